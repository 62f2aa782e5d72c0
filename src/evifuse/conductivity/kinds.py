"""Prototypes from the kinds of evidence that occur most, where focal sets differ from case to case.

The mean of such cases has every set that any of them has, and resembles none. So the cases of a class are
sorted by which sets carry mass, and the kinds that conduct the class best stand for it, each with its mean
masses. Our own, after "frequency of occurrence" (section 3.3).
"""

import numpy as np
from numpy.typing import NDArray

from evifuse.belief import MassFunction
from evifuse.conductivity.aggregate import Aggregate, KnowledgeBase
from evifuse.conductivity.clusters import DIGITS, Met, rounded
from evifuse.conductivity.compiled import compile  # noqa: A004

__all__ = ["best_of_each", "dimensions", "typical"]

Array = NDArray[np.float64]

LOOKED_AT = 12
"""So many kinds, the most frequent ones, may become prototypes."""

LAYERED = 32.0
"""Power of the interaction dimensions that are summed: as behind so many layers, only near cases count."""


def typical(met: Met, others: Met, counts: range) -> list[Array]:
    """Prototypes of one class, for each of the numbers that are asked for.

    The first is the kind into which the cases of the class conduct best, through many layers, compared with
    those of other classes; each further one is the kind that adds most to that difference.

    Parameters
    ----------
    met : Met
        The N cases of the class.
    others : Met
        The cases of all other classes.
    counts : range
        Numbers of prototypes: 1, 2, ...

    Returns
    -------
    list of ndarray of float64, shape (P, F)
        Masses over ``met.focal_sets``; 0 on sets that are none of the kind's.
    """
    kinds = sorted(met.patterns, key=lambda p: (-met.weights[p.rows].sum(), int(p.rows[0])))[:LOOKED_AT]
    candidates = np.unique([_mean(met, p.rows) for p in kinds], axis=0)
    own, foreign = (_Conducted(m, candidates) for m in (met, others))
    chosen: list[int] = []
    while len(chosen) < min(counts[-1], len(candidates)):
        gains = own.gains() - foreign.gains()
        gains[chosen] = -np.inf
        chosen.append(int(gains.argmax()))
        own.take(chosen[-1])
        foreign.take(chosen[-1])
    return [candidates[chosen[:count]] for count in counts]


class _Conducted:
    """How well cases conduct into the best of the kinds that were taken."""

    def __init__(self, met: Met, candidates: Array) -> None:
        self.share = met.weights / max(float(met.weights.sum()), 1e-12)
        self.near = dimensions(met, candidates) ** LAYERED
        self.best = np.zeros(len(self.near))

    def gains(self) -> Array:
        return self.share @ (np.maximum(self.near, self.best[:, None]) - self.best[:, None])

    def take(self, kind: int) -> None:
        self.best = np.maximum(self.best, self.near[:, kind])


def dimensions(met: Met, prototypes: Array) -> Array:
    """Interaction dimension of every case with every prototype (A.5).

    Parameters
    ----------
    met : Met
        N cases.
    prototypes : ndarray of float64, shape (P, F)
        Masses over ``met.focal_sets``, 0 where a prototype has no such set.

    Returns
    -------
    ndarray of float64, shape (N, P)
        In (0, 1].
    """
    each = {
        str(i): MassFunction(met.frame, met.focal_sets[x > 0], x[x > 0]) for i, x in enumerate(prototypes)
    }
    base = KnowledgeBase("", met.frame, (Aggregate("", each),), met.reading)
    return compile(base, met.focal_sets).interaction_dimensions(met.masses)


def best_of_each(met: Met, choices: list[Array]) -> Array:
    """Interaction dimension of every case with the nearest prototype of every choice.

    Parameters
    ----------
    met : Met
        N cases.
    choices : list of ndarray of float64, shape (P, F)
        Prototypes, each choice beginning with those of the one before.

    Returns
    -------
    ndarray of float64, shape (N, number of choices)
        In (0, 1].
    """
    found = np.maximum.accumulate(dimensions(met, choices[-1]), axis=1)
    return found[:, [len(choice) - 1 for choice in choices]]


def _mean(met: Met, rows: NDArray[np.intp]) -> Array:
    """Mean masses of cases of one kind, with a residual of 1 / (n + 1) on the frame for n cases."""
    weights = met.weights[rows]
    means = (weights @ met.masses[rows]) / (weights.sum() + 1.0)
    means[-1] += 1.0 / (weights.sum() + 1.0)
    return rounded(means, DIGITS)
