import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evifuse.belief import Frame, MassFunction, conjunctive, dempster, discount
from evifuse.belief.cautious import bold, cautious, decombine
from evifuse.belief.condition import condition
from evifuse.errors import ConflictError, FrameError, MassError
from tests.belief.strategies import dense, frames, masses_over

FRAME = Frame(["a", "b", "c"])


def trusted_a_little(data: st.DataObject, frame: Frame, count: int) -> list[MassFunction]:
    return [discount(data.draw(masses_over(frame, (2,))), reliability=0.9) for _ in range(count)]


def mirrored(m: MassFunction) -> MassFunction:
    """Every set replaced by its complement, which exchanges the cautious and the bold rule."""
    return MassFunction(m.frame, range(m.frame.full + 1), dense(m)[..., ::-1], open_world=True)


@given(st.data())
def test_both_are_idempotent_commutative_and_associative(data: st.DataObject) -> None:
    a, b, c = trusted_a_little(data, data.draw(frames()), 3)
    for rule, of in ((cautious, lambda m: m), (bold, mirrored)):
        x, y, z = of(a), of(b), of(c)
        np.testing.assert_allclose(dense(rule(x, x).mass), dense(x), atol=1e-12, rtol=0)
        np.testing.assert_allclose(rule(x, y).mass.masses, rule(y, x).mass.masses, atol=1e-12, rtol=0)
        left, right = rule(rule(x, y).mass, z).mass, rule(x, rule(y, z).mass).mass
        np.testing.assert_allclose(left.masses, right.masses, atol=1e-11, rtol=0)


@given(st.data())
def test_bold_is_the_mirror_of_cautious(data: st.DataObject) -> None:
    a, b = trusted_a_little(data, data.draw(frames()), 2)
    joint, conflict = bold(mirrored(a), mirrored(b))
    np.testing.assert_allclose(joint.masses, cautious(a, b).mass.masses[..., ::-1], atol=1e-12, rtol=0)
    np.testing.assert_array_equal(conflict, 0)


def test_simple_sources_keep_the_stronger_evidence() -> None:
    weak = MassFunction.of(FRAME, {"a": 0.3, FRAME: 0.7})
    strong = MassFunction.of(FRAME, {"a": 0.6, FRAME: 0.4})
    other = MassFunction.of(FRAME, {"b": 0.5, FRAME: 0.5})
    np.testing.assert_allclose(cautious(weak, strong).mass.masses, dense(strong), atol=1e-15)
    joint, conflict = cautious(strong, other)
    np.testing.assert_allclose(joint.masses, dense(conjunctive(strong, other).mass), atol=1e-15)
    assert conflict == pytest.approx(0.3, abs=1e-15)
    scaled = condition(joint, FRAME).mass
    np.testing.assert_allclose(scaled.masses, dense(dempster(strong, other).mass), atol=1e-15)


def test_ignorance_is_not_always_neutral() -> None:
    part = MassFunction.of(FRAME, {("a", "b"): 0.4, ("b", "c"): 0.4, FRAME: 0.2})  # w({b}) > 1
    result = cautious(part, MassFunction.vacuous(FRAME)).mass
    assert np.abs(result.masses - dense(part)).max() > 0.1


def test_what_the_weights_need_is_said() -> None:
    certain = MassFunction.of(FRAME, {"a": 1.0})
    vacuous = MassFunction.vacuous(FRAME)
    with pytest.raises(MassError, match=r"dogmatic.*discount"):
        cautious(vacuous, certain)
    with pytest.raises(MassError, match=r"normal.*open_world"):
        bold(vacuous, vacuous)
    with pytest.raises(FrameError, match="different frames"):
        cautious(vacuous, MassFunction.vacuous(Frame(["a", "b"])))


@given(st.data())
def test_what_was_combined_can_be_taken_out(data: st.DataObject) -> None:
    a, b = trusted_a_little(data, data.draw(frames()), 2)
    for rule in (conjunctive, dempster):
        joint, conflict = rule(a, b)
        rest, contradiction = decombine(joint, b, rule=rule.__name__)
        np.testing.assert_allclose(rest.masses, dense(a), atol=1e-12, rtol=0)
        np.testing.assert_allclose(contradiction, conflict, atol=1e-12, rtol=0)


def test_taking_out_near_total_conflict_keeps_its_digits() -> None:
    a = MassFunction.of(FRAME, {"a": 1 - 1e-10, FRAME: 1e-10})
    b = MassFunction.of(FRAME, {"b": 1 - 1e-10, FRAME: 1e-10})
    rest = decombine(dempster(a, b).mass, b).mass
    np.testing.assert_allclose(rest.masses, dense(a), atol=1e-5, rtol=0)


def test_what_was_not_in_it_can_not_be_taken_out() -> None:
    joint = MassFunction(FRAME, ["a", FRAME], [[0.9, 0.1], [0.2, 0.8]])
    source = MassFunction.of(FRAME, {"a": 0.5, FRAME: 0.5})
    assert decombine(joint[0], source).mass == decombine(joint[0], source, rule="conjunctive").mass
    with pytest.raises(MassError, match=r"not part of the combination.*index \(1,\).*'a' would be -0.6"):
        decombine(joint, source)
    with pytest.raises(MassError, match=r"no mass on the frame.*discount"):
        decombine(joint, MassFunction.of(FRAME, {"a": 1.0}))
    with pytest.raises(MassError, match="unknown rule 'yager'"):
        decombine(joint, source, rule="yager")  # type: ignore[arg-type]
    conflict = conjunctive(MassFunction.of(FRAME, {"a": 1.0}), MassFunction.of(FRAME, {"b": 1.0})).mass
    with pytest.raises(ConflictError, match="empty set"):
        decombine(conflict, source)


@pytest.mark.parametrize("layout", ["shared", "padded", "singletons", "dense"])
def test_layouts_agree(layout) -> None:
    rng = np.random.default_rng(3)
    a, b = (MassFunction(FRAME, ["a", "b", "c", FRAME], rng.dirichlet(np.ones(4), (2, 3))) for _ in range(2))
    np.testing.assert_allclose(
        cautious(a.to(layout), b).mass.masses, cautious(a, b).mass.masses, atol=1e-12, rtol=0
    )
    joint = dempster(a, b).mass
    rest = decombine(joint, b.to(layout)).mass
    np.testing.assert_allclose(rest.masses, a.to("dense").masses, atol=1e-12, rtol=0)
