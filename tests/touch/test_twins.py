"""The compiled inner loops give what NumPy gives."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evifuse.touch import _kernels_contact as contact
from evifuse.touch import _kernels_health as health
from evifuse.touch import _kernels_patch as patch
from evifuse.touch import _kernels_rolls as rolls
from evifuse.touch import contact_track, find_sites
from evifuse.touch.fingertip import taxel_pitch_m
from evifuse.touch.rolling import tangents
from tests.touch import twins
from tests.touch.rolled import ball, cylinder, plane, rolled

SURFACES = [plane(), ball(0.03), cylinder(0.02, 0.4)]
NOISE = {"pressure_noise_pa": 150.0, "position_noise_m": 5e-5, "angle_noise_rad": 5e-3}


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(-5, 5) | st.floats(-1e3, 1e3), min_size=1, max_size=40), st.floats(0, 1))
def test_medians_and_quantiles_are_numpys(values, share):
    values = np.array(values, dtype=np.float64)
    assert health.median(values.copy(), len(values)) == pytest.approx(np.median(values), rel=1e-12, abs=1e-12)
    found = health.quantile(values.copy(), len(values), share)
    assert found == pytest.approx(np.quantile(values, share), rel=1e-9, abs=1e-9)


def test_statistics_of_taxels_are_numpys():
    columns = np.round(np.random.default_rng(2).normal(0, 4, (7, 101)))
    quiet, spread, rise, reach = health.taxel_statistics(columns, 1)
    away = columns - np.median(columns, axis=1)[:, None]
    assert np.array_equal(quiet, np.median(columns, axis=1))
    assert np.array_equal(spread, np.median(np.abs(away), axis=1))
    assert np.array_equal(rise, away.max(axis=1))
    assert np.array_equal(reach, np.abs(away).max(axis=1))
    fewer = np.median(columns[:, ::4], axis=1)
    quiet, spread, rise, reach = health.taxel_statistics(columns, 4)
    assert np.array_equal(quiet, fewer)
    assert np.array_equal(spread, np.median(np.abs(columns[:, ::4] - fewer[:, None]), axis=1))
    assert np.array_equal(rise, columns.max(axis=1) - fewer)
    assert np.array_equal(reach, np.abs(columns - fewer[:, None]).max(axis=1))


@pytest.mark.parametrize("noise", [{}, NOISE], ids=["clean", "noisy"])
@pytest.mark.parametrize("surface", SURFACES, ids=lambda s: s.name)
def test_rates_along_a_roll_are_numpys(surface, noise):
    recording = rolled(surface, turn_rad=0.3437, samples=397, **noise)
    track = contact_track(recording)
    (site,) = find_sites(recording, track)
    frame = np.stack([*tangents(site.normal), site.normal], axis=1)
    step = 0.5 * taxel_pitch_m(recording.fingertip)
    pole = np.array([0.0, 0.6, -0.8])
    for roll in site.rolls:
        given = (recording.position_m, track.normal, recording.orientation_xyzw, pole, roll, step, 6, 24)
        found, size = rolls.roll_pieces(*given), twins.roll_pieces(*given)[1]
        assert abs(found[1] - size).max() <= 1  # without noise a sample may be just on a limit
        for fast, slow in zip(found, twins.roll_pieces(*given) if noise else found, strict=True):
            assert fast == pytest.approx(slow, rel=1e-9, abs=1e-12)
        given = (
            recording.position_m,
            track.normal,
            recording.joint_angle_rad,
            roll,
            site.centre_m,
            frame,
            step,
        )
        for fast, slow in zip(
            rolls.roll_rates(*given, 60, twins.NODES, twins.SHARES), twins.roll_rates(*given), strict=True
        ):
            assert fast == pytest.approx(slow, rel=1e-9, abs=1e-9)


@settings(max_examples=60, deadline=None)
@given(st.integers(3, 60), st.integers(0, 10**6), st.booleans())
def test_paths_are_cut_and_placed_as_by_numpy(count, seed, coarse):
    draw = np.random.default_rng(seed)
    position, normal = draw.normal(0, 1, (2, 80, 3)).cumsum(axis=1)
    position = np.round(position) if coarse else position  # standing still, and going back
    roll = np.sort(draw.permutation(80)[:count])
    first, second, centre = draw.normal(0, 1, (3, 3))
    path = rolls.smooth_path(position, roll, first, second, 3)
    assert path == pytest.approx(twins.moving_mean(position[roll] @ np.stack([first, second], axis=1), 3))
    start = int(draw.integers(0, count - 2))
    found, expected = rolls.corner_of(path, start, count), twins.corner_of(path[start:])
    assert found[1:] == pytest.approx(expected[1:])
    assert rolls.mean_of(normal, roll) == pytest.approx(normal[roll].mean(axis=0))
    middle, same = rolls.middle_of(position, roll, 5), twins.middle_of(position, roll, 5)
    if not coarse:  # there ties depend on rounding
        assert found[0] == expected[0]
        assert middle == pytest.approx(same)
    near = rolls.normal_near(position, normal, roll, centre, 0.2)
    assert near == pytest.approx(twins.normal_near(position, normal, roll, centre, 0.2))


@settings(max_examples=20, deadline=None)
@given(st.integers(1, 13), st.integers(0, 10**6))
def test_contacts_are_those_of_numpy(taxels, seed):
    draw = np.random.default_rng(seed)
    pressure, areas = np.round(draw.normal(0, 300, (9, taxels))), draw.uniform(0.5, 1.5, taxels)
    normals = draw.normal(0, 1, (taxels, 3))
    weights = np.ascontiguousarray(np.concatenate([areas[None], areas * normals.T]))
    found = contact.contacts(pressure, 100.0, weights)
    for fast, slow in zip(found, twins.contacts(pressure, 100.0, areas, normals), strict=True):
        assert fast == pytest.approx(slow)
    assert np.array_equal(contact.peaks(pressure, 3), pressure[::3].max(axis=1))


def test_a_step_of_the_patch_is_least_squares():
    draw = np.random.default_rng(4)
    design, residual = draw.normal(0, 1, (30, 3, 16)), draw.normal(0, 1, (30, 3))
    weight, error = draw.uniform(0.2, 1, (30, 2)), np.array([0.3, 2.0])
    scale, prior, theta = draw.uniform(0.1, 3, (3, 16))
    change, used = np.zeros(16), np.zeros(2)
    given = (design, residual, weight, error, scale, prior, theta)
    covariance, regular = patch.normal_step(*given, change, used)
    assert regular
    for fast, slow in zip((covariance, change, used), twins.least_squares(*given), strict=True):
        assert fast == pytest.approx(slow, rel=1e-9)
    assert not patch.normal_step(
        np.zeros_like(design), residual, weight, error, scale, 0 * prior, theta, change, used
    )[1]
