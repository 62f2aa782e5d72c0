import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evifuse.touch import (
    RollCurvature,
    ShapeOperator,
    contact_quality,
    contact_track,
    reliance,
    spherical_fingertip,
)
from evifuse.touch.reliance import TERMS, load_reliance, resolution
from tests.touch.rolled import plane, rolled

BAD = st.floats(0, 5)


@given(st.fixed_dictionaries(dict.fromkeys(TERMS, BAD)), st.sampled_from(TERMS), st.floats(0, 5))
def test_nothing_bad_makes_a_site_more_reliable(terms, worse, by):
    before, after = reliance(terms), reliance(terms | {worse: terms[worse] + by})
    assert 0 < after <= before < 1


def test_a_good_site_is_relied_on():
    assert reliance({}) > 0.9
    assert set(load_reliance().weights) == set(TERMS)


def quality(slip=0.0, **options):
    recording = rolled(plane(), (0.0,), samples=200, **options)
    return contact_quality(recording, contact_track(recording), np.arange(30, 220), slip)


def test_terms_say_what_is_bad():
    good = quality()
    assert good["noisy"] == pytest.approx(0.0, abs=0.01)
    assert quality(slip=-0.2)["slip"] == pytest.approx(2.0)
    assert quality(pressure_noise_pa=500.0)["noisy"] > good["noisy"] + 0.2
    coarse = quality(tip=spherical_fingertip(pitch_m=0.002))
    assert coarse["coarse"] > 1.5 * good["coarse"]
    wide = quality(smear_m=0.002)
    assert wide["coarse"] < 0.7 * good["coarse"]


def test_the_patch_of_a_sphere_on_a_plane_is_known():
    # pressed 60 um deep: radius sqrt(2 a depth) = 1.1 mm; springs give root(2/3) of a disc's spread
    patch = 0.7 / quality(smear_m=0.0, depth_m=2e-4)["coarse"]
    assert patch == pytest.approx(np.sqrt(2 * 10.0 * 0.2) * np.sqrt(2 / 3), rel=0.1)


def test_an_error_as_large_as_the_threshold_is_one():
    assert resolution(ShapeOperator(0.0, -9.0, 2.0, 5.0, 0.0), [], 5.0) == 1.0
    assert resolution(ShapeOperator(0.0, -9.0, 2.0, 500.0, 0.0), [], 5.0) == 10.0
    assert resolution(None, [], 5.0) == 0.0


def test_without_an_operator_the_errors_of_the_rolls_count():
    rolls = [
        RollCurvature(np.arange(3), 0.0, 1.0, e, 1.0, 0.0, np.array([1.0, 0.0]), np.zeros(2), np.ones(2))
        for e in (1.0, 10.0, 200.0)
    ]
    assert resolution(None, rolls, 5.0) == 2.0
