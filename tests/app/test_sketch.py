"""Drawings of many pictures: fast, readable, and of any size."""

import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from evifuse.app import sketch as module
from evifuse.app.overlay import label_of
from evifuse.app.sketch import sketch, write_sketch
from evifuse.errors import RecordingError
from evifuse.vision import sense_shapes

PHOTOS = Path(__file__).parents[1] / "data" / "photos"


def tile() -> np.ndarray:
    image = np.full((480, 640), 210, np.uint8)
    image[160:320, 200:440] = 60
    return image


@pytest.mark.parametrize(
    ("size", "drawn"),
    [
        ((480, 640), (540, 720)),
        ((8, 8), (560, 560)),
        ((2000, 3000), (1000, 1500)),
        ((10000, 8), (1100, 1)),
        ((8, 10000), (1, 1500)),
        ((70, 70, 3), (560, 560)),
    ],
)
def test_pictures_of_any_size(size: tuple[int, ...], drawn: tuple[int, int]) -> None:
    image = np.random.default_rng(1).integers(0, 256, size, dtype=np.uint8)
    made = sketch(image, ())
    assert made.shape == (drawn[0] + 2 * module.STRIP_PX, max(drawn[1], module.LEAST_WIDTH_PX), 3)
    assert made.dtype == np.uint8
    assert (made[:, drawn[1] :][module.STRIP_PX : -module.STRIP_PX] == 255).all()


def test_edges_have_the_tint_of_their_belief() -> None:
    """Every side of the tile has strokes of the colour that the scale gives it."""
    seen = sense_shapes(tile())
    made = sketch(tile(), seen)
    zoom = 720 / 640
    scale = cv2.applyColorMap(np.arange(256, dtype=np.uint8), cv2.COLORMAP_PLASMA).reshape(256, 3)
    assert len(seen[0].fitted_edges) == 4
    for edge in seen[0].fitted_edges:
        along = edge.start + np.linspace(0.2, 0.8, 60)[:, None] * (edge.end - edge.start)
        x, y = np.round((along + 0.5) * zoom - 0.5).astype(int).T
        around = np.arange(-2, 3)  # the dashes of the primitive lie over the middle
        patches = made[(y + module.STRIP_PX)[:, None, None] + around[:, None], x[:, None, None] + around]
        away = np.abs(patches.astype(int) - scale[round(255 * edge.belief)]).max(axis=-1)
        assert (away.min(axis=(1, 2)) < 40).mean() > 0.6


def test_labels_are_there_for_what_is_believed(monkeypatch: pytest.MonkeyPatch) -> None:
    written: list[str] = []
    monkeypatch.setattr(cv2, "putText", lambda sheet, text, *rest: written.append(text))
    seen = sense_shapes(tile())
    sketch(tile(), seen)
    assert label_of(seen[0]) in written
    assert any(text.startswith(f"Seen: {len(seen)} object") for text in written)


def test_what_is_seen_in_photographs_can_be_drawn(tmp_path: Path) -> None:
    for name in ("blocks.jpg", "sign-elliptical-1.png", "drawing-triangle.png"):
        image = cv2.imread(str(PHOTOS / name))
        seen = sense_shapes(image)
        write_sketch(image, seen, tmp_path / "a.png")
        drawn = cv2.imread(str(tmp_path / "a.png"))
        assert np.abs(drawn.astype(int) - sketch(image, ())).max() > 100
        np.testing.assert_array_equal(drawn, sketch(image, seen))


def test_a_folder_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="does not exist"):
        write_sketch(tile(), (), tmp_path / "gone" / "a.png")


def test_many_pictures_are_drawn_without_matplotlib(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    for name in ("a", "b"):
        cv2.imwrite(str(tmp_path / "in" / f"{name}.png"), tile())
    program = (
        "import sys\nfrom evifuse.app.main import main\n"
        f"try:\n    main(['shape', {str(tmp_path / 'in')!r}, '--draw', {str(tmp_path / 'out')!r}])\n"
        "finally:\n    print('matplotlib' in sys.modules)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "False"
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["a.png", "b.png"]
