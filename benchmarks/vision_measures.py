"""How good decisions, doubts and probabilities are, and how sure each of these figures is."""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from vision_data import SEED, Box

Array = NDArray[np.float64]
Interval = tuple[float, float]
BINS = 10


def interval(right: int, count: int) -> Interval:
    """95 % interval of Wilson for a share."""
    if count == 0:
        return 0.0, 1.0
    p, z = right / count, 1.96
    middle = (p + z * z / (2 * count)) / (1 + z * z / count)
    half = z * np.sqrt(p * (1 - p) / count + z * z / (4 * count**2)) / (1 + z * z / count)
    return float(middle - half), float(middle + half)


def mean_interval(values: ArrayLike) -> tuple[float, Interval]:
    """Mean and its 95 % interval by Student's t."""
    from scipy.stats import t

    given = np.asarray(values, np.float64)
    mean = float(given.mean())
    if len(given) < 2:
        return mean, (mean, mean)
    half = float(t.ppf(0.975, len(given) - 1)) * float(given.std(ddof=1)) / np.sqrt(len(given))
    return mean, (mean - half, mean + half)


def auroc(known: ArrayLike, other: ArrayLike) -> float | None:
    """Share of pairs of a known and another shape of which the other one has the higher value."""
    a, b = np.sort(np.asarray(known, np.float64)), np.asarray(other, np.float64)
    if not len(a) or not len(b):
        return None
    below, not_above = np.searchsorted(a, b, "left"), np.searchsorted(a, b, "right")
    return float((below + not_above).mean() / (2 * len(a)))


def auroc_with_interval(known: ArrayLike, other: ArrayLike, draws: int = 1000) -> dict[str, object] | None:
    """AUROC and its 95 % interval, both groups drawn anew with replacement so many times."""
    a, b = np.asarray(known, np.float64), np.asarray(other, np.float64)
    value = auroc(a, b)
    if value is None:
        return None
    rng = np.random.default_rng(SEED)
    drawn = [auroc(rng.choice(a, len(a)), rng.choice(b, len(b))) for _ in range(draws)]
    low, high = np.quantile(np.array(drawn, np.float64), [0.025, 0.975])
    return {"auroc": value, "interval": [float(low), float(high)], "known": len(a), "other": len(b)}


def calibration(probabilities: Array, truth: NDArray[np.intp]) -> dict[str, object]:
    """Expected calibration error of probabilities (N, K): ten bins of equal width of the highest one.

    Where several classes share the highest probability, each counts as an equal share of the decision.
    """
    confidence = probabilities.max(axis=1)
    best = probabilities >= confidence[:, None] - 1e-12
    right = best[np.arange(len(truth)), truth] / best.sum(axis=1)
    which = np.minimum((confidence * BINS).astype(int), BINS - 1)
    bins: list[dict[str, float]] = []
    for b in range(BINS):
        inside = which == b
        if inside.any():
            mean, share, count = confidence[inside].mean(), right[inside].mean(), int(inside.sum())
            bins.append({"from": b / BINS, "confidence": mean, "accuracy": share, "count": count})
    error = sum(b["count"] * abs(b["confidence"] - b["accuracy"]) for b in bins) / max(len(truth), 1)
    bins = [{k: float(v) for k, v in b.items()} for b in bins]
    return {"error": float(error), "count": len(truth), "bins": bins}


def overlap(a: Box, b: Box) -> float:
    """Intersection over union of two boxes x, y, w, h."""
    w = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    h = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    both = max(w, 0) * max(h, 0)
    return both / (a[2] * a[3] + b[2] * b[3] - both)
