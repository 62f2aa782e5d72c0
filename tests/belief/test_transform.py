import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evifuse.belief import (
    Frame,
    MassFunction,
    belief,
    commonality,
    conjunctive,
    mass,
    pignistic,
    plausibility,
)
from evifuse.errors import ConflictError, FrameError
from tests.belief.strategies import dense, frames, masses_over


@given(st.data())
def test_measures_agree_with_their_definitions(data: st.DataObject) -> None:
    m = data.draw(masses_over(data.draw(frames()), (3,)))
    table = dense(m)
    every = range(1, m.frame.full + 1)
    for a in every:
        np.testing.assert_allclose(mass(m, a), table[:, a], atol=1e-12)
        np.testing.assert_allclose(belief(m, a), sum(table[:, b] for b in every if b & ~a == 0), atol=1e-12)
        np.testing.assert_allclose(plausibility(m, a), sum(table[:, b] for b in every if b & a), atol=1e-12)
        np.testing.assert_allclose(
            commonality(m, a), sum(table[:, b] for b in every if b & a == a), atol=1e-12
        )


@given(st.data())
def test_laws(data: st.DataObject) -> None:
    m = data.draw(masses_over(data.draw(frames()), (3,)))
    full = m.frame.full
    for a in range(1, full + 1):
        assert np.all(belief(m, a) <= plausibility(m, a) + 1e-12)
        assert np.all(commonality(m, a) <= plausibility(m, a) + 1e-12)
        if a != full:
            np.testing.assert_allclose(plausibility(m, a), 1 - belief(m, full & ~a), atol=1e-12)
    np.testing.assert_allclose(belief(m, full), 1, atol=1e-9)


@given(st.data())
def test_pignistic_is_a_probability_between_belief_and_plausibility(data: st.DataObject) -> None:
    m = data.draw(masses_over(data.draw(frames()), (3,)))
    p = pignistic(m)
    np.testing.assert_allclose(p.sum(axis=-1), 1, atol=1e-9)
    for i, name in enumerate(m.frame.hypotheses):
        assert np.all(p[:, i] >= belief(m, name) - 1e-12)
        assert np.all(p[:, i] <= plausibility(m, name) + 1e-12)


def test_unknown_names_are_refused() -> None:
    m = MassFunction.vacuous(Frame(["a", "b"]))
    for measure in (mass, belief, plausibility, commonality):
        with pytest.raises(FrameError, match="'c'"):
            measure(m, "c")


def test_pignistic_divides_out_the_empty_set() -> None:
    frame = Frame(["a", "b"])
    a = MassFunction.of(frame, {"a": 0.5, frame: 0.5})
    b = MassFunction.of(frame, {"b": 0.5, frame: 0.5})
    np.testing.assert_allclose(pignistic(conjunctive(a, b).mass), [0.5, 0.5])
    certain = conjunctive(MassFunction.of(frame, {"a": 1.0}), MassFunction.of(frame, {"b": 1.0})).mass
    with pytest.raises(ConflictError, match="empty set"):
        pignistic(certain)
