"""Clusters of belief functions by the divergence of appendix A.6, and the prototypes that stand for them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from evifuse.belief import MassFunction
from evifuse.conductivity.entropy import divergence
from evifuse.conductivity.reading import Reading

__all__ = ["SMALLEST", "prototype_of", "prototypes_of", "weighed"]

Array = NDArray[np.float64]

SMALLEST = 0.001
"""Less than this mass of a prototype is left to the frame, so that a person can read it."""

FLOOR = 0.005
DIGITS = 4
STEPS = 20


def weighed(y: MassFunction, reading: Reading) -> tuple[MassFunction, Array]:
    """Evidence as it meets the prototypes under a reading, and how much each case counts.

    Parameters
    ----------
    y : MassFunction
        N cases in the layout ``shared``.
    reading : Reading
        With a nominal commitment, evidence is brought to it, and counts as much as it really commits.

    Returns
    -------
    met : MassFunction
        The N cases, the frame among the focal sets.
    weights : ndarray of float64, shape (N,)
        In [0, 1].
    """
    off = (y.focal_sets != y.frame.full) & (y.focal_sets != 0)
    sets = np.append(y.focal_sets[off], np.int64(y.frame.full))
    masses, ones = y.on(sets), np.ones(len(y))
    if reading.commitment is None or len(sets) == 1:
        return MassFunction.trusted(y.frame, sets, masses), ones
    weights = masses[:, :-1].sum(axis=1)
    crumbs = masses[:, :-1] < reading.negligible * weights[:, None]
    kept = np.where(crumbs, 0.0, masses[:, :-1])
    total = kept.sum(axis=1, keepdims=True)
    some = total > 0
    kept *= np.where(some, reading.commitment / np.where(some, total, 1.0), 0.0)
    rest = np.where(some, 1.0 - reading.commitment, 1.0)
    return MassFunction.trusted(y.frame, sets, np.concatenate([kept, rest], axis=1)), weights


def prototypes_of(
    met: MassFunction, weights: Array, count: int, reading: Reading, rng: np.random.Generator
) -> list[MassFunction]:
    """Prototypes of one class: cases go to the prototype they diverge least from, until nothing moves.

    Parameters
    ----------
    met : MassFunction
        The N cases of the class, as `weighed` gives them.
    weights : ndarray of float64, shape (N,)
        How much each case counts.
    count : int
        Number of prototypes wanted; there are fewer if the cases are not so different.
    reading : Reading
        Form of the divergence.
    rng : numpy.random.Generator
        Draws the cases to begin with, the likelier the farther from those drawn before.

    Returns
    -------
    list of MassFunction
        From the most cases to the fewest.
    """
    if count == 1 or len(met) < 2:
        return [prototype_of(met, weights)]
    nearest = _divergences(met, [_case(met, int(rng.integers(len(met))))], reading)
    starts: list[MassFunction] = []
    for _ in range(count):
        chances = weights * nearest.min(axis=1)
        if not chances.sum() > 0:
            break
        drawn = int(rng.choice(len(met), p=chances / chances.sum()))
        starts.append(_case(met, drawn))
        nearest = np.concatenate(
            [nearest if len(starts) > 1 else nearest[:, :0], _divergences(met, starts[-1:], reading)], axis=1
        )
    if len(starts) < 2:
        return [prototype_of(met, weights)]
    owner = nearest.argmin(axis=1)
    current: list[MassFunction] = []
    for _ in range(STEPS):
        own = [np.flatnonzero((owner == i) & (weights > 0)) for i in range(int(owner.max()) + 1)]
        own = sorted((o for o in own if len(o)), key=lambda o: (-weights[o].sum(), int(o[0])))
        current = [prototype_of(met[o], weights[o]) for o in own]
        moved = _divergences(met, current, reading).argmin(axis=1)
        if np.array_equal(moved, owner):
            break
        owner = moved
    return list({tuple(x.as_dict().items()): x for x in current}.values())


def prototype_of(met: MassFunction, weights: Array) -> MassFunction:
    """What a cluster of cases has in common: mean masses, and a residual on the frame.

    Frequencies of occurrence (section 3.3); the residual of 1 / (n + 1) for n cases is our own, so that few
    cases commit to less.

    Parameters
    ----------
    met : MassFunction
        The N cases, the frame the last of their focal sets.
    weights : ndarray of float64, shape (N,)
        How much each case counts.

    Returns
    -------
    MassFunction
        Positive masses of four decimals; the frame alone if no case counts.
    """
    total = float(weights.sum())
    means = (weights @ met.masses[:, :-1]) / (total + 1.0)
    rounded = np.round(np.maximum(means, FLOOR), DIGITS)
    rest = round(1.0 - float(rounded.sum()), DIGITS)
    masses = np.append(rounded, rest)
    keep = masses > 0
    return MassFunction(met.frame, met.focal_sets[keep], masses[keep])


def _case(met: MassFunction, index: int) -> MassFunction:
    """One case as a prototype to begin with."""
    keep = met.masses[index] > 0
    return MassFunction.trusted(met.frame, met.focal_sets[keep], met.masses[index][keep])


def _divergences(met: MassFunction, prototypes: Sequence[MassFunction], reading: Reading) -> Array:
    """Divergence of every case from every prototype, in groups of equal focal sets."""
    plain = replace(reading, commitment=None)
    patterns, group = np.unique(met.masses > 0, axis=0, return_inverse=True)
    out = np.empty((len(met), len(prototypes)))
    for g, present in enumerate(patterns):
        rows = np.flatnonzero(group.ravel() == g)
        part = MassFunction.trusted(met.frame, met.focal_sets[present], met.masses[np.ix_(rows, present)])
        for i, x in enumerate(prototypes):
            out[rows, i] = divergence(part, x, plain)
    return out
