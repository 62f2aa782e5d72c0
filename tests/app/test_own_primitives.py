"""Primitives of the user's own on the command line; with a plane, shapes are judged as they lie on it."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from evifuse.app.main import main
from evifuse.knowledge import built_in_text

MODULE = """
import numpy as np
from evifuse.vision.primitives import mean_of_sides, pattern_proposals

def propose(fits):
    five = fits.polygon(5)
    regular = np.cos(five.angles - np.deg2rad(108)).clip(0).prod(axis=1) ** 4
    return pattern_proposals("pentagon", five, mean_of_sides(five.sides.beliefs, least=5) * regular)

OWN = {"pentagon": propose}
NUMBERS = {"pentagon": 5}
"""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a pentagon, what proposes pentagons, and classes that know them."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own_pentagon.py").write_text(MODULE)
    (tmp_path / "broken_pentagon.py").write_text("1 / 0\n")
    text = built_in_text("shape").replace("  B: bracket\n", "  B: bracket\n  P: pentagon\n")
    (tmp_path / "my.yaml").write_text(text + "  pentagonal:\n    P_1: {P: 0.8, frame: 0.2}\n")
    picture = np.full((240, 240), 255, np.uint8)
    turns = np.deg2rad(np.arange(5) * 72 - 90)
    five = np.stack([120 + 80 * np.cos(turns), 120 + 80 * np.sin(turns)], axis=-1)
    cv2.polylines(picture, [five.round().astype(np.int32)], True, 0, 4, cv2.LINE_AA)
    cv2.imwrite("five.png", picture)
    return tmp_path


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as stopped:
        main(["shape", *arguments])
    out, err = capsys.readouterr()
    assert isinstance(stopped.value.code, int)
    return stopped.value.code, out, err


@pytest.mark.parametrize("module", ["own_pentagon", "own_pentagon.py", "./own_pentagon.py"])
def test_a_pentagon_is_seen(here: Path, capsys: pytest.CaptureFixture[str], module: str) -> None:
    arguments = ["five.png", "--primitives", f"{module}:OWN", "--shape-knowledge", "my.yaml", "--json"]
    code, out, err = run(capsys, *arguments)
    assert (code, err) == (0, "")
    first = json.loads(out)["objects"][0]
    assert first["decision"] == "pentagonal"
    assert first["belief"]["pentagon"] > 0.6
    assert len(next(p for p in first["primitives"] if p["kind"] == "pentagon")["corners"]) == 5


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("nowhere:OWN", "can't be loaded: ModuleNotFoundError"),
        ("nowhere.py:OWN", "can't be loaded: FileNotFoundError"),
        ("broken_pentagon:OWN", "can't be loaded: ZeroDivisionError"),
        ("own_pentagon", "give my_module:NAME"),
        ("own_pentagon:", "give my_module:NAME"),
        ("own_pentagon:THEIRS", "no mapping"),
        ("own_pentagon:propose", "no mapping"),
        ("own_pentagon:NUMBERS", "must be a name with a function"),
    ],
)
def test_mistakes_in_a_line(here: Path, capsys: pytest.CaptureFixture[str], text: str, says: str) -> None:
    code, out, err = run(capsys, "five.png", "--primitives", text, "--shape-knowledge", "my.yaml")
    assert (code, out) == (2, "")
    assert says in err
    assert err.count("\n") == 1


def test_classes_that_do_not_know_the_primitive(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, _, err = run(capsys, "five.png", "--primitives", "own_pentagon:OWN")
    assert code == 2
    assert "don't know 'pentagon'" in err
    assert err.count("\n") == 1


def test_with_a_plane_a_tilted_square_is_a_square(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tilt = np.deg2rad(60)
    c, s = np.cos(tilt), np.sin(tilt)
    square = np.array([[-0.12, -0.12], [0.12, -0.12], [0.12, 0.12], [-0.12, 0.12]])
    points = np.column_stack([square[:, 0], c * square[:, 1], 0.8 + s * square[:, 1]])
    seen = points @ np.array([[800, 0, 319.5], [0, 800, 239.5], [0, 0, 1]]).T
    image = np.full((480, 640), 200, np.uint8)
    cv2.fillPoly(image, [np.rint(16 * seen[:, :2] / seen[:, 2:]).astype(np.int32)], 60, cv2.LINE_AA, shift=4)
    cv2.imwrite("tile.png", image)
    beliefs: list[float] = []
    camera = ["--intrinsics", "800,800,319.5,239.5", "--plane", f"0,{-s},{c},{0.8 * c}"]
    for more in ([], camera):
        code, out, _ = run(capsys, "tile.png", "--json", *more)
        assert code == 0
        first = json.loads(out)["objects"][0]
        beliefs.append(next(p["belief"] for p in first["primitives"] if p["kind"] == "square"))
    assert beliefs[0] < 0.8 * beliefs[1]
    np.testing.assert_allclose(first["primitives"][0]["sides_m"], 0.24, rtol=0.02)
