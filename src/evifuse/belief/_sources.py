"""What the rules for many sources share: the door, and the sum of masses of equal sets."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.belief.combine import aligned
from evifuse.belief.mass import MassFunction
from evifuse.errors import MassError

__all__ = ["checked", "merged", "spread"]

Array = NDArray[np.float64]
Sets = NDArray[np.int64]


def checked(many: Iterable[Any]) -> list[MassFunction]:
    """Sources over the frame of the first, with batch dimensions that broadcast; a batch is taken apart."""
    if isinstance(many, MassFunction) and not many.batch:
        raise MassError("one mass function is not a list of sources; put it in a list")
    sources: list[Any] = list(many)
    if not sources:
        raise MassError("nothing to combine: give at least one source")
    batch: tuple[int, ...] = ()
    for i, m in enumerate(sources):
        if not isinstance(m, MassFunction):
            raise MassError(f"source {i} is a {type(m).__name__}, not a MassFunction")
        try:
            batch = np.broadcast_shapes(batch, m.batch)
        except ValueError:
            raise MassError(f"source {i} has batch {m.batch}, but those before it have {batch}") from None
    return [aligned(sources[0], m) for m in sources]


def merged(sets: Sets, masses: Array, *, keep_empty: bool = False) -> tuple[Sets, Array]:
    """Focal sets without repetition, and the sums of their masses.

    Parameters
    ----------
    sets : ndarray of int64, shape (F,) or (..., F)
        Bitmasks, in which equal ones may occur.
    masses : ndarray of float64, shape (..., F)
        Their masses.
    keep_empty : bool
        Keep the mass of the empty set; it is left out otherwise.

    Returns
    -------
    sets : ndarray of int64, shape (G,) or (..., G)
        In increasing order; of the shape (G,) if they were given so.
    masses : ndarray of float64, shape (..., G)
        The sums.
    """
    if sets.ndim == 1:
        order = np.argsort(sets, kind="stable")
        ranked = sets[order]
        starts = np.flatnonzero(np.concatenate([[True], ranked[1:] != ranked[:-1]]))
        sums = np.add.reduceat(masses[..., order], starts, axis=-1)
        found = ranked[starts]
        kept = found != 0
        return (found, sums) if keep_empty or kept.all() else (found[kept], sums[..., kept])
    width = sets.shape[-1]
    flat = np.where((masses > 0) & ((sets != 0) | keep_empty), sets, -1).reshape(-1, width)
    order = np.argsort(-flat, axis=-1, kind="stable")  # what does not count comes last
    ranked = np.take_along_axis(flat, order, axis=-1)
    values = np.take_along_axis(masses.reshape(-1, width), order, axis=-1)
    first = np.concatenate([np.ones((len(ranked), 1), bool), ranked[:, 1:] != ranked[:, :-1]], axis=-1)
    place = np.cumsum(first, axis=-1) - 1
    counts = ranked >= 0
    size = max(1, int(place[counts].max(initial=0)) + 1)
    out_sets, out_masses = np.zeros((len(flat), size), np.int64), np.zeros((len(flat), size))
    rows = np.broadcast_to(np.arange(len(flat))[:, None], place.shape)
    out_sets[rows[counts], place[counts]] = ranked[counts]
    np.add.at(out_masses, (rows[counts], place[counts]), values[counts])
    shape = (*masses.shape[:-1], size)
    return out_sets.reshape(shape), out_masses.reshape(shape)


def spread(sources: list[MassFunction]) -> tuple[tuple[int, ...], list[Sets], list[Array]]:
    """Batch shape of many sources, and the sets and masses of each in that shape (views)."""
    batch = np.broadcast_shapes(*(m.batch for m in sources))
    sets = [np.broadcast_to(m.focal_sets, (*batch, m.masses.shape[-1])) for m in sources]
    return batch, sets, [np.broadcast_to(m.masses, (*batch, m.masses.shape[-1])) for m in sources]
