"""Local quadrics through the taxels of any layout: normals and curvatures where only places are known.

Around taxel i the surface is q_i(x) = n_i . d + d' H_i d / 2 = 0 with d = x - p_i. H_i holds the curvature
along the tangents, and along the normal the larger of both, so that q_i is exact on spheres and cylinders.
All of it is our own; local quadrics as such are those of Ohtake et al., *Multi-level partition of unity
implicits* (2003).
"""

import numpy as np
from numpy.typing import NDArray

__all__ = ["NEIGHBOURS", "estimated_normals", "local_quadrics", "neighbours", "tangent_axes", "unit_rows"]

NEIGHBOURS = 12
"""Taxels around one that its quadric is fitted to."""
ROUNDS = 12
"""Fits of a quadric: each starts from the normal and the curvature of the one before."""
DAMPING = 0.5
"""Share of a normal's correction that is made: at the rim of a layout, whole ones don't settle."""
RIDGE = 1e-3
"""Weight of no curvature against the neighbours, so that few neighbours don't make up curvature."""

Array = NDArray[np.float64]


def tangent_axes(normals: Array) -> Array:
    """Two unit tangents for each normal.

    Parameters
    ----------
    normals : ndarray of float64, shape (M, 3)
        Unit normals.

    Returns
    -------
    ndarray of float64, shape (M, 3, 2)
        Tangents in the columns; first x second = normal. The first is the x axis projected on to the tangent
        plane, or the y axis where the normal is within 26 degrees of x.
    """
    start: Array = np.where(np.abs(normals[:, :1]) < 0.9, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    first = start - np.sum(start * normals, axis=1, keepdims=True) * normals
    first = unit_rows(first)
    return np.stack([first, np.cross(normals, first)], axis=2)


def unit_rows(vectors: Array) -> Array:
    """Scale vectors to length 1.

    Parameters
    ----------
    vectors : ndarray of float64, shape (M, 3)
        Vectors, none of them zero.

    Returns
    -------
    ndarray of float64, shape (M, 3)
        Unit vectors.
    """
    return vectors / np.sqrt(np.square(vectors).sum(axis=1, keepdims=True))


def neighbours(positions_m: Array, count: int = NEIGHBOURS) -> NDArray[np.int64]:
    """Nearest other taxels of each taxel.

    Parameters
    ----------
    positions_m : ndarray of float64, shape (N, 3)
        Places of the taxels, metres.
    count : int
        How many are looked for.

    Returns
    -------
    ndarray of int64, shape (N, min(count, N - 1))
        Numbers of the taxels, nearest first.
    """
    apart = np.linalg.norm(positions_m[:, None] - positions_m[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    return np.argsort(apart, axis=1, kind="stable")[:, : min(count, len(apart) - 1)]


def estimated_normals(positions_m: Array) -> Array:
    """Outward normals of a layout that gives places only.

    A plane through the neighbours first, then the slope of the local quadric. Outward is away from the
    centre of the best sphere, and nearby normals agree with each other.

    Parameters
    ----------
    positions_m : ndarray of float64, shape (N, 3)
        Places of at least 4 taxels, metres, in no matter which frame.

    Returns
    -------
    ndarray of float64, shape (N, 3)
        Outward unit normals.
    """
    near = neighbours(positions_m)
    around = positions_m[near[:, :8]] - positions_m[:, None]
    spread = np.einsum("nki,nkj->nij", around, around)
    normals = _turned_outward(positions_m, np.linalg.eigh(spread)[1][:, :, 0], near)
    return _fitted(positions_m, normals, near, free=True)[0]


def local_quadrics(positions_m: Array, normals: Array) -> Array:
    """Curvature tensor of the surface at each taxel.

    Fitted to the places and to the normals of the neighbours, the normal of the taxel itself kept.

    Parameters
    ----------
    positions_m : ndarray of float64, shape (N, 3)
        Places of the taxels, metres.
    normals : ndarray of float64, shape (N, 3)
        Outward unit normals.

    Returns
    -------
    ndarray of float64, shape (N, 3, 3)
        H_i, 1/m: a turn dn = H du of the normal, positive where the finger is convex.
    """
    if len(positions_m) < 3:
        return np.zeros((len(positions_m), 3, 3))
    return _fitted(positions_m, normals, neighbours(positions_m), free=False)[1]


def _fitted(positions: Array, normals: Array, near: NDArray[np.int64], free: bool) -> tuple[Array, Array]:
    """Normals (N, 3) and tensors (N, 3, 3) of the quadrics; normals move when they are free."""
    d = positions[near] - positions[:, None]
    size = np.linalg.norm(d, axis=2)
    scale = size[:, min(5, size.shape[1] - 1), None]
    weight = np.exp(-0.5 * np.square(size / scale))
    ridge = RIDGE * np.eye(5 if free else 3)
    bulge = np.zeros(len(positions))
    curvature = np.zeros((len(positions), 2, 2))
    for _ in range(ROUNDS):
        axes = tangent_axes(normals)
        u = np.einsum("nki,nia->nka", d, axes) / scale[:, :, None]
        height = np.einsum("nki,ni->nk", d, normals) / scale
        rows = 0.5 * np.stack([u[..., 0] ** 2, 2 * u[..., 0] * u[..., 1], u[..., 1] ** 2], axis=2)
        target = -(height + 0.5 * bulge[:, None] * scale * height**2)
        if free:
            rows = np.concatenate([rows, u], axis=2)
            equations, values = rows * weight[..., None], target * weight
        else:
            slopes, wanted = _slopes(u, height, normals[near], normals, axes, bulge[:, None] * scale)
            equations = np.concatenate([rows, slopes[0], slopes[1]], axis=1)
            equations = equations * np.tile(weight, 3)[..., None]
            values = np.concatenate([target, wanted[..., 0], wanted[..., 1]], axis=1) * np.tile(weight, 3)
        transposed = equations.transpose(0, 2, 1)
        found = np.linalg.solve(transposed @ equations + ridge, transposed @ values[..., None])[..., 0]
        xx, xy, yy = (found[:, :3] / scale).T
        curvature = np.stack([np.stack([xx, xy], axis=1), np.stack([xy, yy], axis=1)], axis=1)
        bulge = np.maximum(np.linalg.eigvalsh(curvature)[:, 1], 0.0)
        if free:
            normals = normals + DAMPING * np.einsum("nia,na->ni", axes, found[:, 3:])
            normals = unit_rows(normals)
    axes = tangent_axes(normals)
    along = np.einsum("nia,nab,njb->nij", axes, curvature, axes)
    return normals, along + bulge[:, None, None] * normals[:, :, None] * normals[:, None, :]


def _slopes(
    u: Array, height: Array, theirs: Array, normals: Array, axes: Array, bulge: Array
) -> tuple[tuple[Array, Array], Array]:
    """Equations of the neighbours' normals: the gradient of the quadric there points along them."""
    upright = np.einsum("nki,ni->nk", theirs, normals)
    steep = 1 + bulge * height  # the gradient's part along the normal
    wanted = np.einsum("nki,nia->nka", theirs, axes) / np.maximum(upright, 0.2)[..., None] * steep[..., None]
    zero = np.zeros_like(height)
    first = np.stack([u[..., 0], u[..., 1], zero], axis=2)
    second = np.stack([zero, u[..., 0], u[..., 1]], axis=2)
    return (first, second), wanted


def _turned_outward(positions: Array, normals: Array, near: NDArray[np.int64]) -> Array:
    """Flip normals so that they agree with their neighbours, and the clearest one points outward."""
    system = np.column_stack([2 * positions, np.ones(len(positions))])
    centre = np.linalg.lstsq(system, np.square(positions).sum(axis=1), rcond=None)[0][:3]
    away = positions - centre
    outward = np.einsum("ni,ni->n", normals, away) / np.maximum(np.linalg.norm(away, axis=1), 1e-12)
    first = int(np.argmax(np.abs(outward)))
    sign = np.zeros(len(positions))
    sign[first] = 1.0 if outward[first] >= 0 else -1.0
    linked = np.zeros((len(positions),) * 2, dtype=np.bool_)
    linked[np.repeat(np.arange(len(near)), near.shape[1]), near.ravel()] = True
    likeness = np.where(linked | linked.T, np.abs(normals @ normals.T), -1.0)
    for _ in range(len(positions) - 1):
        done = sign != 0
        reach = np.where(done[:, None] & ~done[None, :], likeness, -2.0)
        known, new = np.unravel_index(int(np.argmax(reach)), reach.shape)
        sign[new] = sign[known] * (1.0 if normals[known] @ normals[new] >= 0 else -1.0)
    return normals * sign[:, None]
