"""Learned from few examples: prototypes on the sensor's evidence, and HOG with a support vector machine.

Both get the very same clean pictures. 5 and 50 of each class are drawn ten times; the difference is paired by
draw. A class with fewer examples than asked for gives all it has, and where every class does, there is one
draw.

The sensor has weights of its own, which `train_shapes.py` learned from all of `dev`, its drawings among them:
prototypes of 5 drawings rest on those too. What the sensor knows without them is not measured here.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from vision_data import CLASSES, SEED, Image
from vision_measures import interval, mean_interval
from vision_rivals import hog, trained
from vision_seen import Firsts, shown

from evifuse.belief import MassFunction
from evifuse.conductivity import classify, train

COUNTS: tuple[int | None, ...] = (5, 50, None)
DRAWS = 10
OURS, THEIRS = "prototypes", "HOG + SVM"


@dataclass(frozen=True, eq=False)
class Fold:
    """What is learned from and what is judged.

    Parameters
    ----------
    examples : Firsts
        Clean pictures of the split that is learned from, seen.
    features : ndarray of float32, shape (N, D)
        Their histograms of oriented gradients.
    judged : ndarray of int
        Numbers of the pictures to be judged, in every condition.
    """

    examples: Firsts
    features: NDArray[np.float32]
    judged: NDArray[np.intp]


def features_of(pictures: Sequence[Image]) -> NDArray[np.float32]:
    return np.stack([hog(p) for p in pictures])


def few_examples(
    folds: Sequence[Fold],
    seen: dict[str, Firsts],
    features: dict[str, NDArray[np.float32]],
    draws: int = DRAWS,
) -> dict[str, Any]:
    """Accuracy by number of examples and condition: ours, theirs, and ours - theirs.

    Parameters
    ----------
    folds : sequence of Fold
        Each known picture is judged in one of them.
    seen, features : dict by condition
        The pictures to be judged.
    draws : int
        How often 5 and 50 examples are drawn.

    Returns
    -------
    dict
        By number of examples and condition: mean and 95 % interval (Student's t over draws) of each, and
        of the paired difference.
    """
    most = max(int((fold.examples.labels == c).sum()) for fold in folds for c in CLASSES)
    plan = [(n, draw) for n in COUNTS for draw in range(draws if n and n < most else 1)]
    shares: dict[tuple[int | None, str], list[tuple[float, float]]] = {}
    for count, draw in shown(plan, "learning"):
        right: dict[str, list[NDArray[np.bool_]]] = {}
        for number, fold in enumerate(folds):
            rng = np.random.default_rng([SEED, count or 0, draw, number])
            for condition, pair in _one_draw(fold, count, rng, seen, features).items():
                right.setdefault(condition, []).append(pair)
        for condition, pairs in right.items():
            together = np.concatenate(pairs, axis=1)
            shares.setdefault((count, condition), []).append(
                (float(together[0].mean()), float(together[1].mean()))
            )
    found: dict[str, Any] = {}
    for (count, condition), values in shares.items():
        pictures = sum(int(seen[condition].known[fold.judged].sum()) for fold in folds)
        found.setdefault(str(count or "all"), {})[condition] = _row(np.array(values), pictures)
    return found


def _row(shares: NDArray[np.float64], pictures: int) -> dict[str, Any]:
    """Ours, theirs and the difference over draws (D, 2); of a single draw the interval is Wilson's."""
    columns = {OURS: shares[:, 0], THEIRS: shares[:, 1], "difference": shares[:, 0] - shares[:, 1]}
    row: dict[str, Any] = {"draws": len(shares), "pictures": pictures}
    for name, values in columns.items():
        mean, limits = mean_interval(values)
        if len(shares) == 1:
            limits = None if name == "difference" else interval(round(mean * pictures), pictures)
        row[name] = {"mean": mean, "interval": limits}
    return row


def _one_draw(
    fold: Fold,
    count: int | None,
    rng: np.random.Generator,
    seen: dict[str, Firsts],
    features: dict[str, NDArray[np.float32]],
) -> dict[str, NDArray[np.bool_]]:
    """Which of the judged pictures are right, by condition; row 0 ours, row 1 theirs."""
    labels = fold.examples.labels
    chosen = np.concatenate(
        [rng.permutation(np.flatnonzero(labels == c))[: count or len(labels)] for c in CLASSES]
    )
    evidence = fold.examples.evidence
    base = train(part(evidence, chosen), labels[chosen].tolist())
    model = trained(fold.features[chosen], labels[chosen])
    found: dict[str, NDArray[np.bool_]] = {}
    for condition, firsts in seen.items():
        judged = fold.judged[firsts.known[fold.judged]]
        told = classify(part(firsts.evidence, judged), base)
        ours = np.array([*told.classes, ""])[told.decisions]
        theirs = model(features[condition][judged])
        found[condition] = np.stack([firsts.labels[judged] == ours, firsts.labels[judged] == theirs])
    return found


def part(evidence: MassFunction, which: NDArray[np.intp]) -> MassFunction:
    """Some cases of a batch."""
    return MassFunction(evidence.frame, evidence.focal_sets, evidence.masses[which])
