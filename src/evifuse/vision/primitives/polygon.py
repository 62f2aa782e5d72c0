"""Hypothesised polygons: few corners for each outline, refined on its points."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.fit import FittedEdges
from evifuse.vision.geometry import (
    area,
    corner_angles,
    distances_to_polygon,
    fit_line,
    following,
    intersection,
    side_lengths,
)
from evifuse.vision.primitives.agreement import LEAST_TRUST, Agreement, agreement
from evifuse.vision.primitives.hypothesis import Geometry, Proposals
from evifuse.vision.primitives.outline import Outlines
from evifuse.vision.reduce import reduce_polygons
from evifuse.vision.sides import fit_sides

__all__ = ["FittedPolygons", "fit_polygons", "mean_of_sides", "pattern_proposals", "straight_deviation"]

MOST_ADDED = {3: 1.55, 4: 1.45}
"""A polygon with so many corners that encloses more than this times the hull is no hypothesis (our own): a
circle needs 1.65 for a triangle and 1.27 for a quadrilateral, a square 2.0 for a triangle."""


@dataclass(frozen=True, eq=False)
class FittedPolygons:
    """A polygon for each of many outlines.

    Parameters
    ----------
    found : ndarray of bool, shape (B,)
        Where there is one.
    corners : ndarray of float64, shape (B, K, 2)
        Corners in order, px; NaN for none.
    sides : FittedEdges
        Fitted edges, shape (B, K), from corner ``i`` to corner ``i + 1``.
    match : Agreement
        How well outline and polygon agree.
    """

    found: NDArray[np.bool_]
    corners: NDArray[np.float64]
    sides: FittedEdges
    match: Agreement

    @property
    def lengths(self) -> NDArray[np.float64]:
        """Lengths of the sides, px, shape (B, K); NaN for a missing one."""
        return np.where(np.isnan(self.sides.beliefs), np.nan, side_lengths(self.corners))

    @property
    def angles(self) -> NDArray[np.float64]:
        """Interior angles at the end of each side, radians, shape (B, K)."""
        return np.roll(corner_angles(self.corners), -1, axis=1)

    def geometry(self, i: int) -> Geometry:
        """Where the polygon of one outline lies.

        Parameters
        ----------
        i : int
            Number of the outline.

        Returns
        -------
        Geometry
            Its corners.
        """
        return {"corners": self.corners[i].tolist()}


def fit_polygons(outlines: Outlines, reduced: NDArray[np.float64]) -> FittedPolygons:
    """Convex polygon that stands for each outline.

    It starts as the hull reduced to few sides; then each side is fitted to the points next to it, twice,
    the farthest tenth left out, and the corners move to where the sides meet (our own).

    Parameters
    ----------
    outlines : Outlines
        What is seen.
    reduced : ndarray of float64, shape (B, K, 2)
        Hulls reduced to few corners, px; NaN for none.

    Returns
    -------
    FittedPolygons
        None where the reduced hull is much larger than the hull, or outline and polygon do not agree.
    """
    polygon = reduced.copy()
    polygon[area(polygon) > MOST_ADDED[reduced.shape[1]] * outlines.inside] = np.nan
    for _ in range(2):
        polygon = _refined(outlines.points, outlines.tolerance, outlines.width, polygon)
    distance, _ = distances_to_polygon(outlines.points, polygon)
    match = agreement(outlines, polygon, distance)
    found = match.trust >= LEAST_TRUST
    polygon[~found] = np.nan
    sides = fit_sides(outlines.starts, outlines.ends, outlines.owner, polygon)
    return FittedPolygons(found, polygon, sides, match)


def straight_deviation(outlines: Outlines, which: NDArray[np.intp], sides: int) -> NDArray[np.float64]:
    """How far outlines stray from the polygon with so many sides that follows them (our own).

    Parameters
    ----------
    outlines : Outlines
        What is seen.
    which : ndarray of intp, shape (R,)
        The outlines to look at.
    sides : int
        How many sides.

    Returns
    -------
    ndarray of float64, shape (R,)
        Root mean square deviation of all points, each at most four tolerances, px; infinite without such a
        polygon.
    """
    points, tolerance = outlines.points[which], outlines.tolerance[which]
    polygon = reduce_polygons(outlines.hull[which], outlines.corners[which], (sides,))[sides]
    for _ in range(2):
        polygon = _refined(points, tolerance, outlines.width[which], polygon)
    distance, _ = distances_to_polygon(points, polygon)
    deviation = np.sqrt((np.minimum(distance, 4 * tolerance[:, None]) ** 2).mean(axis=1))
    return np.where(np.isnan(deviation), np.inf, deviation)


def _refined(
    points: NDArray[np.float64],
    tolerance: NDArray[np.float64],
    width: NDArray[np.float64],
    polygon: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Polygons with each side fitted to the points next to it."""
    distance, side = distances_to_polygon(points, polygon)
    points = points[:, None]
    along = following(polygon) - polygon
    spans = np.maximum(side_lengths(polygon), 1e-9)[..., None]
    t = ((points - polygon[:, :, None]) * along[:, :, None]).sum(axis=-1) / spans**2
    inner = (side[:, None] == np.arange(polygon.shape[1])[:, None]) & (t > 0.08) & (t < 0.92)
    inner &= (distance <= 4 * tolerance[:, None])[:, None]
    count = inner.sum(axis=-1, keepdims=True)
    apart = np.where(inner, distance[:, None], np.inf)
    rank = np.maximum(np.maximum(4, np.ceil(0.9 * count).astype(np.intp)) - 1, 0)
    limit = np.take_along_axis(np.sort(apart, axis=-1), rank, axis=-1)
    centre, direction = fit_line(points, (inner & (apart <= limit)).astype(np.float64))
    fitted = count >= 4
    centre, direction = np.where(fitted, centre, polygon), np.where(fitted, direction, along / spans)
    before = np.roll(centre, 1, axis=1), np.roll(direction, 1, axis=1)
    meeting = intersection(*before, centre, direction)
    moved = np.hypot(*np.moveaxis(meeting - polygon, -1, 0))
    keep = ~(moved <= (0.25 * width + 3)[:, None])
    return np.where(keep[..., None], polygon, meeting)


