"""Random data sets: balanced, repeatable, labelled truly, and continued after a stop."""

import json

import numpy as np
import pytest

from evifuse.errors import UsageError
from evifuse.recordings import read_scene
from evifuse.simulation import CASE_PRIMITIVES, Noise, random_case, random_scenes
from evifuse.simulation.dataset import simulated_case, write_dataset
from evifuse.simulation.random_cases import random_body_case
from evifuse.simulation.truth import site_truth
from evifuse.touch import sense_curvature


def test_every_seven_hold_each_primitive_and_the_truth_agrees():
    for seed in range(6):
        cases = [random_case(seed, number) for number in range(21)]
        for start in (0, 7, 14):
            assert sorted(case.primitive for case in cases[start : start + 7]) == sorted(CASE_PRIMITIVES)
        for case in cases:
            kinds = {site_truth(case.surface, site, 0.01).primitive for site in case.sites}
            assert case.primitive in kinds
            assert len(kinds) == (2 if case.primitive == "N" else 1)
    assert len({case.noise for case in cases}) == 3
    assert random_case(1, 3) == random_case(1, 3) != random_case(2, 3)


def test_scenes_without_files_have_the_noise_that_was_asked_for():
    (case, made), *_ = random_scenes(1, 5, noise=Noise(pressure_pa=500.0), rate_hz=200)
    touch = made.scene.touch
    free = touch.pressure_pa[made.truth.roll < 0]
    np.testing.assert_allclose(np.median(np.abs(free)) / 0.6745, 500, rtol=0.2)
    assert made.truth.surface == case.surface


def test_a_data_set_goes_on_and_gives_the_same_bytes(tmp_path):
    seen = []
    first, second = tmp_path / "a", tmp_path / "b"
    assert write_dataset(first, 2, 7, rate_hz=100) == 2
    assert write_dataset(second, 3, 7, rate_hz=100) == 3
    truth = (first / "truth.jsonl").read_text()
    (first / "truth.jsonl").write_text(truth[:-20])  # killed while the last row was written
    kept = (first / "00000.mcap").stat().st_mtime_ns
    assert write_dataset(first, 3, 7, rate_hz=100, done=lambda n, k: seen.append((n, k))) == 2
    assert seen == [(0, True), (1, False), (2, False)]
    assert (first / "00000.mcap").stat().st_mtime_ns == kept
    for name in ("00000.mcap", "00001.mcap", "00002.mcap", "truth.jsonl"):
        assert (first / name).read_bytes() == (second / name).read_bytes()
    (first / "00001.mcap").write_bytes((first / "00001.mcap").read_bytes()[:-100])
    assert write_dataset(first, 3, 7, rate_hz=100) == 1
    rows = [json.loads(line) for line in (first / "truth.jsonl").read_text().splitlines()]
    assert [row["file"] for row in rows] == ["00000.mcap", "00001.mcap", "00002.mcap"]
    assert {"primitive", "surface", "dimensions", "class", "sites", "noise", "fingertip"} <= rows[0].keys()
    assert read_scene(first / "00001.mcap").touch is not None
    with pytest.raises(UsageError, match="another data set"):
        write_dataset(first, 3, 8, rate_hz=100)


def test_random_bodies_are_touched_where_they_have_what_is_asked_for(tmp_path):
    assert write_dataset(tmp_path, 2, 3, meshes="random", rate_hz=100) == 2
    rows = [json.loads(line) for line in (tmp_path / "truth.jsonl").read_text().splitlines()]
    for number, row in enumerate(rows):
        assert row["primitive"] == random_case(3, number).primitive
        assert row["surface"].split()[0] in ("plate", "ball")
        assert row["sites"][-1]["primitive"] == row["primitive"]
        assert len(row["sites"]) == (2 if row["primitive"] == "N" else 1)
    assert write_dataset(tmp_path, 2, 3, meshes="random", rate_hz=100) == 0
    with pytest.raises(UsageError, match="another data set"):
        write_dataset(tmp_path, 2, 3, rate_hz=100)


def test_an_opening_is_missed_and_the_place_beside_it_is_met():
    numbers = [n for n in range(7) if random_case(3, n).primitive == "N"]
    case = random_body_case(3, numbers[0])
    beside, opening = (site_truth(case.surface, site, 0.01) for site in case.sites)
    assert (beside.contact, opening.contact, opening.primitive) == (True, False, "N")
    made = simulated_case(case, None, Noise(), 200)
    felt = sense_curvature(made.scene.touch)
    assert [site.contact for site in felt.sites] == [True, False]
    np.testing.assert_allclose(felt.sites[1].position_m[:2], opening.position_m[:2], atol=2e-3)
