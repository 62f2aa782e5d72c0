"""Which parts of a recording are rolls: from the data alone.

All of it is our own: the chapter takes the rolling directions as commanded, here they are measured.
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.clock import gaps
from evifuse.recordings.recording import TouchRecording
from evifuse.touch.contact import ContactTrack

__all__ = ["contact_intervals", "distance_to_segment", "rolls_within", "split_by_direction", "tangents"]

SHORTEST_NS = 20_000_000
"""Contacts and gaps shorter than this are bounces, not touches and lifts: 20 ms."""
BEND = 0.08
"""A path that leaves its chord by more than this share of its extent changes direction."""
WIDE_RAD = 1.2
"""A contact whose normals leave their mean by more than this goes around something thin: 69 degrees."""
LOCAL_RAD = 1.0
"""And what is told of it is told from the part that is so near to its middle."""
SHORTEST_ROLL = 0.12
"""A roll is at least so long, as a share of the fingertip's radius."""


def contact_intervals(touching: NDArray[np.bool_], time_ns: NDArray[np.int64]) -> list[tuple[int, int]]:
    """Intervals of unbroken contact, bounces smoothed away; a gap in the recording ends an interval.

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
    after_gaps = gaps(time_ns) + 1
    for start, stop in _cut(edges.reshape(-1, 2).tolist(), after_gaps.tolist()):
        if intervals and time_ns[start] - time_ns[intervals[-1][1] - 1] < SHORTEST_NS:
            intervals[-1] = (intervals[-1][0], stop)
        else:
            intervals.append((start, stop))
    return [(i, j) for i, j in intervals if j - i > 1 and time_ns[j - 1] - time_ns[i] >= SHORTEST_NS]


def _cut(intervals: list[list[int]], at: list[int]) -> Iterator[tuple[int, int]]:
    """Intervals, in two where one of the samples ``at`` lies within."""
    for start, stop in intervals:
        yield from pairwise([start, *(i for i in at if start < i < stop), stop])


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
    from evifuse.touch._kernels_rolls import corner_of

    pieces: list[tuple[int, int]] = []
    pending = [(0, len(path))]
    while pending:
        start, stop = pending.pop()
        if stop - start < 3:
            continue
        corner, deviation, extent = corner_of(path, start, stop)
        if extent < shortest:
            continue
        if deviation > max(BEND * extent, 0.25 * shortest):
            pending += [(start, start + corner + 1), (start + corner, stop)]
        else:
            pieces.append((start, stop))
    return sorted(pieces)


def rolls_within(
    recording: TouchRecording, track: ContactTrack, samples: NDArray[np.int64]
) -> list[NDArray[np.int64]]:
    """Straight rolls of one contact interval.

    Parameters
    ----------
    recording : TouchRecording
        T samples.
    track : ContactTrack
        Its contact.
    samples : ndarray of int64, shape (M,)
        Samples of the interval.

    Returns
    -------
    list of ndarray of int64
        Samples of each roll, without those at which the contact is on the edge of the array.
    """
    from evifuse.touch._kernels_rolls import least_along, mean_of, smooth_path

    samples = samples[track.interior[samples]]
    if len(samples) < 3:
        return []
    normal = mean_of(track.normal, samples)
    normal = normal / np.linalg.norm(normal)
    first, second = tangents(normal)
    path = smooth_path(recording.position_m, samples, first, second, max(1, len(samples) // 100))
    wide = least_along(track.normal, samples, normal) < np.cos(WIDE_RAD)
    if wide:
        path = _unrolled(recording.position_m[samples], track.normal[samples], normal) @ np.stack(
            [first, second], axis=1
        )
    shortest = SHORTEST_ROLL * recording.fingertip.radius_m
    rolls = [samples[start:stop] for start, stop in split_by_direction(path, shortest)]
    return [_local(track.normal, roll) for roll in rolls] if wide else rolls


def _unrolled(
    position: NDArray[np.float64], normal: NDArray[np.float64], onto: NDArray[np.float64]
) -> NDArray[np.float64]:
    """A way (M, 3) around a strong bend laid flat: each step turned as its normal has to be turned."""
    window = max(1, len(position) // 100)
    total = np.concatenate([np.zeros((1, 6)), np.cumsum(np.concatenate([position, normal], axis=1), axis=0)])
    row = np.arange(len(position))
    low, high = np.maximum(row - window, 0), np.minimum(row + window + 1, len(position))
    smooth = (total[high] - total[low]) / (high - low)[:, None]
    step = np.diff(smooth[:, :3], axis=0)
    facing = smooth[1:, 3:] / np.linalg.norm(smooth[1:, 3:], axis=1, keepdims=True)
    half = facing + onto
    share = np.einsum("mi,mi->m", step, half) / np.maximum(1 + facing @ onto, 0.05)
    along = np.einsum("mi,mi->m", step, facing)
    flat = step - share[:, None] * half + 2 * along[:, None] * onto
    return np.concatenate([np.zeros((1, 3)), np.cumsum(flat, axis=0)])


def _local(normal: NDArray[np.float64], roll: NDArray[np.int64]) -> NDArray[np.int64]:
    """The part of a roll around a strong bend that is near its middle: what comes later is another place."""
    middle = normal[roll[int(0.45 * len(roll)) : int(0.55 * len(roll)) + 1]].sum(axis=0)
    near = normal[roll] @ (middle / np.linalg.norm(middle)) >= np.cos(LOCAL_RAD)
    return roll[near]


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
    x, y, z = normal.tolist()
    along_x = abs(x) < 0.9
    own = x if along_x else y
    p, q, r = along_x - own * x, (not along_x) - own * y, -own * z
    length = (p * p + q * q + r * r) ** 0.5
    p, q, r = p / length, q / length, r / length
    return np.array([p, q, r]), np.array([y * r - z * q, z * p - x * r, x * q - y * p])


def distance_to_segment(
    points: NDArray[np.float64], start: NDArray[np.float64], end: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Distance of points to a line segment.

    Parameters
    ----------
    points : ndarray of float64, shape (M, D)
        The points.
    start, end : ndarray of float64, shape (D,)
        Ends of the segment.

    Returns
    -------
    ndarray of float64, shape (M,)
        Distances, in the unit of the points.
    """
    chord = end - start
    squared = float(chord @ chord)
    share = np.clip((points - start) @ chord / squared, 0.0, 1.0) if squared > 0 else np.zeros(len(points))
    return np.linalg.norm(points - start - share[:, None] * chord, axis=1)
