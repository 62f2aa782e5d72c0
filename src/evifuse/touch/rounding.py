"""How sharply a roll turns: the radius of the rounding that it crosses, down to nothing (our own).

Over a rounding of radius r the centre of a fingertip of radius a runs an arc of radius r + a, less the depth
to which it is pressed in. A curvature 1/r has no end where the rounding becomes sharp; the arc has one, the
fingertip itself. So r is measured on the arc, and a sharp edge is a number like any other: 0, with an error.
The pose alone tells the arc; the normals tell how far it goes, and hold its middle where it is short.
"""

from dataclasses import dataclass, replace

import numpy as np

from evifuse.recordings.recording import Fingertip, TouchRecording
from evifuse.touch.contact import ContactTrack
from evifuse.touch.curvature import NARROWEST_RAD
from evifuse.touch.pressed import pressed_m
from evifuse.touch.remembered import per_fingertip
from evifuse.touch.rolling import tangents
from evifuse.touch.sites import ContactSite

__all__ = ["Rounding", "roundings", "taxel_angle_rad"]

SMALLEST_TURN_RAD = 0.14
"""A rounding turns the normal by so much at least: 8 degrees."""
TAXELS = 1.5
"""And by the angle between so many neighbouring taxels: what is felt sticks to a taxel before it moves on."""
TAXEL_SHARE = 0.3
"""How far the felt normal may stick, over the angle between neighbouring taxels."""
PIECES, FEWEST = 32, 5
"""A roll is cut into so many pieces; an arc has so many at least."""
STEADY = 2.5e-4
"""Error of the height that is left when the pose is exact, over the fingertip's radius."""
LEANING_RAD = 0.03
"""Error of the direction in which the normal turns, where the heights of several rolls tell it."""
WIDE = 1.5
"""An arc of more than so many fingertip radii is no edge, and is not measured here."""
STILL = 0.1
"""In an inner edge the centre's way is shorter than this share of the finger's own turn."""


@dataclass(frozen=True)
class Rounding:
    """A rounding that one roll crossed.

    Parameters
    ----------
    radius_m : float
        Its radius, metres; below 0 by no more than its error where it is sharp.
    error_m : float
        Standard error of the radius, metres.
    turn_rad : float
        Angle by which the normal turned on it, radians.
    across_rad : float
        Direction in which the normal turned, in the site's tangent plane, in [0, pi).
    convex : bool
        Whether it sticks out; if not, the finger turned in an inner edge.
    """

    radius_m: float
    error_m: float
    turn_rad: float
    across_rad: float
    convex: bool = True


def roundings(recording: TouchRecording, track: ContactTrack, site: ContactSite) -> list[Rounding]:
    """Roundings that the rolls of a site cross: of each the one that is known best, and an inner edge.

    Of all stretches of a roll that turn far enough, the arc with the smallest error counts. A stretch that is
    no arc, as it goes on over flat ground, has a large one.

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
    list of Rounding
        Empty where the normal doesn't turn, or only as on a surface that is far from sharp.
    """
    from evifuse.touch._kernels_arcs import site_roundings

    tip, rolls = recording.fingertip, [roll for roll in site.rolls if len(roll) > 3 * FEWEST]
    if not rolls:
        return []
    axes = np.stack([*tangents(site.normal), site.normal], axis=1)
    radius, taxel = tip.radius_m, taxel_angle_rad(tip)
    table = site_roundings(
        recording.position_m,
        track.normal,
        np.concatenate(rolls),
        np.cumsum([0, *map(len, rolls)]),
        site.centre_m,
        axes,
        radius,
        max(SMALLEST_TURN_RAD, TAXELS * taxel),
        PIECES,
        FEWEST,
        NARROWEST_RAD,
        (STEADY * radius, TAXEL_SHARE * taxel, LEANING_RAD, WIDE, STILL),
    )
    felt: list[Rounding] = []
    for (way, across, turn, still, _), (own, _, angle, there, error) in table.tolist():
        if still:
            felt.append(Rounding(0.0, way, turn, across, convex=False))
        if there:
            felt.append(Rounding(own, error, angle, across))
    if not any(own.convex for own in felt):
        return felt
    depth, error = pressed_m(recording, track, site)
    return [
        replace(own, radius_m=own.radius_m + depth, error_m=float(np.hypot(own.error_m, error)))
        if own.convex
        else own
        for own in felt
    ]


@per_fingertip
def taxel_angle_rad(fingertip: Fingertip) -> float:
    """Typical angle between the normals of neighbouring taxels.

    Parameters
    ----------
    fingertip : Fingertip
        N taxels.

    Returns
    -------
    float
        Median over the taxels of the mean angle to the four nearest others, radians; pi for one taxel.
    """
    place, normals = fingertip.positions_m, fingertip.normals
    if len(place) < 2:
        return float(np.pi)
    squared = np.square(place).sum(axis=1)
    near = np.argsort(squared[:, None] + squared - 2 * place @ place.T, axis=1)[:, 1:5]
    cosine = np.einsum("nd,nkd->nk", normals, normals[near])
    return float(np.median(np.arccos(np.clip(cosine, -1.0, 1.0)).mean(axis=1)))
