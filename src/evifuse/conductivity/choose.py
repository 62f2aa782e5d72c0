"""Which reading suits labelled evidence: chosen on one half of the cases, judged on the other.

Our own. Only the half that took no part in choosing says how good the chosen reading is.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.belief import MassFunction, on_frame
from evifuse.conductivity.aggregate import KnowledgeBase
from evifuse.conductivity.classify import classify
from evifuse.conductivity.compiled import compile as compile_knowledge
from evifuse.conductivity.crossing import decide
from evifuse.conductivity.reading import Reading
from evifuse.errors import KnowledgeError

__all__ = ["Choice", "Judged", "choose_reading", "halves", "shortlist"]

NORMAL_95 = 1.959963984540054
"""Half width of the middle 95 % of a normal distribution, in standard deviations."""

Array = NDArray[np.float64]
Rows = NDArray[np.int64]
Progress = Callable[[Sequence[str]], Iterable[str]]


@dataclass(frozen=True)
class Judged:
    """One reading on labelled evidence.

    Parameters
    ----------
    name : str
        What the reading is called.
    reading : Reading
        How the formulas are read.
    chosen_on : float
        Accuracy on the half for choosing.
    accuracy : float
        Accuracy on the held-out half; what conducts nothing counts as wrong.
    low : float
        Lower end of its 95 % interval (Wilson 1927).
    high : float
        Upper end.
    brier : float
        Mean squared error of the pignistic probabilities on the held-out half, summed over classes: 0 to 2.
    undecided : float
        Share of the held-out half that conducts into nothing.
    """

    name: str
    reading: Reading
    chosen_on: float
    accuracy: float
    low: float
    high: float
    brier: float
    undecided: float


@dataclass(frozen=True)
class Choice:
    """The reading that did best on the half for choosing, and how all of them did on the other.

    Parameters
    ----------
    best : Judged
        The chosen one.
    judged : tuple of Judged
        All that were tried, in their order.
    choosing : int
        Cases in the half for choosing.
    held_out : int
        Cases in the other half.
    commonest : float
        Accuracy on the held-out half of always saying the commonest class of the first.
    """

    best: Judged
    judged: tuple[Judged, ...]
    choosing: int
    held_out: int
    commonest: float


def choose_reading(
    evidence: MassFunction,
    labels: Sequence[str],
    knowledge: KnowledgeBase,
    readings: Mapping[str, Reading],
    *,
    groups: Sequence[str] | None = None,
    seed: int = 0,
    progress: Progress = lambda names: names,
) -> Choice:
    """Choose a reading on a random half of labelled evidence, and judge all on the other half.

    Parameters
    ----------
    evidence : MassFunction
        Batch of shape (N,).
    labels : sequence of str
        The N classes that are true.
    knowledge : KnowledgeBase
        The classes and their prototypes.
    readings : mapping of str to Reading
        What to choose from. Equal accuracy is settled by the Brier score, then by order.
    groups : sequence of str, optional
        Group of each case; a group is not parted between the halves.
    seed : int
        Of the split, which keeps the share of each class where there are no groups.
    progress : callable, optional
        Takes the names of the readings and yields them, so that it can show how far it is.

    Returns
    -------
    Choice
        The chosen reading, and figures of all.

    Raises
    ------
    KnowledgeError
        If labels are not classes of the knowledge base, or do not match the evidence in number.
    FrameError
        If the evidence is about a hypothesis that the knowledge base's frame lacks.
    """
    truth = _truth(evidence, labels, knowledge)
    first, second = halves(truth, seed, groups)
    met = on_frame(evidence.to("shared"), knowledge.frame)
    results: list[tuple[float, float, Judged]] = []
    for name in progress(list(readings)):
        reading = readings[name]
        right, error, _ = _judge(met[first], truth[first], knowledge, reading)
        held, brier, undecided = _judge(met[second], truth[second], knowledge, reading)
        low, high = _wilson(int(held.sum()), len(held))
        judged = Judged(name, reading, _mean(right), _mean(held), low, high, _mean(brier), _mean(undecided))
        results.append((-judged.chosen_on, _mean(error), judged))
    best = min(range(len(results)), key=lambda i: (results[i][0], results[i][1], i))
    common = int(np.bincount(truth[first]).argmax())
    judged = tuple(j for _, _, j in results)
    return Choice(judged[best], judged, len(first), len(second), _mean(truth[second] == common))


def shortlist(
    evidence: MassFunction,
    labels: Sequence[str],
    knowledge: KnowledgeBase,
    readings: Mapping[str, Reading],
    *,
    keep: int = 10,
    sample: int = 200,
    groups: Sequence[str] | None = None,
    seed: int = 0,
    progress: Progress = lambda names: names,
) -> dict[str, Reading]:
    """The best of many readings on a sample of the half for choosing; the held-out half is not touched.

    Parameters
    ----------
    evidence : MassFunction
        Batch of shape (N,).
    labels : sequence of str
        The N classes that are true.
    knowledge : KnowledgeBase
        The classes and their prototypes.
    readings : mapping of str to Reading
        What to choose from.
    keep : int
        How many to keep.
    sample : int
        How many cases to try them on, at most.
    groups : sequence of str, optional
        Group of each case, as in `choose_reading`.
    seed : int
        Of the split, the same as in `choose_reading`, and of the sample.
    progress : callable, optional
        Takes the names of the readings and yields them, so that it can show how far it is.

    Returns
    -------
    dict of str to Reading
        Best first.

    Raises
    ------
    KnowledgeError
        If labels are not classes of the knowledge base, or do not match the evidence in number.
    FrameError
        If the evidence is about a hypothesis that the knowledge base's frame lacks.
    """
    truth = _truth(evidence, labels, knowledge)
    first, _ = halves(truth, seed, groups)
    some = np.sort(np.random.default_rng(seed).permutation(first)[:sample])
    met = on_frame(evidence.to("shared"), knowledge.frame)[some]
    scores: list[tuple[float, float, str]] = []
    for name in progress(list(readings)):
        right, error, _ = _judge(met, truth[some], knowledge, readings[name])
        scores.append((-_mean(right), _mean(error), name))
    return {name: readings[name] for _, _, name in sorted(scores, key=lambda s: s[:2])[:keep]}


def halves(truth: Rows, seed: int, groups: Sequence[str] | None = None) -> tuple[Rows, Rows]:
    """Two random halves of the cases, with as even a share of each class, or with whole groups.

    Parameters
    ----------
    truth : ndarray of int64, shape (N,)
        Class of each case.
    seed : int
        Of the random numbers.
    groups : sequence of str, optional
        Group of each case, for example who drew it: a group is not parted, and classes are as they come.

    Returns
    -------
    ndarray of int64
        Cases of the first half, in order; without groups it has the odd case.
    ndarray of int64
        Cases of the second half, in order.

    Raises
    ------
    KnowledgeError
        If there is only one group.
    """
    rng = np.random.default_rng(seed)
    if groups is None or len(set(groups)) == len(groups):
        shuffled = rng.permutation(len(truth))
        by_class = shuffled[np.argsort(truth[shuffled], kind="stable")]
        return np.sort(by_class[0::2]), np.sort(by_class[1::2])
    names, which = np.unique(np.array(groups), return_inverse=True)
    if len(names) < 2:
        raise KnowledgeError(f"all cases are of the group {names[0]!s}: a group can't be split")
    sizes = np.bincount(which)
    in_first, counts = np.zeros(len(names), dtype=np.bool_), [0, 0]
    for group in rng.permutation(len(names)):
        in_first[group] = counts[0] <= counts[1]
        counts[0 if in_first[group] else 1] += int(sizes[group])
    return np.flatnonzero(in_first[which]), np.flatnonzero(~in_first[which])


def _truth(evidence: MassFunction, labels: Sequence[str], knowledge: KnowledgeBase) -> Rows:
    if evidence.batch != (len(labels),):
        raise KnowledgeError(
            f"{len(labels)} labels need as many cases, not a batch of shape {evidence.batch}"
        )
    if len(labels) < 4:
        raise KnowledgeError(f"{len(labels)} labelled cases can't be split: give 4 at least")
    strange = sorted(set(labels) - set(knowledge.classes))
    if strange:
        known = ", ".join(knowledge.classes)
        raise KnowledgeError(f"label {strange[0]!r} is not a class of the knowledge base, which has {known}")
    return np.array([knowledge.classes.index(label) for label in labels], dtype=np.int64)


def _judge(
    evidence: MassFunction, truth: Rows, knowledge: KnowledgeBase, reading: Reading
) -> tuple[NDArray[np.bool_], Array, NDArray[np.bool_]]:
    """For each case: whether it is decided rightly, its squared error, and whether it is undecided."""
    conductivities, masses = _conducted(evidence, knowledge, reading)
    fine: NDArray[np.bool_] = np.all(np.isfinite(conductivities) & (conductivities >= 0), axis=-1)
    decisions = np.where(fine, decide(np.where(fine[:, None], conductivities, 0.0)), -1)
    count = len(knowledge.classes)
    shares = np.where(fine[:, None], masses, 0.0)
    probabilities = shares[:, :count] + (1.0 - shares[:, :count].sum(axis=-1, keepdims=True)) / count
    error = ((probabilities - np.eye(count)[truth]) ** 2).sum(axis=-1)
    return decisions == truth, error, decisions < 0


def _conducted(evidence: MassFunction, knowledge: KnowledgeBase, reading: Reading) -> tuple[Array, Array]:
    """Conductivities and belief; readings that leave sets infinitely far apart can't be compiled."""
    with np.errstate(all="ignore"):  # some readings divide by zero: such figures count as undecided
        try:
            fast = compile_knowledge(knowledge, evidence.focal_sets, reading)
            return fast.conductivities(evidence.masses), fast.belief(evidence.masses)
        except KnowledgeError:
            found = classify(evidence, knowledge, reading)
            return found.conductivities, found.belief.masses


def _mean(values: Array | NDArray[np.bool_]) -> float:
    return float(np.mean(values, dtype=np.float64))


def _wilson(right: int, count: int) -> tuple[float, float]:
    """The 95 % interval of a share by Wilson's score."""
    z2 = NORMAL_95**2
    centre = (right + z2 / 2) / (count + z2)
    half = NORMAL_95 / (count + z2) * np.sqrt(right * (count - right) / count + z2 / 4)
    return max(0.0, float(centre - half)), min(1.0, float(centre + half))
