"""The chapter's formulas of sections 3.1 and 3.2, and the laws that any belief must obey."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evifuse.vision import (
    SHAPE_FRAME,
    edge_belief,
    fit_edge,
    rectangle_belief,
    shape_evidence,
    square_belief,
    triangle_belief,
)
from evifuse.vision.primitives import Agreement, bracket_belief, circle_belief, ellipse_belief

NAN = float("nan")
UNIT = st.floats(0, 1)


def test_the_printed_example() -> None:
    edges, angles = [0.31, 0.15, 0.15, NAN], np.deg2rad([80, 100, NAN, NAN])
    beliefs = {
        "rectangle": rectangle_belief(edges, [1, 1, 1, NAN], angles),
        "square": square_belief(edges, [1, 1, 1, NAN], angles),
        "triangle": triangle_belief(edges[:3], angles),
    }
    masses = shape_evidence(beliefs).as_dict()
    assert {k: round(v, 2) for k, v in masses.items() if v > 0} == {
        "rectangle": 0.19,
        "square": 0.10,
        "triangle": 0.20,
        "frame": 0.51,
    }


def test_a_straight_unbroken_edge_is_certain() -> None:
    corners = np.array([[0.0, 0.0], [4.0, 3.0], [8.0, 6.0]])
    edge = fit_edge(corners[:-1], corners[1:])
    assert edge.belief == pytest.approx(1.0)
    np.testing.assert_allclose([edge.start, edge.end], [[0, 0], [8, 6]], atol=1e-9)


def test_edge_belief_term_by_term() -> None:
    # two segments on a line with a gap of 4 between them, one segment across: by hand
    starts = np.array([[0.0, 0.0], [6.0, 0.0], [8.0, 0.0]])
    ends = np.array([[2.0, 0.0], [8.0, 0.0], [8.0, 2.0]])
    x, y = np.array([0.0, 0.0]), np.array([8.0, 0.0])
    total = 2 + 4 + 2 + 2
    assert edge_belief(starts, ends, x, y) == pytest.approx(8 / total * 1.0 * 2 / 4)


def test_the_smallest_angle_attenuates() -> None:
    turn = np.deg2rad(30)
    starts, ends = np.array([[0.0, 0.0]]), np.array([[10 * np.cos(turn), 10 * np.sin(turn)]])
    belief = edge_belief(starts, ends, np.zeros(2), np.array([10.0, 0.0]))
    assert belief == pytest.approx(1 - np.sin(turn))


@given(
    st.lists(st.tuples(st.floats(-50, 50), st.floats(-50, 50)), min_size=2, max_size=9), st.integers(0, 99)
)
def test_edge_belief_is_in_range_and_does_not_depend_on_the_side_it_starts_from(
    corners: list[tuple[float, float]], seed: int
) -> None:
    points = np.array(corners) + np.random.default_rng(seed).normal(0, 0.1, (len(corners), 2))
    there = fit_edge(points[:-1], points[1:])
    back = fit_edge(points[:0:-1], points[-2::-1])
    assert 0 <= there.belief <= 1
    assert there.belief == pytest.approx(back.belief, abs=1e-6)


@given(st.lists(UNIT, min_size=4, max_size=4), st.lists(st.floats(0.1, 9), min_size=4, max_size=4))
def test_polygon_beliefs_are_in_range_and_never_exceed_the_mean_of_the_edges(
    edges: list[float], lengths: list[float]
) -> None:
    right = [np.pi / 2] * 4
    for belief in (rectangle_belief(edges, lengths, right), square_belief(edges, lengths, right)):
        assert 0 <= belief <= np.mean(edges) + 1e-12
    assert 0 <= triangle_belief(edges[:3], [1.0, 1.0, np.pi - 2.0]) <= np.mean(edges[:3]) + 1e-12


def test_what_attenuates_a_rectangle() -> None:
    edges, right = [0.8] * 4, [np.pi / 2] * 4
    assert rectangle_belief(edges, [2, 1, 2, 1], right) == pytest.approx(0.8)
    assert rectangle_belief(edges, [2, 1, 1, 1], right) == pytest.approx(0.4)
    skew = np.deg2rad([60, 120, 60, 120])
    assert rectangle_belief(edges, [2, 1, 2, 1], skew) == pytest.approx(0.8 * np.sin(np.pi / 3) ** 4)
    assert square_belief(edges, [2, 1, 2, 1], right) == pytest.approx(0.4)
    assert rectangle_belief([0.8, NAN, 0.8, NAN], [1, NAN, 1, NAN], right) == 0


def test_angles_of_a_triangle_sum_to_pi() -> None:
    assert triangle_belief([0.6] * 3, [np.pi / 3] * 3) == pytest.approx(0.6)
    assert triangle_belief([0.6] * 3, [np.pi / 2] * 3) == pytest.approx(0.0, abs=1e-12)


@given(UNIT, UNIT, UNIT, UNIT, UNIT, st.floats(0.01, 1))
def test_curved_beliefs_are_products_of_attenuations(
    fit: float, explained: float, coverage: float, opening: float, tangency: float, ratio: float
) -> None:
    match = Agreement(fit, explained, coverage, min(opening, 1 - coverage), deviation=1.0)
    ellipse = ellipse_belief(match, tangency)
    assert 0 <= circle_belief(match, tangency, ratio) <= ellipse <= min(fit, explained, coverage, tangency)
    assert 0 <= bracket_belief(match, tangency) <= min(fit, explained, tangency) + 1e-12


def test_a_closed_outline_is_no_bracket_and_an_open_one_is() -> None:
    assert bracket_belief(Agreement(1, 1, 1, 0, 0), 1.0) == 0
    assert bracket_belief(Agreement(1, 1, 0.7, 0.3, 0), 1.0) > 0.8
    assert bracket_belief(Agreement(1, 1, 0.2, 0.8, 0), 1.0) < 0.1


@given(st.lists(UNIT, min_size=6, max_size=6))
def test_evidence_sums_to_one_and_keeps_the_order_of_beliefs(values: list[float]) -> None:
    evidence = shape_evidence(dict(zip(SHAPE_FRAME.hypotheses, values, strict=True)))
    masses = evidence.masses
    assert masses.sum() == pytest.approx(1.0)
    assert (np.argsort(values, kind="stable") == np.argsort(masses[:6].round(15), kind="stable")).all() or (
        np.diff(np.sort(values)).min() < 1e-9
    )
    if sum(values) > 1:
        assert masses[-1] == pytest.approx(np.prod(1 - np.array(values)), abs=1e-12)
    else:
        np.testing.assert_allclose(masses[:6], values)
