import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evifuse.belief import belief
from evifuse.touch import (
    CURVATURE_FRAME,
    PRIMITIVES,
    RollCurvature,
    ShapeOperator,
    evidence_from_sites,
    primitive_probabilities,
    sense_curvature,
    site_evidence,
    spherical_fingertip,
)
from evifuse.touch.resolved import operator_covariance, resolved_threshold_per_m
from tests.touch.rolled import ball, plane, rolled

TRUE = {"P": (0, 0), "C-": (0, -40), "C+": (40, 0), "H": (40, -40), "E-": (-40, -40), "E+": (40, 40)}
ROOTS = st.lists(st.floats(-9, 9), min_size=9, max_size=9)


def along(curvature, error, direction=0.0):
    return RollCurvature(
        np.arange(3),
        direction,
        curvature,
        error,
        curvature,
        0.0,
        np.array([1.0, 0.0]),
        np.zeros(2),
        np.ones(2),
    )


def operator(first, second, angle, root=None):
    k1, k2 = max(first, second), min(first, second)
    if root is None:
        return ShapeOperator(k1, k2, 0.2, 0.2, angle)
    half = np.array(root).reshape(3, 3)
    return ShapeOperator(k1, k2, 1.0, 1.0, angle, half @ half.T + 0.01 * np.eye(3))


@pytest.mark.parametrize(("primitive", "k"), TRUE.items())
def test_sharp_principal_curvatures_give_their_primitive_alone(primitive, k):
    masses = site_evidence(operator(*k, 0.3), [], 0.8, 5.0)
    assert masses[(primitive,)] == pytest.approx(0.8)
    assert sum(masses.values()) == pytest.approx(0.8)


def test_a_curvature_at_the_threshold_is_shared_between_two_primitives():
    masses = site_evidence(operator(0.0, -5.0, 0.0), [], 1.0, 5.0)
    assert masses[("P",)] == pytest.approx(0.5, abs=0.01)
    assert masses[("C-",)] == pytest.approx(0.5, abs=0.01)


@settings(max_examples=25, deadline=None)
@given(st.floats(-30, 30), st.floats(-30, 30), st.floats(0, np.pi), ROOTS, st.integers(0, 99))
def test_probabilities_are_those_of_drawn_operators(first, second, angle, root, seed):
    shape = operator(first, second, angle, root)
    axes = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    (xx, xy), (_, yy) = axes @ np.diag([shape.k1_per_m, shape.k2_per_m]) @ axes.T
    drawn = np.random.default_rng(seed).multivariate_normal([xx, xy, yy], shape.covariance, 20_000)
    k = np.linalg.eigvalsh(drawn[:, [0, 1, 1, 2]].reshape(-1, 2, 2))
    kinds = (k > 5).astype(int) - (k < -5)
    rows = {"P": (0, 0), "C-": (-1, 0), "C+": (0, 1), "H": (-1, 1), "E-": (-1, -1), "E+": (1, 1)}
    found = primitive_probabilities(shape, 5.0)
    assert sum(found.values()) == pytest.approx(1.0)
    # a nearly flat covariance makes steps that nodes see only roughly
    room = 0.02 if np.linalg.cond(shape.covariance) < 1e3 else 0.1
    for name, kind in rows.items():
        assert found[name] == pytest.approx(float((kinds == kind).all(axis=1).mean()), abs=room)


@given(st.floats(-60, 60), st.floats(-60, 60), st.floats(0, np.pi), st.floats(0, np.pi))
def test_a_turned_site_has_the_same_primitives(first, second, angle, turn):
    before = operator(first, second, angle)
    after = operator(first, second, angle + turn)
    old, new = (primitive_probabilities(shape, 5.0) for shape in (before, after))
    assert new == pytest.approx(old, abs=2e-3)


@given(st.floats(-60, 60), st.floats(-60, 60), st.floats(0, np.pi), ROOTS)
def test_a_surface_turned_inside_out_has_the_mirrored_primitives(first, second, angle, root):
    shape = operator(first, second, angle, root)
    mirrored = ShapeOperator(-shape.k2_per_m, -shape.k1_per_m, 1.0, 1.0, angle + np.pi / 2, shape.covariance)
    found, back = primitive_probabilities(shape, 5.0), primitive_probabilities(mirrored, 5.0)
    other = {"P": "P", "H": "H", "C-": "C+", "C+": "C-", "E-": "E+", "E+": "E-"}
    assert {other[p]: share for p, share in back.items()} == pytest.approx(found, abs=5e-3)


