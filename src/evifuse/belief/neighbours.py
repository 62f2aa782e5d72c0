"""Evidential nearest neighbours, as a scikit-learn estimator. Needs the extra ``learn``."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.belief.frame import Frame
from evifuse.belief.mass import MassFunction, singleton_sets
from evifuse.errors import MissingExtraError

try:
    from sklearn.base import BaseEstimator, ClassifierMixin
    from sklearn.neighbors import NearestNeighbors
    from sklearn.utils.multiclass import check_classification_targets
    from sklearn.utils.validation import check_is_fitted, validate_data
except ImportError as error:
    raise MissingExtraError(
        "evidential nearest neighbours need scikit-learn: pip install 'evifuse[learn]'"
    ) from error

__all__ = ["EvidentialNeighbours"]

Array = NDArray[np.float64]
_validate: Any = validate_data


class EvidentialNeighbours(ClassifierMixin, BaseEstimator):  # pyright: ignore[reportUntypedBaseClass]
    """Every near neighbour is evidence for its own class, the weaker the farther it is (Denœux 1995).

    A neighbour of class q at distance d gives ``m(q) = confidence exp(-γ_q d²)`` and leaves the rest on the
    frame; Dempster's rule combines the neighbours. Far from all that was learned the result is ignorance,
    where a classifier of probabilities would still be sure.

    Parameters
    ----------
    n_neighbours : int
        How many neighbours speak; all training cases if there are fewer.
    confidence : float
        Mass that a neighbour at distance 0 gives to its class, in (0, 1). Denœux proposes 0.95.
    scale : float or None
        The γ of every class, per squared unit of the features, positive. Without it, one over the mean
        squared distance of two training cases of that class, as Denœux proposes.

    Attributes
    ----------
    classes_ : ndarray of shape (K,)
        The classes, sorted.
    scales_ : ndarray of float64, shape (K,)
        γ of each class.
    n_features_in_ : int
        Number of features J.

    Examples
    --------
    >>> model = EvidentialNeighbours(n_neighbours=2).fit([[0.0], [1.0], [10.0], [11.0]], [0, 0, 1, 1])
    >>> model.predict([[0.4], [10.2]]).tolist()
    [0, 1]
    >>> model.predict_mass([[100.0]])[0]
    MassFunction(frame: 1)
    """

    n_neighbours: int
    confidence: float
    scale: float | None
    classes_: NDArray[Any]
    scales_: Array
    n_features_in_: int

    def __init__(
        self, n_neighbours: int = 5, *, confidence: float = 0.95, scale: float | None = None
    ) -> None:
        self.n_neighbours = n_neighbours
        self.confidence = confidence
        self.scale = scale

    def fit(self, X: Any, y: Any) -> "EvidentialNeighbours":
        """Remember the training cases, and how far cases of each class are apart.

        Parameters
        ----------
        X : array_like of float, shape (N, J)
            Features; bring them to one scale first, since distances mix them.
        y : array_like of shape (N,)
            Class of each case.

        Returns
        -------
        EvidentialNeighbours
            Itself.

        Raises
        ------
        ValueError
            If a parameter is out of range, or the arrays are not what scikit-learn asks of them.
        """
        self._check_parameters()
        cases, labels = _validate(self, X, y, dtype=np.float64)
        check_classification_targets(labels)
        self.classes_, self._codes = np.unique(labels, return_inverse=True)
        count = len(self.classes_)
        if self.scale is None:
            self.scales_ = np.array([_scale(cases[self._codes == k]) for k in range(count)])
        else:
            self.scales_ = np.full(count, float(self.scale))
        self._search = NearestNeighbors(n_neighbors=min(self.n_neighbours, len(cases))).fit(cases)
        return self

    def predict_mass(self, X: Any) -> MassFunction:
        """Belief about the class of each case.

        Parameters
        ----------
        X : array_like of float, shape (N, J)
            Features.

        Returns
        -------
        MassFunction
            Batch shape (N,), over the frame of the classes' names, in the layout ``singletons``.

        Raises
        ------
        FrameError
            If there are more than 62 classes, or two have the same text.
        ValueError
            If it is not fitted, or the features are not those of the fit.
        """
        singles, ignorance = self._evidence(X)
        frame = Frame([str(name) for name in self.classes_.tolist()])
        masses = np.concatenate([singles, ignorance], axis=1)
        if len(frame) == 1:
            masses = np.ones((len(masses), 1))
        return MassFunction.trusted(frame, singleton_sets(len(frame)), masses, "singletons")

    def predict_proba(self, X: Any) -> Array:
        """Pignistic probability of each class: ignorance is shared equally.

        Parameters
        ----------
        X : array_like of float, shape (N, J)
            Features.

        Returns
        -------
        ndarray of float64, shape (N, K)
            Columns in the order of ``classes_``.

        Raises
        ------
        ValueError
            If it is not fitted, or the features are not those of the fit.
        """
        singles, ignorance = self._evidence(X)
        return singles + ignorance / len(self.classes_)

    def predict(self, X: Any) -> NDArray[Any]:
        """The most probable class of each case; the first one in ``classes_`` of equal ones.

        Parameters
        ----------
        X : array_like of float, shape (N, J)
            Features.

        Returns
        -------
        ndarray of shape (N,)
            Members of ``classes_``.

        Raises
        ------
        ValueError
            If it is not fitted, or the features are not those of the fit.
        """
        singles, _ = self._evidence(X)
        return self.classes_[singles.argmax(axis=1)]

    def _evidence(self, X: Any) -> tuple[Array, Array]:
        """Masses of the classes (N, K) and of the frame (N, 1).

        Dempster's rule in closed form: with u_q the product of ``1 - m(q)`` over neighbours of class q,
        ``m(q)`` is proportional to 1/u_q - 1 and the frame to 1. By logarithms, for many neighbours.
        """
        check_is_fitted(self)
        distances, who = self._search.kneighbors(_validate(self, X, dtype=np.float64, reset=False))
        codes = self._codes[who]
        doubts = np.log1p(-self.confidence * np.exp(-self.scales_[codes] * distances**2))
        weights = np.stack(
            [-np.where(codes == k, doubts, 0.0).sum(axis=1) for k in range(len(self.classes_))], axis=1
        )
        most = weights.max(axis=1, keepdims=True)
        singles, ignorance = np.exp(weights - most) * -np.expm1(-weights), np.exp(-most)
        total = singles.sum(axis=1, keepdims=True) + ignorance
        return singles / total, ignorance / total

    def _check_parameters(self) -> None:
        if not isinstance(self.n_neighbours, int | np.integer) or self.n_neighbours < 1:  # pyright: ignore[reportUnnecessaryIsInstance]
            raise ValueError(f"n_neighbours must be a positive whole number, not {self.n_neighbours!r}")
        if not 0 < self.confidence < 1:
            raise ValueError(f"confidence must be above 0 and below 1, not {self.confidence!r}")
        if self.scale is not None and not 0 < self.scale < np.inf:
            raise ValueError(f"scale must be a positive number or None, not {self.scale!r}")


def _scale(cases: Array) -> float:
    """One over the mean squared distance of two different cases; 1 if there are none, or all are the same."""
    if len(cases) < 2:
        return 1.0
    mean = float(2.0 * cases.var(axis=0, ddof=1).sum())  # the variance is half the mean squared difference
    return 1.0 / mean if mean > 0 else 1.0
