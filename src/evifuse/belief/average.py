"""Rules that average their sources, for evidence that is wrong now and then."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evifuse.belief._joint import joint
from evifuse.belief._sources import checked, merged
from evifuse.belief.combine import Combination, dempster
from evifuse.belief.mass import MassFunction
from evifuse.errors import MassError

__all__ = ["average", "murphy"]

Array = NDArray[np.float64]


def average(many: Iterable[MassFunction], weights: ArrayLike | None = None) -> Combination:
    """Mean of the masses of every set: no source is ruled out, none is confirmed.

    Parameters
    ----------
    many : iterable of MassFunction
        One or more sources over one frame; batch dimensions broadcast. A batch is taken as a list.
    weights : array_like of float, shape (S,) or (S, ...), optional
        How much each of the S sources counts, not negative; divided by their sum. Equal without it.

    Returns
    -------
    Combination
        The mean (Murphy 2000), and the conflict of all sources together. Commutative and idempotent, but not
        associative.

    Raises
    ------
    FrameError
        If the frames differ.
    MassError
        If there are no sources, or the weights don't fit them.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> frame = Frame(["rectangle", "triangle"])
    >>> average([MassFunction.of(frame, {"rectangle": 1.0}), MassFunction.of(frame, {frame: 1.0})]).mass
    MassFunction(rectangle: 0.5, frame: 0.5)
    """
    sources = checked(many)
    mean = _mean(sources, weights)
    return Combination(mean, np.broadcast_to(joint(sources, normalise=False).conflict, mean.batch))


def murphy(many: Iterable[MassFunction], weights: ArrayLike | None = None) -> Combination:
    """Murphy's rule: the average of S sources, combined with itself S - 1 times by Dempster's rule.

    Parameters
    ----------
    many : iterable of MassFunction
        One or more sources over one frame; batch dimensions broadcast. A batch is taken as a list.
    weights : array_like of float, shape (S,) or (S, ...), optional
        How much each of the S sources counts, not negative; divided by their sum. Equal without it.

    Returns
    -------
    Combination
        The combination (Murphy 2000; with weights: Deng and others 2004), and the conflict of all sources
        together. Commutative, but neither associative nor idempotent.

    Raises
    ------
    FrameError
        If the frames differ.
    MassError
        If there are no sources, or the weights don't fit them.
    ConflictError
        If all mass is on the empty set somewhere in the batch.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> frame = Frame(["rectangle", "triangle"])
    >>> murphy([MassFunction.of(frame, {"rectangle": 0.5, frame: 0.5})] * 2).mass
    MassFunction(rectangle: 0.75, frame: 0.25)
    """
    sources = checked(many)
    mean = _mean(sources, weights)
    conflict = np.broadcast_to(joint(sources, normalise=False).conflict, mean.batch)
    if len(sources) == 1:
        return Combination(mean, conflict)
    if mean.layout in ("dense", "singletons"):
        return Combination(joint([mean] * len(sources), normalise=True).mass, conflict)
    return Combination(_power(mean, len(sources)), conflict)


def _power(m: MassFunction, exponent: int) -> MassFunction:
    """A source combined with copies of itself, by squaring: Dempster's rule is associative."""
    result: MassFunction | None = None
    while True:
        if exponent & 1:
            result = m if result is None else dempster(result, m).mass
        exponent >>= 1
        if not exponent and result is not None:
            return result
        m = dempster(m, m).mass


def _mean(sources: list[MassFunction], weights: ArrayLike | None) -> MassFunction:
    frame = sources[0].frame
    shares = _shares(sources, weights)
    layouts = {m.layout for m in sources}
    if layouts == {"singletons"} or "dense" in layouts:
        layout = "singletons" if layouts == {"singletons"} else "dense"
        columns = [m.to(layout) for m in sources]
        total = sum((m.masses * w for m, w in zip(columns, shares, strict=True)), np.zeros(()))
        return MassFunction.trusted(frame, columns[0].focal_sets, np.asarray(total), layout)
    weighted = [m.masses * w for m, w in zip(sources, shares, strict=True)]
    batch = np.broadcast_shapes(*(w.shape[:-1] for w in weighted))
    masses = np.concatenate([np.broadcast_to(w, (*batch, w.shape[-1])) for w in weighted], axis=-1)
    if all(m.focal_sets.ndim == 1 for m in sources):
        sets = np.concatenate([m.focal_sets for m in sources])
    else:
        sets = np.concatenate(
            [np.broadcast_to(m.focal_sets, (*batch, m.focal_sets.shape[-1])) for m in sources], axis=-1
        )
    return MassFunction.trusted(frame, *merged(sets, masses, keep_empty=True))


def _shares(sources: list[MassFunction], weights: ArrayLike | None) -> Array:
    """Weights as shares of 1, shape (S, ..., 1)."""
    count = len(sources)
    if weights is None:
        return np.full((count, 1), 1.0 / count)
    values = np.asarray(weights, dtype=np.float64)
    if values.ndim == 0 or len(values) != count:
        raise MassError(f"{count} sources need weights of shape ({count},), not {values.shape}")
    if not np.all(np.isfinite(values) & (values >= 0)):
        raise MassError(f"weights must be finite and not negative, not {weights!r}")
    total = values.sum(axis=0)
    if not np.all(total > 0):
        raise MassError("all weights are 0: at least one source must count")
    try:
        np.broadcast_shapes(values.shape[1:], *(m.batch for m in sources))
    except ValueError:
        raise MassError(f"weights of shape {values.shape} do not fit the batch of the sources") from None
    return (values / total)[..., None]
