"""Appendix A.1 to A.6: entropies, dimension and divergence of belief functions, as the formulas read.

Masses are ``[..., F]`` with leading batch dimensions and all positive: a set without mass is not a focal set.
"""

from functools import lru_cache
from math import log as natural_log

import numpy as np
from numpy.typing import NDArray

from evifuse.belief import Frame, MassFunction
from evifuse.conductivity.reading import Reading
from evifuse.errors import MassError

__all__ = [
    "belief_entropy",
    "capacity",
    "core_entropy",
    "divergence",
    "focal_distance",
    "focal_divergence",
    "fractal_dimension",
    "inner_entropy",
    "interaction_dimension",
    "projection",
    "ratio",
    "similarity",
    "within_set_entropy",
]

Array = NDArray[np.float64]

TIE = 1e-12
"""Similarities closer than this are equally good matches."""


def _positive(x: MassFunction) -> Array:
    if np.any(x.masses <= 0):
        raise MassError("appendix A needs positive masses: leave sets without mass out of the focal sets")
    return x.masses


def _log(x: Array, reading: Reading) -> Array:
    return np.log(x) if reading.log_base is None else np.log(x) / natural_log(reading.log_base)


def ratio(part: Array, whole: Array) -> Array:
    """``part / whole``, and 1 where both vanish: without entropy there are no gaps, so nothing is fractal.

    Parameters
    ----------
    part : ndarray of float64
        A share of ``whole``.
    whole : ndarray of float64
        What it is a share of; the shapes broadcast.

    Returns
    -------
    ndarray of float64
        The quotient.
    """
    part, whole = np.broadcast_arrays(np.asarray(part, float), np.asarray(whole, float))
    with np.errstate(invalid="ignore"):  # both infinite: sets that the reading puts infinitely far apart
        return np.where(whole == 0, 1.0, part / np.where(whole == 0, 1.0, whole))


def similarity(frame: Frame, a: NDArray[np.int64], b: NDArray[np.int64], reading: Reading) -> Array:
    """Similarity of focal sets (A.2): shared attributes over all attributes, of every pair.

    A set's attribute list is the union of its members' lists; without lists a hypothesis is its own only
    attribute.

    Parameters
    ----------
    frame : Frame
        Whose attribute lists are compared.
    a : ndarray of int64, shape (F,)
        Focal sets.
    b : ndarray of int64, shape (G,)
        Focal sets.
    reading : Reading
        Gives ``similarity_offset``.

    Returns
    -------
    ndarray of float64, shape (F, G)
        In [0, 1]; 0 only for disjoint attributes and an offset of 0.
    """
    return _similarity(frame, tuple(a.tolist()), tuple(b.tolist()), reading.similarity_offset)


@lru_cache(maxsize=4096)
def _similarity(frame: Frame, a: tuple[int, ...], b: tuple[int, ...], offset: float) -> Array:
    """The same few focal sets meet again and again, so their similarities are remembered."""
    if frame.attributes is None:
        has = np.eye(len(frame), dtype=bool)
    else:
        every = sorted(frozenset[str]().union(*frame.attributes))
        has = np.array([[attribute in own for attribute in every] for own in frame.attributes])
    x, y = (
        (((np.array(sets)[:, None] >> np.arange(len(frame))) & 1).astype(bool) @ has).astype(np.float64)
        for sets in (a, b)
    )
    shared = x @ y.T
    union = x.sum(axis=1)[:, None] + y.sum(axis=1)[None, :] - shared
    out = (shared + offset) / (union + offset)
    out.flags.writeable = False
    return out


def belief_entropy(x: MassFunction, reading: Reading) -> Array:
    """Entropy of the masses, ``H_b = -sum b log b`` (A.1).

    Parameters
    ----------
    x : MassFunction
        Positive masses, batch shape ``(...)``.
    reading : Reading
        Sign and base.

    Returns
    -------
    ndarray of float64, shape (...)
        0 for a single focal set.
    """
    b = _positive(x)
    return reading.entropy_sign * (b * _log(b, reading)).sum(axis=-1)


def core_entropy(x: MassFunction, reading: Reading) -> Array:
    """Entropy of the focal sets' sizes, ``H_q = -sum h log h`` h a share of all cardinalities (A.1).

    Parameters
    ----------
    x : MassFunction
        Masses, batch shape ``(...)``.
    reading : Reading
        Sign and base.

    Returns
    -------
    ndarray of float64, shape (...)
        The same for the whole batch: only the sets matter.
    """
    sizes = ((x.focal_sets[:, None] >> np.arange(len(x.frame))) & 1).sum(axis=1)
    h = sizes / sizes.sum()
    return np.full(x.batch, reading.entropy_sign * (h * _log(h, reading)).sum())


def within_set_entropy(x: MassFunction, reading: Reading) -> Array:
    """``H_w = H_q + H_b`` (A.1).

    Parameters
    ----------
    x : MassFunction
        Positive masses, batch shape ``(...)``.
    reading : Reading
        How the formulas are read.

    Returns
    -------
    ndarray of float64, shape (...)
        Uncertainty within the focal sets.
    """
    return core_entropy(x, reading) + belief_entropy(x, reading)


