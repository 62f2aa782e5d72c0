"""Sites without contact: where the finger went through the place of a surface and met nothing (our own)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings import rotation
from evifuse.recordings.recording import TouchRecording
from evifuse.touch.curvature import ShapeOperator
from evifuse.touch.rolling import contact_intervals, tangents
from evifuse.touch.sites import ContactSite

__all__ = ["MissedSite", "missed_sites"]

CLEARLY_BELOW = 0.2
"""How far below the expected surface the finger must go, as a share of its radius."""
REACH = 10.0
"""How far from a touched site its surface is expected to go on, in radii of the fingertip."""
UNREFERENCED_BELIEF = 0.8
"""Belief in no contact where no surface is known well enough to measure the depth from, at most."""
DWELL_NS, DWELL_BLOCK_NS = 150_000_000, 20_000_000
"""A finger that was lowered in vain stays so long, as means over the shorter time tell."""
STILL = 0.05
"""It stays where it moves by less than this share of its radius in such a time."""
FAMILIAR = 4.0
"""Nearer than this to a touched site, in radii of the fingertip, its fitted surface says what to expect."""
APPROACH_NS = 1_000_000_000
"""So long before and after it is looked for how high it was."""


@dataclass(frozen=True)
class MissedSite:
    """A place where a surface was expected and none was met.

    Parameters
    ----------
    position_m : ndarray of float64, shape (3,)
        Point of the expected surface, world frame, metres; where the fingertip was lowest if nothing was
        touched.
    normal : ndarray of float64, shape (3,)
        Its expected outward unit normal, world frame.
    depth_m : float or None
        How far below it the fingertip went, metres; None if nothing was touched.
    belief : float
        Belief that there is no surface: ``1 - exp(-depth / (0.2 a))``, or 0.8 if nothing was touched.
    first_sample : int
        First sample at which the fingertip was below.
    """

    position_m: NDArray[np.float64]
    normal: NDArray[np.float64]
    depth_m: float | None
    belief: float
    first_sample: int


def missed_sites(
    recording: TouchRecording,
    touching: NDArray[np.bool_],
    sites: list[ContactSite],
    operators: list[ShapeOperator | None],
) -> list[MissedSite]:
    """Find the sites without contact.

    A lift between rolls stays above the surface. A site was missed where the finger, without contact, stayed
    for 20 ms or more clearly below both the tangent plane and the fitted surface of every touched site within
    reach. It was missed as well, though that is believed to 0.8 at most, where the finger was lowered far
    from every touched site, stayed for 150 ms without contact, and was lifted again, if that was clearly
    below the level, the tangent plane or the fitted surface of one of them: what touched sites say of a far
    place may be wrong.

    Parameters
    ----------
    recording : TouchRecording
        T samples.
    touching : ndarray of bool, shape (T,)
        Whether there is contact.
    sites : list of ContactSite
        The touched sites.
    operators : list of ShapeOperator or None
        Curvature of each, where it is known.

    Returns
    -------
    list of MissedSite
        In order of time. Without any contact, one: the whole recording.
    """
    radius = recording.fingertip.radius_m
    if not sites:
        lowest = int(np.argmin(recording.position_m[:, 2]))
        up = np.array([0.0, 0.0, 1.0])
        return [MissedSite(recording.position_m[lowest] - radius * up, up, None, UNREFERENCED_BELIEF, lowest)]
    free, depths = np.flatnonzero(~touching), np.full((len(touching), len(sites)), np.inf)
    for number, (site, shape) in enumerate(zip(sites, operators, strict=True)):
        depths[free, number] = _depth(recording.position_m[free], site, shape, radius)
    nearest = np.argmin(depths, axis=1)
    depth = depths[np.arange(len(depths)), nearest]
    below = ~touching & np.isfinite(depth) & (depth > CLEARLY_BELOW * radius)
    missed: list[MissedSite] = []
    for start, stop in contact_intervals(below, recording.time_ns):
        if _interrupted(touching[start:stop], recording.time_ns[start:stop]):
            continue
        samples = start + np.flatnonzero(below[start:stop])
        normal = sites[int(nearest[samples[np.argmax(depth[samples])]])].normal
        surface = recording.position_m[samples] + (depth[samples, None] - radius) * normal
        deepest = float(depth[samples].max())
        belief = float(1 - np.exp(-deepest / (CLEARLY_BELOW * radius)))
        missed.append(MissedSite(np.median(surface, axis=0), normal, deepest, belief, start))
    missed = _merged(missed, radius)
    reached = np.where(np.isfinite(depths), depths, -np.inf).max(axis=1)
    for dip in _lowered_in_vain(recording, touching, sites, reached):
        if all(np.linalg.norm(dip.position_m - site.position_m) > 2 * radius for site in missed):
            missed.append(dip)
    return sorted(missed, key=lambda site: site.first_sample)


def _lowered_in_vain(
    recording: TouchRecording,
    touching: NDArray[np.bool_],
    sites: list[ContactSite],
    reached_m: NDArray[np.float64],
) -> list[MissedSite]:
    """Where the finger was lowered, stayed without contact, and was lifted again.

    What was reached is the depth (T,) below the surface that some touched site makes one expect, metres.
    """
    radius, time = recording.fingertip.radius_m, recording.time_ns
    facing = recording.fingertip.normals.mean(axis=0)
    found: list[MissedSite] = []
    for start, stop in _dwells(recording, touching):
        turned = rotation.rotate(recording.orientation_xyzw[start:stop], facing).mean(axis=0)
        up = -turned / np.linalg.norm(turned)
        centre = np.median(recording.position_m[start:stop], axis=0)
        if min(float(np.linalg.norm(site.centre_m - centre)) for site in sites) < FAMILIAR * radius:
            continue
        heights = (recording.position_m - centre) @ up
        drops: list[float] = []
        for near in (
            np.flatnonzero((time >= time[start] - APPROACH_NS) & (time < time[start]))[::-1],
            np.flatnonzero((time > time[stop - 1]) & (time <= time[stop - 1] + APPROACH_NS)),
        ):
            met = np.flatnonzero(touching[near])
            free = near[: met[0]] if len(met) else near
            drops.append(float(heights[free].max(initial=0.0)))
        level = max(float((s.centre_m - centre) @ up) for s in sites)
        depth = max(level, float(np.median(reached_m[start:stop])))
        if min(drops) > CLEARLY_BELOW * radius and depth > CLEARLY_BELOW * radius:
            belief = UNREFERENCED_BELIEF * float(
                1 - np.exp(-min(min(drops), depth) / (CLEARLY_BELOW * radius))
            )
            found.append(MissedSite(centre - radius * up, up, depth, belief, start))
    return _merged(found, radius)


def _dwells(recording: TouchRecording, touching: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Stretches without contact in which the finger stayed in its place."""
    time = recording.time_ns
    usual = max(float(np.median(np.diff(time)[:: max(1, len(time) // 1000)])), 1.0) if len(time) > 1 else 1.0
    size = max(1, round(DWELL_BLOCK_NS / usual))
    starts = np.arange(0, len(time), size)
    if len(starts) < 3:
        return []
    count = np.diff(np.append(starts, len(time)))
    mean = np.add.reduceat(recording.position_m, starts, axis=0) / count[:, None]
    free = np.add.reduceat(touching, starts) == 0
    still = np.linalg.norm(np.diff(mean, axis=0), axis=1) < STILL * recording.fingertip.radius_m
    still &= free[1:] & free[:-1]
    edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(np.int8), [0]])))
    stretches = [
        (int(starts[b]), int(starts[e] + count[e])) for b, e in zip(edges[::2], edges[1::2], strict=True)
    ]
    return [(b, e) for b, e in stretches if time[e - 1] - time[b] >= DWELL_NS]


def _depth(
    position_m: NDArray[np.float64], site: ContactSite, shape: ShapeOperator | None, radius: float
) -> NDArray[np.float64]:
    """Depth of the sphere below where a site's surface would hold it, metres; infinite out of reach."""
    frame = np.stack([*tangents(site.normal), site.normal], axis=1)
    place = (position_m - site.centre_m) @ frame
    expected = np.zeros(len(place))
    if shape is not None:
        turn = shape.k1_direction_rad
        first = place[:, 0] * np.cos(turn) + place[:, 1] * np.sin(turn)
        second = place[:, 1] * np.cos(turn) - place[:, 0] * np.sin(turn)
        k1, k2 = (k / (1 - radius * min(k, 0.0)) for k in (shape.k1_per_m, shape.k2_per_m))
        expected = np.minimum(0.5 * (k1 * first**2 + k2 * second**2), 0.0)
    within = np.hypot(place[:, 0], place[:, 1]) <= REACH * radius
    return np.where(within, expected - place[:, 2], np.inf)


def _interrupted(touching: NDArray[np.bool_], time_ns: NDArray[np.int64]) -> bool:
    """Whether the finger met something on the way after all."""
    return bool(contact_intervals(touching, time_ns)) or bool(touching.mean() > 0.5)


def _merged(missed: list[MissedSite], radius_m: float) -> list[MissedSite]:
    """Passes through the same place are one site, with the depth of the deepest."""
    kept: list[MissedSite] = []
    for site in missed:
        near = [k for k in kept if np.linalg.norm(k.position_m - site.position_m) < radius_m]
        if not near:
            kept.append(site)
        elif (site.depth_m or 0.0) > (near[0].depth_m or 0.0):
            position, first = near[0].position_m, near[0].first_sample
            deeper = MissedSite(position, site.normal, site.depth_m, site.belief, first)
            kept = [deeper if k is near[0] else k for k in kept]
    return kept
