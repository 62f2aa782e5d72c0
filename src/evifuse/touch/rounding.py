"""How sharply a roll turns: the radius of the rounding that it crosses, down to nothing (our own).

Over a rounding of radius r the centre of a fingertip of radius a runs an arc of radius r + a, less the depth
to which it is pressed in. A curvature 1/r has no end where the rounding becomes sharp; the arc has one, the
fingertip itself. So r is measured on the arc, and a sharp edge is a number like any other: 0, with an error.
The pose alone tells the arc; the normals tell how far it goes, and hold its middle where it is short.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import Fingertip, TouchRecording
from evifuse.touch.contact import ContactTrack
from evifuse.touch.curvature import NARROWEST_RAD, spread_rad
from evifuse.touch.pressed import pressed_m
from evifuse.touch.remembered import per_fingertip
from evifuse.touch.rolling import tangents
from evifuse.touch.sites import ContactSite

__all__ = ["Rounding", "roundings", "taxel_angle_rad"]

Array = NDArray[np.float64]

SMALLEST_TURN_RAD = 0.25
"""A rounding turns the normal by so much at least: 14 degrees."""
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
    tip, axes = recording.fingertip, np.stack([*tangents(site.normal), site.normal], axis=1)
    pieces = [
        _pieces((recording.position_m[roll] - site.centre_m) @ axes, track.normal[roll] @ axes)
        for roll in site.rolls
        if len(roll) > 3 * FEWEST
    ]
    bend = _bend([piece.place_m for piece in pieces])
    felt = [own for piece in pieces for own in _of_roll(piece, bend, tip.radius_m, taxel_angle_rad(tip))]
    if not any(own.convex for own in felt):
        return felt
    depth, error = pressed_m(recording, track, site)
    return [
        replace(own, radius_m=own.radius_m + depth, error_m=float(np.hypot(own.error_m, error)))
        if own.convex
        else own
        for own in felt
    ]


@dataclass(frozen=True)
class _Pieces:
    """Places (B, 3) of the finger's centre, normals (B, 3) there, and how steady the height is, metres."""

    place_m: Array
    normal: Array
    noise_m: float


