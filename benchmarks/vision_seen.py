"""What the shape sensor makes of many pictures with one object each: evidence, decisions, doubts."""

import sys
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track
from vision_data import CLASSES, Image
from vision_measures import auroc_with_interval, calibration, interval

from evifuse.belief import Frame, MassFunction, coarsen, pignistic, refining
from evifuse.belief.uncertainty import dissonance
from evifuse.vision import SHAPE_FRAME, SeenObject, sense_shapes

FAMILIES = refining(
    Frame(CLASSES),
    SHAPE_FRAME,
    {
        "rectangular": ["rectangle", "square"],
        "triangular": "triangle",
        "elliptical": ["ellipse", "circle", "bracket"],
    },
)
Array = NDArray[np.float64]
T = TypeVar("T")
See: TypeAlias = Callable[[Image], tuple[SeenObject, ...]]
"""The sensor, with weights that have not seen the pictures."""


@dataclass(frozen=True, eq=False)
class Firsts:
    """The first object of each of N pictures; total ignorance where nothing was seen.

    Parameters
    ----------
    labels : ndarray of str, shape (N,)
        What it is: a class, or ``other``.
    names : tuple of str
        Of the pictures.
    decisions : ndarray of str, shape (N,)
        What it is said to be; empty for no decision.
    evidence : MassFunction
        Over the shape frame, a batch of N.
    pignistic : ndarray of float64, shape (N, 3)
        Of the classification, in the order of the classes.
    seconds : float
        That seeing took, all together.
    """

    labels: NDArray[np.str_]
    names: tuple[str, ...]
    decisions: NDArray[np.str_]
    evidence: MassFunction
    pignistic: Array
    seconds: float

    @property
    def known(self) -> NDArray[np.bool_]:
        """Whether each is of one of the classes."""
        return np.isin(self.labels, CLASSES)

    @property
    def doubts(self) -> dict[str, Array]:
        """Ways to tell strangers: the higher, the stranger.

        *Frame*: mass on the frame. *Conflict*: Yager's dissonance of what is committed to the three classes,
        the mass on the frame divided out; 0 where nothing is committed. *Pignistic*: 1 less the highest
        probability of a class.
        """
        families = coarsen(self.evidence, FAMILIES)
        masses = np.where(families.focal_sets == families.frame.full, 0.0, families.masses)
        total = masses.sum(axis=1, keepdims=True)
        masses = np.where(total > 0, masses / np.where(total > 0, total, 1.0), families.masses)
        committed = MassFunction(families.frame, families.focal_sets, masses)
        return {
            "frame": self.evidence.on(np.array([SHAPE_FRAME.full]))[..., 0],
            "conflict": dissonance(committed),
            "pignistic": 1 - self.pignistic.max(axis=1),
        }


def look(
    pictures: Sequence[Image],
    labels: Sequence[str],
    names: Sequence[str],
    what: str = "",
    see: See = sense_shapes,
) -> Firsts:
    """See every picture and keep what is said of the first object."""
    evidence: list[MassFunction] = []
    decisions: list[str] = []
    probabilities = np.full((len(pictures), len(CLASSES)), 1 / len(CLASSES))
    seconds = 0.0
    for i, picture in enumerate(shown(pictures, what)):
        start = time.perf_counter()
        seen = see(picture)
        seconds += time.perf_counter() - start
        if not seen:
            evidence.append(MassFunction.vacuous(SHAPE_FRAME))
            decisions.append("")
            continue
        belief = seen[0].classification.belief
        shares = dict(zip(belief.frame.hypotheses, pignistic(belief).tolist(), strict=True))
        probabilities[i] = [shares[c] for c in CLASSES]
        evidence.append(seen[0].evidence)
        decisions.append(seen[0].classification.decision or "")
    return Firsts(
        np.array(labels, dtype=np.str_),
        tuple(names),
        np.array(decisions, dtype=np.str_),
        stacked(evidence),
        probabilities,
        seconds,
    )


def stacked(evidence: Sequence[MassFunction]) -> MassFunction:
    """One batch over every focal set that occurs."""
    singletons = [1 << i for i in range(len(SHAPE_FRAME))]
    others = {int(s) for m in evidence for s in m.focal_sets} - {*singletons, SHAPE_FRAME.full}
    sets = np.array([*singletons, *sorted(others), SHAPE_FRAME.full], dtype=np.int64)
    return MassFunction(SHAPE_FRAME, sets, np.stack([m.on(sets) for m in evidence]))


def shown(items: Sequence[T], what: str) -> Iterable[T]:
    """Items with a bar on standard error, on a terminal only."""
    console = Console(stderr=True)
    hidden = not sys.stderr.isatty()
    return track(items, description=what, console=console, transient=True, disable=hidden)


def judged(firsts: Firsts) -> dict[str, Any]:
    """Every figure of one source under one condition."""
    known = firsts.known
    labels, decisions = firsts.labels[known], firsts.decisions[known]
    right = labels == decisions
    truth = np.array([CLASSES.index(v) for v in labels], np.intp)
    names = [n for n, k in zip(firsts.names, known, strict=True) if k]
    doubts = firsts.doubts
    return {
        "accuracy": float(right.mean()) if len(right) else 0.0,
        "interval": interval(int(right.sum()), len(right)),
        "count": len(right),
        "per_class": {c: float(right[labels == c].mean()) if (labels == c).any() else 0.0 for c in CLASSES},
        "nothing_seen": int((decisions == "").sum()),
        "mean_frame_mass": {
            "known": _mean(doubts["frame"][known]),
            "other": _mean(doubts["frame"][~known]),
        },
        "strangers": {n: auroc_with_interval(d[known], d[~known]) for n, d in doubts.items()},
        "calibration": calibration(firsts.pignistic[known], truth),
        "ms_per_image": 1000 * firsts.seconds / max(len(firsts.labels), 1),
        "wrong": [
            (n, str(a), str(b) or None)
            for n, a, b, r in zip(names, labels, decisions, right, strict=True)
            if not r
        ],
    }


def _mean(values: Array) -> float | None:
    return float(values.mean()) if len(values) else None
