import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evifuse.errors import UsageError
from evifuse.touch import (
    chapter_belief,
    class_probabilities,
    resolved_belief,
    smearing_discount,
    spherical_fingertip,
)
from evifuse.touch.smearing import check_belief_model

TIP = spherical_fingertip(0.010, 0.001, 0.5)


def by_the_letter(directions, pressure, threshold):
    """Section 4.1.4, term by term, with the distance from its geometry: Q is on a sphere of radius 2a."""
    numerator = denominator = 0.0
    for n_p, sample in zip(directions, pressure, strict=True):
        contact = int(np.argmax(sample))
        r_p = 2 * TIP.radius_m * n_p
        weighted = distances = 0.0
        for k, v in enumerate(sample):
            if k != contact and v > threshold:
                d = abs((2 * TIP.radius_m * TIP.normals[k] - r_p) @ n_p)
                weighted, distances = weighted + v * d, distances + d
        numerator += sample[contact] - (weighted / distances if distances else 0.0)
        denominator += sample[contact]
    return numerator / denominator


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0, 2000))
def test_the_discount_is_the_chapters_formula(seed, threshold):
    rng = np.random.default_rng(seed)
    pressure = rng.uniform(0, 4000, (4, len(TIP.normals)))
    directions = rng.normal([0, 0, -3], 1, (4, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    discount = smearing_discount(TIP, directions, pressure, threshold)
    assert discount == pytest.approx(by_the_letter(directions, pressure, threshold), abs=1e-9)
    assert 0 <= discount <= 1


def test_a_single_active_cell_is_not_discounted():
    pressure = np.zeros((3, len(TIP.normals)))
    pressure[:, 5] = 1000.0
    assert smearing_discount(TIP, TIP.normals[[5, 5, 5]], pressure, 10.0) == 1.0


def test_pressure_far_from_the_contact_costs_more_than_near():
    order = np.argsort(-TIP.normals @ TIP.normals[0])
    discounts = []
    for neighbour in (order[3], order[-1]):
        pressure = np.zeros((1, len(TIP.normals)))
        pressure[0, order[0]], pressure[0, order[1]], pressure[0, neighbour] = 1000.0, 100.0, 800.0
        discounts.append(smearing_discount(TIP, TIP.normals[:1], pressure, 10.0))
    assert discounts[0] > discounts[1]


def test_no_pressure_is_no_belief():
    assert smearing_discount(TIP, TIP.normals[:1], np.zeros((1, len(TIP.normals))), 10.0) == 0.0


@given(st.floats(0, 1), st.floats(-500, 500))
def test_the_chapters_belief_grows_from_zero_on_a_plane(discount, curvature):
    belief = chapter_belief(discount, curvature - 100.0, 0.010)
    assert belief == pytest.approx(min(0.010 * abs(curvature) * discount, 1.0), abs=1e-12)


@given(st.floats(-200, 200), st.floats(0, 50), st.floats(0.1, 20))
def test_class_probabilities_sum_to_one_and_mirror(curvature, error, gamma):
    down, flat, up = class_probabilities(curvature, error, gamma)
    assert down + flat + up == pytest.approx(1.0)
    assert min(down, flat, up) >= 0
    assert class_probabilities(-curvature, error, gamma) == pytest.approx((up, flat, down))


@pytest.mark.parametrize("curvature", [0.0, -30.0, 30.0])
def test_a_sharp_estimate_keeps_its_discount_and_a_vague_one_loses_it(curvature):
    assert resolved_belief(0.8, curvature, 0.1, 5.0) == pytest.approx(0.8)
    assert resolved_belief(0.8, curvature, 200.0, 5.0) < 0.5


def test_an_unknown_model_is_named():
    with pytest.raises(UsageError, match=r"'bayes'.*'resolved' or 'chapter'"):
        check_belief_model("bayes")