def mean_of_sides(beliefs: NDArray[np.float64], least: int) -> NDArray[np.float64]:
    """Mean belief of the sides that are present (the project's reading of section 3.2).

    Parameters
    ----------
    beliefs : ndarray of float64, shape (..., K)
        Belief in each side; NaN for a missing one.
    least : int
        With fewer sides the mean is 0.

    Returns
    -------
    ndarray of float64, shape (...)
        In [0, 1].
    """
    present = (~np.isnan(beliefs)).sum(axis=-1)
    return np.where(present >= least, np.nansum(beliefs, axis=-1) / np.maximum(present, 1), 0.0)


def pattern_proposals(kind: str, polygons: FittedPolygons, pattern: NDArray[np.float64]) -> Proposals:
    """Proposals of a polygonal primitive.

    The belief of the chapter is multiplied by how well outline and polygon agree (fit, explained share and
    coverage; our own): the chapter starts from edges that are known to belong to the pattern.

    Parameters
    ----------
    kind : str
        Member of the shape frame.
    polygons : FittedPolygons
        One for each outline.
    pattern : ndarray of float64, shape (B,)
        Belief of the chapter, in [0, 1].

    Returns
    -------
    Proposals
        Where there is a polygon.
    """
    match = polygons.match
    return Proposals(
        kind=kind,
        proposed=polygons.found,
        belief=pattern * match.trust,
        shape=polygons.corners,
        deviation=match.deviation,
        terms={
            "pattern": pattern,
            "fit": match.fit,
            "explained": match.explained,
            "coverage": match.coverage,
        },
        geometry=polygons.geometry,
        edges=polygons.sides,
    )
