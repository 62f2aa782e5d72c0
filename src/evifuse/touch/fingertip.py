"""The fingertip's geometry: where its taxels sit, how far apart they are, and where the array ends."""

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import UsageError
from evifuse.recordings.recording import Fingertip
from evifuse.touch.quantiles import quantile_of
from evifuse.touch.remembered import per_fingertip

__all__ = ["spherical_fingertip", "surrounded", "taxel_areas", "taxel_coverage", "taxel_pitch_m"]

SURROUNDED = 0.7
"""A taxel with fewer neighbours than this share of what is usual is on the rim of the array."""


def spherical_fingertip(radius_m: float = 0.010, pitch_m: float = 0.0007, cap_rad: float = 0.61) -> Fingertip:
    """Lay taxels out on a spherical cap, evenly, in a sunflower's spiral.

    Every taxel has the same area: one more taxel is one golden angle further round, and a step down the axis.

    Parameters
    ----------
    radius_m : float
        Radius of the sphere, metres.
    pitch_m : float
        Square root of the area of a taxel, metres.
    cap_rad : float
        Angle between the fingertip's axis and the edge of the array, radians, in (0, pi].

    Returns
    -------
    Fingertip
        The axis is -z of the fingertip frame: a fingertip with unit orientation points down.

    Raises
    ------
    UsageError
        If a length is not positive or the cap is not in (0, pi].

    Examples
    --------
    >>> tip = spherical_fingertip(radius_m=0.010, pitch_m=0.001, cap_rad=0.3)
    >>> tip.positions_m.shape
    (28, 3)
    """
    if not (radius_m > 0 and pitch_m > 0 and 0 < cap_rad <= np.pi):
        raise UsageError(
            f"a fingertip of radius {radius_m} m, pitch {pitch_m} m, cap {cap_rad} rad can't be laid out: "
            "lengths are positive and the cap lies in (0, pi]"
        )
    height = 1 - np.cos(cap_rad)
    count = max(1, round(2 * np.pi * height * (radius_m / pitch_m) ** 2))
    index = np.arange(count) + 0.5
    axial = 1 - height * index / count
    azimuth, across = np.pi * (3 - np.sqrt(5)) * index, np.sqrt(1 - axial**2)
    normals = np.stack([across * np.cos(azimuth), across * np.sin(azimuth), -axial], axis=1)
    return Fingertip(radius_m, radius_m * normals, normals)


@per_fingertip
def taxel_pitch_m(fingertip: Fingertip) -> float:
    """Typical distance between neighbouring taxels.

    Parameters
    ----------
    fingertip : Fingertip
        Geometry of the fingertip, N taxels.

    Returns
    -------
    float
        Median distance to the nearest other taxel, metres; the radius when there is one taxel only.
    """
    distance = _distances_m(fingertip)
    np.fill_diagonal(distance, np.inf)
    nearest = distance.min(axis=1)
    return float(np.median(nearest)) if len(nearest) > 1 else fingertip.radius_m


@per_fingertip
def taxel_areas(fingertip: Fingertip) -> NDArray[np.float64]:
    """Relative area of each taxel, so that uneven layouts don't pull a mean towards their denser side.

    The inverse of the density of taxels, smoothed by a Gaussian of 0.7 pitches (our own).

    Parameters
    ----------
    fingertip : Fingertip
        Geometry of the fingertip, N taxels.

    Returns
    -------
    ndarray of float64, shape (N,)
        Areas in units of the median one, kept within [0.5, 1.5].
    """
    closeness = np.exp(-0.5 * np.square(_distances_m(fingertip) / (0.7 * taxel_pitch_m(fingertip))))
    area = 1 / closeness.sum(axis=1)
    return np.clip(area / np.median(area), 0.5, 1.5)


def _distances_m(fingertip: Fingertip) -> NDArray[np.float64]:
    """Distance (N, N) of every taxel to every other, metres."""
    positions = fingertip.positions_m
    squared = np.square(positions).sum(axis=1)
    return np.sqrt(np.maximum(squared[:, None] + squared[None, :] - 2 * positions @ positions.T, 0.0))


def taxel_coverage(fingertip: Fingertip, reach_rad: float) -> NDArray[np.float64]:
    """How completely the array surrounds each taxel: 1 in its middle, about a half on its edge.

    A patch of pressure that hangs over the edge of the array has a biased centre, so a contact there is not
    used to measure curvature (our own).

    Parameters
    ----------
    fingertip : Fingertip
        Geometry of the fingertip, N taxels.
    reach_rad : float
        Angular radius of the neighbourhood that is looked at, radians.

    Returns
    -------
    ndarray of float64, shape (N,)
        Number of taxels within reach, as a share of what a taxel in the middle of the array has, in [0, 1].
    """
    within = np.count_nonzero(_cosines(fingertip) >= np.cos(reach_rad), axis=1)
    return np.minimum(within / quantile_of(within, 0.75), 1.0)


@per_fingertip
def surrounded(fingertip: Fingertip) -> NDArray[np.bool_]:
    """Which taxels aren't on the rim of an array of any form (our own).

    Parameters
    ----------
    fingertip : Fingertip
        Geometry of the fingertip, N taxels.

    Returns
    -------
    ndarray of bool, shape (N,)
        Those with at least 70 % of the usual number of others within two pitches.
    """
    near = (_distances_m(fingertip) < 2 * taxel_pitch_m(fingertip)).sum(axis=1)
    return near >= SURROUNDED * np.percentile(near, 75)


@per_fingertip
def _cosines(fingertip: Fingertip) -> NDArray[np.float64]:
    """Cosine (N, N) of the angle between the normals of any two taxels."""
    return fingertip.normals @ fingertip.normals.T
