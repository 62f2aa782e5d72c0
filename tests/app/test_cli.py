"""The command line as a user meets it: output, JSON, errors in one line, exit codes, nothing half written."""

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from evifuse.app.main import main
from evifuse.knowledge import built_in_text
from evifuse.recordings import read_scene, write_scene, write_touch
from evifuse.recordings.recording import Scene

Run = Callable[..., tuple[int, str, str]]
Files = Callable[[str], Path]


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    def call(*arguments: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as stopped:
            main([str(a) for a in arguments])
        out, err = capsys.readouterr()
        assert isinstance(stopped.value.code, int)
        return stopped.value.code, out, err

    return call


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    """Two plain objects: a rectangle and a disc."""
    image = np.full((240, 400, 3), 200, np.uint8)
    cv2.rectangle(image, (30, 60), (170, 160), (40, 60, 80), -1)
    cv2.circle(image, (300, 120), 60, (60, 40, 90), -1)
    path = tmp_path / "two.png"
    cv2.imwrite(str(path), image)
    return path


def numbers(value: object) -> list[float]:
    if isinstance(value, dict):
        return [n for v in value.values() for n in numbers(v)]
    if isinstance(value, list):
        return [n for v in value for n in numbers(v)]
    return [float(value)] if isinstance(value, int | float) else []


def test_shape_json_is_what_the_documentation_says(run: Run, picture: Path) -> None:
    code, out, err = run("shape", picture, "--json")
    assert (code, err) == (0, "")
    objects = json.loads(out)["objects"]
    assert {o["decision"] for o in objects} == {"rectangular", "elliptical"}
    for o in objects:
        assert {"box", "fitted_edges", "primitives", "belief", "conductivity", "feature", "decision"} <= set(
            o
        )
        assert len(o["box"]) == 4
        assert list(o["belief"]) == [
            "rectangle",
            "square",
            "triangle",
            "ellipse",
            "circle",
            "bracket",
            "frame",
        ]
        assert sum(o["belief"].values()) == pytest.approx(1)
        assert sum(o["feature"].values()) == pytest.approx(1)
        assert set(o["conductivity"]) == {"rectangular", "triangular", "elliptical"}
        assert all({"start", "end", "belief"} <= set(e) for e in o["fitted_edges"])
        assert all({"kind", "belief"} <= set(p) for p in o["primitives"])
        assert np.isfinite(numbers(o)).all()


def test_touch_json_is_what_the_documentation_says(run: Run, scene_file: Files) -> None:
    code, out, err = run("touch", scene_file("cylinder"), "--json")
    assert (code, err) == (0, "")
    felt = json.loads(out)
    assert felt["decision"] == "curved"
    assert set(felt["conductivity"]) == {"quasiplanar", "curved", "occluded"}
    assert sum(felt["belief"].values()) == pytest.approx(1)
    for c in felt["local_curvatures"]:
        assert {"site", "direction_rad", "curvature_per_m", "belief"} <= set(c)
    for site in felt["sites"]:
        assert {"k1_per_m", "k2_per_m", "contact"} <= set(site)
        assert site["k1_per_m"] >= site["k2_per_m"]


@pytest.mark.parametrize(
    ("surface", "decision"),
    [
        ("plane", "quasiplanar"),
        ("cylinder", "curved"),
        ("sphere", "curved"),
        ("bowl", "curved"),
        ("trough", "curved"),
        ("saddle", "curved"),
        ("hole", "occluded"),
    ],
)
def test_fuse_decides_every_simulated_surface(
    run: Run, scene_file: Files, surface: str, decision: str
) -> None:
    code, out, err = run("fuse", scene_file(surface), "--json")
    assert (code, err) == (0, "")
    found = json.loads(out)
    keys = {"shape", "touch", "total", "belief", "decision", "pignistic", "warnings"}
    assert keys <= set(found)
    assert found["decision"] == decision
    assert sum(found["belief"].values()) == pytest.approx(1)
    assert sum(found["pignistic"].values()) == pytest.approx(1)
    assert found["warnings"] == []
    for label, total in found["total"].items():
        assert total == pytest.approx(found["from_shape"][label] + found["from_touch"][label])
    assert np.isfinite(numbers(found)).all()


def test_each_sense_alone(run: Run, scene_file: Files, picture: Path) -> None:
    code, out, _ = run("fuse", "--touch", scene_file("cylinder"), "--json")
    felt = json.loads(out)
    assert (code, felt["decision"], felt["shape"]) == (0, "curved", None)
    assert "touch alone" in felt["warnings"][0]
    code, out, _ = run("fuse", "--image", picture, "--json")
    seen = json.loads(out)
    assert (code, seen["touch"]) == (0, None)
    assert any("2 objects" in w for w in seen["warnings"])


def test_box_and_projection_choose_the_object(run: Run, scene_file: Files, picture: Path) -> None:
    for box, decision in (("30,60,140,100", "rectangular"), ("240,60,120,120", "elliptical")):
        _, out, _ = run("fuse", "--image", picture, "--touch", scene_file("plane"), "--box", box, "--json")
        found = json.loads(out)
        assert found["shape"]["decision"] == decision
        assert not any("objects" in w for w in found["warnings"])


def test_image_and_touch_files_give_what_the_scene_gives(run: Run, scene_file: Files, tmp_path: Path) -> None:
    scene = read_scene(scene_file("trough"))
    assert scene.image is not None
    assert scene.touch is not None
    cv2.imwrite(str(tmp_path / "seen.png"), scene.image)
    whole = json.loads(run("fuse", scene_file("trough"), "--json")[1])
    for suffix in ("csv", "npz"):
        write_touch(tmp_path / f"felt.{suffix}", scene.touch)
        _, out, _ = run(
            "fuse", "--image", tmp_path / "seen.png", "--touch", tmp_path / f"felt.{suffix}", "--json"
        )
        apart = json.loads(out)
        for label, total in whole["total"].items():
            assert apart["total"][label] == pytest.approx(total, abs=1e-6)


def test_tables_for_people(run: Run, scene_file: Files, picture: Path) -> None:
    for arguments, words in (
        (("shape", picture), ["Seen", "rectangular", "elliptical", "prototype", "margin"]),
        (("touch", scene_file("hole")), ["Felt", "unknown", "Touch says: occluded", "O_3"]),
        (
            ("fuse", scene_file("saddle")),
            ["Fused", "pignistic", "Decision: curved", "because touch believes H"],
        ),
        (("reproduce",), ["published", "reproduces", "does not follow"]),
    ):
        code, out, _ = run(*arguments)
        assert code == 0
        for word in words:
            assert word in out


def test_pictures_are_drawn(run: Run, scene_file: Files, picture: Path, tmp_path: Path) -> None:
    for arguments in (
        ("shape", picture),
        ("touch", scene_file("hole")),
        ("fuse", scene_file("sphere")),
        ("fuse", "--touch", scene_file("plane")),
        ("fuse", "--image", picture),
    ):
        drawn = tmp_path / "drawn.png"
        assert run(*arguments, "--draw", drawn)[0] == 0
        image = cv2.imread(str(drawn))
        assert image is not None
        assert image.shape[0] >= 400
        assert image.std() > 10
        drawn.unlink()


def test_simulate_writes_a_scene_that_is_read_back(run: Run, tmp_path: Path) -> None:
    out = tmp_path / "bowl.mcap"
    code, text, _ = run("simulate", "bowl", "-o", out, "--seed", "5", "--json")
    assert code == 0
    made = json.loads(text)
    assert made["truth"]["decision"] == "curved"
    first = out.read_bytes()
    scene = read_scene(out)
    assert scene.image is not None
    assert scene.touch is not None
    assert run("simulate", "bowl", "-o", out, "--seed", "5")[0] == 0
    assert out.read_bytes() == first


def test_demo_prints_tables_and_draws(run: Run, tmp_path: Path) -> None:
    code, out, err = run("demo", "plane", "-o", tmp_path / "new" / "folder")
    assert code == 0
    assert "Decision: quasiplanar" in out
    assert "The truth: quasiplanar" in out
    assert "rolling" in err
    assert (tmp_path / "new" / "folder" / "plane.png").stat().st_size > 10_000


def test_own_knowledge(run: Run, picture: Path, tmp_path: Path) -> None:
    mine = tmp_path / "mine.yaml"
    mine.write_text(built_in_text("shape").replace("elliptical:", "round:"), encoding="utf-8")
    code, out, _ = run("shape", picture, "--shape-knowledge", mine, "--json")
    assert code == 0
    assert "round" in {o["decision"] for o in json.loads(out)["objects"]}
    code, out, _ = run("knowledge", "chapter-shape")
    assert (code, out) == (0, built_in_text("chapter-shape"))


BAD = [
    (["shape"], "IMAGE"),
    (["shape", "{tmp}/missing.png"], "missing.png"),
    (["shape", "{tmp}/folder"], "{tmp}/folder"),
    (["shape", "{tmp}/empty.png"], "empty.png"),
    (["shape", "{tmp}/text.png"], "text.png"),
    (["shape", "{tmp}/cut.png"], "cut.png"),
    (["shape", "{tmp}/dot.png"], "1"),
    (["shape", "{tmp}/two.png", "--shape-knowledge", "{tmp}/bad.yaml"], "bad.yaml:6: unknown label 'X'"),
    (["shape", "{tmp}/two.png", "--shape-knowledge", "nothing"], "nothing"),
    (["shape", "{tmp}/two.png", "--draw", "{tmp}/no/such/folder.png"], "folder"),
    (["touch", "{tmp}/missing.mcap"], "missing.mcap"),
    (["touch", "{tmp}/empty.mcap"], "empty.mcap"),
    (["touch", "{tmp}/text.png"], "text.png"),
    (["touch", "{tmp}/two.png"], "two.png"),
    (["touch", "{tmp}/seen.mcap"], "seen.mcap"),
    (["touch", "{tmp}/plane.mcap", "--belief", "other"], "other"),
    (["touch", "{tmp}/plane.mcap", "--curvature-knowledge", "shape"], "'P'"),
    (["fuse"], "nothing to fuse"),
    (["fuse", "{tmp}/plane.mcap", "--image", "{tmp}/two.png"], "not both"),
    (["fuse", "--image", "{tmp}/two.png", "--box", "1,2,3"], "--box"),
    (["fuse", "--image", "{tmp}/two.png", "--box", "1,2,0,4"], "above 0"),
    (["fuse", "--image", "{tmp}/missing.png", "--touch", "{tmp}/plane.mcap"], "missing.png"),
    (["simulate", "cube", "-o", "{tmp}/x.mcap"], "cube"),
    (["simulate", "plane", "-o", "{tmp}/x.csv"], "x.mcap"),
    (["simulate", "plane", "-o", "{tmp}/no/x.mcap"], "no"),
    (["nonsense"], "nonsense"),
    (["shape", "{tmp}/two.png", "--nonsense"], "nonsense"),
]


@pytest.mark.parametrize(("arguments", "says"), BAD)
def test_mistakes_end_with_one_line_and_exit_code_2(
    run: Run, scene_file: Files, picture: Path, tmp_path: Path, arguments: list[str], says: str
) -> None:
    whole = picture.read_bytes()
    (tmp_path / "empty.png").write_bytes(b"")
    (tmp_path / "empty.mcap").write_bytes(b"")
    (tmp_path / "text.png").write_text("not an image\n")
    (tmp_path / "folder").mkdir()
    (tmp_path / "cut.png").write_bytes(whole[: len(whole) // 2])
    cv2.imwrite(str(tmp_path / "dot.png"), np.zeros((1, 1), np.uint8))
    (tmp_path / "bad.yaml").write_text("frame:\n  R: rectangle\nclasses:\n  a:\n    A:\n      X: 1\n")
    shutil.copy(scene_file("plane"), tmp_path / "plane.mcap")
    if "{tmp}/seen.mcap" in arguments:
        write_scene(tmp_path / "seen.mcap", Scene(cv2.imread(str(picture)), None, None))
    before = sorted(p.name for p in tmp_path.rglob("*"))
    code, out, err = run(*(a.replace("{tmp}", str(tmp_path)) for a in arguments))
    assert code == 2
    assert out == ""
    assert err.startswith("evifuse: ")
    assert err.count("\n") == 1
    assert "Traceback" not in err
    assert says.replace("{tmp}", str(tmp_path)) in err
    assert sorted(p.name for p in tmp_path.rglob("*")) == before


def test_our_own_mistakes_end_with_exit_code_1(
    run: Run, picture: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import evifuse.app.shapes as commands

    def broken(*_: object) -> None:
        raise ZeroDivisionError("a slip of ours")

    monkeypatch.setattr(commands, "run_shape", broken)
    code, _, err = run("shape", picture)
    assert code == 1
    assert err == (
        "evifuse: internal error: ZeroDivisionError: a slip of ours (EVIFUSE_DEBUG=1 shows where)\n"
    )
    monkeypatch.setenv("EVIFUSE_DEBUG", "1")
    with pytest.raises(ZeroDivisionError):
        main(["shape", str(picture)])


def test_help_version_and_module() -> None:
    for arguments, words in ((["--help"], "Commands"), (["--version"], "0."), (["fuse", "--help"], "--box")):
        done = subprocess.run(
            [sys.executable, "-m", "evifuse", *arguments], capture_output=True, text=True, check=True
        )
        assert words in done.stdout


def test_a_closed_pipe_is_not_an_error(picture: Path) -> None:
    command = f"{sys.executable} -m evifuse reproduce --json | head -c 1"
    done = subprocess.run(
        ["bash", "-o", "pipefail", "-c", command], capture_output=True, text=True, check=False
    )
    assert done.stderr == ""
    assert done.returncode == 0
