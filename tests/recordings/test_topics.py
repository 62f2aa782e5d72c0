"""Bags of other robots: topics of their own, plain arrays, no joint."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.rosbag2 import StoragePlugin, Writer

from evifuse.errors import RecordingError, UsageError
from evifuse.recordings import messages, read_scene, read_touch
from evifuse.recordings.topics import ARRAYS, PARTS, parse_topics
from tests.recordings.made import assert_same_touch, made_touch

TOUCH = made_touch()
TIP = TOUCH.fingertip
STORE = messages.typestore()


def array(values: np.ndarray, kind: str):
    """A plain array, with a layout that names one dimension."""
    types = STORE.types
    dim = types["std_msgs/msg/MultiArrayDimension"](label="taxel", size=len(values), stride=len(values))
    layout = types["std_msgs/msg/MultiArrayLayout"](dim=[dim], data_offset=0)
    return types[kind](layout=layout, data=values.astype(ARRAYS[kind]))


def pose(kind: str, i: int):
    """A pose of the made recording, in any of the types."""
    types, time_ns = STORE.types, int(TOUCH.time_ns[i])
    stamped = messages.pose_message(time_ns, TOUCH.position_m[i], TOUCH.orientation_xyzw[i])
    place, turn = stamped.pose.position, stamped.pose.orientation
    vector = types["geometry_msgs/msg/Vector3"](x=place.x, y=place.y, z=place.z)
    transform = types["geometry_msgs/msg/Transform"](translation=vector, rotation=turn)
    spread = types["geometry_msgs/msg/PoseWithCovariance"](pose=stamped.pose, covariance=np.zeros(36))
    still = types["geometry_msgs/msg/Twist"](linear=vector, angular=vector)
    moving = types["geometry_msgs/msg/TwistWithCovariance"](twist=still, covariance=np.zeros(36))
    name = kind.rpartition("/")[2]
    return {
        "PoseStamped": lambda: stamped,
        "Pose": lambda: stamped.pose,
        "Transform": lambda: transform,
        "TransformStamped": lambda: types[kind](
            header=stamped.header, child_frame_id="tip", transform=transform
        ),
        "PoseWithCovarianceStamped": lambda: types[kind](header=stamped.header, pose=spread),
        "Odometry": lambda: types[kind](
            header=stamped.header, child_frame_id="tip", pose=spread, twist=moving
        ),
    }[name]()


def angles(i: int, joints: list[str]):
    """Joint angles, the last one that of the made recording."""
    position = np.zeros(len(joints))
    position[-1] = TOUCH.joint_angle_rad[i]
    return STORE.types["sensor_msgs/msg/JointState"](
        header=messages.header(int(TOUCH.time_ns[i]), "base"),
        name=joints,
        position=position,
        velocity=np.empty(0),
        effort=np.empty(0),
    )


def bag(folder: Path, topics: dict, plugin: StoragePlugin = StoragePlugin.MCAP) -> Path:
    """A bag with ``topic: (type, message of sample i)``."""
    with Writer(folder, version=9, storage_plugin=plugin) as writer:
        links = {t: writer.add_connection(t, kind, typestore=STORE) for t, (kind, _) in topics.items()}
        for i, time_ns in enumerate(TOUCH.time_ns.tolist()):
            for topic, (kind, message) in topics.items():
                writer.write(links[topic], time_ns, STORE.serialize_cdr(message(i), kind))
    return folder


def pressures(kind: str = "std_msgs/msg/Float64MultiArray"):
    return kind, lambda i: array(TOUCH.pressure_pa[i] / 1000, kind)


def poses(kind: str = "geometry_msgs/msg/PoseStamped"):
    return kind, lambda i: pose(kind, i)


def without_joint(read):
    assert not read.has_joint
    return replace(read, joint_angle_rad=TOUCH.joint_angle_rad)


@pytest.mark.parametrize("plugin", list(StoragePlugin))
def test_a_plain_bag_is_read_and_says_what_was_taken(tmp_path, plugin):
    folder = bag(tmp_path / "bag", {"/arm/pose": poses(), "/tip/raw": pressures()}, plugin)
    read = read_touch(folder, fingertip=TIP, unit="kPa")
    assert_same_touch(without_joint(read), TOUCH)
    assert read.notes[:2] == (
        "bag: pressures taken from topic /tip/raw (std_msgs/msg/Float64MultiArray)",
        "bag: pose taken from topic /arm/pose (geometry_msgs/msg/PoseStamped)",
    )


@pytest.mark.parametrize("kind", PARTS["pose"])
def test_every_type_of_a_pose(tmp_path, kind):
    folder = bag(tmp_path / "bag", {"/arm/pose": poses(kind), "/tip": pressures()})
    assert_same_touch(without_joint(read_touch(folder, fingertip=TIP, unit="kPa")), TOUCH)


@pytest.mark.parametrize("kind", ARRAYS)
def test_every_type_of_an_array(tmp_path, kind):
    values = (TOUCH.pressure_pa / 1000).astype(ARRAYS[kind])
    folder = bag(tmp_path / "bag", {"/a": poses(), "/b": (kind, lambda i: array(values[i], kind))})
    read = read_touch(folder, fingertip=TIP, unit="kPa")
    np.testing.assert_allclose(read.pressure_pa, values.astype(float) * 1000, rtol=1e-6)


def test_a_joint_among_several(tmp_path):
    arm = {"/joint_states": ("sensor_msgs/msg/JointState", lambda i: angles(i, ["wrist_1", "wrist_2"]))}
    folder = bag(tmp_path / "bag", {"/arm/pose": poses(), "/tip": pressures()} | arm)
    assert not read_touch(folder, fingertip=TIP, unit="kPa").has_joint  # nobody said which
    named = {"joint": "/joint_states:wrist_2"}
    assert_same_touch(read_touch(folder, fingertip=TIP, unit="kPa", topics=named), TOUCH)
    with pytest.raises(RecordingError, match=r"one named 'wrist_9', not \['wrist_1', 'wrist_2'\]"):
        read_touch(folder, fingertip=TIP, unit="kPa", topics={"joint": "/joint_states:wrist_9"})
    alone = {"/j": ("sensor_msgs/msg/JointState", lambda i: angles(i, ["wrist"]))}
    folder = bag(tmp_path / "one", {"/arm/pose": poses(), "/tip": pressures()} | alone)
    assert_same_touch(read_touch(folder, fingertip=TIP, unit="kPa"), TOUCH)


def test_what_is_not_clear_is_asked_for(tmp_path):
    other = {"/object/pose": poses()}
    folder = bag(tmp_path / "bag", {"/arm/pose": poses(), "/tip": pressures()} | other)
    with pytest.raises(RecordingError, match="several topics may hold the pose: /arm/pose, /object/pose"):
        read_touch(folder, fingertip=TIP, unit="kPa")
    read = read_touch(folder, fingertip=TIP, unit="kPa", topics={"pose": "/arm/pose"})
    assert_same_touch(without_joint(read), TOUCH)
    for more, says in (
        ({}, "have no unit: give it with --unit"),
        ({"unit": "counts"}, "unknown unit 'counts'"),
        ({"unit": "kPa", "fingertip": None}, "geometry, or --fingertip"),
        (
            {"unit": "kPa", "topics": {"pose": "/nowhere"}},
            "no topic /nowhere for pose; topics in the file: /arm",
        ),
        (
            {"unit": "kPa", "topics": {"pose": "/tip"}},
            "topic /tip has type 'std_msgs/msg/Float64MultiArray', but",
        ),
    ):
        with pytest.raises(RecordingError, match=says) as caught:
            read_touch(folder, **({"fingertip": TIP, "topics": {"pose": "/arm/pose"}} | more))
        assert "\n" not in str(caught.value)


def test_the_documented_topics_go_first(tmp_path):
    documented = {messages.FINGER_POSE: poses(), "/tip": pressures()}
    folder = bag(tmp_path / "bag", {"/arm/pose": poses("nav_msgs/msg/Odometry")} | documented)
    read = read_touch(folder, fingertip=TIP, unit="kPa")
    assert not any("pose taken" in note for note in read.notes)


def test_arrays_beside_a_picture_are_no_touch_without_a_pose(tmp_path):
    folder = bag(tmp_path / "bag", {"/tip": pressures()})
    with pytest.raises(RecordingError, match="no messages on /camera/image/compressed or /finger/taxels"):
        read_scene(folder)
    with pytest.raises(RecordingError, match=r"holds no touch .* name its topics .* in the file: /tip"):
        read_touch(folder)


def test_messages_of_other_lengths_are_refused(tmp_path):
    kind = "std_msgs/msg/Float32MultiArray"
    uneven = (kind, lambda i: array(TOUCH.pressure_pa[i, : 5 - (i == 7)], kind))
    folder = bag(tmp_path / "bag", {"/a": poses(), "/tip": uneven})
    with pytest.raises(RecordingError, match="message 7 on /tip has 4 values for 5 taxels"):
        read_touch(folder, fingertip=TIP, unit="kPa")


@given(st.dictionaries(st.sampled_from(list(PARTS)), st.from_regex(r"/[a-z_/]{1,9}", fullmatch=True)))
@settings(max_examples=50, deadline=None)
def test_topics_come_back_from_their_text(named):
    text = ", ".join(f"{part}={topic}" for part, topic in named.items())
    if named:
        assert parse_topics(text) == named
    for bad in (f"{text},", f"{text},other=/a", f"{text},pose=/a,pose=/b", "pose", "pose="):
        with pytest.raises(UsageError, match="expected pressures=/topic"):
            parse_topics(bad)
