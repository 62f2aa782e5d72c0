"""From the messages of a recording to a raw touch."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import RecordingError
from evifuse.recordings.layout import Group, Layout, grouped
from evifuse.recordings.mcap_reader import Topic
from evifuse.recordings.raw import RawTouch
from evifuse.recordings.topics import ARRAYS, PARTS, origins

__all__ = ["raw_touch"]


def raw_touch(
    topics: dict[str, Topic], name: str, damage: str = "", named: Mapping[str, str] | None = None
) -> RawTouch:
    """Touch of a recording, as it is.

    Parameters
    ----------
    topics : dict of str to Topic
        Messages by topic.
    name : str
        Name of the file, for messages.
    damage : str
        Why the rest of the file can't be read.
    named : mapping of str to str, optional
        Topics of ``pose``, ``pressures`` and ``joint`` that are not the documented ones.

    Returns
    -------
    RawTouch
        With a line for each part that is missing or can't be read.
    """
    where = origins(topics, named or {}, name)
    lacking = where.lacking
    parts: dict[str, Any] = {}
    if "joint" in where.topics and not where.topics["joint"].data:
        del where.topics["joint"]  # as if it had not been recorded
    for part, topic in where.topics.items():
        try:
            if part == "pressures":
                parts |= _taxels(topic, name)
            elif part == "pose":
                parts |= _poses(topic, name)
            else:
                parts |= _joints(topic, where.joint, name)
        except RecordingError as error:
            lacking["pressure" if part == "pressures" else part] = str(error)
    lacking = {part: lacking[part] for part in ("pressure", "pose", "joint") if part in lacking}
    called = {
        "time" if part == "pressures" else part: f"topic {topic.name}" for part, topic in where.topics.items()
    }
    return RawTouch(name, called=called, lacking=lacking, damage=damage, notes=tuple(where.notes), **parts)


def _groups(
    topic: Topic, part: str, name: str, read: Callable[[Layout], dict[str, Any]]
) -> tuple[list[Group], NDArray[np.int64]]:
    """Messages of a topic by layout, oldest first by the recorder's clock, and their times.

    The time is the stamp of the message; where there is none, that of the recorder.
    """
    key = topic.name
    if topic.kind not in PARTS[part]:
        raise RecordingError(
            f"{name}: topic {key} has type {topic.kind!r}, but {' or '.join(PARTS[part])} is expected"
        )
    if topic.encoding != "cdr":
        raise RecordingError(
            f"{name}: topic {key} is encoded as {topic.encoding!r}: record it with ROS 2 (cdr)"
        )
    if not topic.data:
        raise RecordingError(f"{name}: topic {key} has no messages (T = 0): record at least one roll")
    order = sorted(range(len(topic.data)), key=topic.log_time_ns.__getitem__)
    try:
        groups = grouped([topic.data[i] for i in order], read)
    except (ValueError, MemoryError) as error:
        raise RecordingError(f"{name}: a message on {key} is not a valid {topic.kind}") from error
    time_ns = np.zeros(len(order), dtype=np.int64)
    if all("sec" in group.fields for group in groups):
        seconds, rest = _merged(groups, "sec", 1), _merged(groups, "nanosec", 1)
        time_ns = seconds[:, 0].astype(np.int64) * 10**9 + rest[:, 0].astype(np.int64)
    if not time_ns.any():
        if max(topic.log_time_ns) >= 2**63:
            raise RecordingError(f"{name}: topic {key} has times beyond the year 2262: check the clock")
        time_ns = np.array([topic.log_time_ns[i] for i in order], dtype=np.int64)
    return groups, time_ns


def _merged(groups: Sequence[Group], key: str, count: int) -> NDArray[np.float64]:
    """A field (M, count) of all messages in order."""
    total = sum(len(group.index) for group in groups)
    merged = np.empty((total, count))
    for group in groups:
        merged[group.index] = group.values(key)
    return merged


def _stamp(layout: Layout) -> dict[str, Any]:
    sec, nanosec = layout.stamp()
    return {"sec": sec, "nanosec": nanosec}


def _poses(topic: Topic, name: str) -> dict[str, Any]:
    def read(layout: Layout) -> dict[str, Any]:
        fields = {} if topic.kind.endswith(("/Pose", "/Transform")) else _stamp(layout)
        if topic.kind.endswith(("/TransformStamped", "/Odometry")):
            layout.text()  # the moving frame
        return fields | {"pose": layout.numbers("f8", 7)}

    groups, time_ns = _groups(topic, "pose", name, read)
    return {"pose_time_ns": time_ns, "pose": _merged(groups, "pose", 7)}


def _joints(topic: Topic, joint: str, name: str) -> dict[str, Any]:
    def read(layout: Layout) -> dict[str, Any]:
        fields = _stamp(layout)
        names = [layout.text(same=True) for _ in range(_few(layout))]
        fields |= {"names": names, "angles": layout.list_of("f8")}
        layout.list_of("f8")
        layout.list_of("f8")
        return fields

    groups, time_ns = _groups(topic, "joint", name, read)
    angle = np.empty(len(time_ns))
    for group in groups:
        names, count = group.fields["names"], group.fields["angles"][1]
        if count == 1:
            column = 0
        elif joint in names and count == len(names):
            column = names.index(joint)
        else:
            raise RecordingError(f"{name}: {topic.name} needs one joint, or one named {joint!r}, not {names}")
        angle[group.index] = group.values("angles")[:, column]
    return {"joint_time_ns": time_ns, "joint_rad": angle}


def _few(layout: Layout) -> int:
    """Number of texts in a list; each takes five bytes or more."""
    count = layout.length()
    if 4 * count > len(layout.data):
        raise ValueError("the message ends too early")
    return count


def _taxels(topic: Topic, name: str) -> dict[str, Any]:
    if topic.kind in ARRAYS:
        return _plain_array(topic, name)

    def read(layout: Layout) -> dict[str, Any]:
        fields = _stamp(layout) | {"radius": layout.numbers("f8")}
        fields["unit"] = layout.text(same=True)
        fields["area"], fields["offset"] = layout.numbers("f8"), layout.numbers("f8")
        fields["positions"], fields["normals"] = layout.list_of("f8", 3), layout.list_of("f8", 3)
        fields["values"] = layout.list_of("f4")
        return fields

    groups, time_ns = _groups(topic, "pressures", name, read)
    radius, positions, normals = _geometry(groups)
    count = len(positions) or groups[0].fields["values"][1]
    _same_count(groups, count, topic.name, name)
    _same_scale(groups, topic.name, name)
    return {
        "time_ns": time_ns,
        "pressure": _merged(groups, "values", count),
        "unit": groups[0].fields["unit"],
        "area_m2": float(groups[0].values("area")[0, 0]),
        "offset": float(groups[0].values("offset")[0, 0]),
        "radius_m": radius,
        "positions_m": positions,
        "normals": normals,
    }


def _plain_array(topic: Topic, name: str) -> dict[str, Any]:
    """Readings without a unit and without a geometry, one array for each sample."""

    def read(layout: Layout) -> dict[str, Any]:
        for _ in range(_few(layout)):
            layout.text()
            layout.numbers("u4", 2)
        layout.numbers("u4")
        return {"values": layout.list_of(ARRAYS[topic.kind])}

    groups, time_ns = _groups(topic, "pressures", name, read)
    count = groups[0].fields["values"][1]
    _same_count(groups, count, topic.name, name)
    return {"time_ns": time_ns, "pressure": _merged(groups, "values", count)}


def _geometry(groups: list[Group]) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
    """Radius, positions and normals, from the first message that gives any."""
    giving = [g for g in groups if g.fields["positions"][1] or g.fields["normals"][1]]
    if not giving:
        return float("nan"), np.zeros((0, 3)), np.zeros((0, 3))
    first = min(giving, key=lambda group: int(group.index[0]))
    positions = first.values("positions")[0].astype(np.float64).reshape(-1, 3)
    normals = first.values("normals")[0].astype(np.float64).reshape(-1, 3)
    return float(first.values("radius")[0, 0]), positions, normals


def _same_count(groups: list[Group], count: int, topic: str, name: str) -> None:
    """Refuse messages with another number of values."""
    for group in groups:
        found = group.fields["values"][1]
        if found != count:
            raise RecordingError(
                f"{name}: message {group.index[0]} on {topic} has {found} values "
                f"for {count} taxels: read all of them at once"
            )


def _same_scale(groups: list[Group], topic: str, name: str) -> None:
    """Refuse messages whose values mean something else."""
    first = groups[0]
    for group in groups:
        other = np.zeros(len(group.index), dtype=np.bool_)
        for key in ("area", "offset"):
            values, wanted = group.values(key)[:, 0], first.values(key)[0, 0]
            other |= (values != wanted) & ~(np.isnan(values) & np.isnan(wanted))
        if group.fields["unit"] != first.fields["unit"]:
            other[:] = True
        if other.any():
            number = group.index[int(np.argmax(other))]
            raise RecordingError(
                f"{name}: message {number} on {topic} changes unit, area or offset: split the file"
            )
