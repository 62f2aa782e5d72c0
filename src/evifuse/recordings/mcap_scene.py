"""From the messages of an MCAP file to a scene."""

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import RecordingError
from evifuse.recordings import messages, rotation
from evifuse.recordings.checks import checked_touch, finite, unit
from evifuse.recordings.mcap_reader import Topic, read_raw
from evifuse.recordings.pictures import picture
from evifuse.recordings.recording import Fingertip, Scene, TouchRecording
from evifuse.recordings.units import to_pascal

__all__ = ["LONGEST_GAP_S", "read_mcap"]

LONGEST_GAP_S = 0.2
"""Poses and joint angles further apart than this are not interpolated."""


def read_mcap(path: str | os.PathLike[str], *, partial: bool = False) -> Scene:
    """Read a scene from an MCAP file.

    The first image is taken, with the camera pose nearest to it in time. Finger poses and joint angles are
    interpolated to the times of the taxels; taxel samples before the first or after the last of them are left
    out, because there it is not known where the finger was.

    Parameters
    ----------
    path : str or path-like
        The file. Topics and types are listed in `evifuse.recordings.messages`.
    partial : bool
        Accept what is whole of a file that was cut off or damaged.

    Returns
    -------
    Scene
        Image, camera and touch; None for what the file does not hold.

    Raises
    ------
    RecordingError
        If the file is damaged and ``partial`` is off, holds neither an image nor taxels, or a message is
        wrong.
    """
    name = Path(path).name
    raw = read_raw(path)
    if raw.damage and not partial:
        count = sum(len(topic.data) for topic in raw.topics.values())
        raise RecordingError(
            f"{path}: {raw.damage} after {count} messages: "
            "copy it again, or accept what is whole (partial=True)"
        )
    topics = {key: _expected(topic, name) for key, topic in raw.topics.items() if key in messages.TOPIC_TYPES}
    image, camera = picture(topics, name)
    touch = _touch(topics, name) if messages.TAXELS in topics else None
    if image is None and touch is None:
        found = ", ".join(sorted(raw.topics)) or "none"
        raise RecordingError(
            f"{path}: no messages on {messages.IMAGE} or {messages.TAXELS}; topics in the file: {found}"
        )
    return Scene(image, camera, touch, name)


def _expected(topic: Topic, name: str) -> Topic:
    expected = messages.TOPIC_TYPES[topic.name]
    if topic.kind != expected:
        raise RecordingError(
            f"{name}: topic {topic.name} has type {topic.kind!r}, but {expected} is expected"
        )
    return topic


def _touch(topics: dict[str, Topic], name: str) -> TouchRecording:
    taxels, time_ns = _stamped(topics, messages.TAXELS, name)
    poses, pose_time = _stamped(topics, messages.FINGER_POSE, name)
    joints, joint_time = _stamped(topics, messages.FINGER_JOINT, name)
    fingertip = _fingertip(taxels[0], name)
    pressure = _pressures(taxels, len(fingertip.positions_m), name)
    known = np.array([_pose(message) for message in poses])
    angle = np.array([_angle(message, name) for message in joints])
    known = finite(known, messages.FINGER_POSE, (len(poses), 7), name)
    angle = finite(angle, messages.FINGER_JOINT, (len(joints),), name)
    orientation = unit(known[:, 3:], "finger orientations", name)

    covered = (time_ns >= max(pose_time[0], joint_time[0])) & (time_ns <= min(pose_time[-1], joint_time[-1]))
    if not covered.any():
        raise RecordingError(
            f"{name}: no taxel sample lies within the times of both pose and joint: check the clocks"
        )
    time_ns, pressure = time_ns[covered], pressure[covered]
    origin = time_ns[0]
    at = _seconds(time_ns, origin)
    pose_at, joint_at = _seconds(pose_time, origin), _seconds(joint_time, origin)
    _refuse_gaps(pose_at, at, messages.FINGER_POSE, name)
    _refuse_gaps(joint_at, at, messages.FINGER_JOINT, name)
    position = np.stack([np.interp(at, pose_at, known[:, axis]) for axis in range(3)], axis=-1)
    turned = rotation.interpolate(pose_at, orientation, at)
    rolled = np.interp(at, joint_at, angle)
    return checked_touch(TouchRecording(fingertip, time_ns, position, turned, rolled, pressure, name))


