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
