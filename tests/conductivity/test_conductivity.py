import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evifuse.belief import Frame, MassFunction
from evifuse.conductivity import (
    READINGS,
    Aggregate,
    KnowledgeBase,
    Reading,
    aggregate_properties,
    belief_entropy,
    capacity,
    classify,
    core_entropy,
    divergence,
    focal_divergence,
    fractal_dimension,
    inner_entropy,
    interaction_dimension,
    normalised_belief,
    projection,
    similarity,
    within_set_entropy,
)
from evifuse.errors import FrameError, KnowledgeError, MassError
from evifuse.knowledge import load_knowledge
from tests.belief.strategies import frames, masses_over
from tests.conductivity import oracle

SOUND = READINGS["sound"]
SHAPE = Frame(["rectangle", "square", "triangle", "ellipse", "circle", "bracket"])


def as_dict(m: MassFunction) -> dict:
    pairs = zip(m.focal_sets.tolist(), m.masses.tolist(), strict=True)
    return {frozenset(m.frame.names(s)): b for s, b in pairs if b > 0}


@st.composite
def positive_pairs(draw: st.DrawFn) -> tuple[MassFunction, MassFunction]:
    frame = draw(frames())
    return draw(masses_over(frame, zeros=False)), draw(masses_over(frame, zeros=False))


@given(positive_pairs())
def test_agrees_with_the_second_opinion(two: tuple[MassFunction, MassFunction]) -> None:
    x, y = two
    a, b = as_dict(x), as_dict(y)
    assert float(within_set_entropy(x, SOUND)) == pytest.approx(oracle.h_w(a), abs=1e-12)
    assert float(inner_entropy(x, SOUND)) == pytest.approx(oracle.h_in(a), rel=1e-12, abs=1e-12)
    assert float(divergence(x, y, SOUND)) == pytest.approx(oracle.div(a, b), rel=1e-12, abs=1e-12)
    assert float(interaction_dimension(x, y, SOUND)) == pytest.approx(oracle.dim(a, b), rel=1e-12)


@given(positive_pairs())
def test_laws_of_the_sound_reading(two: tuple[MassFunction, MassFunction]) -> None:
    x, y = two
    assert divergence(x, y, SOUND) >= -1e-12
    assert float(divergence(x, y, SOUND)) == pytest.approx(
        float(divergence(y, x, SOUND)), rel=1e-12, abs=1e-12
    )
    assert float(divergence(x, x, SOUND)) == 0
    assert float(interaction_dimension(x, x, SOUND)) == 1
    for value in (fractal_dimension(x, SOUND), interaction_dimension(x, y, SOUND)):
        assert 0 < float(value) <= 1 + 1e-12
    assert float(belief_entropy(x, SOUND)) >= 0
    assert float(core_entropy(x, SOUND)) >= 0
    assert float(focal_divergence(x, SOUND)) >= 0


@given(positive_pairs(), st.randoms())
def test_names_and_order_change_nothing(two: tuple[MassFunction, MassFunction], random) -> None:
    x, y = two
    names = list(x.frame.hypotheses)
    random.shuffle(names)
    shuffled = Frame(names)

    def moved(m: MassFunction) -> MassFunction:
        order = list(range(len(m.focal_sets)))
        random.shuffle(order)
        sets = [m.frame.names(int(m.focal_sets[i])) for i in order]
        return MassFunction(shuffled, sets, m.masses[order])

    expected = float(interaction_dimension(x, y, SOUND))
    assert float(interaction_dimension(moved(x), moved(y), SOUND)) == pytest.approx(expected, rel=1e-9)


@given(st.data())
def test_base_cancels_in_dimensions_but_not_in_the_capacity(data: st.DataObject) -> None:
    x = data.draw(masses_over(Frame(["a", "b", "c"]), zeros=False))
    two = Reading(log_base=2.0)
    assert float(fractal_dimension(x, two)) == pytest.approx(float(fractal_dimension(x, SOUND)), rel=1e-9)
    if float(inner_entropy(x, SOUND)) > 0:
        quotient = float(capacity(inner_entropy(x, SOUND)) / capacity(inner_entropy(x, two)))
        assert quotient == pytest.approx(1 / np.log(2), rel=1e-9)


def test_similarity_over_attribute_lists() -> None:
    frame = Frame(["r", "s", "t"], {"r": ["four", "straight"], "s": ["four", "straight", "equal"]})
    sets = np.array([1, 2, 4])
    none = Reading(similarity_offset=0.0)
    expected = [[1, 2 / 3, 0], [2 / 3, 1, 0], [0, 0, 1]]
    np.testing.assert_allclose(similarity(frame, sets, sets, none), expected)
    assert np.all(similarity(frame, sets, sets, SOUND) > 0)
    plain = similarity(Frame(["r", "s", "t"]), np.array([0b011]), np.array([0b110]), none)
    assert plain[0, 0] == pytest.approx(1 / 3)


