"""What times and poses tell: the rate of samples, where there are none, what is repeated, what is in mm."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["FAST_M_PER_S", "LONGEST_GAP_S", "gaps", "held_to_fresh", "rate_hz", "suspected_millimetres"]

LONGEST_GAP_S = 0.2
"""Poses and joint angles further apart than this are not interpolated; samples further apart are a gap."""

FAST_M_PER_S = 3.0
"""No finger rolls at such a speed: the position is not in metres."""


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
    if not len(steps) or steps.max() <= LONGEST_GAP_S * 1e9:
        return np.zeros(0, dtype=np.int64)
    return np.flatnonzero(steps > max(LONGEST_GAP_S * 1e9, 5 * float(np.median(steps))))


def held_to_fresh(time_ns: NDArray[np.int64], values: NDArray[np.float64]) -> NDArray[np.int64] | None:
    """Samples at which a value that is written again and again until the next comes is fresh.

    Parameters
    ----------
    time_ns : ndarray of int64, shape (P,)
        Times.
    values : ndarray of float64, shape (P, D)
        Values.

    Returns
    -------
    ndarray of int64 or None
        Samples to interpolate between; None if values are not held. Where one is held for longer than usual,
        the finger stood still, and a repeat of it is taken too.
    """
    change = np.flatnonzero((np.diff(values, axis=0) != 0).any(axis=1)) + 1
    if len(change) < 10:
        return None
    steps = np.diff(change)
    step = int(np.median(steps))
    if step < 2 or np.mean(np.abs(steps - step) <= 1) < 0.8:
        return None
    still = change[1:][steps > 2 * step] - step
    first = [0] if change[0] <= 2 * step else [0, int(change[0]) - step]
    last = [len(time_ns) - 1] if len(time_ns) - change[-1] > 2 * step else []
    return np.unique(np.concatenate([first, change, still, last]).astype(np.int64))


def suspected_millimetres(time_ns: NDArray[np.int64], position: NDArray[np.float64]) -> bool:
    """Whether positions move too fast to be in metres.

    Parameters
    ----------
    time_ns : ndarray of int64, shape (P,)
        Times.
    position : ndarray of float64, shape (P, 3)
        Positions, said to be metres.

    Returns
    -------
    bool
        If half of the moving is faster than 3 m/s, over distances that matter.
    """
    if len(time_ns) < 10:
        return False
    seconds = (time_ns - time_ns[0]).astype(np.float64) * 1e-9
    whole = np.isfinite(position).all(axis=1)
    seconds, position = seconds[whole], position[whole]
    if len(seconds) < 10 or float(np.ptp(position, axis=0).max()) < 1:
        return False
    lag = max(1, len(seconds) // 200)  # noise of single samples is not speed
    with np.errstate(over="ignore"):
        step = np.linalg.norm(position[lag:] - position[:-lag], axis=1)
    took = np.maximum(seconds[lag:] - seconds[:-lag], 1e-9)
    speed = step / took
    moving = speed[speed > 0.01 * speed.max()]
    return bool(len(moving)) and float(np.median(moving)) > FAST_M_PER_S
