"""Defective taxels are found in a recording, sound ones are left in peace, and estimates are mended."""

from dataclasses import replace

import numpy as np
import pytest

from evifuse.recordings.recording import Fingertip
from evifuse.simulation.defects import Defects, broken_taxels, with_defects
from evifuse.touch import sense_curvature
from evifuse.touch.fingertip import spherical_fingertip
from evifuse.touch.health import health, silent_taxels
from evifuse.touch.mended import mended
from evifuse.touch.repair import repair_weights
from tests.touch.rolled import ball, cylinder, plane, rolled

SURFACES = [plane(), ball(0.03), cylinder(0.02)]
SOUND = {surface.name: rolled(surface, turn_rad=0.3, depth_m=1.5e-4) for surface in SURFACES}
PEAK = SOUND["plane"].pressure_pa.max()


def surrounded(touch):
    """Taxels that contact went over, not only past."""
    return (touch.pressure_pa > 0.35 * touch.pressure_pa.max()).sum(axis=0) > 0.01 * len(touch.time_ns)


@pytest.mark.parametrize("name", SOUND)
def test_nothing_is_wrong_with_a_sound_fingertip(name):
    found = health(SOUND[name])
    assert found.lines() == ()
    assert found.usable.all()
    same, said = mended(SOUND[name])
    assert same is SOUND[name]
    assert said == ()


@pytest.mark.parametrize("noise", [0.0, 0.005, 0.1])
def test_silent_taxels_are_found_and_no_others(noise):
    hits = asked = false = 0
    for seed in range(4):
        for touch in SOUND.values():
            scatter = np.random.default_rng(seed).normal(0, noise * PEAK, touch.pressure_pa.shape)
            defects = Defects(dead=0.1, stuck=0.03, seed=seed)
            broken = broken_taxels(defects, scatter.shape[1])
            noisy = replace(touch, pressure_pa=touch.pressure_pa + scatter)
            dead, stuck = silent_taxels(with_defects(noisy, defects))
            true = broken.dead | broken.stuck
            telling = true & surrounded(touch)
            hits, asked = hits + ((dead | stuck) & telling).sum(), asked + telling.sum()
            false += ((dead | stuck) & ~true).sum()
    assert asked > 100
    assert hits > 0.9 * asked
    assert false == 0


def test_stuck_is_told_from_dead():
    defects = Defects(dead=0.05, stuck=0.05, seed=8)
    touch = SOUND["plane"]
    broken = broken_taxels(defects, touch.pressure_pa.shape[1])
    found = health(with_defects(touch, defects))
    assert not (found.dead & broken.stuck & (with_defects(touch, defects).pressure_pa[0] > 0.1 * PEAK)).any()
    assert (found.stuck & broken.stuck).sum() > 0.8 * broken.stuck.sum()
    assert any("dead" in line for line in found.lines())
    assert any("stuck" in line for line in found.lines())


@pytest.mark.parametrize("share", [0.5, 0.8])
def test_saturation_is_found_at_its_level(share):
    found = health(with_defects(SOUND["sphere"], Defects(saturation_pa=share * PEAK)))
    assert found.saturation_pa == pytest.approx(share * PEAK, rel=1e-5)
    assert found.saturated.sum() > 10
    assert "saturated" in found.lines()[0]


@pytest.mark.parametrize("bits", [8, 10, 12])
def test_the_step_is_found_with_and_without_single_precision(bits):
    step = 1.3 * PEAK / 2**bits
    scatter = np.random.default_rng(1).normal(0, 2 * step, SOUND["plane"].pressure_pa.shape)
    noisy = replace(SOUND["plane"], pressure_pa=SOUND["plane"].pressure_pa + scatter)
    touch = with_defects(noisy, Defects(step_pa=step))
    assert health(touch).step_pa == pytest.approx(step, rel=1e-3)
    assert health(touch).saturation_pa == np.inf
    single = replace(touch, pressure_pa=touch.pressure_pa.astype(np.float32).astype(np.float64))
    assert health(single).step_pa == pytest.approx(step, rel=1e-3)
    assert health(noisy).step_pa == 0


def test_a_moving_baseline_is_found_and_taken_off():
    touch = SOUND["plane"]
    defects = Defects(drifting=0.3, drift_pa_per_s=0.08 * PEAK, wander_pa=0.02 * PEAK, seed=2)
    broken = broken_taxels(defects, touch.pressure_pa.shape[1])
    drifted = with_defects(touch, defects)
    found = health(drifted)
    moved = np.abs(drifted.pressure_pa - touch.pressure_pa).max(axis=0) > 0.08 * PEAK
    assert found.drifting[moved].all()
    assert not found.drifting[~broken.drifting].any()
    better, said = mended(drifted)
    assert "running baseline" in said[0]
    error = np.sqrt(np.mean(np.square(better.pressure_pa - touch.pressure_pa)[:, moved]))
    assert error < 0.3 * np.sqrt(np.mean(np.square(drifted.pressure_pa - touch.pressure_pa)[:, moved]))


def test_a_finger_that_never_lifts_has_no_baseline_to_take_off():
    touch = SOUND["sphere"]
    pressed = touch.pressure_pa.max(axis=1) > 0.5 * PEAK
    rows = ("time_ns", "position_m", "orientation_xyzw", "joint_angle_rad", "pressure_pa")
    held = replace(touch, **{key: getattr(touch, key)[pressed] for key in rows})
    assert not health(held).drifting.any()
    assert mended(held)[0] is held


def test_no_contact_and_few_taxels_are_no_defects():
    touch = SOUND["plane"]
    noise = np.random.default_rng(0).normal(0, 50.0, touch.pressure_pa.shape)
    assert health(replace(touch, pressure_pa=noise)).usable.all()
    assert health(replace(touch, pressure_pa=np.zeros_like(noise))).lines() == ()
    still = replace(touch, pressure_pa=np.repeat(touch.pressure_pa[200:201], len(noise), axis=0))
    assert mended(still)[0] is still
    one = Fingertip(0.01, touch.fingertip.positions_m[:1], touch.fingertip.normals[:1])
    alone = replace(touch, fingertip=one, pressure_pa=touch.pressure_pa[:, :1])
    assert health(alone).usable.all()
    assert mended(alone)[0] is alone


def test_what_a_silent_taxel_would_have_read_is_filled_in():
    tip = spherical_fingertip()
    silent = np.zeros(len(tip.positions_m), dtype=np.bool_)
    silent[[5, 6, 40, 100]] = True
    weights = repair_weights(tip, silent)
    x, y = tip.positions_m[:, :2].T / 0.01
    field = 2 + 0.3 * x - 0.5 * y + x * y - 2 * x**2
    assert np.allclose((np.where(silent, 1e9, field) @ weights)[silent], field[silent], rtol=0.01)
    assert np.allclose((field @ weights)[~silent], field[~silent])


@pytest.mark.parametrize("name", SOUND)
def test_curvature_with_a_tenth_of_the_taxels_dead_stays_close(name):
    true = next((s.k1, s.k2) for s in SURFACES if s.name == name)
    for seed in range(2):
        felt = sense_curvature(with_defects(SOUND[name], Defects(dead=0.1, seed=seed)))
        assert any("never respond" in line for line in felt.warnings)
        shape = felt.sites[0].shape
        assert abs(shape.k1_per_m - true[0]) < max(3 * shape.k1_error_per_m, 0.5)
        assert abs(shape.k2_per_m - true[1]) < max(3 * shape.k2_error_per_m, 0.5)
        assert max(shape.k1_error_per_m, shape.k2_error_per_m) < 1.5
