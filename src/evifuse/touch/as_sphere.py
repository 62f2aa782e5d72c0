"""Any fingertip as a sphere that touches where it does (our own).

A sphere of the fingertip's nominal radius, put against the surface at each contact, touches the same
surface at the same place with the same normal. Its centre's way is what the estimators of a spherical
finger need, and it is exact for any radius. Where the fingertip is flatter than that sphere, an error of
the contact on the array moves the centre aside. So the contact's way over the finger is smoothed along each
roll, and then moved to where the finger comes closest to the surface that all rolls of the site describe.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import Fingertip, TouchRecording
from evifuse.recordings.rotation import rotate
from evifuse.touch.blocks import Pieces, directions_of, pieces_of, site_frame, spacing_error_rad
from evifuse.touch.contact import ContactTrack
from evifuse.touch.curvature import NARROWEST_RAD, spread_rad
from evifuse.touch.envelope import closest_contacts
from evifuse.touch.fingersurface import SphereSurface
from evifuse.touch.fingertip import surrounded
from evifuse.touch.hull import rolling_surface
from evifuse.touch.patch import Blocks, Patch, fit_patch
from evifuse.touch.pole import pole_of
from evifuse.touch.quadrics import unit_rows
from evifuse.touch.sites import ContactSite

__all__ = ["as_sphere", "guided"]

ROUNDS = 15
"""Contacts and patch are found in turns, at most so many times."""
SETTLED = 3e-4
"""Contacts that move by less than this share of the finger's radius have settled."""
VAGUE_RAD = 0.02
"""Taxels that leave a larger error of a contact's angle say too little of where to start from."""

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
    surface = rolling_surface(tip)
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
    interior[rows] = surrounded(tip)[strongest]
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
    surface = rolling_surface(recording.fingertip)
    if isinstance(surface, SphereSurface):
        return guide, track, sites
    radius, turn = recording.fingertip.radius_m, recording.orientation_xyzw
    centre, normal, point = guide.position_m.copy(), track.normal.copy(), track.point_m.copy()
    moved: list[ContactSite] = []
    for site in sites:
        smooth = [_smooth(recording, guide, track, roll) for roll in site.rolls]
        if smooth and spread_rad(directions_of(guide, site)) >= NARROWEST_RAD:
            smooth = _settled(recording, guide, track, site, smooth)
        for roll, on_finger in zip(site.rolls, smooth, strict=True):
            finger, outward = surface.project(on_finger)
            normal[roll] = -rotate(turn[roll], outward)
            point[roll] = recording.position_m[roll] + rotate(turn[roll], finger)
            centre[roll] = point[roll] + radius * normal[roll]
        moved.append(_placed(site, guide, centre, normal))
    return replace(recording, position_m=centre), replace(track, normal=normal, point_m=point), moved


def _smooth(
    recording: TouchRecording, guide: TouchRecording, track: ContactTrack, roll: NDArray[np.int64]
) -> Array:
    """Contact's way (M, 3) over the finger along a roll, as a parabola."""
    back = recording.orientation_xyzw[roll] * [-1.0, -1.0, -1.0, 1.0]
    way = guide.position_m[roll] @ (guide.position_m[roll[-1]] - guide.position_m[roll[0]])
    share = (way - way.mean()) / max(float(np.ptp(way)), 1e-15)
    powers = share[:, None] ** np.arange(3)
    on_finger = rotate(back, track.point_m[roll] - recording.position_m[roll])
    return powers @ np.linalg.lstsq(powers, on_finger, rcond=None)[0]


