"""How much a mass function leaves open: measures of non-specificity, and of conflict.

Every function takes masses of batch shape ``(...)`` in any layout and returns an array of that shape. Focal
sets without mass don't count. Logarithms are to base 2 (bits) unless another base is given. Measures of both
kinds together are in `evifuse.belief.entropies`; what each satisfies is in `evifuse.belief.desiderata`.
"""

import numpy as np
from numpy.typing import NDArray

from evifuse.belief._sums import (
    beliefs,
    checked,
    contour,
    cross_entropy,
    over_members,
    plausibilities,
    sizes_of,
    total,
)
from evifuse.belief.mass import MassFunction
from evifuse.belief.transform import pignistic

__all__ = ["confusion", "discord", "dissonance", "nonspecificity", "strife"]

Array = NDArray[np.float64]


def nonspecificity(m: MassFunction, base: float = 2.0) -> Array:
    """How large the focal sets are: ``I = sum m(A) log|A|`` (Dubois and Prade 1985; Hartley's for one set).

    Parameters
    ----------
    m : MassFunction
        Masses, batch shape ``(...)``.
    base : float
        Base of the logarithm.

    Returns
    -------
    ndarray of float64, shape (...)
        0 for a probability, log K for total ignorance over K hypotheses.

    Raises
    ------
    MassError
        If the empty set carries mass, or the base is not a positive number other than 1.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> frame = Frame(["a", "b", "c", "d"])
    >>> m = MassFunction.of(frame, {"a": 0.5, frame: 0.5})
    >>> float(nonspecificity(m)), float(nonspecificity(m, base=4))
    (1.0, 0.5)
    """
    masses, scale = checked(m, base)
    return np.asarray(total(masses * np.log(np.maximum(sizes_of(m), 1))) / scale)


def strife(m: MassFunction, base: float = 2.0) -> Array:
    """Conflict among focal sets: ``S = -sum m(A) log sum_B m(B) |A ∩ B| / |A|`` (Klir and Parviz 1992).

    Parameters
    ----------
    m : MassFunction
        Masses, batch shape ``(...)``.
    base : float
        Base of the logarithm.

    Returns
    -------
    ndarray of float64, shape (...)
        0 for a single focal set, Shannon's entropy for a probability. The inner sum is taken as the mean
        plausibility of the members of A, which it equals.

    Raises
    ------
    MassError
        If the empty set carries mass, or the base is not a positive number other than 1.
    """
    masses, scale = checked(m, base)
    return np.asarray(cross_entropy(masses, over_members(m, contour(m)) / np.maximum(sizes_of(m), 1)) / scale)


def discord(m: MassFunction, base: float = 2.0) -> Array:
    """Conflict among focal sets: ``D = -sum m(A) log sum_B m(B) |A ∩ B| / |B|`` (Klir and Ramer 1990).

    Parameters
    ----------
    m : MassFunction
        Masses, batch shape ``(...)``.
    base : float
        Base of the logarithm.

    Returns
    -------
    ndarray of float64, shape (...)
        0 for a single focal set, Shannon's entropy for a probability. The inner sum is the pignistic
        probability of A.

    Raises
    ------
    MassError
        If the empty set carries mass, or the base is not a positive number other than 1.
    """
    masses, scale = checked(m, base)
    return np.asarray(cross_entropy(masses, over_members(m, pignistic(m))) / scale)


def dissonance(m: MassFunction, base: float = 2.0) -> Array:
    """Conflict of sets that don't meet: ``E = -sum m(A) log pl(A)`` (Yager 1983).

    Parameters
    ----------
    m : MassFunction
        Masses, batch shape ``(...)``.
    base : float
        Base of the logarithm.

    Returns
    -------
    ndarray of float64, shape (...)
        0 if all focal sets share a hypothesis, Shannon's entropy for a probability.

    Raises
    ------
    MassError
        If the empty set carries mass, or the base is not a positive number other than 1.
    """
    masses, scale = checked(m, base)
    return np.asarray(cross_entropy(masses, plausibilities(m)) / scale)


def confusion(m: MassFunction, base: float = 2.0) -> Array:
    """Conflict of sets that don't hold each other: ``C = -sum m(A) log bel(A)`` (Höhle 1982).

    Parameters
    ----------
    m : MassFunction
        Masses, batch shape ``(...)``.
    base : float
        Base of the logarithm.

    Returns
    -------
    ndarray of float64, shape (...)
        0 for a single focal set, Shannon's entropy for a probability.

    Raises
    ------
    MassError
        If the empty set carries mass, or the base is not a positive number other than 1.
    """
    masses, scale = checked(m, base)
    return np.asarray(cross_entropy(masses, beliefs(m)) / scale)
