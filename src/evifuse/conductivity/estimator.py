"""Conductivity as a scikit-learn estimator: features, evidence of each source, prototypes, fused belief.

Needs the extra ``learn``. Sources and their evidence are our own; their conductivities are joined after
section 5 of the chapter.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.belief import Frame, MassFunction, pignistic
from evifuse.conductivity.aggregate import KnowledgeBase
from evifuse.conductivity.classify import normalised_belief
from evifuse.conductivity.compiled import compile  # noqa: A004
from evifuse.conductivity.reading import Reading
from evifuse.conductivity.sources import Source, cross_fitted, learn_source
from evifuse.conductivity.train import LAYERS, train
from evifuse.errors import MissingExtraError

try:
    from sklearn.base import BaseEstimator, ClassifierMixin
    from sklearn.utils import check_random_state
    from sklearn.utils.multiclass import check_classification_targets
    from sklearn.utils.validation import check_is_fitted, validate_data
except ImportError as error:
    raise MissingExtraError(
        "the conductivity classifier for features needs scikit-learn: pip install 'evifuse[learn]'"
    ) from error

__all__ = ["AGREEMENT", "ConductivityClassifier", "joined"]

Array = NDArray[np.float64]
_validate: Any = validate_data


AGREEMENT = 50.0
"""How much more than their sum it counts that sources conduct into the same class."""


def joined(names: Sequence[str], shares: Sequence[Array]) -> MassFunction:
    """Beliefs of several sources, as each one's conductivities gave them, in one.

    Conductivities of sources add up (section 5), like conductors side by side, and what is passed on to both
    is multiplied (section 5.1), like one behind the other. Our own is to do both: to the sum of the shares
    ``p_s`` comes each product of several, weighed with ``a`` for each further source:
    ``(prod_s (1 + a p_s) - 1) / a``. A source that knows nothing changes nothing.

    Parameters
    ----------
    names : sequence of str
        The K classes.
    shares : sequence of ndarray of float64, shape (N, K)
        Normalised conductivities of each source; their sum is what the source knows.

    Returns
    -------
    MassFunction
        Batch shape (N,). The frame gets what no source knows.
    """
    total, unknown = np.ones_like(shares[0]), np.ones(len(shares[0]))
    for share in shares:
        total *= 1.0 + AGREEMENT * share
        unknown *= np.clip(1.0 - share.sum(axis=1), 0.0, 1.0)
    return normalised_belief(names, (total - 1.0) / AGREEMENT, unknown)


class ConductivityClassifier(ClassifierMixin, BaseEstimator):  # pyright: ignore[reportUntypedBaseClass]
    """Classify by the conductivity of learned evidence into learned prototypes.

    Each source (a group of columns, such as what is seen and what is felt) gives a belief function about the
    class. It is ignorant where its features are missing or unlike all that was learned. Prototypes of each
    class are learned from evidence about cases that the source had not learned from. Conductivities of the
    sources are added and normalised (section 5); where sources agree they count for more (our own).

    Parameters
    ----------
    sources : list of list of int, or None
        Columns of each source; one source with all columns by default.
    reading : Reading or None
        How appendix A is read; chosen by cross-validation by default.
    max_prototypes : int
        At most so many prototypes for each class and source. The evidence is about the classes already, so
        that more than one rarely helps.
    random_state : int, RandomState or None
        Seed of folds and clusters.

    Attributes
    ----------
    classes_ : ndarray of shape (K,)
        The classes, sorted.
    knowledge_ : list of KnowledgeBase
        The prototypes of each source.
    n_features_in_ : int
        Number of features.

    Examples
    --------
    >>> X = [[0.0], [0.2], [0.4], [1.0], [1.2], [1.4]]
    >>> model = ConductivityClassifier().fit(X, ["low", "low", "low", "high", "high", "high"])
    >>> model.predict([[0.1], [1.3]]).tolist()
    ['low', 'high']
    >>> model.predict_mass([[float("nan")]])[0]
    MassFunction(frame: 1)
    """

    sources: Sequence[Sequence[int]] | None
    reading: Reading | None
    max_prototypes: int
    random_state: Any
    classes_: NDArray[Any]
    knowledge_: list[KnowledgeBase]
    n_features_in_: int

    def __init__(
        self,
        *,
        sources: Sequence[Sequence[int]] | None = None,
        reading: Reading | None = None,
        max_prototypes: int = 1,
        random_state: Any = 0,
    ) -> None:
        self.sources = sources
        self.reading = reading
        self.max_prototypes = max_prototypes
        self.random_state = random_state

    def __sklearn_tags__(self) -> Any:
        tags: Any = super().__sklearn_tags__()
        tags.input_tags.allow_nan = True
        return tags

    def fit(self, X: Any, y: Any) -> "ConductivityClassifier":
        """Learn sources and prototypes from labelled cases.

        Parameters
        ----------
        X : array_like of float, shape (N, J)
            Features, NaN where missing.
        y : array_like of shape (N,)
            Class of each case.

        Returns
        -------
        ConductivityClassifier
            Itself.

        Raises
        ------
        ValueError
            If a parameter is out of range, or the arrays are not what scikit-learn asks of them.
        FrameError
            If there are more than 62 classes, or two have the same text.
        """
        cases, labels = _validate(self, X, y, dtype=np.float64, ensure_all_finite="allow-nan")
        check_classification_targets(labels)
        self._columns = self._checked()
        self.classes_, codes = np.unique(labels, return_inverse=True)
        self._frame = Frame([str(name) for name in self.classes_.tolist()])
        seed = int(check_random_state(self.random_state).randint(2**31 - 1))
        self._learned: list[Source] = []
        self.knowledge_ = []
        names = np.array(self._frame.hypotheses)
        for i, columns in enumerate(self._columns):
            told, strength = cross_fitted(cases, codes, self._frame, columns, seed)
            self._learned.append(learn_source(cases, codes, len(self._frame), columns, strength, seed))
            base = train(
                told,
                names[codes],
                reading=LAYERS if self.reading is None else self.reading,
                max_prototypes=self.max_prototypes,
                seed=seed,
                name=f"source {i + 1}",
            )
            self.knowledge_.append(base)
        return self

    def source_evidence(self, X: Any) -> list[MassFunction]:
        """What each source says about each case, before any prototype is met.

        Parameters
        ----------
        X : array_like of float, shape (N, J)
            Features, NaN where missing.

        Returns
        -------
        list of MassFunction
            One for each source: batch shape (N,), over the frame of the classes' names, in the layout
            ``singletons``.

        Raises
        ------
        ValueError
            If it is not fitted, or the features are not those of the fit.
        """
        check_is_fitted(self)
        cases = _validate(self, X, dtype=np.float64, ensure_all_finite="allow-nan", reset=False)
        return [source.evidence(cases, self._frame) for source in self._learned]

    def predict_mass(self, X: Any) -> MassFunction:
        """Belief about the class of each case.

        Parameters
        ----------
        X : array_like of float, shape (N, J)
            Features, NaN where missing.

        Returns
        -------
        MassFunction
            Batch shape (N,), over the frame of the classes' names; all on the frame where no source knows
            anything.

        Raises
        ------
        ValueError
            If it is not fitted, or the features are not those of the fit.
        """
        told = self.source_evidence(X)
        names = self._frame.hypotheses
        if len(names) == 1:
            return told[0]
        shares: list[Array] = []
        for said, base in zip(told, self.knowledge_, strict=True):
            place = [base.classes.index(name) for name in names]
            sigma = compile(base, said.focal_sets).conductivities(said.masses)[:, place]
            ignorance = said.masses[:, -1] if base.reading.keep_ignorance else 0.0
            shares.append(normalised_belief(names, sigma, ignorance).masses[:, :-1])
        return joined(names, shares)

    def predict_proba(self, X: Any) -> Array:
        """Pignistic probability of each class: ignorance is shared equally.

        Parameters
        ----------
        X : array_like of float, shape (N, J)
            Features, NaN where missing.

        Returns
        -------
        ndarray of float64, shape (N, K)
            Columns in the order of ``classes_``.

        Raises
        ------
        ValueError
            If it is not fitted, or the features are not those of the fit.
        """
        return pignistic(self.predict_mass(X))

    def predict(self, X: Any) -> NDArray[Any]:
        """The most probable class of each case; the first one in ``classes_`` of equal ones.

        Parameters
        ----------
        X : array_like of float, shape (N, J)
            Features, NaN where missing.

        Returns
        -------
        ndarray of shape (N,)
            Members of ``classes_``.

        Raises
        ------
        ValueError
            If it is not fitted, or the features are not those of the fit.
        """
        check_is_fitted(self)
        return self.classes_[self.predict_proba(X).argmax(axis=1)]

    def _checked(self) -> list[NDArray[np.intp]]:
        """Columns of each source."""
        most: Any = self.max_prototypes
        if isinstance(most, bool) or not isinstance(most, int | np.integer) or most < 1:
            raise ValueError(f"max_prototypes must be a positive whole number, not {most!r}")
        if self.sources is None:
            return [np.arange(self.n_features_in_)]
        groups = [np.asarray(list(group)) for group in self.sources]
        for i, group in enumerate(groups):
            whole = group.ndim == 1 and len(group) and np.issubdtype(group.dtype, np.integer)
            if not whole or group.min() < 0 or group.max() >= self.n_features_in_:
                raise ValueError(
                    f"source {i} must be a list of columns from 0 to {self.n_features_in_ - 1}, "
                    f"not {group.tolist()!r}"
                )
        if not groups:
            raise ValueError("sources must hold at least one list of columns, or be None")
        return [group.astype(np.intp) for group in groups]
