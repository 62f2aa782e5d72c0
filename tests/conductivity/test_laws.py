"""Laws of the evidential classifier, and what looks like one and is not."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from evifuse.belief import Frame, MassFunction, discount
from evifuse.conductivity import (
    READINGS,
    Aggregate,
    KnowledgeBase,
    Reading,
    classify,
    divergence,
    interaction_dimension,
)
from evifuse.knowledge import load_knowledge
from tests.belief.strategies import masses_over

SOUND = READINGS["sound"]
NAMES = ["a", "b", "c", "d"]
FRAME = Frame(NAMES)
ORDERLY = {
    "sound": SOUND,
    "working": READINGS["working"],
    "smooth": Reading(smoothing=0.1),
    "unprojected": Reading(projection=False, pooling="mean"),
    "printed divergence": Reading(divergence="printed", projection=False),
}
"""Readings in which neither names nor order may matter."""


@st.composite
def knowledge_bases(draw: st.DrawFn) -> KnowledgeBase:
    """Two classes of one to three prototypes over four hypotheses."""
    classes = tuple(
        Aggregate(
            label,
            {f"{label}{i}": draw(masses_over(FRAME, zeros=False)) for i in range(draw(st.integers(1, 3)))},
        )
        for label in ("one", "two")
    )
    return KnowledgeBase("drawn", FRAME, classes, SOUND)


def rebuilt(knowledge: KnowledgeBase, change) -> KnowledgeBase:  # type: ignore[no-untyped-def]
    """The same knowledge base with every prototype changed."""
    classes = tuple(
        Aggregate(a.label, {name: change(x) for name, x in a.prototypes.items()})
        for a in knowledge.aggregates
    )
    frame = next(iter(classes[0].prototypes.values())).frame
    return KnowledgeBase(knowledge.name, frame, classes, knowledge.reading)


@pytest.mark.parametrize("name", list(ORDERLY))
@settings(max_examples=25)
@given(knowledge_bases(), masses_over(FRAME, (3,)), st.permutations(NAMES), st.permutations(NAMES))
def test_new_names_in_a_new_order_change_nothing(
    name: str, knowledge: KnowledgeBase, y: MassFunction, renamed: list[str], listed: list[str]
) -> None:
    new, names = Frame(listed), dict(zip(NAMES, renamed, strict=True))

    def moved(m: MassFunction) -> MassFunction:
        sets = [tuple(names[h] for h in m.frame.names(s)) for s in m.focal_sets.tolist()]
        return MassFunction(new, sets, m.masses)

    reading = ORDERLY[name]
    expected = classify(y, knowledge, reading).conductivities
    found = classify(moved(y), rebuilt(knowledge, moved), reading).conductivities
    steady = _away_from_jumps(y, knowledge, reading)
    np.testing.assert_allclose(found[steady], expected[steady], rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("name", list(ORDERLY))
@settings(max_examples=25)
@given(knowledge_bases(), masses_over(FRAME, (3,)), st.randoms(use_true_random=False))
def test_the_order_of_focal_sets_and_prototypes_changes_nothing(
    name: str, knowledge: KnowledgeBase, y: MassFunction, random
) -> None:  # type: ignore[no-untyped-def]
    def shuffled(m: MassFunction) -> MassFunction:
        order = list(range(len(m.focal_sets)))
        random.shuffle(order)
        return MassFunction(m.frame, m.focal_sets[order].tolist(), m.masses[..., order])

    turned = KnowledgeBase(
        "turned",
        FRAME,
        tuple(
            Aggregate(a.label, {n: shuffled(x) for n, x in reversed(a.prototypes.items())})
            for a in reversed(knowledge.aggregates)
        ),
        knowledge.reading,
    )
    reading = ORDERLY[name]
    expected = classify(y, knowledge, reading).conductivities
    found = classify(shuffled(y), turned, reading).conductivities[:, ::-1]
    steady = _away_from_jumps(y, knowledge, reading)
    np.testing.assert_allclose(found[steady], expected[steady], rtol=1e-8, atol=1e-10)


def _away_from_jumps(y: MassFunction, knowledge: KnowledgeBase, reading: Reading) -> np.ndarray:
    """Inputs of which no prototype is within rounding of a jump."""
    if not reading.projection:
        return np.ones(y.batch, dtype=bool)
    c = classify(y, knowledge, reading)
    top = np.array([c.properties[label].dimension for label, _ in c.prototypes])
    near = np.minimum(np.abs(c.interaction_dimensions - top), np.abs(c.projected_dimensions - top))
    return (near > 1e-9).all(axis=-1) | (c.interaction_dimensions <= top).all(axis=-1)


@given(st.data())
def test_with_the_first_match_order_matters(data: st.DataObject) -> None:
    """Why tied best matches are averaged: the first of them is another one in another order."""
    x = MassFunction.of(FRAME, {("a", "b"): 0.6, "c": 0.4})
    b = data.draw(st.floats(0.05, 0.4))
    one = MassFunction.of(FRAME, {"a": b, "b": 0.9 - b, "c": 0.1})
    other = MassFunction.of(FRAME, {"b": 0.9 - b, "a": b, "c": 0.1})
    first = Reading(ties="first")
    assert one == other
    assert abs(float(divergence(one, x, first)) - float(divergence(other, x, first))) > 1e-3
    assert float(divergence(one, x, SOUND)) == pytest.approx(float(divergence(other, x, SOUND)), rel=1e-12)


def twice(knowledge: KnowledgeBase) -> KnowledgeBase:
    """Every prototype said twice."""
    classes = tuple(
        Aggregate(a.label, {**a.prototypes, **{f"{n} again": x for n, x in a.prototypes.items()}})
        for a in knowledge.aggregates
    )
    return KnowledgeBase("twice", knowledge.frame, classes, knowledge.reading)


@settings(max_examples=30)
@given(knowledge_bases(), masses_over(FRAME, (3,)))
def test_saying_a_prototype_twice(knowledge: KnowledgeBase, y: MassFunction) -> None:
    """Nothing changes for the best or the mean without projection; a sum doubles."""
    for pooling, factor in (("max", 1.0), ("mean", 1.0), ("sum", 2.0)):
        reading = Reading(projection=False, pooling=pooling)  # type: ignore[arg-type]
        once = classify(y, knowledge, reading).conductivities
        np.testing.assert_allclose(
            classify(y, twice(knowledge), reading).conductivities, factor * once, rtol=1e-12
        )
    working = READINGS["working"]
    a, b = classify(y, knowledge, working), classify(y, twice(knowledge), working)
    np.testing.assert_allclose(a.belief.masses, b.belief.masses, atol=1e-12)


def test_with_projection_saying_a_prototype_twice_moves_the_branch_point() -> None:
    """Copies diverge from the other prototypes once more each, so the class has a lower dimension."""
    knowledge = load_knowledge("chapter-shape")
    y = MassFunction.of(knowledge.frame, {"triangle": 0.6, "square": 0.1, knowledge.frame: 0.3})
    reading = Reading(pooling="mean")
    once, more = classify(y, knowledge, reading), classify(y, twice(knowledge), reading)
    assert more.properties["triangular"].dimension < once.properties["triangular"].dimension - 0.01
    assert more.properties["rectangular"].dimension == once.properties["rectangular"].dimension == 1
    assert np.abs(more.conductivities - once.conductivities).max() > 0.1


@settings(max_examples=30)
@given(knowledge_bases(), masses_over(FRAME, zeros=False), masses_over(FRAME, (3,)))
def test_another_prototype_never_lowers_the_best(
    knowledge: KnowledgeBase, x: MassFunction, y: MassFunction
) -> None:
    first, second = knowledge.aggregates
    more = KnowledgeBase(
        "more", FRAME, (Aggregate("one", {**first.prototypes, "new": x}), second), knowledge.reading
    )
    for reading in (READINGS["working"], Reading(projection=False, pooling="max")):
        before, after = (classify(y, base, reading).conductivities for base in (knowledge, more))
        assert (after[:, 0] >= before[:, 0] - 1e-12).all()
        np.testing.assert_allclose(after[:, 1], before[:, 1], rtol=1e-12)


@settings(max_examples=30)
@given(knowledge_bases(), masses_over(FRAME, (3,)))
def test_a_prototype_conducts_itself_best_without_projection(
    knowledge: KnowledgeBase, y: MassFunction
) -> None:
    reading = Reading(projection=False, pooling="max")
    for k, a in enumerate(knowledge.aggregates):
        for x in a.prototypes.values():
            assert classify(x, knowledge, reading).conductivities[k] == pytest.approx(1.0)
    assert (classify(y, knowledge, reading).conductivities <= 1 + 1e-12).all()


def test_with_projection_a_prototype_may_not_conduct_itself() -> None:
    """Both prototypes of a class of table 1 are above its branch point, where they are projected."""
    knowledge = load_knowledge("chapter-shape")
    for x in knowledge.aggregates[2].prototypes.values():
        found = classify(x, knowledge)
        assert found.interaction_dimensions.max() == 1
        assert found.conductivity["elliptical"] < 0.1
        assert found.decision != "elliptical"


@given(masses_over(FRAME, zeros=False), st.floats(0.05, 1.0), st.sampled_from(["shape", "curvature"]))
def test_doubt_scales_conductivity_under_a_nominal_commitment(
    y: MassFunction, reliability: float, name: str
) -> None:
    """Our own law of the working reading: doubted evidence says the same, more quietly."""
    knowledge = load_knowledge(name)
    names = dict(zip(NAMES, knowledge.frame.hypotheses[:4], strict=True))
    sets = [
        knowledge.frame.full if s == FRAME.full else tuple(names[h] for h in FRAME.names(s))
        for s in y.focal_sets.tolist()
    ]
    y = MassFunction(knowledge.frame, sets, y.masses)
    share = y.masses / max(1e-12, 1.0 - float(y.where(y.focal_sets == y.frame.full)))
    assume(np.abs(share - 0.1).min() > 1e-6)  # at the limit of what is negligible, rounding decides
    sure, doubted = classify(y, knowledge), classify(discount(y, reliability=reliability), knowledge)
    np.testing.assert_allclose(doubted.conductivities, reliability * sure.conductivities, atol=1e-9)


@st.composite
def on_the_same_sets(draw: st.DrawFn) -> tuple[MassFunction, np.ndarray]:
    """A prototype, and other masses on its focal sets."""
    x = draw(masses_over(FRAME, zeros=False))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    return x, np.maximum(rng.dirichlet(np.ones(len(x.focal_sets))), 1e-6)


@given(on_the_same_sets())
def test_divergence_falls_all_the_way_to_a_prototype(two: tuple[MassFunction, np.ndarray]) -> None:
    """On the prototype's own focal sets each one is its own best match, and every term is convex."""
    x, far = two
    far = far / far.sum()
    t = np.linspace(0.0, 1.0, 30)[:, None]
    line = MassFunction(FRAME, x.focal_sets.tolist(), (1 - t) * far + t * x.masses)
    assert (np.diff(divergence(line, x, SOUND)) <= 1e-10).all()
    assert float(interaction_dimension(line[29], x, SOUND)) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("mass", [0.3, 0.6, 0.8])
