"""The square primitive (section 3.2.2)."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evifuse.vision.primitives.fits import Fits
from evifuse.vision.primitives.hypothesis import Proposals
from evifuse.vision.primitives.polygon import mean_of_sides, pattern_proposals
from evifuse.vision.primitives.rectangle import corner_sines

__all__ = ["propose", "square_belief"]


def square_belief(beliefs: ArrayLike, lengths: ArrayLike, angles: ArrayLike) -> NDArray[np.float64]:
    """Belief in a square with fitted edges AB, BC, CD, DA (section 3.2.2).

    The product of the mean belief of the sides that are present, the mean of the four length ratios of
    neighbours (a ratio that touches a missing side counts 0), and the sines of the four interior angles.

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
    The printed example, 0.10:

    >>> nan = float("nan")
    >>> angles = np.deg2rad([80, 100, nan, nan])
    >>> round(float(square_belief([0.31, 0.15, 0.15, nan], [1, 1, 1, nan], angles)), 2)
    0.1
    """
    b, s = np.asarray(beliefs, np.float64), np.asarray(lengths, np.float64)
    following = np.roll(s, -1, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = np.nan_to_num(np.minimum(s, following) / np.maximum(s, following), nan=0.0)
    return mean_of_sides(b, least=3) * ratios.mean(axis=-1) * corner_sines(angles)


def propose(fits: Fits) -> Proposals:
    """Square hypotheses.

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
    pattern = square_belief(four.sides.beliefs, four.lengths, four.angles)
    return pattern_proposals("square", four, pattern)