def _settled(
    recording: TouchRecording,
    guide: TouchRecording,
    track: ContactTrack,
    site: ContactSite,
    smooth: list[Array],
) -> list[Array]:
    """The same ways where the finger comes closest to the patch that fits them, found in turns."""
    turn = recording.orientation_xyzw
    samples, felt = np.concatenate(site.rolls), track.normal.copy()
    felt[samples] = -rotate(turn[samples], track.direction[samples])
    pieces = pieces_of(guide, felt, site)
    rows = np.concatenate([recording.position_m[samples], turn[samples], np.concatenate(smooth)], axis=1)
    start = np.cumsum(pieces.size) - pieces.size
    pose = np.add.reduceat(rows, start, axis=0) / pieces.size[:, None]
    error = spacing_error_rad(recording, track, site)
    finger = _closest(recording.fingertip, pieces, pose, site, (track.scale_error, error))
    if not np.isfinite(finger).all():
        return smooth
    middle, found = start + 0.5 * (pieces.size - 1), list[Array]()
    for number, roll in enumerate(site.rolls):
        own = pieces.roll == number
        at = start[own][0] + np.arange(len(roll))
        found.append(np.stack([np.interp(at, middle[own], c) for c in finger[own].T], axis=1))
    return found


def _closest(
    tip: Fingertip, pieces: Pieces, pose: Array, site: ContactSite, errors: tuple[float, float]
) -> Array:
    """Contacts (B, 3) on the finger of the pieces, NaN where nothing fits.

    Where taxels are far apart, what they say of the contacts may lead astray. Then a plane is another place
    to start from, and whichever leaves less of the heights is kept.
    """
    finger = pose[:, 7:]
    best, least = _found_from(finger, tip, pieces, pose, site, errors)
    if errors[1] > VAGUE_RAD:
        origin, frame = site_frame(site, tip.radius_m)
        at = (pose[:, :3], unit_rows(pose[:, 3:7]))
        on_plane = closest_contacts(
            rolling_surface(tip), tip.radius_m, np.zeros(16), at, finger, (origin, frame), 12
        )
        plane = Patch(np.zeros(16), np.eye(16), SETTLED * tip.radius_m, errors[1])
        other, left = _found_from(on_plane, tip, pieces, pose, site, errors, plane)
        best = other if left < least else best
    return best


def _found_from(
    finger: Array,
    tip: Fingertip,
    pieces: Pieces,
    pose: Array,
    site: ContactSite,
    errors: tuple[float, float],
    patch: Patch | None = None,
) -> tuple[Array, float]:
    """Contacts (B, 3) on the finger that are found from others in turns, and what is left of the heights."""
    surface, radius = rolling_surface(tip), tip.radius_m
    origin, frame = site_frame(site, radius)
    position, turn = pose[:, :3], unit_rows(pose[:, 3:7])
    felt = unit_rows(pieces.means[:, 3:6]) @ frame
    tilt = felt + pieces.means[:, 6:9] @ frame
    radii = np.full(len(felt), radius)
    for _ in range(ROUNDS):
        finger, outward = surface.project(finger)
        centre = position + rotate(turn, finger - radius * outward)
        blocks = Blocks((centre - origin) @ frame, felt, radii, tilt, pieces.share, pieces.roll, *errors)
        patch = fit_patch(blocks, 2, patch)
        if not np.isfinite(patch.parameters).all() or not np.isfinite(patch.covariance).all():
            return np.full_like(finger, np.nan), np.inf
        before = finger
        finger = closest_contacts(
            surface, radius, patch.parameters, (position, turn), finger, (origin, frame)
        )
        if np.linalg.norm(finger - before, axis=1).max() < SETTLED * radius:
            break
    return finger, np.inf if patch is None else patch.height_error_m


def _placed(site: ContactSite, guide: TouchRecording, centre: Array, normal: Array) -> ContactSite:
    """The site where the sphere's centre was when the guide was over it."""
    if not site.rolls:
        return site
    samples = np.concatenate(site.rolls)
    apart = np.linalg.norm(guide.position_m[samples] - site.centre_m, axis=1)
    near = samples[np.argsort(apart, kind="stable")[: max(1, len(samples) // 10)]]
    facing = normal[near].sum(axis=0)
    return ContactSite(np.median(centre[near], axis=0), facing / np.linalg.norm(facing), site.rolls)
