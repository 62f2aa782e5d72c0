"""Edges and corners: where the surface turns more sharply than the fingertip can follow (our own).

On a smooth surface the contact travels while the finger turns. On a convex edge the normal turns while the
contact stays: the finger's centre runs a circle of its own radius about the edge. In a concave one the centre
stays while the contact jumps from one side to the other. Neither is a curvature: its value would say how
sharp the taxels are, not what the surface is like. Such a site gives no evidence over the primitives, and a
warning.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import Fingertip, TouchRecording
from evifuse.touch.contact import ContactTrack
from evifuse.touch.fingertip import taxel_pitch_m
from evifuse.touch.remembered import per_fingertip
from evifuse.touch.rolling import tangents
from evifuse.touch.sites import ContactSite

__all__ = ["Edge", "beside_edges", "find_edge", "site_edge", "taxel_angle_rad"]

SHARP = 0.1
"""An edge's radius is below this share of the fingertip's (concave: the centre's way is)."""
SMALLEST_TURN_RAD = 0.25
"""An edge turns the normal by so much at least: 14 degrees."""
TAXELS = 2.5
"""And by the angle between so many neighbouring taxels: what is felt sticks to a taxel before it moves on."""
TIMES_THE_ERROR = 2.0
"""How many standard errors the radius must be clear of what counts as sharp."""
BESIDE = 2.0
"""A finger that fell off an edge has touched something within so many of its radii."""
CORNER_RAD = 0.5
"""Where rolls turn about axes that differ by more than this (29 degrees), several edges meet."""


@dataclass(frozen=True)
class Edge:
    """An edge that was rolled over.

    Parameters
    ----------
    turn_rad : float
        Angle by which the normal turned, radians.
    width_m : float
        How far the contact (concave: the finger's centre) went meanwhile, metres.
    convex : bool
        Whether it sticks out.
    direction_rad : float
        Direction in which the normal turned, in the site's tangent plane, in [0, pi).
    corner : bool
        Whether the rolls of the site turned in different directions.
    """

    turn_rad: float
    width_m: float
    convex: bool
    direction_rad: float
    corner: bool = False

    def __str__(self) -> str:
        """As warnings say it."""
        kind = ("a corner" if self.corner else "an edge") if self.convex else "an inner edge"
        return f"{kind} (turn {self.turn_rad:.1f} rad within {1000 * self.width_m:.1f} mm)"


def find_edge(
    recording: TouchRecording, track: ContactTrack, site: ContactSite, roll: NDArray[np.int64]
) -> Edge | None:
    """Edge that one roll crosses.

    Of all stretches of the roll that turn by 0.25 rad or more with a radius of curvature below a tenth of
    the fingertip's, the one that does so most clearly.

    Parameters
    ----------
    recording : TouchRecording
        T samples.
    track : ContactTrack
        Its contact.
    site : ContactSite
        The site that the roll crosses.
    roll : ndarray of int64, shape (M,)
        Samples of the roll.

    Returns
    -------
    Edge or None
        None for a smooth surface, and where the errors are too large to tell.
    """
    radius = recording.fingertip.radius_m
    path, turn, normal, error_rad = _stretches(recording, track, site, roll)
    error = TIMES_THE_ERROR * np.sqrt(2) * radius * error_rad
    moved, turned = path[None, :] - path[:, None], turn[None, :] - turn[:, None]
    least = max(SMALLEST_TURN_RAD, TAXELS * taxel_angle_rad(recording.fingertip))
    found: list[Edge] = []
    for convex, total, width in (
        (True, turned, np.abs(moved)),
        (False, -turned, np.abs(moved + radius * turned)),
    ):
        sharp = (total >= least) & (width + error <= SHARP * radius * total)
        if sharp.any():
            clear = np.where(sharp, 2 * SHARP * radius * total - width, -np.inf)
            i, j = np.unravel_index(int(np.argmax(clear)), sharp.shape)
            across = normal[j] - normal[i]
            facing = float(np.arctan2(across[1], across[0]) % np.pi)
            found.append(Edge(float(total[i, j]), float(width[i, j]), convex, facing))
    return max(found, key=lambda edge: edge.turn_rad, default=None)


def site_edge(edges: Sequence[Edge | None]) -> Edge | None:
    """What the rolls of a site say together: a smooth surface, an edge, or a corner.

    Parameters
    ----------
    edges : sequence of Edge or None
        Of each roll.

    Returns
    -------
    Edge or None
        The one that turns most.
    """
    found = [edge for edge in edges if edge is not None]
    if not found:
        return None
    most = max(found, key=lambda edge: edge.turn_rad)
    apart = max(abs(np.angle(np.exp(2j * (edge.direction_rad - most.direction_rad)))) / 2 for edge in found)
    return replace(most, corner=bool(apart > CORNER_RAD))


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


def beside_edges(sites: Sequence[ContactSite], edges: Sequence[Edge | None], radius_m: float) -> list[bool]:
    """Which sites are next to an edge: a roll in one direction there says where the finger fell.

    Parameters
    ----------
    sites : sequence of ContactSite
        The touched sites.
    edges : sequence of Edge or None
        What was found at each.
    radius_m : float
        Radius of the fingertip, metres.

    Returns
    -------
    list of bool
        For each site, whether one that is an edge is within two radii.
    """
    places = [site.centre_m for site, edge in zip(sites, edges, strict=True) if edge is not None]
    return [any(np.linalg.norm(site.centre_m - p) < BESIDE * radius_m for p in places) for site in sites]


def _stretches(
    recording: TouchRecording, track: ContactTrack, site: ContactSite, roll: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], float]:
    """Path of the contact (B,), turn (B,), normal (B, 2) of B parts of a roll; the turn's standard error.

    Path and turn are those in the plane of the roll. The path is summed along the surface's tangent, not over
    its own steps, so that noise doesn't lengthen it. The error is that of second differences, which a steady
    turn doesn't have; the few at the ends of an edge are left out.
    """
    axes = np.stack([*tangents(site.normal), site.normal], axis=1)
    point, normal = track.point_m[roll] @ axes, track.normal[roll] @ axes
    centre = recording.position_m[roll] @ axes
    radius = recording.fingertip.radius_m
    extent = np.linalg.norm(np.ptp(point, axis=0)) + radius * np.linalg.norm(np.ptp(normal[:, :2], axis=0))
    count = int(np.clip(2 * extent / taxel_pitch_m(recording.fingertip), 8, min(64, len(roll))))
    blocks = np.array_split(np.concatenate([point, normal, centre], axis=1), count)
    means = np.array([block.mean(axis=0) for block in blocks])
    change, way = means[-1, 3:5] - means[0, 3:5], means[-1, 6:8] - means[0, 6:8]
    heading = way if np.linalg.norm(way) > SHARP * radius else -change
    heading = heading / max(float(np.linalg.norm(heading)), 1e-12)
    turn = np.arctan2(means[:, 3:5] @ heading, means[:, 5])
    middle, step = 0.5 * (turn[1:] + turn[:-1]), np.diff(means[:, :3], axis=0)
    steps = step[:, :2] @ heading * np.cos(middle) - step[:, 2] * np.sin(middle)
    path = np.concatenate([[0.0], np.cumsum(steps)])
    error = float(np.percentile(np.abs(np.diff(turn, 2)), 90)) / (1.645 * np.sqrt(6)) if count > 3 else 0.0
    return path, turn, means[:, 3:5], error
