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
from evifuse.conductivity.aggregate import KnowledgeBase
from evifuse.conductivity.clusters import meet
from evifuse.conductivity.reading import READINGS, Reading
from evifuse.conductivity.rehearse import Trial, choose, knowledge_of, learned_by_class
from evifuse.errors import InputError, MassError

__all__ = ["LAYERS", "TRAINED_READINGS", "TrainingReport", "train", "train_report"]

Array = NDArray[np.float64]
Codes = NDArray[np.intp]

_LAYERS = replace(READINGS["working"], negligible=0.0, similarity_offset=1.0)
UNTRIED = "layers-16"
"""The reading where no case can be held out to choose one."""

_KIND_COUNTS = (8, 16, 32, 64)
_COUNTS = (4, 8, 16, 32, 64, 128, 256)

LAYERS = {f"layers-{n}": replace(_LAYERS, sharpness=float(n)) for n in _COUNTS}
"""As the sensors read appendix A, with more or fewer layers in series, and no crumbs left out."""

TRAINED_READINGS: dict[str, Reading] = {
    "sound": replace(READINGS["sound"], pooling="mean"),
    "smooth": replace(READINGS["sound"], pooling="max", smoothing=0.1),
    **LAYERS,
    **{f"firm-{n}": replace(_LAYERS, sharpness=float(n), keep_ignorance=False) for n in _COUNTS},
    **{f"kinds-{n}": replace(READINGS["working"], sharpness=float(n)) for n in _KIND_COUNTS},
    **{
        f"firm-kinds-{n}": replace(READINGS["working"], sharpness=float(n), keep_ignorance=False)
        for n in _KIND_COUNTS
    },
}
"""Readings that training tries if none is given, pooled so that more prototypes are no advantage.

``firm`` ones are the ``layers`` without the ignorance of the evidence: half-hearted evidence that is right as
a rule deserves a firm answer, and held-out cases tell. ``kinds`` take their prototypes from the kinds of
evidence that occur, which evidence with different focal sets in every case needs.
"""


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
    groups: Sequence[Any] | NDArray[Any] | None = None,
    name: str = "trained",
) -> KnowledgeBase:
    """Learn a knowledge base from labelled evidence.

    The cases of a class are clustered by the divergence of A.6. A prototype's beliefs are the mean masses of
    its cluster (frequencies of occurrence, section 3.3) with a residual of 1 / (n + 1) on the frame for n
    cases, our own; under a reading that leaves crumbs out it is one of the kinds of evidence that occur, by
    which sets carry mass. How many prototypes a class gets, and how the formulas are read, is decided by
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
    groups : sequence of N values, optional
        What each case belongs to, for example the person who drew it. Cross-validation then holds whole
        groups out, as it must where cases of a group are alike.
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
        evidence, labels, reading=reading, max_prototypes=max_prototypes, seed=seed, groups=groups, name=name
    ).knowledge


def train_report(
    evidence: MassFunction,
    labels: Sequence[Any] | NDArray[Any],
    *,
    reading: Reading | Mapping[str, Reading] | None = None,
    max_prototypes: int = 3,
    seed: int = 0,
    groups: Sequence[Any] | NDArray[Any] | None = None,
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
    groups : sequence of N values, optional
        What each case belongs to: cross-validation holds whole groups out.
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
    sets = np.unique(np.broadcast_to(evidence.focal_sets, evidence.masses.shape)[evidence.masses > 0])
    y = MassFunction.trusted(evidence.frame, sets, evidence.on(sets))
    candidates = TRAINED_READINGS if reading is None else reading
    if isinstance(candidates, Reading):
        candidates = {"given": candidates}
    sizes = np.bincount(codes)
    trials = choose(y, codes, classes, candidates, max_prototypes, seed, _grouped(groups, len(codes)))
    best = next((t for t in trials if t.chosen), None)
    chosen = candidates[best.reading] if best else candidates.get(UNTRIED, next(iter(candidates.values())))
    counts = best.prototypes if best else (1,) * len(classes)
    met = meet(y, chosen)
    learned = [found[0] for found in learned_by_class(met, codes, [(n,) for n in counts], seed)]
    source = f"learned from {len(codes)} cases, seed {seed}"
    knowledge = knowledge_of(met, classes, learned, chosen, name, source)
    return TrainingReport(knowledge, dict(zip(classes, sizes.tolist(), strict=True)), tuple(trials))


def _grouped(groups: Sequence[Any] | NDArray[Any] | None, count: int) -> Codes | None:
    """Index of the group of each case; None if all are of one group or each of its own."""
    if groups is None:
        return None
    texts = [str(group) for group in groups]
    if len(texts) != count:
        raise InputError(f"{count} cases of evidence need as many groups, not {len(texts)}")
    names, which = np.unique(np.array(texts), return_inverse=True)
    return which.ravel().astype(np.intp) if 1 < len(names) < count else None


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