def test_one_focal_set_has_no_gaps() -> None:
    sure = MassFunction.of(SHAPE, {"triangle": 1.0})
    assert float(inner_entropy(sure, SOUND)) == 0
    assert float(fractal_dimension(sure, SOUND)) == 1
    assert float(capacity(inner_entropy(sure, SOUND))) == np.inf
    assert float(projection(np.array(0.5), 0.5)) == 0.25


def test_zero_masses_are_not_focal_sets() -> None:
    with pytest.raises(MassError, match="positive"):
        inner_entropy(MassFunction.of(SHAPE, {"triangle": 1.0, SHAPE: 0.0}), SOUND)
    table = load_knowledge("chapter-shape")
    a = classify(MassFunction.of(SHAPE, {"triangle": 0.6, "square": 0.0, SHAPE: 0.4}), table)
    b = classify(MassFunction.of(SHAPE, {SHAPE: 0.4, "triangle": 0.6}), table)
    np.testing.assert_allclose(a.conductivities, b.conductivities, rtol=1e-12)


@given(st.data())
def test_classification_of_a_batch_is_that_of_its_members(data: st.DataObject) -> None:
    batch = data.draw(masses_over(SHAPE, (2, 2)))
    for name in ("chapter-shape", "shape"):
        knowledge = load_knowledge(name)
        many = classify(batch, knowledge)
        assert many.conductivities.shape == (2, 2, 3)
        one = classify(batch[1][0], knowledge)
        np.testing.assert_allclose(many.conductivities[1, 0], one.conductivities, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(many.belief.masses.sum(axis=-1), 1, atol=1e-12)
        if one.decision is not None:
            assert many.classes[many.decisions[1, 0]] == one.decision


@given(st.data())
def test_classification_agrees_with_the_second_opinion(data: st.DataObject) -> None:
    y = data.draw(masses_over(SHAPE, zeros=False))
    table = load_knowledge("chapter-shape")
    found = classify(y, table)
    for aggregate in table.aggregates:
        gamma = [as_dict(x) for x in aggregate.prototypes.values()]
        expected = oracle.conductivity(as_dict(y), gamma)
        assert found.conductivity[aggregate.label] == pytest.approx(expected, rel=1e-9)


def test_explanations_say_which_branch_and_how_close_the_other_was() -> None:
    evidence = MassFunction.of(SHAPE, {"rectangle": 0.19, "square": 0.10, "triangle": 0.20, SHAPE: 0.51})
    found = classify(evidence, load_knowledge("chapter-shape"))
    why = {e.prototype: e for e in found.explain()}
    assert [why[name].branch for name in ("R_1", "T_1", "E_1")] == ["strong", "strong", "weak"]
    for e in why.values():
        assert e.margin == pytest.approx(abs(e.interaction_dimension - e.aggregate_dimension))
        expected = e.interaction_dimension if e.branch == "strong" else e.projected_dimension
        assert e.conductivity == pytest.approx(expected)
    total = sum(e.conductivity for e in why.values() if e.label == "triangular")
    assert found.conductivity["triangular"] == pytest.approx(total)


def test_blocked_branch_conducts_nothing() -> None:
    frame = Frame(["a", "b"])
    far = [
        MassFunction.of(frame, {"a": 0.6, frame: 0.4}),
        MassFunction.of(frame, {"b": 0.6, frame: 0.4}),
    ]
    knowledge = KnowledgeBase(
        "far", frame, (Aggregate("both", {"A": far[0], "B": far[1]}),), Reading(log_base=1e6)
    )
    found = classify(far[0], knowledge)
    assert next(e.branch for e in found.explain()) == "blocked"
    assert next(found.explain()).conductivity == 0


def test_aggregate_of_one_prototype_has_dimension_one() -> None:
    table = load_knowledge("chapter-shape")
    assert aggregate_properties(table.aggregates[0], SOUND).dimension == 1
    two = aggregate_properties(table.aggregates[1], SOUND)
    assert two.dimension == pytest.approx(two.within_set_entropy / two.inner_entropy)
    assert two.inner_entropy == pytest.approx(two.within_set_entropy + two.internal_divergence)
    assert two.capacity == pytest.approx(1 / two.inner_entropy)


@pytest.mark.parametrize("hypothesis", SHAPE.hypotheses)
@pytest.mark.parametrize("mass", [1.0, 0.9, 0.5, 0.1])
def test_working_prototypes_recognise_each_pure_outline(hypothesis: str, mass: float) -> None:
    expected = {"rectangle": "rectangular", "square": "rectangular", "triangle": "triangular"}
    found = classify(MassFunction.of(SHAPE, {hypothesis: mass, SHAPE: 1 - mass}), load_knowledge("shape"))
    assert found.decision == expected.get(hypothesis, "elliptical")
    assert found.belief.as_dict().get("frame", 0) == pytest.approx(1 - mass, abs=1e-12)


@pytest.mark.parametrize(
    ("hypothesis", "decision"),
    [("P", "quasiplanar"), ("N", "occluded")] + [(k, "curved") for k in ("C-", "C+", "H", "E-", "E+")],
)
@pytest.mark.parametrize("mass", [1.0, 0.9, 0.5, 0.1])
def test_working_prototypes_recognise_each_pure_curvature(
    hypothesis: str, decision: str, mass: float
) -> None:
    frame = Frame(["P", "C-", "C+", "H", "E-", "E+", "N"])
    found = classify(MassFunction.of(frame, {hypothesis: mass, frame: 1 - mass}), load_knowledge("curvature"))
    assert found.decision == decision


@pytest.mark.parametrize(
    ("masses", "decision"),
    [
        ({"P": 0.43, "N": 0.49}, "occluded"),
        ({"C-": 0.6, "P": 0.25}, "curved"),
        ({"E-": 0.5, "C-": 0.2, "P": 0.1}, "curved"),
        ({"H": 0.4, "C-": 0.2, "C+": 0.2}, "curved"),
        ({"P": 0.6, "C-": 0.2}, "quasiplanar"),
    ],
)
def test_working_prototypes_recognise_mixtures(masses: dict[str, float], decision: str) -> None:
    frame = Frame(["P", "C-", "C+", "H", "E-", "E+", "N"])
    evidence = MassFunction.of(frame, {**masses, frame: 1 - sum(masses.values())})
    assert classify(evidence, load_knowledge("curvature")).decision == decision


def test_crumbs_of_mass_change_little() -> None:
    knowledge = load_knowledge("shape")
    clean = classify(MassFunction.of(SHAPE, {"rectangle": 0.6, "square": 0.35, SHAPE: 0.05}), knowledge)
    crumbs = {"rectangle": 0.6, "square": 0.349, "circle": 0.0005, "bracket": 0.0005, SHAPE: 0.05}
    found = classify(MassFunction.of(SHAPE, crumbs), knowledge)
    np.testing.assert_allclose(found.conductivities, clean.conductivities, atol=0.01)


def test_total_ignorance_conducts_nothing_in_the_working_reading() -> None:
    found = classify(MassFunction.vacuous(SHAPE), load_knowledge("shape"))
    assert found.decision is None
    assert found.belief == MassFunction.vacuous(found.belief.frame)
    assert int(found.decisions) == -1


def test_normalised_belief_of_the_published_conductivities() -> None:
    m = normalised_belief(["R", "T"], np.array([0.48, 1.46]))
    assert m.as_dict(2) == {"T": 0.75, "R": 0.25}
    kept = normalised_belief(["R", "T"], np.array([[1.0, 1.0], [0.0, 0.0]]), np.array([0.5, 0.2]))
    assert kept[0].as_dict() == {"frame": 0.5, "R": 0.25, "T": 0.25}
    assert kept[1].as_dict() == {"frame": 1.0}
    assert normalised_belief(["only"], np.array([0.3])).as_dict() == {"only": 1.0}


def test_evidence_about_something_else_is_refused() -> None:
    with pytest.raises(FrameError, match="'octagon'"):
        classify(MassFunction.vacuous(Frame(["octagon"])), load_knowledge("shape"))


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("entropy_sign", 0),
        ("divergence", "other"),
        ("ties", "last"),
        ("pooling", "median"),
        ("log_base", 1.0),
        ("similarity_offset", -1.0),
        ("commitment", 1.0),
        ("sharpness", 0.0),
        ("negligible", 0.6),
    ],
)
def test_readings_refuse_what_they_do_not_know(field: str, value: object) -> None:
    with pytest.raises(KnowledgeError, match=field):
        Reading(**{field: value})  # type: ignore[arg-type]


