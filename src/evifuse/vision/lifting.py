"""Back from pixels to space: points, ellipses and planes in front of a camera.

All of it is our own. Points are in the camera's optical frame (x right, y down, z forward, metres), pixel
``(u, v)`` is the ray ``K^-1 (u, v, 1)``, and pixel centres are whole numbers, as in
`evifuse.recordings.recording.Camera`.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evifuse.errors import ImageError, UsageError
from evifuse.vision.conics import axes_of, conic_of

__all__ = [
    "Plane",
    "basis_of",
    "covariance_on_plane",
    "ellipse_on_plane",
    "on_depth",
    "on_plane",
    "one_depth",
    "rays_of",
]


@dataclass(frozen=True, eq=False)
class Plane:
    """The plane of all points X, camera frame, with ``normal . X = distance_m``.

    Parameters
    ----------
    normal : ndarray of float64, shape (3,)
        Of any length but 0 (it is brought to length 1); it may face the camera or face away.
    distance_m : float
        Of the plane from the camera along the normal, metres; negative if the normal faces the camera.

    Raises
    ------
    UsageError
        If the normal is 0, a number is not finite, or the plane goes through the camera.

    Examples
    --------
    >>> Plane(np.array([0, 0, 2]), 0.5).normal
    array([0., 0., 1.])
    """

    normal: NDArray[np.float64]
    distance_m: float

    def __post_init__(self) -> None:
        normal = np.asarray(self.normal, np.float64)
        length = float(np.linalg.norm(normal)) if normal.shape == (3,) else 0.0
        if not (np.isfinite(length) and length > 0):
            raise UsageError(f"a plane needs a normal nx, ny, nz other than 0, 0, 0, not {self.normal}")
        if not (np.isfinite(self.distance_m) and self.distance_m != 0):
            raise UsageError(
                f"a plane at {self.distance_m:g} m can't be measured on: give its distance from the camera"
            )
        object.__setattr__(self, "normal", normal / length)
        object.__setattr__(self, "distance_m", float(self.distance_m))


def on_plane(pixels: ArrayLike, matrix: ArrayLike, plane: Plane) -> NDArray[np.float64]:
    """Points of a plane that are seen at pixels.

    A ray ``r = K^-1 (u, v, 1)`` meets the plane at ``r d / (n . r)``.

    Parameters
    ----------
    pixels : array_like of float, shape (..., 2)
        (u, v), px.
    matrix : array_like of float, shape (3, 3)
        Camera matrix K, px.
    plane : Plane
        In the camera frame.

    Returns
    -------
    ndarray of float64, shape (..., 3)
        Camera frame, metres.

    Raises
    ------
    UsageError
        If K is not a camera's.
    ImageError
        If a pixel is not finite or does not see the plane: the plane is behind the camera there.
    """
    rays = rays_of(pixels, matrix)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        depth = plane.distance_m / (rays @ plane.normal)
    wrong = ~(np.isfinite(depth) & (depth > 0))
    if wrong.any():
        first = np.asarray(pixels, np.float64)[wrong][0]
        raise ImageError(
            f"pixel ({first[0]:.1f}, {first[1]:.1f}) does not see the plane: {_named(plane)} lies behind the "
            "camera there, or runs beside it: check the plane's sign"
        )
    return rays * depth[..., None]


def covariance_on_plane(
    pixels: ArrayLike, covariance_px2: ArrayLike, matrix: ArrayLike, plane: Plane
) -> NDArray[np.float64]:
    """How uncertain points of a plane are, from how uncertain the pixels are that they are seen at.

    To first order: ``J C J^T`` with ``J = d X / d (u, v)``, where X is the point that `on_plane` gives. Plane
    and camera count as known, so nothing is uncertain across the plane.

    Parameters
    ----------
    pixels : array_like of float, shape (..., 2)
        (u, v), px.
    covariance_px2 : array_like of float, shape (..., 2, 2)
        Of each pixel's u and v, square px.
    matrix : array_like of float, shape (3, 3)
        Camera matrix K, px.
    plane : Plane
        In the camera frame.

    Returns
    -------
    ndarray of float64, shape (..., 3, 3)
        Of x, y and z in the camera frame, square metres; of rank 2.
    """
    points = on_plane(pixels, matrix, plane)
    slope = np.linalg.inv(np.asarray(matrix, np.float64))[:, :2]
    depth = points[..., 2, None, None]
    along = points[..., :, None] * (plane.normal @ slope) / plane.distance_m
    jacobian = depth * (slope - along)
    return jacobian @ np.asarray(covariance_px2, np.float64) @ np.swapaxes(jacobian, -1, -2)


def on_depth(pixels: ArrayLike, matrix: ArrayLike, depth: ArrayLike) -> NDArray[np.float64]:
    """Points that are seen at pixels, by their measured depth.

    Parameters
    ----------
    pixels : array_like of float, shape (..., 2)
        (u, v), px.
    matrix : array_like of float, shape (3, 3)
        Camera matrix K, px.
    depth : array_like of float, shape () or (H, W)
        Along z, metres: one for all, or a picture, of which the nearest pixel is taken. NaN and 0 mean that
        nothing was measured.

    Returns
    -------
    ndarray of float64, shape (..., 3)
        Camera frame, metres.

    Raises
    ------
    UsageError
        If K is not a camera's, or the single depth is not above 0.
    ImageError
        If a pixel lies outside the depth picture or nothing was measured there.
    """
    rays = rays_of(pixels, matrix)
    depths = np.asarray(depth, np.float64)
    if depths.ndim == 0:
        return rays * one_depth(float(depths))
    if depths.ndim != 2:
        raise ImageError(f"a depth picture has shape (height, width), not {depths.shape}")
    places = np.rint(np.asarray(pixels, np.float64)).astype(np.int64)
    inside = ((places >= 0) & (places < np.array(depths.shape[::-1]))).all(axis=-1)
    if not inside.all():
        u, v = places[~inside][0]
        raise ImageError(
            f"pixel ({u}, {v}) is outside the depth picture of {depths.shape[1]} x {depths.shape[0]} px"
        )
    found = depths[places[..., 1], places[..., 0]]
    missing = ~(np.isfinite(found) & (found > 0))
    if missing.any():
        u, v = places[missing][0]
        raise ImageError(
            f"the depth at pixel ({u}, {v}) is {found[missing][0]:g} m: nothing was measured there; "
            "fill the holes, or give a plane"
        )
    return rays * found[..., None]


def ellipse_on_plane(
    centre: ArrayLike, axes: ArrayLike, angle_rad: ArrayLike, matrix: ArrayLike, plane: Plane
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """The ellipse of a plane that is seen as an ellipse of the picture.

    With the ellipse of the picture as a conic C, and H from coordinates of the plane to pixels, it is the
    conic ``H^T C H``. Its centre is not what is seen at the centre of C: perspective moves it.

    Parameters
    ----------
    centre : array_like of float, shape (..., 2)
        Centres in the picture, px.
    axes : array_like of float, shape (..., 2)
        Whole lengths of the axes, px.
    angle_rad : array_like of float, shape (...)
        From the picture's x axis to the first axis, towards y.
    matrix : array_like of float, shape (3, 3)
        Camera matrix K, px.
    plane : Plane
        In the camera frame.

    Returns
    -------
    centre_m : ndarray of float64, shape (..., 3)
        Camera frame, metres.
    axes_m : ndarray of float64, shape (..., 2)
        Whole lengths of the axes, longest first, metres.
    ends_m : ndarray of float64, shape (..., 4, 3)
        Both ends of the long axis, then of the short one, metres.

    Raises
    ------
    UsageError
        If K is not a camera's.
    ImageError
        If part of an ellipse does not see the plane.
    """
    middle, lengths = np.asarray(centre, np.float64), np.asarray(axes, np.float64)
    angle = np.asarray(angle_rad, np.float64)
    if not (np.isfinite(lengths).all() and (lengths > 0).all() and np.isfinite(angle).all()):
        raise ImageError("an ellipse needs axes above 0 px and a finite angle")
    origin = on_plane(middle, matrix, plane)
    across, along = basis_of(plane.normal)
    scale = np.linalg.norm(origin, axis=-1) * lengths.mean(axis=-1) / np.asarray(matrix, np.float64)[0, 0]
    place = np.stack(
        [across * scale[..., None], along * scale[..., None], origin], axis=-1
    )  # from plane coordinates to the camera frame
    to_pixels = np.asarray(matrix, np.float64) @ place
    conic = np.swapaxes(to_pixels, -1, -2) @ conic_of(middle, lengths, angle) @ to_pixels
    where, half, directions = axes_of(conic)
    if not np.isfinite(half).all():
        raise ImageError(
            f"part of the ellipse at pixel {_first(middle)} does not see the plane: {_named(plane)} lies "
            "behind the camera there: check the plane"
        )
    steps = directions * half[..., None]
    ends = where[..., None, :] + np.concatenate([steps, -steps], axis=-2)[..., [0, 2, 1, 3], :]
    points = np.concatenate([where[..., None, :], ends], axis=-2)
    lifted = np.concatenate([points, np.ones((*points.shape[:-1], 1))], axis=-1) @ np.swapaxes(place, -1, -2)
    return lifted[..., 0, :], 2 * half * scale[..., None], lifted[..., 1:, :]


def rays_of(pixels: ArrayLike, matrix: ArrayLike) -> NDArray[np.float64]:
    """Rays that pixels see.

    Parameters
    ----------
    pixels : array_like of float, shape (..., 2)
        (u, v), px.
    matrix : array_like of float, shape (3, 3)
        Camera matrix K, px.

    Returns
    -------
    ndarray of float64, shape (..., 3)
        With z = 1, camera frame.

    Raises
    ------
    UsageError
        If K is not a camera's.
    ImageError
        If a pixel is not finite.
    """
    k = np.asarray(matrix, np.float64)
    if k.shape != (3, 3) or not np.isfinite(k).all() or not (k[0, 0] > 0 and k[1, 1] > 0):
        raise UsageError("the camera matrix must be 3 x 3 and finite, with focal lengths above 0 px")
    if k[1, 0] != 0 or not np.array_equal(k[2], [0, 0, 1]):
        raise UsageError("the camera matrix must be fx, s, cx over 0, fy, cy over 0, 0, 1")
    points = np.asarray(pixels, np.float64)
    if points.ndim == 0 or points.shape[-1] != 2:
        raise UsageError(f"pixels have shape (..., 2), not {points.shape}")
    if not np.isfinite(points).all():
        raise ImageError("a pixel coordinate is NaN or infinite: leave it out")
    y = (points[..., 1] - k[1, 2]) / k[1, 1]
    x = (points[..., 0] - k[0, 2] - k[0, 1] * y) / k[0, 0]
    return np.stack([x, y, np.ones_like(x)], axis=-1)


def basis_of(normal: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Two unit vectors across a normal and across each other.

    Parameters
    ----------
    normal : ndarray of float64, shape (3,)
        Of length 1.

    Returns
    -------
    tuple of ndarray of float64, shape (3,)
        With the normal a right-handed frame.
    """
    helper = np.eye(3)[int(np.argmin(np.abs(normal)))]
    first: NDArray[np.float64] = np.asarray(np.cross(normal, helper), np.float64)
    first = first / np.linalg.norm(first)
    return first, np.asarray(np.cross(normal, first), np.float64)


def one_depth(depth: float) -> float:
    """A single depth, checked.

    Parameters
    ----------
    depth : float
        Along z, metres.

    Returns
    -------
    float
        The same.

    Raises
    ------
    UsageError
        If it is not above 0.
    """
    if not (np.isfinite(depth) and depth > 0):
        raise UsageError(f"a depth of {depth:g} m can't be measured at: it must be above 0")
    return depth


def _named(plane: Plane) -> str:
    x, y, z = plane.normal
    return f"the plane with normal {x:.3g}, {y:.3g}, {z:.3g} at {plane.distance_m:.3g} m"


def _first(points: NDArray[np.float64]) -> str:
    x, y = points.reshape(-1, 2)[0]
    return f"({x:.1f}, {y:.1f})"
