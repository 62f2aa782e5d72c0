"""What is left out, interpolated or refused on the way into a recording, in every format alike."""

import json
import re
import sqlite3
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as RosWriter

from evifuse.errors import RecordingError
from evifuse.recordings import messages, read_touch, write_touch
from evifuse.recordings.clock import gaps, held_to_fresh, suspected_millimetres
from evifuse.recordings.door import touch_of
from evifuse.recordings.inspection import inspect_touch
from evifuse.recordings.raw import RawTouch
from tests.recordings.made import START_NS, assert_same_touch, made_touch

MS = 1_000_000


def made_raw(samples: int = 400, taxels: int = 6) -> RawTouch:
    """A finger that moves evenly for a while, at 1 kHz."""
    touch = made_touch(samples, taxels)
    time_ns = START_NS + np.arange(samples) * MS
    along = np.linspace(0, 0.02, samples)
    pose = np.zeros((samples, 7))
    pose[:, 0], pose[:, 6] = along, 1.0
    return RawTouch(
        "made",
        time_ns=time_ns,
        pressure=touch.pressure_pa,
        unit="Pa",
        pose_time_ns=time_ns,
        pose=pose,
        joint_time_ns=time_ns,
        joint_rad=along * 30,
        radius_m=0.01,
        positions_m=touch.fingertip.positions_m,
        normals=touch.fingertip.normals,
    )


def test_a_whole_recording_has_no_notes():
    touch = touch_of(made_raw())
    assert touch.notes == ()
    np.testing.assert_allclose(touch.position_m[:, 0], made_raw().pose[:, 0], atol=1e-15)


def test_a_taxel_that_is_nan_throughout_is_left_out_of_the_fingertip():
    raw = made_raw()
    raw.pressure[:, 2] = np.nan
    touch = touch_of(raw)
    assert touch.pressure_pa.shape == (400, 5)
    np.testing.assert_allclose(touch.fingertip.normals, np.delete(raw.normals, 2, axis=0), atol=1e-12)
    assert touch.notes == ("made: taxel 2 is NaN throughout, left out of the fingertip",)
    raw.pressure[:] = np.nan
    with pytest.raises(RecordingError, match="all taxels are NaN"):
        touch_of(raw)


def test_single_nan_samples_are_left_out():
    raw = made_raw()
    raw.pressure[[7, 90], [1, 3]] = np.nan
    touch = touch_of(raw)
    np.testing.assert_array_equal(touch.time_ns, np.delete(raw.time_ns, [7, 90]))
    assert touch.notes == ("made: 2 samples (7, 90) are NaN in some pressure, left out",)


def test_missing_poses_are_interpolated():
    raw = made_raw()
    truth = raw.pose[:, 0].copy()
    raw.pose[50:80] = np.nan
    raw.joint_rad[5] = np.nan
    touch = touch_of(raw)
    np.testing.assert_allclose(touch.position_m[:, 0], truth, atol=1e-12)
    assert len(touch.notes) == 2
    assert "NaN at 30 of 400 rows" in touch.notes[0]


