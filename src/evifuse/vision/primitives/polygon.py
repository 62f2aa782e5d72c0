"""Hypothesised polygons: the one of several that stands best for each outline."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.fit import FittedEdges
from evifuse.vision.geometry import (
    corner_angles,
    distances_to_polygon,
    length_before,
    side_lengths,
)
from evifuse.vision.primitives.agreement import LEAST_TRUST, Agreement, agreement
from evifuse.vision.primitives.hypothesis import Geometry, Proposals
from evifuse.vision.primitives.odds import log_odds
from evifuse.vision.primitives.outline import Outlines
from evifuse.vision.sides import fit_sides

__all__ = ["FittedPolygons", "fit_polygons", "mean_of_sides", "pattern_proposals"]

POINTED_POWER = 0.7
"""How fast the odds of a triangle fall with the sine of its smallest angle (our own, tuned)."""

RATIO_POWER = 1.5
"""How fast the odds of a quadrilateral fall with the ratio of its opposite sides (our own, tuned)."""

SKEW_POWER = 1.8
"""How fast the odds of a quadrilateral fall with the product of the sines of its angles (our own, tuned)."""


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
    odds : ndarray of float64, shape (B,)
        Logarithm of its odds against other shapes, up to a constant of the outline.
    """

    found: NDArray[np.bool_]
    corners: NDArray[np.float64]
    sides: FittedEdges
    match: Agreement
    odds: NDArray[np.float64]

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


def fit_polygons(outlines: Outlines, choices: Sequence[NDArray[np.float64]]) -> FittedPolygons:
    """The polygon that stands best for each outline.

    Parameters
    ----------
    outlines : Outlines
        What is seen.
    choices : sequence of ndarray of float64, shape (B, K, 2)
        Corners of polygons to choose from, px; NaN for none.

    Returns
    -------
    FittedPolygons
        Those with the highest odds; none where outline and polygon do not agree.
    """
    matches = [agreement(outlines, *_nearest(outlines.points, polygon)) for polygon in choices]
    odds = [log_odds(m, outlines.tolerance) + _form(c) for m, c in zip(matches, choices, strict=True)]
    values = np.stack([o + np.log(m.trust + 1e-9) for o, m in zip(odds, matches, strict=True)])
    best = np.nan_to_num(values, nan=-np.inf).argmax(axis=0)
    polygon, match, chosen = choices[0].copy(), matches[0], odds[0]
    for k in range(1, len(choices)):
        polygon = np.where((best == k)[:, None, None], choices[k], polygon)
        match, chosen = matches[k].where(best == k, match), np.where(best == k, odds[k], chosen)
    found = match.trust >= LEAST_TRUST
    polygon[~found] = np.nan
    sides = fit_sides(outlines.starts, outlines.ends, outlines.owner, polygon)
    return FittedPolygons(found, polygon, sides, match, chosen)


def _form(polygon: NDArray[np.float64]) -> NDArray[np.float64]:
    """Logarithm of the odds of the form of triangles and quadrilaterals (our own, tuned).

    0 for more corners. Lower for pointed triangles, and for quadrilaterals that are skew or have unlike
    opposite sides: a triangle with a cut corner is one of those.
    """
    sines = np.sin(corner_angles(polygon))
    if polygon.shape[1] == 3:
        return POINTED_POWER * np.log(np.maximum(sines.min(axis=1), 0.02))
    if polygon.shape[1] != 4:
        return np.zeros(len(polygon))
    lengths = side_lengths(polygon)
    ratio = (np.minimum(lengths[:, :2], lengths[:, 2:]) / np.maximum(lengths[:, :2], lengths[:, 2:])).min(
        axis=1
    )
    return RATIO_POWER * np.log(np.maximum(ratio, 1e-3)) + SKEW_POWER * np.log(
        np.maximum(sines.prod(axis=1), 1e-3)
    )


def _nearest(
    points: NDArray[np.float64], polygon: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Distance of points from polygons, and the share of the polygon's length before the nearest place."""
    distance, position = distances_to_polygon(points, polygon)
    return distance, length_before(polygon, position)


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
        family={3: "triangle", 4: "quadrilateral"}.get(polygons.corners.shape[1], kind),
        proposed=polygons.found,
        belief=pattern * match.trust,
        shape=polygons.corners,
        deviation=match.deviation,
        odds=polygons.odds,
        terms={
            "pattern": pattern,
            "fit": match.fit,
            "explained": match.explained,
            "coverage": match.coverage,
        },
        geometry=polygons.geometry,
        edges=polygons.sides,
    )
