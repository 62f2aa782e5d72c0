"""Edges and corners: roundings that can't be told from sharp ones (our own).

On a smooth surface the contact travels while the finger turns. On a sharp edge the normal turns while the
contact stays: the finger's centre runs a circle of its own radius about the edge. In an inner edge the centre
stays while the contact jumps from one side to the other. A curvature of such a place would say how sharp the
taxels are, not what the surface is like. So it gives no evidence over the primitives, and a warning.

What is called an edge is a matter of what was measured: the radius of the rounding is below an eighth of the
fingertip's, or its interval goes down to 0. A rod whose radius is measured, and larger, is curved.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from evifuse.recordings.recording import TouchRecording
from evifuse.touch.contact import ContactTrack
from evifuse.touch.curvature import ShapeOperator
from evifuse.touch.fingersurface import SphereSurface, surface_of
from evifuse.touch.rounding import Rounding, roundings, taxel_angle_rad
from evifuse.touch.sites import ContactSite

__all__ = ["SHARP", "Edge", "beside_edges", "contradicted", "find_edge", "site_edge", "taxel_angle_rad"]

SHARP = 0.125
"""A rounding is an edge when its radius is below this share of the fingertip's, or may be 0."""
OPEN = 0.35
"""And when its interval ends below this share."""
TIMES_THE_ERROR = 2.0
"""Half the width of that interval, in standard errors: 95 %."""
BESIDE = 2.0
"""A finger that fell off an edge has touched something within so many of its radii."""
RIDGE = 2.0
"""A ridge that turns by less than half a radian is felt as sharp as this times its turn, over the radius."""
CORNER_RAD = 0.5
"""Where rolls turn in directions that differ by more than this (29 degrees) there is a corner or a tip."""


@dataclass(frozen=True)
class Edge:
    """An edge or a corner that was rolled over.

    Parameters
    ----------
    turn_rad : float
        Angle by which the normal turned, radians.
    radius_m : float
        Radius of its rounding, metres; 0 where it is sharp, as far as was felt.
    largest_radius_m : float
        Upper end of the radius' interval (95 %), metres.
    convex : bool
        Whether it sticks out.
    direction_rad : float or None
        Direction of the ridge (inner edge: the groove) in the site's tangent plane, as
        `RollCurvature.direction_rad`, in [0, pi). None for a corner, which has none.
    corner : bool
        Whether the normal turned in more than one direction: a corner, a tip or a thorn.
    """

    turn_rad: float
    radius_m: float
    largest_radius_m: float
    convex: bool
    direction_rad: float | None
    corner: bool = False

    def __str__(self) -> str:
        """As warnings say it."""
        kind = ("a corner" if self.corner else "an edge") if self.convex else "an inner edge"
        return f"{kind} (turn {self.turn_rad:.1f} rad, radius below {1000 * self.largest_radius_m:.1f} mm)"


def find_edge(recording: TouchRecording, track: ContactTrack, site: ContactSite) -> Edge | None:
    """The edge or corner at a site.

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
    Edge or None
        None where the surface is smooth, or known to be rounded.
    """
    tip = recording.fingertip
    return site_edge(
        roundings(recording, track, site), tip.radius_m, isinstance(surface_of(tip), SphereSurface)
    )


def site_edge(felt: Sequence[Rounding], radius_m: float, sphere: bool = True) -> Edge | None:
    """What the roundings that the rolls of a site crossed say together.

    One that is known better outdoes others: a roll along a thin rod sees little of it. On a finger that is no
    sphere a contact is moved to where a smooth surface would be touched, which makes an edge look rounder
    than it is: there a roll that finds it sharp is not outdone, and the bound is that of all.

    Parameters
    ----------
    felt : sequence of Rounding
        Of all rolls.
    radius_m : float
        Radius of the fingertip, metres.
    sphere : bool
        Whether the fingertip is one.

    Returns
    -------
    Edge or None
        The edge, a corner where rolls turn in different directions, or nothing.
    """
    sharp = [
        own
        for own in felt
        if _is_sharp(own, radius_m) and not (sphere and any(_outdoes(other, own, radius_m) for other in felt))
    ]
    if not sharp:
        return None
    best = min(sharp, key=lambda own: (own.convex, own.error_m))
    reach = SHARP * radius_m
    alike = [own for own in felt if own.convex == best.convex and _interval(own)[0] <= reach]
    turn = max(own.turn_rad for own in alike)
    corner = best.convex and any(_apart(own, best) > CORNER_RAD for own in alike)
    spread = max(own.radius_m for own in alike) - min(own.radius_m for own in alike)
    largest = max(_interval(own)[1] for own in alike) + spread if corner else _interval(best)[1]
    if not sphere:
        largest = max(_interval(own)[1] for own in felt if own.convex == best.convex)
    return Edge(
        turn_rad=turn,
        radius_m=max(best.radius_m, 0.0),
        largest_radius_m=largest,
        convex=best.convex,
        direction_rad=None if corner else float((best.across_rad + np.pi / 2) % np.pi),
        corner=corner,
    )


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


def contradicted(edge: Edge, shape: ShapeOperator | None, radius_m: float) -> bool:
    """Whether the curvature of the whole site is known, and too small for an edge to be there.

    Over a sharp edge the operator of all rolls is sharper than the fingertip: a ridge of 150 degrees is felt
    with twice the fingertip's curvature. In an inner edge it is about as hollow as the fingertip. A saddle
    may bend the way of one roll so that it looks like either.

    Parameters
    ----------
    edge : Edge
        What was found.
    shape : ShapeOperator or None
        The site's operator.
    radius_m : float
        Radius of the fingertip, metres.

    Returns
    -------
    bool
        False without an operator.
    """
    if shape is None:
        return False
    if edge.convex:
        least = min(1.0, RIDGE * edge.turn_rad) / radius_m
        return -shape.k2_per_m + TIMES_THE_ERROR * shape.k2_error_per_m < least
    return shape.k1_per_m + TIMES_THE_ERROR * shape.k1_error_per_m < 0.7 / radius_m


def _interval(own: Rounding) -> tuple[float, float]:
    """Interval (95 %) of the radius, metres; what is below 0 by error counts as 0."""
    half = TIMES_THE_ERROR * own.error_m
    return own.radius_m - half, max(own.radius_m, 0.0) + half


def _is_sharp(own: Rounding, radius_m: float) -> bool:
    """Whether a rounding is narrow, or can't be told from a sharp edge."""
    if not own.convex:
        return True
    low, high = _interval(own)
    return high <= OPEN * radius_m and (low <= 0 or own.radius_m <= SHARP * radius_m)


def _outdoes(other: Rounding, own: Rounding, radius_m: float) -> bool:
    """Whether another roll knows better that the rounding is not sharp."""
    return other.convex == own.convex and other.error_m < own.error_m and not _is_sharp(other, radius_m)


def _apart(one: Rounding, other: Rounding) -> float:
    """Angle between the directions in which two roundings turn, radians, at most pi / 2."""
    return float(abs(np.angle(np.exp(2j * (one.across_rad - other.across_rad)))) / 2)
