"""What times alone tell: the rate of samples, and where there are none."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["LONGEST_GAP_S", "gaps", "rate_hz"]

LONGEST_GAP_S = 0.2
"""Poses and joint angles further apart than this are not interpolated; samples further apart are a gap."""


def rate_hz(time_ns: NDArray[np.int64]) -> float:
    """Rate of samples.

    Parameters
    ----------
    time_ns : ndarray of int64, shape (T,)
        Increasing times, nanoseconds.

    Returns
    -------
    float
        Samples per second, from the median step; 0 for fewer than two samples.

    Examples
    --------
    >>> rate_hz(np.array([0, 1_000_000, 2_000_000]))
    1000.0
    """
    steps = np.diff(time_ns)
    steps = steps[steps > 0]
    return 1e9 / float(np.median(steps)) if len(steps) else 0.0


def gaps(time_ns: NDArray[np.int64]) -> NDArray[np.int64]:
    """Where samples are missing.

    Parameters
    ----------
    time_ns : ndarray of int64, shape (T,)
        Increasing times, nanoseconds.

    Returns
    -------
    ndarray of int64
        The last sample before each gap: a step of more than `LONGEST_GAP_S` and of five usual steps.

    Examples
    --------
    >>> gaps(np.array([0, 10, 20, 3020, 3030]) * 1_000_000)
    array([2])
    """
    steps = np.diff(time_ns)
    if not len(steps):
        return np.zeros(0, dtype=np.int64)
    return np.flatnonzero(steps > max(LONGEST_GAP_S * 1e9, 5 * float(np.median(steps))))