def test_simple_support_conducts_best_at_the_mass_of_the_prototype(mass: float) -> None:
    x = MassFunction.of(FRAME, {"a": mass, FRAME: 1 - mass})
    b = np.linspace(0.02, 0.98, 97)
    line = MassFunction(FRAME, ["a", FRAME], np.stack([b, 1 - b], axis=-1))
    found = interaction_dimension(line, x, SOUND)
    assert b[found.argmax()] == pytest.approx(mass)
    assert (np.diff(found[: found.argmax() + 1])[10:] > 0).all()
    assert (np.diff(found[found.argmax() :]) < 0).all()


def test_interaction_is_not_monotone_in_matching() -> None:
    """Not a law: on the way to a prototype, entropy may fall faster than divergence."""
    x = MassFunction.of(FRAME, {"a": 0.8, FRAME: 0.2})
    b = np.linspace(0.001, 0.8, 800)
    found = interaction_dimension(MassFunction(FRAME, ["a", FRAME], np.stack([b, 1 - b], axis=-1)), x, SOUND)
    assert (np.diff(found) < -1e-9).any()
    assert found.argmax() == 799


def test_an_interaction_dimension_of_one_does_not_mean_equal() -> None:
    """Not a law: divergence compares the masses of best matches, equal on other sets too."""
    certain = [MassFunction.of(FRAME, {name: 1.0}) for name in ("a", "b")]
    assert float(divergence(*certain, SOUND)) == 0
    assert float(interaction_dimension(*certain, SOUND)) == 1
    frame = Frame([f"h{i}" for i in range(6)])
    pairs = [MassFunction.of(frame, {("h0", other): 0.8, frame: 0.2}) for other in ("h1", "h2")]
    assert pairs[0] != pairs[1]
    assert float(interaction_dimension(*pairs, SOUND)) == 1
    apart = [MassFunction.of(FRAME, {name: 0.8, FRAME: 0.2}) for name in ("a", "b")]
    assert float(interaction_dimension(*apart, SOUND)) < 0.8


