"""Corrections that know in which context a source errs: discounting, reinforcement, and fitting them."""

from collections.abc import Iterable, Mapping
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evifuse.belief.combine import Combination, aligned, conjunctive, disjunctive
from evifuse.belief.frame import Frame, Subset
from evifuse.belief.mass import DENSE_LIMIT, MassFunction
from evifuse.errors import FrameError, MassError

__all__ = ["Context", "contextual_discounting", "contextual_reinforcement", "fit_reliabilities"]

Context: TypeAlias = str | tuple[str, ...]
"""A context of a correction: one hypothesis by name, or several."""

Array = NDArray[np.float64]
SWEEPS = 500


def contextual_discounting(
    m: MassFunction, *, reliabilities: Mapping[Subset, ArrayLike] | ArrayLike
) -> MassFunction:
    """Trust a source only so far, and how far depends on what is the case (Mercier, Quost, Denoeux 2008).

    In each context A with reliability β, a share 1 - β of every focal set grows by A: the disjunctive
    combination with ``{∅: β, A: 1 - β}``. With one context, the frame, that is plain discounting; with the
    groups of a coarsening, β is how far the source is right when the truth is in that group. Contexts may
    overlap (Mercier, Denoeux, Masson 2010).

    Parameters
    ----------
    m : MassFunction
        The source, batch shape ``(...)``, over K hypotheses.
    reliabilities : mapping of subset to array_like, or array_like of shape (..., K)
        Reliability of each context in [0, 1], broadcast against the batch; without a mapping, of each
        hypothesis in the frame's order.

    Returns
    -------
    MassFunction
        Corrected masses. Each context can double the number of focal sets.

    Raises
    ------
    FrameError
        If a context is not a subset of the frame, is empty or is given twice.
    MassError
        If a reliability is outside [0, 1] or has another shape, or there would be more than 2^20 focal sets.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> m = MassFunction.of(Frame(["cat", "dog", "fox"]), {"cat": 1.0})
    >>> contextual_discounting(m, reliabilities={"dog": 0.75})
    MassFunction(cat: 0.75, cat|dog: 0.25)
    """
    contexts = _contexts(m, reliabilities)
    loose = _loose(m, contexts)
    for mask, trust in contexts.items():
        if trust.ndim == 0 and trust == 1:
            continue
        sets = np.array([0, mask], dtype=np.int64)
        loose = disjunctive(loose, _simple(m.frame, sets, trust)).mass
    return loose.to("dense") if m.layout == "dense" else loose


def contextual_reinforcement(
    m: MassFunction, *, reliabilities: Mapping[Subset, ArrayLike] | ArrayLike
) -> Combination:
    """Sharpen a source that is too vague in known contexts (Pichon, Mercier, Lefèvre, Delmotte 2016).

    The dual of `contextual_discounting`: for each context A with reliability β, a share 1 - β of every focal
    set shrinks to its part within A: the conjunctive combination with ``{A: 1 - β, frame: β}``.

    Parameters
    ----------
    m : MassFunction
        The source, batch shape ``(...)``, over K hypotheses.
    reliabilities : mapping of subset to array_like, or array_like of shape (..., K)
        How far the vagueness about what lies outside each context is to be believed, in [0, 1], broadcast
        against the batch. Without a mapping, entry k is for the context of all hypotheses but k, so that the
        plausibility of hypothesis k is multiplied by it.

    Returns
    -------
    Combination
        Corrected masses, not normalised, and the mass on the empty set: what contradicts the contexts.
        `dempster` with ignorance divides it out.

    Raises
    ------
    FrameError
        If a context is not a subset of the frame, is empty or is given twice.
    MassError
        If a reliability is outside [0, 1] or has another shape.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> vague = MassFunction.vacuous(Frame(["cat", "dog", "fox"]))
    >>> contextual_reinforcement(vague, reliabilities={("cat", "dog"): 0.25}).mass
    MassFunction(cat|dog: 0.75, frame: 0.25)
    """
    contexts = _contexts(m, reliabilities, complements=True)
    sharp = _loose(m, {})
    for mask, trust in contexts.items():
        sets = np.array([mask, m.frame.full], dtype=np.int64)
        sharp = conjunctive(sharp, _simple(m.frame, sets, 1.0 - trust)).mass
    sharp = sharp.to("dense") if m.layout == "dense" else sharp
    return Combination(sharp, sharp.where(sharp.focal_sets == 0))


