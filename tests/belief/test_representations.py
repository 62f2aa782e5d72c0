import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evifuse.belief import Frame, MassFunction, belief, commonality, conjunctive, discount, plausibility
from evifuse.belief.representations import (
    contour,
    from_belief,
    from_commonality,
    from_implicability,
    from_plausibility,
    plausibility_transform,
    to_belief,
    to_commonality,
    to_implicability,
    to_plausibility,
)
from evifuse.belief.weights import (
    from_conjunctive_weights,
    from_disjunctive_weights,
    to_conjunctive_weights,
    to_disjunctive_weights,
)
from evifuse.errors import ConflictError, MassError
from tests.belief.strategies import dense, frames, masses_over

FRAME = Frame(["a", "b", "c"])
BOTH_WAYS = {
    "belief": (to_belief, from_belief),
    "implicability": (to_implicability, from_implicability),
    "plausibility": (to_plausibility, from_plausibility),
    "commonality": (to_commonality, from_commonality),
}


def opened(m: MassFunction, share: float) -> MassFunction:
    """Some of the mass moved to the empty set."""
    values = dense(m) * (1 - share)
    values[..., 0] += share
    return MassFunction(m.frame, range(m.frame.full + 1), values, open_world=True)


@given(st.data())
def test_each_agrees_with_the_measure_of_one_set(data: st.DataObject) -> None:
    m = data.draw(masses_over(data.draw(frames()), (2,)))
    for whole, single in (
        (to_belief, belief),
        (to_plausibility, plausibility),
        (to_commonality, commonality),
    ):
        table = whole(m)
        for a in range(1, m.frame.full + 1):
            np.testing.assert_allclose(table[:, a], single(m, a), atol=1e-12, rtol=0)
    np.testing.assert_allclose(to_implicability(m), to_belief(m), atol=1e-15)
    np.testing.assert_array_equal(to_plausibility(m)[:, 0], 0)


@pytest.mark.parametrize("name", BOTH_WAYS)
@given(data=st.data())
def test_round_trips_leave_no_residue(name: str, data: st.DataObject) -> None:
    there, back = BOTH_WAYS[name]
    m = data.draw(masses_over(data.draw(frames()), (2, 1)))
    for source in (m, opened(m, 0.25)):
        result = back(source.frame, there(source))
        assert result.layout == "dense"
        assert result.batch == (2, 1)
        np.testing.assert_allclose(result.masses, dense(source), atol=1e-12, rtol=0)
        assert np.all(result.masses >= 0)
        np.testing.assert_array_equal(result.masses[dense(source) == 0], 0.0)


@given(st.data())
def test_weights_round_trip(data: st.DataObject) -> None:
    m = discount(data.draw(masses_over(data.draw(frames()), (2,))), reliability=0.9)
    back = from_conjunctive_weights(m.frame, to_conjunctive_weights(m))
    np.testing.assert_allclose(back.masses, dense(m), atol=1e-12, rtol=0)
    subnormal = opened(m, 0.2)
    back = from_disjunctive_weights(m.frame, to_disjunctive_weights(subnormal))
    np.testing.assert_allclose(back.masses, dense(subnormal), atol=1e-12, rtol=0)


@given(st.data())
def test_weights_are_those_of_the_definition(data: st.DataObject) -> None:
    m = discount(data.draw(masses_over(data.draw(frames()))), reliability=0.8)
    q, full = to_commonality(m), m.frame.full
    w = to_conjunctive_weights(m)
    assert w[full] == 1
    for a in range(full):
        logs = [(-1) ** ((b ^ a).bit_count() + 1) * np.log(q[b]) for b in range(full + 1) if b & a == a]
        np.testing.assert_allclose(np.log(w[a]), sum(logs), atol=1e-11)


@given(st.data())
def test_weights_multiply_in_the_conjunctive_combination(data: st.DataObject) -> None:
    frame = data.draw(frames())
    a, b = (discount(data.draw(masses_over(frame)), reliability=0.9) for _ in range(2))
    product = to_conjunctive_weights(a) * to_conjunctive_weights(b)
    joint = from_conjunctive_weights(frame, product)
    np.testing.assert_allclose(joint.masses, dense(conjunctive(a, b).mass), atol=1e-12, rtol=0)


def test_small_plausibilities_keep_their_digits() -> None:
    m = MassFunction.of(FRAME, {"a": 1.0 - 1e-12, ("b", "c"): 1e-12 - 1e-30, "c": 1e-30})
    np.testing.assert_allclose(to_plausibility(m)[[2, 4]], [1e-12, 1e-12], rtol=1e-15)
    assert to_belief(m)[4] == 1e-30


