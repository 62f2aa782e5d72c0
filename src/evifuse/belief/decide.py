"""From belief to a decision: which hypothesis, which act, or none."""

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evifuse.belief.frame import Frame
from evifuse.belief.mass import MassFunction
from evifuse.belief.transform import pignistic
from evifuse.errors import ConflictError, MassError

__all__ = [
    "REJECTED",
    "Expectation",
    "decide",
    "expected_cost",
    "maximum_belief",
    "maximum_pignistic",
    "maximum_plausibility",
    "names_of",
]

Array = NDArray[np.float64]
Chosen = NDArray[np.intp]
Expectation = Literal["pignistic", "lower", "upper"]
"""How costs are averaged: by pignistic probability, at best, or at worst."""

REJECTED = -1
"""Index of the decision not to decide."""


def maximum_pignistic(m: MassFunction) -> Chosen:
    """The hypothesis of the largest pignistic probability (Smets 1994): least expected error.

    Parameters
    ----------
    m : MassFunction
        Masses, batch shape ``(...)``.

    Returns
    -------
    ndarray of int, shape (...)
        Index of the hypothesis; the first in the frame's order among equals.

    Raises
    ------
    ConflictError
        If all mass is on the empty set.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> frame = Frame(["a", "b", "c"])
    >>> m = MassFunction.of(frame, {"a": 0.3, ("b", "c"): 0.5, "b": 0.2})
    >>> [names_of(frame, rule(m)) for rule in (maximum_pignistic, maximum_belief, maximum_plausibility)]
    ['b', 'a', 'b']
    """
    return np.asarray(pignistic(m).argmax(axis=-1))


def maximum_belief(m: MassFunction) -> Chosen:
    """The hypothesis of the largest belief: the cautious choice, least upper expected error.

    Parameters
    ----------
    m : MassFunction
        Masses, batch shape ``(...)``.

    Returns
    -------
    ndarray of int, shape (...)
        Index of the hypothesis; the first in the frame's order among equals, as where no single hypothesis
        has any belief.

    Raises
    ------
    ConflictError
        If all mass is on the empty set.
    """
    return np.asarray(_intervals(m)[0].argmax(axis=-1))


def maximum_plausibility(m: MassFunction) -> Chosen:
    """The hypothesis of the largest plausibility: the bold choice, least lower expected error.

    Parameters
    ----------
    m : MassFunction
        Masses, batch shape ``(...)``.

    Returns
    -------
    ndarray of int, shape (...)
        Index of the hypothesis; the first in the frame's order among equals.

    Raises
    ------
    ConflictError
        If all mass is on the empty set.
    """
    return np.asarray(_intervals(m)[1].argmax(axis=-1))


def expected_cost(m: MassFunction, costs: ArrayLike, kind: Expectation = "pignistic") -> Array:
    """Expected cost of every act.

    Parameters
    ----------
    m : MassFunction
        Masses over K hypotheses, batch shape ``(...)``. Mass on the empty set is divided out.
    costs : array_like of float, shape (A, K)
        Cost of act a if hypothesis k is the case.
    kind : {"pignistic", "lower", "upper"}
        A focal set counts the mean, the least or the largest of its members' costs: expectation by pignistic
        probability (Smets 1994), or the bounds over all compatible probabilities (Dempster 1967).

    Returns
    -------
    ndarray of float64, shape (..., A)
        Expected costs, lower <= pignistic <= upper.

    Raises
    ------
    MassError
        If the costs are not finite, not of that shape, or ``kind`` is none of the three.
    ConflictError
        If all mass is on the empty set.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> m = MassFunction.of(Frame(["ripe", "raw"]), {"ripe": 0.5, ("ripe", "raw"): 0.5})
    >>> costs = [[0, 10], [1, 1]]  # pick, wait
    >>> [expected_cost(m, costs, kind).tolist() for kind in ("lower", "pignistic", "upper")]
    [[0.0, 1.0], [2.5, 1.0], [5.0, 1.0]]
    >>> int(decide(m, costs, "lower")), int(decide(m, costs, "upper"))
    (0, 1)
    """
    if kind == "pignistic":
        return pignistic(m) @ cost_table(m, costs).T
    if kind == "lower":
        return bounded_expectation(m, cost_table(m, costs), np.minimum, np.inf)
    if kind == "upper":
        return bounded_expectation(m, cost_table(m, costs), np.maximum, -np.inf)
    raise MassError(f"no expectation {kind!r}: it is 'pignistic', 'lower' or 'upper'")


