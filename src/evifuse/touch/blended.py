"""A smooth surface through taxels that lie on no sphere.

The local quadrics q_i of the taxels are blended into f(x) = sum_i w_i(x) q_i(x), with Gaussian weights that
sum to 1, and the surface is f = 0 (a partition of unity, Ohtake et al. 2003; the choices are our own).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from evifuse.touch.quadrics import (
    estimated_normals,
    local_quadrics,
    neighbours,
    tangent_axes,
    unit_rows,
)

__all__ = ["BlendedSurface", "blended_surface", "layout_normals"]

Array = NDArray[np.float64]

BLEND = 0.9
"""Standard deviation of the blending weights, in distances to the fourth neighbour."""
SAME = 0.98
"""Cosine between two estimates of a normal below which the better one is not trusted."""
STEPS = 8
"""Most steps towards the nearest point; two or three are usual."""
CLOSE = 1e-7
"""A step shorter than this share of the blending width is the last one."""


@dataclass(frozen=True)
class BlendedSurface:
    """Local quadrics of the taxels, blended.

    Parameters
    ----------
    positions_m : ndarray of float64, shape (N, 3)
        Places of the taxels, metres.
    normals : ndarray of float64, shape (N, 3)
        Their outward unit normals.
    tensors_per_m : ndarray of float64, shape (N, 3, 3)
        Curvature of the surface at each, 1/m, as `local_quadrics` gives it.
    heights_m : ndarray of float64, shape (N,)
        What is added to each quadric so that the blend passes through all taxels, metres.
    width_m : float
        Standard deviation of the blending weights, metres.
    """

    positions_m: Array
    normals: Array
    tensors_per_m: Array
    heights_m: Array
    width_m: float

    def contact(self, weights: Array) -> tuple[Array, Array]:
        """Middle of a patch of active taxels: see `FingerSurface`.

        Parameters
        ----------
        weights : ndarray of float64, shape (T, N)
            How much each taxel counts.

        Returns
        -------
        points_m, normals : ndarray of float64, shape (T, 3)
            Points of the surface, metres, and outward unit normals.
        """
        return self.project(weights @ self.positions_m / weights.sum(axis=1, keepdims=True))

    def project(self, points_m: Array) -> tuple[Array, Array]:
        """Nearest points of the surface: see `FingerSurface`.

        Parameters
        ----------
        points_m : ndarray of float64, shape (M, 3)
            Points, metres.

        Returns
        -------
        nearest_m, normals : ndarray of float64, shape (M, 3)
            Points of the surface, metres, and outward unit normals.
        """
        from evifuse.touch._kernels_blend import nearest

        return nearest(_rows(points_m), self._table, self.width_m, STEPS, CLOSE)

    def distance(self, points_m: Array) -> Array:
        """Signed distance to the surface, positive outside.

        Parameters
        ----------
        points_m : ndarray of float64, shape (M, 3)
            Points, metres.

        Returns
        -------
        ndarray of float64, shape (M,)
            Distances, metres.
        """
        nearest, normals = self.project(points_m)
        return np.einsum("mi,mi->m", points_m - nearest, normals)

    def shape_operators(self, points_m: Array) -> tuple[Array, Array]:
        """Curvature of the blend: see `FingerSurface`.

        Parameters
        ----------
        points_m : ndarray of float64, shape (M, 3)
            Points of the surface, metres.

        Returns
        -------
        operators_per_m : ndarray of float64, shape (M, 2, 2)
            Curvatures, 1/m.
        axes : ndarray of float64, shape (M, 3, 2)
            Unit tangents.
        """
        axes = tangent_axes(unit_rows(self._gradients(points_m)))
        step, turned = 1e-3 * self.width_m, list[Array]()
        for k in range(2):
            ends = [unit_rows(self._gradients(points_m + s * step * axes[:, :, k])) for s in (1, -1)]
            turned.append(np.einsum("mi,mia->ma", (ends[0] - ends[1]) / (2 * step), axes))
        operator = np.stack(turned, axis=2)
        return 0.5 * (operator + operator.transpose(0, 2, 1)), axes

    def _gradients(self, points: Array) -> Array:
        from evifuse.touch._kernels_blend import gradients

        return gradients(_rows(points), self._table, self.width_m)

    @cached_property
    def _table(self) -> Array:
        """Places and terms of the quadrics (13, N), as the compiled loops take them."""
        bent = np.einsum("nij,nj->ni", self.tensors_per_m, self.positions_m)
        constant = np.einsum("ni,ni->n", 0.5 * bent - self.normals, self.positions_m) + self.heights_m
        first, second = np.triu_indices(3)
        rows = [self.positions_m.T, constant[None], (self.normals - bent).T]
        return np.ascontiguousarray(np.concatenate([*rows, self.tensors_per_m[:, first, second].T]))


def blended_surface(positions_m: Array, normals: Array) -> BlendedSurface:
    """Surface through taxels.

    Parameters
    ----------
    positions_m : ndarray of float64, shape (N, 3)
        Places of the taxels, metres.
    normals : ndarray of float64, shape (N, 3)
        Their outward unit normals.

    Returns
    -------
    BlendedSurface
        It passes through all taxels.
    """
    near = neighbours(positions_m, 4)
    apart = np.linalg.norm(positions_m[near[:, -1]] - positions_m, axis=1) if near.shape[1] else np.ones(1)
    width = BLEND * float(np.median(apart))
    tensors = local_quadrics(positions_m, normals)
    weight = _weights(positions_m, positions_m, width)
    value = _values(positions_m, positions_m, normals, tensors)
    heights = np.linalg.lstsq(weight, -np.sum(weight * value, axis=1), rcond=1e-6)[0]
    return BlendedSurface(positions_m, normals, tensors, heights, width)


def layout_normals(positions_m: Array) -> Array:
    """Outward normals of a layout that gives places only: those of the blended surface.

    Several times closer than `estimated_normals`, from which it starts.

    Parameters
    ----------
    positions_m : ndarray of float64, shape (N, 3)
        Places of at least 4 taxels, metres.

    Returns
    -------
    ndarray of float64, shape (N, 3)
        Outward unit normals.
    """
    first = estimated_normals(positions_m)
    better = blended_surface(positions_m, first).project(positions_m)[1]
    alike = np.sum(first * better, axis=1, keepdims=True) > SAME
    return np.where(alike, better, first)


def _rows(points: Array) -> Array:
    return np.ascontiguousarray(points, dtype=np.float64)


def _weights(points: Array, positions: Array, width: float) -> Array:
    """Blending weights (M, N); each row sums to 1."""
    squared = np.square(positions).sum(axis=1) - 2 * points @ positions.T  # but for what the row shares
    squared -= squared.min(axis=1, keepdims=True)
    weight = np.exp(squared * (-0.5 / width**2))
    return weight / weight.sum(axis=1, keepdims=True)


def _values(points: Array, positions: Array, normals: Array, tensors: Array) -> Array:
    """Values (M, N) of all quadrics at all points, metres: polynomials of the coordinates."""
    bent = np.einsum("nij,nj->ni", tensors, positions)
    constant = np.einsum("ni,ni->n", 0.5 * bent - normals, positions)
    square = np.einsum("mi,mj->mij", points, points).reshape(-1, 9)
    return 0.5 * square @ tensors.reshape(-1, 9).T + points @ (normals - bent).T + constant
