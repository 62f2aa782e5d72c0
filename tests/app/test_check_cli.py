"""What ``evifuse check`` says of recordings that lack something."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from evifuse.app.main import main
from evifuse.recordings import write_scene, write_touch
from evifuse.recordings.recording import Scene, TouchRecording
from evifuse.simulation import simulate

Run = Callable[..., tuple[int, str, str]]
SAMPLES = ("time_ns", "position_m", "orientation_xyzw", "joint_angle_rad", "pressure_pa")


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    def call(*arguments: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as stopped:
            main(["check", *map(str, arguments)])
        out, err = capsys.readouterr()
        assert isinstance(stopped.value.code, int)
        assert "Traceback" not in err
        assert "internal error" not in err
        return stopped.value.code, out, err

    return call


@pytest.fixture(scope="module")
def scene() -> Scene:
    return simulate("cylinder", rate_hz=100).scene


@pytest.fixture(scope="module")
def rolled(scene: Scene) -> TouchRecording:
    assert scene.touch is not None
    return scene.touch


def texts(out: str, part: str, verdict: str) -> list[str]:
    return [f["text"] for f in json.loads(out)["findings"] if (f["part"], f["verdict"]) == (part, verdict)]


def stored(rolled: TouchRecording, path: Path, **values: object) -> Path:
    """An archive with other arrays, checked by nobody; None leaves one out."""
    tip = rolled.fingertip
    arrays = {"radius_m": tip.radius_m, "positions_m": tip.positions_m, "normals": tip.normals}
    arrays |= {key: getattr(rolled, key) for key in SAMPLES}
    arrays |= values
    np.savez(path, **{key: value for key, value in arrays.items() if value is not None})
    return path


def test_a_sound_scene_is_fine(run: Run, scene: Scene, tmp_path: Path) -> None:
    write_scene(tmp_path / "s.mcap", scene)
    code, out, err = run(tmp_path / "s.mcap", "--json")
    assert (code, err) == (0, "")
    found = json.loads(out)
    assert found["usable"] is True
    parts = dict.fromkeys(f["part"] for f in found["findings"])
    assert list(parts) == ["file", "time", "pose", "joint", "pressures", "fingertip", "contact", "picture"]
    assert texts(out, "time", "fine") == ["1000 samples in 9.990 s, 100 Hz"]
    assert any("k1 and k2 can be known" in text for text in texts(out, "contact", "fine"))
    assert texts(out, "picture", "fine") == ["640 x 480 px, with camera and pose"]
    code, out, _ = run(tmp_path / "s.mcap")
    assert code == 0
    assert "8 rolls over 2 sites" in out


def test_several_lacks_are_all_listed(run: Run, rolled: TouchRecording, tmp_path: Path) -> None:
    time_ns = rolled.time_ns.copy()
    time_ns[[10, 20]] = time_ns[[9, 19]]
    bad = stored(
        rolled, tmp_path / "b.npz", time_ns=time_ns, joint_angle_rad=None, pressure_pa=None,
        pressure=rolled.pressure_pa, pressure_unit="counts", orientation_xyzw=rolled.orientation_xyzw * 2,
    )  # fmt: skip
    code, out, err = run(bad, "--json")
    assert code == 2
    assert err.endswith("an estimate would be refused, for the reasons above\n")
    assert err.count("\n") == 1
    assert "samples 10, 20" in texts(out, "time", "refused")[0]
    assert texts(out, "joint", "note") == [
        "none: slip can't be told, and there is no estimate by the chapter"
    ]
    assert "unknown unit 'counts'" in texts(out, "pressures", "refused")[0]
    assert any("length 1" in text for text in texts(out, "pose", "refused"))
    assert run(bad)[0] == 2


def test_what_can_not_be_known_is_said(run: Run, rolled: TouchRecording, tmp_path: Path) -> None:
    short = replace(rolled, **{key: getattr(rolled, key)[:110] for key in SAMPLES})
    write_touch(tmp_path / "one.csv", short)
    code, out, _ = run(tmp_path / "one.csv", "--json")
    assert code == 0
    assert texts(out, "contact", "note") == [
        "site 0 rolled along 0 degrees only: the curvature across, at 90 degrees, can't be known"
    ]
    air = stored(rolled, tmp_path / "air.npz", pressure_pa=0 * rolled.pressure_pa)
    code, out, _ = run(air, "--json")
    assert code == 0
    assert texts(out, "contact", "note") == ["none: this is evidence of N, no surface"]
    assert any("nothing was pressed" in text for text in texts(out, "pressures", "note"))


def test_what_is_hardly_meant_is_said_beside_what_to_do(
    run: Run, rolled: TouchRecording, tmp_path: Path
) -> None:
    tip = rolled.fingertip
    for part, verdict, says, values in (
        ("pose", "note", "in mm? metres are needed", {"position_m": rolled.position_m * 1000}),
        ("pose", "note", "w, x, y, z? give", {"orientation_xyzw": rolled.orientation_xyzw[:, [3, 0, 1, 2]]}),
        ("joint", "note", "in degrees?", {"joint_angle_rad": np.rad2deg(rolled.joint_angle_rad)}),
        ("fingertip", "refused", "positions in mm?", {"positions_m": tip.positions_m * 1000}),
        ("fingertip", "refused", "in (0, 1) m, not 10", {"radius_m": tip.radius_m * 1000}),
        ("pressures", "note", "is the unit right?", {"pressure_pa": rolled.pressure_pa / 1000}),
        ("time", "refused", "is it in us? multiply by 1000", {"time_ns": rolled.time_ns // 1000}),
        ("pressures", "refused", "have no unit", {"pressure_pa": None, "pressure": rolled.pressure_pa}),
    ):
        code, out, _ = run(stored(rolled, tmp_path / "odd.npz", **values), "--json")
        assert code == (0 if verdict == "note" else 2)
        assert any(says in text for text in texts(out, part, verdict))
        said = {f["part"] for f in json.loads(out)["findings"] if f["verdict"] != "fine"}
        assert part in said <= {part, "contact", "file"}


def test_rates_gaps_and_defective_taxels_are_notes(run: Run, rolled: TouchRecording, tmp_path: Path) -> None:
    late = rolled.time_ns + np.where(np.arange(1000) >= 500, 2_000_000_000, 0)
    pressure = rolled.pressure_pa.copy()
    pressure[:, int(np.argmax(pressure.max(axis=0)))] = 0.0
    pressure[:, 0] = np.nan
    held = np.arange(1000) // 3 * 3
    odd = stored(
        rolled, tmp_path / "o.npz", time_ns=late, pressure_pa=pressure,
        position_m=rolled.position_m[held], orientation_xyzw=rolled.orientation_xyzw[held],
    )  # fmt: skip
    code, out, _ = run(odd, "--json")
    assert code == 0
    assert texts(out, "time", "note") == ["gap of 2.01 s after 4.99 s: rolls end there"]
    assert any("33.33 Hz (repeated in between)" in text for text in texts(out, "pose", "note"))
    assert any("NaN throughout: taxels 0" in text for text in texts(out, "pressures", "note"))
    assert any("dead" in text for text in texts(out, "pressures", "note"))


def test_files_that_can_not_be_read_entirely(run: Run, rolled: TouchRecording, tmp_path: Path) -> None:
    file = tmp_path / "c.mcap"
    write_touch(file, rolled)
    data = file.read_bytes()
    file.write_bytes(data[: len(data) - 500])
    code, out, _ = run(file, "--json")
    assert code == 0
    assert "cut off or damaged after" in texts(out, "file", "note")[0]
    file.write_bytes(data[:200])
    code, out, err = run(file, "--json")
    assert code == 2
    assert any("no touch in it" in text for text in texts(out, "file", "refused"))
    (tmp_path / "x.npz").write_bytes(b"nothing")
    code, out, err = run(tmp_path / "x.npz")
    assert code == 2
    assert "not a whole .npz" in out
    code, out, err = run(tmp_path / "absent.mcap")
    assert (code, out) == (2, "")
    assert err == f"evifuse: {tmp_path}/absent.mcap: there is no such file: check its name\n"
    assert run()[0] == 2


def test_many_are_checked_one_by_one(run: Run, rolled: TouchRecording, tmp_path: Path) -> None:
    write_touch(tmp_path / "a.npz", rolled)
    (tmp_path / "b.npz").write_bytes(b"nothing")
    code, out, err = run(tmp_path, "--json")
    assert code == 2
    assert [json.loads(line)["usable"] for line in out.splitlines()] == [True, False]
    assert err == "evifuse: 1 of 2 recordings would be refused\n"
