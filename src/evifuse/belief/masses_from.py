"""Where masses come from: probabilities of a classifier, likelihoods, counts and samples."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evifuse.belief._columns import at_index, checked_probabilities, columns, refuse
from evifuse.belief.discount import discount
from evifuse.belief.frame import Frame
from evifuse.belief.mass import MassFunction, singleton_sets
from evifuse.errors import MassError

__all__ = [
    "consonant_from_probabilities",
    "from_counts",
    "from_likelihoods",
    "from_probabilities",
    "from_samples",
]

Array = NDArray[np.float64]


def from_probabilities(
    frame: Frame,
    probabilities: ArrayLike,
    *,
    reliability: ArrayLike | None = None,
    accuracies: ArrayLike | None = None,
    confusion: ArrayLike | None = None,
) -> MassFunction:
    """Probabilities as masses of single hypotheses, trusted as far as you say (Shafer 1976).

    A probability claims to know everything but the outcome: without a reliability nothing is on the frame,
    and two classifiers that differ contradict each other flatly. Say how far the classifier is to be
    believed by at most one of the three options.

    Parameters
    ----------
    frame : Frame
        K hypotheses, in the order of the columns.
    probabilities : array_like of float, shape (..., K)
        As ``predict_proba`` gives them, summing to 1 within 1e-9 (1e-5 in single precision); that rounding
        is divided out.
    reliability : array_like of float, optional
        Plain reliability in [0, 1], broadcast against the batch: ``m(k) = reliability p(k)``.
    accuracies : array_like of float of shape (K,), optional
        How often the classifier is right when it says k, its precision: ``m(k) = accuracies[k] p(k)``.
    confusion : array_like of shape (K, K), optional
        Counts or shares of held-out cases, row the truth and column what was said, as scikit-learn has it;
        accuracies are the diagonal over the column sums (a class that was never said gets 0).

    Returns
    -------
    MassFunction
        In the layout ``singletons``; what is not trusted is on the frame.

    Raises
    ------
    MassError
        If probabilities are not ones, shapes disagree, an option is out of range, or several are given.

    Examples
    --------
    >>> frame = Frame(["cat", "dog"])
    >>> from_probabilities(frame, [0.75, 0.25], accuracies=[1.0, 0.5])
    MassFunction(cat: 0.75, dog: 0.125, frame: 0.125)
    """
    p = checked_probabilities(frame, probabilities)
    if sum(given is not None for given in (reliability, accuracies, confusion)) > 1:
        raise MassError("give one of reliability, accuracies and confusion, not several")
    if reliability is not None:
        trust = np.asarray(reliability, dtype=np.float64)[..., None]
    elif confusion is not None:
        trust = _precisions(frame, confusion)
    else:
        trust = np.asarray(1.0 if accuracies is None else accuracies, dtype=np.float64)
        if trust.shape not in ((), (len(frame),)) or (accuracies is not None and not trust.shape):
            raise MassError(f"{len(frame)} hypotheses need {len(frame)} accuracies, not shape {trust.shape}")
    if not np.all((trust >= 0) & (trust <= 1)):
        raise MassError(f"reliability must be in [0, 1], not {float(trust.ravel()[_first_bad(trust)]):g}")
    try:
        singles = p * trust
    except ValueError:
        raise MassError(
            f"reliability of shape {trust.shape[:-1]} does not fit cases {p.shape[:-1]}"
        ) from None
    if len(frame) == 1:
        return MassFunction.trusted(frame, singleton_sets(1), np.ones_like(singles), "singletons")
    rest = np.broadcast_to((p * (1.0 - trust)).sum(axis=-1, keepdims=True), (*singles.shape[:-1], 1))
    masses = np.concatenate([singles, rest], axis=-1)
    return MassFunction.trusted(frame, singleton_sets(len(frame)), masses, "singletons")


def consonant_from_probabilities(
    frame: Frame, probabilities: ArrayLike, *, reliability: ArrayLike = 1.0
) -> MassFunction:
    """The least committed masses that bet as these probabilities do (Dubois, Prade and Smets 2008).

    Nested focal sets, the i most probable hypotheses with mass ``i (p_i - p_(i+1))``: the inverse of
    `pignistic`, to which it comes back. It claims less than `from_probabilities`, because a bet does not say
    whether it rests on knowledge or on ignorance.

    Parameters
    ----------
    frame : Frame
        K hypotheses, in the order of the columns.
    probabilities : array_like of float, shape (..., K)
        Summing to 1 as for `from_probabilities`.
    reliability : array_like of float
        Plain reliability in [0, 1], broadcast against the batch.

    Returns
    -------
    MassFunction
        Nested focal sets, those of each case its own.

    Raises
    ------
    MassError
        If probabilities are not ones or the reliability is outside [0, 1].

    Examples
    --------
    >>> consonant_from_probabilities(Frame(["cat", "dog", "fox"]), [0.5, 0.25, 0.25])
    MassFunction(frame: 0.75, cat: 0.25)
    """
    p = checked_probabilities(frame, probabilities)
    order, ranked = _ranked(p)
    steps = _drops(ranked) * np.arange(1, len(frame) + 1)
    m = _nested(frame, order, steps / steps.sum(axis=-1, keepdims=True))
    trust = np.asarray(reliability, dtype=np.float64)
    return m if trust.ndim == 0 and trust == 1 else discount(m, reliability=trust)


def from_likelihoods(frame: Frame, likelihoods: ArrayLike, *, logarithms: bool = False) -> MassFunction:
    """Nested masses whose plausibilities are the relative likelihoods (Shafer 1976, chapter 11).

    ``pl(k) = L(k) / max L``: no prior is needed, and a likelihood that favours nothing gives ignorance. The
    result is the least committed one with these plausibilities (Denœux 2014).

    Parameters
    ----------
    frame : Frame
        K hypotheses, in the order of the columns.
    likelihoods : array_like of float, shape (..., K)
        Probability or density of the observation under each hypothesis, not negative, not all 0.
    logarithms : bool
        They are natural logarithms of likelihoods; minus infinity is a likelihood of 0.

    Returns
    -------
    MassFunction
        Nested focal sets, those of each case its own.

    Raises
    ------
    MassError
        If a likelihood is negative or not a number, or all of a case are 0.

    Examples
    --------
    >>> from_likelihoods(Frame(["cat", "dog", "fox"]), [0.02, 0.01, 0.0])
    MassFunction(cat: 0.5, cat|dog: 0.5)
    """
    values = columns(frame, likelihoods, "likelihoods", infinite=logarithms)
    best = values.max(axis=-1, keepdims=True)
    if logarithms:
        bad = ~np.isfinite(best)
    else:
        refuse(frame, values, values < 0, "likelihood", "is negative")
        bad = best <= 0
    if bad.any():
        raise MassError(
            f"all likelihoods{at_index(np.argwhere(bad)[0][:-1])} are 0: no hypothesis explains this"
        )
    relative = np.exp(values - best) if logarithms else values / best
    order, ranked = _ranked(relative)
    return _nested(frame, order, _drops(ranked))


def from_counts(frame: Frame, counts: ArrayLike, *, unseen: float = 2.0) -> MassFunction:
    """Relative frequencies, with a share for what has not been seen yet (imprecise Dirichlet, Walley 1996).

    ``m(k) = n_k / (n + s)`` and ``m(frame) = s / (n + s)``: the upper and lower probabilities of the next
    observation, whatever the prior. No observation is ignorance.

    Parameters
    ----------
    frame : Frame
        K hypotheses, in the order of the columns.
    counts : array_like of float, shape (..., K)
        How often each was observed, not negative; weights may be fractions.
    unseen : float
        Walley's s, positive: as many observations as are needed to halve the ignorance. He proposes 1 or 2.

    Returns
    -------
    MassFunction
        In the layout ``singletons``.

    Raises
    ------
    MassError
        If a count is negative or not a number, or ``unseen`` is not positive.

    Examples
    --------
    >>> from_counts(Frame(["cat", "dog"]), [5, 1])
    MassFunction(cat: 0.625, frame: 0.25, dog: 0.125)
    """
    n = columns(frame, counts, "counts")
    refuse(frame, n, n < 0, "count", "is negative")
    if not 0 < unseen < np.inf:
        raise MassError(f"unseen must be a positive number of observations, not {unseen!r}")
    values = np.concatenate([n, np.full((*n.shape[:-1], 1), float(unseen))], axis=-1)
    masses = values / values.sum(axis=-1, keepdims=True)
    if len(frame) == 1:
        masses = np.ones((*n.shape[:-1], 1))
    return MassFunction.trusted(frame, singleton_sets(len(frame)), masses, "singletons")


def from_samples(frame: Frame, samples: Iterable[Any], *, unseen: float = 2.0) -> MassFunction:
    """Observed outcomes by name, counted: see `from_counts`.

    Parameters
    ----------
    frame : Frame
        What can be observed.
    samples : iterable of str, or array_like of str of shape (..., N)
        N observations of each case; none of them is ignorance.
    unseen : float
        Walley's s, positive: as many observations as are needed to halve the ignorance.

    Returns
    -------
    MassFunction
        Batch shape ``(...)``, in the layout ``singletons``.

    Raises
    ------
    FrameError
        If an observation is not in the frame.
    MassError
        If ``unseen`` is not positive.

    Examples
    --------
    >>> from_samples(Frame(["cat", "dog"]), ["cat", "cat"])
    MassFunction(cat: 0.5, frame: 0.5)
    """
    if isinstance(samples, str):
        raise MassError(f"samples must be a list of names, not the one string {samples!r}")
    names = np.asarray(samples if isinstance(samples, np.ndarray) else list(samples), dtype=object)
    if names.ndim == 0:
        raise MassError(f"samples must be a list of names, not {samples!r}")
    seen: list[Any] = names.ravel().tolist()
    place = {name: frame.mask([name]).bit_length() - 1 for name in dict.fromkeys(seen)}
    rows = np.repeat(np.arange(int(np.prod(names.shape[:-1]))), names.shape[-1])
    counts = np.zeros((*names.shape[:-1], len(frame)))
    places = np.array([place[name] for name in seen], dtype=np.intp)
    np.add.at(counts.reshape(-1, len(frame)), (rows, places), 1.0)
    return from_counts(frame, counts, unseen=unseen)


def _first_bad(trust: Array) -> int:
    return int(np.flatnonzero(~((trust >= 0) & (trust <= 1)))[0])


def _precisions(frame: Frame, confusion: ArrayLike) -> Array:
    table = np.asarray(confusion, dtype=np.float64)
    if table.shape != (len(frame), len(frame)):
        raise MassError(f"{len(frame)} hypotheses need a square confusion matrix, not shape {table.shape}")
    if not (np.isfinite(table).all() and (table >= 0).all()):
        raise MassError("a confusion matrix holds counts: finite numbers, none negative")
    said = table.sum(axis=0)
    return np.diag(table) / np.where(said > 0, said, 1.0)


def _ranked(values: Array) -> tuple[NDArray[np.intp], Array]:
    order = np.argsort(-values, axis=-1, kind="stable")
    return order, np.take_along_axis(values, order, axis=-1)


def _drops(ranked: Array) -> Array:
    """How far each is above the next one, the last above 0."""
    return ranked - np.concatenate([ranked[..., 1:], np.zeros_like(ranked[..., :1])], axis=-1)


def _nested(frame: Frame, order: NDArray[np.intp], masses: Array) -> MassFunction:
    """Masses of the first one, two, ... hypotheses of an order, without the sets that have none."""
    sets = np.cumsum(np.int64(1) << order.astype(np.int64), axis=-1)
    if masses.ndim == 1:
        keep = masses > 0
        return MassFunction.trusted(frame, sets[keep], masses[keep])
    front = np.argsort(masses <= 0, axis=-1, kind="stable")
    width = max(1, int((masses > 0).sum(axis=-1).max(initial=1)))
    masses = np.take_along_axis(masses, front, axis=-1)[..., :width].copy()
    sets = np.take_along_axis(sets, front, axis=-1)[..., :width]
    return MassFunction.trusted(frame, np.where(masses > 0, sets, 0), masses, "padded")
