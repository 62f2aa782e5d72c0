"""Transforms over all subsets, for a batch of rows, compiled by numba on first use and cached on disk.

Every kernel works in place on C-contiguous rows of shape (R, 2^K).
"""

# numba finds the types itself
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUntypedFunctionDecorator=false

import numpy as np

from evifuse.belief._kernels import moebius_down, moebius_up, njit, zeta_down, zeta_up

__all__ = ["differences_down", "differences_up", "hits", "sums_down", "sums_up"]


@njit
def sums_up(rows):
    """Sum over the subsets of each set."""
    for row in range(rows.shape[0]):
        zeta_up(rows[row])


@njit
def sums_down(rows):
    """Sum over the supersets of each set."""
    for row in range(rows.shape[0]):
        zeta_down(rows[row])


@njit
def differences_up(rows):
    """Inverse of `sums_up`."""
    for row in range(rows.shape[0]):
        moebius_up(rows[row])


@njit
def differences_down(rows):
    """Inverse of `sums_down`."""
    for row in range(rows.shape[0]):
        moebius_down(rows[row])


@njit
def hits(rows):
    """Sum over the sets that meet each set, without a subtraction, so that small sums keep their digits.

    With hypothesis i added to the frame, what met A within the smaller frame still does, and all sets that
    hold i (their sum is in ``totals``) meet A and i.
    """
    size = rows.shape[1]
    totals = np.empty(size)
    for row in range(rows.shape[0]):
        met = rows[row]
        totals[:] = met
        met[:] = 0.0
        half = 1
        while half < size:
            for start in range(0, size, 2 * half):
                held = totals[start + half]
                for k in range(start, start + half):
                    without, others = met[k], met[k + half]
                    met[k] = without + others
                    met[k + half] = without + held
                totals[start] += held
            half *= 2
