"""Fingertips by name and from files, and where their pole is."""

import json
import sys

import numpy as np
import pytest

from evifuse.errors import EvifuseError, MissingExtraError, RecordingError, UsageError
from evifuse.recordings.recording import Fingertip
from evifuse.touch.fingersurface import SphereSurface, surface_of
from evifuse.touch.fingertip import spherical_fingertip, taxel_pitch_m
from evifuse.touch.layouts import load_fingertip
from evifuse.touch.paxini import paxini_sensors
from evifuse.touch.pole import facing_down, pole_of

TIP = spherical_fingertip(0.008, 0.002, 1.0)


def written(path, columns, values, head=""):
    rows = "\n".join(",".join(f"{v:.9g}" for v in row) for row in values)
    path.write_text(f"{head}{columns}\n{rows}\n")
    return path


def test_a_csv_gives_back_what_was_laid_out(tmp_path):
    both = np.column_stack([TIP.positions_m, TIP.normals])
    tip = load_fingertip(written(tmp_path / "tip.csv", "x_m,y_m,z_m,nx,ny,nz", both))
    assert np.allclose(tip.positions_m, TIP.positions_m, atol=1e-9)
    assert np.allclose(tip.normals, TIP.normals, atol=1e-6)
    assert tip.radius_m == pytest.approx(0.008, rel=1e-5)


def test_columns_say_their_unit_and_may_come_in_any_order(tmp_path):
    file = written(
        tmp_path / "tip.csv", "z_mm,x_mm,y_mm", 1e3 * TIP.positions_m[:, [2, 0, 1]], "# radius_m: 0.0081\n"
    )
    tip = load_fingertip(file)
    assert np.allclose(tip.positions_m, TIP.positions_m, atol=1e-9)
    assert np.min(np.sum(tip.normals * TIP.normals, axis=1)) > np.cos(np.radians(2))
    assert tip.radius_m == 0.0081


@pytest.mark.parametrize(("key", "scale"), [("positions_m", 1.0), ("positions_mm", 1e3)])
def test_a_json_file_may_leave_out_normals_and_radius(tmp_path, key, scale):
    file = tmp_path / "tip.json"
    file.write_text(json.dumps({key: (scale * TIP.positions_m).tolist()}))
    tip = load_fingertip(file)
    assert np.allclose(tip.positions_m, TIP.positions_m)
    assert tip.radius_m == pytest.approx(0.008, rel=0.02)
    file.write_text(json.dumps({key: (scale * TIP.positions_m).tolist(), "normals": TIP.normals.tolist()}))
    assert isinstance(surface_of(load_fingertip(file)), SphereSurface)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("tip.csv", "", "the file is empty"),
        ("tip.csv", "x,y,z\n0,0,0\n", "column 'x_m' is missing"),
        ("tip.csv", "x_m,y_m,z_m\n0,0\n", "tip.csv:2: 2 values for 3 columns"),
        ("tip.csv", "x_m,y_m,z_m\n0,0,a\n", "tip.csv:2: not a number"),
        ("tip.csv", "x_m,y_m,z_m\n", "N >= 1"),
        ("tip.csv", "x_m,y_m,z_m\n0,0,0\n1,0,0\n", "too few|no fingertip"),
        ("tip.csv", "x_m,y_m,z_m\n0,0,nan\n1,0,0\n", "NaN"),
        ("tip.csv", "x_m,y_m,z_m\n0,0,-8\n5,0,-7\n-5,0,-7\n0,5,-7\n", "millimetres"),
        ("tip.csv", "x_m,y_m,z_m\n0,0,0\n0.01,0,0\n", "too few to estimate normals"),
        ("tip.csv", "# radius_m: -1\nx_m,y_m,z_m,nx,ny,nz\n0,0,0,0,0,-1\n", "radius_m must be in"),
        ("tip.csv", "x_m,y_m,z_m,nx,ny,nz\n0,0,0,0,0,-2\n", "length 1"),
        ("tip.json", "{", "not JSON"),
        ("tip.json", "[1]", "'positions_m'"),
        ("tip.json", '{"positions_m": [["a", 1, 2]]}', "lists of three numbers"),
        ("tip.json", '{"positions_m": [[0, 0, 0]], "normals": [[0, 0, -1], [0, 0, 1]]}', "shape"),
        (
            "tip.json",
            '{"positions_m": [[0, 0, 0]], "normals": [[0, 0, -1]], "radius_m": "big"}',
            "one number",
        ),
    ],
)
def test_a_bad_layout_is_refused_in_one_line(tmp_path, name, content, message):
    (tmp_path / name).write_text(content)
    with pytest.raises(RecordingError, match=message) as caught:
        load_fingertip(tmp_path / name)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "name", ["tip.stl", "hand", "sphere:big", "sphere:0.01", "sphere:-1:0.001", "paxini:none"]
)
def test_an_unknown_name_is_refused_with_what_there_is(name):
    with pytest.raises(UsageError):
        load_fingertip(name)