def test_printed_reading_is_what_the_notes_say_it_is() -> None:
    printed = READINGS["printed"]
    evidence = MassFunction.of(SHAPE, {"rectangle": 0.3, SHAPE: 0.7})
    assert float(belief_entropy(evidence, printed)) < 0
    other = MassFunction.of(SHAPE, {"rectangle": 0.6, SHAPE: 0.4})
    assert np.isfinite(float(divergence(evidence, other, printed)))


def test_pooling_modes() -> None:
    evidence = MassFunction.of(SHAPE, {"triangle": 0.6, SHAPE: 0.4})
    table = load_knowledge("chapter-shape")
    totals = {
        mode: classify(evidence, table, Reading(pooling=mode)).conductivity["triangular"]  # type: ignore[arg-type]
        for mode in ("sum", "mean", "max")
    }
    assert totals["mean"] == pytest.approx(totals["sum"] / 2)
    assert totals["mean"] <= totals["max"] <= totals["sum"]


def test_a_batch_has_no_single_answer() -> None:
    found = classify(MassFunction.vacuous(SHAPE, (3,)), load_knowledge("shape"))
    for ask in (lambda: found.decision, lambda: found.conductivity, lambda: list(found.explain())):
        with pytest.raises(MassError, match="batch of shape"):
            ask()