def test_hypotheses_that_nobody_names_change_dimensions() -> None:
    """Not a law: a larger frame makes ignorance a larger set, and core entropy counts members."""
    found = []
    for size in (4, 6, 10):
        frame = Frame([f"h{i}" for i in range(size)])
        x, y = (MassFunction.of(frame, {"h0": b, frame: 1 - b}) for b in (0.8, 0.5))
        found.append(float(interaction_dimension(x, y, SOUND)))
    assert np.ptp(found) > 0.01


def test_without_the_minus_sign_dimensions_leave_the_unit_interval() -> None:
    """What the positive sign of the print does: a negative entropy beside a positive divergence."""
    x = MassFunction.of(FRAME, {"a": 0.5, "b": 0.5})
    y = MassFunction.of(FRAME, {"c": 0.5, ("c", "d"): 0.3, FRAME: 0.2})
    rng = np.random.default_rng(0)
    many = MassFunction(FRAME, y.focal_sets.tolist(), rng.dirichlet(np.ones(3), size=200))
    found = interaction_dimension(many, x, Reading(entropy_sign=1))
    assert ((found < 0) | (found > 1)).any()
    assert ((interaction_dimension(many, x, SOUND) > 0) & (interaction_dimension(many, x, SOUND) <= 1)).all()


