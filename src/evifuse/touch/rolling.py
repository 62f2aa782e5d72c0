"""Which parts of a recording are rolls, and which rolls belong to the same site: from the data alone.

All of it is our own: the chapter takes the sites and the meridian planes as commanded, here they are
measured.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import TouchRecording
from evifuse.touch.contact import ContactTrack

__all__ = ["ContactSite", "contact_intervals", "find_sites", "split_by_direction"]

SHORTEST_NS = 20_000_000
"""Contacts and gaps shorter than this are bounces, not touches and lifts: 20 ms."""
BEND = 0.15
"""A path that leaves its chord by more than this share of its extent changes direction."""
SAME_MIDDLE = 0.25
"""Rolls whose middles are closer than this share of their length cross the same site."""
SAME_SITE = 0.75
"""Rolls whose middles are further apart than this share of their length have no site in common."""
SHORTEST_ROLL = 0.12
"""A roll is at least so long, as a share of the fingertip's radius."""


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


def contact_intervals(touching: NDArray[np.bool_], time_ns: NDArray[np.int64]) -> list[tuple[int, int]]:
    """Intervals of unbroken contact, bounces smoothed away.

    Parameters
    ----------
    touching : ndarray of bool, shape (T,)
        Whether there is contact.
    time_ns : ndarray of int64, shape (T,)
        Times, nanoseconds.

    Returns
    -------
    list of (int, int)
        First and one-past-last sample of each interval.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], touching, [False]]).astype(np.int8)))
    intervals: list[tuple[int, int]] = []
    for start, stop in edges.reshape(-1, 2).tolist():
        if intervals and time_ns[start] - time_ns[intervals[-1][1] - 1] < SHORTEST_NS:
            intervals[-1] = (intervals[-1][0], stop)
        else:
            intervals.append((start, stop))
    return [(i, j) for i, j in intervals if j - i > 1 and time_ns[j - 1] - time_ns[i] >= SHORTEST_NS]


def split_by_direction(path: NDArray[np.float64], shortest: float) -> list[tuple[int, int]]:
    """Cut a path where its direction changes, reversals included.

    Parameters
    ----------
    path : ndarray of float64, shape (M, 2)
        Points in order of time, metres.
    shortest : float
        Pieces of smaller extent are left out, metres.

    Returns
    -------
    list of (int, int)
        First and one-past-last point of each straight piece.
    """
    pieces: list[tuple[int, int]] = []
    pending = [(0, len(path))]
    while pending:
        start, stop = pending.pop()
        part = path[start:stop]
        extent = float(np.linalg.norm(np.ptp(part, axis=0))) if len(part) > 2 else 0.0
        if extent < shortest:
            continue
        deviation = _distance_to_segment(part, part[0], part[-1])
        corner = int(np.argmax(deviation))
        if deviation[corner] > max(BEND * extent, 0.25 * shortest):
            pending += [(start, start + corner + 1), (start + corner, stop)]
        else:
            pieces.append((start, stop))
    return sorted(pieces)


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
    for start, stop in contact_intervals(track.touching, recording.time_ns):
        samples = start + np.flatnonzero(track.touching[start:stop])
        found = _rolls_within(recording, track, samples)
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


def _rolls_within(
    recording: TouchRecording, track: ContactTrack, samples: NDArray[np.int64]
) -> list[NDArray[np.int64]]:
    """Straight rolls of one contact interval."""
    samples = samples[track.interior[samples]]
    if len(samples) < 3:
        return []
    normal = track.normal[samples].mean(axis=0)
    first, second = tangents(normal / np.linalg.norm(normal))
    path = track.point_m[samples] + recording.fingertip.radius_m * track.normal[samples]
    flat = path @ np.stack([first, second], axis=1)
    window = max(1, len(flat) // 100)
    smooth = _moving_mean(flat, window)
    return [
        samples[start:stop]
        for start, stop in split_by_direction(smooth, SHORTEST_ROLL * recording.fingertip.radius_m)
    ]


def tangents(normal: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Axes of a tangent plane: the world's x axis projected into it, and a quarter turn on.

    Parameters
    ----------
    normal : ndarray of float64, shape (3,)
        Outward unit normal, world frame.

    Returns
    -------
    first, second : ndarray of float64, shape (3,)
        Unit vectors, world frame; ``first x second = normal``. A surface that faces along x starts from the
        world's y axis instead.
    """
    start = np.array([1.0, 0.0, 0.0]) if abs(float(normal[0])) < 0.9 else np.array([0.0, 1.0, 0.0])
    first = start - (start @ normal) * normal
    first = first / np.linalg.norm(first)
    return first, np.cross(normal, first)


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
    gap = _distance_to_segment(path, ends[j][0], ends[j][1])
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


def _moving_mean(values: NDArray[np.float64], window: int) -> NDArray[np.float64]:
    """Centred mean over up to 2 window + 1 rows."""
    total = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
    row = np.arange(len(values))
    low, high = np.maximum(row - window, 0), np.minimum(row + window + 1, len(values))
    return (total[high] - total[low]) / (high - low)[:, None]


def _distance_to_segment(
    points: NDArray[np.float64], start: NDArray[np.float64], end: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Distance of each point (M, D) to the segment from start to end (D,)."""
    chord = end - start
    squared = float(chord @ chord)
    share = np.clip((points - start) @ chord / squared, 0.0, 1.0) if squared > 0 else np.zeros(len(points))
    return np.linalg.norm(points - start - share[:, None] * chord, axis=1)