def decide(
    m: MassFunction, costs: ArrayLike, kind: Expectation = "pignistic", *, rejection: float | None = None
) -> Chosen:
    """The act of the least expected cost, or none if rejecting is cheaper.

    Parameters
    ----------
    m : MassFunction
        Masses over K hypotheses, batch shape ``(...)``.
    costs : array_like of float, shape (A, K)
        Cost of act a if hypothesis k is the case.
    kind : {"pignistic", "lower", "upper"}
        How costs are averaged: `expected_cost`.
    rejection : float, optional
        Cost of not deciding (Chow 1970; Denœux 1997 for belief functions). Without it something is decided.

    Returns
    -------
    ndarray of int, shape (...)
        Index of the act, or -1 for rejection: the first act among equals, and an act rather than a rejection
        of equal cost.

    Raises
    ------
    MassError
        If the costs are not finite, not of that shape, or ``kind`` is none of the three.
    ConflictError
        If all mass is on the empty set.
    """
    expected = expected_cost(m, costs, kind)
    best = np.asarray(expected.argmin(axis=-1))
    if rejection is None:
        return best
    if not np.isfinite(rejection):
        raise MassError(
            f"the cost of rejection is {rejection}: give a finite number, or none to decide always"
        )
    return np.where(expected.min(axis=-1) > rejection, REJECTED, best)


def names_of(frame: Frame, chosen: ArrayLike, rejected: str = "rejected") -> Any:
    """Names of decisions, nested like their batch.

    Parameters
    ----------
    frame : Frame
        K hypotheses, or acts that are named like a frame.
    chosen : array_like of int, shape (...), or of bool, shape (..., K)
        Indices, -1 for rejection; or which hypotheses are undominated.
    rejected : str
        What to call a rejection.

    Returns
    -------
    str, tuple of str, or nested list of them
        The name of an index, the names of a set.

    Raises
    ------
    MassError
        If an index is outside the frame or the last dimension is not K.

    Examples
    --------
    >>> names_of(Frame(["a", "b"]), [[0, 1], [-1, 0]])
    [['a', 'b'], ['rejected', 'a']]
    """
    values = np.asarray(chosen)
    if values.dtype != bool:
        bad = (values < REJECTED) | (values >= len(frame))
        if bad.any():
            raise MassError(f"index {values[bad][0]} is none of the {len(frame)} hypotheses of {frame}")
        names = np.array([*frame.hypotheses, rejected], dtype=object)  # -1 is the last one
        return names[values].tolist() if values.ndim else names[values]
    if values.shape[-1:] != (len(frame),):
        raise MassError(
            f"choices of shape {values.shape} are not sets of the {len(frame)} hypotheses of {frame}"
        )
    if values.ndim > 1:
        return [names_of(frame, part) for part in values]
    return tuple(name for name, yes in zip(frame.hypotheses, values, strict=True) if yes)


def cost_table(m: MassFunction, costs: ArrayLike | None) -> Array:
    """A cost matrix that was checked; 1 for a wrong hypothesis without one."""
    count = len(m.frame)
    if costs is None:
        return 1.0 - np.eye(count)
    try:
        table = np.asarray(costs, dtype=np.float64)
    except (TypeError, ValueError):
        raise MassError(f"costs must be numbers of shape (acts, {count}), not {costs!r}") from None
    if table.ndim != 2 or table.shape[1] != count or not len(table):
        raise MassError(f"costs over {count} hypotheses need the shape (acts, {count}), not {table.shape}")
    if not np.isfinite(table).all():
        act, where = np.argwhere(~np.isfinite(table))[0].tolist()
        raise MassError(f"the cost of act {act} under {m.frame.hypotheses[where]!r} is {table[act, where]}")
    return table


def _total(m: MassFunction) -> Array:
    total = np.asarray(m.where(m.focal_sets != 0))
    if np.any(total <= 0):
        raise ConflictError("all mass is on the empty set: there is nothing to decide by")
    return total


def _intervals(m: MassFunction) -> tuple[Array, Array]:
    """Belief and plausibility of every hypothesis, shape (..., K)."""
    _total(m)
    sets = m.focal_sets
    low = [m.where(sets == 1 << k) for k in range(len(m.frame))]
    high = [m.where(sets >> k & 1 != 0) for k in range(len(m.frame))]
    return np.stack(low, axis=-1), np.stack(high, axis=-1)


def bounded_expectation(
    m: MassFunction, table: Array, extreme: Callable[[Any, Any], Any], start: float
) -> Array:
    """Sums over focal sets of mass times the extreme cost of their members, shape (..., A)."""
    total = _total(m)
    out = np.empty((*m.batch, len(table)))
    for act, row in enumerate(table):
        worth = np.full(m.focal_sets.shape, start)
        for k, cost in enumerate(row):
            worth = np.where(m.focal_sets >> k & 1, extreme(worth, cost), worth)
        worth = np.where(m.focal_sets == 0, 0.0, worth)
        out[..., act] = (m.masses * worth).sum(axis=-1) / total
    return out
