"""What a mass function says about a set: mass, belief, plausibility, commonality, and the pignistic share."""

import numpy as np
from numpy.typing import NDArray

from evifuse.belief.frame import Subset
from evifuse.belief.mass import MassFunction
from evifuse.errors import ConflictError

__all__ = ["belief", "commonality", "mass", "pignistic", "plausibility"]


def mass(m: MassFunction, subset: Subset) -> NDArray[np.float64]:
    """Mass committed to exactly this set: ``m(A)``.

    Parameters
    ----------
    m : MassFunction
        Masses, batch shape ``(...)``.
    subset : str, iterable of str, int or Frame
        The set A.

    Returns
    -------
    ndarray of float64, shape (...)
        ``m(A)``, 0 if A is not focal.

    Raises
    ------
    FrameError
        If the set names a hypothesis that the frame does not have.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> m = MassFunction.of(Frame(["a", "b", "c"]), {"a": 0.5, ("a", "b"): 0.25, ("a", "b", "c"): 0.25})
    >>> float(mass(m, "a")), float(belief(m, ["a", "b"]))
    (0.5, 0.75)
    >>> float(plausibility(m, "b")), float(commonality(m, "b"))
    (0.5, 0.5)
    """
    return m.where(m.focal_sets == m.frame.mask(subset))


def belief(m: MassFunction, subset: Subset) -> NDArray[np.float64]:
    """Mass that implies the set: ``bel(A)``, the sum of m(B) over non-empty B within A (Shafer 1976).

    Parameters
    ----------
    m : MassFunction
        Masses, batch shape ``(...)``.
    subset : str, iterable of str, int or Frame
        The set A.

    Returns
    -------
    ndarray of float64, shape (...)
        ``bel(A)``, in [0, 1].

    Raises
    ------
    FrameError
        If the set names a hypothesis that the frame does not have.
    """
    return m.where((m.focal_sets & ~m.frame.mask(subset) == 0) & (m.focal_sets != 0))


def plausibility(m: MassFunction, subset: Subset) -> NDArray[np.float64]:
    """Mass that does not contradict the set: ``pl(A)``, the sum of m(B) over B that meet A (Shafer 1976).

    Parameters
    ----------
    m : MassFunction
        Masses, batch shape ``(...)``.
    subset : str, iterable of str, int or Frame
        The set A.

    Returns
    -------
    ndarray of float64, shape (...)
        ``pl(A)``, in [bel(A), 1].

    Raises
    ------
    FrameError
        If the set names a hypothesis that the frame does not have.
    """
    return m.where(m.focal_sets & m.frame.mask(subset) != 0)


def commonality(m: MassFunction, subset: Subset) -> NDArray[np.float64]:
    """Mass that can move to every member of the set: ``q(A)``, the sum of m(B) over B that hold A.

    Parameters
    ----------
    m : MassFunction
        Masses, batch shape ``(...)``.
    subset : str, iterable of str, int or Frame
        The set A.

    Returns
    -------
    ndarray of float64, shape (...)
        ``q(A)``, in [0, 1] (Shafer 1976).

    Raises
    ------
    FrameError
        If the set names a hypothesis that the frame does not have.
    """
    mask = m.frame.mask(subset)
    return m.where(m.focal_sets & mask == mask)


def pignistic(m: MassFunction) -> NDArray[np.float64]:
    """Pignistic probability ``BetP``: every focal set shares its mass equally among its members (Smets 1994).

    Parameters
    ----------
    m : MassFunction
        Masses, batch shape ``(...)``, over K hypotheses. Mass on the empty set (only the conjunctive
        combination leaves any) is divided out.

    Returns
    -------
    ndarray of float64, shape (..., K)
        A probability for each hypothesis, in the frame's order.

    Raises
    ------
    ConflictError
        If all mass is on the empty set.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> pignistic(MassFunction.of(Frame(["a", "b"]), {"a": 0.5, ("a", "b"): 0.5})).tolist()
    [0.75, 0.25]
    """
    members = (m.focal_sets[..., None] >> np.arange(len(m.frame))) & 1
    sizes = members.sum(axis=-1)
    members = members / np.maximum(sizes, 1)[..., None]
    shares = m.masses @ members if members.ndim == 2 else np.einsum("...f,...fk->...k", m.masses, members)
    total = m.where(sizes > 0)[..., None]
    if np.any(total <= 0):
        raise ConflictError("all mass is on the empty set: there is no pignistic probability")
    return shares / total
