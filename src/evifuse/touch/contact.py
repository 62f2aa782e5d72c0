"""Where the fingertip touches at each instant, from the pressures and the pose."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import Fingertip, TouchRecording
from evifuse.touch.fingertip import taxel_areas, taxel_coverage, taxel_pitch_m
from evifuse.touch.profile import Profile, pressure_profile
from evifuse.touch.quantiles import median_of, quantile_of
from evifuse.touch.remembered import per_fingertip
from evifuse.touch.rim import without_rim

__all__ = ["CONTACT_FLOOR_PA", "ContactTrack", "contact_track", "noise_pa"]

CONTACT_FLOOR_PA = 100.0
"""No pressure below this counts as contact, whatever the noise (our own: 0.1 mN on a square millimetre)."""
NOISY = 0.01
"""Noise above this share of the peak is averaged over neighbouring taxels."""
SUMMED = 1.2
"""Standard deviation of that average, in pitches."""
REACHES = (0.85, 1.0, 1.15)
"""Neighbourhoods of a taxel on a lattice grow by leaps, so a few of them are averaged."""
VALUES = 20_000
"""Readings that the noise is measured on, about."""
SOME = 1000
"""Samples that the highest pressure and the width of the patch are taken from, about."""
WIDE = 2.5
"""A patch with a larger radius of gyration than so many pitches is placed by its profile."""
BROAD = 7.0
"""The profile of a wide patch is looked at up to so many radii of gyration of its upper part."""
NARROW_ERROR, WIDE_ERROR = 2e-4, 1.5e-3
"""Relative error of the contact's angle on the finger that all samples share, by how it was placed."""
PULLED_ERROR = 2.7e-3
"""The same where a wide patch is placed and the rim's pull is not undone."""


@dataclass(frozen=True)
class ContactTrack:
    """The contact of a fingertip, sample by sample.

    Parameters
    ----------
    touching : ndarray of bool, shape (T,)
        Whether there is contact.
    interior : ndarray of bool, shape (T,)
        Whether there is contact and the array surrounds it, so that its centre is not biased.
    direction : ndarray of float64, shape (T, 3)
        Unit vector from the sphere's centre to the contact, fingertip frame; zeros where there is no contact.
    normal : ndarray of float64, shape (T, 3)
        Outward unit normal of the touched surface, world frame; zeros where there is no contact.
    point_m : ndarray of float64, shape (T, 3)
        Contact point, world frame, metres; the sphere's centre where there is no contact.
    peak_pa : ndarray of float64, shape (T,)
        Largest pressure of the sample, pascals.
    threshold_pa : float
        Pressure above which a taxel counts as active, pascals.
    scale_error : float
        Standard deviation of the relative error of the contact's angle that all samples share.
    noise_pa : float
        Standard deviation of the taxels' noise, pascals.
    """

    touching: NDArray[np.bool_]
    interior: NDArray[np.bool_]
    direction: NDArray[np.float64]
    normal: NDArray[np.float64]
    point_m: NDArray[np.float64]
    peak_pa: NDArray[np.float64]
    threshold_pa: float
    scale_error: float = NARROW_ERROR
    noise_pa: float = 0.0