def _pieces(centre_m: Array, normal: Array) -> _Pieces:
    """Means over equal pieces of a roll."""
    count = min(PIECES, len(centre_m) // 3)
    cuts = np.arange(count) * len(centre_m) // count
    size = np.diff(np.append(cuts, len(centre_m)))[:, None]
    second = float(np.median(np.abs(np.diff(centre_m[:, 2], 2)))) / (0.6745 * np.sqrt(6))
    return _Pieces(
        np.add.reduceat(centre_m, cuts) / size,
        np.add.reduceat(normal, cuts) / size,
        second / float(np.sqrt(len(centre_m) / count)),
    )


def _bend(places: list[Array]) -> Array | None:
    """How the height over the site's plane bends, a matrix (2, 2); None if rolls have one direction only."""
    ways = [place[-1, :2] - place[0, :2] for place in places]
    if not ways or spread_rad([float(np.arctan2(y, x)) for x, y in ways]) < NARROWEST_RAD:
        return None
    x, y, z = np.concatenate(places).T
    scale = max(float(np.abs([x, y]).max()), 1e-12)
    x, y = x / scale, y / scale
    rows = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
    _, _, _, xx, xy, yy = np.linalg.solve(rows.T @ rows + 1e-9 * len(x) * np.eye(6), rows.T @ z)
    return np.array([[2 * xx, xy], [xy, 2 * yy]])


def _of_roll(pieces: _Pieces, bend: Array | None, radius: float, taxel_rad: float) -> list[Rounding]:
    """Roundings of one roll of a finger of some radius, metres, if it isn't pressed in."""
    place = pieces.place_m
    across, turn, doubt = _turn(place, pieces.normal, bend)
    first, last = np.triu_indices(len(turn), 1)
    total = turn[last] - turn[first]
    turned = total >= max(SMALLEST_TURN_RAD, TAXELS * taxel_rad)
    if not turned.any():
        return []
    first, last, total = first[turned], last[turned], total[turned]
    x, z = place[:, :2] @ across, place[:, 2]
    aside = place[:, :2] @ np.array([-across[1], across[0]])
    forward = x[last] - x[first]
    chord = np.hypot(forward, z[last] - z[first])
    facing = float(np.arctan2(across[1], across[0]) % np.pi)
    found: list[Rounding] = []
    height = float(np.hypot(pieces.noise_m, STEADY * radius))
    still = chord + 2 * height <= STILL * radius * total
    if still.any():
        furthest = int(np.argmax(np.where(still, total, 0.0)))
        found.append(Rounding(0.0, float(chord[furthest]), float(total[furthest]), facing, convex=False))
    arc = (last - first >= FEWEST - 1) & (forward > 0)
    if not arc.any() or (chord / (2 * np.sin(np.minimum(total, 3.0) / 2)))[arc].min() > WIDE * radius:
        return found
    first, last, total = first[arc], last[arc], total[arc]
    second = np.percentile(np.abs(np.diff(turn, 2)), 75) / (1.15 * np.sqrt(6))
    angle = float(np.hypot(second, TAXEL_SHARE * taxel_rad))
    reach, error = _arcs(np.stack([x, z], axis=1) / radius, turn, first, last, (height / radius, angle))
    lean = angle / total if doubt is None else max(doubt, LEANING_RAD)
    leaning = np.abs(aside[last] - aside[first]) * lean / total / radius
    error = np.sqrt(error**2 + leaning**2)
    best = int(np.argmin(error))
    found.append(
        Rounding(radius * (float(reach[best]) - 1), radius * float(error[best]), float(total[best]), facing)
    )
    return found


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


def _turn(place: Array, normal: Array, bend: Array | None) -> tuple[Array, Array, float | None]:
    """Direction (2,) in which the normal turns along a roll, its angle (B,) in that plane, and a doubt.

    The poses know that direction better than the taxels: it is that of the height's bend along the way. By
    how much the taxels see it otherwise is the doubt, in radians; None where only they have seen it.
    """
    flat = normal[:, :2] - normal[:, :2].mean(axis=0)
    across = np.linalg.eigh(flat.T @ flat)[1][:, 1]
    doubt = None
    if bend is not None:
        bent = bend @ (place[-1, :2] - place[0, :2])
        bent = bent / max(float(np.linalg.norm(bent)), 1e-15)
        doubt = float(np.arccos(np.clip(abs(across @ bent), 0.0, 1.0)))
        across = bent
    if across @ (normal[-1, :2] - normal[0, :2]) < 0:
        across = -across
    return across, np.unwrap(np.arctan2(normal[:, :2] @ across, normal[:, 2])), doubt


def _arcs(
    place: Array, turn: Array, first: NDArray[np.int64], last: NDArray[np.int64], noise: tuple[float, float]
) -> tuple[Array, Array]:
    """Radii (P,) of the arcs through pieces first to last of a way (B, 2), and their standard errors.

    Two equations for each piece, linear in the circle's middle (x, z) and in R^2 - x^2 - z^2: the piece is on
    the circle (Kasa, 1976), and its normal points away from the middle. Their errors are given, as is the
    unit of length that R is close to; what is left over beyond them widens the result. Sums over stretches
    are differences of running sums.
    """
    height, aside = noise
    (x, z), one = place.T, np.ones(len(place))
    sine, cosine = np.sin(turn), np.cos(turn)
    on_circle = np.stack([2 * x, 2 * z, one, x * x + z * z], axis=1) / (2 * height)
    facing = np.stack([cosine, -sine, 0 * one, x * cosine - z * sine], axis=1) / aside
    squares = on_circle[:, :, None] * on_circle[:, None] + facing[:, :, None] * facing[:, None]
    running = np.concatenate([np.zeros((1, 4, 4)), np.cumsum(squares, axis=0)])
    summed = running[last + 1] - running[first]
    system, target, left = summed[:, :3, :3], summed[:, :3, 3], summed[:, 3, 3]
    ridge = 1e-12 * np.trace(system, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    covariance = np.linalg.inv(system + ridge)
    found = np.einsum("pij,pj->pi", covariance, target)
    free = 2 * (last - first + 1) - 3
    misfit = np.maximum((left - np.einsum("pi,pi->p", found, target)) / free, 1.0)
    middle = found[:, :2]
    radius = np.sqrt(np.maximum(found[:, 2] + np.square(middle).sum(axis=1), 1e-12))
    slope = np.concatenate([2 * middle, np.ones((len(found), 1))], axis=1) / (2 * radius[:, None])
    return radius, np.sqrt(np.einsum("pi,pij,pj->p", slope, covariance, slope)) * misfit