def test_errors_that_go_together_are_counted_once():
    # k_xx and k_yy wrong by the same amount: a cylinder becomes elliptical or hyperbolic, never a plane
    shared = ShapeOperator(6.0, 6.0, 3.0, 3.0, 0.0, 9.0 * np.array([[1, 0, 1], [0, 0, 0], [1, 0, 1.0]]))
    apart = ShapeOperator(6.0, 6.0, 3.0, 3.0, 0.0, 9.0 * np.diag([1.0, 0.0, 1.0]))
    assert primitive_probabilities(shared, 5.0)["C+"] < 0.01
    assert primitive_probabilities(apart, 5.0)["C+"] > 0.4


def test_without_a_covariance_it_is_made_from_the_two_errors():
    made = operator_covariance(ShapeOperator(0.0, -9.0, 1.0, 2.0, np.pi / 2))
    assert made == pytest.approx(np.diag([4.0, 1.25, 1.0]), abs=1e-12)


def test_a_plane_that_is_felt_badly_is_still_a_plane():
    shape = ShapeOperator(3.0, -4.0, 6.0, 6.0, 0.0)
    assert resolved_threshold_per_m(5.0, shape) == 12.0
    assert resolved_threshold_per_m(5.0, operator(0, 0, 0)) == 5.0
    assert resolved_threshold_per_m(5.0, ShapeOperator(0.0, -900.0, 100.0, 300.0, 0.0)) == 15.0
    one_way = ShapeOperator(0.5, -9.0, 1.0, 8.0, 0.0)
    assert resolved_threshold_per_m(5.0, one_way) == 15.0
    assert resolved_threshold_per_m(5.0, ShapeOperator(0.5, -32.0, 1.0, 8.0, 0.0)) == 5.0  # clear of flat
    for felt_badly in (shape, one_way):
        masses = site_evidence(felt_badly, [], 1.0, 5.0)
        assert max(masses, key=masses.__getitem__) == ("P",)


def test_one_direction_supports_the_set_of_primitives_that_have_it():
    down = site_evidence(None, [along(-30.0, 1.0)], 0.7, 5.0)
    assert down[("C-", "H", "E-")] == pytest.approx(0.7)
    flat = site_evidence(None, [along(0.0, 1.0)], 0.7, 5.0)
    assert flat[("P", "C-", "C+", "H")] == pytest.approx(0.7)
    assert site_evidence(None, [], 0.7, 5.0) == {}
    crossing = [along(-30.0, 1.0), along(-30.0, 1.0, 1.0)]  # but no operator fits both
    assert site_evidence(None, crossing, 0.7, 5.0) == {}
    assert site_evidence(ShapeOperator(*[np.nan] * 5), [], 0.7, 5.0) == {}


@given(
    k=st.tuples(st.floats(-99, 99), st.floats(-99, 99)),
    errors=st.tuples(st.floats(0, 99), st.floats(0, 99)),
    local=st.lists(st.tuples(st.floats(-99, 99), st.floats(0, 99)), min_size=1, max_size=6),
    relied=st.floats(0, 1),
    missed=st.lists(st.floats(0, 1), max_size=3),
    known=st.booleans(),
)
def test_evidence_is_a_mass_function_whatever_was_felt(k, errors, local, relied, missed, known):
    shape = ShapeOperator(max(k), min(k), *errors, 0.0) if known else None
    masses = site_evidence(shape, [along(*values) for values in local], relied, 5.0)
    assert sum(masses.values()) == pytest.approx(relied)
    evidence = evidence_from_sites([masses], missed)
    assert evidence.masses.sum() == pytest.approx(1.0)
    assert float(belief(evidence, "N")) == pytest.approx(sum(missed) / (1 + len(missed)))


def test_sites_weigh_the_same_and_no_sites_are_ignorance():
    evidence = evidence_from_sites([{("P",): 0.9}, {}], [1.0, 1.0])
    assert evidence.as_dict() == pytest.approx({"N": 0.5, "P": 0.225, "frame": 0.275})
    assert evidence_from_sites([], []).as_dict() == {"frame": 1.0}
    assert CURVATURE_FRAME.hypotheses == (*PRIMITIVES, "N")


@pytest.mark.parametrize("pitch_m", [0.002, 0.003])
def test_one_direction_of_far_taxels_is_as_unsure_as_it_is_wrong(pitch_m):
    off = []
    for number, (surface, k) in enumerate([(plane(), 0.0), (ball(0.03), -1 / 0.03), (ball(0.08), -12.5)] * 2):
        tip = spherical_fingertip(pitch_m=pitch_m)
        felt = sense_curvature(rolled(surface, (0.3 * number,), samples=400, tip=tip))
        (found,) = felt.local_curvatures
        off.append((found.curvature_per_m - k) / found.standard_error_per_m)
    assert np.abs(off).max() < 4
