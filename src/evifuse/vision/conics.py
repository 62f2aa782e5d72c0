"""Ellipses as conics, so that they can be seen through a camera."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["axes_of", "conic_of", "mapped_ellipse"]


def conic_of(
    centre: NDArray[np.float64], axes: NDArray[np.float64], angle_rad: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Symmetric matrices C with ``p^T C p = 0`` for the points p = (x, y, 1) of ellipses, negative inside.

    Parameters
    ----------
    centre : ndarray of float64, shape (..., 2)
        Centres.
    axes : ndarray of float64, shape (..., 2)
        Whole lengths of the axes.
    angle_rad : ndarray of float64, shape (...)
        From x to the first axis, towards y.

    Returns
    -------
    ndarray of float64, shape (..., 3, 3)
        In the inverse square of the unit of length.
    """
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    a, b = axes[..., 0] / 2, axes[..., 1] / 2
    zero = np.zeros_like(a * c)
    rows = [
        np.stack([a * c, -b * s, centre[..., 0] + zero], axis=-1),
        np.stack([a * s, b * c, centre[..., 1] + zero], axis=-1),
        np.stack([zero, zero, zero + 1], axis=-1),
    ]
    to_circle = np.linalg.inv(np.stack(rows, axis=-2))
    return np.swapaxes(to_circle, -1, -2) @ (np.diag([1.0, 1.0, -1.0]) @ to_circle)


def axes_of(
    conic: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Centres and axes of conics.

    Parameters
    ----------
    conic : ndarray of float64, shape (..., 3, 3)
        Symmetric, negative inside.

    Returns
    -------
    centre : ndarray of float64, shape (..., 2)
        In the unit of length.
    half : ndarray of float64, shape (..., 2)
        Half lengths of the axes, longest first; NaN for what is no ellipse.
    directions : ndarray of float64, shape (..., 2, 2)
        Unit vector along each axis.
    """
    values, vectors = np.linalg.eigh(conic[..., :2, :2])
    values = np.where(values > 0, values, np.nan)
    centre = -np.linalg.solve(conic[..., :2, :2], conic[..., :2, 2:])[..., 0]
    level = -(conic[..., 2, 2] + (conic[..., 2, :2] * centre).sum(axis=-1))
    level = np.where(level > 0, level, np.nan)
    half: NDArray[np.float64] = np.asarray(np.sqrt(level[..., None] / values), np.float64)
    return np.asarray(centre, np.float64), half, np.swapaxes(vectors, -1, -2)


def mapped_ellipse(
    centre: NDArray[np.float64],
    axes: NDArray[np.float64],
    angle_rad: NDArray[np.float64],
    homography: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Ellipses seen through homographies.

    Parameters
    ----------
    centre : ndarray of float64, shape (..., 2)
        Centres.
    axes : ndarray of float64, shape (..., 2)
        Whole lengths of the axes.
    angle_rad : ndarray of float64, shape (...)
        From x to the first axis, towards y.
    homography : ndarray of float64, shape (..., 3, 3)
        From points (x, y, 1) to where they are seen.

    Returns
    -------
    centre : ndarray of float64, shape (..., 2)
        Of the ellipse that is seen; not what is seen of the centre.
    axes : ndarray of float64, shape (..., 2)
        Whole lengths, longest first; NaN where no ellipse is seen.
    angle_rad : ndarray of float64, shape (...)
        Of the long axis, in [-pi / 2, pi / 2).
    """
    back = np.linalg.inv(homography)
    where, half, directions = axes_of(np.swapaxes(back, -1, -2) @ conic_of(centre, axes, angle_rad) @ back)
    angle = np.arctan2(directions[..., 0, 1], directions[..., 0, 0])
    return where, 2 * half, (angle + np.pi / 2) % np.pi - np.pi / 2
