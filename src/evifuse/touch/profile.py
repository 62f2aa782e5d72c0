"""How pressure falls off around the contact: the width of the patch, and how deep the finger is pressed in.

All of it is our own. The pressures of many samples, laid over each other by their distance from the contact,
give one profile. It is described by ``A (1 - r^2 / R^2)^p``: p = 1 is a bed of springs, large p
is a Gaussian.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import Fingertip

__all__ = ["Profile", "press_depth_m", "pressure_profile"]

POWERS = (1, 2, 3, 4, 6, 9)
BINS, SAMPLES = 24, 300
REACHES = np.geomspace(0.15, 1.0, 40)
"""Ends of the profile that are tried, over the largest distance that is looked at."""
USUAL_DEPTH_M = 1.5e-4
"""Press depth where the profile doesn't tell it, give or take half: our finger of 10 mm on a
plane with 2 N. The same force presses deeper, by a square root, where the relative curvature is larger."""


@dataclass(frozen=True)
class Profile:
    """Pressure ``height (1 - r^2 / reach^2)^power`` at distance r from the contact, zero beyond the reach.

    Parameters
    ----------
    power : int
        Exponent.
    reach_m : float
        Where it ends, metres.
    height_pa : float
        Pressure in the middle, pascals.
    """

    power: int
    reach_m: float
    height_pa: float


def pressure_profile(
    fingertip: Fingertip,
    pressure_pa: NDArray[np.float64],
    contact_m: NDArray[np.float64],
    furthest_m: float,
) -> Profile:
    """Profile of the pressure around the contact, by least squares over binned distances.

    Parameters
    ----------
    fingertip : Fingertip
        N taxels.
    pressure_pa : ndarray of float64, shape (M, N)
        Pressures of samples with contact, pascals.
    contact_m : ndarray of float64, shape (M, 3)
        Their contacts in the fingertip frame, metres.
    furthest_m : float
        Largest distance that is looked at, metres.

    Returns
    -------
    Profile
        Of at most 300 of the samples.
    """
    from evifuse.touch._kernels_contact import rings
    from evifuse.touch._kernels_sites import best_profile

    some = slice(None, None, max(1, len(contact_m) // SAMPLES))
    size, total, squares = rings(fingertip.positions_m, contact_m[some], pressure_pa[some], BINS, furthest_m)
    best, reach, height = best_profile(size, total, squares, furthest_m * REACHES, np.array(POWERS))
    return Profile(POWERS[best], reach, height)


def press_depth_m(
    profile: Profile, radius_m: float, mean_curvature_per_m: float, pitch_m: float
) -> tuple[float, float]:
    """How deep the finger is pressed in, from the width of the patch.

    Without spread between taxels a patch of radius b is pressed in by ``b^2 (1/a - H) / 2``. Spread adds to
    the second moment of the profile and to its fourth; ``b^4 = 18 (2 M2^2 - M4)`` holds for any Gaussian
    spread. A profile that is far wider than a usual patch is mostly spread, and says nothing. One that is
    narrower than the taxels are apart says little: the error grows with the pitch, found on simulated
    fingers, and what is usual takes part with its own error.

    Parameters
    ----------
    profile : Profile
        Of the site.
    radius_m : float
        Radius a of the fingertip, metres.
    mean_curvature_per_m : float
        Mean curvature H of the surface, 1/m, concave up positive.
    pitch_m : float
        Distance between taxels, metres.

    Returns
    -------
    depth_m, error_m : float
        Depth and its standard error, metres.
    """
    relative = max(1 / radius_m - mean_curvature_per_m, 0.1 / radius_m)
    second = profile.reach_m**2 / (profile.power + 2)
    usual = USUAL_DEPTH_M * float(np.sqrt(0.01 * relative))
    if second > 2 * usual / relative + 0.25 * pitch_m**2:
        return usual, 0.5 * usual
    depth = 3 * second / np.sqrt(profile.power + 3) * relative
    error = depth * float(np.hypot(0.13, 0.05 * (pitch_m**2 / second) ** 2))
    share = usual**2 / (usual**2 + 4 * error**2)
    return float(share * depth + (1 - share) * usual), float(np.sqrt(share) * error)
