"""Sums over focal sets that the uncertainty measures share."""

import numpy as np
from numpy.typing import NDArray

from evifuse.belief.mass import MassFunction
from evifuse.errors import MassError

Array = NDArray[np.float64]


def checked(m: MassFunction, base: float) -> tuple[Array, float]:
    """Masses, none of them on the empty set, and the natural logarithm of the base."""
    if not (np.isfinite(base) and base > 0 and base != 1):
        raise MassError(f"base {base} has no logarithm: take a positive number other than 1")
    if np.any(m.where(m.focal_sets == 0) > 0):
        raise MassError("the empty set carries mass: uncertainty is measured on normalised masses")
    return m.masses, float(np.log(base))


def sizes_of(m: MassFunction) -> NDArray[np.int64]:
    """Number of members of each focal set."""
    sizes = np.zeros_like(m.focal_sets)
    for k in range(len(m.frame)):
        sizes += m.focal_sets >> k & 1
    return sizes


def subset_counts(m: MassFunction) -> Array:
    """Number of non-empty subsets of each focal set, 1 for the empty one."""
    return np.maximum(np.exp2(sizes_of(m)) - 1, 1.0)


def total(values: Array) -> Array:
    return np.asarray(values.sum(axis=-1))


def cross_entropy(masses: Array, values: Array) -> Array:
    """``-sum m log v`` over positive masses, never below 0 through rounding."""
    logs = np.log(np.where(masses > 0, values, 1.0))
    return np.asarray(np.maximum(-total(masses * logs), 0.0))


def over_members(m: MassFunction, values: Array) -> Array:
    """Sum over each focal set of a value of its members: (..., K) to (..., F)."""
    out = np.zeros(m.masses.shape)
    for k in range(len(m.frame)):
        out += np.where(m.focal_sets >> k & 1, values[..., k, None], 0.0)
    return out


def beliefs(m: MassFunction) -> Array:
    """Belief of each focal set, shape (..., F)."""
    if m.layout == "dense":
        return sums_over(m.masses, upward=True)
    out = np.empty(m.masses.shape)
    for i in range(m.masses.shape[-1]):
        out[..., i] = m.where(m.focal_sets & ~m.focal_sets[..., i, None] == 0)
    return out


def plausibilities(m: MassFunction) -> Array:
    """Plausibility of each focal set, shape (..., F)."""
    if m.layout == "dense":
        return np.maximum(1 - sums_over(m.masses, upward=True)[..., ::-1], m.masses)
    out = np.empty(m.masses.shape)
    for i in range(m.masses.shape[-1]):
        out[..., i] = m.where(m.focal_sets & m.focal_sets[..., i, None] != 0)
    return out


def sums_over(values: Array, *, upward: bool) -> Array:
    """Sums over subsets (``upward``) or supersets, of arrays over all subsets (Kennes 1992)."""
    out = values.copy()
    half = 1
    while 2 * half <= out.shape[-1]:
        pairs = out.reshape(-1, 2, half)
        if upward:
            pairs[:, 1] += pairs[:, 0]
        else:
            pairs[:, 0] += pairs[:, 1]
        half *= 2
    return out


def contour(m: MassFunction) -> Array:
    """Plausibility of each hypothesis, shape (..., K)."""
    return np.stack([m.where(m.focal_sets >> k & 1 != 0) for k in range(len(m.frame))], axis=-1)
