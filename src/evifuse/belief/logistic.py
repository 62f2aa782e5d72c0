"""Masses from logits: what a logistic regression, or the last layer of a network, says as evidence."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evifuse.belief._columns import columns
from evifuse.belief.frame import Frame
from evifuse.belief.mass import DENSE_LIMIT, MassFunction, every_set, singleton_sets
from evifuse.errors import FrameError, MassError

__all__ = ["from_logistic_regression", "from_logits"]

Array = NDArray[np.float64]


def from_logits(frame: Frame, logits: ArrayLike, *, temperature: float = 1.0) -> MassFunction:
    """Logits as weights of evidence, combined by Dempster's rule (Denœux 2019, one feature for all).

    Each logit, less the mean of all, is a weight of evidence: for its hypothesis if positive, against it if
    negative. The plausibilities of single hypotheses are in the proportions of softmax(logits / temperature),
    and small logits leave mass on the frame. Taking off the mean makes the sum of squared weights least, so
    it claims as little as these probabilities allow.

    Parameters
    ----------
    frame : Frame
        K hypotheses, up to 20, in the order of the columns.
    logits : array_like of float, shape (..., K)
        Natural logarithms of unnormalised probabilities, such as ``decision_function`` of several classes.
    temperature : float
        Positive; above 1 it weakens the evidence of an overconfident classifier (as fitted for calibration).

    Returns
    -------
    MassFunction
        Normalised, in the smallest layout that holds it.

    Raises
    ------
    FrameError
        If there are more than 20 hypotheses.
    MassError
        If a logit is not a finite number, or the temperature is not positive.

    Examples
    --------
    >>> from_logits(Frame(["cat", "dog"]), [np.log(2.0), -np.log(2.0)])
    MassFunction(cat: 0.75, frame: 0.25)
    """
    _small_enough(frame)
    if not 0 < temperature < np.inf:
        raise MassError(f"the temperature must be a positive number, not {temperature!r}")
    values = columns(frame, logits, "logits") / temperature
    weights = values - values.mean(axis=-1, keepdims=True)
    return _evidence(frame, np.maximum(weights, 0.0), np.maximum(-weights, 0.0))


def from_logistic_regression(
    frame: Frame,
    features: ArrayLike,
    coefficients: ArrayLike,
    intercepts: ArrayLike,
    *,
    feature_means: ArrayLike,
) -> MassFunction:
    """Every feature as evidence for and against every class, combined by Dempster's rule (Denœux 2019).

    Unlike `from_logits` this tells conflict between features, which leaves little mass on the frame, from
    lack of evidence, which leaves much. Weights are ``b_jk x_j + a_jk`` with the centred coefficients b and
    the a that make their squares over the training set least (section 4 there, multi-category case).

    Parameters
    ----------
    frame : Frame
        K hypotheses, up to 20, in the order of the rows of the coefficients.
    features : array_like of float, shape (..., J)
        What the classifier was given.
    coefficients : array_like of float, shape (K, J) or (1, J)
        ``coef_`` of scikit-learn; one row, for the second of two classes, will do.
    intercepts : array_like of float, shape (K,) or (1,)
        ``intercept_``.
    feature_means : array_like of float, shape (J,)
        Means of the features in the training set.

    Returns
    -------
    MassFunction
        Normalised, in the smallest layout that holds it. The plausibilities of single hypotheses are in the
        proportions of the classifier's probabilities.

    Raises
    ------
    FrameError
        If there are more than 20 hypotheses.
    MassError
        If shapes disagree or a number is not finite.

    Examples
    --------
    >>> from_logistic_regression(Frame(["no", "yes"]), [0.0], [[2.0]], [0.0], feature_means=[0.0])
    MassFunction(frame: 1)
    """
    _small_enough(frame)
    x, mean = (np.asarray(v, dtype=np.float64) for v in (features, feature_means))
    b, b0 = _both_rows(frame, np.asarray(coefficients, np.float64), np.asarray(intercepts, np.float64))
    if mean.shape != (b.shape[1],) or x.ndim == 0 or x.shape[-1] != b.shape[1]:
        raise MassError(
            f"{b.shape[1]} coefficients need so many features and means, not {x.shape} and {mean.shape}"
        )
    if not all(np.isfinite(v).all() for v in (x, mean, b, b0)):
        raise MassError("features, means, coefficients and intercepts must be finite numbers")
    b, b0 = b - b.mean(axis=0), b0 - b0.mean()
    spread = (b0 + b @ mean) / b.shape[1]  # the constant terms, shared among the features
    weights = x[..., None, :] * b + (spread[:, None] - b * mean)
    return _evidence(frame, np.maximum(weights, 0.0).sum(axis=-1), np.maximum(-weights, 0.0).sum(axis=-1))


def _small_enough(frame: Frame) -> None:
    if len(frame) > DENSE_LIMIT:
        raise FrameError(
            f"evidence against hypotheses needs all subsets: {len(frame)} hypotheses are more than "
            f"{DENSE_LIMIT}; add the probabilities of groups up first"
        )


def _both_rows(frame: Frame, b: Array, b0: Array) -> tuple[Array, Array]:
    """Coefficients with a row for each class."""
    if len(frame) == 2 and b.ndim == 2 and len(b) == 1 and b0.shape == (1,):
        return np.concatenate([-b, b]) / 2, np.concatenate([-b0, b0]) / 2
    if b.ndim != 2 or len(b) != len(frame) or not b.shape[1] or b0.shape != (len(frame),):
        raise MassError(
            f"{len(frame)} hypotheses need coefficients of shape ({len(frame)}, J) and as many intercepts, "
            f"not {b.shape} and {b0.shape}"
        )
    return b, b0


def _evidence(frame: Frame, pro: Array, con: Array) -> MassFunction:
    """Dempster's combination of simple evidence for (``pro``) and against (``con``) each hypothesis.

    By logarithms: over the evidence against, ``m(A)`` is the product of ``1 - exp(-con)`` outside A and
    ``exp(-con)`` inside; over that for, {k} has ``exp(pro) - 1`` times the mass of the frame.
    """
    count = len(frame)
    if count == 1:
        return MassFunction.trusted(frame, singleton_sets(1), np.ones((*pro.shape[:-1], 1)), "singletons")
    with np.errstate(divide="ignore"):
        against, gain = np.log(-np.expm1(-con)), pro + np.log(-np.expm1(-pro))
    logs = np.zeros((*pro.shape[:-1], 1))
    for k in range(count):
        logs = np.concatenate([logs + against[..., k, None], logs - con[..., k, None]], axis=-1)
    logs[..., 0] = -np.inf
    singles = np.int64(1) << np.arange(count)
    logs[..., singles] = np.logaddexp(logs[..., singles], gain - con)
    logs -= logs.max(axis=-1, keepdims=True)
    masses = np.exp(logs, out=logs)
    masses /= masses.sum(axis=-1, keepdims=True)
    return compact(frame, masses)


def compact(frame: Frame, masses: Array) -> MassFunction:
    """Masses over all subsets in the layout that takes least room.

    Parameters
    ----------
    frame : Frame
        K hypotheses, two at least.
    masses : ndarray of float64, shape (..., 2^K)
        In the order of the bitmasks.

    Returns
    -------
    MassFunction
        ``singletons`` if nothing else is focal, ``dense`` if more than half of the subsets are focal in some
        case, ``shared`` else.
    """
    focal = np.asarray(masses.reshape(-1, masses.shape[-1]).any(axis=0))
    single = singleton_sets(len(frame))
    if focal.sum() == focal[single].sum():
        return MassFunction.trusted(frame, single, masses[..., single], "singletons")
    if focal.sum() * 2 > len(focal):
        return MassFunction.trusted(frame, every_set(len(frame)), masses, "dense")
    sets = np.flatnonzero(focal).astype(np.int64)
    return MassFunction.trusted(frame, sets, masses[..., sets], "shared")
