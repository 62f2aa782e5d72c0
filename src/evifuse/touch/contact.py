"""Where the fingertip touches at each instant, from the pressures and the pose."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import TouchRecording
from evifuse.recordings.rotation import rotate
from evifuse.touch.fingertip import taxel_areas, taxel_coverage, taxel_pitch_m

__all__ = ["CONTACT_FLOOR_PA", "ContactTrack", "contact_track", "noise_pa"]

CONTACT_FLOOR_PA = 100.0
"""No pressure below this counts as contact, whatever the noise (our own: 0.1 mN on a square millimetre)."""


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
    """

    touching: NDArray[np.bool_]
    interior: NDArray[np.bool_]
    direction: NDArray[np.float64]
    normal: NDArray[np.float64]
    point_m: NDArray[np.float64]
    peak_pa: NDArray[np.float64]
    threshold_pa: float


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
    sample = pressure_pa[:: max(1, pressure_pa.size // 200_000)]
    below, middle, above = np.percentile(sample, [40, 50, 60])
    return float(max(middle - below, above - middle)) / 0.2533


def contact_track(recording: TouchRecording) -> ContactTrack:
    """Find the contact in every sample of a recording.

    The contact's direction is the mean of the taxel normals, weighted by their areas and by the square of the
    pressure above a threshold of four standard deviations of the noise: the square fades out towards the rim
    of the patch, where taxels drop in and out, and halves the error that the taxels' spacing leaves. A sample
    is contact when its peak exceeds eight standard deviations, a fiftieth of the recording's peak, and
    `CONTACT_FLOOR_PA` (all our own).

    Parameters
    ----------
    recording : TouchRecording
        T samples of N taxels.

    Returns
    -------
    ContactTrack
        Contact of each of the T samples.
    """
    tip, pressure = recording.fingertip, recording.pressure_pa
    strongest = np.argmax(pressure, axis=1)
    peak = pressure[np.arange(len(pressure)), strongest]
    noise = noise_pa(pressure)
    threshold = max(4 * noise, 0.01 * float(np.percentile(peak, 99)), CONTACT_FLOOR_PA / 2)
    touching = peak > 2 * threshold
    rows = np.flatnonzero(touching)
    weights = np.square(np.maximum(pressure[rows] - threshold, 0.0)) * taxel_areas(tip)
    total = weights.sum(axis=1, keepdims=True)
    mean = weights @ tip.normals / total
    length = np.linalg.norm(mean, axis=1, keepdims=True)
    usable = length[:, 0] > 0.5  # pressure all around the sphere is a squeeze, not a contact with one surface
    touching[rows[~usable]] = False
    rows, mean, length = rows[usable], mean[usable], length[usable]
    direction, normal = np.zeros((2, len(peak), 3))
    direction[rows] = mean / length
    normal[rows] = -rotate(recording.orientation_xyzw[rows], direction[rows])
    spread_rad = np.sqrt(np.maximum(2 * (1 - length[:, 0]), 0.0))
    patch_rad = float(np.median(spread_rad)) if len(rows) else 0.0
    reach = max(2 * taxel_pitch_m(tip) / tip.radius_m, 2 * patch_rad)
    interior = np.zeros(len(peak), dtype=np.bool_)
    interior[rows] = taxel_coverage(tip, reach)[strongest[rows]] > 0.8
    point = recording.position_m - tip.radius_m * normal
    return ContactTrack(touching, interior, direction, normal, point, peak, threshold)