def fit_reliabilities(
    m: MassFunction,
    labels: Iterable[Any] | MassFunction,
    *,
    contexts: Iterable[Subset] | None = None,
    correction: Literal["discounting", "reinforcement"] = "discounting",
) -> dict[Context, Array]:
    """Reliabilities that bring a source's plausibilities nearest to labelled cases.

    Minimises the sum over cases i and hypotheses k of (pl_i(k) - δ_i(k))², pl the corrected plausibility and
    δ 1 for the label and 0 elsewhere (Mercier, Quost, Denoeux 2008; Pichon et al. 2016). Where no hypothesis
    is touched by two contexts, the least squares have a closed form in [0, 1]. Where contexts overlap, one
    reliability after the other takes its closed form until none moves: no single change is then better, but
    the minimum may be a local one.

    Parameters
    ----------
    m : MassFunction
        What the source said, batch shape ``(..., N)``: N cases; leading dimensions are fitted separately.
    labels : array_like of str of shape (N,) or (..., N), or MassFunction with that batch shape
        The truth of each case by name, or what is known about it, whose plausibilities take the place of δ.
    contexts : iterable of subset, optional
        Each hypothesis (or each complement of one, for reinforcement) without it. ``[frame]`` fits the plain
        reliability of `discount`.
    correction : {"discounting", "reinforcement"}
        Which correction the reliabilities are for.

    Returns
    -------
    dict of str or tuple of str to ndarray of float64, shape (...)
        Reliability of each context, for ``reliabilities=``. It is 1 where the cases say nothing about it.

    Raises
    ------
    FrameError
        If a context or label is not in the frame, or a context is empty or given twice.
    MassError
        If the labels are not one for each case, or there is no case.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> frame = Frame(["cat", "dog"])
    >>> says_cat = MassFunction(frame, ["cat"], [[1.0], [1.0], [1.0], [1.0]])
    >>> {k: float(v) for k, v in fit_reliabilities(says_cat, ["cat", "cat", "cat", "dog"]).items()}
    {'cat': 1.0, 'dog': 0.75}
    """
    if correction not in ("discounting", "reinforcement"):
        raise MassError(f"correction is 'discounting' or 'reinforcement', not {correction!r}")
    dual = correction == "reinforcement"
    given = _default_contexts(m.frame, dual) if contexts is None else list(contexts)
    masks = list(_contexts(m, dict.fromkeys(_hashable(given), 1.0)))
    truth = _truth(m, labels)
    said = contour(m)
    # Both corrections multiply a row r of each touched hypothesis: 1 - pl, or pl itself.
    r, t = (said, truth) if dual else (1.0 - said, 1.0 - truth)
    members = (np.array(masks, dtype=np.int64)[:, None] >> np.arange(len(m.frame)) & 1).astype(bool)
    fitted = _least_squares(r, t, ~members if dual else members)
    return {_context(m.frame, mask): fitted[..., i] for i, mask in enumerate(masks)}


def contour(m: MassFunction) -> Array:
    """Plausibility of each single hypothesis.

    Parameters
    ----------
    m : MassFunction
        Masses, batch shape ``(...)``, over K hypotheses.

    Returns
    -------
    ndarray of float64, shape (..., K)
        The contour function, in [0, 1] (Shafer 1976).
    """
    return np.stack([m.where(m.focal_sets >> k & 1 == 1) for k in range(len(m.frame))], axis=-1)


def _least_squares(r: Array, t: Array, touched: NDArray[np.bool_]) -> Array:
    """Factors x in [0, 1] that bring ``r`` times the product of its x nearest to ``t``, by coordinates.

    Rows (..., N, K); ``touched`` (C, K) says which factor acts on which column. Returns (..., C).
    """
    fitted = np.ones((*r.shape[:-2], len(touched)))
    overlap = bool((touched.sum(axis=0) > 1).any())
    for _ in range(SWEEPS if overlap else 1):
        before = fitted.copy()
        for i, columns in enumerate(touched):
            others = np.where(touched, fitted[..., None], 1.0)
            others[..., i, :] = 1.0
            q = (r * others.prod(axis=-2)[..., None, :])[..., columns]
            top = (q * t[..., columns]).sum(axis=(-2, -1))
            bottom = (q * q).sum(axis=(-2, -1))
            known = bottom > 0
            fitted[..., i] = np.where(known, np.clip(top / np.where(known, bottom, 1.0), 0.0, 1.0), 1.0)
        if np.abs(fitted - before).max(initial=0.0) < 1e-12:
            break
    return fitted


