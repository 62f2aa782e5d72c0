"""What a group of features says about the class of a case: evidence learned from labelled cases.

Our own arrangement. A logistic regression gives probabilities. Missing features are taken, in turn, from
similar training cases, and the answers averaged: what could have been there makes the evidence less sure.
Probabilities are trusted as far as features are present and the case is near something that was learned.
Needs the extra ``learn``.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.belief import Frame, MassFunction, pignistic
from evifuse.belief.mass import singleton_sets
from evifuse.belief.masses_from import from_probabilities
from evifuse.conductivity.rehearse import folds_of
from evifuse.errors import MissingExtraError

try:
    from sklearn.linear_model import LogisticRegression
except ImportError as error:
    raise MissingExtraError(
        "learning from features needs scikit-learn: pip install 'evifuse[learn]'"
    ) from error

__all__ = ["Source", "cross_fitted", "learn_source"]

Array = NDArray[np.float64]
Codes = NDArray[np.intp]

TRUST = 0.99
"""Mass off the frame where all features are present and familiar."""

REMEMBERED = 1000
"""Training cases that are kept, to know what is familiar and what a missing feature could have been."""

DONORS = 10
"""Remembered cases that a missing feature is taken from."""

STRENGTHS = (1.0, 10.0)
"""Inverse penalties of the logistic regression to choose from."""

FOLDS = 5
ROWS = 2048
FAR = 1e9


@dataclass(frozen=True, eq=False)
class Source:
    """A group of J features, and what was learned about the K classes from it.

    Parameters
    ----------
    columns : ndarray of int, shape (J,)
        Which features.
    means : ndarray of float64, shape (J,)
        Means over the training cases, in the units of the features.
    scales : ndarray of float64, shape (J,)
        Their standard deviations; 1 for a feature that never changed.
    weights : ndarray of float64, shape (J + 1, K)
        Weights of evidence of the standardised features, in nats; the constants last.
    remembered : ndarray of float64, shape (M, J)
        Standardised training cases, missing features NaN.
    reach : float
        Mean squared distance per feature to the nearest remembered case that is still familiar, in squared
        standard deviations: twice what 95 % of the training cases keep to.
    """

    columns: NDArray[np.intp]
    means: Array
    scales: Array
    weights: Array
    remembered: Array
    reach: float

    def standardised(self, X: Array) -> Array:
        """The source's features in standard deviations from their means.

        Parameters
        ----------
        X : ndarray of float64, shape (N, all features)
            Cases, missing features NaN.

        Returns
        -------
        ndarray of float64, shape (N, J)
            Missing features NaN.
        """
        return (X[:, self.columns] - self.means) / self.scales

    def evidence(self, X: Array, frame: Frame) -> MassFunction:
        """Belief about the class of each case.

        Parameters
        ----------
        X : ndarray of float64, shape (N, all features)
            Cases, missing features NaN.
        frame : Frame
            The K classes.

        Returns
        -------
        MassFunction
            Batch shape (N,), in the layout ``singletons``; all on the frame where every feature is missing.
        """
        z = self.standardised(X)
        p, trust = np.empty((len(z), len(frame))), np.empty(len(z))
        for at in range(0, len(z), ROWS):
            rows = slice(at, at + ROWS)
            apart = np.nan_to_num(squared_distances(z[rows], self.remembered), nan=np.inf)
            p[rows] = self._probabilities(z[rows], apart)
            near = apart.min(axis=1)
            beyond = np.where(np.isfinite(near), near / self.reach - 1.0, 0.0)
            lost = np.isnan(z[rows]).mean(axis=1)
            trust[rows] = TRUST * (1.0 - lost**4) * np.exp(-np.maximum(beyond, 0.0))
        return from_probabilities(frame, p, reliability=trust)

    def _probabilities(self, z: Array, apart: Array) -> Array:
        """Probabilities (n, K), averaged over what the missing features could have been."""
        missing = np.isnan(z)
        logits = np.nan_to_num(z) @ self.weights[:-1] + self.weights[-1]
        p = _softmax(logits)
        rows = np.flatnonzero(missing.any(axis=1) & ~missing.all(axis=1))
        if not len(rows):
            return p
        count = min(DONORS, apart.shape[1])
        donors = np.argpartition(apart[rows], count - 1, axis=1)[:, :count]
        far = np.minimum(np.take_along_axis(apart[rows], donors, axis=1), FAR)
        nearest = far.min(axis=1, keepdims=True)
        share = np.exp(-2.0 * (far - nearest) / (nearest + self.reach))
        lent = np.where(missing[rows][:, None], np.nan_to_num(self.remembered)[donors], 0.0)
        said = _softmax(logits[rows][:, None] + lent @ self.weights[:-1])
        p[rows] = (said * (share / share.sum(axis=1, keepdims=True))[..., None]).sum(axis=1)
        return p


def _softmax(logits: Array) -> Array:
    raised = np.exp(logits - logits.max(axis=-1, keepdims=True))
    return raised / raised.sum(axis=-1, keepdims=True)


def squared_distances(a: Array, b: Array) -> Array:
    """Mean squared distance per feature that both cases have.

    Parameters
    ----------
    a : ndarray of float64, shape (N, J)
        Cases, missing features NaN.
    b : ndarray of float64, shape (M, J)
        Cases, missing features NaN.

    Returns
    -------
    ndarray of float64, shape (N, M)
        NaN for two cases without a common feature.
    """
    if not (np.isnan(a).any() or np.isnan(b).any()):
        apart = (a * a).sum(axis=1)[:, None] - 2.0 * (a @ b.T) + (b * b).sum(axis=1)
        return np.maximum(apart, 0.0) / a.shape[1]
    here, there = ~np.isnan(a) + 0.0, ~np.isnan(b) + 0.0
    x, y = np.nan_to_num(a), np.nan_to_num(b)
    total = (x * x) @ there.T - 2.0 * (x @ y.T) + here @ (y * y).T
    shared = here @ there.T
    return np.where(shared > 0, np.maximum(total, 0.0) / np.maximum(shared, 1.0), np.nan)


def learn_source(
    X: Array, codes: Codes, classes: int, columns: NDArray[np.intp], strength: float, seed: int
) -> Source:
    """Learn what a group of features says.

    Parameters
    ----------
    X : ndarray of float64, shape (N, all features)
        Training cases, missing features NaN.
    codes : ndarray of int, shape (N,)
        Class of each case.
    classes : int
        Number of classes K.
    columns : ndarray of int, shape (J,)
        Which features make the source.
    strength : float
        Inverse penalty of the logistic regression, positive.
    seed : int
        Seed of the choice of remembered cases.

    Returns
    -------
    Source
        What was learned.
    """
    own = X[:, columns]
    there = ~np.isnan(own)
    count = np.maximum(there.sum(axis=0), 1)
    means = np.where(there, own, 0.0).sum(axis=0) / count
    scales = np.sqrt(np.where(there, (own - means) ** 2, 0.0).sum(axis=0) / count)
    scales[~(scales > 0)] = 1.0
    z = (own - means) / scales
    rng = np.random.default_rng(seed)
    kept = np.sort(rng.permutation(len(z))[:REMEMBERED])
    apart = squared_distances(z[kept], z[kept])
    np.fill_diagonal(apart, np.nan)
    nearest = np.nan_to_num(apart, nan=np.inf).min(axis=1)
    usual = nearest[np.isfinite(nearest)]
    reach = 2.0 * float(np.quantile(usual, 0.95)) if len(usual) else 1.0
    weights = _weights(np.nan_to_num(z), codes, classes, strength)
    return Source(columns, means, scales, weights, z[kept], max(reach, 1e-6))


def _weights(z: Array, codes: Codes, classes: int, strength: float) -> Array:
    """Coefficients and constants of a logistic regression, a column for each class."""
    found = np.unique(codes)
    out = np.zeros((z.shape[1] + 1, classes))
    if len(found) < 2:
        return out
    model: Any = LogisticRegression(C=strength, tol=1e-2, max_iter=200).fit(z, codes)
    rows = np.concatenate([model.coef_, model.intercept_[:, None]], axis=1).T
    out[-1] = -10.0
    out[:, found] = np.concatenate([-rows, rows], axis=1) / 2 if len(found) == 2 else rows
    return out


def cross_fitted(
    X: Array, codes: Codes, frame: Frame, columns: NDArray[np.intp], seed: int
) -> tuple[MassFunction, float]:
    """Evidence about training cases from sources that have not learned from them.

    Parameters
    ----------
    X : ndarray of float64, shape (N, all features)
        Training cases, missing features NaN.
    codes : ndarray of int, shape (N,)
        Class of each case.
    frame : Frame
        The K classes.
    columns : ndarray of int, shape (J,)
        Which features make the source.
    seed : int
        Seed of the folds.

    Returns
    -------
    MassFunction
        Batch shape (N,). The only case of a class can't be held out: its evidence counts half.
    float
        Which of ``STRENGTHS`` gave it: the one that found the truth likelier.
    """
    if len(frame) == 1:
        return MassFunction.vacuous(frame, (len(X),)), STRENGTHS[0]
    fold_of = folds_of(codes, FOLDS, seed)
    best: tuple[float, MassFunction, float] | None = None
    for strength in STRENGTHS:
        masses = np.zeros((len(X), len(frame) + 1))
        for fold in np.unique(fold_of):
            out = fold_of == fold
            learn = ~out if fold >= 0 else np.ones(len(X), dtype=bool)
            source = learn_source(X[learn], codes[learn], len(frame), columns, strength, seed)
            masses[out] = source.evidence(X[out], frame).masses
            if fold < 0:
                masses[out, :-1] /= 2
                masses[out, -1] = 1.0 - masses[out, :-1].sum(axis=1)
        told = MassFunction.trusted(frame, singleton_sets(len(frame)), masses, "singletons")
        loss = -float(np.log(pignistic(told)[np.arange(len(X)), codes] + 1e-6).mean())
        if best is None or loss < best[0]:
            best = (loss, told, strength)
    assert best is not None
    return best[1], best[2]