def noise_pa(pressure_pa: NDArray[np.float64]) -> float:
    """Standard deviation of the taxels' noise, from the data alone.

    Most taxels are out of contact most of the time, so the middle of all readings is noise. Its spread is
    taken on both sides of the median, as a sensor may cut off at zero, and scaled to a normal distribution
    (our own choice of estimator).

    Parameters
    ----------
    pressure_pa : ndarray of float64, shape (T, N)
        Pressures, pascals.

    Returns
    -------
    float
        Standard deviation, pascals.
    """
    from evifuse.touch._kernels_health import quantile

    sample = np.array(pressure_pa[:: max(1, pressure_pa.size // VALUES)], dtype=np.float64).ravel()
    below, middle, above = (quantile(sample, len(sample), share) for share in (0.4, 0.5, 0.6))
    return float(max(middle - below, above - middle)) / 0.2533


def contact_track(recording: TouchRecording) -> ContactTrack:
    """Find the contact in every sample of a recording.

    The contact's direction is the mean of the taxel normals, weighted by their areas and by the square of the
    pressure above a threshold of four standard deviations of the noise: the square fades out towards the rim
    of the patch, where taxels drop in and out, and halves the error that the taxels' spacing leaves. A sample
    is contact when its peak exceeds eight standard deviations, a fiftieth of the recording's peak, and
    `CONTACT_FLOOR_PA`.

    Where the noise is more than a hundredth of the peak, pressures are first summed over neighbouring taxels.
    There, and where the patch is wide, the direction is then the place at which the mean profile of pressure
    fits best: taxels without contact add no noise to it, and what the rim of the array pulls is undone, see
    `without_rim`.

    All of this is our own.

    Parameters
    ----------
    recording : TouchRecording
        T samples of N taxels.

    Returns
    -------
    ContactTrack
        Contact of each of the T samples.
    """
    from evifuse.touch._kernels_contact import contacts, peaks, placed, to_unit

    tip, pressure = recording.fingertip, np.ascontiguousarray(recording.pressure_pa)
    noise, pitch = noise_pa(pressure), taxel_pitch_m(tip)
    top = _highest_pa(pressure)
    noisy, clear = noise > NOISY * top, pressure
    threshold = max(4 * noise, 0.01 * top, CONTACT_FLOOR_PA / 2)
    if noisy:
        clear = pressure @ neighbourhoods(tip, SUMMED * pitch)
        threshold = max(3 * noise, 0.02 * _highest_pa(clear), CONTACT_FLOOR_PA / 2)
    peak, strongest, mean = contacts(clear, threshold, normal_weights(tip))
    length = to_unit(mean)
    # pressure all around the sphere is a squeeze, not a contact with one surface
    touching = (peak > 2 * threshold) & (length > 0.5)
    rows = np.flatnonzero(touching)
    middle = length[rows[:: max(1, len(rows) // SOME)]]
    patch_rad = float(np.sqrt(max(2 * (1 - median_of(middle)), 0.0))) if len(rows) else 0.0
    wide = noisy or patch_rad * tip.radius_m > WIDE * pitch
    contact, interior = mean[rows], np.zeros(len(peak), dtype=np.bool_)
    if wide and len(rows):
        contact, interior[rows] = _matched(tip, pressure, rows, contact, patch_rad)
    else:
        reach = max(2 * pitch / tip.radius_m, 2 * patch_rad)
        covered = np.mean([taxel_coverage(tip, reach * share) for share in REACHES], axis=0)
        interior[rows] = (covered > 0.8)[strongest[rows]]
    direction, normal, point = placed(
        rows, contact, recording.orientation_xyzw, recording.position_m, tip.radius_m
    )
    return ContactTrack(
        touching=touching,
        interior=interior,
        direction=direction,
        normal=normal,
        point_m=point,
        peak_pa=peaks(pressure, 1) if noisy else peak,
        threshold_pa=threshold,
        scale_error=WIDE_ERROR if wide else NARROW_ERROR,
        noise_pa=noise,
    )


def _highest_pa(pressure_pa: NDArray[np.float64]) -> float:
    """Pressure that hardly any sample exceeds, from some of them: 99 % of the peaks are lower."""
    from evifuse.touch._kernels_contact import peaks

    return quantile_of(peaks(pressure_pa, max(1, len(pressure_pa) // SOME)), 0.99)


@per_fingertip
def normal_weights(tip: Fingertip) -> NDArray[np.float64]:
    """Areas of the taxels, and areas times their normals, shape (4, N)."""
    areas = taxel_areas(tip)
    return np.ascontiguousarray(np.concatenate([areas[None], areas * tip.normals.T]))


@per_fingertip
def neighbourhoods(tip: Fingertip, width_m: float) -> NDArray[np.float64]:
    """Weights (N, N) that sum neighbours, a Gaussian; they leave the standard deviation of noise as it is."""
    apart = tip.positions_m[:, None] - tip.positions_m[None]
    weight = np.exp(-0.5 * np.square(apart).sum(axis=-1) / width_m**2)
    return weight / np.sqrt(np.square(weight).sum(axis=0))


def _matched(
    tip: Fingertip,
    pressure: NDArray[np.float64],
    rows: NDArray[np.int64],
    contact: NDArray[np.float64],
    patch_rad: float,
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Directions (M, 3) at which the mean profile fits best, and whether the array lies around them."""
    from evifuse.touch._kernels_contact import match

    furthest = max(BROAD * patch_rad * tip.radius_m, 4 * taxel_pitch_m(tip))
    height, profile = np.zeros(len(rows)), Profile(1, furthest, 0.0)
    some = slice(None, None, max(1, len(rows) // 300))
    for _ in range(2):
        profile = pressure_profile(tip, pressure[rows[some]], tip.radius_m * contact[some], furthest)
        contact, height = match(
            pressure, rows, contact, tip.positions_m, tip.radius_m, profile.reach_m, profile.power, 3
        )
    contact = without_rim(tip, contact, height, profile)
    pole = tip.normals.mean(axis=0)
    rim = float((tip.normals @ pole).min()) / float(np.linalg.norm(pole))
    aside = np.arccos(np.clip(contact @ pole / np.linalg.norm(pole), -1.0, 1.0))
    inside = aside < np.arccos(np.clip(rim, -1.0, 1.0)) - 0.5 * taxel_pitch_m(tip) / tip.radius_m
    return contact, inside & (height > 0)
