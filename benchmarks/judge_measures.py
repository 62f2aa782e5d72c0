"""How good probabilities of classes are, and how sure a mean over seeds is."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
BINS = 15
COVERAGES = np.linspace(0.05, 1.0, 20)


@dataclass(frozen=True)
class Scores:
    """One method on one set of test cases.

    Parameters
    ----------
    accuracy : float
        Share of right decisions; of k equally probable best classes each counts 1/k.
    brier : float
        Mean squared distance of the probabilities from the truth, 0 to 2.
    calibration : float
        Expected calibration error: mean gap of confidence and accuracy over 15 bins of equal size.
    rejection : float
        Area under the curve of accuracy over coverage when the least confident cases are rejected first.
    curve : list of float
        That accuracy at coverages of 5, 10, ... 100 %.
    """

    accuracy: float
    brier: float
    calibration: float
    rejection: float
    curve: list[float]


def scores(probabilities: Array, truth: NDArray[np.intp]) -> Scores:
    """Judge probabilities (N, K) of cases whose true classes are known.

    Parameters
    ----------
    probabilities : ndarray of float64, shape (N, K)
        Rows sum to 1.
    truth : ndarray of int, shape (N,)
        Column of the true class.

    Returns
    -------
    Scores
        All measures.
    """
    if not np.allclose(probabilities.sum(axis=1), 1.0, atol=1e-6) or (probabilities < -1e-12).any():
        raise ValueError("the rows of probabilities must sum to 1 and be nowhere negative")
    confidence = probabilities.max(axis=1)
    best = probabilities >= confidence[:, None] - 1e-12
    right = best[np.arange(len(truth)), truth] / best.sum(axis=1)
    wanted = np.eye(probabilities.shape[1])[truth]
    area, curve = rejection_curve(confidence, right)
    return Scores(
        float(right.mean()),
        float(((probabilities - wanted) ** 2).sum(axis=1).mean()),
        calibration_error(confidence, right),
        area,
        curve,
    )


def calibration_error(confidence: Array, right: Array) -> float:
    """Mean over bins of equal size of |mean confidence - accuracy|, weighted by size."""
    order = np.argsort(confidence, kind="stable")
    bins = np.array_split(order, min(BINS, len(order)))
    return float(sum(len(b) * abs(confidence[b].mean() - right[b].mean()) for b in bins) / len(order))


def rejection_curve(confidence: Array, right: Array) -> tuple[float, list[float]]:
    """Area under accuracy over coverage, and the accuracy at 20 coverages.

    Cases of equal confidence can't be told apart: each counts as the mean of its group.
    """
    order = np.argsort(-confidence, kind="stable")
    _, group, count = np.unique(np.round(-confidence[order], 12), return_inverse=True, return_counts=True)
    mean = np.bincount(group, weights=right[order]) / count
    kept = np.cumsum(mean[group]) / np.arange(1, len(order) + 1)
    places = np.maximum(np.ceil(COVERAGES * len(order)).astype(int), 1) - 1
    return float(kept.mean()), [round(float(v), 5) for v in kept[places]]


def mean_and_half(values: Array) -> tuple[float, float]:
    """Mean, and half the width of its 95 % t interval; 0 width for a single value."""
    from scipy.stats import t

    count = len(values)
    if count < 2:
        return float(values.mean()), 0.0
    error = float(values.std(ddof=1)) / np.sqrt(count)
    return float(values.mean()), float(t.ppf(0.975, count - 1)) * float(error)


def verdict(mine: Array, other: Array, higher_is_better: bool = True) -> str:
    """``+`` if mine is better over the same seeds, ``-`` if worse, ``=`` if the 95 % interval holds 0."""
    mean, half = mean_and_half((mine - other) * (1 if higher_is_better else -1))
    return "+" if mean > half and mean > 1e-12 else "-" if mean < -half and mean < -1e-12 else "="


def mean_ranks(values: Array) -> Array:
    """Mean rank of each of M methods over T sets, values (T, M), 1 the highest; equal values share ranks."""
    from scipy.stats import rankdata

    return np.array([rankdata(-np.round(row, 9)) for row in values]).mean(axis=0)
