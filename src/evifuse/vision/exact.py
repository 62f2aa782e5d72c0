"""Hypotheses and fitted edges placed exactly, each with its uncertainty in pixels.

Outlines are followed in whole pixels of a smoothed copy of the picture. What is kept of them is fitted once
more to the picture itself: sides to the edge points along them, corners to where neighbouring sides meet,
ellipses to the edge points around them. Beliefs stay as they are. All of it is our own.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.fit import FittedEdge
from evifuse.vision.geometry import distances_to_polygon, intersection
from evifuse.vision.primitives import Geometry, Hypothesis
from evifuse.vision.refine import ExactEllipses, ExactLines, exact_ellipses, exact_lines

__all__ = ["exact_hypotheses", "with_rough_ends"]

LEAST_BELIEF = 0.04
"""Hypotheses that are believed less are not worth the time (our own)."""

ROUGH_PX = 0.6
"""Standard deviation of a side that follows whole working pixels only, working px (our own, measured)."""

END_PX = 1.5
"""Standard deviation, along a side, of the place where its edge ends without meeting another (our own)."""

CORNER_PX = 5.0
"""An edge that ends so near to a corner meets the next one there, px (our own)."""

CORNER_SHARE = 0.15
"""The same as a share of the side; the larger of both holds (our own)."""

MOST_MOVED_PX = 10.0
"""A corner moves by at most so much, and 15 % of its longer side: sides may nearly be parallel (our own)."""

HIDDEN = 0.1
"""A corner beside a hidden side is uncertain along the seen side by this share of it (our own)."""


def exact_hypotheses(
    shown: Sequence[tuple[Hypothesis, ...]], picture: NDArray[np.uint8], scale: float
) -> list[tuple[Hypothesis, ...]]:
    """Place the hypotheses of every object exactly.

    Parameters
    ----------
    shown : sequence of tuple of Hypothesis
        Of each object, in pixels of the picture.
    picture : ndarray of uint8, shape (H, W) or (H, W, 3)
        Grey or BGR.
    scale : float
        Working pixels per pixel of the picture, by which the edges were found.

    Returns
    -------
    list of tuple of Hypothesis
        The same with corners, centre, axes and edges moved to the edge in the picture, and with their
        uncertainty: `corners_covariance_px2`; or `centre_covariance_px2`, `axes_std_px` (of a circle
        `radius_std_px`) and `angle_std_rad`. Those whose edge is not found again stay, with a rough one.
        Hypotheses with a belief below 0.04 are left as they are, but for the first of each object.
    """
    unit = max(1.0, 1.0 / scale)
    polygons: dict[bytes, Hypothesis] = {}
    rounds: dict[bytes, Hypothesis] = {}
    worth = [tuple(h for h in hs if h is hs[0] or h.belief >= LEAST_BELIEF) for hs in shown]
    for h in (h for hypotheses in worth for h in hypotheses):
        if "corners" in h.geometry:
            polygons[h.shape.tobytes()] = h
        elif "axes" in h.geometry or ("centre" in h.geometry and h.shape.tobytes() not in rounds):
            rounds[h.shape.tobytes()] = h
    placed = dict(zip(polygons, _polygons(list(polygons.values()), picture, scale, unit), strict=True))
    ellipses = _ellipses(list(rounds.values()), picture, scale, unit)
    number = {key: i for i, key in enumerate(rounds)}

    def one(h: Hypothesis) -> Hypothesis:
        key = h.shape.tobytes()
        if key in placed:
            return _with(h, placed[key])
        return _round(h, ellipses, number[key]) if key in number else h

    return [tuple(map(one, hypotheses)) for hypotheses in shown]


def with_rough_ends(edge: FittedEdge, scale: float) -> FittedEdge:
    """A fitted edge with the uncertainty that whole working pixels leave.

    Parameters
    ----------
    edge : FittedEdge
        In pixels of the picture.
    scale : float
        Working pixels per pixel of the picture.

    Returns
    -------
    FittedEdge
        Where it was.
    """
    u = (edge.end - edge.start) / max(edge.length, 1e-9)
    v = np.array([-u[1], u[0]])
    covariance = (np.outer(u, u) * END_PX**2 + np.outer(v, v) * ROUGH_PX**2) / scale**2
    return replace(edge, start_covariance_px2=covariance, end_covariance_px2=covariance)


_PlacedPolygon: TypeAlias = tuple[NDArray[np.float64], NDArray[np.float64], tuple[FittedEdge, ...]]
"""Corners (K, 2), their covariances (K, 2, 2), and the fitted edges."""


def _polygons(
    found: list[Hypothesis], picture: NDArray[np.uint8], scale: float, unit: float
) -> list[_PlacedPolygon]:
    """Every polygon with its sides fitted anew: all corners of all of them are one list."""
    if not found:
        return []
    polygons = [np.array(h.geometry["corners"], np.float64) for h in found]
    counts = np.array([len(c) for c in polygons])
    first = np.cumsum(counts) - counts
    corners = np.concatenate(polygons)
    after = np.arange(len(corners)) + 1
    after[first + counts - 1] = first
    sides = [b + _sides_of(h.edges, c) for h, c, b in zip(found, polygons, first, strict=True)]
    side = np.concatenate(sides)
    lines = exact_lines(
        picture, corners, corners[after], unit, np.repeat([_rough(h, scale) for h in found], counts)
    )
    place, covariance, met = _corners(corners, after, side, lines, unit)
    fitted = [e for h in found for e in h.edges]
    points = np.array([[e.start, e.end] for e in fitted]).reshape(-1, 2, 2)
    ends, spread = points.copy(), np.zeros((len(fitted), 2, 2, 2))
    length = np.hypot(*(corners[after] - corners).T)[side]
    for i, corner in enumerate((side, after[side])):
        near = np.hypot(*(points[:, i] - corners[corner]).T) <= np.maximum(
            CORNER_PX * unit, CORNER_SHARE * length
        )
        meets = met[corner] & near
        foot, about = _free_ends(points[:, i], lines.part(side), unit)
        ends[:, i] = np.where(meets[:, None], place[corner], foot)
        spread[:, i] = np.where(meets[:, None, None], covariance[corner], about)
    edges = [
        FittedEdge(x[0], x[1], e.belief, c[0], c[1]) for e, x, c in zip(fitted, ends, spread, strict=True)
    ]
    until = np.cumsum([len(s) for s in sides])
    return [
        (place[b : b + n], covariance[b : b + n], tuple(edges[u - len(s) : u]))
        for b, n, u, s in zip(first.tolist(), counts.tolist(), until.tolist(), sides, strict=True)
    ]


def _rough(found: Hypothesis, scale: float) -> float:
    """Standard deviation of an outline that is not found again, px."""
    return float(np.hypot(ROUGH_PX, found.deviation / 2)) / scale


def _corners(
    corners: NDArray[np.float64],
    after: NDArray[np.intp],
    side: NDArray[np.intp],
    lines: ExactLines,
    unit: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Where neighbouring sides meet, the covariance of that, and whether they do.

    A corner with a hidden side keeps its place along the other side; one between two hidden sides stays.
    """
    before = np.empty_like(after)
    before[after] = np.arange(len(after))
    lengths = np.hypot(*(corners[after] - corners).T)
    seen = np.zeros(len(corners), np.bool_)
    seen[side] = True
    other = lines.part(before)
    place = intersection(other.centres, other.directions, lines.centres, lines.directions)
    moved = np.hypot(*(np.nan_to_num(place, nan=np.inf) - corners).T)
    reach = MOST_MOVED_PX * unit + CORNER_SHARE * np.maximum(lengths, lengths[before])
    met = seen & seen[before] & (moved <= reach)
    own = lines.part(np.where(seen, np.arange(len(corners)), before))
    place = np.where(met[:, None], place, own.foot(corners))
    along = (HIDDEN * lengths) ** 2 + (END_PX * unit) ** 2
    normals = np.stack([np.where(met[:, None], other.normals, own.directions), own.normals], axis=1)
    variance = np.stack([np.where(met, other.variance_at(place), along), own.variance_at(place)], axis=1)
    none = ~(seen | seen[before])
    place[none], normals[none], variance[none] = corners[none], np.eye(2), along[none, None]
    return place, _from_lines(normals, variance), met


