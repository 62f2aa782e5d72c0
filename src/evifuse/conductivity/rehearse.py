"""Readings and numbers of prototypes tried on held-out evidence: what training chooses by. Our own."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from evifuse.belief import MassFunction
from evifuse.conductivity.aggregate import Aggregate, KnowledgeBase
from evifuse.conductivity.clusters import Met, clustered, divergences, meet
from evifuse.conductivity.compiled import compile  # noqa: A004
from evifuse.conductivity.entropy import inner_entropy, ratio
from evifuse.conductivity.kinds import best_of_each, typical
from evifuse.conductivity.reading import Reading

__all__ = ["Trial", "choose", "folds_of", "knowledge_of", "learned_by_class", "probabilities"]

Array = NDArray[np.float64]
Codes = NDArray[np.intp]

SURE = 1e-3
"""Share of a probability that is spread over all classes before its logarithm is taken."""

EQUAL = 0.01
"""Within so many nats of the least log loss, the first reading in the list is as good: the gentlest."""

FOLDS = 5


@dataclass(frozen=True)
class Trial:
    """One choice that was tried on held-out evidence.

    Parameters
    ----------
    reading : str
        Name of the reading in ``TRAINED_READINGS``, or ``given``.
    prototypes : tuple of int
        Number of prototypes of each class.
    log_loss : float
        Mean of ``-log p`` of the true class, in nats, over cases that the prototypes were not made from.
    accuracy : float
        Share of these cases whose true class had the highest probability.
    chosen : bool
        Whether the knowledge base was made this way.
    """

    reading: str
    prototypes: tuple[int, ...]
    log_loss: float
    accuracy: float
    chosen: bool = False


def folds_of(codes: Codes, count: int, seed: int, groups: Codes | None = None) -> Codes:
    """Fold of each case, stratified: cases of a class are dealt out evenly in a random order.

    With groups, whole groups are dealt out, each to the fold with the fewest cases so far.

    Parameters
    ----------
    codes : ndarray of int, shape (N,)
        Class of each case.
    count : int
        Number of folds, 2 or more.
    seed : int
        Seed of the order.
    groups : ndarray of int, shape (N,), optional
        Group of each case, at least two of them.

    Returns
    -------
    ndarray of int, shape (N,)
        From 0 to ``count - 1``; -1 for the only case of a class, which is always learned from, and for the
        cases of a group with all of a class.
    """
    rng = np.random.default_rng(seed)
    if groups is not None:
        return _folds_of_groups(codes, count, groups, rng)
    out = np.full(len(codes), -1, dtype=np.intp)
    for k in np.unique(codes):
        mine = np.flatnonzero(codes == k)
        if len(mine) > 1:
            out[rng.permutation(mine)] = (np.arange(len(mine)) + rng.integers(count)) % count
    return out


def _folds_of_groups(codes: Codes, count: int, groups: Codes, rng: np.random.Generator) -> Codes:
    sizes = np.bincount(groups)
    filled = np.zeros(min(count, len(sizes)))
    fold = np.empty(len(sizes), dtype=np.intp)
    for group in rng.permutation(len(sizes)):
        fold[group] = filled.argmin()
        filled[fold[group]] += sizes[group]
    out = fold[groups]
    for k in np.unique(codes):
        mine = codes == k
        if len(np.unique(out[mine])) == 1:
            out[mine] = -1
    return out


def learned_by_class(met: Met, codes: Codes, counts: Sequence[Sequence[int]], seed: int) -> list[list[Array]]:
    """Prototypes of each class, for each of the numbers of prototypes that are asked for.

    Parameters
    ----------
    met : Met
        N cases.
    codes : ndarray of int, shape (N,)
        Class of each case.
    counts : sequence of sequences of int
        Numbers of prototypes to try for each class.
    seed : int
        Seed of the first prototypes.

    Returns
    -------
    list of list of ndarray of float64, shape (P, F)
        For each class and number.
    """
    out: list[list[Array]] = []
    for k, wanted in enumerate(counts):
        mine = met.take(np.flatnonzero(codes == k))
        if met.reading.negligible > 0:
            others = met.take(np.flatnonzero(codes != k))
            out.append(typical(mine, others, range(1, max(wanted) + 1)))
            out[-1] = [out[-1][count - 1] for count in wanted]
            continue
        out.append([clustered(mine, count, np.random.default_rng([seed, k])) for count in wanted])
    return out


def knowledge_of(
    met: Met, classes: Sequence[str], learned: Sequence[Array], reading: Reading, name: str, source: str
) -> KnowledgeBase:
    """A knowledge base from learned prototypes.

    Parameters
    ----------
    met : Met
        Gives the frame and the focal sets.
    classes : sequence of str
        The C labels.
    learned : sequence of ndarray of float64, shape (P, F)
        Prototypes of each class.
    reading : Reading
        The reading that they were made for.
    name : str
        Title.
    source : str
        Where they come from.

    Returns
    -------
    KnowledgeBase
        With prototypes numbered from 1.
    """
    aggregates = [
        Aggregate(
            label,
            {
                f"{label}_{i + 1}": MassFunction(met.frame, met.focal_sets[x > 0], x[x > 0])
                for i, x in enumerate(found)
            },
        )
        for label, found in zip(classes, learned, strict=True)
    ]
    return KnowledgeBase(name, met.frame, tuple(aggregates), reading, source)


def choose(
    y: MassFunction,
    codes: Codes,
    classes: Sequence[str],
    candidates: Mapping[str, Reading],
    most: int,
    seed: int,
    groups: Codes | None = None,
) -> list[Trial]:
    """Try readings and numbers of prototypes on held-out cases.

    Parameters
    ----------
    y : MassFunction
        N cases in the layout ``shared``.
    codes : ndarray of int, shape (N,)
        Class of each case.
    classes : sequence of str
        The C labels.
    candidates : mapping of str to Reading
        Readings by name.
    most : int
        At most so many prototypes for each class.
    seed : int
        Seed of folds and clusters.
    groups : ndarray of int, shape (N,), optional
        Group of each case: none is parted by the folds.

    Returns
    -------
    list of Trial
        The first that is within ``EQUAL`` of the least log loss is marked as chosen. Empty if no case can be
        held out.
    """
    sizes = np.bincount(codes)
    fold_of = folds_of(codes, int(min(FOLDS, max(2, sizes.max()))), seed, groups)
    held = fold_of >= 0
    if not held.any() or len(classes) < 2:
        return []
    tried = [range(1, max(1, min(most, int(n) - 1)) + 1) for n in sizes]
    committed = y.where(y.focal_sets != y.frame.full)
    rehearsal = _Rehearsal(y, codes, fold_of, tried, seed)
    tried_out: list[tuple[Trial, Array]] = []
    for name, reading in candidates.items():
        into = rehearsal.conductivities(reading)
        known = committed if reading.keep_ignorance else np.ones(len(codes))
        tried_out += _grow(name, into[held], known[held], codes[held], tried)
    least = min(trial.log_loss for trial, _ in tried_out)
    best = next(i for i, (trial, _) in enumerate(tried_out) if trial.log_loss <= least + EQUAL)
    return [replace(trial, chosen=i == best) for i, (trial, _) in enumerate(tried_out)]


def _better(old: Array, new: Array) -> bool:
    """Whether the losses of the same cases fall by more than chance would have them: two standard errors."""
    gain = old - new
    return bool(gain.mean() > 2.0 * gain.std() / np.sqrt(len(gain)))


class _Rehearsal:
    """Conductivities of held-out cases, without learning twice where only the last steps of A.8 differ."""

    def __init__(
        self, y: MassFunction, codes: Codes, fold_of: Codes, tried: Sequence[range], seed: int
    ) -> None:
        self.y, self.codes, self.tried, self.seed = y, codes, tried, seed
        self.folds = [fold_of == fold for fold in range(int(fold_of.max()) + 1)]
        self.mets: dict[Reading, Met] = {}
        self.learned: dict[Reading, list[list[list[Array]]]] = {}
        self.found: dict[Reading, Array] = {}

    def met(self, reading: Reading) -> Met:
        """Evidence as it meets prototypes; it depends on few choices of a reading."""
        key = replace(Reading(), **{name: getattr(reading, name) for name in _SHAPING})
        if key not in self.mets:
            met = self.mets[key] = meet(self.y, key)
            self.learned[key] = [
                learned_by_class(met.take(np.flatnonzero(~out)), self.codes[~out], self.tried, self.seed)
                for out in self.folds
            ]
        return self.mets[key]

    def conductivities(self, reading: Reading) -> Array:
        """Of every case into every class with 1, 2, ... prototypes, shape (N, C, most)."""
        if reading.projection or reading.pooling != "max":
            return self.by_the_book(reading)
        met = self.met(reading)
        if met.reading not in self.found:  # the largest dimension stays the largest when all are sharpened
            self.found[met.reading] = self.nearest(met)
        sigma = self.found[met.reading] ** reading.sharpness
        return sigma if reading.commitment is None else met.weights[:, None, None] * sigma

    def nearest(self, met: Met) -> Array:
        """Interaction dimension with the nearest prototype of every class."""
        out = np.zeros((len(self.codes), len(self.tried), max(t[-1] for t in self.tried)))
        for chosen, learned in zip(self.folds, self.learned[met.reading], strict=True):
            part = met.take(np.flatnonzero(chosen))
            for k, choices in enumerate(learned):
                if met.reading.negligible > 0:
                    out[chosen, k, : len(choices)] = best_of_each(part, choices)
                    continue
                for i, found in enumerate(choices):
                    x = MassFunction.trusted(met.frame, met.focal_sets, found)
                    both = part.inner[:, None] + inner_entropy(x, met.reading)
                    out[chosen, k, i] = ratio(both, both + divergences(part, found)).max(axis=1)
        return out

    def by_the_book(self, reading: Reading) -> Array:
        """The same with all of A.8: every choice is an aggregate of its own."""
        met = self.met(reading)
        out = np.zeros((len(self.codes), len(self.tried), max(t[-1] for t in self.tried)))
        places = [(k, i) for k, counts in enumerate(self.tried) for i in range(len(counts))]
        for chosen, learned in zip(self.folds, self.learned[met.reading], strict=True):
            names = [f"{k}#{i}" for k, i in places]
            base = knowledge_of(met, names, [learned[k][i] for k, i in places], reading, "", "")
            found = compile(base, self.y.focal_sets).conductivities(self.y.masses[chosen])
            for at, (k, i) in enumerate(places):
                out[chosen, k, i] = found[:, at]
        return out


_SHAPING = (
    "entropy_sign",
    "log_base",
    "similarity_offset",
    "divergence",
    "ties",
    "pairs_within",
    "commitment",
    "negligible",
)
"""The choices of a reading that interaction dimensions depend on."""


def _grow(
    name: str, into: Array, known: Array, truth: Codes, tried: Sequence[range]
) -> list[tuple[Trial, Array]]:
    """From one prototype for each class, add where held-out cases gain more than chance would give them."""

    def trial(counts: Sequence[int]) -> tuple[Trial, Array]:
        sigma = into[:, np.arange(len(counts)), np.array(counts) - 1]
        p = probabilities(sigma, known)
        loss = -np.log((1 - SURE) * p[np.arange(len(p)), truth] + SURE / p.shape[1])
        right = float((p.argmax(axis=1) == truth).mean())
        return Trial(name, tuple(counts), float(loss.mean()), right), loss

    counts = [1] * len(tried)
    first, loss = trial(counts)
    trials = [(first, loss)]
    for k, sizes in enumerate(tried):
        for count in sizes[1:]:
            more = [*counts[:k], count, *counts[k + 1 :]]
            candidate, losses = trial(more)
            if _better(loss, losses):
                counts, loss = more, losses
                trials.append((candidate, losses))
    return trials


def probabilities(sigma: Array, known: Array) -> Array:
    """Shares of the conductivities, with what is not known shared equally among the classes.

    Parameters
    ----------
    sigma : ndarray of float64, shape (N, C)
        Conductivities.
    known : ndarray of float64, shape (N,)
        Mass off the frame, where anything conducts.

    Returns
    -------
    ndarray of float64, shape (N, C)
        Pignistic probabilities.
    """
    total = sigma.sum(axis=1, keepdims=True)
    share = np.where(total > 0, known[:, None], 0.0)
    return share * sigma / np.where(total > 0, total, 1.0) + (1.0 - share) / sigma.shape[1]
