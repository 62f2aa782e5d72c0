import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evifuse.belief import Frame, MassFunction, conjunctive, dempster, plausibility
from evifuse.belief.condition import condition
from evifuse.errors import ConflictError, FrameError
from tests.belief.strategies import dense, frames, masses_over

FRAME = Frame(["a", "b", "c"])


@pytest.mark.parametrize("layout", ["shared", "padded", "dense"])
@given(data=st.data())
def test_conditioning_is_combination_with_certainty(layout, data: st.DataObject) -> None:
    m = data.draw(masses_over(data.draw(frames()), (2,)))
    subset = data.draw(st.integers(1, m.frame.full))
    certain = MassFunction(m.frame, [subset], [1.0])
    left = condition(m.to(layout), subset, open_world=True)
    right = conjunctive(m, certain)
    np.testing.assert_allclose(dense(left.mass), dense(right.mass), atol=1e-14)
    np.testing.assert_allclose(left.conflict, 1 - plausibility(m, subset), atol=1e-12)
    if np.all(plausibility(m, subset) > 0):
        scaled = condition(m.to(layout), subset)
        np.testing.assert_allclose(dense(scaled.mass), dense(dempster(m, certain).mass), atol=1e-12)
        again = condition(scaled.mass, subset)
        np.testing.assert_allclose(dense(again.mass), dense(scaled.mass), atol=1e-14)
        np.testing.assert_array_equal(again.conflict, 0)
        assert (scaled.mass.layout == "dense") == (layout == "dense")


def test_conditioning_on_the_frame_scales_the_empty_set_away() -> None:
    a = MassFunction(FRAME, ["a", FRAME], [[0.5, 0.5], [0.25, 0.75]])
    b = MassFunction.of(FRAME, {"b": 0.5, FRAME: 0.5})
    joint, conflict = conjunctive(a, b)
    result = condition(joint, FRAME)
    np.testing.assert_allclose(dense(result.mass), dense(dempster(a, b).mass), atol=1e-15)
    np.testing.assert_allclose(result.conflict, conflict, atol=1e-15)


def test_the_least_possibility_is_enough() -> None:
    m = MassFunction.of(FRAME, {"a": 1.0, "b": 1e-300})
    assert condition(m, ["b", "c"]).mass == MassFunction.of(FRAME, {"b": 1.0})


def test_the_impossible_is_an_error_that_says_where() -> None:
    m = MassFunction(FRAME, ["a", "b"], [[0.5, 0.5], [1.0, 0.0]])
    with pytest.raises(ConflictError, match=r"index \(1,\).*'b\|c' impossible"):
        condition(m, ["b", "c"])
    with pytest.raises(ConflictError, match="'∅'"):
        condition(m, ())
    assert condition(m, "c", open_world=True).conflict.tolist() == [1.0, 1.0]
    with pytest.raises(FrameError, match="'d'"):
        condition(m, "d")