def _free_ends(
    points: NDArray[np.float64], lines: ExactLines, unit: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Ends of edges that meet no other: on their line, and uncertain along it."""
    foot = lines.foot(points)
    across = lines.variance_at(foot)
    variance = np.stack([np.full_like(across, (END_PX * unit) ** 2), across], axis=1)
    return foot, _from_lines(np.stack([lines.directions, lines.normals], axis=1), variance)


def _sides_of(edges: tuple[FittedEdge, ...], corners: NDArray[np.float64]) -> NDArray[np.intp]:
    """Which side of the polygon each fitted edge stands for."""
    if len(edges) == len(corners):
        return np.arange(len(corners))
    if not edges:
        return np.empty(0, np.intp)
    middle = np.array([(e.start + e.end) / 2 for e in edges])
    return distances_to_polygon(middle, corners)[1].astype(np.intp) % len(corners)


def _from_lines(normals: NDArray[np.float64], variance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Covariance of where two lines meet, from their normals (..., 2, 2) and the variances of both."""
    inverse = np.linalg.inv(normals)
    return (inverse * variance[..., None, :]) @ np.swapaxes(inverse, -1, -2)


def _with(found: Hypothesis, placed: _PlacedPolygon) -> Hypothesis:
    """A polygon in its exact place."""
    corners, covariance, edges = placed
    geometry: Geometry = {
        **found.geometry,
        "corners": corners.tolist(),
        "corners_covariance_px2": covariance.tolist(),
    }
    return replace(found, geometry=geometry, shape=corners, edges=edges)


def _ellipses(
    found: list[Hypothesis], picture: NDArray[np.uint8], scale: float, unit: float
) -> ExactEllipses:
    """Every ellipse fitted anew."""
    diameter = [2 * np.asarray(h.geometry.get("radius", np.nan), np.float64) for h in found]
    axes = [h.geometry.get("axes", [d, d]) for h, d in zip(found, diameter, strict=True)]
    return exact_ellipses(
        picture,
        np.array([h.geometry["centre"] for h in found], np.float64).reshape(-1, 2),
        np.array(axes, np.float64).reshape(-1, 2),
        np.array([h.geometry.get("angle_rad", 0.0) for h in found], np.float64),
        unit,
        np.array([_rough(h, scale) for h in found]),
    )


def _round(found: Hypothesis, ellipses: ExactEllipses, i: int) -> Hypothesis:
    """An ellipse, or what lies on one, in its exact place."""
    axes, spread = ellipses.axes[i], ellipses.axes_std[i]
    geometry: Geometry = {
        **found.geometry,
        "centre": ellipses.centre[i].tolist(),
        "centre_covariance_px2": ellipses.centre_covariance[i].tolist(),
    }
    if "radius" in geometry:
        geometry |= {"radius": float(axes.mean() / 2), "radius_std_px": float(np.hypot(*spread) / 4)}
    else:
        geometry |= {
            "axes": axes.tolist(),
            "axes_std_px": spread.tolist(),
            "angle_rad": float(ellipses.angle_rad[i]),
            "angle_std_rad": float(ellipses.angle_std[i]),
        }
    return replace(found, geometry=geometry, shape=ellipses.shape(i))
