"""The triangle primitive (section 3.2.3)."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evifuse.vision.primitives.fits import Fits
from evifuse.vision.primitives.hypothesis import Proposals
from evifuse.vision.primitives.polygon import mean_of_sides, pattern_proposals

__all__ = ["propose", "triangle_belief"]


def triangle_belief(beliefs: ArrayLike, angles: ArrayLike) -> NDArray[np.float64]:
    """Belief in a triangle with fitted edges AB, BC, CA (section 3.2.3).

    The mean belief of the sides that are present, times ``1 - |sin(sum of the interior angles)|``. The
    angles of a triangle sum to pi; the print says 2 pi, which gives the same sine.

    Parameters
    ----------
    beliefs : array_like of float, shape (..., 3)
        Beliefs of the sides, in [0, 1]; NaN for a missing side.
    angles : array_like of float, shape (..., K)
        Interior angles that are known, radians; NaN for one that is not.

    Returns
    -------
    ndarray of float64, shape (...)
        In [0, 1]; 0 with fewer than two sides.

    Examples
    --------
    The printed example, 0.20:

    >>> round(float(triangle_belief([0.31, 0.15, 0.15], np.deg2rad([80, 100]))), 2)
    0.2
    """
    total = np.nansum(np.asarray(angles, np.float64), axis=-1)
    return mean_of_sides(np.asarray(beliefs, np.float64), least=2) * (1 - np.abs(np.sin(total)))


def propose(fits: Fits) -> Proposals:
    """Triangle hypotheses.

    Parameters
    ----------
    fits : Fits
        What is seen, and what was fitted to it.

    Returns
    -------
    Proposals
        Where a triangle can be formed.
    """
    three = fits.triangle
    return pattern_proposals("triangle", three, triangle_belief(three.sides.beliefs, three.angles))
