"""MCAP in and out: our own files, other writers, other readers, and damage."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType
from mcap.writer import Writer as RawWriter
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as RosWriter

from evifuse.errors import RecordingError
from evifuse.recordings import messages, read_scene, read_touch, rotation, write_scene
from tests.recordings.made import assert_same_touch, made_camera, made_scene, made_touch

IMAGE, INFO, CAMERA = messages.IMAGE, messages.CAMERA_INFO, messages.CAMERA_POSE
POSE, JOINT, TAXELS = messages.FINGER_POSE, messages.FINGER_JOINT, messages.TAXELS
SECOND = 10**9


def loaded(path: Path) -> list[tuple[str, int, object]]:
    """Messages of a file, by a reader that is not ours."""
    with AnyReader([path]) as reader:
        return [(c.topic, time, reader.deserialize(raw, c.msgtype)) for c, time, raw in reader.messages()]


def stored(
    path: Path, entries, *, kinds=messages.TOPIC_TYPES, compression=CompressionType.LZ4, checksums=True
) -> Path:
    """Write messages with the bare MCAP library; every topic of ``kinds`` is there, even empty."""
    store = messages.typestore()
    with path.open("wb") as stream:
        writer = RawWriter(stream, chunk_size=2000, compression=compression, enable_crcs=checksums)
        writer.start(profile="ros2", library="test")
        channels = {}
        for topic, kind in kinds.items():
            text = store.generate_msgdef(kind, ros_version=2)[0]
            schema = writer.register_schema(kind, "ros2msg", text.encode())
            channels[topic] = writer.register_channel(topic, "cdr", schema)
        for topic, time_ns, message in entries:
            data = (
                message if isinstance(message, bytes) else bytes(store.serialize_cdr(message, kinds[topic]))
            )
            writer.add_message(channels[topic], time_ns, data, time_ns)
        writer.finish()
    return path


@pytest.fixture
def entries(tmp_path):
    write_scene(tmp_path / "made.mcap", made_scene())
    return loaded(tmp_path / "made.mcap")


def test_a_scene_comes_back(tmp_path):
    scene = made_scene()
    write_scene(tmp_path / "s.mcap", scene)
    again = read_scene(tmp_path / "s.mcap")
    assert again.name == "s.mcap"
    np.testing.assert_array_equal(again.image, scene.image)
    assert (again.camera.width, again.camera.height) == (64, 48)
    np.testing.assert_array_equal(again.camera.matrix, scene.camera.matrix)
    np.testing.assert_array_equal(again.camera.position_m, scene.camera.position_m)
    np.testing.assert_array_equal(again.camera.orientation_xyzw, scene.camera.orientation_xyzw)
    assert_same_touch(again.touch, scene.touch)


@pytest.mark.parametrize("missing", ["image", "camera", "touch"])
def test_parts_of_a_scene_come_back(tmp_path, missing):
    scene = replace(made_scene(), **{missing: None})
    write_scene(tmp_path / "s.mcap", scene)
    again = read_scene(tmp_path / "s.mcap")
    assert getattr(again, missing) is None
    assert (again.camera is None) == (missing != "touch")
    assert (again.image is None) == (scene.image is None)
    assert (again.touch is None) == (scene.touch is None)


def test_the_file_is_chunked_compressed_and_checksummed(tmp_path):
    write_scene(tmp_path / "s.mcap", made_scene(samples=3000, taxels=60))
    with (tmp_path / "s.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert reader.get_header().profile == "ros2"
        assert sum(1 for _ in reader.iter_messages()) == 3 * 3000 + 3
    assert len(summary.chunk_indexes) > 1
    assert {chunk.compression for chunk in summary.chunk_indexes} == {"zstd"}
    assert {schema.encoding for schema in summary.schemas.values()} == {"ros2msg"}
    assert {channel.topic for channel in summary.channels.values()} == set(messages.TOPIC_TYPES)


def test_another_reader_understands_ours(tmp_path):
    scene = made_scene()
    write_scene(tmp_path / "s.mcap", scene)
    found = loaded(tmp_path / "s.mcap")
    taxels = [message for topic, _, message in found if topic == TAXELS]
    np.testing.assert_allclose([m.values for m in taxels], scene.touch.pressure_pa, rtol=1e-6)
    assert [len(m.positions) for m in taxels] == [5] + [0] * 39
    poses = [(time, m) for topic, time, m in found if topic == POSE]
    assert [time for time, _ in poses] == scene.touch.time_ns.tolist()
    stamp = poses[7][1].header.stamp
    assert stamp.sec * SECOND + stamp.nanosec == scene.touch.time_ns[7]
    assert [m.format for topic, _, m in found if topic == IMAGE] == ["png"]


@pytest.mark.parametrize("compression", list(CompressionType))
def test_the_bare_library_writes_what_we_read(tmp_path, entries, compression):
    file = stored(tmp_path / "raw.mcap", entries, compression=compression)
    assert_same_touch(read_touch(file), made_touch())


def test_ros_bag_folders_with_other_rates(tmp_path, entries):
    """Poses at 100 Hz, joint at 50 Hz, taxels at 1 kHz, written by rosbags in its own order."""
    types = messages.typestore().types
    first = next(m for topic, _, m in entries if topic == TAXELS)
    start, axis = 5 * SECOND, np.array([0.6, 0.0, 0.8])
    with RosWriter(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        store = messages.typestore()
        links = {
            t: writer.add_connection(t, messages.TOPIC_TYPES[t], typestore=store)
            for t in (TAXELS, POSE, JOINT)
        }

        def put(topic, time_ns, message):
            writer.write(links[topic], time_ns, store.serialize_cdr(message, messages.TOPIC_TYPES[topic]))

        for i in range(1000):
            time_ns = start + i * 10**6
            header = messages.header(time_ns, "finger")
            put(TAXELS, time_ns, replace(first, header=header, unit="kPa", offset=1.0))
        for i in range(2, 90):
            time_ns = start + i * 10**7
            turned = rotation.about_axis(axis, i * 0.01) * (-1) ** i
            put(POSE, time_ns, messages.pose_message(time_ns, np.array([i * 0.01, 0.0, 1.0]), turned))
        for i in reversed(range(51)):
            time_ns = start + i * 2 * 10**7
            joint = types["sensor_msgs/msg/JointState"](
                header=messages.header(time_ns, "finger"),
                name=["other", "distal"],
                position=np.array([9.0, i * 0.02]),
                velocity=np.empty(0),
                effort=np.empty(0),
            )
            put(JOINT, time_ns, joint)
    touch = read_touch(tmp_path / "bag")
    seconds = (touch.time_ns - start) / SECOND
    assert (seconds[0], seconds[-1], len(seconds)) == (0.02, 0.89, 871)
    np.testing.assert_allclose(touch.position_m[:, 0], seconds, atol=1e-12)
    np.testing.assert_allclose(touch.joint_angle_rad, seconds, atol=1e-12)
    true = rotation.to_matrix(rotation.about_axis(axis, seconds))
    np.testing.assert_allclose(rotation.to_matrix(touch.orientation_xyzw), true, atol=1e-9)
    np.testing.assert_allclose(touch.pressure_pa[5], (first.values.astype(float) - 1.0) * 1e3)


def test_the_recorder_s_clock_stands_in_for_missing_stamps(tmp_path, entries):
    for _, _, message in entries:
        message.header.stamp.sec = message.header.stamp.nanosec = 0
    assert_same_touch(read_touch(stored(tmp_path / "z.mcap", entries)), made_touch())


def test_lens_distortion_is_removed(tmp_path, entries):
    import cv2

    info = next(m for topic, _, m in entries if topic == INFO)
    info.d = np.array([0.2, -0.1, 0.001, 0.002, 0.0])
    straight = cv2.undistort(made_scene().image, made_camera().matrix, info.d)
    np.testing.assert_array_equal(read_scene(stored(tmp_path / "d.mcap", entries)).image, straight)
    info.distortion_model = "fisheye"
    with pytest.raises(RecordingError, match="'fisheye'"):
        read_scene(stored(tmp_path / "d.mcap", entries))


def altered(entries, topic, index, **values):
    """The entries with one message changed; a message that is cut loses its end."""
    places = [i for i, entry in enumerate(entries) if entry[0] == topic]
    name, time_ns, message = entries[places[index]]
    changed = list(entries)
    changed[places[index]] = (name, time_ns, replace(message, **values))
    return changed


def without(entries, *topics):
    return [entry for entry in entries if entry[0] not in topics]


def rare(entries):
    """A pose every second of four."""
    first = made_touch().time_ns[0]
    slow = silent(entries, factor=100, start=9, stop=9)
    poses = [e for e in slow if e[0] == POSE][::10]
    assert (poses[-1][1] - first) / SECOND > 2
    return [*without(slow, POSE), *poses]


def silent(entries, factor=25, start=0.2, stop=0.8):
    """Slower, and no pose for a while: by default between 0.2 s and 0.8 s of a second."""
    first = made_touch().time_ns[0]
    stretched = [(t, first + (time - first) * factor, m) for t, time, m in entries]
    for _, time_ns, message in stretched:
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(int(time_ns), SECOND)
    return [e for e in stretched if not (e[0] == POSE and start < (e[1] - first) / SECOND < stop)]


NAN5 = np.full(5, np.nan, np.float32)
INF5 = np.full(5, np.inf, np.float32)
BROKEN = {
    "no message on .*taxels has no|T = 0": lambda e: without(e, TAXELS),
    "/finger/pose has no messages": lambda e: without(e, POSE),
    "pressure_pa is NaN or infinite at row 4": lambda e: altered(e, TAXELS, 4, values=INF5),
    "message 4 on /finger/taxels has 3 values": lambda e: altered(e, TAXELS, 4, values=NAN5[:3]),
    "message 4 on /finger/taxels changes unit": lambda e: altered(e, TAXELS, 4, unit="kPa"),
    "unknown unit 'psi'": lambda e: [(t, i, replace(m, unit="psi") if t == TAXELS else m) for t, i, m in e],
    "must give the fingertip's geometry": lambda e: altered(e, TAXELS, 0, positions=[]),
    "radius must be in": lambda e: altered(e, TAXELS, 0, radius=-1.0),
    "two samples at time": lambda e: [*e, e[-1]],
    "needs one joint": lambda e: altered(e, JOINT, 2, name=["a", "b"], position=np.zeros(2)),
    "/finger/joint_states is NaN": lambda e: altered(e, JOINT, 2, position=np.array([np.inf])),
    "/finger/taxels is not a valid evifuse": lambda e: [*e, (TAXELS, e[-1][1] + 1, b"\0\1\0\0\7")],
    "/finger/pose is silent for .* record it more often": rare,
    "picture on .* is broken": lambda e: altered(e, IMAGE, 0, data=np.arange(50, dtype=np.uint8)),
    "camera_info is for 10x48 px": lambda e: altered(e, INFO, 0, width=10),
    "not that of a calibrated camera": lambda e: altered(e, INFO, 0, k=np.zeros(9)),
    "matrix k .* is NaN": lambda e: altered(e, INFO, 0, k=np.full(9, np.nan)),
}


@pytest.mark.parametrize("message", BROKEN)
def test_broken_content_is_named(tmp_path, entries, message):
    file = stored(tmp_path / "broken.mcap", BROKEN[message](entries))
    with pytest.raises(RecordingError, match=message) as caught:
        read_scene(file)
    assert "\n" not in str(caught.value)
    assert "broken.mcap" in str(caught.value)


def test_a_topic_that_was_not_recorded_is_named(tmp_path, entries):
    kinds = {key: kind for key, kind in messages.TOPIC_TYPES.items() if key != POSE}
    file = stored(tmp_path / "m.mcap", without(entries, POSE), kinds=kinds)
    with pytest.raises(RecordingError, match=f"touch needs topic {POSE}"):
        read_scene(file)


@pytest.mark.parametrize("silent_topic", [True, False])
def test_a_joint_may_be_missing(tmp_path, entries, silent_topic):
    kinds = {key: kind for key, kind in messages.TOPIC_TYPES.items() if silent_topic or key != JOINT}
    touch = read_touch(stored(tmp_path / "m.mcap", without(entries, JOINT), kinds=kinds))
    assert not touch.has_joint
    assert touch.notes[0] == (
        "m.mcap: no joint angle: slip can't be told, and there is no estimate by the chapter"
    )
    np.testing.assert_allclose(touch.pressure_pa, made_touch().pressure_pa, rtol=1e-6)


def test_a_recording_of_something_else(tmp_path, entries):
    text = messages.typestore().types["std_msgs/msg/String"](data="hello")
    file = stored(tmp_path / "c.mcap", [("/chatter", 1, text)], kinds={"/chatter": "std_msgs/msg/String"})
    with pytest.raises(RecordingError, match="topics in the file: /chatter"):
        read_scene(file)
    file = stored(tmp_path / "c.mcap", [(TAXELS, 1, text)], kinds={TAXELS: "std_msgs/msg/String"})
    with pytest.raises(RecordingError, match="has type 'std_msgs/msg/String'"):
        read_scene(file)
    file = stored(tmp_path / "c.mcap", without(entries, POSE, JOINT, TAXELS), kinds=messages.TOPIC_TYPES)
    with pytest.raises(RecordingError, match="T = 0"):
        read_touch(file)
    kinds = {key: messages.TOPIC_TYPES[key] for key in (IMAGE, INFO, CAMERA)}
    file = stored(tmp_path / "c.mcap", without(entries, POSE, JOINT, TAXELS), kinds=kinds)
    with pytest.raises(RecordingError, match="holds no touch"):
        read_touch(file)


def test_a_file_cut_anywhere_is_refused_and_its_whole_chunks_can_be_had(tmp_path, entries):
    whole = stored(tmp_path / "whole.mcap", entries).read_bytes()
    lengths = []
    for cut in [*range(1, len(whole), max(1, len(whole) // 60)), len(whole) - 1]:
        (tmp_path / "cut.mcap").write_bytes(whole[:cut])
        with pytest.raises(RecordingError, match=r"cut\.mcap") as caught:
            read_scene(tmp_path / "cut.mcap")
        assert "\n" not in str(caught.value)
        try:
            lengths.append(len(read_touch(tmp_path / "cut.mcap", partial=True).time_ns))
        except RecordingError:
            lengths.append(0)
    assert lengths == sorted(lengths)
    assert lengths[0] == 0
    assert lengths[-1] == 40
    assert any(0 < length < 40 for length in lengths)


def test_a_flipped_byte_is_noticed(tmp_path):
    write_scene(tmp_path / "s.mcap", made_scene())
    whole = (tmp_path / "s.mcap").read_bytes()
    with AnyReader([tmp_path / "s.mcap"]):
        pass
    for place in range(100, len(whole) // 2, max(1, len(whole) // 40)):
        changed = bytearray(whole)
        changed[place] ^= 0x10
        (tmp_path / "f.mcap").write_bytes(bytes(changed))
        with pytest.raises(RecordingError, match=r"f\.mcap"):
            read_scene(tmp_path / "f.mcap")


@pytest.mark.parametrize("compression", list(CompressionType))
def test_damage_without_checksums_is_an_error_or_another_valid_recording(tmp_path, entries, compression):
    file = stored(tmp_path / "w.mcap", without(entries, IMAGE), compression=compression, checksums=False)
    whole = file.read_bytes()
    rng = np.random.default_rng(7)
    refused: list[str] = []
    for _ in range(80):
        changed = bytearray(whole)
        for place in rng.integers(8, len(whole), 3):
            changed[place] = rng.integers(256)
        file.write_bytes(bytes(changed))
        try:
            assert np.isfinite(read_touch(file, partial=True).pressure_pa).all()
        except RecordingError as error:
            refused.append(str(error))
    assert refused
    assert not any("\n" in message for message in refused)


def test_huge_numbers_are_refused_in_one_line(tmp_path, entries):
    huge = altered(entries, TAXELS, 0, values=np.full(5, 3e38, np.float32))
    huge = [(t, i, replace(m, unit="N", area=1e-300) if t == TAXELS else m) for t, i, m in huge]
    with pytest.raises(RecordingError, match="infinite at row 0"):
        read_touch(stored(tmp_path / "h.mcap", huge))


@pytest.mark.parametrize(
    ("content", "message"),
    [(b"", "empty"), (b"hello, I am text", "not an MCAP file"), (b"\x89MCAP0\r\n", "cut off or damaged")],
)
def test_not_a_recording(tmp_path, content, message):
    (tmp_path / "x.mcap").write_bytes(content)
    for partial in (False, True):
        with pytest.raises(
            RecordingError, match="no messages on" if partial and "cut" in message else message
        ):
            read_scene(tmp_path / "x.mcap", partial=partial)
