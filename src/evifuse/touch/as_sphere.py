"""Any fingertip as a sphere that touches where it does (our own).

A sphere of the fingertip's nominal radius, put against the surface at each contact, touches the same
surface at the same place with the same normal. Its centre's way is what the estimators of a spherical
finger need, and it is exact for any radius. Where the fingertip is flatter than that sphere, an error of
the contact on the array moves the centre aside. So the contact's way over the finger is smoothed along each
roll.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import Fingertip, TouchRecording
from evifuse.recordings.rotation import rotate
from evifuse.touch.contact import ContactTrack
from evifuse.touch.fingersurface import SphereSurface, surface_of
from evifuse.touch.fingertip import taxel_pitch_m
from evifuse.touch.pole import pole_of
from evifuse.touch.remembered import per_fingertip
from evifuse.touch.sites import ContactSite

__all__ = ["as_sphere", "guided"]

SURROUNDED = 0.7
"""A taxel with fewer neighbours than this share of what is usual is on the rim of the array."""

Array = NDArray[np.float64]


def guided(recording: TouchRecording, track: ContactTrack) -> tuple[TouchRecording, ContactTrack]:
    """Put the position at the centre of a sphere at the fingertip's pole, and the contact on its surface.

    Parameters
    ----------
    recording : TouchRecording
        T samples.
    track : ContactTrack
        Its contact, from `contact_track`.

    Returns
    -------
    recording : TouchRecording
        The same one for a sphere about its origin.
    track : ContactTrack
        With the contact on the fingertip's own surface.
    """
    tip = recording.fingertip
    surface = surface_of(tip)
    if isinstance(surface, SphereSurface):
        if float(np.linalg.norm(surface.centre_m)) < 1e-3 * tip.radius_m:
            return recording, track
        centre = recording.position_m + rotate(recording.orientation_xyzw, surface.centre_m[None])
        point = centre - tip.radius_m * track.normal
        return replace(recording, position_m=centre), replace(track, point_m=point)
    pole, facing, _ = pole_of(tip)
    turn = recording.orientation_xyzw
    centre = recording.position_m + rotate(turn, (pole - tip.radius_m * facing)[None])
    rows = np.flatnonzero(track.touching)
    strongest = np.argmax(recording.pressure_pa[rows], axis=1)
    weights = np.square(np.maximum(recording.pressure_pa[rows] - track.threshold_pa, 0.0))
    weights[np.arange(len(rows)), strongest] += 1e-9
    finger, outward = surface.contact(weights)
    normal, point, direction = track.normal.copy(), track.point_m.copy(), track.direction.copy()
    direction[rows], normal[rows] = outward, -rotate(turn[rows], outward)
    point[rows] = recording.position_m[rows] + rotate(turn[rows], finger)
    interior = np.zeros_like(track.touching)
    interior[rows] = _surrounded(tip)[strongest]
    found = replace(track, interior=interior, direction=direction, normal=normal, point_m=point)
    return replace(recording, position_m=centre), found


def as_sphere(
    recording: TouchRecording, guide: TouchRecording, track: ContactTrack, sites: list[ContactSite]
) -> tuple[TouchRecording, ContactTrack, list[ContactSite]]:
    """Replace the fingertip by a sphere of its nominal radius that touches where it does.

    Parameters
    ----------
    recording : TouchRecording
        T samples, as recorded.
    guide : TouchRecording
        The same, from `guided`.
    track : ContactTrack
        Its contact, from `guided`.
    sites : list of ContactSite
        Sites that were found on the guide.

    Returns
    -------
    recording : TouchRecording
        With the centre of that sphere as position.
    track : ContactTrack
        With contacts that are smooth along each roll.
    sites : list of ContactSite
        With the sphere's centre over each site.
    """
    surface = surface_of(recording.fingertip)
    if isinstance(surface, SphereSurface):
        return guide, track, sites
    radius, turn = recording.fingertip.radius_m, recording.orientation_xyzw
    centre, normal, point = guide.position_m.copy(), track.normal.copy(), track.point_m.copy()
    moved: list[ContactSite] = []
    for site in sites:
        for roll in site.rolls:
            back = turn[roll] * [-1.0, -1.0, -1.0, 1.0]
            way = guide.position_m[roll] @ (guide.position_m[roll[-1]] - guide.position_m[roll[0]])
            share = (way - way.mean()) / max(float(np.ptp(way)), 1e-15)
            powers = share[:, None] ** np.arange(3)
            on_finger = rotate(back, track.point_m[roll] - recording.position_m[roll])
            smooth = powers @ np.linalg.lstsq(powers, on_finger, rcond=None)[0]
            finger, outward = surface.project(smooth)
            normal[roll] = -rotate(turn[roll], outward)
            point[roll] = recording.position_m[roll] + rotate(turn[roll], finger)
            centre[roll] = point[roll] + radius * normal[roll]
        moved.append(_placed(site, guide, centre, normal))
    return replace(recording, position_m=centre), replace(track, normal=normal, point_m=point), moved


def _placed(site: ContactSite, guide: TouchRecording, centre: Array, normal: Array) -> ContactSite:
    """The site where the sphere's centre was when the guide was over it."""
    if not site.rolls:
        return site
    samples = np.concatenate(site.rolls)
    apart = np.linalg.norm(guide.position_m[samples] - site.centre_m, axis=1)
    near = samples[np.argsort(apart, kind="stable")[: max(1, len(samples) // 10)]]
    facing = normal[near].sum(axis=0)
    return ContactSite(np.median(centre[near], axis=0), facing / np.linalg.norm(facing), site.rolls)


@per_fingertip
def _surrounded(tip: Fingertip) -> NDArray[np.bool_]:
    """Taxels (N,) that aren't on the rim of the array."""
    apart = np.linalg.norm(tip.positions_m[:, None] - tip.positions_m[None], axis=-1)
    near = (apart < 2 * taxel_pitch_m(tip)).sum(axis=1)
    return near >= SURROUNDED * np.percentile(near, 75)
