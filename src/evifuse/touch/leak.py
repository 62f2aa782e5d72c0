"""How far a load leaks from taxel to taxel: the point spread, measured from a recording (our own).

A ball in a bed of springs loads a round patch of radius b as ``1 - r^2 / b^2``. Its mean square distance from
the middle is ``M2 = b^2 / 3`` and its mean fourth power ``M4 = b^4 / 6``. A Gaussian point spread of standard
deviation s adds ``2 s^2`` to M2, but ``2 M2^2 - M4`` stays ``b^4 / 18`` whatever s is: that tells b from s.
"""

import numpy as np

from evifuse.recordings.recording import TouchRecording
from evifuse.touch.contact import contact_track

__all__ = ["point_spread_m"]

BINS = 400
"""Rings around the contact."""
SAMPLES = 400
"""Contacts that are laid over each other, about."""
FAINT = 0.003
"""Rings with less than this share of the highest pressure are left out."""
MIDDLE, FARTHEST = 0.35, 1.2
"""Contacts that are used, and outermost ring around them, over the angle at which the array ends."""


def point_spread_m(recording: TouchRecording) -> float:
    """Standard deviation of the spread between taxels.

    Meant for recordings of a spherical fingertip on surfaces with round patches, such as a plane or a ball;
    where the patch is long, its length counts as spread.

    Parameters
    ----------
    recording : TouchRecording
        T samples with contact in the middle of the array.

    Returns
    -------
    float
        Metres; 0 where there is less spread than the method resolves, NaN without such contacts.
    """
    tip, track = recording.fingertip, contact_track(recording)
    pole = tip.normals.mean(axis=0)
    edge = float((tip.normals @ pole).min()) / float(np.linalg.norm(pole))
    aside = track.direction @ (pole / np.linalg.norm(pole))
    array = float(np.arccos(np.clip(edge, -1.0, 1.0)))
    rows = np.flatnonzero(track.touching & (aside > np.cos(MIDDLE * array)))
    reach = FARTHEST * array
    if len(rows) < 10:
        return float("nan")
    rows = rows[:: max(1, len(rows) // SAMPLES)]
    angle = np.arccos(np.clip(track.direction[rows] @ tip.normals.T, -1.0, 1.0)).ravel()
    ring = np.floor(np.square(angle / reach) * BINS).astype(np.int64)  # of equal areas
    inside = ring < BINS
    count = np.bincount(ring[inside], minlength=BINS)
    load = np.bincount(ring[inside], recording.pressure_pa[rows].ravel()[inside], BINS) / np.maximum(count, 1)
    load[load < FAINT * load.max()] = 0.0
    square = np.square(reach * tip.radius_m) * (np.arange(BINS) + 0.5) / BINS
    total = float(load.sum())
    second, fourth = float(load @ square) / total, float(load @ square**2) / total
    patch = np.sqrt(max(18 * (2 * second**2 - fourth), 0.0))
    return float(np.sqrt(max(second - patch / 3, 0.0) / 2))
