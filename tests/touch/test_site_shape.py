"""The fit of a whole site: exact on exact data, honest under noise, and on arrays that are sparse or wide."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evifuse.recordings.recording import Fingertip
from evifuse.recordings.rotation import rotate
from evifuse.touch import (
    contact_track,
    find_sites,
    sense_curvature,
    site_shape,
    spherical_fingertip,
    taxel_pitch_m,
)
from evifuse.touch.as_sphere import guided
from evifuse.touch.patch import Blocks, fit_patch
from evifuse.touch.profile import press_depth_m, pressure_profile
from tests.touch.rolled import ball, cylinder, plane, quadric, rolled

STRONG = {"pressure_noise_pa": 1000.0, "position_noise_m": 2e-4, "angle_noise_rad": 0.0087, "smear_m": 1e-3}


def shape_of(recording):
    track = contact_track(recording)
    (site,) = find_sites(recording, track)
    return site_shape(recording, track, site)


def exact_blocks(k, directions, radius=0.01):
    """Blocks of a sphere that rolls over a torus-like surface, exact to second order: n = (-S x, .)."""
    rows = []
    for direction in directions:
        x = np.linspace(-0.0005, 0.0005, 12)[:, None] * np.array([np.cos(direction), np.sin(direction)])
        slope = x @ k
        normal = np.concatenate([-slope, np.ones((12, 1))], axis=1)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        point = np.concatenate([x, 0.5 * np.sum(x * slope, axis=1, keepdims=True)], axis=1)
        rows.append((point + radius * normal, normal))
    centre, normal = (np.concatenate(part) for part in zip(*rows, strict=True))
    count = len(centre)
    roll = np.repeat(np.arange(len(directions)), 12)
    return Blocks(centre, normal, np.full(count, radius), np.zeros((count, 3)), np.ones(count), roll, 1e-3)


@settings(max_examples=40, deadline=None)
@given(k1=st.floats(-150, 60), k2=st.floats(-150, 60), turn=st.floats(0, np.pi))
def test_exact_blocks_give_the_exact_operator(k1, k2, turn):
    axes = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    k = axes @ np.diag([k1, k2]) @ axes.T
    patch = fit_patch(exact_blocks(k, (0.1, 1.2, 2.2)))
    assert patch.parameters[3:6] == pytest.approx([k[0, 0], k[0, 1], k[1, 1]], abs=0.2)


def test_one_wild_roll_out_of_eight_hardly_matters():
    blocks = exact_blocks(np.diag([20.0, -50.0]), np.arange(8) * np.pi / 8)
    rng = np.random.default_rng(2)
    blocks.normal[:] += 1e-3 * rng.standard_normal(blocks.normal.shape)
    calm = fit_patch(blocks).parameters[3:6]
    blocks.normal[12:20] += 0.03 * rng.standard_normal((8, 3))
    wild = fit_patch(blocks).parameters[3:6]
    assert np.abs(wild - calm).max() < 5.0


@pytest.mark.parametrize(
    "surface", [cylinder(0.02, 0.4), ball(0.03), quadric(25.0, -40.0), plane()], ids=lambda s: s.name
)
def test_errors_are_honest_in_strong_noise(surface):
    z = []
    for seed in range(3):
        shape = shape_of(rolled(surface, turn_rad=0.25, depth_m=1.2e-4, samples=300, seed=seed, **STRONG))
        z += [(shape.k1_per_m - surface.k1) / shape.k1_error_per_m]
        z += [(shape.k2_per_m - surface.k2) / shape.k2_error_per_m]
        assert max(shape.k1_error_per_m, shape.k2_error_per_m) < 5.0
    assert np.sqrt(np.mean(np.square(z))) < 2.5


def test_a_sparse_array_still_tells_the_curvature():
    tip = spherical_fingertip(pitch_m=0.003)
    shape = shape_of(rolled(cylinder(0.02), tip=tip, turn_rad=0.35, depth_m=2e-4, samples=400, smear_m=1e-3))
    assert shape.k2_per_m == pytest.approx(-50.0, rel=0.08)
    assert shape.k1_per_m == pytest.approx(0.0, abs=4.0)


@pytest.mark.parametrize("depth_m", [6e-5, 1.2e-4, 2e-4])
def test_the_press_depth_is_told_by_the_patch(depth_m):
    recording = rolled(ball(0.03), turn_rad=0.25, depth_m=depth_m, samples=200)
    track = contact_track(recording)
    rows = np.flatnonzero(track.interior)
    tip = recording.fingertip
    profile = pressure_profile(tip, recording.pressure_pa[rows], 0.01 * track.direction[rows], 0.006)
    depth, error = press_depth_m(profile, tip.radius_m, -1 / 0.03, taxel_pitch_m(tip))
    assert depth == pytest.approx(depth_m, rel=0.3)
    assert error < 0.2 * depth_m


def test_a_sphere_about_its_origin_is_left_alone():
    recording = rolled(plane(), (0.0,), samples=60)
    track = contact_track(recording)
    assert guided(recording, track) == (recording, track)


def test_a_sphere_beside_its_origin_feels_the_same():
    recording = rolled(ball(0.03), turn_rad=0.25, depth_m=1.2e-4, samples=200)
    tip, aside = recording.fingertip, np.array([0.001, -0.002, 0.003])

    moved = replace(
        recording,
        fingertip=Fingertip(tip.radius_m, tip.positions_m + aside, tip.normals),
        position_m=recording.position_m - rotate(recording.orientation_xyzw, aside[None]),
    )
    before, after = (sense_curvature(r).sites[0].shape for r in (recording, moved))
    assert after.k1_per_m == pytest.approx(before.k1_per_m, abs=0.2)
    assert after.k2_per_m == pytest.approx(before.k2_per_m, abs=0.2)
