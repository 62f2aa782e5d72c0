"""CSV and NPZ, and what is the same for all formats."""

import os
from dataclasses import replace

import numpy as np
import pytest

from evifuse.errors import ImageError, RecordingError
from evifuse.recordings import Scene, read_scene, read_touch, write_scene, write_touch
from evifuse.recordings.atomic import replacing
from tests.recordings.made import assert_same_touch, made_scene, made_touch


@pytest.mark.parametrize("suffix", [".csv", ".npz", ".mcap", ".CSV"])
def test_what_is_written_is_read(tmp_path, suffix):
    touch = made_touch()
    file = tmp_path / f"touch{suffix}"
    write_touch(file, touch)
    assert_same_touch(read_touch(file), touch)
    assert read_touch(file).name == file.name
    assert [path.name for path in tmp_path.iterdir()] == [file.name]


@pytest.mark.parametrize("suffix", [".csv", ".npz", ".mcap", ".parquet"])
def test_a_recording_without_a_joint_comes_back(tmp_path, suffix):
    touch = made_touch()
    file = tmp_path / f"touch{suffix}"
    write_touch(file, replace(touch, joint_angle_rad=np.full(40, np.nan)))
    read = read_touch(file)
    assert not read.has_joint
    assert "no joint angle" in read.notes[0]
    assert_same_touch(replace(read, joint_angle_rad=touch.joint_angle_rad), touch)


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_an_archive_cut_anywhere_gives_its_whole_samples(tmp_path, save):
    touch = made_touch(samples=300)
    write_touch(tmp_path / "t.npz", touch)
    with np.load(tmp_path / "t.npz") as archive:
        save(tmp_path / "w.npz", **archive)
    data = (tmp_path / "w.npz").read_bytes()
    file, lengths = tmp_path / "c.npz", []
    for cut in [*range(0, len(data), len(data) // 80), len(data) - 1]:
        file.write_bytes(data[:cut])
        with pytest.raises(RecordingError, match=r"c\.npz"):
            read_touch(file)
        try:
            read = read_touch(file, partial=True)
        except RecordingError:
            lengths.append(0)
            continue
        lengths.append(len(read.time_ns))
        kept = slice(0, lengths[-1])
        np.testing.assert_array_equal(read.time_ns, touch.time_ns[kept])
        np.testing.assert_allclose(read.pressure_pa, touch.pressure_pa[kept], rtol=1e-6)
        assert "cut off" in read.notes[0]
        assert f"the {lengths[-1]} samples before that are read" in read.notes[0]
    assert lengths == sorted(lengths)
    assert (lengths[0], lengths[-1]) == (0, 300)
    assert sum(0 < length < 300 for length in lengths) > 10


def test_an_archive_that_its_writer_left_open_is_read_so_far(tmp_path):
    """Its last array has no size yet; numpy wrote zeros there, to be filled in at the end."""
    touch = made_touch(samples=300)
    write_touch(tmp_path / "t.npz", touch)
    data = bytearray((tmp_path / "t.npz").read_bytes())
    at = data.index(b"pressure_pa.npy")
    data[at - 16 : at - 8] = b"\xff" * 8
    field = at + len(b"pressure_pa.npy")
    data[field + 4 : field + 20] = bytes(16)
    (tmp_path / "c.npz").write_bytes(data[: at + 3000])
    read = read_touch(tmp_path / "c.npz", partial=True)
    assert 20 < len(read.time_ns) < 300
    np.testing.assert_allclose(read.pressure_pa, touch.pressure_pa[: len(read.time_ns)], rtol=1e-6)


@pytest.mark.parametrize("suffix", [".csv", ".npz", ".mcap"])
def test_no_contact_and_one_sample_are_valid(tmp_path, suffix):
    touch = made_touch(samples=1)
    touch = replace(touch, pressure_pa=np.zeros_like(touch.pressure_pa))
    write_touch(tmp_path / f"t{suffix}", touch)
    assert not read_touch(tmp_path / f"t{suffix}").pressure_pa.any()


def csv_lines(tmp_path, touch=None):
    write_touch(tmp_path / "t.csv", touch or made_touch(samples=4, taxels=2))
    return (tmp_path / "t.csv").read_text().splitlines()


def test_kilopascals_newtons_and_an_offset_in_csv(tmp_path):
    touch = made_touch(samples=4, taxels=2)
    lines = csv_lines(tmp_path, touch)
    text = "\n".join(lines)
    kilo = text.replace("_pa", "_kpa").replace("# taxel_n", "# pressure_offset: 2\n# taxel_n")
    (tmp_path / "k.csv").write_text(kilo)
    read = read_touch(tmp_path / "k.csv")
    np.testing.assert_allclose(read.pressure_pa, (touch.pressure_pa - 2) * 1e3, rtol=1e-6)
    newton = text.replace("_pa", "_n").replace("# taxel_n", "# taxel_area_m2: 4e-6\n# taxel_n")
    (tmp_path / "n.csv").write_text(newton)
    read = read_touch(tmp_path / "n.csv")
    np.testing.assert_allclose(read.pressure_pa, touch.pressure_pa / 4e-6, rtol=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: "", "no line with the names"),
        (lambda t: t[: t.index("1700")], "T = 0"),
        (lambda t: t[:-30], ":8: .*values for 11 columns"),
        (lambda t: t.replace("x_m,", "", 1), "column 2 must be 'x_m', not 'y_m'"),
        (lambda t: t.replace("time_ns,x_m", "x_m,time_ns"), "column 1 must be 'time_ns'"),
        (lambda t: t.replace("p1_pa", "p1_kpa"), "column 11 must be 'p1_pa'"),
        (lambda t: t.replace(",p0_pa,p1_pa", ""), "no pressure columns"),
        (lambda t: t.replace("_pa", "_psi"), "unknown unit 'psi'"),
        (lambda t: t.replace("_pa", "_n"), "area"),
        (lambda t: t.replace("# taxel_normals", "# other"), "'# taxel_normals: ...' is needed"),
        (lambda t: t.replace("radius_m: 0.01", "radius_m: ten"), ":1: .*not JSON"),
        (lambda t: t.replace("radius_m: 0.01", 'radius_m: "ten"'), "does not hold the numbers"),
        (lambda t: t.replace("positions_m: [[", "positions_m: [[1,"), "does not hold the numbers"),
        (lambda t: t.replace("\n1700", "\n17x0", 1), ":5: not a number"),
        (lambda t: t[:-4] + "nope", ":8: "),
        (lambda t: t.replace("\n1700", "\n9999999999999999999999"), ":5: not a number"),
    ],
)
def test_bad_csv_is_named(tmp_path, change, message):
    text = "\n".join(csv_lines(tmp_path))
    file = tmp_path / "bad.csv"
    file.write_text(change(text))
    with pytest.raises(RecordingError, match=message) as caught:
        read_touch(file)
    assert "\n" not in str(caught.value)
    assert "bad.csv" in str(caught.value)