@given(masses_over(Frame(["a", "b", "c"]), (50,), zeros=False), st.sampled_from([1e-3, 1e-2, 0.1]))
def test_a_fade_is_continuous_and_the_jump_elsewhere(y: MassFunction, width: float) -> None:
    """Along a line between neighbours conductivity moves a little where the jump would move it a lot."""
    frame = y.frame
    pair = {n: MassFunction.of(frame, {n: 0.7, frame: 0.3}) for n in ("a", "b")}
    knowledge = KnowledgeBase("pair", frame, (Aggregate("ab", pair),), SOUND)
    jump, smooth = classify(y, knowledge, SOUND), classify(y, knowledge, Reading(smoothing=width))
    top = jump.properties["ab"].dimension
    seen = jump.projected_dimensions
    dims = jump.interaction_dimensions
    outside = ((dims <= top) | (dims >= top + width)) & (
        (dims <= top) | (seen <= top) | (seen >= top + width)
    )
    np.testing.assert_allclose(
        smooth.prototype_conductivities[outside], jump.prototype_conductivities[outside], atol=1e-12
    )
    order = np.argsort(dims[:, 0])
    d, s = dims[order, 0], smooth.prototype_conductivities[order, 0]
    slope = np.abs(np.diff(s))[np.diff(d) > 1e-9] / np.diff(d)[np.diff(d) > 1e-9]
    assert (slope <= 1.0 + 1.5 * (1.0 + jump.properties["ab"].capacity ** 2) / width * 1.5).all()
