"""Polygons from straight sections: closed where the sections meet, or virtually where a side is hidden."""

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.geometry import cross, following, intersection
from evifuse.vision.sections import Sections

__all__ = ["closed_by_itself", "closed_quadrilateral", "closed_triangle"]

LEAST_GAP = 0.04
"""A side can be hidden only in a gap of more than this share of the hull's length (our own)."""

MOST_EXTENT = 4.0
"""A corner further from the first one than so many lengths of the hull is none (our own)."""


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
    c, d = sections.centres, sections.directions
    return _sound(intersection(np.roll(c, 1, axis=1), np.roll(d, 1, axis=1), c, d), around)


def closed_triangle(sections: Sections, around: NDArray[np.float64]) -> NDArray[np.float64]:
    """Triangles of two sections; the third side, which is hidden, joins their ends across the larger gap.

    Parameters
    ----------
    sections : Sections
        Two sections of each outline.
    around : ndarray of float64, shape (B,)
        Length of the hull of each, px.

    Returns
    -------
    ndarray of float64, shape (B, 3, 2)
        Corners in order, px; NaN for none.
    """
    (s, c, d, e), gap = _with_largest_gap_last(sections)
    corner = intersection(c[:, 0], d[:, 0], c[:, 1], d[:, 1])
    polygon = np.stack([s[:, 0], corner, e[:, 1]], axis=1)
    return _sound(np.where((gap > LEAST_GAP * around)[:, None, None], polygon, np.nan), around)


def closed_quadrilateral(sections: Sections, around: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quadrilaterals of three sections; the fourth side is hidden in the largest gap.

    What is seen of the two sides that lead to the gap may be cut at different places: both are taken to be
    as long as the longer one, as in a rectangle.

    Parameters
    ----------
    sections : Sections
        Three sections of each outline.
    around : ndarray of float64, shape (B,)
        Length of the hull of each, px.

    Returns
    -------
    ndarray of float64, shape (B, 4, 2)
        Corners in order, px; NaN for none.
    """
    (s, c, d, e), gap = _with_largest_gap_last(sections)
    first = intersection(c[:, 0], d[:, 0], c[:, 1], d[:, 1])
    second = intersection(c[:, 1], d[:, 1], c[:, 2], d[:, 2])
    reach = np.hypot(*np.moveaxis(np.stack([first - s[:, 0], e[:, 2] - second]), -1, 0)).max(axis=0)
    polygon = np.stack(
        [first - d[:, 0] * reach[:, None], first, second, second + d[:, 2] * reach[:, None]], 1
    )
    return _sound(np.where((gap > LEAST_GAP * around)[:, None, None], polygon, np.nan), around)


def _with_largest_gap_last(
    sections: Sections,
) -> tuple[tuple[NDArray[np.float64], ...], NDArray[np.float64]]:
    """Starts, centres, directions and ends, the largest gap after the last; its width, px."""
    parts = sections.starts, sections.centres, sections.directions, sections.ends
    gap = np.hypot(*np.moveaxis(following(sections.starts) - sections.ends, -1, 0))
    count = gap.shape[1]
    place = ((np.arange(count) + gap.argmax(axis=1)[:, None] + 1) % count)[..., None]
    return tuple(np.take_along_axis(p, place, axis=1) for p in parts), gap.max(axis=1)


def _sound(polygon: NDArray[np.float64], around: NDArray[np.float64]) -> NDArray[np.float64]:
    """Polygons, NaN where they turn both ways or reach far beyond what is seen."""
    side = following(polygon) - polygon
    turn = cross(np.roll(side, 1, axis=1), side)
    convex = (turn > 0).all(axis=1) | (turn < 0).all(axis=1)
    extent = np.abs(polygon - polygon[:, :1]).max(axis=(1, 2))
    keep = convex & (extent <= MOST_EXTENT * around)
    return np.where(keep[:, None, None], polygon, np.nan)
