"""Prototypes learned from labelled evidence, as section 3.3 announces: from frequencies of occurrence.

The chapter says no more than that. The clusters, the residual and the choice by cross-validation are our own.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.belief import MassFunction
from evifuse.conductivity.aggregate import Aggregate, KnowledgeBase
from evifuse.conductivity.clusters import Met, clustered, divergences, meet
from evifuse.conductivity.compiled import compile  # noqa: A004
from evifuse.conductivity.entropy import inner_entropy, ratio
from evifuse.conductivity.reading import READINGS, Reading
from evifuse.errors import InputError, MassError

__all__ = ["TRAINED_READINGS", "TrainingReport", "Trial", "folds_of", "train", "train_report"]

Array = NDArray[np.float64]
Codes = NDArray[np.intp]

SURE = 1e-3
"""Share of a probability that is spread over all classes before its logarithm is taken."""

_SOUND = replace(READINGS["sound"], pooling="max", keep_ignorance=True)
_WORKING = replace(READINGS["working"], negligible=0.0, similarity_offset=1.0)

LAYERS: dict[str, Reading] = {
    f"layers-{n}": replace(_WORKING, sharpness=float(n)) for n in (4, 8, 16, 32, 64, 128, 256, 512, 1024)
}

TRAINED_READINGS: dict[str, Reading] = {
    "sound": replace(READINGS["sound"], pooling="mean", keep_ignorance=True),
    "smooth": replace(_SOUND, smoothing=0.1),
    **LAYERS,
}
"""Readings that training tries if none is given: pooled so that more prototypes are no advantage."""


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


@dataclass(frozen=True)
class TrainingReport:
    """A trained knowledge base and what was tried to get there.

    Parameters
    ----------
    knowledge : KnowledgeBase
        The classes and their prototypes.
    cases : mapping of str to int
        Number of training cases of each class.
    trials : tuple of Trial
        In the order in which they were tried; empty if no class has two cases, so that nothing can be held
        out.
    """

    knowledge: KnowledgeBase
    cases: dict[str, int]
    trials: tuple[Trial, ...]


def train(
    evidence: MassFunction,
    labels: Sequence[Any] | NDArray[Any],
    *,
    reading: Reading | Mapping[str, Reading] | None = None,
    max_prototypes: int = 3,
    seed: int = 0,
    name: str = "trained",
) -> KnowledgeBase:
    """Learn a knowledge base from labelled evidence.

    The cases of a class are clustered by the divergence of A.6. A prototype's beliefs are the mean masses of
    its cluster (frequencies of occurrence, section 3.3) with a residual of 1 / (n + 1) on the frame for n
    cases, our own. How many prototypes a class gets, and how the formulas are read, is decided by
    cross-validation.

    Parameters
    ----------
    evidence : MassFunction
        N cases, batch shape ``(N,)``, in any layout.
    labels : sequence of N labels
        The class of each case; the text of a label is the name of its class.
    reading : Reading, optional
        How the formulas are read; the best of ``TRAINED_READINGS`` on held-out cases by default.
    max_prototypes : int
        At most so many prototypes for each class, 1 or more.
    seed : int
        Seed of the folds and of the first prototypes: the same seed gives the same knowledge base.
    name : str
        Title of the knowledge base.

    Returns
    -------
    KnowledgeBase
        Classes in the order of their labels; masses rounded to four decimals.

    Raises
    ------
    InputError
        If there are no cases, the labels are not as many, or two different labels have the same text.
    MassError
        If the evidence is not a batch of cases, or has mass on the empty set.

    Examples
    --------
    >>> from evifuse.belief import Frame
    >>> frame = Frame(["round", "flat"])
    >>> seen = MassFunction(frame, ["round", "flat", frame], [[0.6, 0.1, 0.3], [0.8, 0.1, 0.1], [0, 1, 0]])
    >>> base = train(seen, ["ball", "ball", "tile"], reading=READINGS["sound"], max_prototypes=1)
    >>> base.aggregates[0].prototypes["ball_1"]
    MassFunction(frame: 0.4667, round: 0.4666, flat: 0.0667)
    """
    return train_report(
        evidence, labels, reading=reading, max_prototypes=max_prototypes, seed=seed, name=name
    ).knowledge


def train_report(
    evidence: MassFunction,
    labels: Sequence[Any] | NDArray[Any],
    *,
    reading: Reading | Mapping[str, Reading] | None = None,
    max_prototypes: int = 3,
    seed: int = 0,
    name: str = "trained",
) -> TrainingReport:
    """Learn a knowledge base as `train` does, and tell what was tried.

    Parameters
    ----------
    evidence : MassFunction
        N cases, batch shape ``(N,)``, in any layout.
    labels : sequence of N labels
        The class of each case.
    reading : Reading, optional
        How the formulas are read.
    max_prototypes : int
        At most so many prototypes for each class.
    seed : int
        Seed of the folds and of the first prototypes.
    name : str
        Title of the knowledge base.

    Returns
    -------
    TrainingReport
        The knowledge base, and the figures of the cross-validation.

    Raises
    ------
    InputError
        If there are no cases, the labels are not as many, or two different labels have the same text.
    MassError
        If the evidence is not a batch of cases, or has mass on the empty set.
    """
    classes, codes = _checked(evidence, labels, max_prototypes)
    y = evidence.to("shared")
    candidates = TRAINED_READINGS if reading is None else reading
    if isinstance(candidates, Reading):
        candidates = {"given": candidates}
    sizes = np.bincount(codes)
    trials = _choose(y, codes, classes, candidates, max_prototypes, seed)
    best = next((t for t in trials if t.chosen), None)
    chosen = candidates[best.reading] if best else next(iter(candidates.values()))
    counts = best.prototypes if best else (1,) * len(classes)
    met = meet(y, chosen)
    learned = [found[0] for found in _learned(met, codes, [(n,) for n in counts], seed)]
    source = f"learned from {len(codes)} cases, seed {seed}"
    knowledge = _knowledge(met, classes, learned, chosen, name, source)
    return TrainingReport(knowledge, dict(zip(classes, sizes.tolist(), strict=True)), tuple(trials))


def _checked(
    evidence: MassFunction, labels: Sequence[Any] | NDArray[Any], max_prototypes: int
) -> tuple[tuple[str, ...], Codes]:
    """Names of the classes, and the index of the class of each case."""
    if len(evidence.batch) != 1:
        raise MassError(
            f"training needs evidence of batch shape (N,), a row for each case, not {evidence.batch}"
        )
    if evidence.where(evidence.focal_sets == 0).max(initial=0.0) > 0:
        raise MassError("training evidence has mass on the empty set: normalise it first")
    given: list[Any] = np.asarray(labels).tolist() if isinstance(labels, np.ndarray) else list(labels)
    if len(given) != len(evidence):
        raise InputError(f"{len(evidence)} cases of evidence need as many labels, not {len(given)}")
    if not given:
        raise InputError("nothing to train on: there are no cases")
    if isinstance(max_prototypes, bool) or max_prototypes < 1:
        raise InputError(f"max_prototypes must be 1 or more, not {max_prototypes!r}")
    distinct = set(given)
    text = {label: str(label).strip() for label in distinct}
    for label in distinct:
        if label is None or label != label or not text[label]:
            raise InputError(f"case {given.index(label)}: {label!r} is not a label: every case needs a class")
    if len(set(text.values())) < len(distinct):
        names = sorted(text.values())
        twice = next(a for a, b in pairwise(names) if a == b)
        raise InputError(f"two different labels have the same text {twice!r}: rename one")
    try:
        ordered = sorted(distinct)
    except TypeError:
        ordered = sorted(distinct, key=str)
    place = {label: i for i, label in enumerate(ordered)}
    return tuple(text[label] for label in ordered), np.array([place[label] for label in given], dtype=np.intp)


def folds_of(codes: Codes, count: int, seed: int) -> Codes:
    """Fold of each case, stratified: cases of a class are dealt out evenly in a random order.

    Parameters
    ----------
    codes : ndarray of int, shape (N,)
        Class of each case.
    count : int
        Number of folds, 2 or more.
    seed : int
        Seed of the order.

    Returns
    -------
    ndarray of int, shape (N,)
        From 0 to ``count - 1``; -1 for the only case of a class, which is always learned from.
    """
    rng = np.random.default_rng(seed)
    out = np.full(len(codes), -1, dtype=np.intp)
    for k in np.unique(codes):
        mine = np.flatnonzero(codes == k)
        if len(mine) > 1:
            out[rng.permutation(mine)] = (np.arange(len(mine)) + rng.integers(count)) % count
    return out


def _learned(met: Met, codes: Codes, counts: Sequence[Sequence[int]], seed: int) -> list[list[Array]]:
    """Prototypes of each class, for each of the numbers of prototypes that are asked for."""
    out: list[list[Array]] = []
    for k, wanted in enumerate(counts):
        mine = met.take(np.flatnonzero(codes == k))
        out.append([clustered(mine, count, np.random.default_rng([seed, k])) for count in wanted])
    return out


def _knowledge(
    met: Met, classes: Sequence[str], learned: Sequence[Array], reading: Reading, name: str, source: str
) -> KnowledgeBase:
    aggregates = [
        Aggregate(
            label,
            {f"{label}_{i + 1}": MassFunction(met.frame, met.focal_sets, x) for i, x in enumerate(found)},
        )
        for label, found in zip(classes, learned, strict=True)
    ]
    return KnowledgeBase(name, met.frame, tuple(aggregates), reading, source)


def _choose(
    y: MassFunction,
    codes: Codes,
    classes: Sequence[str],
    candidates: Mapping[str, Reading],
    most: int,
    seed: int,
) -> list[Trial]:
    """Try readings and numbers of prototypes on held-out cases; the chosen trial is marked."""
    sizes = np.bincount(codes)
    fold_of = folds_of(codes, int(min(5, max(2, sizes.max()))), seed)
    held = fold_of >= 0
    if not held.any() or len(classes) < 2:
        return []
    tried = [range(1, max(1, min(most, int(n) - 1)) + 1) for n in sizes]
    rehearsal = _Rehearsal(y, codes, fold_of, tried, seed)
    trials: list[Trial] = []
    for name, reading in candidates.items():
        into = rehearsal.conductivities(reading)
        known = rehearsal.met(reading).weights if reading.keep_ignorance else np.ones(len(codes))
        trials += _grow(name, into[held], known[held], codes[held], tried)
    best = min(range(len(trials)), key=lambda i: trials[i].log_loss)
    trials[best] = replace(trials[best], chosen=True)
    return trials


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
                _learned(met.take(np.flatnonzero(~out)), self.codes[~out], self.tried, self.seed)
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
            base = _knowledge(met, names, [learned[k][i] for k, i in places], reading, "", "")
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


def _grow(name: str, into: Array, known: Array, truth: Codes, tried: Sequence[range]) -> list[Trial]:
    """From one prototype for each class, add where held-out cases gain more than chance would give them."""

    def trial(counts: Sequence[int]) -> tuple[Trial, Array]:
        sigma = into[:, np.arange(len(counts)), np.array(counts) - 1]
        p = probabilities(sigma, known)
        loss = -np.log((1 - SURE) * p[np.arange(len(p)), truth] + SURE / p.shape[1])
        right = float((p.argmax(axis=1) == truth).mean())
        return Trial(name, tuple(counts), float(loss.mean()), right), loss

    counts = [1] * len(tried)
    first, loss = trial(counts)
    trials = [first]
    for k, sizes in enumerate(tried):
        for count in sizes[1:]:
            more = [*counts[:k], count, *counts[k + 1 :]]
            candidate, losses = trial(more)
            gain = loss - losses
            if gain.mean() > gain.std() / np.sqrt(len(gain)):
                counts, loss = more, losses
                trials.append(candidate)
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