def test_a_missing_file_or_package_is_said_in_one_line(tmp_path, monkeypatch):
    with pytest.raises(RecordingError, match="No such file"):
        load_fingertip(tmp_path / "none.csv")
    monkeypatch.setitem(sys.modules, "paxini_sdk", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'evifuse\[paxini\]'") as caught:
        load_fingertip("paxini:DP-S2015-Elite")
    assert isinstance(caught.value, EvifuseError)


def test_every_real_layout_faces_down_and_has_a_convex_cap():
    sensors = paxini_sensors()
    assert len(sensors) == 12
    for sensor in sensors:
        tip = load_fingertip(f"paxini:{sensor.name}")
        assert len(tip.positions_m) == sensor.taxels
        assert 0.0015 < taxel_pitch_m(tip) < 0.0045
        assert np.allclose(np.linalg.norm(tip.normals, axis=1), 1)
        point, normal, radius = pole_of(tip)
        assert np.allclose(point, [0, 0, -tip.radius_m], atol=2e-6)
        assert normal[2] < -0.99999
        assert radius == pytest.approx(tip.radius_m, rel=1e-3)
        surface = surface_of(tip)
        nearest, facing = surface.project(tip.positions_m)
        assert np.abs(surface.distance(tip.positions_m)).max() < 2e-5
        assert np.linalg.norm(nearest - tip.positions_m, axis=1).max() < 2e-5
        if sensor.kind != "palm":
            assert 0.004 < tip.radius_m < 0.04, sensor.name
            assert np.median(np.sum(facing * tip.normals, axis=1)) > np.cos(np.radians(4)), sensor.name
            outward = np.sum(tip.normals * (tip.positions_m - tip.positions_m.mean(axis=0)), axis=1)
            assert np.mean(outward > -0.0005) > 0.95


def test_a_sensor_has_three_names():
    tips = [
        load_fingertip(f"paxini:{name}")
        for name in ("DP-S2015-Elite", "pxsr-stddp03g", "PX6AX-GEN3-DP-S2015-Elite")
    ]
    assert all(np.array_equal(tip.positions_m, tips[0].positions_m) for tip in tips)
    assert len(tips[0].positions_m) == 52


def test_the_frame_of_a_layout_does_not_matter_once_it_faces_down():
    turn = np.linalg.qr(np.random.default_rng(4).standard_normal((3, 3)))[0]
    turn *= np.linalg.det(turn)
    moved = Fingertip(0.008, TIP.positions_m @ turn.T + [0.1, 0.2, -0.3], TIP.normals @ turn.T)
    tip = facing_down(moved)
    assert tip.radius_m == pytest.approx(0.008)
    assert np.allclose(tip.positions_m, 0.008 * tip.normals, atol=1e-8)
    assert np.mean(tip.normals[:, 2]) == pytest.approx(np.mean(TIP.normals[:, 2]), abs=1e-3)
    upside = Fingertip(0.008, -TIP.positions_m, -TIP.normals)
    assert facing_down(upside).normals[:, 2].max() < 0
