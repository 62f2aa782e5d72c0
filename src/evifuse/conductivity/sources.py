"""What a group of features says about the class of a case: evidence learned from labelled cases.

Our own arrangement. A logistic regression gives probabilities; they are trusted as far as features are
present and the case is near something that was learned. Needs the extra ``learn``.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.belief import Frame, MassFunction
from evifuse.belief.masses_from import from_probabilities
from evifuse.conductivity.train import folds_of
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
"""Training cases that are kept to know what is familiar."""

FOLDS = 5


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
        Mean squared distance per feature from one case to the nearest other that is still usual, in squared
        standard deviations.
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
        logits = np.nan_to_num(z) @ self.weights[:-1] + self.weights[-1]
        logits -= logits.max(axis=1, keepdims=True)
        p = np.exp(logits)
        p /= p.sum(axis=1, keepdims=True)
        return from_probabilities(frame, p, reliability=TRUST * self.presence(z) * self.familiarity(z))

    def presence(self, z: Array) -> Array:
        """How much of what the features can say is there.

        Parameters
        ----------
        z : ndarray of float64, shape (N, J)
            Standardised cases.

        Returns
        -------
        ndarray of float64, shape (N,)
            0 where nothing is present, 1 where everything is.
        """
        says = (self.weights[:-1] ** 2).sum(axis=1) + 1e-12
        lost = np.isnan(z) @ (says / says.sum())
        return 1.0 - np.clip(lost, 0.0, 1.0) ** 4

    def familiarity(self, z: Array) -> Array:
        """How near a case is to something that was learned.

        Parameters
        ----------
        z : ndarray of float64, shape (N, J)
            Standardised cases.

        Returns
        -------
        ndarray of float64, shape (N,)
            1 within the usual reach of a training case, falling to 0 beyond.
        """
        near = np.nan_to_num(squared_distances(z, self.remembered), nan=np.inf).min(axis=1)
        beyond = np.where(np.isfinite(near), near / self.reach - 1.0, 0.0)
        return np.exp(-np.maximum(beyond, 0.0))


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
    here, there = ~np.isnan(a) + 0.0, ~np.isnan(b) + 0.0
    x, y = np.nan_to_num(a), np.nan_to_num(b)
    total = (x * x) @ there.T - 2.0 * (x @ y.T) + here @ (y * y).T
    shared = here @ there.T
    return np.where(shared > 0, np.maximum(total, 0.0) / np.maximum(shared, 1.0), np.nan)


def learn_source(X: Array, codes: Codes, classes: int, columns: NDArray[np.intp], seed: int) -> Source:
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
    reach = float(np.quantile(usual, 0.95)) if len(usual) else 1.0
    return Source(
        columns, means, scales, _weights(np.nan_to_num(z), codes, classes), z[kept], max(reach, 1e-6)
    )


def _weights(z: Array, codes: Codes, classes: int) -> Array:
    """Coefficients and constants of a logistic regression, a column for each class."""
    found = np.unique(codes)
    out = np.zeros((z.shape[1] + 1, classes))
    if len(found) < 2:
        return out
    model: Any = LogisticRegression(tol=1e-2, max_iter=200).fit(z, codes)
    rows = np.concatenate([model.coef_, model.intercept_[:, None]], axis=1).T
    out[-1] = -10.0
    out[:, found] = np.concatenate([-rows, rows], axis=1) / 2 if len(found) == 2 else rows
    return out


def cross_fitted(X: Array, codes: Codes, frame: Frame, columns: NDArray[np.intp], seed: int) -> MassFunction:
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
    """
    if len(frame) == 1:
        return MassFunction.vacuous(frame, (len(X),))
    fold_of = folds_of(codes, FOLDS, seed)
    masses = np.zeros((len(X), len(frame) + 1))
    sets = None
    for fold in np.unique(fold_of):
        out = fold_of == fold
        learn = ~out if fold >= 0 else np.ones(len(X), dtype=bool)
        said = learn_source(X[learn], codes[learn], len(frame), columns, seed).evidence(X[out], frame)
        sets = said.focal_sets
        masses[out] = said.masses
        if fold < 0:
            masses[out, :-1] /= 2
            masses[out, -1] = 1.0 - masses[out, :-1].sum(axis=1)
    assert sets is not None
    return MassFunction.trusted(frame, sets, masses, "singletons")
