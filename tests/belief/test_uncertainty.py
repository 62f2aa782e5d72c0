"""Uncertainty measures: definitions, published values, and every entry of the table of desiderata."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evifuse.belief import Frame, MassFunction, belief, conjunctive
from evifuse.belief.desiderata import DESIDERATA, MEASURES
from evifuse.belief.entropies import (
    belief_entropy,
    core_entropy,
    deng_entropy,
    information_dimension,
    jirousek_shenoy_entropy,
    within_set_entropy,
)
from evifuse.belief.fractal import _by_closure, fractal_belief_entropy
from evifuse.belief.product import ProductFrame, marginalise, product_frame
from evifuse.belief.uncertainty import dissonance, nonspecificity, strife
from evifuse.conductivity import Reading
from evifuse.conductivity import entropy as appendix
from evifuse.errors import MassError
from tests.belief.strategies import dense, frames, masses_over

ALL = sorted(MEASURES)
SQUARE = product_frame(Frame(["a", "b"]), Frame(["x", "y"]))
WIDE = product_frame(Frame(["a", "b"]), Frame(["x", "y", "z"]))


def entropy(p: list[float]) -> float:
    return -sum(x * math.log2(x) for x in p if x > 0)


def by_definition(name: str, table: np.ndarray, count: int) -> float:
    """The measure in bits, by loops over all subsets."""
    every = range(1, 1 << count)
    m = {s: float(table[s]) for s in every if table[s] > 0}
    size = {s: s.bit_count() for s in every}

    def pl(a: int) -> float:
        return sum(v for b, v in m.items() if a & b)

    def bel(a: int) -> float:
        return sum(v for b, v in m.items() if b & ~a == 0)

    singles = [1 << k for k in range(count)]
    betp = [sum(v / size[b] for b, v in m.items() if b & s) for s in singles]
    inner = {
        "strife": lambda a: sum(v * size.get(a & b, 0) / size[a] for b, v in m.items()),
        "discord": lambda a: sum(v * size.get(a & b, 0) / size[b] for b, v in m.items()),
        "dissonance": pl,
        "confusion": bel,
        "deng": lambda a: m[a] / (2 ** size[a] - 1),
        "belief_entropy": lambda a: m[a],
    }
    hartley = sum(v * math.log2(size[a]) for a, v in m.items())
    whole = sum(size[a] for a in m)
    if name in inner:
        return -sum(v * math.log2(inner[name](a)) for a, v in m.items())
    if name == "nonspecificity":
        return hartley
    if name == "pignistic":
        return entropy(betp)
    if name == "jirousek_shenoy":
        return entropy([pl(s) / sum(map(pl, singles)) for s in singles]) + hartley
    if name == "fractal_belief":
        return entropy([sum(v / (2 ** size[b] - 1) for b, v in m.items() if b & a == a) for a in every])
    if name == "information_dimension":
        return by_definition("deng", table, count) / count
    core = entropy([size[a] / whole for a in m])
    return core if name == "core_entropy" else core + by_definition("belief_entropy", table, count)


@settings(max_examples=25)
@given(st.data())
def test_every_measure_is_its_definition_in_every_layout(data: st.DataObject) -> None:
    m = data.draw(masses_over(data.draw(frames()), (2,)))
    for name in ALL:
        expected = [by_definition(name, table, len(m.frame)) for table in dense(m)]
        for layout in ("shared", "padded", "dense"):
            np.testing.assert_allclose(MEASURES[name](m.to(layout)), expected, atol=1e-9, err_msg=name)
            np.testing.assert_allclose(MEASURES[name](m[1].to(layout)), expected[1], atol=1e-9)


@given(st.data())
def test_batches_have_any_shape_and_bases_scale(data: st.DataObject) -> None:
    m = data.draw(masses_over(data.draw(frames()), (2, 3)))
    for name in ALL:
        bits = MEASURES[name](m)
        assert bits.shape == (2, 3)
        np.testing.assert_allclose(bits[1, 2], MEASURES[name](m[1, 2]), atol=1e-12)
        factor = 1.0 if MEASURES[name].unit == "1" else math.log(2)
        np.testing.assert_allclose(MEASURES[name](m, math.e), bits * factor, atol=1e-12)


@given(st.data())
def test_counting_subsets_by_intersections_agrees_with_listing_them(data: st.DataObject) -> None:
    m = data.draw(masses_over(data.draw(frames()), (2,)))
    np.testing.assert_allclose(_by_closure(m) / math.log(2), fractal_belief_entropy(m), atol=1e-9)


@pytest.mark.parametrize("layout", ["shared", "padded"])
def test_the_fractal_based_entropy_of_large_frames(layout: str) -> None:
    frame = Frame([f"h{i}" for i in range(14)])
    rng = np.random.default_rng(0)
    m = MassFunction(frame, rng.choice(frame.full, 5, replace=False) + 1, rng.dirichlet(np.ones(5), 3))
    np.testing.assert_allclose(
        fractal_belief_entropy(m.to(layout)), fractal_belief_entropy(m.to("dense")), rtol=1e-12
    )
    many = Frame([f"h{i}" for i in range(62)])
    assert fractal_belief_entropy(MassFunction.vacuous(many)) == pytest.approx(62)
    half = MassFunction(many, [1, 2], [0.5, 0.5])
    assert fractal_belief_entropy(half) == pytest.approx(1)


def test_too_many_intersections_are_refused() -> None:
    frame = Frame([f"h{i}" for i in range(14)])
    m = MassFunction(frame, [frame.full & ~(1 << i) for i in range(14)], np.full(14, 1 / 14))
    with pytest.raises(MassError, match="over 4096 intersections"):
        fractal_belief_entropy(m)
    assert fractal_belief_entropy(m.to("dense")) < 14


def test_published_values() -> None:
    frame = Frame(list("abcd"))
    vacuous = MassFunction.vacuous(frame)
    assert jirousek_shenoy_entropy(vacuous) == pytest.approx(2 * 2)  # twice log2 of 4
    assert deng_entropy(vacuous) == pytest.approx(math.log2(15))
    assert fractal_belief_entropy(vacuous) == pytest.approx(math.log2(15))
    sizes = np.array([s.bit_count() for s in range(1, 16)])
    largest = (2.0**sizes - 1) / (2.0**sizes - 1).sum()
    assert deng_entropy(MassFunction(frame, range(1, 16), largest)) == pytest.approx(math.log2(3**4 - 2**4))


def test_the_information_dimension_of_the_largest_deng_entropy_tends_to_sierpinskis() -> None:
    found = []
    for count in (4, 8, 12, 16):
        sets = np.arange(1 << count)
        sizes = sum((sets >> k) & 1 for k in range(count))
        masses = (2.0**sizes - 1) / (3.0**count - 2.0**count)
        m = MassFunction(Frame([f"h{i}" for i in range(count)]), sets, masses)
        found.append(float(information_dimension(m)))
    assert found == sorted(found)
    assert found[-1] == pytest.approx(math.log(3) / math.log(2), abs=2e-4)


@given(st.data())
def test_the_chapters_sums_are_those_of_the_appendix(data: st.DataObject) -> None:
    m = data.draw(masses_over(data.draw(frames()), (2,), zeros=False))
    reading = Reading()
    np.testing.assert_allclose(belief_entropy(m, math.e), appendix.belief_entropy(m, reading), atol=1e-9)
    np.testing.assert_allclose(core_entropy(m, math.e), appendix.core_entropy(m, reading), atol=1e-9)
    np.testing.assert_allclose(
        within_set_entropy(m, math.e), appendix.within_set_entropy(m, reading), atol=1e-9
    )


@given(st.data())
def test_sets_without_mass_do_not_count(data: st.DataObject) -> None:
    m = data.draw(masses_over(data.draw(frames())))
    more = m.to("dense")
    for name in ALL:
        np.testing.assert_allclose(MEASURES[name](more), MEASURES[name](m.to("padded")), atol=1e-9)


def test_tiny_masses_are_not_lost() -> None:
    frame = Frame(["a", "b"])
    m = MassFunction(frame, ["a", "b"], [1e-20, 1.0])
    for layout in ("shared", "padded", "dense"):
        assert dissonance(m.to(layout)) >= 0
        assert strife(m.to(layout)) == pytest.approx(1e-20 * math.log2(1e20), rel=1e-6)


def test_mass_on_the_empty_set_and_bad_bases_are_refused() -> None:
    frame = Frame(["a", "b"])
    clash = conjunctive(
        MassFunction.of(frame, {"a": 0.5, frame: 0.5}), MassFunction.of(frame, {"b": 1.0})
    ).mass
    for name in ALL:
        with pytest.raises(MassError, match="empty set carries mass"):
            MEASURES[name](clash)
        for base in (1.0, 0.0, -2.0, float("nan"), float("inf")):
            with pytest.raises(MassError, match="has no logarithm"):
                MEASURES[name](MassFunction.vacuous(frame), base)


def test_the_registry_is_complete() -> None:
    for name in ALL:
        measure = MEASURES[name]
        assert measure.name == name
        assert measure.source
        assert measure.kind in ("nonspecificity", "conflict", "total", "dimension")
        assert list(measure.desiderata) == list(DESIDERATA)
        for desideratum, holds in measure.desiderata.items():
            assert holds == ((name, desideratum) not in COUNTEREXAMPLES)


# -- what holds, by property tests ----------------------------------------

LARGEST = st.sampled_from([Frame(list("abcdef")[:count]) for count in range(1, 7)])


def holding(desideratum: str) -> list[str]:
    return [name for name in ALL if MEASURES[name].desiderata[desideratum]]


def non_interactive(a: MassFunction, b: MassFunction, product: ProductFrame) -> MassFunction:
    """Product of masses on boxes of focal sets."""
    left, right = product.projection(0).inverse, product.projection(1).inverse
    boxes = [left.image(int(s)) & right.image(int(t)) for s in a.focal_sets for t in b.focal_sets]
    return MassFunction(product.frame, boxes, np.outer(a.masses, b.masses).ravel())


@given(LARGEST, st.integers(0, 2**32 - 1))
def test_consistency_with_probability(frame: Frame, seed: int) -> None:
    p = np.random.default_rng(seed).dirichlet(np.ones(len(frame)))
    m = MassFunction(frame, [1 << k for k in range(len(frame))], p)
    for name in holding("probability"):
        assert MEASURES[name](m) == pytest.approx(entropy(list(p)), abs=1e-9), name


@given(st.data())
def test_consistency_with_sets(data: st.DataObject) -> None:
    frame = data.draw(LARGEST)
    chosen = data.draw(st.integers(1, frame.full))
    for name in holding("set"):
        value = MEASURES[name](MassFunction(frame, [chosen], [1.0]))
        assert value == pytest.approx(math.log2(chosen.bit_count()), abs=1e-9), name


@given(st.data())
def test_range(data: st.DataObject) -> None:
    frame = data.draw(LARGEST)
    m = data.draw(masses_over(frame, (20,)))
    for name in holding("range"):
        value = MEASURES[name](m)
        assert np.all((value >= 0) & (value <= math.log2(len(frame)) + 1e-9)), name
    assert all(np.all(MEASURES[name](m) >= 0) for name in ALL)


@given(st.data(), st.sampled_from([SQUARE, WIDE]))
def test_subadditivity(data: st.DataObject, product: ProductFrame) -> None:
    m = data.draw(masses_over(product.frame, (20,)))
    parts = [marginalise(m, product, i) for i in (0, 1)]
    for name in holding("subadditivity"):
        measure = MEASURES[name]
        assert np.all(measure(m) <= measure(parts[0]) + measure(parts[1]) + 1e-9), name


@given(st.data(), st.sampled_from([SQUARE, WIDE]))
def test_additivity(data: st.DataObject, product: ProductFrame) -> None:
    a, b = (data.draw(masses_over(factor)) for factor in product.factors)
    joint = non_interactive(a, b, product)
    for name in holding("additivity"):
        measure = MEASURES[name]
        assert measure(joint) == pytest.approx(float(measure(a) + measure(b)), abs=1e-9), name


def beliefs(m: MassFunction) -> np.ndarray:
    return np.array([float(belief(m, s)) for s in range(1, m.frame.full + 1)])


@given(st.data())
def test_monotonicity(data: st.DataObject) -> None:
    """Mass is moved to larger sets, then mixed with any other as far as no belief rises above the first."""
    frame = Frame(list("abc"))
    more, other = data.draw(masses_over(frame)), data.draw(masses_over(frame))
    grown = [int(s) | data.draw(st.integers(0, frame.full)) for s in more.focal_sets]
    table = np.zeros(8)
    np.add.at(table, grown, more.masses)
    less = MassFunction(frame, np.arange(8), table)
    room, slope = beliefs(more) - beliefs(less), beliefs(other) - beliefs(less)
    share = min([1.0, *(max(r, 0.0) / s for r, s in zip(room, slope, strict=True) if s > 1e-12)])
    mixed = MassFunction(frame, np.arange(8), (1 - share) * table + share * dense(other))
    assert np.all(beliefs(mixed) <= beliefs(more) + 1e-9)
    for name in holding("monotonicity"):
        assert MEASURES[name](mixed) >= MEASURES[name](more) - 1e-8, name


# -- what does not hold, by counterexamples ----------------------------------------

AB, ABC = Frame(["a", "b"]), Frame(["a", "b", "c"])
MANY = Frame(["a", *(f"b{i}" for i in range(8))])
IGNORANT = MassFunction.vacuous(AB)
EVEN = MassFunction.of(AB, {"a": 0.5, "b": 0.5})
SKEWED = MassFunction.of(AB, {"a": 0.9, "b": 0.1})
ALL_THREE = MassFunction.of(AB, {"a": 0.3, "b": 0.3, AB: 0.4})
DIAGONALS = MassFunction.of(
    SQUARE.frame, {("a, x", "b, y"): 0.5, ("a, y", "b, x"): 0.5}
)  # both marginals know nothing
CORNER = MassFunction.of(SQUARE.frame, {("a, y", "b, x"): 0.5, "a, x": 0.5})
LEANING = MassFunction.of(SQUARE.frame, {"a, y": 0.8, ("a, x", "b, x", "b, y"): 0.2})
THREE_CELLS = MassFunction.of(SQUARE.frame, {"b, y": 0.5, ("a, x", "a, y", "b, x"): 0.5})
UNKNOWN = MassFunction.vacuous(SQUARE.frame)
TWO_OF_THREE = MassFunction.of(ABC, {("a", "b"): 0.5, "c": 0.5})
KNOWS_NOTHING = MassFunction.vacuous(ABC)
NEARLY_NOTHING = MassFunction.of(ABC, {ABC: 0.6, ("a", "c"): 0.4})
SINGLES = MassFunction.of(ABC, {"a": 0.6, "c": 0.4})
ONE_GROWN = MassFunction.of(ABC, {("a", "c"): 0.6, "a": 0.4})
COMMITTED = MassFunction.of(ABC, {"a": 0.3, ABC: 0.3, "c": 0.3, ("a", "c"): 0.1})
UNCOMMITTED = MassFunction.of(ABC, {("a", "c"): 0.4, ("a", "b"): 0.3, "c": 0.3})
LONG_TAIL = MassFunction.of(MANY, {"a": 0.5, **{f"b{i}": 0.0625 for i in range(8)}})
TAIL_GROWN = MassFunction.of(MANY, {"a": 0.5, ("a", "b0"): 0.0625, **{f"b{i}": 0.0625 for i in range(1, 8)}})

CONFLICTS = ("strife", "discord", "dissonance", "confusion", "belief_entropy")
CHAPTER = ("core_entropy", "within_set_entropy")

COUNTEREXAMPLES: dict[tuple[str, str], tuple[MassFunction, ...]] = {
    ("nonspecificity", "probability"): (EVEN,),
    ("information_dimension", "probability"): (EVEN,),
    **{(name, "probability"): (SKEWED,) for name in CHAPTER},
    **{
        (name, "set"): (IGNORANT,)
        for name in (
            *CONFLICTS, *CHAPTER, "deng", "jirousek_shenoy", "fractal_belief", "information_dimension",
        )
    },
    **{(name, "range"): (IGNORANT,) for name in ("deng", "jirousek_shenoy", "fractal_belief")},
    **{
        (name, "range"): (ALL_THREE,)
        for name in ("confusion", "belief_entropy", "information_dimension", *CHAPTER)
    },
    **{(name, "subadditivity"): (DIAGONALS,) for name in (*CONFLICTS, *CHAPTER)},
    ("dissonance", "subadditivity"): (CORNER,),
    **{(name, "subadditivity"): (UNKNOWN,) for name in ("deng", "fractal_belief")},
    ("jirousek_shenoy", "subadditivity"): (LEANING,),
    ("pignistic", "subadditivity"): (THREE_CELLS,),
    **{
        (name, "additivity"): (IGNORANT, IGNORANT)
        for name in ("deng", "fractal_belief", "information_dimension")
    },
    **{(name, "monotonicity"): (TWO_OF_THREE, KNOWS_NOTHING) for name in (*CONFLICTS, *CHAPTER)},
    **{
        (name, "monotonicity"): (NEARLY_NOTHING, KNOWS_NOTHING) for name in ("deng", "information_dimension")
    },
    ("jirousek_shenoy", "monotonicity"): (LONG_TAIL, TAIL_GROWN),
    ("pignistic", "monotonicity"): (SINGLES, ONE_GROWN),
    ("fractal_belief", "monotonicity"): (COMMITTED, UNCOMMITTED),
}  # fmt: skip


@pytest.mark.parametrize(("name", "desideratum"), sorted(COUNTEREXAMPLES))
def test_counterexamples(name: str, desideratum: str) -> None:
    measure, given_masses = MEASURES[name], COUNTEREXAMPLES[name, desideratum]
    first, last = given_masses[0], given_masses[-1]
    value = float(measure(first))
    if desideratum == "probability":
        assert abs(value - entropy(first.masses.tolist())) > 1e-3
    elif desideratum == "set":
        assert len(first.focal_sets) == 1
        assert abs(value - math.log2(int(first.focal_sets[0]).bit_count())) > 1e-3
    elif desideratum == "range":
        assert value > math.log2(len(first.frame)) + 1e-3
    elif desideratum == "subadditivity":
        assert value > sum(float(measure(marginalise(first, SQUARE, i))) for i in (0, 1)) + 1e-3
    elif desideratum == "additivity":
        joint = float(measure(non_interactive(first, last, SQUARE)))
        assert abs(joint - value - float(measure(last))) > 1e-3
    else:
        every = range(1, first.frame.full + 1)
        assert all(belief(last, s) <= belief(first, s) + 1e-12 for s in every)
        assert value > float(measure(last)) + 1e-3


def test_the_table_in_the_documentation_is_the_registry() -> None:
    text = (Path(__file__).parents[2] / "docs" / "uncertainty.md").read_text(encoding="utf-8")
    rows = [line.strip("|").split("|") for line in text.splitlines() if line.startswith("| `")]
    printed = {cells[0].strip().strip("`"): [cell.strip() for cell in cells[1:]] for cells in rows}
    expected = {
        name: [measure.source, measure.kind, *("yes" if v else "no" for v in measure.desiderata.values())]
        for name, measure in MEASURES.items()
    }
    assert printed == expected


def test_nonspecificity_alone_grows_with_ignorance() -> None:
    frame = Frame(["a", "b", "c", "d"])
    m = MassFunction(frame, ["a", frame], np.stack([1 - np.linspace(0, 1, 5), np.linspace(0, 1, 5)], -1))
    np.testing.assert_allclose(nonspecificity(m), np.linspace(0, 2, 5))
