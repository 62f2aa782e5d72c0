"""Which rolls belong to the same site: from where they were (our own)."""

from dataclasses import dataclass
from itertools import pairwise
from math import hypot

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import TouchRecording
from evifuse.touch.contact import ContactTrack
from evifuse.touch.rolling import contact_intervals, distance_to_segment, gaps, rolls_within

__all__ = ["ContactSite", "find_sites"]

SAME_MIDDLE = 0.2
"""Rolls whose middles are closer than this share of their length cross the same site."""
BRIDGE = 0.04
"""A finger that leaves its way by less than this share of its radius was not lifted."""
AROUND = 8
"""Over so many samples the normal at the end of a contact is averaged."""
MOST_OF_IT = 0.9
"""So much of its way counts: a few samples may be noise."""
LONGEST_BRIDGE_NS = 500_000_000
"""Half a second without pressure is the end of a contact."""
LONGEST_JUMP_NS = 300_000_000
"""A finger that loses contact while it rolls is back after less than that: 0.3 s."""
KEPT_WAY = 0.9
"""Cosine of how much its way may turn meanwhile."""
SAME_SITE = 0.75
"""Rolls whose middles are further apart than this share of their length have no site in common."""


@dataclass(frozen=True)
class ContactSite:
    """A place that was touched, with the rolls over it.

    Parameters
    ----------
    centre_m : ndarray of float64, shape (3,)
        Where the sphere's centre is over the site, world frame, metres.
    normal : ndarray of float64, shape (3,)
        Outward unit normal of the surface there, world frame.
    rolls : tuple of ndarray of int64
        Samples of each roll, in order of time; empty if the finger touched without rolling.
    """

    centre_m: NDArray[np.float64]
    normal: NDArray[np.float64]
    rolls: tuple[NDArray[np.int64], ...]


def find_sites(recording: TouchRecording, track: ContactTrack) -> list[ContactSite]:
    """Rolls of a recording, grouped into the sites they cross.

    Parameters
    ----------
    recording : TouchRecording
        T samples.
    track : ContactTrack
        Its contact.

    Returns
    -------
    list of ContactSite
        In the order in which they were first touched; empty without contact.
    """
    rolls: list[NDArray[np.int64]] = []
    still: list[NDArray[np.int64]] = []
    for start, stop in _bridged(recording, track, contact_intervals(track.touching, recording.time_ns)):
        samples = start + np.flatnonzero(track.touching[start:stop])
        found = rolls_within(recording, track, samples)
        rolls += found
        if not found:
            still.append(samples)
    middles = np.array([_middle(recording, roll) for roll in rolls])
    sites = [
        _site(recording, track, [rolls[i] for i in group], middles[group])
        for group in _groups(recording, rolls, middles)
    ]
    radius = recording.fingertip.radius_m
    for samples in still:
        site = _site(recording, track, [samples], _middle(recording, samples)[None])
        if all(_apart(site, other, radius) > 0.5 * radius for other in sites):
            sites.append(ContactSite(site.centre_m, site.normal, ()))
    return sorted(sites, key=lambda site: int(site.rolls[0][0]) if site.rolls else len(recording.time_ns))


def _apart(one: ContactSite, other: ContactSite, radius_m: float) -> float:
    """Distance of two sites, of the finger's centres or of what it touches, whichever is less, metres."""
    touched = [site.centre_m - radius_m * site.normal for site in (one, other)]
    return float(min(np.linalg.norm(one.centre_m - other.centre_m), np.linalg.norm(touched[0] - touched[1])))


def _bridged(
    recording: TouchRecording, track: ContactTrack, intervals: list[tuple[int, int]]
) -> list[tuple[int, int]]:
    """Contacts between which the finger rolled on: there was no lift, taxels are far apart."""
    from evifuse.touch._kernels_rolls import off_the_arc

    joined: list[tuple[int, int]] = []
    after_gaps = gaps(recording.time_ns)
    for start, stop in intervals:
        if joined:
            before = joined[-1][1] - 1
            brief = recording.time_ns[start] - recording.time_ns[before] < LONGEST_BRIDGE_NS
            if brief and not np.any((after_gaps >= before) & (after_gaps < start)):
                if _goes_on(recording, joined[-1][0], before, start, stop - 1):
                    joined[-1] = (joined[-1][0], stop)
                    continue
                aside = off_the_arc(
                    recording.position_m, track.normal, track.touching, before, start, AROUND, MOST_OF_IT
                )
                if aside < BRIDGE * recording.fingertip.radius_m:
                    joined[-1] = (joined[-1][0], stop)
                    continue
        joined.append((start, stop))
    return joined


