"""Decisions: definitions, bounds, laws between the rules, ties."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evifuse.belief import Frame, MassFunction, belief, conjunctive, pignistic, plausibility
from evifuse.belief.decide import (
    REJECTED,
    decide,
    expected_cost,
    maximum_belief,
    maximum_pignistic,
    maximum_plausibility,
    names_of,
)
from evifuse.belief.dominance import bound_dominance, interval_dominance, maximality
from evifuse.errors import ConflictError, MassError
from tests.belief.strategies import dense, frames, masses_over

LAYOUTS = ("shared", "padded", "dense")
KINDS = ("lower", "pignistic", "upper")


@st.composite
def cases(draw: st.DrawFn) -> tuple[MassFunction, np.ndarray]:
    frame = draw(frames())
    acts = draw(st.integers(1, 5))
    seed = draw(st.integers(0, 2**32 - 1))
    costs = np.random.default_rng(seed).integers(-4, 9, (acts, len(frame))).astype(float)
    return draw(masses_over(frame, (3,))), costs


@given(cases())
def test_expected_costs_are_their_definitions(case: tuple[MassFunction, np.ndarray]) -> None:
    m, costs = case
    table = dense(m)
    for kind, worth in (("lower", np.min), ("pignistic", np.mean), ("upper", np.max)):
        expected = np.zeros((3, len(costs)))
        for s in range(1, m.frame.full + 1):
            members = [k for k in range(len(m.frame)) if s >> k & 1]
            expected += table[:, s, None] * worth(costs[:, members], axis=1)
        for layout in LAYOUTS:
            np.testing.assert_allclose(expected_cost(m.to(layout), costs, kind), expected, atol=1e-9)
            np.testing.assert_allclose(expected_cost(m[1].to(layout), costs, kind), expected[1], atol=1e-9)


@given(cases())
def test_lower_pignistic_and_upper_costs_are_ordered(case: tuple[MassFunction, np.ndarray]) -> None:
    lower, middle, upper = (expected_cost(*case, kind) for kind in KINDS)
    assert np.all(lower <= middle + 1e-9)
    assert np.all(middle <= upper + 1e-9)


@given(cases())
def test_one_hypothesis_is_chosen_by_its_measure(case: tuple[MassFunction, np.ndarray]) -> None:
    m, _ = case
    names = m.frame.hypotheses
    measures = (
        (maximum_pignistic, pignistic(m)),
        (maximum_belief, np.stack([belief(m, n) for n in names], -1)),
        (maximum_plausibility, np.stack([plausibility(m, n) for n in names], -1)),
    )
    for rule, values in measures:
        for layout in LAYOUTS:
            at = rule(m.to(layout))
            assert at.shape == (3,)
            best = np.take_along_axis(values, at[:, None], -1)[:, 0]
            np.testing.assert_allclose(best, values.max(axis=-1), atol=1e-12)


@given(st.data())
def test_costs_of_errors_give_the_maxima(data: st.DataObject) -> None:
    m = data.draw(masses_over(data.draw(frames()), (3,)))
    errors = 1 - np.eye(len(m.frame))
    rules = ((maximum_plausibility, "lower"), (maximum_pignistic, "pignistic"), (maximum_belief, "upper"))
    for rule, kind in rules:
        cost = expected_cost(m, errors, kind)
        chosen = np.take_along_axis(cost, rule(m)[:, None], -1)[:, 0]
        np.testing.assert_allclose(chosen, cost.min(axis=-1), atol=1e-12)


@given(cases())
def test_dominance_is_its_definition(case: tuple[MassFunction, np.ndarray]) -> None:
    m, costs = case
    lower, upper = expected_cost(m, costs, "lower"), expected_cost(m, costs, "upper")
    strong, weak, maximal = interval_dominance(m, costs), bound_dominance(m, costs), maximality(m, costs)
    acts = range(len(costs))
    for i in range(3):
        for a in acts:
            beaten = any(upper[i, b] < lower[i, a] - 1e-9 for b in acts)
            assert strong[i, a] == (not beaten)
            no_worse = [
                b for b in acts if lower[i, b] <= lower[i, a] + 1e-9 and upper[i, b] <= upper[i, a] + 1e-9
            ]
            beaten = any(
                lower[i, b] < lower[i, a] - 1e-9 or upper[i, b] < upper[i, a] - 1e-9 for b in no_worse
            )
            assert weak[i, a] == (not beaten)
            change = [expected_cost(m[i], costs[[b]] - costs[[a]], "upper")[0] for b in acts]
            assert maximal[i, a] == (min(change) >= -1e-9)


@given(cases())
def test_the_rules_are_nested_and_never_empty(case: tuple[MassFunction, np.ndarray]) -> None:
    m, costs = case
    strong, weak, maximal = interval_dominance(m, costs), bound_dominance(m, costs), maximality(m, costs)
    assert np.all(weak <= strong)
    assert np.all(maximal <= strong)
    for kept in (weak, maximal):
        assert np.all(kept.any(axis=-1))
    lower, upper = (decide(m, costs, kind) for kind in ("lower", "upper"))
    assert np.all(np.take_along_axis(strong, lower[:, None], -1))
    assert np.all(np.take_along_axis(strong, upper[:, None], -1))
    pignistic_choice = decide(m, costs)
    assert np.all(np.take_along_axis(maximal, pignistic_choice[:, None], -1))


@given(st.data())
def test_dominance_of_hypotheses_compares_belief_with_plausibility(data: st.DataObject) -> None:
    m = data.draw(masses_over(data.draw(frames()), (3,)))
    low = np.stack([belief(m, n) for n in m.frame.hypotheses], -1)
    high = np.stack([plausibility(m, n) for n in m.frame.hypotheses], -1)
    beaten = low.max(axis=-1, keepdims=True) > high + 1e-9
    for layout in LAYOUTS:
        np.testing.assert_array_equal(interval_dominance(m.to(layout)), ~beaten)


def test_ignorance_leaves_everything_in_the_running_and_certainty_one() -> None:
    frame = Frame(["a", "b", "c"])
    for rule in (interval_dominance, bound_dominance, maximality):
        assert rule(MassFunction.vacuous(frame)).tolist() == [True, True, True]
        assert rule(MassFunction.of(frame, {"b": 1.0})).tolist() == [False, True, False]


def test_ties_go_to_the_first() -> None:
    frame = Frame(["a", "b", "c"])
    ignorant = MassFunction.vacuous(frame, (2,))
    for rule in (maximum_belief, maximum_pignistic, maximum_plausibility):
        assert rule(ignorant).tolist() == [0, 0]
    assert decide(ignorant, np.ones((3, 3))).tolist() == [0, 0]


def test_an_act_goes_before_a_rejection_of_equal_cost() -> None:
    frame = Frame(["a", "b"])
    m = MassFunction(frame, ["a", frame], [[0.5, 0.5], [1.0, 0.0], [0.0, 1.0]])
    errors = 1 - np.eye(2)
    assert decide(m, errors, rejection=0.25).tolist() == [0, 0, REJECTED]
    assert decide(m, errors, rejection=0.2).tolist() == [REJECTED, 0, REJECTED]
    assert decide(m, errors, "lower", rejection=0.0).tolist() == [0, 0, 0]
    assert decide(m, errors, "upper", rejection=0.4).tolist() == [REJECTED, 0, REJECTED]


@given(cases(), st.floats(-5, 9))
def test_rejection_is_an_act_of_constant_cost(case: tuple[MassFunction, np.ndarray], cost: float) -> None:
    m, costs = case
    with_act = np.vstack([costs, np.full(costs.shape[1], cost)])
    for kind in KINDS:
        rejected = decide(m, costs, kind, rejection=cost) == REJECTED
        value = expected_cost(m, with_act, kind)
        sure = np.abs(value[:, :-1].min(axis=-1) - cost) > 1e-9
        as_act = decide(m, with_act, kind) == len(costs)
        np.testing.assert_array_equal(rejected[sure], as_act[sure])


def test_names() -> None:
    frame = Frame(["a", "b", "c"])
    assert names_of(frame, np.array(2)) == "c"
    assert names_of(frame, np.int64(REJECTED)) == "rejected"
    assert names_of(frame, [[0, -1]], rejected="unsure") == [["a", "unsure"]]
    assert names_of(frame, [True, False, True]) == ("a", "c")
    assert names_of(frame, [[True, False, True], [False] * 3]) == [("a", "c"), ()]
    with pytest.raises(MassError, match="index 3"):
        names_of(frame, [0, 3])
    with pytest.raises(MassError, match=r"shape \(2,\)"):
        names_of(frame, [True, False])


def test_mass_on_the_empty_set_is_divided_out() -> None:
    frame = Frame(["a", "b"])
    clash = conjunctive(
        MassFunction.of(frame, {"a": 0.5, frame: 0.5}), MassFunction.of(frame, {"b": 0.4, frame: 0.6})
    )
    scaled = MassFunction.of(frame, {"a": 0.3 / 0.8, "b": 0.2 / 0.8, frame: 0.3 / 0.8})
    costs = [[1.0, 4.0], [3.0, 0.0]]
    for kind in KINDS:
        np.testing.assert_allclose(expected_cost(clash.mass, costs, kind), expected_cost(scaled, costs, kind))
    np.testing.assert_array_equal(interval_dominance(clash.mass, costs), interval_dominance(scaled, costs))
    nothing = MassFunction.of(frame, {(): 1.0}, open_world=True)
    for rule in (maximum_belief, maximum_plausibility, maximum_pignistic, interval_dominance, maximality):
        with pytest.raises(ConflictError, match="empty set"):
            rule(nothing)


@pytest.mark.parametrize(
    ("costs", "message"),
    [
        ([[1, 2, 3]], r"shape \(acts, 2\), not \(1, 3\)"),
        ([1, 2], r"not \(2,\)"),
        ([[1, 2], [3]], "costs must be numbers"),
        (np.empty((0, 2)), r"not \(0, 2\)"),
        ([[0, 1], [np.nan, 1]], "act 1 under 'a' is nan"),
    ],
)
def test_bad_costs_are_refused(costs: object, message: str) -> None:
    m = MassFunction.vacuous(Frame(["a", "b"]))
    for rule in (decide, expected_cost, interval_dominance, bound_dominance, maximality):
        with pytest.raises(MassError, match=message):
            rule(m, costs)


def test_unknown_expectations_and_endless_rejection_are_refused() -> None:
    m = MassFunction.vacuous(Frame(["a", "b"]))
    with pytest.raises(MassError, match="'mean'"):
        expected_cost(m, np.eye(2), "mean")
    with pytest.raises(MassError, match="cost of rejection is nan"):
        decide(m, np.eye(2), rejection=float("nan"))


def test_many_hypotheses() -> None:
    frame = Frame([f"h{i}" for i in range(62)])
    m = MassFunction(frame, [1 << 61, 0b11, frame.full], [0.5, 0.3, 0.2])
    assert names_of(frame, maximum_belief(m)) == "h61"
    assert names_of(frame, interval_dominance(m)) == ("h0", "h1", "h61")
