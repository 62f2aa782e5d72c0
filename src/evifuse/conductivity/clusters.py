"""Clusters of belief functions by the divergence of appendix A.6, and the prototypes that stand for them.

While it is learned, a prototype is a row of positive masses over the focal sets that occur in the evidence.
Every divergence is then linear in the masses of the evidence, in their logarithms, and in their products.
"""

from dataclasses import dataclass, replace
from math import log as natural_log
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.belief import Frame, MassFunction
from evifuse.conductivity.classify import at_commitment
from evifuse.conductivity.entropy import TIE, inner_entropy, similarity
from evifuse.conductivity.reading import Reading

__all__ = ["Met", "clustered", "divergences", "meet"]

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

FLOOR = 0.005
"""Least mass of a focal set that occurs at all: without mass it would not be focal, and crumbs diverge."""

MANY = 50
"""With more focal sets than this their masses need more decimals."""

DIGITS = 4
STEPS = 20


@dataclass(frozen=True, eq=False)
class Pattern:
    """Cases in which the same focal sets carry mass.

    Parameters
    ----------
    rows : ndarray of int, shape (n,)
        Which cases.
    matched : ndarray of float64, shape (G, F)
        Takes the masses of a prototype to those that the G present sets match best.
    linear : ndarray of float64, shape (n, G + F)
        What the logarithms of a prototype's masses (matched, then its own) are multiplied with.
    logs : ndarray of float64, shape (n, G + F)
        What its masses (matched, then its own) are multiplied with.
    weights : ndarray of float64, shape (G + F,)
        One over the similarity of each best match.
    constants : ndarray of float64, shape (n,)
        What does not depend on the prototype.
    """

    rows: Rows
    matched: Array
    linear: Array
    logs: Array
    weights: Array
    constants: Array


@dataclass(frozen=True, eq=False)
class Met:
    """Evidence as it meets the prototypes under a reading.

    Parameters
    ----------
    frame : Frame
        Frame of the evidence.
    focal_sets : ndarray of int64, shape (F,)
        Sets that occur; the frame is the last one.
    masses : ndarray of float64, shape (N, F)
        At the reading's commitment, if it has one.
    weights : ndarray of float64, shape (N,)
        How much each case counts: as much as it really commits, under a nominal commitment.
    inner : ndarray of float64, shape (N,)
        Inner entropy of each case (A.3).
    patterns : tuple of Pattern
        The cases by the sets that carry mass.
    reading : Reading
        How the formulas are read.
    """

    frame: Frame
    focal_sets: NDArray[np.int64]
    masses: Array
    weights: Array
    inner: Array
    patterns: tuple[Pattern, ...]
    reading: Reading

    def take(self, rows: Rows) -> "Met":
        """Some of the cases.

        Parameters
        ----------
        rows : ndarray of int, shape (n,)
            Which, in rising order.

        Returns
        -------
        Met
            These cases only.
        """
        place = np.full(len(self.masses), -1, dtype=np.intp)
        place[rows] = np.arange(len(rows))
        patterns: list[Pattern] = []
        for p in self.patterns:
            here = place[p.rows] >= 0
            if here.any():
                cut: dict[str, Any] = {
                    name: getattr(p, name)[here] for name in ("linear", "logs", "constants")
                }
                patterns.append(replace(p, rows=place[p.rows[here]], **cut))
        return replace(
            self,
            masses=self.masses[rows],
            weights=self.weights[rows],
            inner=self.inner[rows],
            patterns=tuple(patterns),
        )


def meet(y: MassFunction, reading: Reading) -> Met:
    """Evidence as it meets the prototypes, and what its divergences will need.

    Parameters
    ----------
    y : MassFunction
        N cases in the layout ``shared``.
    reading : Reading
        With a nominal commitment, evidence is brought to it, and counts as much as it really commits.

    Returns
    -------
    Met
        The N cases.
    """
    masses, sets = _at_commitment(y, reading)
    weights = np.ones(len(y)) if reading.commitment is None else y.where(y.focal_sets != y.frame.full)
    kinds, group = np.unique(masses > 0, axis=0, return_inverse=True)
    inner = np.empty(len(masses))
    patterns: list[Pattern] = []
    for g, present in enumerate(kinds):
        rows = np.flatnonzero(group.ravel() == g)
        part = MassFunction.trusted(y.frame, sets[present], masses[np.ix_(rows, present)])
        inner[rows] = inner_entropy(part, reading)
        patterns.append(_pattern(part, rows, sets, reading))
    return Met(y.frame, sets, masses, weights, inner, tuple(patterns), reading)


def _at_commitment(y: MassFunction, reading: Reading) -> tuple[Array, NDArray[np.int64]]:
    """Masses with the frame last: a nominal share off it, without crumbs; ignorance where nothing is."""
    sets = np.append(y.focal_sets[(y.focal_sets != y.frame.full) & (y.focal_sets != 0)], y.frame.full)
    masses = y.on(sets)
    if reading.commitment is None:
        return masses, sets
    met = at_commitment(MassFunction.trusted(y.frame, sets, masses), reading.commitment, reading.negligible)
    return met.masses, sets


