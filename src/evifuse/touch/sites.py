"""Which rolls belong to the same site: from where they were (our own)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import TouchRecording
from evifuse.touch.contact import ContactTrack
from evifuse.touch.rolling import contact_intervals, distance_to_segment, gaps, rolls_within

__all__ = ["ContactSite", "find_sites"]

SAME_MIDDLE = 0.2
"""Rolls whose middles are closer than this share of their length cross the same site."""
BRIDGE = 0.04
"""A finger that leaves its straight way by less than this share of its radius was not lifted."""
LONGEST_BRIDGE_NS = 500_000_000
"""Half a second without pressure is the end of a contact."""
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
    for start, stop in _bridged(recording, contact_intervals(track.touching, recording.time_ns)):
        samples = start + np.flatnonzero(track.touching[start:stop])
        found = rolls_within(recording, track, samples)
        rolls += found
        if not found:
            still.append(samples)
    sites = [_site(recording, track, [rolls[i] for i in group]) for group in _groups(recording, rolls)]
    radius = recording.fingertip.radius_m
    for samples in still:
        site = _site(recording, track, [samples])
        if all(np.linalg.norm(site.centre_m - other.centre_m) > 0.5 * radius for other in sites):
            sites.append(ContactSite(site.centre_m, site.normal, ()))
    return sorted(sites, key=lambda site: int(site.rolls[0][0]) if site.rolls else len(recording.time_ns))


def _bridged(recording: TouchRecording, intervals: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Contacts between which the finger went straight on: there was no lift, taxels are far apart."""
    joined: list[tuple[int, int]] = []
    after_gaps = gaps(recording.time_ns)
    for start, stop in intervals:
        if joined:
            before = joined[-1][1] - 1
            way = recording.position_m[before : start + 1]
            brief = recording.time_ns[start] - recording.time_ns[before] < LONGEST_BRIDGE_NS
            whole = not np.any((after_gaps >= before) & (after_gaps < start))
            if brief and whole:
                aside = distance_to_segment(way, way[0], way[-1])
                middle = np.sort(aside)[int(0.9 * (len(aside) - 1))]  # a few samples may be noise
                if middle < BRIDGE * recording.fingertip.radius_m:
                    joined[-1] = (joined[-1][0], stop)
                    continue
        joined.append((start, stop))
    return joined


def _groups(recording: TouchRecording, rolls: list[NDArray[np.int64]]) -> list[list[int]]:
    """Rolls of the same site.

    Rolls through a site have their middles there. Those that are left with one direction, such as rays that
    start at their site, join the rolls that they cross or share an end with.
    """
    ends = [recording.position_m[roll[[0, -1]]] for roll in rolls]
    middles = [_middle(recording, roll) for roll in rolls]
    every = range(len(rolls))
    apart = np.array(
        [[np.linalg.norm(middles[i] - middles[j]) / _length(ends, i, j) for j in every] for i in every]
    )
    groups = _linked([[float(apart[i, j]) < SAME_MIDDLE for j in every] for i in every])
    label = {roll: number for number, group in enumerate(groups) for roll in group}
    headings = [end[1] - end[0] for end in ends]
    settled = [_is_star([headings[i] for i in groups[label[roll]]]) for roll in every]
    return _linked(
        [
            [
                label[i] == label[j]
                or (not (settled[i] and settled[j]) and float(apart[i, j]) < SAME_SITE and _cross(ends, i, j))
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
    path = recording.position_m[roll]
    along = (path - path[0]) @ (path[-1] - path[0])
    near = np.argsort(np.abs(along - 0.5 * along[-1]), kind="stable")[: max(1, len(roll) // 20)]
    return path[near].mean(axis=0)


def _site(recording: TouchRecording, track: ContactTrack, rolls: list[NDArray[np.int64]]) -> ContactSite:
    """Where the rolls cross: least squares over their lines, their middles where that is undecided."""
    middles = np.array([_middle(recording, roll) for roll in rolls])
    mean = middles.mean(axis=0)
    system, target = 0.05 * np.eye(3), np.zeros(3)
    for roll, middle in zip(rolls, middles, strict=True):
        chord = recording.position_m[roll[-1]] - recording.position_m[roll[0]]
        chord = chord / max(float(np.linalg.norm(chord)), 1e-12)
        across = np.eye(3) - np.outer(chord, chord)
        system += across
        target += across @ (middle - mean)
    centre = mean + np.linalg.solve(system, target)
    samples = np.concatenate(rolls)
    distance = np.linalg.norm(recording.position_m[samples] - centre, axis=1)
    near = samples[distance <= np.percentile(distance, 10)]
    normal = track.normal[near].sum(axis=0)
    return ContactSite(centre, normal / np.linalg.norm(normal), tuple(rolls))
