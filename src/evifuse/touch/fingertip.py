"""The fingertip's geometry: where its taxels sit, how far apart they are, and where the array ends."""

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import UsageError
from evifuse.recordings.recording import Fingertip

__all__ = ["spherical_fingertip", "taxel_coverage", "taxel_pitch_m"]


def spherical_fingertip(radius_m: float = 0.010, pitch_m: float = 0.0007, cap_rad: float = 0.61) -> Fingertip:
    """Lay taxels out in rings on a spherical cap.

    Parameters
    ----------
    radius_m : float
        Radius of the sphere, metres.
    pitch_m : float
        Distance between neighbours along a ring and between rings, metres.
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
    >>> tip.positions_m.shape, tip.positions_m[0].tolist()
    ((37, 3), [0.0, 0.0, -0.01])
    """
    if not (radius_m > 0 and pitch_m > 0 and 0 < cap_rad <= np.pi):
        raise UsageError(
            f"a fingertip of radius {radius_m} m, pitch {pitch_m} m, cap {cap_rad} rad can't be laid out: "
            "lengths are positive and the cap lies in (0, pi]"
        )
    rings = [np.array([[0.0, 0.0, -1.0]])]
    for index in range(1, int(cap_rad * radius_m / pitch_m + 1e-9) + 1):
        polar = index * pitch_m / radius_m
        count = max(1, round(2 * np.pi * np.sin(polar) * radius_m / pitch_m))
        azimuth = 2 * np.pi * (np.arange(count) + 0.5 * (index % 2)) / count
        ring = [
            np.sin(polar) * np.cos(azimuth),
            np.sin(polar) * np.sin(azimuth),
            -np.full(count, np.cos(polar)),
        ]
        rings.append(np.stack(ring, axis=1))
    normals = np.concatenate(rings)
    return Fingertip(radius_m, radius_m * normals, normals)


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
    positions = fingertip.positions_m
    if len(positions) < 2:
        return fingertip.radius_m
    squared = np.square(positions).sum(axis=1)
    distance = squared[:, None] + squared[None, :] - 2 * positions @ positions.T
    np.fill_diagonal(distance, np.inf)
    return float(np.sqrt(max(float(np.median(distance.min(axis=1))), 0.0))) or fingertip.radius_m


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
    within = (fingertip.normals @ fingertip.normals.T >= np.cos(reach_rad)).sum(axis=1)
    return np.minimum(within / float(np.percentile(within, 75)), 1.0)