def test_csv_that_is_not_text(tmp_path):
    (tmp_path / "b.csv").write_bytes(b"\xff\xfe\x00\x01" * 10)
    with pytest.raises(RecordingError, match="not a text file"):
        read_touch(tmp_path / "b.csv")


def npz_arrays(tmp_path):
    write_touch(tmp_path / "t.npz", made_touch())
    with np.load(tmp_path / "t.npz") as archive:
        return dict(archive)


def test_npz_with_units(tmp_path):
    arrays = npz_arrays(tmp_path)
    pressure = arrays.pop("pressure_pa")
    np.savez(tmp_path / "u.npz", **arrays, pressure=pressure / 1e3, pressure_unit="kPa")
    np.testing.assert_allclose(read_touch(tmp_path / "u.npz").pressure_pa, pressure)
    np.savez(tmp_path / "u.npz", **arrays, pressure=pressure, pressure_unit="lbf")
    with pytest.raises(RecordingError, match="'lbf'"):
        read_touch(tmp_path / "u.npz")


@pytest.mark.parametrize(
    "key",
    ["time_ns", "position_m", "orientation_xyzw", "radius_m", "normals", "pressure_pa"],
)
def test_npz_missing_array_is_named(tmp_path, key):
    arrays = npz_arrays(tmp_path)
    del arrays[key]
    np.savez(tmp_path / "m.npz", **arrays)
    with pytest.raises(RecordingError, match=f"'{key}' is missing"):
        read_touch(tmp_path / "m.npz")


