"""``evifuse simulate``: recordings, random data sets and their truth, and what it refuses."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from evifuse.app.main import main
from evifuse.simulation import SURFACES, dataset, primitive_of, surface

resource = pytest.importorskip("resource")
Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(capfd: pytest.CaptureFixture[str]) -> Run:
    def call(*arguments: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as stopped:
            main([str(argument) for argument in arguments])
        out, err = capfd.readouterr()
        assert isinstance(stopped.value.code, int)
        assert "Traceback" not in err
        assert "internal error" not in err
        return stopped.value.code, out, err

    return call


def random_set(folder: Path) -> tuple[object, ...]:
    return ("simulate", "--random", 3, "--seed", 7, "--noise", "modest", "--json", "-o", folder)


def contents(folder: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in sorted(folder.iterdir())}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("whole") / "set"
    with pytest.raises(SystemExit) as stopped:
        main([str(argument) for argument in random_set(folder)])
    assert stopped.value.code == 0
    return folder


def test_a_stopped_run_goes_on_and_gives_the_same_bytes(
    whole: Path, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, write = tmp_path / "set", dataset.write_scene

    def stopped(path: Path, scene: object) -> None:
        if path.name == "00002.mcap":
            raise KeyboardInterrupt
        write(path, scene)

    monkeypatch.setattr(dataset, "write_scene", stopped)
    code, out, err = run(*random_set(folder))
    assert (code, out, err.strip()) == (130, "", "evifuse: stopped")
    monkeypatch.undo()
    half = folder / "00001.mcap"
    half.write_bytes(half.read_bytes()[:-1000])
    before = (folder / "00000.mcap").stat().st_mtime_ns
    code, out, err = run(*random_set(folder))
    assert (code, json.loads(out)["written"], err) == (0, 2, "")  # no progress bar but on a terminal
    assert (folder / "00000.mcap").stat().st_mtime_ns == before
    assert contents(folder) == contents(whole)


def test_the_truth_is_that_of_its_surface_and_every_recording_opens(whole: Path, run: Run) -> None:
    rows = [json.loads(line) for line in (whole / "truth.jsonl").read_text().splitlines()]
    assert [row["file"] for row in rows] == ["00000.mcap", "00001.mcap", "00002.mcap"]
    for row in rows:
        kind = surface(row["surface"], **row["dimensions"])
        assert row["class"] == kind.category
        assert row["fingertip"] == "sphere"
        assert row["noise_levels"]["pressure_pa"] == 200
        assert row["primitive"] in {site["primitive"] for site in row["sites"]}
        for site in row["sites"]:
            assert site["contact"] == (site["primitive"] != "N")
            if site["contact"]:
                curvatures = kind.principal_curvatures(np.array(site["position_m"]))
                np.testing.assert_allclose((site["k1_per_m"], site["k2_per_m"]), curvatures, atol=1e-9)
                assert primitive_of(*curvatures, 0.01) == site["primitive"]
        assert run("touch", whole / row["file"], "--json")[0] == 0


def test_another_data_set_is_not_continued(whole: Path, run: Run) -> None:
    code, _, err = run("simulate", "--random", 3, "--seed", 8, "--noise", "modest", "-o", whole)
    assert code == 2
    assert "is of another data set" in err


def test_a_progress_bar_is_shown_on_a_terminal(tmp_path: Path) -> None:
    pty = pytest.importorskip("pty")
    command = [sys.executable, "-m", "evifuse", "simulate", "--random", "1", "-o", str(tmp_path / "set")]
    leader, follower = pty.openpty()
    on_terminal = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=follower, env=os.environ | {"TERM": "xterm"}
    )
    os.close(follower)
    seen = b""
    while True:
        try:
            part = os.read(leader, 4096)
        except OSError:  # how a terminal says that nobody writes to it any longer
            break
        if not part:
            break
        seen += part
    os.close(leader)
    on_terminal.communicate()
    assert on_terminal.returncode == 0
    assert b"100%" in seen


def test_the_catalogue_is_listed(run: Run) -> None:
    code, out, _ = run("simulate", "--list", "--json")
    assert code == 0
    assert [row["surface"] for row in json.loads(out)] == list(SURFACES)
    assert "radius_m" in run("simulate", "--list")[1]


def box(path: Path, size: float, *, faces: int = 12) -> Path:
    import trimesh

    mesh = trimesh.creation.box((size, size, size))
    trimesh.Trimesh(mesh.vertices, mesh.faces[:faces], process=False).export(path)
    return path


def test_what_can_not_be_simulated_is_said_in_one_line(run: Run, tmp_path: Path) -> None:
    cases = [
        ((box(tmp_path / "mm.stl", 60.0),), "were they millimetres"),
        ((box(tmp_path / "open.stl", 0.06, faces=11),), "not watertight"),
        (("nothing.stl",), "no such mesh file"),
        (("cilinder",), "did you mean 'cylinder'"),
        (("bowl", "--radius", 0.011), "smallest radius that it fits into is 0.012"),
        (("plane", "--mesh", "a.stl"), "is for --random"),
        (("--random", 0), "at least one recording"),
        (("--random", 2, "--mesh", tmp_path / "mm.stl"), "were they millimetres"),
    ]
    for arguments, said in cases:
        code, out, err = run("simulate", *arguments, "-o", tmp_path / "out.mcap")
        assert (code, out, len(err.splitlines())) == (2, "", 1), err
        assert said in err
        assert not (tmp_path / "out.mcap").is_file()


@pytest.mark.parametrize(("module", "name"), [("mujoco", "plane"), ("trimesh", "{mesh}")])
def test_a_missing_extra_is_named(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, module: str, name: str
) -> None:
    mesh = box(tmp_path / "box.stl", 0.06)
    monkeypatch.setitem(sys.modules, module, None)
    code, _, err = run("simulate", name.format(mesh=mesh), "-o", tmp_path / "x.mcap")
    assert code == 2
    assert "pip install 'evifuse[simulation]'" in err


def test_a_full_disk_leaves_nothing_behind(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "evifuse", "simulate", "plane", "-o", str(tmp_path / "x.mcap")],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000)),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "writing failed" in done.stderr
    assert list(tmp_path.iterdir()) == []
