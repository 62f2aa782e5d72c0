"""What ``evifuse touch`` takes in and gives out: many files, live samples, drawings, bad input."""

import io
import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from evifuse.app.main import main
from evifuse.recordings import read_touch, write_touch
from evifuse.recordings.recording import TouchRecording
from evifuse.simulation import simulate

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    def call(*arguments: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as stopped:
            main(["touch", *map(str, arguments)])
        out, err = capsys.readouterr()
        assert isinstance(stopped.value.code, int)
        assert "Traceback" not in err
        assert "internal error" not in err
        return stopped.value.code, out, err

    return call


@pytest.fixture(scope="module")
def rolled() -> TouchRecording:
    """A finger of few taxels that rolls over a saddle, 200 samples each second."""
    touch = simulate("saddle", rate_hz=200, picture=False).scene.touch
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
    tip = rolled.fingertip
    layout = {
        "radius_m": tip.radius_m,
        "positions_m": tip.positions_m.tolist(),
        "normals": tip.normals.tolist(),
    }
    (file.parent / "tip.json").write_text(json.dumps(layout))
    code, out, _ = run(table, "--fingertip", file.parent / "tip.json", "--json")
    assert code == 0
    assert k1(out) == pytest.approx(k1(run(file, "--json")[1]), rel=1e-4)


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
    assert json.loads(out)["sites"][0]["k1_per_m"] is None
    assert "one direction only" in json.loads(out)["warnings"][0]


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
        code, out, err = run(file)
        assert err.count("\n") == 1
        if suffix == "csv":
            assert code == 0
            assert "is cut off" in err
        else:
            assert (code, out) == (2, "")
            assert "not a whole" in err


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
    assert said[-1] == "evifuse: 2000 samples felt, 8 lines left out"


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


def test_a_drawing_of_nothing_felt(run: Run, rolled: TouchRecording, tmp_path: Path) -> None:
    air = altered(rolled, tmp_path / "air.npz", pressure_pa=0 * rolled.pressure_pa)
    assert run(air, "--draw", tmp_path / "air.png")[0] == 0
    assert cv2.imread(str(tmp_path / "air.png")) is not None
    assert read_touch(air).notes == ()
