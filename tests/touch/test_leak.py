"""The spread between taxels, measured against the spread that was put in."""

from dataclasses import replace

import numpy as np
import pytest

from evifuse.simulation.defects import Defects, with_defects
from evifuse.touch.leak import point_spread_m
from tests.touch.rolled import ball, plane, rolled


@pytest.mark.parametrize("surface", [plane(), ball(0.03)], ids=["plane", "sphere"])
@pytest.mark.parametrize("spread", [0.6e-3, 1e-3, 2e-3])
def test_the_spread_is_measured(surface, spread):
    sharp = rolled(surface, turn_rad=0.3, depth_m=1.5e-4)
    found = point_spread_m(with_defects(sharp, Defects(crosstalk_m=spread)))
    assert found == pytest.approx(spread, rel=0.2)


def test_a_sharp_patch_has_next_to_no_spread():
    assert point_spread_m(rolled(plane(), turn_rad=0.3, depth_m=1.5e-4)) < 0.25e-3


def test_without_contact_nothing_is_known():
    touch = rolled(plane(), (0.0,))
    assert np.isnan(point_spread_m(replace(touch, pressure_pa=np.zeros_like(touch.pressure_pa))))
