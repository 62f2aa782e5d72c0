"""How far two mass functions are apart: Jousselme's distance, Bhattacharyya's, and their conflict."""

from functools import lru_cache
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.belief.combine import aligned, conjunctive
from evifuse.belief.mass import MassFunction
from evifuse.errors import MassError

__all__ = ["bhattacharyya", "conflict", "jousselme"]

Array = NDArray[np.float64]
MATRIX_LIMIT = 1024
"""Up to so many shared focal sets the matrix of their similarities is laid out for a batch."""

_kernels: Any = None


def _compiled() -> Any:
    """The compiled inner loops; numba is imported on first use, not before."""
    global _kernels
    if _kernels is None:
        _kernels = import_module("evifuse.belief._kernels_distance")
    return _kernels


def jousselme(a: MassFunction, b: MassFunction) -> Array:
    """Jousselme's distance ``sqrt((a - b)ᵀ J (a - b) / 2)``, where J(A, B) = |A ∩ B| / |A ∪ B| (2001).

    Parameters
    ----------
    a : MassFunction
        First mass function.
    b : MassFunction
        Second one, over the same frame; batch dimensions broadcast, layouts may differ.

    Returns
    -------
    ndarray of float64, shape (...)
        In [0, 1]; a metric (Bouchard, Jousselme and Doré 2013 prove J positive definite). Mass on the empty
        set counts as a set that resembles only itself: J(∅, ∅) = 1.

    Raises
    ------
    FrameError
        If the frames differ.
    MassError
        If the batches don't broadcast.

    Notes
    -----
    Where many sets carry mass, the quadratic form is not summed over pairs. Our own way: since
    ``1 / |A ∪ B|`` is the integral of ``t^(|A ∪ B| - 1)`` over [0, 1], it equals the integral of
    ``sum over C of |C| (t (1 - t))^(|C| - 1) P_t(C)²`` with ``P_t(C)`` the sum of ``(a - b)(A) t^|A - C|``
    over all A that hold C: one scaled superset transform for each of n/2 Gauss-Legendre nodes, which
    integrate this polynomial exactly, and sums of positive terms alone. That costs O(n² 2^n).

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> frame = Frame(["a", "b"])
    >>> sure, ignorant = MassFunction.of(frame, {"a": 1.0}), MassFunction.vacuous(frame)
    >>> round(float(jousselme(sure, ignorant)), 6)
    0.707107
    """
    b = aligned(a, b)
    batch = _batch(a, b)
    rows = int(np.prod(batch))
    if a.focal_sets.ndim == b.focal_sets.ndim == 1 and rows > 3 and a.layout != "dense" != b.layout:
        sets, x, y = _common(a, b)
        if len(sets) <= MATRIX_LIMIT:
            return _by_matrix(x - y, sets, len(a.frame))
    out = np.empty(rows)
    if _transform_pays(a, b):
        x, y = a.to("dense"), b.to("dense")
        nodes, weights, sizes = _quadrature(len(a.frame))
        _compiled().dense(_rows(x.masses, batch), _rows(y.masses, batch), rows, nodes, weights, sizes, out)
    else:
        _compiled().pairs(*_operands(a, b, batch), rows, out)
    return np.sqrt(np.minimum(out, 1.0)).reshape(batch)


def bhattacharyya(a: MassFunction, b: MassFunction) -> Array:
    """Bhattacharyya's distance ``sqrt(1 - sum of sqrt(a(A) b(A)))`` of the masses (Ristic and Smets 2006).

    Parameters
    ----------
    a : MassFunction
        First mass function.
    b : MassFunction
        Second one, over the same frame; batch dimensions broadcast, layouts may differ.

    Returns
    -------
    ndarray of float64, shape (...)
        In [0, 1]; a metric (Hellinger's), 1 if no set is focal in both. It does not see how much sets that
        differ resemble each other: Jousselme's distance does.

    Raises
    ------
    FrameError
        If the frames differ.
    MassError
        If the batches don't broadcast.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> frame = Frame(["a", "b"])
    >>> sure, unsure = MassFunction.of(frame, {"a": 1.0}), MassFunction.of(frame, {"a": 0.25, "b": 0.75})
    >>> round(float(bhattacharyya(sure, unsure)), 6)
    0.707107
    """
    b = aligned(a, b)
    batch = _batch(a, b)
    if a.focal_sets.ndim == b.focal_sets.ndim == 1:
        _, x, y = _common(a, b)
        squares = 0.5 * ((np.sqrt(x) - np.sqrt(y)) ** 2).sum(axis=-1)
    else:
        squares = np.empty(int(np.prod(batch)))
        _compiled().roots(*_operands(a, b, batch), len(squares), squares)
    return np.asarray(np.sqrt(np.minimum(squares, 1.0))).reshape(batch)


