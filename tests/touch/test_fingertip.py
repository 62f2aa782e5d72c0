import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evifuse.errors import UsageError
from evifuse.touch import spherical_fingertip, taxel_coverage, taxel_pitch_m


@settings(max_examples=25, deadline=None)
@given(
    radius=st.floats(0.003, 0.03),
    steps=st.integers(6, 20),
    cap=st.floats(0.3, 1.5),
)
def test_taxels_lie_on_the_sphere_a_pitch_apart(radius, steps, cap):
    pitch = cap * radius / steps
    tip = spherical_fingertip(radius, pitch, cap)
    assert np.allclose(np.linalg.norm(tip.positions_m, axis=1), radius)
    assert np.allclose(tip.positions_m, radius * tip.normals)
    assert (tip.normals[:, 2] <= -np.cos(cap) + 1e-9).all()
    assert taxel_pitch_m(tip) == pytest.approx(pitch, rel=0.15)


def test_coverage_is_whole_in_the_middle_and_about_a_half_at_the_edge():
    tip = spherical_fingertip(0.010, 0.0007, 0.61)
    coverage = taxel_coverage(tip, 0.15)
    polar = np.arccos(-tip.normals[:, 2])
    assert coverage[polar < 0.3].min() > 0.75
    assert coverage[polar > 0.55].max() < 0.75
    assert ((coverage > 0) & (coverage <= 1)).all()


def test_one_taxel_is_its_own_pitch():
    tip = spherical_fingertip(0.010, 0.02, 0.1)
    assert len(tip.positions_m) == 1
    assert taxel_pitch_m(tip) == 0.010


@pytest.mark.parametrize(("radius", "pitch", "cap"), [(0, 1e-3, 0.5), (0.01, 0, 0.5), (0.01, 1e-3, 4.0)])
def test_impossible_layouts_are_refused(radius, pitch, cap):
    with pytest.raises(UsageError, match="can't be laid out"):
        spherical_fingertip(radius, pitch, cap)
