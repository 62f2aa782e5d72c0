"""Masses from probability intervals: what is known when each probability is only bounded."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evifuse.belief._columns import at_index, columns
from evifuse.belief.frame import Frame
from evifuse.belief.logistic import compact
from evifuse.belief.mass import TOLERANCE, MassFunction, singleton_sets
from evifuse.errors import FrameError, MassError

__all__ = ["INTERVAL_LIMIT", "from_intervals"]

INTERVAL_LIMIT = 10
"""Largest number of hypotheses for which intervals are turned into masses: the work grows as 3^K."""

Array = NDArray[np.float64]


def from_intervals(frame: Frame, lower: ArrayLike, upper: ArrayLike) -> MassFunction:
    """Masses that claim no more than lower and upper probabilities of the hypotheses do.

    The smallest probability of a set is ``P(A) = max(sum of lower in A, 1 - sum of upper outside A)``, once
    each bound is drawn in to what the others leave possible (de Campos, Huete and Moral 1994). Its Moebius
    inverse is taken size by size, the small sets first. Where it would be negative, which can happen from
    three hypotheses on, the masses of the largest subsets are cut back in proportion (our own, after Hall and
    Lawry 2004). So ``bel <= P`` everywhere, and all probabilities within the intervals stay possible.

    Parameters
    ----------
    frame : Frame
        K hypotheses, up to 10, in the order of the columns.
    lower : array_like of float, shape (..., K)
        Lower probabilities in [0, 1].
    upper : array_like of float, shape (..., K)
        Upper probabilities in [0, 1], not below the lower ones.

    Returns
    -------
    MassFunction
        In the smallest layout that holds it.

    Raises
    ------
    FrameError
        If there are more than 10 hypotheses.
    MassError
        If a bound is outside [0, 1] or crossed, or no probability lies within the intervals.

    Examples
    --------
    >>> from_intervals(Frame(["cat", "dog"]), [0.5, 0.125], [0.875, 0.5])
    MassFunction(cat: 0.5, frame: 0.375, dog: 0.125)
    """
    if len(frame) > INTERVAL_LIMIT:
        raise FrameError(f"intervals of {len(frame)} hypotheses are too many: the limit is {INTERVAL_LIMIT}")
    low, high = _reachable(frame, columns(frame, lower, "lower"), columns(frame, upper, "upper"))
    if len(frame) == 1:
        return MassFunction.trusted(frame, singleton_sets(1), np.ones((*low.shape[:-1], 1)), "singletons")
    members = np.arange(frame.full + 1)[:, None] >> np.arange(len(frame)) & 1
    smallest = np.maximum(low @ members.T, 1.0 - high @ (1 - members.T))
    masses = np.zeros_like(smallest)
    sizes = members.sum(axis=1)
    for size in range(1, len(frame) + 1):
        level = np.flatnonzero(sizes == size)
        inside = [np.array([t for t in range(1, s) if t & ~s == 0], dtype=np.intp) for s in level.tolist()]
        kept = np.ones_like(masses)
        for s, subsets in zip(level, inside, strict=True):
            excess = masses[..., subsets].sum(axis=-1) - smallest[..., s]
            if np.any(excess > 0):
                _cut_back(kept, masses, subsets, sizes, np.maximum(excess, 0.0))
        masses *= kept
        for s, subsets in zip(level, inside, strict=True):
            missing = smallest[..., s] - masses[..., subsets].sum(axis=-1)
            masses[..., s] = np.where(missing > 1e-15, missing, 0.0)
    return compact(frame, masses / masses.sum(axis=-1, keepdims=True))


def _reachable(frame: Frame, low: Array, high: Array) -> tuple[Array, Array]:
    """Bounds that some probability within all of them reaches."""
    if low.shape != high.shape:
        raise MassError(f"lower bounds of shape {low.shape} need upper ones of that shape, not {high.shape}")
    crossed = (low < 0) | (high > 1) | (low > high)
    if crossed.any():
        where = np.argwhere(crossed)[0]
        a, b, name = low[tuple(where)], high[tuple(where)], frame.hypotheses[int(where[-1])]
        raise MassError(f"[{a:g}, {b:g}] of {name!r}{at_index(where[:-1])} is not an interval within [0, 1]")
    least, most = low.sum(axis=-1, keepdims=True), high.sum(axis=-1, keepdims=True)
    empty = (least > 1 + TOLERANCE) | (most < 1 - TOLERANCE)
    if empty.any():
        at = at_index(np.argwhere(empty[..., 0])[0])
        raise MassError(
            f"intervals{at} leave no probability: the lower sum exceeds 1 or the upper is below 1"
        )
    drawn_low, drawn_high = np.maximum(low, 1 - (most - high)), np.minimum(high, 1 - (least - low))
    return np.clip(drawn_low, 0, 1), np.clip(np.maximum(drawn_high, drawn_low), 0, 1)


def _cut_back(
    kept: Array, masses: Array, subsets: NDArray[np.intp], sizes: NDArray[np.int64], excess: Array
) -> None:
    """Lower, in place, what is kept of each subset so that ``excess`` goes: from the largest sets first."""
    for size in range(int(sizes[subsets].max()), 0, -1):
        level = subsets[sizes[subsets] == size]
        there = masses[..., level].sum(axis=-1)
        cut = np.minimum(there, excess)
        share = np.where(there > 0, 1.0 - cut / np.where(there > 0, there, 1.0), 1.0)
        kept[..., level] = np.minimum(kept[..., level], share[..., None])
        excess = excess - cut
