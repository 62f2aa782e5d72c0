"""Which topics of a recording hold the touch: those that were named, the documented ones, or the only ones.

A bag of somebody else's robot holds a pose and an array of readings on topics of its own. Where the
documented topics are absent, the one topic of a fitting type is taken, and a note says so (our own).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from evifuse.errors import RecordingError, UsageError
from evifuse.recordings import messages
from evifuse.recordings.mcap_reader import Topic

__all__ = ["ARRAYS", "PARTS", "Named", "Origins", "holds_touch", "origins", "parse_topics"]

ARRAYS = {
    f"std_msgs/msg/{kind}MultiArray": code
    for kind, code in (
        ("Float32", "f4"), ("Float64", "f8"), ("Int8", "i1"), ("Int16", "i2"), ("Int32", "i4"),
        ("Int64", "i8"), ("UInt8", "u1"), ("UInt16", "u2"), ("UInt32", "u4"), ("UInt64", "u8"),
    )
}  # fmt: skip
"""Types of plain arrays, and NumPy's name of their numbers."""

_STAMPED_POSES = ("PoseStamped", "PoseWithCovarianceStamped", "TransformStamped")
PARTS = {
    "pressures": (messages.TOPIC_TYPES[messages.TAXELS], *ARRAYS),
    "pose": (
        *(f"geometry_msgs/msg/{kind}" for kind in (*_STAMPED_POSES, "Pose", "Transform")),
        "nav_msgs/msg/Odometry",
    ),
    "joint": (messages.TOPIC_TYPES[messages.FINGER_JOINT],),
}
"""Types that each part of a touch may have."""

_DOCUMENTED = {
    "pressures": messages.TAXELS,
    "pose": messages.FINGER_POSE,
    "joint": messages.FINGER_JOINT,
}

Named = Mapping[str, str]
"""Topic of ``pose``, ``pressures`` and ``joint`` (``/joint_states:wrist_3`` for one of several joints)."""


@dataclass
class Origins:
    """Where the parts of a touch are.

    Parameters
    ----------
    topics : dict of str to Topic
        By part, as far as they were found.
    joint : str
        Name of the joint, where a message names several.
    notes : list of str
        Which topics were taken, where nobody named them.
    lacking : dict of str to str
        By part, the line that says what is wrong.
    """

    topics: dict[str, Topic] = field(default_factory=dict[str, Topic])
    joint: str = messages.JOINT_NAME
    notes: list[str] = field(default_factory=list[str])
    lacking: dict[str, str] = field(default_factory=dict[str, str])


def parse_topics(text: str) -> dict[str, str]:
    """Topics as the command line names them.

    Parameters
    ----------
    text : str
        ``pose=/arm/pose,pressures=/tip/taxels,joint=/joint_states:wrist_3``, each of the three or fewer.

    Returns
    -------
    dict of str to str
        By part.

    Raises
    ------
    UsageError
        If it is not of that form.

    Examples
    --------
    >>> parse_topics("pose=/arm/pose,pressures=/tip")
    {'pose': '/arm/pose', 'pressures': '/tip'}
    """
    named: dict[str, str] = {}
    for entry in text.split(","):
        part, equals, topic = (piece.strip() for piece in entry.partition("="))
        if not equals or not topic or part not in PARTS or part in named:
            raise UsageError(f"--topics {text}: expected {','.join(f'{key}=/topic' for key in PARTS)}")
        named[part] = topic
    return named


def holds_touch(topics: Mapping[str, Topic], named: Named) -> bool:
    """Whether there is reason to look for a touch.

    Parameters
    ----------
    topics : mapping of str to Topic
        By name.
    named : mapping of str to str
        Topics that were named.

    Returns
    -------
    bool
        If pressures were named or are on the documented topic, or there is something that may be pressures
        and something that may be a pose.
    """
    if "pressures" in named or messages.TAXELS in topics:
        return True
    return bool(_fitting(topics, "pressures") and ("pose" in named or _fitting(topics, "pose")))


def origins(topics: Mapping[str, Topic], named: Named, name: str) -> Origins:
    """Find the topics of a touch.

    Parameters
    ----------
    topics : mapping of str to Topic
        By name.
    named : mapping of str to str
        Topics that were named.
    name : str
        Name of the file, for messages.

    Returns
    -------
    Origins
        With a line for each part that was not found; a joint may be absent.
    """
    found = Origins()
    for part in PARTS:
        try:
            topic = _topic(topics, part, named, found, name)
        except RecordingError as error:
            found.lacking["pressure" if part == "pressures" else part] = str(error)
        else:
            if topic is not None:
                found.topics[part] = topic
    return found


def _topic(topics: Mapping[str, Topic], part: str, named: Named, found: Origins, name: str) -> Topic | None:
    if part in named:
        key, colon, joint = named[part].partition(":") if part == "joint" else (named[part], "", "")
        found.joint = joint if colon else found.joint
        if key not in topics:
            there = ", ".join(sorted(topics)) or "none"
            raise RecordingError(f"{name}: there is no topic {key} for {part}; topics in the file: {there}")
        return topics[key]
    if _DOCUMENTED[part] in topics:
        return topics[_DOCUMENTED[part]]
    fitting = _fitting(topics, part)
    if len(fitting) == 1:
        found.notes.append(f"{name}: {part} taken from topic {fitting[0].name} ({fitting[0].kind})")
        return fitting[0]
    if part == "joint":
        return None
    if fitting:
        several = ", ".join(sorted(topic.name for topic in fitting))
        raise RecordingError(
            f"{name}: several topics may hold the {part}: {several}: choose one with "
            f"--topics {part}={fitting[0].name}"
        )
    raise RecordingError(
        f"{name}: touch needs topic {_DOCUMENTED[part]}, which is not in the file: record it too, or name "
        f"another with --topics {part}=/topic"
    )


def _fitting(topics: Mapping[str, Topic], part: str) -> list[Topic]:
    """Topics with messages that may be a part, those of the camera left out."""
    return [
        topic
        for topic in topics.values()
        if topic.kind in PARTS[part]
        and topic.data
        and topic.name != messages.CAMERA_POSE
        and (part != "joint" or _one_joint(topic))
    ]


def _one_joint(topic: Topic) -> bool:
    """Whether it is clear which joint of a ``JointState`` is meant: there is one, or one is the distal."""
    from evifuse.recordings.layout import Layout

    try:
        layout = Layout(topic.data[0])
        layout.stamp()
        count = layout.length()
        names = [layout.text(same=True) for _ in range(min(count, len(layout.data) // 5))]
    except ValueError:
        return False
    return count == 1 or messages.JOINT_NAME in names