def _stamped(topics: dict[str, Topic], key: str, name: str) -> tuple[list[Any], NDArray[np.int64]]:
    """Messages of a topic and their times, oldest first."""
    if key not in topics:
        raise RecordingError(f"{name}: touch needs topic {key}, which is not in the file: record it too")
    found = topics[key].decoded(name)
    if not found:
        raise RecordingError(f"{name}: topic {key} has no messages (T = 0): record at least one roll")
    stamps = [message.header.stamp.sec * 10**9 + message.header.stamp.nanosec for message in found]
    time_ns = np.array(stamps if any(stamps) else topics[key].log_time_ns, dtype=np.int64)
    order = np.argsort(time_ns, kind="stable")
    time_ns = time_ns[order]
    twice = np.flatnonzero(np.diff(time_ns) == 0)
    if len(twice):
        raise RecordingError(
            f"{name}: topic {key} has two messages at time {time_ns[twice[0]]} ns: remove one"
        )
    return [found[i] for i in order], time_ns


def _fingertip(first: Any, name: str) -> Fingertip:
    positions = np.array([(p.x, p.y, p.z) for p in first.positions]).reshape(-1, 3)
    normals = np.array([(n.x, n.y, n.z) for n in first.normals]).reshape(-1, 3)
    if len(positions) == 0 or len(normals) != len(positions):
        raise RecordingError(
            f"{name}: the first message on {messages.TAXELS} gives {len(positions)} taxel positions and "
            f"{len(normals)} normals: it must give the fingertip's geometry"
        )
    return Fingertip(first.radius, positions, normals)


def _pressures(taxels: list[Any], count: int, name: str) -> NDArray[np.float64]:
    for i, message in enumerate(taxels):
        if len(message.values) != count:
            raise RecordingError(
                f"{name}: message {i} on {messages.TAXELS} has {len(message.values)} values "
                f"for {count} taxels: read all of them at once"
            )
        if (message.unit, message.area, message.offset) != (taxels[0].unit, taxels[0].area, taxels[0].offset):
            raise RecordingError(
                f"{name}: message {i} on {messages.TAXELS} changes unit, area or offset: split the file"
            )
    values = np.array([message.values for message in taxels], dtype=np.float64)
    return to_pascal(values, taxels[0].unit, taxels[0].area, taxels[0].offset, name)


def _pose(message: Any) -> tuple[float, ...]:
    p, q = message.pose.position, message.pose.orientation
    return (p.x, p.y, p.z, q.x, q.y, q.z, q.w)


def _angle(message: Any, name: str) -> float:
    names, positions = list(message.name), message.position
    if len(positions) == 1:
        return float(positions[0])
    if messages.JOINT_NAME in names and len(positions) == len(names):
        return float(positions[names.index(messages.JOINT_NAME)])
    raise RecordingError(
        f"{name}: {messages.FINGER_JOINT} needs one joint, or one named {messages.JOINT_NAME!r}, not {names}"
    )


def _seconds(time_ns: NDArray[np.int64], origin: np.int64) -> NDArray[np.float64]:
    return (time_ns - origin).astype(np.float64) * 1e-9


def _refuse_gaps(known: NDArray[np.float64], at: NDArray[np.float64], topic: str, name: str) -> None:
    """Interpolating over a long silence would invent where the finger was."""
    if len(known) < 2:
        return
    gap = np.diff(known)
    before = np.clip(np.searchsorted(known, at, side="right") - 1, 0, len(gap) - 1)
    inside = (known[before] < at) & (at < known[before + 1])
    bad = np.flatnonzero(inside & (gap[before] > LONGEST_GAP_S))
    if len(bad):
        raise RecordingError(
            f"{name}: topic {topic} is silent for {gap[before[bad[0]]]:.2f} s around {at[bad[0]]:.2f} s, "
            f"longer than {LONGEST_GAP_S} s: record it more often"
        )
