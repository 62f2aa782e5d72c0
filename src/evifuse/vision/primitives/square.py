"""The square primitive (section 3.2.2)."""

import numpy as np
from numpy.typing import ArrayLike

from evifuse.vision.primitives.base import Hypothesis, Outline
from evifuse.vision.primitives.polygon import corner_angles
from evifuse.vision.primitives.rectangle import corner_sines, four_sides

__all__ = ["propose", "square_belief"]


def square_belief(beliefs: ArrayLike, lengths: ArrayLike, angles: ArrayLike) -> float:
    """Belief in a square with fitted edges AB, BC, CD, DA (section 3.2.2).

    The product of the mean belief of the sides that are present, the mean of the four length ratios of
    neighbours (a ratio that touches a missing side counts 0), and the sines of the four interior angles.

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
    The printed example, 0.10:

    >>> nan = float("nan")
    >>> angles = np.deg2rad([80, 100, nan, nan])
    >>> round(square_belief([0.31, 0.15, 0.15, nan], [1, 1, 1, nan], angles), 2)
    0.1
    """
    b, s = np.asarray(beliefs, np.float64), np.asarray(lengths, np.float64)
    present = ~np.isnan(b)
    if present.sum() < 3:
        return 0.0
    following = np.roll(s, -1)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = np.nan_to_num(np.minimum(s, following) / np.maximum(s, following), nan=0.0)
    return float(b[present].mean() * ratios.sum() / 4 * corner_sines(angles))


def propose(outline: Outline) -> Hypothesis | None:
    """Square hypothesis for an outline.

    As for the rectangle, the belief of the chapter is multiplied by how well outline and pattern agree
    (our own).

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
    pattern = square_belief(beliefs, lengths, np.roll(corner_angles(corners), -1))
    terms = {"pattern": pattern, "fit": match.fit, "explained": match.explained, "coverage": match.coverage}
    return Hypothesis(
        kind="square",
        belief=float(np.prod(list(terms.values()))),
        geometry={"corners": corners.tolist()},
        shape=corners,
        deviation=match.deviation,
        edges=tuple(e for e in sides if e is not None),
        terms=terms,
    )
