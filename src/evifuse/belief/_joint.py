"""The conjunctive combination of any number of sources, by the way that suits them, without underflow.

A thousand sources that contradict each other leave products far below the smallest number, and which set is
the least impossible shows only at the end. So a power of two is kept beside a mass
wherever products might be too small.
"""

from collections.abc import Sequence
from functools import cache, reduce
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.belief._lattice import noise, swept
from evifuse.belief._sources import spread
from evifuse.belief.combine import Combination, conjunctive, dempster
from evifuse.belief.mass import MassFunction, every_set
from evifuse.errors import ConflictError, MassError

__all__ = ["joint", "loops"]

Array = NDArray[np.float64]
Powers = NDArray[np.int64]

SMALLEST_LOG = -600.0
"""Products above exp(-600) are multiplied as they are."""

LOWEST = -1100
"""Two to this power is 0 as a number."""

NEVER = np.iinfo(np.int64).min // 2
"""The power of two that stands for a mass of 0."""

SMALL_FRAME = 12
"""Up to so many hypotheses all subsets are few."""

PAIR = 10
"""One pair of focal sets with its power of two takes as long as so many additions of a sweep."""

MOST_SETS = 1 << 24
"""So many masses, with their sets and powers, are half a gigabyte."""

RESIDUE = 1e-14
"""What the sum of masses may lack to 1 through rounding."""


@cache
def loops() -> Any:
    """The compiled loops; numba is imported on the first use, not before."""
    return import_module("evifuse.belief._kernels_many")


def joint(sources: Sequence[MassFunction], *, normalise: bool) -> Combination:
    """All sources are right: the product of their commonalities.

    Parameters
    ----------
    sources : sequence of MassFunction
        One or more, over one frame; batch dimensions broadcast.
    normalise : bool
        Scale the non-empty sets to 1 (Dempster's rule); otherwise the empty set keeps the conflict.

    Returns
    -------
    Combination
        The combination and its conflict: the mass of the empty set before it is scaled away.

    Raises
    ------
    ConflictError
        If it is to be scaled and the sources contradict each other totally somewhere in the batch.
    """
    layouts = {m.layout for m in sources}
    if len(sources) == 2 and "dense" not in layouts:
        two = (dempster if normalise else conjunctive)(*sources)
        if np.all(two.conflict < 1.0):
            return two
    if layouts == {"singletons"}:
        return _singletons(sources, normalise)
    if "dense" in layouts:
        return _dense(sources, normalise)
    least = sum(
        float(np.log(np.min(m.masses, where=m.masses > 0, initial=1.0))) for m in sources if m.masses.size
    )
    if least < SMALLEST_LOG:
        if _lattice_is_faster(sources):
            joined = _dense(sources, normalise)
            return Combination(joined.mass.to("padded").tidy(), joined.conflict)
        return _scaled_pairs(sources, normalise)
    product = reduce(_pair, sources)
    empty = product.focal_sets == 0
    conflict = product.where(empty)
    return _scaled(product, conflict) if normalise else Combination(product, conflict)


def _lattice_is_faster(sources: Sequence[MassFunction]) -> bool:
    """Whether pairs of focal sets are more work than sweeps over a small lattice of all subsets."""
    count = len(sources[0].frame)
    if count > SMALL_FRAME:
        return False
    met, pairs = 1, 0
    for m in sources:
        pairs += met * m.masses.shape[-1]
        met = min(met * m.masses.shape[-1], 1 << count)
    return PAIR * pairs > len(sources) * count << count


def _pair(a: MassFunction, b: MassFunction) -> MassFunction:
    rows = int(np.prod(np.broadcast_shapes(a.batch, b.batch)))
    _room(rows, a.masses.shape[-1] * b.masses.shape[-1], a)
    return conjunctive(a, b).mass


def _room(rows: int, pairs: int, m: MassFunction) -> int:
    """How many intersections to expect; far too many are refused before memory runs out."""
    size = min(pairs, 1 << min(len(m.frame), 40))
    if rows * size > MOST_SETS:
        raise MassError(
            f"the sources have {pairs} intersections in each of {rows} cases, more than fit: combine fewer "
            "at a time, or use a coarser frame"
        )
    return size


def _scaled(product: MassFunction, conflict: Array) -> Combination:
    """The non-empty sets of a combination, divided by the sum of their masses."""
    sets, masses = product.focal_sets, product.masses
    if sets.ndim == 1 and product.layout != "dense":
        kept = sets != 0
        sets, masses = sets[kept], masses[..., kept]
    else:
        masses = np.where(sets != 0, masses, 0.0)
    total = masses.sum(axis=-1, keepdims=True)
    refuse_total_conflict(total[..., 0] > 0)
    return Combination(MassFunction.trusted(product.frame, sets, masses / total, product.layout), conflict)


def refuse_total_conflict(possible: NDArray[np.bool_]) -> None:
    """Refuse a batch in which nothing is left of a case."""
    bad = np.argwhere(~possible)
    if len(bad):
        at = f" at index {tuple(bad[0].tolist())}" if possible.ndim else ""
        raise ConflictError(
            f"total conflict{at}: the sources leave no set possible together; discount them first"
        )


