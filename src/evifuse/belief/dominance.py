"""Which acts, or hypotheses, are still in the running: those that no other dominates."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evifuse.belief.decide import bounded_expectation, cost_table
from evifuse.belief.mass import MassFunction

__all__ = ["bound_dominance", "interval_dominance", "maximality"]

Array = NDArray[np.float64]
Kept = NDArray[np.bool_]

SLACK = 1e-12
"""Differences of expected costs below this, times the largest cost, are rounding."""


def interval_dominance(m: MassFunction, costs: ArrayLike | None = None) -> Kept:
    """Acts that no other surely beats: strong, or interval, dominance.

    An act is dominated if another's upper expected cost is below its lower one. Without costs the acts are
    the hypotheses, and one is dominated if the belief of another exceeds its plausibility.

    Parameters
    ----------
    m : MassFunction
        Masses over K hypotheses, batch shape ``(...)``.
    costs : array_like of float, shape (A, K), optional
        Cost of act a if hypothesis k is the case; 1 for a wrong hypothesis without it.

    Returns
    -------
    ndarray of bool, shape (..., A)
        True for undominated acts, at least one (Troffaes 2007, Denœux 2019). Equals don't dominate each
        other.

    Raises
    ------
    MassError
        If the costs are not finite or not of that shape.
    ConflictError
        If all mass is on the empty set.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> frame = Frame(["a", "b", "c"])
    >>> m = MassFunction.of(frame, {"a": 0.4, ("a", "b"): 0.4, "c": 0.2})
    >>> from evifuse.belief.decide import names_of
    >>> names_of(frame, interval_dominance(m)), names_of(frame, bound_dominance(m))
    (('a', 'b'), ('a',))
    """
    lower, upper, slack = _bounds(m, costs)
    return ~(upper.min(axis=-1, keepdims=True) < lower - slack)


def bound_dominance(m: MassFunction, costs: ArrayLike | None = None) -> Kept:
    """Acts that no other beats both at best and at worst: weak, or interval bound, dominance.

    An act is dominated if another's lower and upper expected costs are both no larger and one of
    them smaller.

    Parameters
    ----------
    m : MassFunction
        Masses over K hypotheses, batch shape ``(...)``.
    costs : array_like of float, shape (A, K), optional
        Cost of act a if hypothesis k is the case; 1 for a wrong hypothesis without it.

    Returns
    -------
    ndarray of bool, shape (..., A)
        True for undominated acts, at least one: a subset of those of `interval_dominance` (Destercke 2010,
        Denœux 2019). Equals don't dominate each other.

    Raises
    ------
    MassError
        If the costs are not finite or not of that shape.
    ConflictError
        If all mass is on the empty set.
    """
    lower, upper, slack = _bounds(m, costs)
    below = lower[..., :, None] - lower[..., None, :]  # [..., act, other]
    above = upper[..., :, None] - upper[..., None, :]
    worse = (below >= -slack) & (above >= -slack) & ((below > slack) | (above > slack))
    return np.logical_not(worse.any(axis=-1))


def maximality(m: MassFunction, costs: ArrayLike | None = None) -> Kept:
    """Acts that none is better than under every compatible probability (Walley 1991).

    An act is dominated if changing to another surely pays: the upper expectation of the other's cost minus
    its own is negative.

    Parameters
    ----------
    m : MassFunction
        Masses over K hypotheses, batch shape ``(...)``.
    costs : array_like of float, shape (A, K), optional
        Cost of act a if hypothesis k is the case; 1 for a wrong hypothesis without it.

    Returns
    -------
    ndarray of bool, shape (..., A)
        True for undominated acts, at least one: a subset of those of `interval_dominance`. Equals don't
        dominate each other.

    Raises
    ------
    MassError
        If the costs are not finite or not of that shape.
    ConflictError
        If all mass is on the empty set.
    """
    table = cost_table(m, costs)
    slack = SLACK * np.abs(table).max()
    kept = np.ones((*m.batch, len(table)), dtype=bool)
    for act, own in enumerate(table):
        gain = bounded_expectation(m, table - own, np.maximum, -np.inf)
        kept[..., act] = ~(gain < -slack).any(axis=-1)
    return kept


def _bounds(m: MassFunction, costs: ArrayLike | None) -> tuple[Array, Array, float]:
    """Lower and upper expected costs, and what counts as equal."""
    table = cost_table(m, costs)
    lower = bounded_expectation(m, table, np.minimum, np.inf)
    upper = bounded_expectation(m, table, np.maximum, -np.inf)
    return lower, upper, SLACK * float(np.abs(table).max())
