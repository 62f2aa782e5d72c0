"""A finger that was lowered in vain says N, also far from what was touched; one that stayed high does not."""

from dataclasses import replace

import numpy as np
import pytest

from evifuse.touch import sense_curvature
from tests.touch.rolled import ball, joined, plane, rolled


@pytest.mark.parametrize(("down_m", "missed"), [(0.006, 1), (-0.004, 0)])
def test_far_from_a_dome_its_fall_says_nothing(down_m, missed):
    aside = rolled(plane(), (0.0,), offset_m=(0.06, 0.0, -down_m))
    felt = sense_curvature(
        joined(rolled(ball(0.02)), replace(aside, pressure_pa=np.zeros_like(aside.pressure_pa)))
    )
    found = [site for site in felt.sites if not site.contact]
    assert len(found) == missed
    for site in found:
        assert 0.5 < site.evidence.as_dict()["N"] <= 0.8
        np.testing.assert_allclose(site.position_m, [0.06, 0.0, -down_m], atol=1e-3)


def missed(*recordings):
    return [site for site in sense_curvature(joined(*recordings)).sites if not site.contact]


@pytest.mark.parametrize("down_m", [0.003, 0.006])
def test_a_step_down_that_is_met_is_not_missed(down_m):
    below = rolled(plane(), offset_m=(0.03, 0.0, -down_m))
    assert not missed(rolled(plane()), below)
    gone = replace(below, pressure_pa=np.zeros_like(below.pressure_pa))
    assert len(missed(rolled(plane()), gone)) == 1  # the same way where there is nothing


@pytest.mark.parametrize("depth_m", [1e-5, 0.0])
def test_a_light_touch_is_not_missed_even_if_no_taxel_answers(depth_m):
    light = rolled(plane(), depth_m=depth_m, pressure_noise_pa=200.0, offset_m=(0.03, 0.0, 0.0))
    assert not missed(rolled(plane(), pressure_noise_pa=200.0), light)


def test_a_moment_without_pressure_is_not_missed():
    broken = rolled(plane())
    pressure = broken.pressure_pa.copy()
    pressure[600:680] = 0.0
    assert not missed(replace(broken, pressure_pa=pressure))
