import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evifuse.belief import Frame, MassFunction, conjunctive, dempster
from evifuse.belief.average import average, murphy
from evifuse.errors import FrameError, MassError
from tests.belief.strategies import dense, frames, masses_over

FRAME = Frame(["a", "b", "c"])
LAYOUTS = ["shared", "padded", "dense"]


@pytest.mark.parametrize("layout", LAYOUTS)
@given(data=st.data())
def test_average_is_the_mean_of_every_set(layout, data: st.DataObject) -> None:
    frame = data.draw(frames())
    many = [data.draw(masses_over(frame, (2,))).to(layout) for _ in range(3)]
    mean, conflict = average(many)
    np.testing.assert_allclose(dense(mean), sum(dense(m) for m in many) / 3, atol=1e-14)
    np.testing.assert_allclose(dense(average(many[::-1]).mass), dense(mean), atol=1e-14)
    np.testing.assert_allclose(dense(average([many[0]] * 4).mass), dense(many[0]), atol=1e-14)
    everything = conjunctive(conjunctive(many[0], many[1]).mass, many[2])
    np.testing.assert_allclose(conflict, everything.conflict, atol=1e-12)
    assert mean.batch == conflict.shape == (2,)


@given(st.data())
def test_weights_are_relative_and_per_case(data: st.DataObject) -> None:
    frame = data.draw(frames())
    a, b = data.draw(masses_over(frame, (2,))), data.draw(masses_over(frame))
    np.testing.assert_allclose(
        dense(average([a, b], [3, 1]).mass), 0.75 * dense(a) + 0.25 * dense(b), atol=1e-14
    )
    per_case = average([a, b], [[1, 0], [0, 2]]).mass
    np.testing.assert_allclose(dense(per_case), np.stack([dense(a)[0], dense(b)]), atol=1e-14)
    assert dense(average([b, b], [[1, 1, 1], [1, 2, 0]]).mass).shape == (3, frame.full + 1)


@pytest.mark.parametrize("layout", LAYOUTS)
@given(data=st.data())
def test_murphy_is_dempsters_rule_on_copies_of_the_average(layout, data: st.DataObject) -> None:
    frame = data.draw(frames())
    many = [data.draw(masses_over(frame, (2,))).to(layout) for _ in range(4)]
    mean = average(many).mass
    expected = mean
    for _ in range(3):
        expected = dempster(expected, mean).mass
    np.testing.assert_allclose(dense(murphy(many).mass), dense(expected), atol=1e-12, rtol=0)


def test_murphy_does_not_let_one_broken_source_decide() -> None:
    """The example of Murphy (2000): a veto against a is outvoted."""
    good = MassFunction.of(FRAME, {"a": 0.8, "b": 0.1, "c": 0.1})
    broken = MassFunction.of(FRAME, {"b": 0.9, "c": 0.1})
    assert dense(murphy([good, broken, good]).mass)[1] > 0.75
    assert dense(dempster(dempster(good, broken).mass, good).mass)[1] == 0
    assert dense(murphy([good, good]).mass)[1] > dense(good)[1]  # not idempotent


def test_a_thousand_sources_do_not_underflow() -> None:
    many = [MassFunction.of(FRAME, {name: 1.0}) for name in "ab"] * 500
    for layout in LAYOUTS:
        mass, conflict = murphy([m.to(layout) for m in many])
        np.testing.assert_allclose(dense(mass)[[1, 2]], [0.5, 0.5], rtol=1e-12)
        assert conflict == 1.0


def test_a_batch_is_a_list_of_sources() -> None:
    many = MassFunction(FRAME, ["a", FRAME], [[0.5, 0.5], [0.25, 0.75]])
    assert average(many).mass == MassFunction.of(FRAME, {"a": 0.375, FRAME: 0.625})


def test_singletons_stay_singletons() -> None:
    rng = np.random.default_rng(1)
    many = [MassFunction(FRAME, ["a", "b", "c", FRAME], rng.dirichlet(np.ones(4), (5,))) for _ in range(3)]
    for rule in (average, murphy):
        mass = rule(many).mass
        assert mass.layout == "singletons"
        np.testing.assert_allclose(dense(mass), dense(rule([m.to("dense") for m in many]).mass), atol=1e-12)


@pytest.mark.parametrize(
    ("many", "weights", "names"),
    [
        ([], None, "at least one source"),
        (MassFunction.vacuous(FRAME), None, "put it in a list"),
        ([MassFunction.vacuous(FRAME), {"a": 1.0}], None, "source 1 is a dict"),
        (
            [MassFunction.vacuous(FRAME, (2,)), MassFunction.vacuous(FRAME, (3,))],
            None,
            "source 1 has batch (3,)",
        ),
        ([MassFunction.vacuous(FRAME)] * 2, [1], "2 sources need weights of shape (2,), not (1,)"),
        ([MassFunction.vacuous(FRAME)] * 2, [1, -1], "not negative"),
        ([MassFunction.vacuous(FRAME)] * 2, [1, np.nan], "finite"),
        ([MassFunction.vacuous(FRAME)] * 2, [0, 0], "all weights are 0"),
        ([MassFunction.vacuous(FRAME, (2,))] * 2, np.ones((2, 3)), "shape (2, 3) do not fit"),
    ],
)
def test_bad_sources_and_weights_are_refused(many, weights, names: str) -> None:
    for rule in (average, murphy):
        with pytest.raises(MassError) as caught:
            rule(many, weights)
        assert names in str(caught.value)


def test_mixed_frames_are_refused_and_reordered_ones_moved() -> None:
    with pytest.raises(FrameError, match="different frames"):
        average([MassFunction.vacuous(FRAME), MassFunction.vacuous(Frame(["a", "b"]))])
    turned = MassFunction.of(Frame(["c", "b", "a"]), {"a": 1.0})
    assert average([MassFunction.of(FRAME, {"a": 1.0}), turned]).mass == MassFunction.of(FRAME, {"a": 1.0})
