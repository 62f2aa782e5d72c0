"""How the rivalry of shapes is learned (`benchmarks/train_shapes.py`), on cases that are made up."""

import importlib
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import yaml

from evifuse.vision.rivalry import FAMILIES

BENCHMARKS = str(Path(__file__).parents[2] / "benchmarks")
pytest.importorskip("scipy")


@pytest.fixture(scope="module")
def training() -> ModuleType:
    sys.path.insert(0, BENCHMARKS)
    try:
        return importlib.import_module("train_shapes")
    finally:
        sys.path.remove(BENCHMARKS)


def made_up(training: ModuleType, count: int, seed: int = 0) -> list:
    """Pictures of one good outline, whose first feature tells the family, among four bad ones."""
    rng = np.random.default_rng(seed)
    found = []
    for i in range(count):
        family = i % len(FAMILIES)
        features = rng.normal(0, 1, (5, 3))
        good = rng.integers(5)
        features[:, 1] = 0.0
        features[good, :2] = family + rng.normal(0, 0.1), 4.0
        bounds = np.ones(5, np.bool_)
        found.append(
            training.Case("drawn", str(i % 7), "clean", family, ("a", "b", "c"), features, bounds, 1.0)
        )
    return found


def test_the_gradient_is_that_of_the_likelihood(training: ModuleType) -> None:
    cases = made_up(training, 12)
    cases[3] = replace(cases[3], bounds=np.array([True, False, True, False, True]))
    rows = np.concatenate([c.features for c in cases])
    value = training._likelihood(np.column_stack([rows, np.ones(len(rows))]), cases)
    flat = np.random.default_rng(1).normal(0, 0.3, 4 * (1 + len(FAMILIES)))
    _, slope = value(flat)
    for k in range(len(flat)):
        step = np.zeros_like(flat)
        step[k] = 1e-5
        assert (value(flat + step)[0] - value(flat - step)[0]) / 2e-5 == pytest.approx(
            slope[k], rel=1e-4, abs=1e-4
        )


def test_what_tells_the_family_and_the_outline_is_found(training: ModuleType) -> None:
    model = training.fit(made_up(training, 400))
    judged = made_up(training, 100, seed=1)
    shares = np.array([training.shares_of(model, case) for case in judged])
    right = shares.argmax(axis=1) == [case.family for case in judged]
    assert right.mean() > 0.8
    assert model.standing[1] > 5 * abs(model.standing[2])


def test_whole_groups_are_held_out(training: ModuleType) -> None:
    cases = made_up(training, 60)
    fold = training.fold_of(cases)
    for group in {c.group for c in cases}:
        assert len({int(f) for c, f in zip(cases, fold, strict=True) if c.group == group}) == 1
    assert len(set(fold.tolist())) == training.FOLDS


def test_what_is_written_is_what_was_learned(training: ModuleType) -> None:
    model = training.fit(made_up(training, 50))
    table = yaml.safe_load(training.written(model))
    rows = np.array(list(table["features"].values()))
    assert tuple(table["features"]) == model.features
    np.testing.assert_allclose(rows[:, 0], model.mean, atol=1e-3)
    np.testing.assert_allclose(rows[:, 3:], model.families, atol=1e-3)
    np.testing.assert_allclose(table["constants"], model.constants, atol=1e-3)


def test_overlap_counts_all_pixels(training: ModuleType) -> None:
    boxes = np.array([[0.0, 0.0, 9.0, 9.0], [5.0, 0.0, 14.0, 9.0], [20.0, 20.0, 29.0, 29.0]])
    np.testing.assert_allclose(training.overlap(boxes, boxes[0]), [1.0, 50 / 150, 0.0])
