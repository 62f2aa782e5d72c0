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
    nearest, depth, reached = _depths(recording, touching, sites, operators)
    below = (depth > CLEARLY_BELOW * radius) & (depth < np.inf)
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


def _depths(
    recording: TouchRecording,
    touching: NDArray[np.bool_],
    sites: list[ContactSite],
    operators: list[ShapeOperator | None],
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Depth (T,) of the sphere below where the surfaces of sites would hold it, metres.

    First the site where it is least, then the least and the largest depth: infinite out of reach and with
    contact.
    """
    from evifuse.touch._kernels_sites import depths

    radius, flat = recording.fingertip.radius_m, (0.0, 0.0, 0.0)
    k1, k2, turn = np.array(
        [flat if s is None else (s.k1_per_m, s.k2_per_m, s.k1_direction_rad) for s in operators]
    ).T
    return depths(
        recording.position_m,
        touching,
        np.array([site.centre_m for site in sites]),
        np.array([np.stack([*tangents(site.normal), site.normal], axis=1) for site in sites]),
        np.stack([np.cos(turn), np.sin(turn)], axis=1),
        k1 / (1 - radius * np.minimum(k1, 0.0)),
        k2 / (1 - radius * np.minimum(k2, 0.0)),
        REACH * radius,
    )


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