def test_a_large_frame_comes_back_clean() -> None:
    frame = Frame([f"h{i}" for i in range(16)])
    rng = np.random.default_rng(5)
    sets = np.append(rng.choice(frame.full - 1, 40, replace=False) + 1, frame.full)
    m = MassFunction(frame, sets, rng.dirichlet(np.ones(41)))
    expected = m.to("dense").masses
    for there, back in BOTH_WAYS.values():
        result = back(frame, there(m)).masses
        np.testing.assert_allclose(result, expected, atol=1e-12, rtol=0)
        assert np.count_nonzero(result) == 41


@pytest.mark.parametrize(
    ("back", "values", "names"),
    [
        (from_belief, [0, 0.5, 0.6, 1], "'frame' would be -0.1"),
        (from_commonality, [1, 0.2, 0.5, 0.5], "mass of 'a' would be -0.3"),
        (from_plausibility, [0, 0.2, 0.3, 1], "'frame' would be -0.5"),
        (from_implicability, [0.3, 0.2, 0.5, 1], "mass of 'a' would be -0.1"),
        (from_conjunctive_weights, [1, 3, 1, 1], "mass of 'a' would be -2"),
        (from_disjunctive_weights, [1, 3, 1, 1], "mass of 'a' would be -2"),
        (from_belief, [0.1, 0.5, 0.5, 1], "'∅' must be 0, not 0.1"),
        (from_plausibility, [0.1, 0.5, 0.5, 1], "'∅' must be 0"),
        (from_commonality, [0.9, 0.5, 0.5, 0.5], "'∅' must be 1, not 0.9"),
        (from_implicability, [0, 0.5, 0.5, 0.9], "'frame' must be 1, not 0.9"),
        (from_conjunctive_weights, [1, 0, 1, 1], "0 of 'a' is not positive"),
        (from_conjunctive_weights, [1, 1, 1, 2], "'frame' must be 1"),
        (from_disjunctive_weights, [2, 1, 1, 1], "'∅' must be 1"),
        (from_commonality, [1, np.nan, 0.5, 0.5], "nan of 'a'"),
        (from_commonality, [1, 1.5, 0.5, 0.5], "1.5 of 'a' is not in [0, 1]"),
        (from_commonality, [1, 0.5], "needs shape (..., 4), not (2,)"),
    ],
)
def test_what_is_no_such_function_is_refused_by_name(back, values, names: str) -> None:
    with pytest.raises(MassError) as caught:
        back(Frame(["a", "b"]), values)
    assert names in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_offender_in_a_batch_is_found() -> None:
    values = np.tile([1, 0.5, 0.5, 0.5], (3, 1))
    values[2, 1] = 0.1
    with pytest.raises(MassError, match=r"index \(2,\).*'a' would be -0.4"):
        from_commonality(Frame(["a", "b"]), values)


def test_sources_without_weights_are_told_the_remedy() -> None:
    dogmatic = MassFunction(FRAME, ["a", FRAME], [[0.5, 0.5], [1.0, 0.0]])
    with pytest.raises(MassError, match=r"index \(1,\) is dogmatic.*discount"):
        to_conjunctive_weights(dogmatic)
    with pytest.raises(MassError, match=r"normal.*open_world"):
        to_disjunctive_weights(MassFunction.vacuous(FRAME))
    with pytest.raises(MassError, match="limit is 20"):
        to_commonality(MassFunction.vacuous(Frame([f"h{i}" for i in range(21)])))


@pytest.mark.parametrize("layout", ["shared", "padded", "singletons", "dense"])
def test_layouts_agree(layout) -> None:
    m = MassFunction(FRAME, ["a", "b", "c", FRAME], np.random.default_rng(0).dirichlet(np.ones(4), (2, 3)))
    other = m.to(layout)
    for transform in (*(there for there, _ in BOTH_WAYS.values()), to_conjunctive_weights, contour):
        np.testing.assert_allclose(transform(other), transform(m), atol=1e-12, rtol=0)


@given(st.data())
def test_plausibility_transform_agrees_with_dempsters_rule(data: st.DataObject) -> None:
    frame = data.draw(frames())
    a, b = (discount(data.draw(masses_over(frame, (2,))), reliability=0.9) for _ in range(2))
    p = plausibility_transform(a) * plausibility_transform(b)
    joint = plausibility_transform(conjunctive(a, b).mass)
    np.testing.assert_allclose(joint, p / p.sum(axis=-1, keepdims=True), atol=1e-12)
    singles = [1 << i for i in range(len(frame))]
    np.testing.assert_allclose(contour(a), to_plausibility(a)[:, singles], atol=1e-15)


def test_nothing_is_plausible_when_all_is_conflict() -> None:
    certain = conjunctive(MassFunction.of(FRAME, {"a": 1.0}), MassFunction.of(FRAME, {"b": 1.0})).mass
    with pytest.raises(ConflictError, match="empty set"):
        plausibility_transform(certain)
