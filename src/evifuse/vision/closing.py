"""Polygons from straight sections: closed where the sections meet, or virtually where a side is hidden."""

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.sections import Sections

__all__ = ["closed_across_the_gap", "closed_by_itself"]


def closed_by_itself(sections: Sections, around: NDArray[np.float64]) -> NDArray[np.float64]:
    """Polygons whose every side is seen: neighbouring sections are prolonged until they meet.

    Parameters
    ----------
    sections : Sections
        K sections of each outline.
    around : ndarray of float64, shape (B,)
        Length of the hull of each, px.

    Returns
    -------
    ndarray of float64, shape (B, K, 2)
        Corners in order, px; NaN where the sections make no convex polygon.
    """
    from evifuse.vision import _kernels_closing

    polygons = np.empty(sections.centres.shape)
    _kernels_closing.where_they_meet(sections.centres, sections.directions, around, polygons)
    return polygons


def closed_across_the_gap(sections: Sections, around: NDArray[np.float64]) -> NDArray[np.float64]:
    """Polygons of all sides but one, which is hidden in the largest gap.

    Two sections make a triangle: the hidden side joins their ends. Three make a quadrilateral: what is seen
    of the two sides that lead to the gap may be cut at different places, so both are taken to be as long as
    the longer one, as in a rectangle.

    Parameters
    ----------
    sections : Sections
        K sections of each outline, K being 2 or 3.
    around : ndarray of float64, shape (B,)
        Length of the hull of each, px.

    Returns
    -------
    ndarray of float64, shape (B, K + 1, 2)
        Corners in order, px; NaN for none.
    """
    from evifuse.vision import _kernels_closing

    count, seen = sections.centres.shape[:2]
    polygons = np.empty((count, seen + 1, 2))
    parts = sections.starts, sections.centres, sections.directions, sections.ends
    _kernels_closing.across_the_gap(*parts, around, polygons)
    return polygons