def _singletons(sources: Sequence[MassFunction], normalise: bool) -> Combination:
    """Closed form over single hypotheses and the frame: the plausibility of a hypothesis is a product."""
    frame = sources[0].frame
    batch = np.broadcast_shapes(*(m.batch for m in sources))
    if len(frame) == 1:
        certain = MassFunction.trusted(frame, sources[0].focal_sets, np.ones((*batch, 1)), "singletons")
        return Combination(certain, np.zeros(batch))
    plausible, likely = _product([m.masses[..., :-1] + m.masses[..., -1:] for m in sources], batch)
    unknown, powers = _product([m.masses[..., -1:] for m in sources], batch)
    ratio = np.zeros(plausible.shape)  # ln(plausible / unknown) without a quotient of tiny numbers
    with np.errstate(divide="ignore", invalid="ignore"):
        for m in sources:
            single, rest = m.masses[..., :-1], m.masses[..., -1:]
            ratio += np.where(rest > 0, np.log1p(single / rest), np.inf)
    parts = np.concatenate([-plausible * np.expm1(-ratio), unknown], axis=-1)
    powers = np.concatenate([likely, powers], axis=-1)
    rest = 1.0 - np.ldexp(parts, np.maximum(powers, LOWEST)).sum(axis=-1)
    rest = np.where(rest < RESIDUE, 0.0, rest)
    if normalise:
        return Combination(
            MassFunction.trusted(frame, sources[0].focal_sets, _relative(parts, powers), "singletons"), rest
        )
    sets = np.append(sources[0].focal_sets, np.int64(0))
    masses = np.concatenate([np.ldexp(parts, np.maximum(powers, LOWEST)), rest[..., None]], axis=-1)
    return Combination(MassFunction.trusted(frame, sets, masses, "shared"), rest)


def _dense(sources: Sequence[MassFunction], normalise: bool) -> Combination:
    """Commonalities multiply; masses follow relative to the most plausible hypothesis."""
    frame = sources[0].frame
    batch = np.broadcast_shapes(*(m.batch for m in sources))
    parts, powers = _product([swept("sums_down", m.to("dense").masses) for m in sources], batch)
    singles = np.int64(1) << np.arange(len(frame))
    top = np.where(parts[..., singles] > 0, powers[..., singles], NEVER).max(axis=-1, keepdims=True)
    if normalise:
        refuse_total_conflict(top[..., 0] > NEVER)
    top = np.where(top > NEVER, top, 0)
    q = np.ldexp(parts, np.clip(powers - top, LOWEST, 0))
    q[..., 0] = 0.0  # changes no mass but that of the empty set
    masses = swept("differences_down", q)
    masses[masses <= noise("sums_down", q * (1.0 + len(sources) ** 0.5))] = 0.0
    masses[..., 0] = 0.0
    total = masses.sum(axis=-1, keepdims=True)
    conflict = 1.0 - np.ldexp(total, np.maximum(top, LOWEST))
    conflict[conflict < RESIDUE] = 0.0
    if normalise:
        masses /= total
    else:
        masses = np.ldexp(masses, np.maximum(top, LOWEST))
        masses[..., :1] = conflict
    return Combination(
        MassFunction.trusted(frame, every_set(len(frame)), masses, "dense"), conflict[..., 0].copy()
    )


def _scaled_pairs(sources: Sequence[MassFunction], normalise: bool) -> Combination:
    """Pairs of focal sets, one source after the other, with a power of two beside every mass."""
    frame = sources[0].frame
    batch, all_sets, all_masses = spread(list(sources))
    rows = int(np.prod(batch))
    sets, parts = np.full((rows, 1), frame.full, dtype=np.int64), np.ones((rows, 1))
    powers = np.zeros((rows, 1), dtype=np.int64)
    for more_sets, more_masses in zip(all_sets, all_masses, strict=True):
        width = more_masses.shape[-1]
        others = np.ascontiguousarray(more_sets).reshape(rows, width)
        more, exponents = np.frexp(np.ascontiguousarray(more_masses).reshape(rows, width))
        shape = (rows, _room(rows, sets.shape[1] * width, sources[0]))
        out = np.zeros(shape, np.int64), np.zeros(shape), np.zeros(shape, np.int64)
        counts = loops().scaled_intersections(
            sets, parts, powers, others, more, exponents.astype(np.int64), *out
        )
        most = int(counts.max(initial=1))
        sets, parts, powers = out[0][:, :most].copy(), out[1][:, :most].copy(), out[2][:, :most].copy()
    shape = (*batch, sets.shape[-1])
    sets, parts, powers = sets.reshape(shape), parts.reshape(shape), powers.reshape(shape)
    values = np.ldexp(parts, np.maximum(powers, LOWEST))
    conflict = np.minimum(np.where(sets == 0, values, 0.0).sum(axis=-1), 1.0)
    if normalise:
        values = _relative(np.where(sets == 0, 0.0, parts), powers)
    return Combination(MassFunction.trusted(frame, sets, values).tidy(), conflict)


def _product(factors: Sequence[Array], batch: tuple[int, ...]) -> tuple[Array, Powers]:
    """Product of arrays as parts in [0.5, 1), or 0, and powers of two."""
    shape = (*batch, factors[0].shape[-1])
    parts, powers = np.ones(shape), np.zeros(shape, dtype=np.int64)
    for factor in factors:
        part, power = np.frexp(factor)
        parts *= part
        powers += power
        parts, power = np.frexp(parts)
        powers += power
    return parts, powers


def _relative(parts: Array, powers: Powers) -> Array:
    """Masses scaled to 1 along the last axis."""
    top = np.where(parts > 0, powers, NEVER).max(axis=-1, keepdims=True)
    refuse_total_conflict(top[..., 0] > NEVER)
    masses = np.ldexp(parts, np.clip(powers - top, LOWEST, 0))
    return masses / masses.sum(axis=-1, keepdims=True)
