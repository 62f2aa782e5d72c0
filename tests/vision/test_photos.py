"""The shape sensor on real photographs and drawings, whose sources are in tests/data/README.md."""

import sys
from functools import cache
from pathlib import Path

import pytest

from evifuse.recordings.images import read_image
from evifuse.vision import SeenObject, sense_shapes

ROOT = Path(__file__).parents[2]
PHOTOS = ROOT / "tests" / "data" / "photos"
DEVELOPMENT = ROOT.parent / "shared" / "data"

EXPECTED: dict[str, list[tuple[str, tuple[int, int, int, int]]]] = {
    "blocks.jpg": [("elliptical", (34, 57, 192, 92))],
    "board.jpg": [("rectangular", (287, 126, 134, 95)), ("rectangular", (37, 55, 40, 43))],
    "box.jpg": [("rectangular", (18, 8, 298, 204))],
    "coins.png": [
        ("elliptical", (315, 156, 65, 63)),
        ("elliptical", (18, 231, 57, 57)),
        ("elliptical", (275, 238, 52, 51)),
        ("elliptical", (188, 170, 50, 47)),
    ],
    "desk.jpg": [("elliptical", (337, 126, 117, 119)), ("elliptical", (190, 18, 75, 77))],
    "drawing-ellipse.png": [("elliptical", (8, 5, 54, 60))],
    "drawing-rectangle.png": [("rectangular", (6, 10, 60, 46))],
    "drawing-triangle.png": [("triangular", (3, 12, 62, 46))],
    "sign-elliptical-1.png": [("elliptical", (28, 28, 48, 48))],
    "sign-elliptical-2.png": [("elliptical", (21, 21, 65, 65))],
    "sign-rectangular-1.png": [("rectangular", (23, 24, 83, 82))],
    "sign-rectangular-2.png": [("rectangular", (18, 19, 63, 64))],
    "sign-triangular-1.png": [("triangular", (44, 42, 112, 98))],
    "sign-triangular-2.png": [("triangular", (30, 24, 117, 108))],
    "sudoku.jpg": [("rectangular", (34, 78, 488, 445))],
    "sweets.jpg": [("elliptical", (321, 211, 54, 55)), ("elliptical", (192, 278, 56, 57))],
}


@cache
def seen_in(name: str) -> tuple[SeenObject, ...]:
    """What the sensor sees in a photograph, computed once."""
    return sense_shapes(read_image(PHOTOS / name))


def overlap(a: tuple[int, int, int, int], b: tuple[int, int, int, int]) -> float:
    """Intersection over union."""
    w = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    h = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    both = max(w, 0) * max(h, 0)
    return both / (a[2] * a[3] + b[2] * b[3] - both)


@pytest.mark.parametrize("name", EXPECTED)
def test_the_objects_of_a_photograph(name: str) -> None:
    seen = seen_in(name)
    for decision, box in EXPECTED[name]:
        best = max(seen, key=lambda s: overlap(s.box, box))
        assert overlap(best.box, box) > 0.5
        assert best.classification.decision == decision


@pytest.mark.parametrize("name", [n for n in EXPECTED if n.startswith(("sign", "drawing"))])
def test_the_main_object_comes_first(name: str) -> None:
    decision, box = EXPECTED[name][0]
    main = seen_in(name)[0]
    assert main.classification.decision == decision
    assert overlap(main.box, box) > 0.4


def test_most_coins_are_seen() -> None:
    coins = [s for s in seen_in("coins.png") if min(s.box[2:]) > 30]
    assert sum(s.classification.decision == "elliptical" for s in coins) >= 15


@pytest.mark.parametrize("name", sorted(p.name for p in PHOTOS.iterdir()))
def test_every_photograph_gives_sound_evidence(name: str) -> None:
    image = read_image(PHOTOS / name)
    seen = seen_in(name)
    assert seen
    for s in seen:
        beliefs = [h.belief for h in s.primitives]
        assert beliefs == sorted(beliefs, reverse=True)
        x, y, w, h = s.box
        assert 0 <= x < x + w <= image.shape[1]
        assert 0 <= y < y + h <= image.shape[0]
        assert all(0 <= e.belief <= 1 for e in s.fitted_edges)
        assert s.evidence.masses.sum() == pytest.approx(1.0)


@pytest.mark.slow
@pytest.mark.skipif(not DEVELOPMENT.exists(), reason="the development data are not here")
def test_accuracy_on_the_development_data() -> None:
    sys.path.insert(0, str(ROOT / "benchmarks"))
    try:
        import vision as benchmark
    finally:
        sys.path.pop(0)
    drawings = list(benchmark.drawings(DEVELOPMENT, "test"))
    assert benchmark.accuracy(drawings, benchmark.clean, "test")["accuracy"] > 0.92
    crops = list(benchmark.sign_crops(DEVELOPMENT, "test"))
    assert benchmark.accuracy(crops, benchmark.clean, "test")["accuracy"] > 0.80