def focal_distance(b: Array, c: Array, similar: Array | float, reading: Reading) -> Array:
    """Distance ``(b - c) log(b / c) / sim`` of two focal sets (A.2).

    Parameters
    ----------
    b : ndarray of float64
        Positive masses.
    c : ndarray of float64
        Positive masses.
    similar : ndarray of float64
        Similarities of the sets; infinite distance at 0.
    reading : Reading
        Gives the base.

    Returns
    -------
    ndarray of float64
        Broadcast shape, 0 where the masses are equal and sets are similar at all.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        return (b - c) * (_log(b, reading) - _log(c, reading)) / similar


def focal_divergence(x: MassFunction, reading: Reading) -> Array:
    """``D(X)``: the focal distances of all pairs of focal sets (A.2).

    Parameters
    ----------
    x : MassFunction
        Positive masses, batch shape ``(...)``.
    reading : Reading
        ``pairs_within`` says whether a pair counts once or twice.

    Returns
    -------
    ndarray of float64, shape (...)
        Uncertainty between the focal sets: the information gaps.
    """
    b = _positive(x)
    sim = similarity(x.frame, x.focal_sets, x.focal_sets, reading)
    i, j = np.triu_indices(len(x.focal_sets), 1)
    return reading.pairs_within * focal_distance(b[..., i], b[..., j], sim[i, j], reading).sum(axis=-1)


def inner_entropy(x: MassFunction, reading: Reading) -> Array:
    """``H_in = H_w + D`` (A.3).

    Parameters
    ----------
    x : MassFunction
        Positive masses, batch shape ``(...)``.
    reading : Reading
        How the formulas are read.

    Returns
    -------
    ndarray of float64, shape (...)
        Uncertainty within and between the focal sets.
    """
    return within_set_entropy(x, reading) + focal_divergence(x, reading)


def fractal_dimension(x: MassFunction, reading: Reading) -> Array:
    """``dim(X) = H_w / H_in`` (A.3): how nearly the belief function fills its space.

    Parameters
    ----------
    x : MassFunction
        Positive masses, batch shape ``(...)``.
    reading : Reading
        How the formulas are read.

    Returns
    -------
    ndarray of float64, shape (...)
        In (0, 1] under the sound reading; 1 for a single focal set, which has no gaps.
    """
    within = within_set_entropy(x, reading)
    return ratio(within, within + focal_divergence(x, reading))


def capacity(inner: Array | float) -> Array:
    """``cap = 1 / H_in`` (A.4, A.7), infinite without inner entropy.

    Parameters
    ----------
    inner : ndarray of float64
        Inner entropies.

    Returns
    -------
    ndarray of float64
        Capacities.
    """
    with np.errstate(divide="ignore"):
        return 1.0 / np.asarray(inner, dtype=np.float64)


def projection(dimension: Array, viewed_with: Array | float) -> Array:
    """``Proj[dim(Y)] = dim(Y) cap(X)`` (A.4): what a belief function of lower dimension sees of a higher one.

    Parameters
    ----------
    dimension : ndarray of float64
        The higher dimension.
    viewed_with : ndarray of float64
        Capacity of the belief function or aggregate that looks.

    Returns
    -------
    ndarray of float64
        Projected dimensions.
    """
    return np.asarray(dimension * viewed_with, dtype=np.float64)


def _directed(b: Array, c: Array, sim: Array, reading: Reading) -> Array:
    """Half of A.6: every focal set of one side against its best match on the other."""
    best = sim.max(axis=1)
    match = sim >= best[:, None] - TIE
    if reading.ties == "first":
        match = match & (np.cumsum(match, axis=1) == 1)
    matched = c @ (match / match.sum(axis=1, keepdims=True)).T
    b, matched = np.broadcast_arrays(b, matched)
    if reading.divergence == "symmetric":
        return focal_distance(b, matched, best, reading).sum(axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return (b * (_log(b, reading) - _log(matched, reading)) / best).sum(axis=-1)


def divergence(x: MassFunction, y: MassFunction, reading: Reading) -> Array:
    """``div(X; Y)``: every focal set against its best match on the other side, both ways (A.6).

    Parameters
    ----------
    x : MassFunction
        Positive masses.
    y : MassFunction
        Positive masses over the same frame; batch dimensions broadcast.
    reading : Reading
        Form of the terms and what to do with ties.

    Returns
    -------
    ndarray of float64, shape (...)
        0 for equal belief functions; symmetric; never negative under the sound reading.
    """
    sim = similarity(x.frame, x.focal_sets, y.focal_sets, reading)
    b, c = _positive(x), _positive(y)
    return _directed(b, c, sim, reading) + _directed(c, b, sim.T, reading)


def interaction_dimension(x: MassFunction, y: MassFunction, reading: Reading) -> Array:
    """``dim(X; Y) = (H_in(X) + H_in(Y)) / (H_in(X) + H_in(Y) + div(X; Y))`` (A.5, A.8).

    Parameters
    ----------
    x : MassFunction
        Positive masses.
    y : MassFunction
        Positive masses over the same frame; batch dimensions broadcast.
    reading : Reading
        How the formulas are read.

    Returns
    -------
    ndarray of float64, shape (...)
        In (0, 1] under the sound reading; 1 for equal belief functions.
    """
    inner = inner_entropy(x, reading) + inner_entropy(y, reading)
    return ratio(inner, inner + divergence(x, y, reading))