def _pattern(part: MassFunction, rows: Rows, sets: NDArray[np.int64], reading: Reading) -> Pattern:
    """Terms of A.6 for cases on the same sets against prototypes on all sets."""
    similar = similarity(part.frame, part.focal_sets, sets, reading)
    best, matched = _matches(similar, reading)
    best_back, matched_back = _matches(similar.T, reading)
    b = part.masses
    met = b @ matched_back.T
    weights = 1.0 / np.concatenate([best, best_back])
    own, other = np.concatenate([b, met], axis=1), np.log(np.concatenate([b, met], axis=1))
    each = weights * own * other
    if reading.divergence == "printed":  # only b log(b / c), from the side of b
        each[:, len(best) :] = 0.0
    return Pattern(rows, matched, weights * own, weights * other, weights, each.sum(axis=1))


def _matches(similar: Array, reading: Reading) -> tuple[Array, Array]:
    """Similarity of the best match of each row, and the average over those that tie."""
    best = similar.max(axis=1)
    match = similar >= best[:, None] - TIE
    if reading.ties == "first":
        match = match & (np.cumsum(match, axis=1) == 1)
    return best, match / match.sum(axis=1, keepdims=True)


def divergences(met: Met, prototypes: Array) -> Array:
    """Divergence of every case from every prototype (A.6).

    Parameters
    ----------
    met : Met
        N cases.
    prototypes : ndarray of float64, shape (P, F)
        Positive masses over ``met.focal_sets``.

    Returns
    -------
    ndarray of float64, shape (N, P)
        As `evifuse.conductivity.divergence` gives them.
    """
    out = np.empty((len(met.masses), len(prototypes)))
    for p in met.patterns:
        c = np.concatenate([prototypes @ p.matched.T, prototypes], axis=1)
        logs, near = np.log(c), len(p.matched)
        own = p.weights * c * logs
        if met.reading.divergence == "printed":
            found = own[:, near:].sum(axis=1) - p.linear[:, :near] @ logs[:, :near].T
            found = found - p.logs[:, near:] @ c[:, near:].T
        else:
            found = own.sum(axis=1) - p.linear @ logs.T - p.logs @ c.T
        out[p.rows] = found + p.constants[:, None]
    if met.reading.divergence == "symmetric":
        out = np.maximum(out, 0.0)
    return out if met.reading.log_base is None else out / natural_log(met.reading.log_base)


def clustered(met: Met, count: int, rng: np.random.Generator) -> Array:
    """Prototypes of one class: cases go to the prototype they diverge least from, until nothing moves.

    Parameters
    ----------
    met : Met
        The N cases of the class.
    count : int
        Number of prototypes wanted; there are fewer if the cases are not so different.
    rng : numpy.random.Generator
        Draws the cases to begin with, the likelier the farther from those drawn before.

    Returns
    -------
    ndarray of float64, shape (count or fewer, F)
        Masses over ``met.focal_sets``, from the most cases to the fewest.
    """
    current = centre(met.masses, met.weights)[None]
    if count == 1:
        return current
    apart = divergences(met, current)
    starts: list[Array] = []
    while len(starts) < count:
        chances = met.weights * np.maximum(apart.min(axis=1), 0.0)
        if not chances.sum() > 1e-9:
            return current
        drawn = int(rng.choice(len(chances), p=chances / chances.sum()))
        starts.append(centre(met.masses[[drawn]], met.weights[[drawn]]))
        new = divergences(met, starts[-1][None])
        apart = new if len(starts) == 1 else np.concatenate([apart, new], axis=1)
    owner = np.full(len(met.masses), -1)
    for _ in range(STEPS):
        moved = apart.argmin(axis=1)
        if np.array_equal(moved, owner):
            break
        owner = moved
        own = [np.flatnonzero((owner == i) & (met.weights > 0)) for i in range(apart.shape[1])]
        own = sorted((o for o in own if len(o)), key=lambda o: (-met.weights[o].sum(), int(o[0])))
        current = np.array([centre(met.masses[o], met.weights[o]) for o in own])
        apart = divergences(met, current)
    _, first = np.unique(current, axis=0, return_index=True)
    return current[np.sort(first)]


def centre(masses: Array, weights: Array) -> Array:
    """What a cluster of cases has in common: mean masses, and a residual on the frame.

    Frequencies of occurrence (section 3.3); the residual of 1 / (n + 1) for n cases is our own, so that few
    cases commit to less.

    Parameters
    ----------
    masses : ndarray of float64, shape (N, F)
        The cases, the frame last.
    weights : ndarray of float64, shape (N,)
        How much each case counts.

    Returns
    -------
    ndarray of float64, shape (F,)
        Positive masses of four decimals (six with many sets).
    """
    count = masses.shape[1]
    if count == 1:
        return np.ones(1)
    means = (weights @ masses) / (weights.sum() + 1.0)
    means[-1] += 1.0 / (weights.sum() + 1.0)
    floored = np.maximum(means, min(FLOOR, 0.1 / count))
    digits = DIGITS if count <= MANY else DIGITS + 2
    return rounded(floored / floored.sum(), digits)


def rounded(masses: Array, digits: int) -> Array:
    """Masses of so many decimals that still sum to 1: the largest makes up for the others.

    Parameters
    ----------
    masses : ndarray of float64, shape (F,)
        They sum to 1.
    digits : int
        Decimals.

    Returns
    -------
    ndarray of float64, shape (F,)
        Rounded.
    """
    out = np.round(masses, digits)
    most = int(out.argmax())
    out[most] = round(1.0 - float(np.delete(out, most).sum()), digits)
    return out
