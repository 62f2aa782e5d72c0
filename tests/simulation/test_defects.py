"""Defective taxels: as many as asked for, the same for the same seed, each doing what it should."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evifuse.errors import UsageError
from evifuse.simulation.defects import Defects, broken_taxels, with_defects
from tests.touch.rolled import plane, rolled

TOUCH = rolled(plane(), (0.0, 1.5), samples=300)
PEAK = TOUCH.pressure_pa.max()


@settings(max_examples=25, deadline=None)
@given(
    dead=st.floats(0, 0.5), stuck=st.floats(0, 0.5), seed=st.integers(0, 2**31), taxels=st.integers(1, 400)
)
def test_so_many_are_broken_as_asked_for(dead, stuck, seed, taxels):
    broken = broken_taxels(Defects(dead=dead, stuck=stuck, drifting=1.0, seed=seed), taxels)
    assert broken.dead.sum() == round(dead * taxels)
    assert broken.stuck.sum() == min(round(stuck * taxels), taxels - round(dead * taxels))
    assert not (broken.dead & broken.stuck).any()
    assert np.array_equal(broken.drifting, ~(broken.dead | broken.stuck))


def test_dead_taxels_are_silent_and_stuck_ones_constant():
    defects = Defects(dead=0.1, stuck=0.1, seed=3)
    broken = broken_taxels(defects, TOUCH.pressure_pa.shape[1])
    pressure = with_defects(TOUCH, defects).pressure_pa
    assert (pressure[:, broken.dead] == 0).all()
    assert (np.ptp(pressure[:, broken.stuck], axis=0) == 0).all()
    assert len(np.unique(pressure[0, broken.stuck])) > 20
    sound = ~(broken.dead | broken.stuck)
    assert np.array_equal(pressure[:, sound], TOUCH.pressure_pa[:, sound])


def test_the_same_seed_gives_the_same_bytes_and_another_one_others():
    defects = Defects(dead=0.1, stuck=0.1, drifting=0.5, drift_pa_per_s=100, wander_pa=50, seed=5)
    first, second = (with_defects(TOUCH, defects).pressure_pa for _ in range(2))
    assert first.tobytes() == second.tobytes()
    other = Defects(dead=0.1, stuck=0.1, drifting=0.5, drift_pa_per_s=100, wander_pa=50, seed=6)
    assert not np.array_equal(first, with_defects(TOUCH, other).pressure_pa)


def test_saturation_clips_and_steps_round():
    assert with_defects(TOUCH, Defects(saturation_pa=0.6 * PEAK)).pressure_pa.max() == 0.6 * PEAK
    rounded = with_defects(TOUCH, Defects(step_pa=50.0)).pressure_pa
    assert np.abs(rounded - TOUCH.pressure_pa).max() <= 25 + 1e-9
    assert np.allclose(rounded / 50, np.round(rounded / 50))


def test_baselines_drift_as_far_as_asked_for():
    seconds = (TOUCH.time_ns[-1] - TOUCH.time_ns[0]) * 1e-9
    line = with_defects(TOUCH, Defects(drifting=1, drift_pa_per_s=300.0)).pressure_pa - TOUCH.pressure_pa
    assert np.std(line[-1]) == pytest.approx(300 * seconds, rel=0.15)
    walk = with_defects(TOUCH, Defects(drifting=1, wander_pa=300.0)).pressure_pa - TOUCH.pressure_pa
    assert np.std(walk[-1]) == pytest.approx(300 * np.sqrt(seconds), rel=0.15)


def test_crosstalk_keeps_the_load_but_for_the_rim_and_widens_the_patch():
    leaked = with_defects(TOUCH, Defects(crosstalk_m=0.001)).pressure_pa
    middle = np.argmax(np.where(np.abs(TOUCH.joint_angle_rad) < 0.05, TOUCH.pressure_pa.max(axis=1), 0))
    assert leaked[middle].sum() == pytest.approx(TOUCH.pressure_pa[middle].sum(), rel=0.05)
    assert leaked.max() < 0.7 * PEAK
    assert (leaked > 0.01 * PEAK).sum() > 1.5 * (TOUCH.pressure_pa > 0.01 * PEAK).sum()


@pytest.mark.parametrize(
    "wrong",
    [
        {"dead": 1.1},
        {"dead": -0.1},
        {"dead": 0.6, "stuck": 0.6},
        {"step_pa": -1.0},
        {"wander_pa": float("nan")},
    ],
)
def test_impossible_defects_are_refused(wrong):
    with pytest.raises(UsageError, match="defective taxels"):
        with_defects(TOUCH, Defects(**wrong))
