"""Seen objects in metres: where their primitives and edges lie in front of the camera, and how large.

The geometry is in `evifuse.vision.lifting`, whose functions are offered here too. All of it is our own.
"""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evifuse.errors import ImageError
from evifuse.vision.fit import FittedEdge
from evifuse.vision.lifting import (
    Plane,
    covariance_on_plane,
    ellipse_on_plane,
    on_depth,
    on_plane,
    one_depth,
    rays_of,
)
from evifuse.vision.primitives import Geometry, Hypothesis
from evifuse.vision.sensor import SeenObject

__all__ = [
    "Plane",
    "Surface",
    "covariance_on_plane",
    "ellipse_on_plane",
    "measure",
    "on_depth",
    "on_plane",
    "plane_in_depth",
]

INNER_SHARE = 0.85
"""Depth is fitted inside an outline shrunk by this factor: at its border, depth is mixed."""

LEAST_DEPTHS = 12
"""A plane is not fitted to fewer measured depths."""


Surface: TypeAlias = "Plane | float | NDArray[np.floating[Any]]"
"""Where things lie: a plane; one depth for all, m; or a picture of depths along z, shape (H, W), m."""


def plane_in_depth(polygon: ArrayLike, matrix: ArrayLike, depth: ArrayLike) -> tuple[Plane, float]:
    """Plane of what lies inside an outline, from a depth picture.

    On a plane ``1/z`` is linear in the pixel: ``1/z = (n/d) . r``. Of the planes through three random depths
    (always the same ones) that with the least median residual is refined by least squares with Tukey's
    weights, so that a minority of depths from elsewhere does little harm. The outline is shrunk before,
    because at its border the depth is that of the object or of what is behind.

    Parameters
    ----------
    polygon : array_like of float, shape (N, 2)
        Outline, px.
    matrix : array_like of float, shape (3, 3)
        Camera matrix K, px.
    depth : array_like of float, shape (H, W)
        Depths along z, metres; NaN and 0 where nothing was measured.

    Returns
    -------
    plane : Plane
        In the camera frame.
    error_m : float
        Root mean square of the depths about it, weighted as in the fit, metres.

    Raises
    ------
    ImageError
        If too few depths were measured inside the outline, or they don't fix a plane.
    """
    depths = np.asarray(depth, np.float64) if np.ndim(depth) != 2 else np.asarray(depth)
    if depths.ndim != 2:
        raise ImageError(f"a depth picture has shape (height, width), not {depths.shape}")
    pixels, z = _depths_inside(np.asarray(polygon, np.float64), depths)
    if len(z) < LEAST_DEPTHS:
        raise ImageError(
            f"only {len(z)} depths were measured inside the outline: {LEAST_DEPTHS} are needed for a plane"
        )
    rays = rays_of(pixels, matrix)
    inverse = 1 / z
    slope = _least_median(rays, inverse)
    weights = np.ones(len(z))
    for _ in range(5):
        residual = inverse - rays @ slope
        spread = 4.685 * 1.4826 * float(np.median(np.abs(residual)))
        weights = np.clip(1 - (residual / max(spread, 1e-12 * inverse.max())) ** 2, 0, None) ** 2
        root = np.sqrt(weights)[:, None]
        slope = np.asarray(np.linalg.lstsq(rays * root, inverse * root[:, 0], rcond=None)[0], np.float64)
    plane = Plane(slope, 1 / float(np.linalg.norm(slope)))
    off = (plane.distance_m / (rays @ plane.normal) - z) ** 2
    return plane, float(np.sqrt(np.sum(weights * off) / np.sum(weights)))


def measure(seen: SeenObject, matrix: ArrayLike, surface: Surface) -> dict[str, Any]:
    """An object's primitives and fitted edges in metres.

    Parameters
    ----------
    seen : SeenObject
        What the shape sensor gave.
    matrix : array_like of float, shape (3, 3)
        Camera matrix K, px, of the picture that the sensor saw.
    surface : Plane, float or ndarray of shape (H, W)
        Where the object lies. Of a depth picture the plane inside the most believed primitive is taken.

    Returns
    -------
    dict
        `primitives`: for each one, in the order of the object's, `corners_m` and `sides_m` (side i goes from
        corner i to the next) or `centre_m`, `axes_m` and `axis_ends_m` (of a circle `radius_m` too);
        `fitted_edges`: `start_m`, `end_m` and `length_m`; `plane`: `normal`, `distance_m`, and from a depth
        picture `error_m`. With the uncertainty that the pixels have, where it is known:
        `corners_covariance_m2`, `centre_covariance_m2`, `start_covariance_m2`, `end_covariance_m2` (each
        3 x 3) and `length_std_m`. Plain lists and numbers. Of the primitives after the first, one that
        reaches beyond the plane's horizon has no metres.

    Raises
    ------
    UsageError
        If K, the plane or the depth can't be used.
    ImageError
        If the object does not lie on the plane in front of the camera, or its depth was not measured.
    """
    error = None
    if isinstance(surface, Plane):
        plane = surface
    elif np.ndim(surface) == 0:
        plane = Plane(np.array([0.0, 0.0, 1.0]), one_depth(float(surface)))
    else:
        outline = seen.primitives[0].shape if seen.primitives else _corners(seen.box)
        plane, error = plane_in_depth(outline, matrix, surface)
    where = {"normal": plane.normal.tolist(), "distance_m": plane.distance_m}
    return {
        "primitives": [_measured(h, matrix, plane, i == 0) for i, h in enumerate(seen.primitives)],
        "fitted_edges": [_edge_measured(e, matrix, plane) for e in seen.fitted_edges],
        "plane": where if error is None else {**where, "error_m": error},
    }


