"""Fractal-based belief entropy: mass handed down to all subsets."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from evifuse.belief._sums import checked, cross_entropy, subset_counts, sums_over, total
from evifuse.belief.mass import MassFunction
from evifuse.errors import MassError

__all__ = ["fractal_belief_entropy"]

Array = NDArray[np.float64]

LAID_OUT = 12
"""Up to so many hypotheses the fractal-based entropy lays out all subsets, whatever the layout."""

TABLE_SIZE = 1 << 20
"""How many masses it lays out at a time."""

CLOSURE_LIMIT = 1 << 12
"""Most intersections of focal sets that it follows in larger frames."""


def fractal_belief_entropy(m: MassFunction, base: float = 2.0) -> Array:
    """Fractal-based belief entropy: every focal set shares its mass among its subsets (Zhou and Deng 2022).

    It is Shannon's entropy of ``m_F(A) = sum over B that hold A of m(B) / (2^|B| - 1)``, over all
    non-empty A.

    Parameters
    ----------
    m : MassFunction
        Masses, batch shape ``(...)``.
    base : float
        Base of the logarithm.

    Returns
    -------
    ndarray of float64, shape (...)
        Shannon's entropy for a probability, at most ``log(2^K - 1)``, for total ignorance over K hypotheses.

    Raises
    ------
    MassError
        If the empty set carries mass, the base is not a positive number other than 1, or a large frame's
        focal sets have more than 4096 different intersections.

    Notes
    -----
    Up to 12 hypotheses, and in the dense layout, ``m_F`` is laid out over all subsets. In larger frames all
    sets whose smallest enclosing intersection of focal sets is the same have equal ``m_F``, and are counted
    (our own way).
    """
    _, scale = checked(m, base)
    if m.layout != "dense" and len(m.frame) > LAID_OUT:
        if m.focal_sets.ndim == 1:
            return np.asarray(_by_closure(m) / scale)
        rows = _flat(m)
        each = [_by_closure(row.to("padded").to("shared")) for row in rows]
        return np.asarray(np.array(each).reshape(m.batch) / scale)
    if not m.batch:
        return np.asarray(_by_table(m) / scale)
    rows, step = _flat(m), max(1, TABLE_SIZE >> len(m.frame))
    parts = [_by_table(rows[i : i + step]) for i in range(0, len(rows), step)]
    return np.asarray(np.concatenate([*parts, np.empty(0)]).reshape(m.batch) / scale)


def _flat(m: MassFunction) -> MassFunction:
    """A batch with a single dimension."""
    masses = m.masses.reshape(-1, m.masses.shape[-1])
    sets = m.focal_sets if m.focal_sets.ndim == 1 else m.focal_sets.reshape(masses.shape)
    return MassFunction.trusted(m.frame, sets, masses, m.layout)


def _by_table(m: MassFunction) -> Array:
    """Natural fractal-based belief entropy, over all subsets."""
    m = m.to("dense")
    shares = sums_over(m.masses / subset_counts(m), upward=False)[..., 1:]
    return cross_entropy(shares, shares)


def _by_closure(m: MassFunction) -> Array:
    """Natural fractal-based belief entropy of masses over shared focal sets."""
    sets, counts = _cells(tuple(int(s) for s in m.focal_sets if s))
    shares = np.zeros((*m.batch, len(sets)))
    each = m.masses / subset_counts(m)
    for i, s in enumerate(m.focal_sets):
        shares += np.where(sets & ~s == 0, each[..., i, None] if s else 0.0, 0.0)
    logs = np.log(np.where(shares > 0, shares, 1.0))
    return np.asarray(np.maximum(-total(counts * shares * logs), 0.0))


@lru_cache(maxsize=64)
def _cells(focal_sets: tuple[int, ...]) -> tuple[NDArray[np.int64], Array]:
    """All intersections of focal sets, and how many non-empty sets each is the smallest to hold."""
    closed: set[int] = set()
    for s in focal_sets:
        closed |= {s & t for t in closed} | {s}
        if len(closed) > CLOSURE_LIMIT:
            raise MassError(
                f"{len(focal_sets)} focal sets have over {CLOSURE_LIMIT} intersections: "
                "use the dense layout, or a coarser frame"
            )
    ordered = sorted((s for s in closed if s), key=int.bit_count)
    counts: dict[int, int] = {}
    for s in ordered:
        counts[s] = (1 << s.bit_count()) - 1 - sum(n for t, n in counts.items() if t & ~s == 0)
    return np.array(ordered, dtype=np.int64), np.array([float(counts[s]) for s in ordered])
