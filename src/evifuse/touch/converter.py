"""What an analogue-to-digital converter leaves in pressures: a common top and a step (our own)."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["quantisation_step_pa", "saturation_pa"]

VALUES = 20_000
"""Values that the step is looked for in."""
OFTEN = 10
"""Readings at the very top that saturation needs at least,"""
MORE_OFTEN = 3.0
"""and how many times as many they are as those in the three steps below it."""
EXACT = 3e-7
"""Values that differ by less than this share of the largest are one: files may hold single precision."""

Array = NDArray[np.float64]


def quantisation_step_pa(pressure_pa: Array) -> float:
    """Step of quantised pressures.

    All values are whole multiples of the smallest difference between any two of them.

    Parameters
    ----------
    pressure_pa : ndarray of float64, shape (T, N)
        Pressures, pascals.

    Returns
    -------
    float
        The step, pascals; 0 where there is none to be seen.

    Examples
    --------
    >>> quantisation_step_pa(np.round(np.random.default_rng(0).normal(0, 100, (500, 4))) * 20.0)
    20.0
    """
    flat = pressure_pa.ravel()
    flat = flat[:: max(1, flat.size // (20 * VALUES))]
    flat = flat[flat != 0]
    flat = flat[:: max(1, flat.size // VALUES)]
    values = np.unique(flat)
    if len(values) < 3 or len(values) > 0.6 * len(flat):
        return 0.0
    exact = EXACT * float(np.abs(values[[0, -1]]).max())
    apart = np.diff(values)
    apart = apart[apart > exact]
    step = float(apart.min(initial=np.inf))
    if len(apart) < 2 or step < 30 * exact:
        return 0.0
    many = np.round(apart / step)
    step = float(apart.sum() / many.sum())
    off = np.abs(apart - many * step)
    return step if float(np.mean(off < 0.02 * step + 2 * exact)) > 0.97 else 0.0


def saturation_pa(pressure_pa: Array) -> float:
    """Common top at which pressures are clipped.

    Clipped readings pile up at exactly one value, with few just below it.

    Parameters
    ----------
    pressure_pa : ndarray of float64, shape (T, N)
        Pressures, pascals.

    Returns
    -------
    float
        The top, pascals; infinity where nothing is clipped.
    """
    top = float(pressure_pa.max(initial=0.0))
    if top <= 0:
        return np.inf
    high = pressure_pa[pressure_pa > 0.9 * top]
    at_top = int((high >= top * (1 - EXACT)).sum())
    step = quantisation_step_pa(pressure_pa)
    below = int((high >= top - max(3.5 * step, 0.01 * top)).sum()) - at_top
    return top * (1 - EXACT) if at_top >= OFTEN and at_top > MORE_OFTEN * below else np.inf