def _edge_measured(edge: FittedEdge, matrix: ArrayLike, plane: Plane) -> dict[str, Any]:
    """A fitted edge in metres; the ends of its length count as independent."""
    pixels = np.stack([edge.start, edge.end])
    start, end = on_plane(pixels, matrix, plane)
    length = float(np.linalg.norm(end - start))
    found = {"start_m": start.tolist(), "end_m": end.tolist(), "length_m": length}
    covariance = np.stack([edge.start_covariance_px2, edge.end_covariance_px2])
    if not np.isfinite(covariance).all():
        return found
    first, last = covariance_on_plane(pixels, covariance, matrix, plane)
    along = (end - start) / max(length, 1e-12)
    return {
        **found,
        "start_covariance_m2": first.tolist(),
        "end_covariance_m2": last.tolist(),
        "length_std_m": float(np.sqrt(along @ (first + last) @ along)),
    }


def _measured(found: Hypothesis, matrix: ArrayLike, plane: Plane, must: bool) -> dict[str, Any]:
    """A primitive in metres; nothing for one that reaches beyond the plane, unless it must not."""
    try:
        return _primitive(found, matrix, plane)
    except ImageError:
        if must:
            raise
        return {}


def _primitive(found: Hypothesis, matrix: ArrayLike, plane: Plane) -> dict[str, Any]:
    geometry = found.geometry
    if "corners" in geometry:
        corners = on_plane(geometry["corners"], matrix, plane)
        sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=-1)
        known: dict[str, Any] = {"corners_m": corners.tolist(), "sides_m": sides.tolist()}
        return known | _uncertainty("corners", geometry, matrix, plane)
    if "centre" not in geometry:
        return {}
    radius: Any = geometry.get("radius")
    axes: Any = geometry["axes"] if radius is None else [2 * radius, 2 * radius]
    angle: Any = geometry.get("angle_rad", 0.0)
    centre, axes_m, ends = ellipse_on_plane(geometry["centre"], axes, angle, matrix, plane)
    known = {"centre_m": centre.tolist(), "axes_m": axes_m.tolist(), "axis_ends_m": ends.tolist()}
    if found.kind == "circle":
        known["radius_m"] = float(axes_m.mean() / 2)
    return known | _uncertainty("centre", geometry, matrix, plane)


def _uncertainty(what: str, geometry: Geometry, matrix: ArrayLike, plane: Plane) -> dict[str, Any]:
    """Covariance in metres of corners or centre, if it is known in pixels."""
    covariance = geometry.get(f"{what}_covariance_px2")
    if covariance is None:
        return {}
    found = covariance_on_plane(geometry[what], covariance, matrix, plane)
    return {f"{what}_covariance_m2": found.tolist()}


def _least_median(rays: NDArray[np.float64], inverse: NDArray[np.float64]) -> NDArray[np.float64]:
    """Slope of the plane, through three of the depths, that most depths are near to."""
    random = np.random.default_rng(0)
    chosen = random.choice(len(rays), min(len(rays), 500), replace=False)
    triples = random.choice(chosen, (200, 3))
    corners = rays[triples]
    spread_out = np.abs(np.linalg.det(corners)) > 1e-9 * np.ptp(rays, axis=0).max() ** 2
    if not spread_out.any():
        raise ImageError("the depths inside the outline lie on a line of pixels and fix no plane")
    slopes = np.linalg.solve(corners[spread_out], inverse[triples[spread_out]][..., None])[..., 0]
    medians = np.median(np.abs(inverse[chosen] - slopes @ rays[chosen].T), axis=-1)
    return slopes[int(np.argmin(medians))]


def _depths_inside(
    polygon: NDArray[np.float64], depths: NDArray[Any]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Pixels inside a shrunk outline where depth was measured, shape (M, 2), and the depths there."""
    import cv2

    centre = polygon.mean(axis=0)
    inner = centre + INNER_SHARE * (polygon - centre)
    low = np.clip(np.floor(inner.min(axis=0)), 0, None).astype(np.int64)
    high = np.minimum(np.ceil(inner.max(axis=0)).astype(np.int64) + 1, depths.shape[::-1])
    if (high <= low).any():
        raise ImageError(
            f"the outline lies outside the depth picture of {depths.shape[1]} x {depths.shape[0]} px"
        )
    mask = np.zeros((int(high[1] - low[1]), int(high[0] - low[0])), np.uint8)
    cv2.fillPoly(mask, [np.rint(inner - low).astype(np.int32)], 1)
    part = depths[low[1] : high[1], low[0] : high[0]].astype(np.float64)
    rows, columns = np.nonzero((mask > 0) & np.isfinite(part) & (part > 0))
    return np.column_stack([columns, rows]) + low.astype(np.float64), part[rows, columns]


def _corners(box: tuple[int, int, int, int]) -> NDArray[np.float64]:
    x, y, w, h = box
    return np.array([[x, y], [x + w, y], [x + w, y + h], [x, y + h]], np.float64)
