"""Rotations as unit quaternions ``[x, y, z, w]``, one or many at once.

The quaternion of a pose turns coordinates of the moving frame into world coordinates. Formulas are the
textbook ones (Hamilton product, spherical linear interpolation).
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["about_axis", "cross", "interpolate", "multiply", "rotate", "to_matrix", "to_quaternion"]


def about_axis(axis: ArrayLike, angle_rad: ArrayLike) -> NDArray[np.float64]:
    """Rotation by an angle about a unit axis.

    Parameters
    ----------
    axis : array_like of float, shape (..., 3)
        Unit vectors.
    angle_rad : array_like of float, shape (...)
        Angles, radians, right-handed.

    Returns
    -------
    ndarray of float64, shape (..., 4)
        Unit quaternions, ``xyzw``.

    Examples
    --------
    >>> about_axis([0.0, 0.0, 1.0], np.pi).round(3)
    array([0., 0., 1., 0.])
    """
    half = np.asarray(angle_rad, dtype=np.float64)[..., None] / 2
    vector = np.asarray(axis, dtype=np.float64) * np.sin(half)
    return np.concatenate([vector, np.broadcast_to(np.cos(half), (*vector.shape[:-1], 1))], axis=-1)


def multiply(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    """Hamilton product: the rotation ``second`` followed by ``first``.

    Parameters
    ----------
    first, second : ndarray of float64, shape (..., 4)
        Unit quaternions, ``xyzw``; the leading dimensions broadcast.

    Returns
    -------
    ndarray of float64, shape (..., 4)
        ``first * second``.
    """
    u, a = first[..., :3], first[..., 3:]
    v, b = second[..., :3], second[..., 3:]
    scalar = a * b - np.sum(u * v, axis=-1, keepdims=True)
    return np.concatenate([a * v + b * u + cross(u, v), scalar], axis=-1)


def rotate(quaternion: NDArray[np.float64], vector: NDArray[np.float64]) -> NDArray[np.float64]:
    """Turn vectors by unit quaternions.

    Parameters
    ----------
    quaternion : ndarray of float64, shape (..., 4)
        Unit quaternions, ``xyzw``.
    vector : ndarray of float64, shape (..., 3)
        Vectors in the moving frame.

    Returns
    -------
    ndarray of float64, shape (..., 3)
        The vectors in the fixed frame.
    """
    u = quaternion[..., :3]
    twice = 2 * cross(u, vector)
    return vector + quaternion[..., 3:] * twice + cross(u, twice)


def to_matrix(quaternion: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation matrices of unit quaternions.

    Parameters
    ----------
    quaternion : ndarray of float64, shape (..., 4)
        Unit quaternions, ``xyzw``.

    Returns
    -------
    ndarray of float64, shape (..., 3, 3)
        The columns are the moving frame's axes in the fixed frame.
    """
    x, y, z, w = (quaternion[..., i] for i in range(4))
    xx, yy, zz = 2 * x * x, 2 * y * y, 2 * z * z
    xy, yz, zx, wx, wy, wz = 2 * x * y, 2 * y * z, 2 * z * x, 2 * w * x, 2 * w * y, 2 * w * z
    rows = [1 - yy - zz, xy - wz, zx + wy, xy + wz, 1 - zz - xx, yz - wx, zx - wy, yz + wx, 1 - xx - yy]
    return np.stack(rows, axis=-1).reshape(*quaternion.shape[:-1], 3, 3)


def to_quaternion(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit quaternion of one rotation matrix, with ``w >= 0``.

    Parameters
    ----------
    matrix : ndarray of float64, shape (3, 3)
        A proper rotation.

    Returns
    -------
    ndarray of float64, shape (4,)
        Unit quaternion, ``xyzw``. It is the eigenvector of the symmetric matrix that holds the four-fold
        products of its components, so no case is ill conditioned.
    """
    (a, b, c), (d, e, f), (g, h, i) = matrix
    products = np.array(
        [
            [a - e - i, b + d, c + g, h - f],
            [b + d, e - a - i, f + h, c - g],
            [c + g, f + h, i - a - e, d - b],
            [h - f, c - g, d - b, a + e + i],
        ]
    )
    quaternion = np.linalg.eigh(products)[1][:, -1]
    return quaternion if quaternion[3] >= 0 else -quaternion


def cross(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    """Cross products; for few vectors several times as fast as NumPy's general one.

    Parameters
    ----------
    first, second : ndarray of float64, shape (..., 3)
        Vectors; the leading dimensions broadcast.

    Returns
    -------
    ndarray of float64, shape (..., 3)
        ``first x second``.
    """
    (a, b, c), (d, e, f) = ((v[..., 0], v[..., 1], v[..., 2]) for v in (first, second))
    return np.stack([b * f - c * e, c * d - a * f, a * e - b * d], axis=-1)


def interpolate(
    times: NDArray[np.float64], quaternions: NDArray[np.float64], at: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Spherical linear interpolation of a sequence of orientations.

    Parameters
    ----------
    times : ndarray of float64, shape (P,)
        Strictly increasing times of the known orientations, any unit.
    quaternions : ndarray of float64, shape (P, 4)
        Unit quaternions, ``xyzw``; the sign of each is free.
    at : ndarray of float64, shape (T,)
        Times wanted, in the same unit, within ``times``.

    Returns
    -------
    ndarray of float64, shape (T, 4)
        Unit quaternions along the shorter arcs.
    """
    if len(times) == 1:
        return np.repeat(quaternions, len(at), axis=0)
    before = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
    fraction = (at - times[before]) / (times[before + 1] - times[before])
    start, end = quaternions[before], quaternions[before + 1]
    cosine = np.sum(start * end, axis=-1)
    end = np.where(cosine[:, None] < 0, -end, end)
    angle = np.arccos(np.clip(np.abs(cosine), 0.0, 1.0))
    small = angle < 1e-6
    sine = np.where(small, 1.0, np.sin(angle))
    left = np.where(small, 1 - fraction, np.sin((1 - fraction) * angle) / sine)
    right = np.where(small, fraction, np.sin(fraction * angle) / sine)
    mixed = left[:, None] * start + right[:, None] * end
    return mixed / np.linalg.norm(mixed, axis=-1, keepdims=True)
