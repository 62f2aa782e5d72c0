"""The measures that the figures are made of, on cases that can be counted by hand."""

import importlib
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import cv2
import numpy as np
import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def benchmark() -> Iterator[dict[str, ModuleType]]:
    """Modules of the benchmark by name."""
    sys.path.insert(0, str(ROOT / "benchmarks"))
    names = ("data", "measures", "scenes", "ellipses", "seen", "training", "rivals")
    modules = {name: importlib.import_module(f"vision_{name}") for name in names}
    yield {**modules, "main": importlib.import_module("vision")}
    sys.path.remove(str(ROOT / "benchmarks"))


def test_auroc_counts_pairs(benchmark: dict[str, ModuleType]) -> None:
    auroc = benchmark["measures"].auroc
    random = np.random.default_rng(0)
    known, other = random.integers(0, 8, 40), random.integers(2, 10, 30)
    pairs = (other[None] > known[:, None]).mean() + 0.5 * (other[None] == known[:, None]).mean()
    assert auroc(known, other) == pytest.approx(pairs)
    assert auroc([1.0], []) is None
    row = benchmark["measures"].auroc_with_interval(known, other)
    assert row["interval"][0] < row["auroc"] < row["interval"][1]


def test_intervals(benchmark: dict[str, ModuleType]) -> None:
    """Wilson's of 8 of 10, and Student's of three values, from tables."""
    measures = benchmark["measures"]
    assert measures.interval(8, 10) == pytest.approx((0.4902, 0.9433), abs=1e-4)
    mean, (low, high) = measures.mean_interval([1.0, 2.0, 3.0])
    assert (mean, low, high) == pytest.approx((2.0, 2 - 4.3027 / 3**0.5, 2 + 4.3027 / 3**0.5), abs=1e-4)


def test_calibration_error_of_two_bins(benchmark: dict[str, ModuleType]) -> None:
    probabilities = np.array([[0.92, 0.04, 0.04]] * 4 + [[0.55, 0.25, 0.2]] * 4)
    truth = np.array([0, 0, 0, 1, 0, 0, 1, 2])
    row = benchmark["measures"].calibration(probabilities, truth)
    assert row["error"] == pytest.approx((0.92 - 0.75) / 2 + (0.55 - 0.5) / 2)
    assert [b["count"] for b in row["bins"]] == [4, 4]
    even = benchmark["measures"].calibration(np.full((3, 3), 1 / 3), np.array([0, 1, 2]))
    assert even["error"] == pytest.approx(0.0)


def test_precision_and_recall_over_belief(benchmark: dict[str, ModuleType]) -> None:
    named = [(0.9, 0), (0.6, -1), (0.35, 1), (0.05, -1)]
    rows = {round(r["belief"], 1): r for r in benchmark["scenes"].curve(named, 4)}
    assert (rows[0.0]["precision"], rows[0.0]["recall"]) == (0.5, 0.5)
    assert (rows[0.3]["precision"], rows[0.3]["recall"]) == pytest.approx((2 / 3, 0.5))
    assert (rows[0.7]["precision"], rows[0.7]["recall"]) == (1.0, 0.25)


def test_ellipses_are_matched_once_each(benchmark: dict[str, ModuleType]) -> None:
    module = benchmark["ellipses"]
    true = [module.outline_of(np.array([x, 100, 30, 20, 10])) for x in (100, 200)]
    near = module.outline_of(np.array([101, 100, 30, 20, 10]))
    assert module.overlap_of(true[0], true[0]) == pytest.approx(1.0, abs=1e-4)
    assert module.overlap_of(true[0], true[1]) == 0.0
    twice = module.outline_of(np.array([100, 100, 60, 20, 10]))
    assert module.overlap_of(true[0], twice) == pytest.approx(0.5, abs=0.01)
    assert module.matched([near, true[0], twice], true) == 1
    assert module.matched([near, true[1]], true) == 2


