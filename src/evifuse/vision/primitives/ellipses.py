"""Ellipses fitted to outlines."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.geometry import length_before
from evifuse.vision.primitives.agreement import LEAST_TRUST, Agreement, agreement
from evifuse.vision.primitives.hypothesis import Geometry
from evifuse.vision.primitives.odds import log_odds
from evifuse.vision.primitives.outline import POINTS, Outlines

__all__ = ["FittedEllipses", "fit_ellipses", "tangency_of"]

CORNERS = 48
"""Corners of the polygon that stands for an ellipse."""

LEAST_AXIS_PX = 0.5
"""An ellipse whose short axis is no longer than this is a line, px (our own)."""


@dataclass(frozen=True, eq=False)
class FittedEllipses:
    """An ellipse for each of many outlines.

    Parameters
    ----------
    found : ndarray of bool, shape (B,)
        Where there is one.
    centre : ndarray of float64, shape (B, 2)
        (x, y), px.
    axes : ndarray of float64, shape (B, 2)
        Full lengths of the long and the short axis, px.
    angle_rad : ndarray of float64, shape (B,)
        Direction of the long axis from x towards y, radians, in [-pi / 2, pi / 2).
    match : Agreement
        How well outline and ellipse agree.
    tangency : ndarray of float64, shape (B,)
        How well the edge segments run along it, see `tangency_of`.
    odds : ndarray of float64, shape (B,)
        Logarithm of its odds against other shapes, up to a constant of the outline.
    """

    found: NDArray[np.bool_]
    centre: NDArray[np.float64]
    axes: NDArray[np.float64]
    angle_rad: NDArray[np.float64]
    match: Agreement
    tangency: NDArray[np.float64]
    odds: NDArray[np.float64]

    @cached_property
    def shape(self) -> NDArray[np.float64]:
        """Points on the ellipses, in order, px, shape (B, 48, 2)."""
        return _polygons(np.column_stack([self.centre, self.axes, self.angle_rad]))

    def geometry(self, i: int) -> Geometry:
        """Where the ellipse of one outline lies.

        Parameters
        ----------
        i : int
            Number of the outline.

        Returns
        -------
        Geometry
            Centre, axes and angle.
        """
        return {
            "centre": self.centre[i].tolist(),
            "axes": self.axes[i].tolist(),
            "angle_rad": float(self.angle_rad[i]),
        }


def fit_ellipses(outlines: Outlines) -> FittedEllipses:
    """Ellipses of least squared algebraic distance that stay ellipses (Fitzgibbon et al., 1999).

    Fitted twice: once to all points, once to the nearest 85 % of them; the better one is taken.

    Parameters
    ----------
    outlines : Outlines
        What is seen.

    Returns
    -------
    FittedEllipses
        None where the points lie on no ellipse of a size comparable with the outline, or far from it.
    """
    points = outlines.points
    first = _direct(points, np.zeros(points.shape[:2]), 0)
    distance, position = _nearest(points, first)
    match = agreement(outlines, distance, position)
    second = _direct(points, distance, POINTS - int(0.85 * POINTS))
    other = agreement(outlines, *_nearest(points, second))
    better = other.deviation < match.deviation
    best, match = np.where(better[:, None], second, first), other.where(better, match)
    return FittedEllipses(
        found=(best[:, 2] <= 3 * outlines.extent) & (match.fit * match.explained >= LEAST_TRUST),
        centre=best[:, :2],
        axes=best[:, 2:4],
        angle_rad=best[:, 4],
        match=match,
        tangency=tangency_of(outlines, best),
        odds=log_odds(match, outlines.tolerance),
    )


def tangency_of(outlines: Outlines, ellipses: NDArray[np.float64]) -> NDArray[np.float64]:
    """How well the edge segments of outlines run along ellipses (our own).

    For an arc what ``|x - y| / L * (1 - sin phi)`` is for a fitted edge: the mean over the segments, weighted
    by length, of ``1 - sin`` of the angle to the tangent; what the chord of an arc can't avoid is not
    counted.

    Parameters
    ----------
    outlines : Outlines
        What is seen.
    ellipses : ndarray of float64, shape (B, 5)
        Centre x and y, long and short axis, angle; px and radians.

    Returns
    -------
    ndarray of float64, shape (B,)
        In [0, 1].
    """
    from evifuse.vision import _kernels_ellipse

    share = np.empty(len(ellipses))
    _kernels_ellipse.tangency(outlines.starts, outlines.ends, outlines.owner, ellipses, share)
    return share


def _direct(points: NDArray[np.float64], distance: NDArray[np.float64], left_out: int) -> NDArray[np.float64]:
    """Centre x and y, long and short axis and angle of the ellipse of each outline; NaN for none.

    It is fitted without so many points, the most distant ones.
    """
    from evifuse.vision import _kernels_ellipse

    found = np.empty((len(points), 5))
    _kernels_ellipse.direct_ellipses(points, distance, left_out, found)
    found[~(found[:, 3] > LEAST_AXIS_PX)] = np.nan
    return found


def _nearest(
    points: NDArray[np.float64], ellipses: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Distance of points from ellipses to first order in the gauge function, exact for circles, and where.

    Where is the share of the ellipse's length before the ray from its centre through the point, measured on
    the polygon that stands for the ellipse.
    """
    from evifuse.vision import _kernels_ellipse

    distance, position = np.empty(points.shape[:2]), np.empty(points.shape[:2])
    _kernels_ellipse.ellipse_distances(points, ellipses, CORNERS, distance, position)
    return distance, length_before(_polygons(ellipses), position)


def _polygons(ellipses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points on ellipses, in order, shape (B, 48, 2)."""
    from evifuse.vision import _kernels_ellipse

    polygons = np.empty((len(ellipses), CORNERS, 2))
    _kernels_ellipse.corners_of(ellipses, polygons)
    return polygons
