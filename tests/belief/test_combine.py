import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evifuse.belief import Frame, MassFunction, conjunctive, dempster, discount, mass, on_frame
from evifuse.errors import ConflictError, FrameError, MassError
from tests.belief.strategies import dense, frames, masses_over, pairs

FRAME = Frame(["a", "b", "c"])


@given(pairs((2,)))
def test_conjunctive_is_the_sum_over_intersections(two: tuple[MassFunction, MassFunction]) -> None:
    a, b = two
    expected = np.zeros((2, a.frame.full + 1))
    for i, s in enumerate(a.focal_sets):
        for j, t in enumerate(b.focal_sets):
            expected[:, int(s & t)] += a.masses[:, i] * b.masses[:, j]
    joint, conflict = conjunctive(a, b)
    np.testing.assert_allclose(dense(joint), expected, atol=1e-14)
    np.testing.assert_allclose(conflict, expected[:, 0], atol=1e-14)


@given(pairs((2,)))
def test_both_rules_commute_and_ignorance_is_neutral(two: tuple[MassFunction, MassFunction]) -> None:
    a, b = two
    np.testing.assert_allclose(dense(conjunctive(a, b).mass), dense(conjunctive(b, a).mass), atol=1e-14)
    vacuous = MassFunction.vacuous(a.frame)
    np.testing.assert_allclose(dense(conjunctive(a, vacuous).mass), dense(a), atol=1e-14)
    np.testing.assert_allclose(dense(dempster(a, vacuous).mass), dense(a), atol=1e-9)


@given(st.data())
def test_dempster_is_associative(data: st.DataObject) -> None:
    frame = data.draw(frames())
    a, b, c = (discount(data.draw(masses_over(frame)), reliability=0.9) for _ in range(3))
    left = dempster(dempster(a, b).mass, c).mass
    right = dempster(a, dempster(b, c).mass).mass
    np.testing.assert_allclose(dense(left), dense(right), atol=1e-12)


def test_batches_broadcast() -> None:
    many = MassFunction(FRAME, ["a", FRAME], np.array([[[0.5, 0.5]], [[0.25, 0.75]]]))
    others = MassFunction(FRAME, ["a", FRAME], np.array([[0.5, 0.5], [0.0, 1.0], [1.0, 0.0]]))
    joint = dempster(many, others).mass
    assert joint.batch == (2, 3)
    assert joint[1][0] == dempster(many[1][0], others[0]).mass


def test_near_total_conflict_keeps_its_digits() -> None:
    for tiny in (1e-6, 1e-10, 1e-15):
        a = MassFunction(FRAME, ["a", "c"], [1 - tiny, tiny])
        b = MassFunction(FRAME, ["b", "c"], [1 - tiny, tiny])
        joint, conflict = dempster(a, b)
        assert mass(joint, "c") == 1.0
        assert conflict == pytest.approx(1 - tiny**2)


def test_total_conflict_is_an_error_that_says_where() -> None:
    a = MassFunction(FRAME, ["a"], [[1.0], [1.0]])
    b = MassFunction(FRAME, ["a", "b"], [[1.0, 0.0], [0.0, 1.0]])
    with pytest.raises(ConflictError, match=r"index \(1,\)"):
        dempster(a, b)
    with pytest.raises(ConflictError, match="discount"):
        dempster(MassFunction.of(FRAME, {"a": 1.0}), MassFunction.of(FRAME, {"b": 1.0}))


def test_mixed_frames_are_refused() -> None:
    other = MassFunction.vacuous(Frame(["a", "b"]))
    for rule in (conjunctive, dempster):
        with pytest.raises(FrameError, match=r"\{a, b, c\} and \{a, b\}"):
            rule(MassFunction.vacuous(FRAME), other)


@given(st.data())
def test_discounting_is_a_walk_to_ignorance(data: st.DataObject) -> None:
    m = data.draw(masses_over(data.draw(frames()), (2,)))
    assert discount(m, reliability=1.0) == m
    assert discount(m, reliability=0.0) == MassFunction.vacuous(m.frame, (2,))
    half = discount(m, reliability=0.5)
    np.testing.assert_allclose(half.masses.sum(axis=-1), 1, atol=1e-12)
    np.testing.assert_allclose(dense(half)[:, : m.frame.full], 0.5 * dense(m)[:, : m.frame.full], atol=1e-14)
    per_case = discount(m, reliability=[1.0, 0.5])
    assert per_case[0] == m[0]
    np.testing.assert_allclose(dense(per_case[1]), dense(half[1]))


@pytest.mark.parametrize("bad", [-0.1, 1.1, float("nan")])
def test_reliability_is_a_share(bad: float) -> None:
    with pytest.raises(MassError, match="reliability"):
        discount(MassFunction.vacuous(FRAME), reliability=bad)


def test_moving_to_a_larger_frame_keeps_ignorance_ignorant() -> None:
    small = Frame(["c", "a"])
    m = on_frame(MassFunction.of(small, {"c": 0.3, small: 0.7}), FRAME)
    assert m == MassFunction.of(FRAME, {"c": 0.3, FRAME: 0.7})
    with pytest.raises(FrameError, match="lacks 'b'"):
        on_frame(MassFunction.vacuous(FRAME), small)