def test_drawn_ellipses_are_as_they_are_said_to_be(benchmark: dict[str, ModuleType]) -> None:
    """Whoever lies on top is seen; who is mostly hidden is not among the true ones."""
    module = benchmark["ellipses"]
    again = [module.drawn(24, 1) for _ in range(2)]
    np.testing.assert_array_equal(again[0][0], again[1][0])
    assert 8 < len(again[0][1]) < 24
    assert len(module.drawn(1, 0)[1]) == 1
    assert module.matched(module.edge_drawing(module.drawn(4, 0)[0]), module.drawn(4, 0)[1]) >= 3


def test_halves_share_nobody(benchmark: dict[str, ModuleType]) -> None:
    module = benchmark["data"]
    image = np.zeros((8, 8), np.uint8)
    items = [("triangular", image, f"triangle.p{k % 7}.{k:04}.png") for k in range(40)]
    judged: list[int] = []
    for examples, numbers in module.folds(items, "dev", items):
        people = {module.group_of(name) for _, _, name in examples}
        assert people.isdisjoint(module.group_of(items[i][2]) for i in numbers)
        judged += numbers
    assert sorted(judged) == list(range(40))
    assert module.group_of("00012.jpg#3") == "00012.jpg"
    assert module.in_split(["a", "b", "c"], "dev").isdisjoint(module.in_split(["a", "b", "c"], "test"))


def test_the_whole_command_on_a_little_data(
    benchmark: dict[str, ModuleType],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Three people, two drawings of each shape by each; two photographs with a sign."""
    random = np.random.default_rng(0)
    corners = {
        "rectangle": np.array([[12, 16], [58, 16], [58, 54], [12, 54]]),
        "triangle": np.array([[35, 10], [60, 56], [10, 56]]),
        "ellipse": cv2.ellipse2Poly((35, 35), (26, 18), 20, 0, 360, 8),
        "other": np.array([[10, 10], [60, 60], [60, 10], [30, 50]]),
    }
    for kind, points in corners.items():
        folder = tmp_path / "drawings" / kind
        folder.mkdir(parents=True)
        for number in range(6):
            image = np.full((70, 70), 255, np.uint8)
            cv2.polylines(image, [points + random.integers(-3, 4, 2)], True, 0, 2)
            cv2.imwrite(str(folder / f"{kind}.p{number % 3}.{number:04}.png"), image)
    (tmp_path / "signs").mkdir()
    rows = ["file,x_px,y_px,width_px,height_px,class_id,shape"]
    for number in range(4):
        scene = np.full((240, 320, 3), 90, np.uint8)
        cv2.circle(scene, (100 + 20 * number, 120), 30, (230, 230, 240), -1, cv2.LINE_AA)
        cv2.imwrite(str(tmp_path / "signs" / f"{number}.png"), scene)
        rows.append(f"{number}.png,{70 + 20 * number},90,61,61,1,elliptical")
    (tmp_path / "signs" / "labels.csv").write_text("\n".join(rows) + "\n")
    options = ["vision.py", "--data", str(tmp_path)]
    scenes = ["--only", "scenes", "--json", str(tmp_path / "a.json"), "--draw", str(tmp_path / "drawn")]
    monkeypatch.setattr(sys, "argv", [*options, *scenes])
    benchmark["main"].main()
    found = json.loads((tmp_path / "a.json").read_text())["scenes"]
    assert (found["recall"], found["count"]) == (1.0, 2)
    assert (tmp_path / "drawn" / "scenes.png").exists()
    some = ["--only", "drawings", "--condition", "25 %", "--quick", "1", "--rivals"]
    monkeypatch.setattr(sys, "argv", [*options, *some, "--json", str(tmp_path / "b.json")])
    benchmark["main"].main()
    figures = json.loads((tmp_path / "b.json").read_text())
    assert figures["sensor"]["drawings 25 %"]["count"] == 12
    assert set(figures["learned"]["drawings"]) == {"5", "50", "all"}
    assert "difference, paired" in capsys.readouterr().out
