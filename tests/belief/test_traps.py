"""What goes wrong elsewhere, and not here: a test for each trap found by running other libraries."""

import inspect
import pickle

import numpy as np
import pytest

import evifuse.belief
from evifuse.belief import (
    Frame,
    MassFunction,
    conjunctive,
    dempster,
    discount,
    disjunctive,
    dubois_prade,
    mass,
    pcr5,
    yager,
)
from evifuse.errors import ConflictError, FrameError, MassError

FRAME = Frame(["a", "b", "c"])


def test_no_silent_renormalisation() -> None:
    with pytest.raises(MassError, match=r"sum to 0\.6"):
        MassFunction.of(FRAME, {"a": 0.3, "b": 0.3})


def test_a_nan_focal_set_is_not_deleted() -> None:
    with pytest.raises(MassError, match="nan of 'b'"):
        MassFunction.of(FRAME, {"a": 1.0, "b": float("nan")})


@pytest.mark.parametrize("doubt", [1e-6, 1e-10])
def test_near_total_conflict_is_not_called_total_and_sums_to_one(doubt: float) -> None:
    a = MassFunction.of(FRAME, {"a": 1 - doubt, FRAME: doubt})
    b = MassFunction.of(FRAME, {"b": 1 - doubt, FRAME: doubt})
    joint, conflict = dempster(a, b)
    assert float(joint.masses.sum()) == pytest.approx(1, abs=1e-12)
    assert float(mass(joint, "a")) == pytest.approx((1 - doubt) / (2 - doubt), rel=1e-9)
    assert float(conflict) == pytest.approx((1 - doubt) ** 2, rel=1e-12)


def test_total_conflict_is_not_an_empty_answer() -> None:
    with pytest.raises(ConflictError, match="total conflict"):
        dempster(MassFunction.of(FRAME, {"a": 1.0}), MassFunction.of(FRAME, {"b": 1.0}))


def test_frames_of_different_size_are_not_mixed() -> None:
    for rule in (conjunctive, dempster, disjunctive, yager, dubois_prade, pcr5):
        with pytest.raises(FrameError, match="different frames"):
            rule(MassFunction.vacuous(FRAME), MassFunction.vacuous(Frame(["a", "b"])))


def test_a_string_is_one_name_not_a_set_of_letters() -> None:
    with pytest.raises(FrameError, match="'ab'"):
        MassFunction.of(FRAME, {"ab": 1.0})
    with pytest.raises(FrameError, match="one string"):
        Frame("abc")


def test_masses_can_be_pickled() -> None:
    m = MassFunction.of(FRAME, {"a": 0.5, FRAME: 0.5})
    assert pickle.loads(pickle.dumps(m)) == m


def test_no_negative_residues_of_transforms() -> None:
    rng = np.random.default_rng(0)
    frame = Frame([f"h{i}" for i in range(10)])
    masses = [np.concatenate([[0.0], rng.dirichlet(np.full(1023, 0.05))]) for _ in range(2)]
    a, b = (MassFunction(frame, np.arange(1024), m) for m in masses)
    for rule in (conjunctive, dempster, disjunctive, pcr5):
        assert rule(a, b).mass.masses.min() >= 0


def test_no_operators_whose_meaning_one_has_to_guess() -> None:
    m = MassFunction.vacuous(FRAME)
    for operator in ("__or__", "__and__", "__add__", "__mul__", "__matmul__", "__xor__"):
        assert not hasattr(m, operator)


def test_no_bare_alpha() -> None:
    parameters = inspect.signature(discount).parameters
    assert parameters["reliability"].kind is inspect.Parameter.KEYWORD_ONLY
    for name in evifuse.belief.__all__:
        value = getattr(evifuse.belief, name)
        if inspect.isfunction(value):
            assert "alpha" not in inspect.signature(value).parameters


def test_inputs_are_never_changed() -> None:
    values = np.array([0.5, 0.5])
    m = MassFunction(FRAME, ["a", FRAME], values)
    before = m.masses.copy()
    dempster(m, m)
    discount(m, reliability=0.5)
    np.testing.assert_array_equal(m.masses, before)
    assert not m.masses.flags.writeable