def conflict(a: MassFunction, b: MassFunction) -> Array:
    """Degree of conflict: the sum of a(A) b(B) over sets A and B that don't meet (Shafer 1976).

    Parameters
    ----------
    a : MassFunction
        First mass function.
    b : MassFunction
        Second one, over the same frame; batch dimensions broadcast, layouts may differ.

    Returns
    -------
    ndarray of float64, shape (...)
        In [0, 1]. A dissimilarity, not a distance: it may be positive between equal mass functions, and 0
        between different ones (Liu 2006).

    Raises
    ------
    FrameError
        If the frames differ.
    MassError
        If the batches don't broadcast.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> m = MassFunction.of(Frame(["a", "b"]), {"a": 0.5, "b": 0.5})
    >>> float(conflict(m, m)), float(jousselme(m, m))
    (0.5, 0.0)
    """
    _batch(a, b)
    return np.asarray(conjunctive(a, b).conflict)


def _batch(a: MassFunction, b: MassFunction) -> tuple[int, ...]:
    try:
        return np.broadcast_shapes(a.batch, b.batch)
    except ValueError:
        raise MassError(f"batches of shape {a.batch} and {b.batch} don't broadcast") from None


def _common(a: MassFunction, b: MassFunction) -> tuple[NDArray[np.int64], Array, Array]:
    """Masses over the focal sets of either, given that both share theirs over the batch."""
    if np.array_equal(a.focal_sets, b.focal_sets):
        return a.focal_sets, a.masses, b.masses
    sets = np.union1d(a.focal_sets, b.focal_sets)
    return sets, a.on(sets), b.on(sets)


def _rows(values: NDArray[Any], batch: tuple[int, ...]) -> NDArray[Any]:
    """An operand as rows: a single one if it is the same for the whole batch."""
    width = values.shape[-1]
    if values.ndim == 1:
        return values.reshape(1, width)
    return np.ascontiguousarray(np.broadcast_to(values, (*batch, width))).reshape(-1, width)


def _operands(a: MassFunction, b: MassFunction, batch: tuple[int, ...]) -> list[NDArray[Any]]:
    return [_rows(x, batch) for x in (a.focal_sets, a.masses, b.focal_sets, b.masses)]


def _transform_pays(a: MassFunction, b: MassFunction) -> bool:
    """Whether so many sets carry mass that transforms are faster than pairs."""
    count = len(a.frame)
    if a.layout != "dense" != b.layout:
        return False
    if a.layout != b.layout and max(a.masses.size, b.masses.size) < 1 << count:
        return False
    focal = sum(int(np.count_nonzero(m.masses, axis=-1).max(initial=0)) for m in (a, b))
    return 4 * focal * focal > count * (count + 2) << count


@lru_cache(maxsize=32)
def _quadrature(count: int) -> tuple[Array, Array, NDArray[np.uint8]]:
    """Gauss-Legendre nodes and weights on [0, 1] for degree ``count - 1``, and sizes of all subsets."""
    nodes, weights = np.polynomial.legendre.leggauss((count + 1) // 2)
    sizes = np.zeros(1, dtype=np.uint8)
    for _ in range(count):
        sizes = np.concatenate([sizes, sizes + np.uint8(1)])
    return (nodes + 1) / 2, weights / 2, sizes


def _by_matrix(u: Array, sets: NDArray[np.int64], count: int) -> Array:
    """Batches whose focal sets are shared: one matrix of similarities for all."""
    members = ((sets[:, None] >> np.arange(count)) & 1).astype(np.float64)
    meet = members @ members.T
    sizes = members.sum(axis=1)
    union = sizes[:, None] + sizes[None, :] - meet
    similar = np.where(union == 0, 1.0, meet / np.maximum(union, 1.0))
    squares = 0.5 * np.einsum("...f,...f->...", u @ similar, u)
    return np.sqrt(np.clip(squares, 0.0, 1.0))
