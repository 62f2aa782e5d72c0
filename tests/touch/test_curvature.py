from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evifuse.recordings.rotation import about_axis, multiply, rotate
from evifuse.touch import contact_track, find_sites, measure_roll, sense_curvature, shape_operator
from evifuse.touch.curvature import RollCurvature
from tests.touch.rolled import Surface, ball, cylinder, plane, quadric, rolled

RADII_M = (0.015, 0.020, 0.030, 0.040, 0.060)


def felt_shape(recording):
    track = contact_track(recording)
    (site,) = find_sites(recording, track)
    rolls = [measure_roll(recording, track, site, roll) for roll in site.rolls]
    return shape_operator(rolls, recording.fingertip.radius_m), rolls


def catalogue() -> list[tuple[Surface, float]]:
    """Surfaces with the turn that keeps the contact on the array."""
    found = [(cylinder(r, 0.4 * i), 0.35) for i, r in enumerate(RADII_M)]
    found += [(ball(r), 0.35) for r in RADII_M]
    found += [(quadric(1 / r, -1 / r), 0.25) for r in RADII_M[1:]]
    found += [(ball(-r), 0.3 * (1 - 0.010 / r)) for r in RADII_M[1:]]
    found += [(cylinder(-r, 0.3), 0.3 * (1 - 0.010 / r)) for r in RADII_M[1:]]
    found += [(quadric(20.0, -50.0), 0.25), (plane(), 0.35)]
    return found


@pytest.mark.parametrize(
    ("surface", "turn"), catalogue(), ids=lambda x: f"{x.name}{x.k1:.0f}" if isinstance(x, Surface) else ""
)
def test_principal_curvatures_are_within_two_percent(surface, turn):
    shape, _ = felt_shape(rolled(surface, turn_rad=turn, depth_m=1.2e-4, samples=250))
    scale = max(abs(surface.k1), abs(surface.k2), 16.7)
    assert shape.k1_per_m == pytest.approx(surface.k1, rel=0.02, abs=0.02 * scale)
    assert shape.k2_per_m == pytest.approx(surface.k2, rel=0.02, abs=0.02 * scale)


def test_directions_are_the_travelled_ones_not_the_commanded():
    radius = 0.020
    _, rolls = felt_shape(rolled(cylinder(radius), (np.pi / 4,), depth_m=1.2e-4))
    shrunk = np.arctan2(1 / (1 + 0.010 / radius), 1.0)  # the contact lags behind the centre across the axis
    assert rolls[0].direction_rad == pytest.approx(shrunk, abs=0.01)
    assert rolls[0].curvature_per_m == pytest.approx(-(np.sin(shrunk) ** 2) / radius, rel=0.03)


@pytest.mark.parametrize("axis_rad", [0.0, 0.5, 1.2, 2.5])
def test_the_direction_of_k1_is_the_cylinders_axis(axis_rad):
    shape, _ = felt_shape(rolled(cylinder(0.02, axis_rad), depth_m=1.2e-4))
    assert abs(np.sin(shape.k1_direction_rad - axis_rad)) < 0.01


@pytest.mark.parametrize("slip", [0.0, 0.05, 0.3])
def test_slip_is_measured_and_taken_out(slip):
    surface = cylinder(0.02)
    shape, rolls = felt_shape(rolled(surface, slip=slip, depth_m=1.2e-4))
    assert shape.k2_per_m == pytest.approx(-50.0, rel=0.02)
    assert rolls[2].slip == pytest.approx(slip + (1 - slip) * 0.012, abs=0.003)  # 0.012: depth over radius
    off = abs(rolls[2].joint_curvature_per_m + 50.0)  # the joint alone mistakes slip for curvature
    assert off < 3.0 if slip == 0 else off > 100 * slip


def test_curvature_that_changes_along_the_roll_is_taken_at_the_site():
    steep = quadric(60.0, 60.0)  # at 5 mm from its middle it is 12 percent less
    shape, _ = felt_shape(rolled(steep, turn_rad=0.22, depth_m=8e-5))
    assert shape.k1_per_m == pytest.approx(60.0, rel=0.02)


@settings(max_examples=8, deadline=None)
@given(
    axis=st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.2),
    angle=st.floats(-np.pi, np.pi),
    shift=st.tuples(*[st.floats(-0.5, 0.5)] * 3),
)
def test_moving_the_whole_scene_changes_no_curvature(axis, angle, shift):
    recording = rolled(cylinder(0.03, 0.3), samples=120, depth_m=1.2e-4)
    turn = about_axis(np.array(axis) / np.linalg.norm(axis), angle)
    moved = replace(
        recording,
        position_m=rotate(turn, recording.position_m) + np.array(shift),
        orientation_xyzw=multiply(turn, recording.orientation_xyzw),
    )
    before, after = felt_shape(recording)[0], felt_shape(moved)[0]
    assert after.k1_per_m == pytest.approx(before.k1_per_m, abs=0.02)
    assert after.k2_per_m == pytest.approx(before.k2_per_m, abs=0.02)


@settings(max_examples=100, deadline=None)
@given(
    k=st.tuples(st.floats(-80, 60), st.floats(-80, 60)),
    turn=st.floats(0, np.pi),
    directions=st.lists(st.floats(0, np.pi), min_size=2, max_size=6),
)
def test_exact_bendings_give_the_exact_shape_operator(k, turn, directions):
    spread = np.abs(np.sin(np.subtract.outer(directions, directions))).max()
    if spread < 0.5:
        directions = [*directions, directions[0] + 1.0]
    axes = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    surface = axes @ np.diag(k) @ axes.T
    offset = surface @ np.linalg.inv(np.eye(2) - 0.010 * surface)
    rolls = []
    for direction in directions:
        t = np.array([np.cos(direction), np.sin(direction)])
        rolls.append(
            RollCurvature(np.arange(3), direction, 0.0, 1.0, 0.0, 0.0, t, offset @ t, np.array([0.2, 0.3]))
        )
    shape = shape_operator(rolls, 0.010)
    assert shape is not None
    assert [shape.k1_per_m, shape.k2_per_m] == pytest.approx(sorted(k, reverse=True), abs=1e-6)


def test_one_direction_gives_no_shape_operator():
    shape, rolls = felt_shape(rolled(cylinder(0.02), (1.2, 1.25)))
    assert shape is None
    assert len(rolls) == 2


NOISE = {"pressure_noise_pa": 150.0, "position_noise_m": 5e-5, "angle_noise_rad": 5e-3, "smear_m": 4e-4}


def test_standard_errors_are_honest_under_noise():
    errors = []
    for seed in range(12):
        shape, _ = felt_shape(rolled(cylinder(0.03), samples=250, depth_m=1.2e-4, seed=seed, **NOISE))
        errors.append(
            [shape.k1_per_m / shape.k1_error_per_m, (shape.k2_per_m + 1 / 0.03) / shape.k2_error_per_m]
        )
        assert abs(shape.k2_per_m + 1 / 0.03) < 1.0
    spread = np.sqrt(np.mean(np.square(errors)))
    assert 0.2 < spread < 2.0


def test_a_pose_without_the_joint_is_turned_by_the_joint():
    recording = rolled(ball(-0.03), turn_rad=0.2, depth_m=1.2e-4)
    still = np.broadcast_to([0.0, 0.0, 0.0, 1.0], recording.orientation_xyzw.shape).copy()
    felt = sense_curvature(replace(recording, orientation_xyzw=still))
    assert "joint" in felt.warnings[0]
    assert [felt.sites[0].k1_per_m, felt.sites[0].k2_per_m] == pytest.approx([33.3, 33.3], rel=0.02)
