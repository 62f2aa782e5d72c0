"""How deep a finger is pressed in, from how far it went on after the first touch (our own).

Before a roll the finger is lowered along the normal, and after it lifted: between the first touch and the
roll, and between the roll and the last touch, it goes as far as it is pressed in.
"""

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import TouchRecording
from evifuse.touch.contact import ContactTrack
from evifuse.touch.fingertip import taxel_pitch_m
from evifuse.touch.sites import ContactSite

__all__ = ["pressed_m"]

LONGEST = 300
"""So many samples after the first touch are looked at."""
ASIDE = 0.03
"""A finger that has moved aside by more than this share of its radius is rolling."""
USUAL, UNSURE = 0.02, 0.015
"""Depth that is taken where no touch was seen, and its error, over the finger's radius."""
LATE, RELATIVE, LEAST = 1.15, 0.2, 0.01
"""By how much a felt depth is too small, its relative error, and its smallest over the finger's radius."""


def pressed_m(recording: TouchRecording, track: ContactTrack, site: ContactSite) -> tuple[float, float]:
    """Press depth at a site.

    The first touch is felt late where taxels are far apart, so the upper quartile of all touches and lifts
    counts.

    Parameters
    ----------
    recording : TouchRecording
        T samples.
    track : ContactTrack
        Its contact.
    site : ContactSite
        The site with its rolls.

    Returns
    -------
    depth_m, error_m : float
        Depth and its standard error, metres.
    """
    radius = recording.fingertip.radius_m
    away = np.flatnonzero(~track.touching)
    found: list[float] = []
    for roll in site.rolls:
        before, after = np.searchsorted(away, roll[0]), np.searchsorted(away, roll[-1])
        start = int(away[before - 1]) + 1 if before > 0 else None
        stop = int(away[after]) if after < len(away) else None
        if start is not None:
            samples = np.arange(start, min(start + LONGEST, int(roll[-1])))
            found.append(_way_m(recording, track, samples, radius))
        if stop is not None:
            samples = np.arange(stop - 1, max(stop - 1 - LONGEST, int(roll[0])), -1)
            found.append(_way_m(recording, track, samples, radius))
    low, middle, most = np.percentile(found, [25, 75, 100]).tolist() if found else (0.0, 0.0, 0.0)
    depth = LATE * middle
    if depth < 0.25 * USUAL * radius:
        return USUAL * radius, UNSURE * radius
    late = taxel_pitch_m(recording.fingertip) ** 2 / (4 * radius)  # half a diagonal away from a taxel
    error = float(np.sqrt((LEAST * radius) ** 2 + (RELATIVE * depth) ** 2 + late**2))
    return depth, max(error, 0.5 * (most - low))


def _way_m(
    recording: TouchRecording, track: ContactTrack, samples: NDArray[np.int64], radius_m: float
) -> float:
    """How far a finger goes along the normal from its first (last) touch until it rolls, metres."""
    normal = np.median(track.normal[samples[: LONGEST // 4]], axis=0)
    normal = normal / max(float(np.linalg.norm(normal)), 1e-12)
    way = recording.position_m[samples] - recording.position_m[samples[0]]
    depth = -(way @ normal)
    aside = np.linalg.norm(way + depth[:, None] * normal, axis=1) > ASIDE * radius_m
    still = int(np.argmax(aside)) if aside.any() else len(aside)
    return max(float(np.median(depth[max(still - 20, 0) : max(still, 1)])), 0.0)
