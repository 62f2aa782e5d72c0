"""Principal curvatures of something thin: rods, balls and tips that the finger goes around (our own).

Not much thicker than the finger is pressed in, and steep all around, it is no graph over a plane. The arcs of
the finger's centre tell its radius across, and what is left of the heights tells how it bends along.
"""

import numpy as np

from evifuse.recordings.recording import TouchRecording
from evifuse.touch.contact import ContactTrack
from evifuse.touch.curvature import ShapeOperator
from evifuse.touch.pressed import pressed_m
from evifuse.touch.rolling import tangents
from evifuse.touch.rounding import Rounding, roundings
from evifuse.touch.sites import ContactSite

__all__ = ["thin_shape"]

THINNEST = 2.0
"""A radius below so many of its errors is no radius."""
SIDEWAYS_RAD = np.pi / 4
"""Roundings in directions that differ by more belong to a ball or a tip."""
ENDS = 0.12
"""At either end of a roll this share of it may belong to lowering and lifting."""
STEADY = 1e-3
"""Error of heights that is left along a rod, over the finger's radius."""


def thin_shape(recording: TouchRecording, track: ContactTrack, site: ContactSite) -> ShapeOperator | None:
    """Shape operator of something thin, from the roundings of its rolls.

    Parameters
    ----------
    recording : TouchRecording
        T samples, of a sphere.
    track : ContactTrack
        Its contact.
    site : ContactSite
        The site with its rolls.

    Returns
    -------
    ShapeOperator or None
        None where no radius was measured.
    """
    felt = [own for own in roundings(recording, track, site) if own.convex]
    felt = [own for own in felt if own.radius_m > THINNEST * own.error_m]
    if not felt:
        return None
    best = min(felt, key=lambda own: own.error_m)
    aside = [own for own in felt if _apart(own, best) > SIDEWAYS_RAD]
    own, error = -1 / best.radius_m, best.error_m / best.radius_m**2
    if aside:
        other = min(aside, key=lambda found: found.error_m)
        along, along_error = -1 / other.radius_m, other.error_m / other.radius_m**2
    else:
        along, along_error = _along(recording, track, site, best)
    across = best.across_rad
    if along >= own:
        return ShapeOperator(along, own, along_error, error, float((across + np.pi / 2) % np.pi))
    return ShapeOperator(own, along, error, along_error, across)


def _along(
    recording: TouchRecording, track: ContactTrack, site: ContactSite, best: Rounding
) -> tuple[float, float]:
    """Curvature along a rod and its standard error, 1/m: how the way of the centre bends beside its arc."""
    radius = recording.fingertip.radius_m
    axes = np.stack([*tangents(site.normal), site.normal], axis=1)
    cut = [(roll, round(ENDS * len(roll))) for roll in site.rolls]
    samples = np.concatenate([roll[e : len(roll) - e : max(1, len(roll) // 64)] for roll, e in cut])
    place = (recording.position_m[samples] - site.centre_m) @ axes
    c, s = np.cos(best.across_rad), np.sin(best.across_rad)
    x, y = place[:, 0] * c + place[:, 1] * s, place[:, 1] * c - place[:, 0] * s
    depth = pressed_m(recording, track, site)[0]
    reach = radius + best.radius_m - depth
    near = np.abs(x) < 0.8 * reach
    x, y, z = x[near], y[near], place[near, 2]
    left = z - np.sqrt(reach**2 - x * x)
    scale = max(float(np.abs([x, y]).max()), 1e-9)
    x, y = x / scale, y / scale
    rows = np.stack([np.ones_like(x), x, y, y * y, x * y, x * x], axis=1)
    system = rows.T @ rows + 1e-6 * len(x) * np.eye(6)
    found = np.linalg.solve(system, rows.T @ left)
    noise = float(np.std(left - rows @ found))
    bend = 2 * float(found[3]) / scale**2
    variance = float(np.linalg.inv(system)[3, 3])
    error = 2 * np.hypot(noise * np.sqrt(variance), STEADY * radius) / scale**2
    shrunk = max(1 + (radius - depth) * bend, 0.05)
    return bend / shrunk, float(error) / shrunk**2


def _apart(one: Rounding, other: Rounding) -> float:
    return float(abs(np.angle(np.exp(2j * (one.across_rad - other.across_rad)))) / 2)
