"""The rectangle primitive (section 3.2.1)."""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evifuse.vision.fit import FittedEdge, fit_sides
from evifuse.vision.geometry import perimeter
from evifuse.vision.primitives.base import LEAST_TRUST, Agreement, Hypothesis, Outline, agreement
from evifuse.vision.primitives.polygon import corner_angles, polygon_for

__all__ = ["corner_sines", "propose", "rectangle_belief"]


def rectangle_belief(beliefs: ArrayLike, lengths: ArrayLike, angles: ArrayLike) -> float:
    """Belief in a rectangle with fitted edges AB, BC, CD, DA (section 3.2.1).

    The product of the mean belief of the sides that are present, the two length ratios of opposite
    sides, and the sines of the four interior angles. A missing side is closed virtually: its ratio
    counts as 1, and an angle it touches equals the opposite one (the project's reading of the printed
    example).

    Parameters
    ----------
    beliefs : array_like of float, shape (4,)
        Beliefs of AB, BC, CD, DA, in [0, 1]; NaN for a missing side.
    lengths : array_like of float, shape (4,)
        Their lengths, in any one unit; NaN for a missing side.
    angles : array_like of float, shape (4,)
        Interior angles ABC, BCD, CDA, DAB, radians; NaN where a side is missing.

    Returns
    -------
    float
        In [0, 1]; 0 with fewer than three sides.

    Examples
    --------
    The printed example, 0.19:

    >>> nan = float("nan")
    >>> angles = np.deg2rad([80, 100, nan, nan])
    >>> round(rectangle_belief([0.31, 0.15, 0.15, nan], [1, 1, 1, nan], angles), 2)
    0.19
    """
    b, s = np.asarray(beliefs, np.float64), np.asarray(lengths, np.float64)
    present = ~np.isnan(b)
    if present.sum() < 3:
        return 0.0
    opposite = np.array([_ratio(s[0], s[2]), _ratio(s[1], s[3])])
    opposite[np.isnan(opposite)] = 1.0
    return float(b[present].mean() * opposite.prod() * corner_sines(angles))


def corner_sines(angles: ArrayLike) -> float:
    """Product of the sines of the interior angles of a four-sided pattern.

    Parameters
    ----------
    angles : array_like of float, shape (4,)
        Radians; a NaN equals the opposite angle, or a right angle if that is missing too.

    Returns
    -------
    float
        In [0, 1].
    """
    a = np.asarray(angles, np.float64)
    a = np.where(np.isnan(a), np.roll(a, 2), a)
    return float(np.abs(np.sin(np.where(np.isnan(a), np.pi / 2, a))).prod())


def _ratio(a: float, b: float) -> float:
    longest = max(a, b)
    return min(a, b) / longest if longest > 0 else float("nan")


@lru_cache(maxsize=4)
def four_sides(
    outline: Outline,
) -> tuple[NDArray[np.float64], tuple[FittedEdge | None, ...], Agreement] | None:
    """Hypothesised quadrilateral of an outline, with its fitted sides.

    Parameters
    ----------
    outline : Outline
        What is seen.

    Returns
    -------
    corners : ndarray of float64, shape (4, 2)
        Corners in order, px.
    sides : tuple of FittedEdge or None
        One per side; None where it is missing.
    match : Agreement
        How well outline and quadrilateral agree.
    """
    corners = polygon_for(outline, 4)
    if corners is None or perimeter(corners) < 1:
        return None
    match = agreement(outline, corners)
    return None if match.trust < LEAST_TRUST else (corners, fit_sides(outline.links, corners), match)


def propose(outline: Outline) -> Hypothesis | None:
    """Rectangle hypothesis for an outline.

    The belief of the chapter is multiplied by how well outline and quadrilateral agree (fit and
    explained share; our own): the chapter starts from edges that are known to belong to the pattern.

    Parameters
    ----------
    outline : Outline
        What is seen.

    Returns
    -------
    Hypothesis or None
        None if no quadrilateral can be formed.
    """
    found = four_sides(outline)
    if found is None:
        return None
    corners, sides, match = found
    beliefs = [np.nan if e is None else e.belief for e in sides]
    spans = np.hypot(*(np.roll(corners, -1, axis=0) - corners).T)
    lengths = np.where(np.isnan(beliefs), np.nan, spans)
    angles = np.roll(corner_angles(corners), -1)
    pattern = rectangle_belief(beliefs, lengths, angles)
    terms = {"pattern": pattern, "fit": match.fit, "explained": match.explained, "coverage": match.coverage}
    return Hypothesis(
        kind="rectangle",
        belief=float(np.prod(list(terms.values()))),
        geometry={"corners": corners.tolist()},
        shape=corners,
        deviation=match.deviation,
        edges=tuple(e for e in sides if e is not None),
        terms=terms,
    )
