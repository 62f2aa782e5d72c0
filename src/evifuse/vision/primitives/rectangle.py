"""The rectangle primitive (section 3.2.1)."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evifuse.vision.primitives.fits import Fits
from evifuse.vision.primitives.hypothesis import Proposals
from evifuse.vision.primitives.polygon import mean_of_sides, pattern_proposals

__all__ = ["corner_sines", "propose", "rectangle_belief", "rectangle_form"]


def rectangle_belief(beliefs: ArrayLike, lengths: ArrayLike, angles: ArrayLike) -> NDArray[np.float64]:
    """Belief in a rectangle with fitted edges AB, BC, CD, DA (section 3.2.1).

    The product of the mean belief of the sides that are present, the two length ratios of opposite
    sides, and the sines of the four interior angles. A missing side is closed virtually: its ratio
    counts as 1, and an angle it touches equals the opposite one (the project's reading of the printed
    example).

    Parameters
    ----------
    beliefs : array_like of float, shape (..., 4)
        Beliefs of AB, BC, CD, DA, in [0, 1]; NaN for a missing side.
    lengths : array_like of float, shape (..., 4)
        Their lengths, in any one unit; NaN for a missing side.
    angles : array_like of float, shape (..., 4)
        Interior angles ABC, BCD, CDA, DAB, radians; NaN where a side is missing.

    Returns
    -------
    ndarray of float64, shape (...)
        In [0, 1]; 0 with fewer than three sides.

    Examples
    --------
    The printed example, 0.19:

    >>> nan = float("nan")
    >>> angles = np.deg2rad([80, 100, nan, nan])
    >>> round(float(rectangle_belief([0.31, 0.15, 0.15, nan], [1, 1, 1, nan], angles)), 2)
    0.19
    """
    return mean_of_sides(np.asarray(beliefs, np.float64), least=3) * rectangle_form(lengths, angles)


def rectangle_form(lengths: ArrayLike, angles: ArrayLike) -> NDArray[np.float64]:
    """How nearly a four-sided pattern has the form of a rectangle: the ratios and sines of its belief.

    Parameters
    ----------
    lengths : array_like of float, shape (..., 4)
        Of AB, BC, CD, DA, in any one unit; NaN for a missing side.
    angles : array_like of float, shape (..., 4)
        Interior angles ABC, BCD, CDA, DAB, radians; NaN where a side is missing.

    Returns
    -------
    ndarray of float64, shape (...)
        In [0, 1]; it falls the more obliquely a rectangle is seen.
    """
    s = np.asarray(lengths, np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = np.minimum(s[..., :2], s[..., 2:]) / np.maximum(s[..., :2], s[..., 2:])
    return np.where(np.isnan(ratios), 1.0, ratios).prod(axis=-1) * corner_sines(angles)


def corner_sines(angles: ArrayLike) -> NDArray[np.float64]:
    """Product of the sines of the interior angles of a four-sided pattern.

    Parameters
    ----------
    angles : array_like of float, shape (..., 4)
        Radians; a NaN equals the opposite angle, or a right angle if that is missing too.

    Returns
    -------
    ndarray of float64, shape (...)
        In [0, 1].
    """
    a = np.asarray(angles, np.float64)
    a = np.where(np.isnan(a), np.roll(a, 2, axis=-1), a)
    return np.abs(np.sin(np.where(np.isnan(a), np.pi / 2, a))).prod(axis=-1)


def propose(fits: Fits) -> Proposals:
    """Rectangle hypotheses.

    Parameters
    ----------
    fits : Fits
        What is seen, and what was fitted to it.

    Returns
    -------
    Proposals
        Where a quadrilateral can be formed.
    """
    four = fits.quadrilateral
    pattern = rectangle_belief(four.sides.beliefs, four.lengths, four.angles)
    found = pattern_proposals("rectangle", four, pattern)
    return replace(found, terms={**found.terms, "form": rectangle_form(four.lengths, four.angles)})
