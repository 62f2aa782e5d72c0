"""Which primitive a shape operator makes, given its covariance: the probabilities behind the masses.

All our own. The operator's k_xx, k_xy and k_yy are normal with the covariance of the fit. In the coordinates
``h = (k_xx + k_yy) / 2``, ``d = (k_xx - k_yy) / 2`` and ``e = k_xy`` the principal curvatures are ``h +- r``
with ``r = sqrt(d^2 + e^2)``, so every row of table 3 is an interval of h once d and e are given. The integral
over h is then a difference of error functions, and the one over d and e a sum over nodes. Errors of k1 and k2
that go together are so counted once.
"""

from functools import cache
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from evifuse.touch.curvature import ShapeOperator

__all__ = ["operator_covariance", "primitive_probabilities", "resolved_threshold_per_m"]

TIMES_THE_ERROR = 2.0
"""A curvature is called flat up to so many of its standard errors at least."""
WIDEST = 3.0
"""But never more than so many thresholds of a fingertip without error."""
SMALLEST_ERROR = 1e-6
"""Standard errors below this are taken as this, 1/m: keeps the integral regular."""
TO_MEAN_AND_DIFFERENCE = np.array([[0.5, 0.0, 0.5], [0.5, 0.0, -0.5], [0.0, 1.0, 0.0]])
"""From k_xx, k_xy, k_yy to h, d, e."""


def resolved_threshold_per_m(gamma_per_m: float, shape: ShapeOperator) -> float:
    """Threshold between flat and curved at a site: gamma, or twice an error that leaves both open.

    A plane then stays a plane when it is felt badly: curvatures that the error alone explains are not called
    curved. What counts is the error of a curvature that is less than two or three of them, and the smaller of
    both in any case, which says how well the site was felt: the larger one may be that of a sharp curvature,
    which is known to a share of its size only. The threshold is three times gamma at most: what is less sure
    than that is not flat, but unknown. What a wide threshold costs is said by `evifuse.touch.reliance`.

    Parameters
    ----------
    gamma_per_m : float
        Smallest threshold, of a fingertip that measures without error, 1/m.
    shape : ShapeOperator
        The operator with its errors.

    Returns
    -------
    float
        Threshold, 1/m.
    """
    error = min(shape.k1_error_per_m, shape.k2_error_per_m)
    pairs = ((shape.k1_per_m, shape.k1_error_per_m), (shape.k2_per_m, shape.k2_error_per_m))
    for k, own in pairs:
        unclear = TIMES_THE_ERROR + 1 - abs(k) / max(own, SMALLEST_ERROR)
        error = max(error, own * min(max(unclear, 0.0), 1.0))
    error *= TIMES_THE_ERROR
    return min(max(gamma_per_m, error), WIDEST * gamma_per_m)


def operator_covariance(shape: ShapeOperator) -> NDArray[np.float64]:
    """Covariance of an operator's k_xx, k_xy, k_yy in its site's tangent axes.

    Parameters
    ----------
    shape : ShapeOperator
        With or without a covariance.

    Returns
    -------
    ndarray of float64, shape (3, 3)
        1/m^2. Without one it is made from the errors of k1 and k2 as if they were independent, with the mean
        of their variances, halved, for the twist between them.
    """
    if shape.covariance is not None:
        return shape.covariance
    first, second = shape.k1_error_per_m**2, shape.k2_error_per_m**2
    turned = _turned(-shape.k1_direction_rad)
    return turned @ np.diag([first, (first + second) / 4, second]) @ turned.T


def primitive_probabilities(shape: ShapeOperator, gamma_per_m: float) -> dict[str, float]:
    """Probability that a shape operator fulfils each row of table 3.

    Parameters
    ----------
    shape : ShapeOperator
        The operator; its error is taken as normal.
    gamma_per_m : float
        Threshold between flat and curved, 1/m.

    Returns
    -------
    dict of str to float
        Of P, C-, C+, H, E- and E+; the sum is 1.

    Examples
    --------
    >>> found = primitive_probabilities(ShapeOperator(0.0, -5.0, 0.1, 0.1, 0.0), 5.0)
    >>> round(found["P"], 2), round(found["C-"], 2)
    (0.5, 0.5)
    """
    from evifuse.touch._kernels_primitives import primitive_shares

    k1, k2, turn = shape.k1_per_m, shape.k2_per_m, 2 * shape.k1_direction_rad
    centre = np.array([(k1 + k2) / 2, (k1 - k2) / 2 * np.cos(turn), (k1 - k2) / 2 * np.sin(turn)])
    spread = TO_MEAN_AND_DIFFERENCE @ operator_covariance(shape) @ TO_MEAN_AND_DIFFERENCE.T
    spread = spread + SMALLEST_ERROR**2 * np.eye(3)
    variance, axes = np.linalg.eigh(spread[1:, 1:])
    slope = axes.T @ spread[1:, 0] / variance
    left = np.sqrt(max(float(spread[0, 0] - slope**2 @ variance), SMALLEST_ERROR**2))
    shares = primitive_shares(_nodes(), np.sqrt(variance), axes, slope, centre, left, gamma_per_m)
    return dict(zip(("P", "C-", "C+", "H", "E-", "E+"), shares, strict=True))


@cache
def _nodes() -> NDArray[np.float64]:
    """Nodes (987, 2) of a bivariate normal, each with the same weight: a Fibonacci lattice of its quantiles.

    Few rows and columns of a grid would see a step in the integrand all at once; a lattice has as many of
    either as it has nodes.
    """
    index = np.arange(987)
    quantile = NormalDist().inv_cdf
    columns = [[quantile(x) for x in ((index * step + 0.5) / 987 % 1.0).tolist()] for step in (1, 610)]
    return np.array(columns).T


def _turned(angle_rad: float) -> NDArray[np.float64]:
    """How k_xx, k_xy, k_yy change (3, 3) when the axes are turned by an angle."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c * c, 2 * c * s, s * s], [-c * s, c * c - s * s, c * s], [s * s, -2 * c * s, c * c]])
