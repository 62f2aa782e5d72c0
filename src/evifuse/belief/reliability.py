"""How far each of several sources can be trusted, judged by how much it disagrees with the others."""

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from evifuse.belief._sources import checked
from evifuse.belief.distance import jousselme
from evifuse.belief.mass import MassFunction
from evifuse.errors import MassError

__all__ = ["Distance", "disagreement", "reliability_from_disagreement"]

Array = NDArray[np.float64]
Distance = Callable[[MassFunction, MassFunction], Array]
"""A distance of two mass functions in [0, 1], such as `jousselme`."""


def disagreement(
    sources: Iterable[MassFunction], *, distance: Distance = jousselme, by_case: bool = False
) -> Array:
    """Mean distance of each source to the others (Martin, Jousselme and Osswald 2008).

    Parameters
    ----------
    sources : iterable of MassFunction
        S of them, two at least, over the same frame; case i of each batch ``(...)`` speaks of the same thing.
    distance : callable
        Takes two mass functions to distances in [0, 1] of their batch shape, Jousselme's without it.
    by_case : bool
        Judge every case for itself. Without it a source is judged by the mean over all its cases, which tells
        a broken source from one that happens to be right against the others.

    Returns
    -------
    ndarray of float64, shape (S,), or (S, ...) by case
        Disagreement in [0, 1]: 0 if all say the same.

    Raises
    ------
    FrameError
        If the frames differ.
    MassError
        If there are fewer than two sources, there is no case, or batches don't broadcast.
    """
    given = checked(sources)
    if len(given) < 2:
        raise MassError("one source alone agrees with itself: disagreement needs two sources at least")
    batch = np.broadcast_shapes(*(m.batch for m in given))
    if 0 in batch:
        raise MassError(f"disagreement needs at least one case, not a batch of shape {batch}")
    sums = np.zeros((len(given), *(batch if by_case else ())))
    for i, a in enumerate(given):
        for j in range(i):
            apart = np.broadcast_to(distance(a, given[j]), batch)
            sums[[i, j]] += apart if by_case else apart.mean()
    return sums / (len(given) - 1)


def reliability_from_disagreement(
    sources: Iterable[MassFunction],
    *,
    exponent: float = 1.5,
    distance: Distance = jousselme,
    by_case: bool = False,
) -> Array:
    """Reliability of each source: ``(1 - c^λ)^(1/λ)`` of its disagreement c (Martin et al. 2008).

    No labels are needed, but the majority is taken to be right: of two sources that disagree both are equally
    suspect, and a majority that errs together passes for reliable. With labelled cases use
    `fit_reliabilities`.

    Parameters
    ----------
    sources : iterable of MassFunction
        S of them, two at least, over the same frame; case i of each batch ``(...)`` speaks of the same thing.
    exponent : float
        The λ of the source, positive: the larger, the more disagreement is forgiven. 1 gives 1 - c.
    distance : callable
        Takes two mass functions to distances in [0, 1] of their batch shape, Jousselme's without it.
    by_case : bool
        Judge every case for itself, not each source by all its cases.

    Returns
    -------
    ndarray of float64, shape (S,), or (S, ...) by case
        Reliabilities in [0, 1], in the order of the sources, for ``discount(m, reliability=)``.

    Raises
    ------
    FrameError
        If the frames differ.
    MassError
        If there are fewer than two sources, there is no case, batches don't broadcast, or the exponent is not
        positive.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> frame = Frame(["rain", "sun"])
    >>> sun, rain = MassFunction.of(frame, {"sun": 1.0}), MassFunction.of(frame, {"rain": 1.0})
    >>> reliability_from_disagreement([sun, sun, sun, rain], exponent=1.0).round(2).tolist()
    [0.67, 0.67, 0.67, 0.0]
    """
    if not 0 < exponent < np.inf:
        raise MassError(f"the exponent must be a positive number, not {exponent!r}")
    apart = np.clip(disagreement(sources, distance=distance, by_case=by_case), 0.0, 1.0)
    return (1.0 - apart**exponent) ** (1.0 / exponent)