@given(step=st.integers(2, 40), phase=st.integers(0, 39))
@settings(max_examples=30, deadline=None)
def test_held_poses_are_interpolated_between_changes(step: int, phase: int):
    """A pose at a lower rate, repeated until the next one comes, is not a staircase."""
    raw = made_raw(800)
    truth = raw.pose[:, 0].copy()
    held = np.maximum((np.arange(800) + phase) // step * step - phase, 0)
    touch = touch_of(replace(raw, pose=raw.pose[held]))
    inner = (touch.time_ns >= raw.time_ns[2 * step]) & (touch.time_ns <= raw.time_ns[-2 * step])
    where = np.searchsorted(raw.time_ns, touch.time_ns[inner])
    np.testing.assert_allclose(touch.position_m[inner, 0], truth[where], atol=1e-12)
    assert any(f"changes only at {1000 / step:.4g} Hz" in note for note in touch.notes)


def test_a_finger_that_stands_still_is_not_taken_for_a_held_pose():
    raw = made_raw()
    raw.pose[100:300, 0] = raw.pose[100, 0]
    assert held_to_fresh(raw.pose_time_ns, raw.pose) is None
    held = raw.pose[np.arange(400) // 5 * 5]
    fresh = held_to_fresh(raw.pose_time_ns, held)
    assert fresh is not None
    between = np.interp(np.arange(400), fresh, held[fresh, 0])
    np.testing.assert_allclose(between[110:290], raw.pose[100, 0])


def test_slow_poses_are_interpolated_and_said():
    raw = made_raw()
    slow = replace(raw, pose_time_ns=raw.pose_time_ns[::19], pose=raw.pose[::19])
    touch = touch_of(slow)
    np.testing.assert_allclose(touch.position_m[:, 0], raw.pose[: len(touch.time_ns), 0], atol=1e-12)
    assert touch.notes == ("made: pose comes at 52.63 Hz, the pressures at 1000 Hz: interpolated",)


def test_a_silence_of_the_pose_is_not_bridged():
    raw = made_raw(1000)
    keep = (np.arange(1000) < 300) | (np.arange(1000) >= 800)
    touch = touch_of(replace(raw, pose_time_ns=raw.pose_time_ns[keep], pose=raw.pose[keep]))
    np.testing.assert_array_equal(touch.time_ns, raw.time_ns[keep])
    assert "pose is silent for up to 0.50 s, first around 0.30 s: the 500 samples there" in touch.notes[0]
    with pytest.raises(RecordingError, match="record it more often"):
        touch_of(replace(raw, pose_time_ns=raw.pose_time_ns[::300], pose=raw.pose[::300]))


def test_a_gap_is_said():
    raw = made_raw()
    late = raw.time_ns + np.where(np.arange(400) >= 150, 3_000 * MS, 0)
    touch = touch_of(replace(raw, time_ns=late, pose_time_ns=late, joint_time_ns=late))
    assert len(touch.time_ns) == 400
    assert touch.notes == ("made: no samples for 3.00 s after 0.15 s: not bridged, rolls end there",)
    assert gaps(late).tolist() == [149]


@pytest.mark.parametrize(("change", "says"), [(0, "two samples at time .* 9 and 10"), (-5, "at sample 10 ")])
def test_times_that_do_not_increase_are_refused_with_the_sample(change: int, says: str):
    raw = made_raw()
    raw.time_ns[10] = raw.time_ns[9] + change
    with pytest.raises(RecordingError, match=says):
        touch_of(raw)
    found = [f for f in inspect_touch(raw) if f.verdict == "refused"]
    assert [f.part for f in found] == ["time"]
    assert re.search(r"samples 10\b", found[0].text)


def test_inspection_lists_every_wrong_time():
    raw = made_raw()
    raw.time_ns[[10, 40, 77]] = raw.time_ns[[9, 39, 76]]
    texts = [f.text for f in inspect_touch(raw) if f.verdict == "refused"]
    assert texts == ["3 samples repeat a time and 0 go back: samples 10, 40, 77"]


TIMES = ("time_ns", "pose_time_ns", "joint_time_ns")
CHANGES = {
    "unknown unit 'psi'": ("pressures", lambda r: replace(r, unit="psi")),
    "taxel values in N need the area": ("pressures", lambda r: replace(r, unit="N")),
    "quaternions must have length 1": ("pose", lambda r: replace(r, pose=r.pose * 1.5)),
    "normals must have length 1": ("fingertip", lambda r: replace(r, normals=r.normals * 2)),
    "are positions in mm?": ("fingertip", lambda r: replace(r, positions_m=r.positions_m * 1000)),
    "is it in us? multiply by 1000": (
        "time",
        lambda r: replace(r, **{key: getattr(r, key) // 1000 for key in TIMES}),
    ),
    "is it in ms? multiply by 1000000": (
        "time",
        lambda r: replace(r, **{key: getattr(r, key) // 10**6 for key in TIMES}),
    ),
    "radius must be in": ("fingertip", lambda r: replace(r, radius_m=10.0)),
    "taxel positions must have shape": ("fingertip", lambda r: replace(r, positions_m=np.zeros((0, 3)))),
}


@pytest.mark.parametrize("says", CHANGES)
def test_what_inspection_refuses_an_estimate_refuses_too(says: str):
    part, change = CHANGES[says]
    raw = change(made_raw())
    found = [f for f in inspect_touch(raw) if f.verdict == "refused"]
    assert {f.part for f in found} == {part}
    assert any(says in f.text for f in found)
    with pytest.raises(RecordingError):
        touch_of(raw)


NOTES = {
    "is the position in mm?": lambda r: replace(r, pose=r.pose * [1000, 1000, 1000, 1, 1, 1, 1]),
    "is it in degrees?": lambda r: replace(r, joint_rad=np.rad2deg(r.joint_rad)),
    "normals point at the fingertip's origin": lambda r: replace(r, normals=-r.normals),
    "is the unit right?": lambda r: replace(r, unit="MPa"),
    "reading at no load as offset": lambda r: replace(r, pressure=r.pressure + 5e4),
    "but taxels are 10.00 mm": lambda r: replace(r, radius_m=0.02),
    "the turn must be in the joint angle": lambda r: r,
}


@pytest.mark.parametrize("says", NOTES)
def test_doubts_are_notes(says: str):
    texts = [f.text for f in inspect_touch(NOTES[says](made_raw())) if f.verdict == "note"]
    assert any(says in text for text in texts)
    sound = {f.text for f in inspect_touch(made_raw()) if f.verdict == "note"}
    assert len(sound) == 1  # this finger does not turn


def test_millimetres_are_suspected_by_speed_alone():
    raw = made_raw()
    assert not suspected_millimetres(raw.pose_time_ns, raw.pose[:, :3])
    assert suspected_millimetres(raw.pose_time_ns, raw.pose[:, :3] * 1000)
    touch = touch_of(replace(raw, pose=raw.pose * [1000, 1000, 1000, 1, 1, 1, 1]))
    assert "is its position in mm?" in touch.notes[0]


def test_degrees_are_left_out_and_said():
    touch = touch_of(replace(made_raw(), joint_rad=np.rad2deg(made_raw().joint_rad)))
    assert not touch.has_joint
    assert touch.notes[0] == "made: the joint turns through 34 rad: in degrees? it is left out; give radians"


# Formats


def test_parquet_and_csv_cells_may_be_empty(tmp_path: Path):
    touch = made_touch(samples=6, taxels=3)
    write_touch(tmp_path / "t.csv", touch)
    lines = (tmp_path / "t.csv").read_text().splitlines()
    cells = lines[6].split(",")
    lines[6] = ",".join([*cells[:-1], ""])
    (tmp_path / "e.csv").write_text("\n".join(lines))
    read = read_touch(tmp_path / "e.csv")
    np.testing.assert_array_equal(read.time_ns, np.delete(touch.time_ns, 2))
    assert "sample 2 is NaN" in read.notes[0]


def test_a_csv_that_is_cut_keeps_its_whole_rows(tmp_path: Path):
    touch = made_touch(samples=6, taxels=3)
    write_touch(tmp_path / "t.csv", touch)
    text = (tmp_path / "t.csv").read_text()
    cut = text.rindex(",") - 3
    (tmp_path / "c.csv").write_text(text[:cut])
    with pytest.raises(RecordingError, match="cut off"):
        read_touch(tmp_path / "c.csv")
    read = read_touch(tmp_path / "c.csv", partial=True)
    assert len(read.time_ns) == 5
    assert read.notes == ("c.csv: line 10 is cut off; the 5 samples before that are read",)


def test_parquet_comes_back_and_says_what_is_wrong(tmp_path: Path):
    import pyarrow as pa
    import pyarrow.parquet as pq

    touch = made_touch()
    file = tmp_path / "t.parquet"
    write_touch(file, touch)
    assert_same_touch(read_touch(file), touch)
    table = pq.read_table(file)
    assert table.column_names[:3] == ["time_ns", "x_m", "y_m"]
    assert json.loads(table.schema.metadata[b"fingertip_radius_m"]) == 0.01
    changes = {
        "metadata must hold fingertip_radius_m": table.replace_schema_metadata({}),
        "column 2 must be 'x_m', not 'x_mm'": table.rename_columns(
            ["time_ns", "x_mm", *table.column_names[2:]]
        ),
        "unknown unit 'psi'": table.rename_columns([n.replace("_pa", "_psi") for n in table.column_names]),
        "column 'y_m' must be real numbers, not string": table.set_column(2, "y_m", pa.array(["a"] * 40)),
        "T = 0": table.slice(0, 0),
    }
    for says, changed in changes.items():
        named = says if "metadata" in says else None
        pq.write_table(changed if named else changed.replace_schema_metadata(table.schema.metadata), file)
        with pytest.raises(RecordingError, match=re.escape(says)):
            read_touch(file)
    write_touch(file, touch)
    file.write_bytes(file.read_bytes()[:-100])
    with pytest.raises(RecordingError, match="not a whole Parquet file"):
        read_touch(file)


def test_npz_with_poses_at_their_own_times(tmp_path: Path):
    raw = made_raw()
    np.savez(
        tmp_path / "s.npz",
        radius_m=0.01,
        positions_m=raw.positions_m,
        normals=raw.normals,
        time_ns=raw.time_ns,
        pressure_pa=raw.pressure,
        pose_time_ns=raw.time_ns[::3],
        position_m=raw.pose[::3, :3],
        orientation_xyzw=raw.pose[::3, 3:],
        joint_angle_rad=raw.joint_rad,
    )
    read = read_touch(tmp_path / "s.npz")
    np.testing.assert_allclose(read.position_m[:, 0], raw.pose[:, 0], atol=1e-12)
    assert "pose_time_ns comes at 333.3 Hz" in read.notes[0]


def bag(folder: Path, plugin: StoragePlugin, start: int, stop: int) -> Path:
    """A part of the made recording, by another writer."""
    from evifuse.recordings.mcap_writer import _touch_messages

    store = messages.typestore()
    with RosWriter(folder, version=9, storage_plugin=plugin) as writer:
        links = {
            t: writer.add_connection(t, messages.TOPIC_TYPES[t], typestore=store)
            for t in (messages.TAXELS, messages.FINGER_POSE, messages.FINGER_JOINT)
        }
        for topic, time_ns, message in list(_touch_messages(made_touch()))[3 * start : 3 * stop]:
            writer.write(links[topic], time_ns, store.serialize_cdr(message, messages.TOPIC_TYPES[topic]))
    return folder


@pytest.mark.parametrize(("plugin", "suffix"), [(StoragePlugin.MCAP, "mcap"), (StoragePlugin.SQLITE3, "db3")])
def test_bags_of_several_files(tmp_path: Path, plugin: StoragePlugin, suffix: str):
    for part, (start, stop) in enumerate([(0, 9), (9, 15), (15, 40)]):
        source = bag(tmp_path / f"part{part}", plugin, start, stop)
        number = (2, 9, 10)[part]
        whole = tmp_path / "whole"
        whole.mkdir(exist_ok=True)
        (source / f"part{part}.{suffix}").rename(whole / f"whole_{number}.{suffix}")
    (whole / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
    assert_same_touch(read_touch(whole), made_touch())
    if suffix == "db3":
        (whole / "metadata.yaml").unlink()  # a recorder that was stopped hard
        assert_same_touch(read_touch(whole), made_touch())
    last = whole / f"whole_10.{suffix}"
    last.write_bytes(last.read_bytes()[: last.stat().st_size // 2])
    (whole / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
    with pytest.raises(RecordingError, match="whole_10"):
        read_touch(whole)
    part = read_touch(whole, partial=True)
    assert 15 <= len(part.time_ns) < 40
    assert "whole_10" in part.notes[0]


@pytest.mark.parametrize("taxels", [5, 400])
def test_a_sqlite_file_cut_anywhere_gives_its_whole_messages(tmp_path: Path, taxels: int):
    """With many taxels, a message goes on over several pages."""
    from evifuse.recordings.bags import read_sqlite
    from evifuse.recordings.mcap_writer import _touch_messages

    touch, store = made_touch(300, taxels), messages.typestore()
    with RosWriter(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        links = {
            t: writer.add_connection(t, messages.TOPIC_TYPES[t], typestore=store)
            for t in (messages.TAXELS, messages.FINGER_POSE, messages.FINGER_JOINT)
        }
        for topic, time_ns, message in _touch_messages(touch):
            writer.write(links[topic], time_ns, store.serialize_cdr(message, messages.TOPIC_TYPES[topic]))
    file = tmp_path / "bag" / "bag.db3"
    whole = read_sqlite(file)
    assert not whole.damage
    data, lengths = file.read_bytes(), []
    for cut in np.linspace(200, len(data) - 1, 40).astype(int).tolist():
        file.write_bytes(data[:cut])
        part = read_sqlite(file)
        assert "cut off" in part.damage
        for name, topic in part.topics.items():
            assert topic.data == whole.topics[name].data[: len(topic.data)]
            assert topic.log_time_ns == whole.topics[name].log_time_ns[: len(topic.data)]
        lengths.append(sum(len(topic.data) for topic in part.topics.values()))
    assert lengths == sorted(lengths)
    assert lengths[0] == 0
    assert lengths[20] > 0.35 * 900
    assert lengths[-1] > 0.9 * 900
    with pytest.raises(RecordingError, match="cut off"):
        read_touch(tmp_path / "bag")
    read = read_touch(tmp_path / "bag", partial=True)
    np.testing.assert_allclose(read.pressure_pa, touch.pressure_pa[: len(read.time_ns)], rtol=1e-6)


def test_sqlite_files_that_are_none(tmp_path: Path):
    (tmp_path / "e.db3").write_bytes(b"")
    (tmp_path / "t.db3").write_text("hello, I am text, and long enough")
    link = sqlite3.connect(tmp_path / "o.db3")
    link.execute("CREATE TABLE other (id INTEGER)")
    link.commit()
    link.close()
    for name, says in (("e", "is empty"), ("t", "not a SQLite bag"), ("o", "not a whole rosbag2 file")):
        with pytest.raises(RecordingError, match=says):
            read_touch(tmp_path / f"{name}.db3")


def test_big_endian_messages_are_read(tmp_path: Path):
    from evifuse.recordings.layout import Layout, grouped

    first = b"\0\0\0\0" + (7).to_bytes(4, "big") + np.array([1.5, 2.5], ">f8").tobytes().rjust(20, b"\0")

    def read(layout: Layout):
        return {"n": layout.numbers("u4"), "v": layout.numbers("f8", 2)}

    (group,) = grouped([first, first], read)
    assert group.values("n").tolist() == [[7], [7]]
    assert group.values("v").tolist() == [[1.5, 2.5], [1.5, 2.5]]
