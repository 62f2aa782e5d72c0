"""The triangle primitive (section 3.2.3)."""

import numpy as np
from numpy.typing import ArrayLike

from evifuse.vision.fit import fit_sides
from evifuse.vision.primitives.base import LEAST_TRUST, Hypothesis, Outline, agreement
from evifuse.vision.primitives.polygon import corner_angles, polygon_for

__all__ = ["propose", "triangle_belief"]


def triangle_belief(beliefs: ArrayLike, angles: ArrayLike) -> float:
    """Belief in a triangle with fitted edges AB, BC, CA (section 3.2.3).

    The mean belief of the sides that are present, times ``1 - |sin(sum of the interior angles)|``. The
    angles of a triangle sum to pi; the print says 2 pi, which gives the same sine.

    Parameters
    ----------
    beliefs : array_like of float, shape (3,)
        Beliefs of the sides, in [0, 1]; NaN for a missing side.
    angles : array_like of float, shape (K,)
        Interior angles that are known, radians; NaN for one that is not.

    Returns
    -------
    float
        In [0, 1]; 0 with fewer than two sides.

    Examples
    --------
    The printed example, 0.20:

    >>> round(triangle_belief([0.31, 0.15, 0.15], np.deg2rad([80, 100])), 2)
    0.2
    """
    b = np.asarray(beliefs, np.float64)
    present = ~np.isnan(b)
    if present.sum() < 2:
        return 0.0
    return float(b[present].mean() * (1 - abs(np.sin(np.nansum(np.asarray(angles, np.float64))))))


def propose(outline: Outline) -> Hypothesis | None:
    """Triangle hypothesis for an outline.

    The belief of the chapter is multiplied by how well outline and triangle agree (fit, explained share and
    coverage; our own).

    Parameters
    ----------
    outline : Outline
        What is seen.

    Returns
    -------
    Hypothesis or None
        None if no triangle can be formed.
    """
    corners = polygon_for(outline, 3)
    if corners is None:
        return None
    match = agreement(outline, corners)
    if match.trust < LEAST_TRUST:
        return None
    sides = fit_sides(outline.links, corners)
    beliefs = [np.nan if e is None else e.belief for e in sides]
    pattern = triangle_belief(beliefs, corner_angles(corners))
    terms = {"pattern": pattern, "fit": match.fit, "explained": match.explained, "coverage": match.coverage}
    return Hypothesis(
        kind="triangle",
        belief=float(np.prod(list(terms.values()))),
        geometry={"corners": corners.tolist()},
        shape=corners,
        deviation=match.deviation,
        edges=tuple(e for e in sides if e is not None),
        terms=terms,
    )
