"""Entropies of mass functions: total uncertainty in one number, and the chapter's sums.

Every function takes masses of batch shape ``(...)`` in any layout and returns an array of that shape. Focal
sets without mass don't count. Logarithms are to base 2 (bits) unless another base is given. The fractal-based
entropy is in `evifuse.belief.fractal`; what each satisfies is in `evifuse.belief.desiderata`.
"""

import numpy as np
from numpy.typing import NDArray

from evifuse.belief._sums import checked, contour, cross_entropy, sizes_of, subset_counts
from evifuse.belief.mass import MassFunction
from evifuse.belief.transform import pignistic
from evifuse.belief.uncertainty import nonspecificity

__all__ = [
    "belief_entropy",
    "core_entropy",
    "deng_entropy",
    "information_dimension",
    "jirousek_shenoy_entropy",
    "pignistic_entropy",
    "within_set_entropy",
]

Array = NDArray[np.float64]


def deng_entropy(m: MassFunction, base: float = 2.0) -> Array:
    """Deng's entropy ``-sum m(A) log(m(A) / (2^|A| - 1))`` (Deng 2016).

    Parameters
    ----------
    m : MassFunction
        Masses, batch shape ``(...)``.
    base : float
        Base of the logarithm.

    Returns
    -------
    ndarray of float64, shape (...)
        Shannon's entropy for a probability, at most ``log(3^K - 2^K)`` over K hypotheses.

    Raises
    ------
    MassError
        If the empty set carries mass, or the base is not a positive number other than 1.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> round(float(deng_entropy(MassFunction.vacuous(Frame(["a", "b", "c"])))), 4)
    2.8074
    """
    masses, scale = checked(m, base)
    return np.asarray(cross_entropy(masses, masses / subset_counts(m)) / scale)


def jirousek_shenoy_entropy(m: MassFunction, base: float = 2.0) -> Array:
    """Shannon's entropy of the plausibility transform plus non-specificity (Jiroušek and Shenoy 2018).

    Parameters
    ----------
    m : MassFunction
        Masses, batch shape ``(...)``.
    base : float
        Base of the logarithm.

    Returns
    -------
    ndarray of float64, shape (...)
        Shannon's entropy for a probability, twice log K for total ignorance over K hypotheses.

    Raises
    ------
    MassError
        If the empty set carries mass, or the base is not a positive number other than 1.
    """
    _, scale = checked(m, base)
    shares = contour(m)
    shares = shares / shares.sum(axis=-1, keepdims=True)
    return np.asarray(cross_entropy(shares, shares) / scale + nonspecificity(m, base))


def pignistic_entropy(m: MassFunction, base: float = 2.0) -> Array:
    """Shannon's entropy of the pignistic probability, the ambiguity measure of Jousselme et al. (2006).

    Parameters
    ----------
    m : MassFunction
        Masses, batch shape ``(...)``.
    base : float
        Base of the logarithm.

    Returns
    -------
    ndarray of float64, shape (...)
        In [0, log K] over K hypotheses.

    Raises
    ------
    MassError
        If the empty set carries mass, or the base is not a positive number other than 1.
    """
    _, scale = checked(m, base)
    shares = pignistic(m)
    return np.asarray(cross_entropy(shares, shares) / scale)


def information_dimension(m: MassFunction, base: float = 2.0) -> Array:
    """Information fractal dimension: Deng's entropy over the logarithm of the number of subsets.

    ``D = E_d(m) / log 2^K`` over K hypotheses, after Qiang, Deng and Cheong (2022, arXiv 2112.04246), who
    take the slope of Deng's entropy along growing frames. Dividing at one given K is our own finite reading.

    Parameters
    ----------
    m : MassFunction
        Masses, batch shape ``(...)``.
    base : float
        Base of the logarithm, which cancels.

    Returns
    -------
    ndarray of float64, shape (...)
        In [0, log 3 / log 2): towards that bound, the dimension of Sierpiński's triangle, for the masses of
        the largest Deng entropy as K grows; towards 1 for total ignorance.

    Raises
    ------
    MassError
        If the empty set carries mass, or the base is not a positive number other than 1.
    """
    return np.asarray(deng_entropy(m, base) * np.log(base) / (len(m.frame) * np.log(2)))


def belief_entropy(m: MassFunction, base: float = 2.0) -> Array:
    """Entropy of the masses, ``H_b = -sum m(A) log m(A)`` (the chapter's appendix A.1; also Nguyen 1987).

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
    return np.asarray(cross_entropy(masses, masses) / scale)


def core_entropy(m: MassFunction, base: float = 2.0) -> Array:
    """Entropy of the focal sets' sizes, ``H_q = -sum h log h``, h a share of all sizes (appendix A.1).

    Parameters
    ----------
    m : MassFunction
        Masses, batch shape ``(...)``.
    base : float
        Base of the logarithm.

    Returns
    -------
    ndarray of float64, shape (...)
        0 for a single focal set; only which sets have mass matters.

    Raises
    ------
    MassError
        If the empty set carries mass, or the base is not a positive number other than 1.
    """
    masses, scale = checked(m, base)
    sizes = np.where(masses > 0, sizes_of(m), 0)
    shares = sizes / sizes.sum(axis=-1, keepdims=True)
    return np.asarray(cross_entropy(shares, shares) / scale)


def within_set_entropy(m: MassFunction, base: float = 2.0) -> Array:
    """Uncertainty within the focal sets, ``H_w = H_q + H_b`` (the chapter's appendix A.1).

    Parameters
    ----------
    m : MassFunction
        Masses, batch shape ``(...)``.
    base : float
        Base of the logarithm.

    Returns
    -------
    ndarray of float64, shape (...)
        0 for a single focal set.

    Raises
    ------
    MassError
        If the empty set carries mass, or the base is not a positive number other than 1.
    """
    return np.asarray(core_entropy(m, base) + belief_entropy(m, base))