def _goes_on(recording: TouchRecording, first: int, before: int, start: int, last: int) -> bool:
    """Whether a finger that lost contact for a moment kept its way and speed: a jump is no new roll."""
    time_ns, place = recording.time_ns, recording.position_m
    if time_ns[start] - time_ns[before] > LONGEST_JUMP_NS:
        return False
    reach = 2 * LONGEST_JUMP_NS // 3
    early = max(first, int(np.searchsorted(time_ns, time_ns[before] - reach)))
    late = min(last, int(np.searchsorted(time_ns, time_ns[start] + reach)))
    if not early < before < start < late:
        return False
    rows = [early, before, start, late]
    point: list[list[float]] = place[rows].tolist()
    times: list[int] = time_ns[rows].tolist()
    ways = [[q - p for p, q in zip(a, b, strict=True)] for a, b in pairwise(point)]
    length = [hypot(*way) for way in ways]
    speed = [way / (b - a) for way, (a, b) in zip(length, pairwise(times), strict=True)]
    if min(speed) < 0.5 * max(speed) or min(length) == 0:
        return False
    return all(
        sum(p * q for p, q in zip(ways[i], ways[j], strict=True)) > KEPT_WAY * length[i] * length[j]
        for i, j in ((0, 1), (0, 2), (1, 2))
    )


def _groups(
    recording: TouchRecording, rolls: list[NDArray[np.int64]], middles: NDArray[np.float64]
) -> list[list[int]]:
    """Rolls of the same site.

    Rolls through a site have their middles there. Those that are left with one direction, such as rays that
    start at their site, join the rolls that they cross or share an end with.
    """
    if not rolls:
        return []
    ends, every = [recording.position_m[roll[[0, -1]]] for roll in rolls], range(len(rolls))
    length = np.array([np.linalg.norm(end[1] - end[0]) for end in ends])
    gap = np.sqrt(np.square(middles[:, None] - middles).sum(axis=2))
    near = gap / (0.5 * (length[:, None] + length))
    apart: list[list[float]] = near.tolist()
    groups = _linked((near < SAME_MIDDLE).tolist())
    label = {roll: number for number, group in enumerate(groups) for roll in group}
    headings = [end[1] - end[0] for end in ends]
    settled = [_is_star([headings[i] for i in groups[label[roll]]]) for roll in every]
    return _linked(
        [
            [
                label[i] == label[j]
                or (not (settled[i] and settled[j]) and apart[i][j] < SAME_SITE and _cross(ends, i, j))
                for j in every
            ]
            for i in every
        ]
    )


def _linked(link: list[list[bool]]) -> list[list[int]]:
    """Connected groups of a symmetric relation, each in order."""
    groups: list[list[int]] = []
    for index in range(len(link)):
        joined = [g for g in groups if any(link[index][other] for other in g)]
        groups = [g for g in groups if g not in joined] + [sorted(sum(joined, [index]))]
    return sorted(groups)


def _is_star(headings: list[NDArray[np.float64]]) -> bool:
    """Whether lines point in clearly different directions: 11 degrees or more."""
    units = np.array([h / np.linalg.norm(h) for h in headings])
    return bool(np.abs(units @ units.T).min() < 0.98)


def _length(ends: list[NDArray[np.float64]], i: int, j: int) -> float:
    """Mean length of two rolls, metres."""
    return 0.5 * float(sum(np.linalg.norm(ends[k][1] - ends[k][0]) for k in (i, j)))


def _cross(ends: list[NDArray[np.float64]], i: int, j: int) -> bool:
    """Whether two rolls come close to each other somewhere."""
    path = ends[i][0] + np.linspace(0.0, 1.0, 33)[:, None] * (ends[i][1] - ends[i][0])
    gap = distance_to_segment(path, ends[j][0], ends[j][1])
    return float(gap.min()) < SAME_MIDDLE * _length(ends, i, j)


def _middle(recording: TouchRecording, roll: NDArray[np.int64]) -> NDArray[np.float64]:
    """Middle of a roll along its way, however long it stood still at an end."""
    from evifuse.touch._kernels_rolls import middle_of

    return middle_of(recording.position_m, roll, 20)


def _site(
    recording: TouchRecording,
    track: ContactTrack,
    rolls: list[NDArray[np.int64]],
    middles: NDArray[np.float64],
) -> ContactSite:
    """Where the rolls cross: least squares over their lines, their middles where that is undecided."""
    from evifuse.touch._kernels_rolls import normal_near

    mean = middles.mean(axis=0)
    ways = np.array([recording.position_m[roll[-1]] - recording.position_m[roll[0]] for roll in rolls])
    chords = ways / np.maximum(np.sqrt(np.square(ways).sum(axis=1, keepdims=True)), 1e-12)
    across = np.eye(3) - chords[:, :, None] * chords[:, None, :]
    target = np.einsum("rij,rj->i", across, middles - mean)
    centre = mean + np.linalg.solve(0.05 * np.eye(3) + across.sum(axis=0), target)
    normal = normal_near(recording.position_m, track.normal, np.concatenate(rolls), centre, 0.1)
    return ContactSite(centre, normal / np.linalg.norm(normal), tuple(rolls))
