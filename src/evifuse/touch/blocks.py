"""The rolls of a site cut into short pieces, and what each piece says (our own)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import Fingertip, TouchRecording
from evifuse.touch.contact import ContactTrack
from evifuse.touch.fingertip import taxel_pitch_m
from evifuse.touch.quantiles import median_of
from evifuse.touch.rolling import tangents
from evifuse.touch.sites import ContactSite

__all__ = ["Pieces", "directions_of", "pieces_of", "site_frame", "spacing_error_rad"]

Array = NDArray[np.float64]

FEWEST, MOST = 6, 24
"""How many pieces a roll is cut into."""
LONGEST = 0.04
"""A piece is at most so long, over the finger's radius, and at most half the distance between taxels."""
ALONE = 0.26
"""Error of a contact that one taxel alone tells, per axis, over the distance between taxels."""
FAINT = 0.15
"""A taxel with less than this share of the peak doesn't count as active."""


@dataclass(frozen=True)
class Pieces:
    """Means over the pieces of all rolls of a site, B in all.

    Parameters
    ----------
    means : ndarray of float64, shape (B, 9)
        Centre of the sphere, metres, normal of the surface and turned pole, world frame.
    size : ndarray of int64, shape (B,)
        How many samples a piece has; pieces follow each other in time.
    share : ndarray of float64, shape (B,)
        Share of a full piece, in (0, 1].
    roll : ndarray of int64, shape (B,)
        Number of the roll, not decreasing.
    """

    means: Array
    size: NDArray[np.int64]
    share: Array
    roll: NDArray[np.int64]


def site_frame(site: ContactSite, radius_m: float) -> tuple[Array, Array]:
    """Where a patch of surface is described.

    Parameters
    ----------
    site : ContactSite
        A site.
    radius_m : float
        Radius of the fingertip, metres.

    Returns
    -------
    origin_m : ndarray of float64, shape (3,)
        A point of the surface, metres.
    frame : ndarray of float64, shape (3, 3)
        Tangents and normal in its columns.
    """
    frame = np.stack([*tangents(site.normal), site.normal], axis=1)
    return site.centre_m - radius_m * site.normal, frame


def directions_of(recording: TouchRecording, site: ContactSite) -> list[float]:
    """Directions of the rolls in the site's tangent plane.

    Parameters
    ----------
    recording : TouchRecording
        T samples.
    site : ContactSite
        A site.

    Returns
    -------
    list of float
        Radians.
    """
    axes = np.stack(tangents(site.normal))
    ways = [axes @ (recording.position_m[roll[-1]] - recording.position_m[roll[0]]) for roll in site.rolls]
    return [float(np.arctan2(way[1], way[0])) for way in ways]


def pieces_of(recording: TouchRecording, normal: Array, site: ContactSite) -> Pieces:
    """Cut the rolls of a site into pieces, equal steps of their way.

    Parameters
    ----------
    recording : TouchRecording
        T samples, whose position moves along the rolls.
    normal : ndarray of float64, shape (T, 3)
        Outward unit normals of the surface, from the taxels.
    site : ContactSite
        A site with rolls.

    Returns
    -------
    Pieces
        In order of time, roll by roll.
    """
    from evifuse.touch._kernels_rolls import roll_pieces

    tip, turn = recording.fingertip, recording.orientation_xyzw
    pole = tip.normals.mean(axis=0)
    pole = pole / np.linalg.norm(pole)
    step = _length_m(tip)
    parts: list[tuple[Array, Array, Array, NDArray[np.int64]]] = []
    for number, roll in enumerate(site.rolls):
        means, size = roll_pieces(recording.position_m, normal, turn, pole, roll, step, FEWEST, MOST)
        full = np.minimum(size / median_of(size), 1.0)
        parts.append((means, size, full, np.full(len(full), number, np.int64)))
    means, size, full, label = (np.concatenate(part) for part in zip(*parts, strict=True))
    return Pieces(means, size.astype(np.int64), full, label)


def spacing_error_rad(recording: TouchRecording, track: ContactTrack, site: ContactSite) -> float:
    """Error of a piece's contact angle that the spacing of the taxels leaves.

    The middle of a patch on a square lattice is off by 0.26 of the pitch if only one taxel feels it (found by
    drawing patches on a lattice). With more active taxels it falls by their fourth power until the scatter of
    the pieces shows what is left, as simulated recordings say. Neighbouring pieces share the error over the
    length of a pitch.

    Parameters
    ----------
    recording : TouchRecording
        T samples.
    track : ContactTrack
        Its contact.
    site : ContactSite
        A site with rolls.

    Returns
    -------
    float
        Standard deviation, radians.
    """
    from evifuse.touch._kernels_sites import active_taxels

    tip = recording.fingertip
    pitch = taxel_pitch_m(tip)
    samples = np.concatenate(site.rolls)
    some = samples[:: max(1, len(samples) // 100)]
    active = median_of(active_taxels(recording.pressure_pa, some, track.threshold_pa, FAINT))
    error = ALONE * pitch * min(1.0, (1.3 / max(active, 1.0)) ** 4)
    return error / tip.radius_m * float(np.sqrt(max(pitch / _length_m(tip), 1.0)))


def _length_m(tip: Fingertip) -> float:
    """Length of a piece, metres."""
    return min(0.5 * taxel_pitch_m(tip), LONGEST * tip.radius_m)
