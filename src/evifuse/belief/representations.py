"""A whole mass function as belief, plausibility, commonality or implicability, and back.

Every array has one entry for each of the 2^K subsets, in the order of their bitmasks, the empty set first.
All are sums over subsets or supersets, done in K sweeps (Kennes 1992).
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evifuse.belief._lattice import expect_entry, given_array, masses_of, swept
from evifuse.belief.frame import Frame
from evifuse.belief.mass import MassFunction
from evifuse.errors import ConflictError

__all__ = [
    "contour",
    "from_belief",
    "from_commonality",
    "from_implicability",
    "from_plausibility",
    "plausibility_transform",
    "to_belief",
    "to_commonality",
    "to_implicability",
    "to_plausibility",
]

Array = NDArray[np.float64]

RESIDUE = 1e-13
"""What ``bel(frame)`` may lack to 1 through rounding."""


def to_belief(m: MassFunction) -> Array:
    """Belief of every subset: the mass of the non-empty sets within it (Shafer 1976).

    Parameters
    ----------
    m : MassFunction
        Masses over K hypotheses (up to 20), batch shape ``(...)``.

    Returns
    -------
    ndarray of float64, shape (..., 2^K)
        ``bel(A)`` at the bitmask of A.

    Raises
    ------
    MassError
        If the frame has more than 20 hypotheses.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> m = MassFunction.of(Frame(["a", "b"]), {"a": 0.5, ("a", "b"): 0.5})
    >>> to_belief(m).tolist()
    [0.0, 0.5, 0.0, 1.0]
    """
    values = m.to("dense").masses.copy()
    values[..., 0] = 0.0
    return swept("sums_up", values)


def to_implicability(m: MassFunction) -> Array:
    """Implicability of every subset: belief and the mass of the empty set (Smets 1993).

    Parameters
    ----------
    m : MassFunction
        Masses over K hypotheses (up to 20), batch shape ``(...)``.

    Returns
    -------
    ndarray of float64, shape (..., 2^K)
        ``b(A) = bel(A) + m(∅)`` at the bitmask of A.

    Raises
    ------
    MassError
        If the frame has more than 20 hypotheses.
    """
    return swept("sums_up", m.to("dense").masses)


def to_plausibility(m: MassFunction) -> Array:
    """Plausibility of every subset: the mass of the sets that meet it (Shafer 1976).

    Parameters
    ----------
    m : MassFunction
        Masses over K hypotheses (up to 20), batch shape ``(...)``.

    Returns
    -------
    ndarray of float64, shape (..., 2^K)
        ``pl(A)`` at the bitmask of A, summed without a subtraction (our own sweep), so that a plausibility of
        1e-30 has all its digits.

    Raises
    ------
    MassError
        If the frame has more than 20 hypotheses.
    """
    return swept("hits", m.to("dense").masses)


def to_commonality(m: MassFunction) -> Array:
    """Commonality of every subset: the mass of the sets that hold it (Shafer 1976).

    Parameters
    ----------
    m : MassFunction
        Masses over K hypotheses (up to 20), batch shape ``(...)``.

    Returns
    -------
    ndarray of float64, shape (..., 2^K)
        ``q(A)`` at the bitmask of A; the commonalities of sources multiply in the conjunctive combination.

    Raises
    ------
    MassError
        If the frame has more than 20 hypotheses.
    """
    return swept("sums_down", m.to("dense").masses)


def from_belief(frame: Frame, values: ArrayLike) -> MassFunction:
    """Mass function of a belief function.

    Parameters
    ----------
    frame : Frame
        K hypotheses, up to 20.
    values : array_like of float, shape (..., 2^K)
        ``bel(A)`` at the bitmask of A, 0 for the empty set. What ``bel(frame)`` lacks to 1 is the mass of the
        empty set.

    Returns
    -------
    MassFunction
        In the dense layout, batch shape ``(...)``; what is only a residue of rounding is exactly 0.

    Raises
    ------
    MassError
        If the values are not a belief function: the message names the set whose mass would be negative.

    Examples
    --------
    >>> from evifuse.belief import Frame
    >>> from_belief(Frame(["a", "b"]), [0, 0.5, 0, 1])
    MassFunction(a: 0.5, frame: 0.5)
    """
    bel = given_array(frame, values, "the belief")
    expect_entry(frame, bel, 0, 0.0, "the belief")
    empty = np.maximum(1.0 - bel[..., -1:], 0.0)
    empty[empty <= RESIDUE] = 0.0
    return masses_of(frame, "differences_up", bel + empty, bel + empty)


def from_implicability(frame: Frame, values: ArrayLike) -> MassFunction:
    """Mass function of an implicability function.

    Parameters
    ----------
    frame : Frame
        K hypotheses, up to 20.
    values : array_like of float, shape (..., 2^K)
        ``b(A)`` at the bitmask of A, 1 for the frame.

    Returns
    -------
    MassFunction
        In the dense layout, batch shape ``(...)``; what is only a residue of rounding is exactly 0.

    Raises
    ------
    MassError
        If the values are not an implicability function: the message names the set whose mass would be
        negative.
    """
    b = given_array(frame, values, "the implicability")
    expect_entry(frame, b, frame.full, 1.0, "the implicability")
    return masses_of(frame, "differences_up", b, b)


def from_plausibility(frame: Frame, values: ArrayLike) -> MassFunction:
    """Mass function of a plausibility function.

    Parameters
    ----------
    frame : Frame
        K hypotheses, up to 20.
    values : array_like of float, shape (..., 2^K)
        ``pl(A)`` at the bitmask of A, 0 for the empty set. What ``pl(frame)`` lacks to 1 is the mass of the
        empty set.

    Returns
    -------
    MassFunction
        In the dense layout, batch shape ``(...)``; what is only a residue of rounding is exactly 0.

    Raises
    ------
    MassError
        If the values are not a plausibility function: the message names the set whose mass would be negative.
    """
    pl = given_array(frame, values, "the plausibility")
    expect_entry(frame, pl, 0, 0.0, "the plausibility")
    b = 1.0 - pl[..., ::-1]  # the complement of bitmask A is full - A
    return masses_of(frame, "differences_up", b, np.ones_like(b))


def from_commonality(frame: Frame, values: ArrayLike) -> MassFunction:
    """Mass function of a commonality function.

    Parameters
    ----------
    frame : Frame
        K hypotheses, up to 20.
    values : array_like of float, shape (..., 2^K)
        ``q(A)`` at the bitmask of A, 1 for the empty set.

    Returns
    -------
    MassFunction
        In the dense layout, batch shape ``(...)``; what is only a residue of rounding is exactly 0.

    Raises
    ------
    MassError
        If the values are not a commonality function: the message names the set whose mass would be negative.

    Examples
    --------
    >>> from evifuse.belief import Frame
    >>> from_commonality(Frame(["a", "b"]), [1, 1, 0.5, 0.5])
    MassFunction(a: 0.5, frame: 0.5)
    """
    q = given_array(frame, values, "the commonality")
    expect_entry(frame, q, 0, 1.0, "the commonality")
    return masses_of(frame, "differences_down", q, q)


def contour(m: MassFunction) -> Array:
    """Plausibility of each hypothesis alone (Shafer 1976).

    Parameters
    ----------
    m : MassFunction
        Masses over K hypotheses, any number of them, batch shape ``(...)``.

    Returns
    -------
    ndarray of float64, shape (..., K)
        ``pl({h})`` for each hypothesis h, in the frame's order.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> contour(MassFunction.of(Frame(["a", "b"]), {"a": 0.5, ("a", "b"): 0.5})).tolist()
    [1.0, 0.5]
    """
    bits = np.int64(1) << np.arange(len(m.frame), dtype=np.int64)
    return np.stack([m.where(m.focal_sets & bit != 0) for bit in bits], axis=-1)


def plausibility_transform(m: MassFunction) -> Array:
    """Contour scaled to a probability, which is the one that agrees with Dempster's rule.

    Parameters
    ----------
    m : MassFunction
        Masses over K hypotheses, any number of them, batch shape ``(...)``.

    Returns
    -------
    ndarray of float64, shape (..., K)
        A probability for each hypothesis, in the frame's order (Cobb and Shenoy 2006).

    Raises
    ------
    ConflictError
        If all mass is on the empty set.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> m = MassFunction.of(Frame(["a", "b"]), {"a": 0.75, ("a", "b"): 0.25})
    >>> plausibility_transform(m).tolist()
    [0.8, 0.2]
    """
    single = contour(m)
    total = single.sum(axis=-1, keepdims=True)
    if np.any(total <= 0):
        raise ConflictError("all mass is on the empty set: there is no plausibility transform")
    return single / total