def test_broken_npz(tmp_path):
    npz_arrays(tmp_path)
    data = (tmp_path / "t.npz").read_bytes()
    for name, content in {"cut": data[: len(data) // 2], "no": b"hello", "empty": b""}.items():
        (tmp_path / f"{name}.npz").write_bytes(content)
        with pytest.raises(RecordingError, match=rf"{name}\.npz"):
            read_touch(tmp_path / f"{name}.npz")
    np.savez(tmp_path / "o.npz", time_ns=np.array([{}], dtype=object))
    with pytest.raises(RecordingError, match="plain arrays"):
        read_touch(tmp_path / "o.npz")
    arrays = npz_arrays(tmp_path)
    np.savez(tmp_path / "r.npz", **{**arrays, "radius_m": np.array([1.0, 2.0])})
    with pytest.raises(RecordingError, match="radius_m must be one number"):
        read_touch(tmp_path / "r.npz")
    np.savez(tmp_path / "s.npz", **{**arrays, "position_m": np.array(["a"] * 40)})
    with pytest.raises(RecordingError, match="position_m"):
        read_touch(tmp_path / "s.npz")


def test_a_picture_is_a_scene_without_touch(tmp_path):
    import cv2

    image = made_scene().image
    cv2.imwrite(str(tmp_path / "i.png"), image)
    scene = read_scene(tmp_path / "i.png")
    np.testing.assert_array_equal(scene.image, image)
    assert scene.touch is None
    with pytest.raises(RecordingError, match="picture holds no touch"):
        read_touch(tmp_path / "i.png")
    (tmp_path / "j.png").write_bytes(b"nothing")
    with pytest.raises(ImageError):
        read_scene(tmp_path / "j.png")


def test_a_table_is_a_scene_without_image(tmp_path):
    write_touch(tmp_path / "t.csv", made_touch())
    scene = read_scene(tmp_path / "t.csv")
    assert scene.image is None
    assert scene.camera is None
    assert_same_touch(scene.touch, made_touch())


@pytest.mark.parametrize("read", [read_scene, read_touch])
def test_files_that_are_not_there_or_not_known(tmp_path, read):
    with pytest.raises(RecordingError, match="no such file"):
        read(tmp_path / "absent.mcap")
    with pytest.raises(RecordingError, match="folder"):
        read(tmp_path)
    (tmp_path / "a.docx").write_bytes(b"x")
    with pytest.raises(RecordingError, match=r"unknown format \.docx"):
        read(tmp_path / "a.docx")


def test_writers_refuse_what_they_can_not_store(tmp_path):
    with pytest.raises(RecordingError, match="unknown format"):
        write_touch(tmp_path / "t.xlsx", made_touch())
    with pytest.raises(RecordingError, match=r"\.mcap"):
        write_scene(tmp_path / "t.csv", made_scene())
    with pytest.raises(RecordingError, match="neither"):
        write_scene(tmp_path / "t.mcap", Scene(None, None, None))
    with pytest.raises(RecordingError, match="camera is for 64x48 px"):
        write_scene(tmp_path / "t.mcap", replace(made_scene(), image=made_scene().image[:20]))
    with pytest.raises(ImageError):
        write_scene(tmp_path / "t.mcap", replace(made_scene(), image=np.full((48, 64), np.nan)))
    for shift in (-made_touch().time_ns[0] - 1, 2**61):
        with pytest.raises(RecordingError, match="between 1970 and 2038"):
            write_touch(tmp_path / "t.mcap", replace(made_touch(), time_ns=made_touch().time_ns + shift))
    bad = replace(made_touch(), time_ns=made_touch().time_ns[::-1])
    for suffix in (".mcap", ".csv", ".npz"):
        with pytest.raises(RecordingError, match="does not increase"):
            write_touch(tmp_path / f"t{suffix}", bad)
    with pytest.raises(RecordingError, match="does not exist"):
        write_touch(tmp_path / "absent" / "t.csv", made_touch())
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_half_written(tmp_path):
    file = tmp_path / "t.csv"
    file.write_text("before")

    def fail(error):
        with replacing(file) as beside:
            beside.write_text("half")
            raise error

    with pytest.raises(RecordingError, match="No space left"):
        fail(OSError(28, "No space left on device"))
    with pytest.raises(KeyboardInterrupt):
        fail(KeyboardInterrupt())
    assert file.read_text() == "before"
    assert [path.name for path in tmp_path.iterdir()] == ["t.csv"]


def test_a_full_disk_leaves_nothing(tmp_path, monkeypatch):
    def full(*_args, **_kwargs):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    for suffix in (".csv", ".npz", ".mcap"):
        with pytest.raises(RecordingError, match="writing failed: No space left"):
            write_touch(tmp_path / f"t{suffix}", made_touch())
    assert list(tmp_path.iterdir()) == []


def test_a_new_file_has_ordinary_permissions(tmp_path):
    (tmp_path / "plain").touch()
    write_touch(tmp_path / "t.csv", made_touch())
    assert (tmp_path / "t.csv").stat().st_mode == (tmp_path / "plain").stat().st_mode