def _truth(m: MassFunction, labels: Iterable[Any] | MassFunction) -> Array:
    if not m.batch or not m.batch[-1]:
        raise MassError(f"fitting needs at least one labelled case, not a batch of shape {m.batch}")
    if isinstance(labels, MassFunction):
        truth = contour(aligned(m, labels))
    else:
        names = np.asarray(labels if isinstance(labels, np.ndarray) else list(labels), dtype=object)
        places = [m.frame.mask(_name(name)).bit_length() - 1 for name in names.ravel()]
        truth = np.eye(len(m.frame))[np.array(places, dtype=np.intp)].reshape(*names.shape, len(m.frame))
    if truth.shape[:-1] not in (m.batch, m.batch[-1:]):
        raise MassError(f"cases of shape {m.batch} need labels of that shape, not {truth.shape[:-1]}")
    return truth


def _name(label: Any) -> str:
    if not isinstance(label, str):
        raise FrameError(f"label {label!r} is not the name of a hypothesis: give names, not positions")
    return label


def _default_contexts(frame: Frame, dual: bool) -> list[Subset]:
    ones: list[Subset] = [1 << k for k in range(len(frame))]
    return [frame.full & ~(1 << k) for k in range(len(frame))] if dual else ones


def _hashable(contexts: list[Subset]) -> list[Subset]:
    return [c if isinstance(c, str | int | Frame) else tuple(c) for c in contexts]


def _context(frame: Frame, mask: int) -> Context:
    names = frame.names(mask)
    return names[0] if len(names) == 1 else names


def _contexts(
    m: MassFunction, reliabilities: Mapping[Subset, ArrayLike] | ArrayLike, complements: bool = False
) -> dict[int, Array]:
    """Reliability by bitmask, checked."""
    frame = m.frame
    if not isinstance(reliabilities, Mapping):
        values = np.asarray(reliabilities, dtype=np.float64)
        if values.ndim == 0 or values.shape[-1] != len(frame):
            raise MassError(
                f"{len(frame)} hypotheses need reliabilities of shape (..., {len(frame)}) or a dict"
            )
        pairs = zip(_default_contexts(frame, complements), np.moveaxis(values, -1, 0), strict=True)
    else:
        pairs = reliabilities.items()
    checked: dict[int, Array] = {}
    for subset, value in pairs:
        mask, trust = frame.mask(subset), np.asarray(value, dtype=np.float64)
        if mask == 0:
            raise FrameError("a context needs at least one hypothesis, not the empty set")
        if mask in checked:
            raise FrameError(f"context {frame.label(mask)!r} is given more than once")
        if not np.all((trust >= 0) & (trust <= 1)):
            raise MassError(f"reliability of {frame.label(mask)!r} must be in [0, 1], not {value!r}")
        try:
            np.broadcast_shapes(trust.shape, m.batch)
        except ValueError:
            raise MassError(
                f"reliability of {frame.label(mask)!r} has shape {trust.shape}, the masses {m.batch}"
            ) from None
        checked[mask] = trust
    return checked


def _loose(m: MassFunction, contexts: Mapping[int, Array]) -> MassFunction:
    """The same masses in a layout that any focal set can join."""
    doublings = sum(bool(np.any(trust < 1)) for trust in contexts.values())
    if len(m.frame) > DENSE_LIMIT and m.masses.shape[-1] << doublings > 1 << DENSE_LIMIT:
        raise MassError(
            f"{doublings} contexts would leave up to {m.masses.shape[-1]} x 2^{doublings} focal sets: "
            "use fewer, coarser contexts"
        )
    layout = "padded" if m.layout == "padded" else "shared"
    return MassFunction.trusted(m.frame, m.focal_sets, m.masses, layout)


def _simple(frame: Frame, sets: NDArray[np.int64], first: Array) -> MassFunction:
    return MassFunction.trusted(frame, sets, np.stack([first, 1.0 - first], axis=-1), "shared")
