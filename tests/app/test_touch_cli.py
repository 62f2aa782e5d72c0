"""What ``evifuse touch`` takes in and gives out: many files, live samples, drawings, bad input."""

import io
import json
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer

from evifuse.app import live
from evifuse.app.main import main
from evifuse.recordings import messages, read_touch, write_touch
from evifuse.recordings.recording import TouchRecording
from evifuse.simulation import simulate
from evifuse.touch import spherical_fingertip

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(call: Run) -> Run:
    return lambda *arguments: call("touch", *arguments)


@pytest.fixture
def call(capsys: pytest.CaptureFixture[str]) -> Run:
    def call(*arguments: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as stopped:
            main([*map(str, arguments)])
        out, err = capsys.readouterr()
        assert isinstance(stopped.value.code, int)
        assert "Traceback" not in err
        assert "internal error" not in err
        return stopped.value.code, out, err

    return call


@pytest.fixture(scope="module")
def rolled() -> TouchRecording:
    """A finger of few taxels that rolls over a saddle, 200 samples each second."""
    few = spherical_fingertip(pitch_m=0.001)
    touch = simulate("saddle", rate_hz=200, picture=False, fingertip=few).scene.touch
    assert touch is not None
    return touch


@pytest.fixture
def file(rolled: TouchRecording, tmp_path: Path) -> Path:
    write_touch(tmp_path / "saddle.npz", rolled)
    return tmp_path / "saddle.npz"


def k1(out: str) -> float:
    return json.loads(out)["sites"][0]["k1_per_m"]


@pytest.mark.parametrize("suffix", ["mcap", "csv", "parquet"])
def test_every_format_gives_the_same(run: Run, file: Path, rolled: TouchRecording, suffix: str) -> None:
    code, out, err = run(file, "--json")
    assert (code, err) == (0, "")
    other = file.with_suffix(f".{suffix}")
    write_touch(other, rolled)
    code, same, err = run(other, "--json")
    assert (code, err) == (0, "")
    assert k1(same) == pytest.approx(k1(out), rel=1e-4)
    assert json.loads(same)["decision"] == json.loads(out)["decision"] == "curved"


def test_a_folder_gives_a_line_for_each(run: Run, file: Path, rolled: TouchRecording) -> None:
    write_touch(file.parent / "b10.mcap", rolled)
    write_touch(file.parent / "b9.mcap", rolled)
    (file.parent / "notes.txt").write_text("no recording")
    (file.parent / "broken.npz").write_text("no recording either")
    drawings = file.parent / "drawings"
    code, out, err = run(file.parent, "--json", "--draw", drawings)
    assert code == 2
    assert [Path(json.loads(line)["path"]).name for line in out.splitlines()] == [
        "b9.mcap",
        "b10.mcap",
        "saddle.npz",
    ]
    assert "broken.npz: this is not a whole .npz" in err
    assert err.splitlines()[-1].endswith("1 file could not be used, named above")
    assert sorted(p.name for p in drawings.iterdir()) == ["b10.png", "b9.png", "saddle.png"]
    (file.parent / "broken.npz").unlink()
    code, out, err = run(file.parent / "*.*")
    header, *rows = out.splitlines()
    assert code == 0
    assert header.split()[0] == "recording"
    assert all("curved" in row and "k1 3" in row for row in rows)
    assert err.startswith("evifuse: 3 recordings of ")


def test_a_layout_stands_in_for_a_missing_one(run: Run, file: Path, rolled: TouchRecording) -> None:
    table = file.with_suffix(".csv")
    write_touch(table, rolled)
    lines = [line for line in table.read_text().splitlines() if not line.startswith("# ")]
    table.write_text("\n".join(lines))
    code, out, err = run(table)
    assert (code, out) == (2, "")
    assert "'# fingertip_radius_m: ...' is needed" in err
    write_tip(rolled, file.parent / "tip.json")
    code, out, _ = run(table, "--fingertip", file.parent / "tip.json", "--json")
    assert code == 0
    assert k1(out) == pytest.approx(k1(run(file, "--json")[1]), rel=1e-4)


def write_tip(rolled: TouchRecording, path: Path) -> None:
    """The fingertip of a recording as a layout."""
    tip = rolled.fingertip
    lists = {"positions_m": tip.positions_m.tolist(), "normals": tip.normals.tolist()}
    path.write_text(json.dumps({"radius_m": tip.radius_m} | lists))


def plain_bag(rolled: TouchRecording, folder: Path, plugin: StoragePlugin) -> Path:
    """What a robot's own recorder would write: poses, and arrays in kPa."""
    store = messages.typestore()
    types = store.types
    layout = types["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
    kinds = {"/arm/pose": "geometry_msgs/msg/PoseStamped", "/tip/raw": "std_msgs/msg/Float32MultiArray"}
    with Writer(folder, version=9, storage_plugin=plugin) as writer:
        links = {topic: writer.add_connection(topic, kind, typestore=store) for topic, kind in kinds.items()}
        for i, time_ns in enumerate(rolled.time_ns.tolist()):
            values = (rolled.pressure_pa[i] / 1000).astype(np.float32)
            sent = {
                "/arm/pose": messages.pose_message(time_ns, rolled.position_m[i], rolled.orientation_xyzw[i]),
                "/tip/raw": types[kinds["/tip/raw"]](layout=layout, data=values),
            }
            for topic, message in sent.items():
                writer.write(links[topic], time_ns, store.serialize_cdr(message, kinds[topic]))
    return folder


# Bad input


def altered(rolled: TouchRecording, path: Path, **values: object) -> Path:
    """An archive of the recording with other arrays, checked by nobody."""
    tip = rolled.fingertip
    arrays: dict[str, object] = {
        "radius_m": tip.radius_m,
        "positions_m": tip.positions_m,
        "normals": tip.normals,
    }
    for key in ("time_ns", "position_m", "orientation_xyzw", "joint_angle_rad", "pressure_pa"):
        arrays[key] = getattr(rolled, key)
    arrays |= values
    np.savez(path, **{key: value for key, value in arrays.items() if value is not None})
    return path


def test_pressures_in_unknown_units(run: Run, rolled: TouchRecording, tmp_path: Path) -> None:
    bad = altered(
        rolled, tmp_path / "u.npz", pressure_pa=None, pressure=rolled.pressure_pa, pressure_unit="counts"
    )
    code, out, err = run(bad)
    assert (code, out) == (2, "")
    assert err.startswith("evifuse: u.npz: unknown unit 'counts' of the taxel values: use one of Pa, ")
    assert err.count("\n") == 1


@pytest.mark.parametrize(("step", "says"), [(0, "two samples at time"), (-3_000_000, "at sample 700 ")])
def test_times_that_repeat_or_go_back(
    run: Run, rolled: TouchRecording, tmp_path: Path, step: int, says: str
) -> None:
    time_ns = rolled.time_ns.copy()
    time_ns[700] = time_ns[699] + step
    code, out, err = run(altered(rolled, tmp_path / "t.npz", time_ns=time_ns))
    assert (code, out) == (2, "")
    assert says in err
    assert "700" in err
    assert err.count("\n") == 1


def test_a_pose_at_a_lower_rate(run: Run, rolled: TouchRecording, file: Path, tmp_path: Path) -> None:
    slow = altered(
        rolled,
        tmp_path / "p.npz",
        pose_time_ns=rolled.time_ns[::4],
        position_m=rolled.position_m[::4],
        orientation_xyzw=rolled.orientation_xyzw[::4],
    )
    held = np.arange(len(rolled.time_ns)) // 4 * 4
    stairs = altered(
        rolled,
        tmp_path / "h.npz",
        position_m=rolled.position_m[held],
        orientation_xyzw=rolled.orientation_xyzw[held],
    )
    expected = k1(run(file, "--json")[1])
    for path, says in ((slow, "comes at 50 Hz, the pressures at 200 Hz"), (stairs, "changes only at 50 Hz")):
        code, out, err = run(path, "--json")
        assert code == 0
        assert says in err
        assert "interpolated" in err
        assert any(says in w for w in json.loads(out)["warnings"])
        assert k1(out) == pytest.approx(expected, rel=0.02)


def test_a_gap_of_seconds_is_not_bridged(run: Run, rolled: TouchRecording, tmp_path: Path) -> None:
    """In the midst of the first roll: it becomes two, of which neither knows of the other."""
    pressed = np.flatnonzero(rolled.pressure_pa.max(axis=1) > 1000)
    middle = pressed[0] + 110
    time_ns = rolled.time_ns + np.where(np.arange(len(rolled.time_ns)) > middle, 3_000_000_000, 0)
    code, out, err = run(altered(rolled, tmp_path / "g.npz", time_ns=time_ns), "--json")
    assert code == 0
    assert "no samples for 3.0" in err
    assert "not bridged" in err
    assert len(json.loads(out)["local_curvatures"]) > 4


def test_taxels_that_are_nan(run: Run, rolled: TouchRecording, file: Path, tmp_path: Path) -> None:
    pressure = rolled.pressure_pa.copy()
    pressure[:, [5, 9]] = np.nan
    pressure[[40, 900], 30] = np.nan
    code, out, err = run(altered(rolled, tmp_path / "n.npz", pressure_pa=pressure), "--json")
    assert code == 0
    assert "2 taxels (5, 9) are NaN throughout, left out of the fingertip" in err
    assert "2 samples (40, 900) are NaN in some pressure, left out" in err
    assert k1(out) == pytest.approx(k1(run(file, "--json")[1]), rel=0.05)


def test_one_direction_only(run: Run, rolled: TouchRecording, tmp_path: Path) -> None:
    count = int(1.1 * 200)
    short = replace(
        rolled,
        **{
            key: getattr(rolled, key)[:count]
            for key in ("time_ns", "position_m", "orientation_xyzw", "joint_angle_rad", "pressure_pa")
        },
    )
    write_touch(tmp_path / "one.npz", short)
    code, out, _ = run(tmp_path / "one.npz", "--json")
    assert code == 0
    (site,) = json.loads(out)["sites"]
    assert site["k1_per_m"] is None
    assert json.loads(out)["decision"] is None  # a trough, a saddle and a bowl alike
    assert site["known_curvature_per_m"] == pytest.approx(33.3, rel=0.02)
    assert site["known_standard_error_per_m"] > 0
    assert np.sin(site["known_direction_rad"]) == pytest.approx(0, abs=0.02)  # along the world's x axis
    assert site["unknown_direction_rad"] == pytest.approx(np.pi / 2, abs=0.02)
    (warning,) = json.loads(out)["warnings"]
    known, unknown = (round(float(np.degrees(site[f"{key}_direction_rad"]))) for key in ("known", "unknown"))
    assert f"in one direction only, along {known} degrees: the curvature along it is 33." in warning
    assert f"the one across it, along {unknown} degrees, can't be known" in warning
    code, out, _ = run(tmp_path / "one.npz")
    assert code == 0
    assert f"the one across it, along {unknown} degrees, can't be known" in out


def test_no_contact_at_all_is_evidence(run: Run, rolled: TouchRecording, tmp_path: Path) -> None:
    code, out, _ = run(altered(rolled, tmp_path / "air.npz", pressure_pa=0 * rolled.pressure_pa), "--json")
    assert code == 0
    belief = json.loads(out)["belief"]
    assert max(belief, key=belief.get) == "N"


def test_a_recording_cut_off_is_read_so_far_as_it_is_whole(
    run: Run, rolled: TouchRecording, tmp_path: Path
) -> None:
    whole = tmp_path / "w.mcap"
    write_touch(whole, rolled)
    data = whole.read_bytes()
    whole.write_bytes(data[: len(data) * 7 // 10])
    code, out, err = run(whole, "--json")
    assert code == 0
    assert "cut off or damaged" in err
    assert err.count("\n") == 1
    assert json.loads(out)["warnings"][0] in err
    whole.write_bytes(data[:300])
    code, out, err = run(whole)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1


def test_damage_anywhere_is_never_a_traceback(run: Run, rolled: TouchRecording, tmp_path: Path) -> None:
    """Cuts and flipped bytes at two hundred places; a short roll, so that each is quick."""
    keep = slice(0, 160)
    keys = ("time_ns", "position_m", "orientation_xyzw", "joint_angle_rad")
    short = replace(
        rolled, **{key: getattr(rolled, key)[keep] for key in keys}, pressure_pa=rolled.pressure_pa[keep, :]
    )
    file = tmp_path / "d.mcap"
    write_touch(file, short)
    data = file.read_bytes()
    rng = np.random.default_rng(11)
    codes = []
    for number, place in enumerate(rng.integers(0, len(data), 200).tolist()):
        changed = bytearray(data[:place] if number % 2 else data)
        if number % 2 == 0:
            changed[place] ^= int(rng.integers(1, 256))
        file.write_bytes(bytes(changed))
        codes.append(run(file, "--json")[0])
    assert set(codes) == {0, 2}


def test_other_formats_that_are_cut(run: Run, rolled: TouchRecording, tmp_path: Path) -> None:
    for suffix in ("npz", "parquet", "csv"):
        file = tmp_path / f"c.{suffix}"
        write_touch(file, rolled)
        data = file.read_bytes()
        file.write_bytes(data[: len(data) * 3 // 4])
        code, out, err = run(file, "--json")
        assert err.count("\n") == 1
        if suffix == "parquet":  # its directory is at the end
            assert (code, out) == (2, "")
            assert "not a whole Parquet file (nothing of one that is cut off can be read" in err
        else:
            assert code == 0
            assert "is cut off" in err
            assert json.loads(out)["decision"] == "curved"


@pytest.mark.parametrize("name", ["f.mcap", "f.csv", "f.npz"])
def test_fusion_takes_what_is_whole_of_a_recording_that_is_cut(
    call: Callable[..., tuple[int, str, str]], rolled: TouchRecording, tmp_path: Path, name: str
) -> None:
    file = tmp_path / name
    write_touch(file, rolled)
    data = file.read_bytes()
    file.write_bytes(data[: len(data) * 3 // 4])
    code, out, err = call("fuse", "--touch", file, "--json")
    assert code == 0
    assert "cut off" in err
    assert err.count("\n") == 1
    assert json.loads(out)["decision"] == "curved"
    assert any("cut off" in warning for warning in json.loads(out)["warnings"])
    code, out, err = call("fuse", "--touch", file)
    assert code == 0
    assert "cut off" in err
    assert "cut off" not in out


@pytest.mark.parametrize("plugin", list(StoragePlugin))
def test_a_bag_of_another_robot(
    call: Callable[..., tuple[int, str, str]], rolled: TouchRecording, tmp_path: Path, plugin: StoragePlugin
) -> None:
    """Pose and plain array on topics of their own, no joint; then the file is cut."""
    write_tip(rolled, tmp_path / "tip.json")
    folder = plain_bag(rolled, tmp_path / "bag", plugin)
    needed = ("--fingertip", tmp_path / "tip.json", "--unit", "kPa")
    code, out, err = call("touch", folder, *needed, "--json")
    assert code == 0
    said = err.splitlines()
    assert "pressures taken from topic /tip/raw" in said[0]
    assert "pose taken from topic /arm/pose" in said[1]
    assert "no joint angle: slip can't be told" in said[2]
    found = json.loads(out)
    assert found["decision"] == "curved"
    assert {roll["slip"] for roll in found["local_curvatures"]} == {None}
    assert {roll["joint_curvature_per_m"] for roll in found["local_curvatures"]} == {None}
    code, _, err = call("touch", folder, *needed, "--topics", "pose=/arm/pose,pressures=/tip/raw", "--json")
    assert (code, err.count("\n")) == (0, 1)  # what was named is not said
    code, out, _ = call("check", folder, *needed)
    assert code == 0
    assert "pose taken from topic /arm/pose" in out
    code, out, err = call("fuse", folder, *needed, "--json")
    assert code == 0
    assert json.loads(out)["decision"] == "curved"
    for missing, says in ((needed[2:], "or --fingertip"), (needed[:2], "give it with --unit")):
        code, out, err = call("touch", folder, *missing)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert says in err
    (file,) = (p for p in folder.iterdir() if p.suffix in (".mcap", ".db3"))
    file.write_bytes(file.read_bytes()[:-200])
    code, out, err = call("touch", folder, *needed, "--json")
    assert code == 0
    assert "cut off or damaged" in err
    assert json.loads(out)["decision"] == "curved"


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ((), "nothing to feel"),
        (("--live", "x.mcap"), "--live reads standard input"),
        (("x.mcap", "--every", "5"), "--every 5: it needs --live"),
        (("-", "--every", "0"), "--every 0"),
        (("-", "--draw", "x.png"), "live samples are not drawn"),
        (("--nothing",), "unknown option --nothing"),
    ],
)
def test_mistakes(run: Run, arguments: tuple[str, ...], says: str) -> None:
    code, out, err = run(*arguments)
    assert (code, out) == (2, "")
    assert says in err
    assert err.count("\n") == 1


# Live


def lines_of(touch: TouchRecording, tip: bool = True) -> list[str]:
    t = touch.fingertip
    known = {"radius_m": t.radius_m, "positions_m": t.positions_m.tolist(), "normals": t.normals.tolist()}
    first = [json.dumps({"fingertip": known})] if tip else []
    return first + [
        json.dumps(
            {
                "time_ns": int(touch.time_ns[i]),
                "position_m": touch.position_m[i].tolist(),
                "orientation_xyzw": touch.orientation_xyzw[i].tolist(),
                "joint_angle_rad": float(touch.joint_angle_rad[i]),
                "pressure_kpa": (touch.pressure_pa[i] / 1000).tolist(),
            }
        )
        for i in range(len(touch.time_ns))
    ]


def feed(monkeypatch: pytest.MonkeyPatch, lines: list[str]) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO("\n".join(lines)))


def test_live_ends_at_what_the_recording_says(
    run: Run, rolled: TouchRecording, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    feed(monkeypatch, lines_of(rolled))
    code, out, err = run("-", "--json")
    said = [json.loads(line) for line in out.splitlines()]
    assert code == 0
    assert len(said) >= 8  # a line for each of eight rolls
    assert [line["samples"] for line in said] == sorted({line["samples"] for line in said})
    assert said[-1]["sites"][0]["k1_per_m"] == pytest.approx(k1(run(file, "--json")[1]), rel=1e-6)
    assert err == "evifuse: 2000 samples felt\n"


def test_live_every_so_many_samples(
    run: Run, rolled: TouchRecording, monkeypatch: pytest.MonkeyPatch
) -> None:
    feed(monkeypatch, lines_of(rolled))
    code, out, _ = run("--live", "--every", 100, "--json")
    said = [json.loads(line) for line in out.splitlines()]
    assert code == 0
    assert [line["samples"] for line in said[:-1]] == list(range(100, 2001, 100))
    known = [line["k1_per_m"] for line in said[:-1] if line["k1_per_m"] is not None]
    assert np.median(known) == pytest.approx(33.3, rel=0.1)
    assert "decision" in said[-1]


def test_live_lines_that_can_not_be_used_are_left_out(
    run: Run, rolled: TouchRecording, monkeypatch: pytest.MonkeyPatch
) -> None:
    good = lines_of(rolled)
    sample = json.loads(good[500])
    bad = [
        "{",
        "[1]",
        json.dumps({**sample, "pressure_kpa": [1.0]}),
        json.dumps({**sample, "position_m": None}),
    ]
    nan = json.dumps({**sample, "pressure_kpa": [None] * len(sample["pressure_kpa"])})
    sample["pressure"] = sample.pop("pressure_kpa")
    bad += [json.dumps(sample), json.dumps({**sample, "pressure_unit": "psi"}), nan]
    feed(monkeypatch, [*good[:500], *bad, good[100], "", *good[500:]])
    code, out, err = run("-", "--json")
    assert code == 0
    assert len(out.splitlines()) >= 8
    said = err.splitlines()
    for number, text in enumerate(
        ("not JSON", "not a JSON object", "pressure_kpa must be", "position_m must be")
    ):
        assert f"line {501 + number} is left out: " in said[number]
        assert text in said[number]
    assert "'pressure' has no unit" in said[4]
    assert err.count("is left out") == 5  # named one by one
    assert said[-1] == "evifuse: 2000 samples felt, 8 lines left out"


def test_live_with_a_dead_taxel_and_without_a_joint(
    run: Run, rolled: TouchRecording, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = [json.loads(line) for line in lines_of(rolled)]
    for line in lines[1:]:
        line["pressure_kpa"][40] = None
        del line["joint_angle_rad"]
    feed(monkeypatch, [json.dumps(line) for line in lines])
    code, out, err = run("-", "--json")
    assert code == 0
    last = json.loads(out.splitlines()[-1])
    assert last["sites"][0]["k1_per_m"] == pytest.approx(k1(run(file, "--json")[1]), rel=0.02)
    assert last["local_curvatures"][0]["slip"] is None
    said = err.splitlines()
    assert said[0] == "evifuse: live: taxel 40 is NaN throughout, left out of the fingertip"
    assert "no joint angle" in said[1]
    assert said[2:] == ["evifuse: 2000 samples felt"]  # each is said once


def test_live_when_the_clock_is_set_back(
    run: Run, rolled: TouchRecording, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A sensor that is switched on again counts from anew; single late lines are left out."""
    lines = lines_of(rolled)
    feed(monkeypatch, [*lines[:900], lines[300], *lines[900:1001], *lines[1:1001]])
    code, out, err = run("-", "--json")
    assert code == 0
    assert "the clock was set back by" in err
    assert err.splitlines()[-1] == "evifuse: 1951 samples felt, 50 lines left out"
    assert json.loads(out.splitlines()[-1])["time_ns"] == int(rolled.time_ns[999])


def test_live_takes_no_longer_after_many_samples(
    run: Run, rolled: TouchRecording, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is felt after a contact is bounded, and the last line looks back further."""
    monkeypatch.setattr(live, "RECENT", 600)
    monkeypatch.setattr(live, "LONGEST_WINDOW", 1200)
    felt: list[int] = []
    sense = live.sense_curvature

    def counted(recording: TouchRecording, *more: Any, **options: Any) -> Any:
        felt.append(len(recording.time_ns))
        return sense(recording, *more, **options)

    monkeypatch.setattr(live, "sense_curvature", counted)
    feed(monkeypatch, lines_of(rolled))
    code, out, _ = run("-", "--json")
    assert code == 0
    assert max(felt[:-1]) == 600
    assert felt[-1] == 1200
    assert json.loads(out.splitlines()[-1])["samples"] == 2000


def test_live_tells_what_it_knows_at_ctrl_c(rolled: TouchRecording, tmp_path: Path) -> None:
    """A slow producer: each line comes out when its contact ends, and the signal asks for the last."""
    lines = [line.encode() for line in lines_of(rolled)]
    command = [sys.executable, "-m", "evifuse", "touch", "-", "--json"]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdin.write(b"\n".join([lines[0], b"\xff\xfe{", *lines[1:700]]) + b"\n")
        process.stdin.flush()
        first = json.loads(process.stdout.readline())  # while the pipe is open
        assert first["samples"] < 400
        second = json.loads(process.stdout.readline())
        assert first["samples"] < second["samples"] < 700
        process.send_signal(signal.SIGINT)
        rest, said = process.stdout.read().splitlines(), process.stderr.read().decode().splitlines()
    assert process.returncode == 130
    last = json.loads(rest[-1])
    assert second["samples"] <= last["samples"] <= 699
    assert last["local_curvatures"]
    assert "line 2 is left out: it is not JSON" in said[0]
    assert said[-1] == f"evifuse: stopped: {last['samples']} samples felt, 1 lines left out"


def test_live_without_a_fingertip_or_samples(
    run: Run, rolled: TouchRecording, monkeypatch: pytest.MonkeyPatch
) -> None:
    for lines, says in (
        (lines_of(rolled, tip=False)[:3], "the fingertip is not known: give --fingertip"),
        ([], "no sample could be used"),
        (lines_of(rolled)[:1], "no sample could be used"),
        (['{"fingertip": {"radius_m": "x"}}'], "the fingertip needs the numbers"),
    ):
        feed(monkeypatch, lines)
        code, out, err = run("-")
        assert (code, out) == (2, "")
        assert says in err
        assert err.count("\n") == 1


# Drawing


@pytest.mark.parametrize("surface", ["plane", "hole", "edge"])
def test_drawings_are_pictures(run: Run, tmp_path: Path, surface: str) -> None:
    touch = simulate(surface, rate_hz=200, picture=False).scene.touch
    assert touch is not None
    write_touch(tmp_path / "s.npz", touch)
    assert run(tmp_path / "s.npz", "--draw", tmp_path / "s.png")[0] == 0
    image = cv2.imread(str(tmp_path / "s.png"))
    assert image.shape == (950, 1300, 3)
    quarters = [image[y : y + 475, x : x + 650] for y in (0, 475) for x in (0, 650)]
    assert all((q < 200).any(axis=2).mean() > 0.004 for q in quarters)


def test_drawings_of_little(run: Run, rolled: TouchRecording, tmp_path: Path) -> None:
    """Without contact the fingertip's path is drawn; after one direction, the one arrow that is known."""
    air = altered(rolled, tmp_path / "air.npz", pressure_pa=0 * rolled.pressure_pa)
    assert run(air, "--draw", tmp_path / "air.png")[0] == 0
    keys = ("time_ns", "position_m", "orientation_xyzw", "joint_angle_rad", "pressure_pa")
    one = altered(rolled, tmp_path / "one.npz", **{key: getattr(rolled, key)[:220] for key in keys})
    assert run(one, "--draw", tmp_path / "one.png")[0] == 0
    path = cv2.imread(str(tmp_path / "air.png"))[60:470, 120:530]
    assert ((path == 201).all(axis=2)).sum() > 500  # the grey of the path
    bends = cv2.imread(str(tmp_path / "one.png"))[100:470, 120:580].astype(int)
    red = (bends[:, :, 2] > 150) & (bends[:, :, 1] < 100) & (bends[:, :, 0] < 100)
    assert red.sum() > 200
    assert read_touch(air).notes == ()
