import copy
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evifuse.belief import Frame, MassFunction
from evifuse.errors import FrameError, MassError
from tests.belief.strategies import frames, masses_over

FRAME = Frame(["rectangle", "square", "triangle"])


def test_one_and_many_are_one_type() -> None:
    one = MassFunction.of(FRAME, {"rectangle": 0.25, ("rectangle", "square"): 0.25, FRAME: 0.5})
    many = MassFunction(FRAME, one.focal_sets, np.tile(one.masses, (4, 5, 1)))
    assert one.batch == ()
    assert many.batch == (4, 5)
    assert many[2][3] == one
    assert len(many) == 4
    assert [m.batch for m in many] == [(5,)] * 4
    assert one.as_dict() == {"frame": 0.5, "rectangle": 0.25, "rectangle|square": 0.25}
    assert repr(one) == "MassFunction(frame: 0.5, rectangle: 0.25, rectangle|square: 0.25)"
    assert "batch=(4, 5)" in repr(many)


def test_values_are_frozen_and_copied() -> None:
    given_array = np.array([0.5, 0.5])
    m = MassFunction(FRAME, ["rectangle", "square"], given_array)
    given_array[0] = 9
    assert m.masses[0] == 0.5
    with pytest.raises(ValueError, match="read-only"):
        m.masses[0] = 1
    with pytest.raises(AttributeError):
        m.frame = Frame(["x"])  # type: ignore[misc]


def test_order_of_focal_sets_does_not_matter() -> None:
    a = MassFunction(FRAME, ["rectangle", "square"], [0.3, 0.7])
    b = MassFunction(FRAME, ["square", "rectangle"], [0.7, 0.3])
    assert a == b
    assert a == MassFunction(FRAME, ["square", "rectangle", "triangle"], [0.7, 0.3, 0.0])
    assert a != MassFunction(FRAME, ["square", "rectangle"], [0.3, 0.7])
    assert a != "rectangle"


@pytest.mark.parametrize(
    ("sets", "masses", "error", "names"),
    [
        (["rectangle"], [-0.1], MassError, "-0.1 of 'rectangle' is negative"),
        (["rectangle", "square"], [0.5, np.nan], MassError, "nan of 'square' is not a finite number"),
        (["rectangle", "square"], [0.5, np.inf], MassError, "inf of 'square'"),
        (["rectangle", "square"], [0.5, 0.4], MassError, "sum to 0.9, not 1: put the balance on the frame"),
        (["rectangle", "square"], [0.5, 0.6], MassError, "sum to 1.1"),
        (["rectangle", "circle"], [0.5, 0.5], FrameError, "unknown hypothesis 'circle'"),
        (["rectangle", ()], [0.5, 0.5], MassError, "empty set"),
        ([0, 1], [0.5, 0.5], MassError, "empty set"),
        (["rectangle", 1], [0.5, 0.5], FrameError, "'rectangle' is listed more than once"),
        (["rectangle"], [0.5, 0.5], MassError, "1 focal sets need masses of shape (..., 1), not (2,)"),
        ([], np.zeros((0,)), MassError, "at least one focal set"),
        ([Frame(["x"])], [1.0], FrameError, "{x}"),
    ],
)
def test_bad_masses_are_refused_by_name(sets, masses, error, names: str) -> None:
    with pytest.raises(error) as caught:
        MassFunction(FRAME, sets, masses)
    assert names in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_offender_in_a_batch_is_found() -> None:
    masses = np.full((3, 2), 0.5)
    masses[1] = [0.5, 0.4]
    with pytest.raises(MassError, match=r"at index \(1,\) sum to 0.9"):
        MassFunction(FRAME, ["rectangle", "square"], masses)
    masses[1] = [1.5, -0.5]
    with pytest.raises(MassError, match=r"-0.5 of 'square' at index \(1,\)"):
        MassFunction(FRAME, ["rectangle", "square"], masses)


def test_nothing_is_renormalised() -> None:
    with pytest.raises(MassError):
        MassFunction(FRAME, ["rectangle", "square"], [0.5, 0.5 + 1e-8])
    m = MassFunction(FRAME, ["rectangle", "square"], [0.5, 0.5 + 1e-12])
    assert m.masses[1] == 0.5 + 1e-12


def test_a_single_one_is_not_a_sequence_and_a_batch_is_not_a_dictionary() -> None:
    one = MassFunction.vacuous(FRAME)
    with pytest.raises(TypeError):
        len(one)
    with pytest.raises(IndexError):
        one[0]
    with pytest.raises(MassError, match="batch of shape"):
        MassFunction.vacuous(FRAME, (2,)).as_dict()


@given(st.data())
def test_pickles_and_copies_are_equal(data: st.DataObject) -> None:
    m = data.draw(masses_over(data.draw(frames()), (2,)))
    assert pickle.loads(pickle.dumps(m)) == m
    assert copy.deepcopy(m) == m


def test_rounded_dictionary() -> None:
    m = MassFunction.of(FRAME, {"rectangle": 1 / 3, FRAME: 2 / 3})
    assert m.as_dict(2) == {"frame": 0.67, "rectangle": 0.33}
