"""The axioms of every rule, in every layout, and the combination of many sources."""

import io
from contextlib import redirect_stdout
from fractions import Fraction
from functools import reduce
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evifuse.belief import Frame, MassFunction, discount, pcr5
from evifuse.belief._joint import _scaled_pairs
from evifuse.belief.combine import dempster
from evifuse.belief.many import RULES, combine
from evifuse.belief.pcr6 import pcr6
from evifuse.errors import ConflictError, FrameError, MassError
from tests.belief.strategies import dense, frames, masses_over

FRAME = Frame(["a", "b", "c"])
LAYOUTS = ["shared", "padded", "singletons", "dense"]
ORDERED = [name for name, rule in RULES.items() if not (rule.associative or rule.takes_many)]
ASSOCIATIVE = [name for name, rule in RULES.items() if rule.associative]
NEEDS_EMPTY = {"bold"}


def opened(m: MassFunction) -> MassFunction:
    """A fifth of the mass moved to the empty set."""
    values = 0.8 * dense(m)
    values[..., 0] += 0.2
    return MassFunction(m.frame, range(m.frame.full + 1), values, open_world=True)


def sources(name: str, data: st.DataObject, count: int) -> list[MassFunction]:
    """Sources that the rule can take: none dogmatic, and with mass on the empty set where it is needed."""
    frame = data.draw(frames())
    many = [discount(data.draw(masses_over(frame, (2,))), reliability=0.9) for _ in range(count)]
    return [opened(m) for m in many] if name in NEEDS_EMPTY else many


def together(name: str, many: list[MassFunction]) -> np.ndarray:
    return dense(combine(many, name, order_matters=name in ORDERED).mass)


@pytest.mark.parametrize("name", RULES)
@given(data=st.data())
@settings(max_examples=25)
def test_two_sources_commute_and_masses_stay_masses(name: str, data: st.DataObject) -> None:
    a, b = sources(name, data, 2)
    left, right = together(name, [a, b]), together(name, [b, a])
    np.testing.assert_allclose(left, right, atol=1e-12, rtol=0)
    np.testing.assert_allclose(left.sum(axis=-1), 1, atol=1e-11)
    assert np.all(left >= 0)
    rule = RULES[name]
    alone = rule.function([a, b]) if rule.takes_many else rule.function(a, b)
    np.testing.assert_allclose(left, dense(alone.mass), atol=1e-12, rtol=0)
    np.testing.assert_allclose(combine([a, b], name).conflict, alone.conflict, atol=1e-12, rtol=0)


@pytest.mark.parametrize("name", ASSOCIATIVE)
@given(data=st.data())
@settings(max_examples=25)
def test_grouping_and_order_do_not_matter_where_that_is_claimed(name: str, data: st.DataObject) -> None:
    a, b, c = sources(name, data, 3)
    rule = RULES[name].function
    left = dense(rule(rule(a, b).mass, c).mass)
    np.testing.assert_allclose(left, dense(rule(a, rule(b, c).mass).mass), atol=1e-11, rtol=0)
    np.testing.assert_allclose(left, together(name, [c, a, b]), atol=1e-11, rtol=0)


@pytest.mark.parametrize("name", sorted(set(RULES) - set(ASSOCIATIVE)))
def test_a_counterexample_to_associativity(name: str) -> None:
    a, b, c = (MassFunction.of(FRAME, {key: 0.6, FRAME: 0.4}) for key in ("a", "a", "b"))
    left = together(name, [combine([a, b], name).mass, c])
    right = together(name, [a, combine([b, c], name).mass])
    assert np.abs(left - right).max() > 0.01


@pytest.mark.parametrize("name", [name for name, rule in RULES.items() if rule.takes_many])
@given(data=st.data())
@settings(max_examples=15)
def test_rules_for_many_do_not_ask_for_the_order(name: str, data: st.DataObject) -> None:
    a, b, c = sources(name, data, 3)
    np.testing.assert_allclose(together(name, [a, b, c]), together(name, [c, a, b]), atol=1e-12, rtol=0)


@pytest.mark.parametrize("name", ORDERED)
def test_rules_that_depend_on_the_order_say_so(name: str) -> None:
    a, b, c = (MassFunction.of(FRAME, {key: 0.6, FRAME: 0.4}) for key in ("a", "b", "a"))
    with pytest.raises(MassError, match=r"not associative.*order_matters=True"):
        combine([a, b, c], name)
    assert np.abs(together(name, [a, b, c]) - together(name, [a, c, b])).max() > 0.01
    mass, conflict = combine([a, b, c], name, order_matters=True)
    rule = RULES[name].function
    assert mass == rule(rule(a, b).mass, c).mass
    assert conflict == pytest.approx(combine([a, b, c], "conjunctive").conflict)


@pytest.mark.parametrize("name", RULES)
@given(data=st.data())
@settings(max_examples=15)
def test_idempotent_where_that_is_claimed(name: str, data: st.DataObject) -> None:
    (a,) = sources(name, data, 1)
    if RULES[name].idempotent:
        np.testing.assert_allclose(together(name, [a, a, a]), dense(a), atol=1e-12, rtol=0)
    else:
        m = MassFunction.of(FRAME, {"a": 0.3, "b": 0.3, FRAME: 0.4})
        assert np.abs(together(name, [m, m]) - dense(m)).max() > 0.01


@pytest.mark.parametrize("name", ["conjunctive", "dempster", "yager", "dubois_prade", "pcr5", "pcr6"])
@given(data=st.data())
@settings(max_examples=15)
def test_ignorance_is_neutral(name: str, data: st.DataObject) -> None:
    (a,) = sources(name, data, 1)
    vacuous = MassFunction.vacuous(a.frame)
    np.testing.assert_allclose(together(name, [a, vacuous]), dense(a), atol=1e-12, rtol=0)
    np.testing.assert_allclose(together(name, [vacuous, a]), dense(a), atol=1e-12, rtol=0)


@pytest.mark.parametrize("name", ["disjunctive", "bold"])
@given(data=st.data())
@settings(max_examples=15)
def test_the_empty_set_is_neutral_for_unions(name: str, data: st.DataObject) -> None:
    (a,) = sources(name, data, 1)
    nothing = MassFunction(a.frame, [0], [1.0], open_world=True)
    expected = dense(a)
    if name == "bold":  # as ignorance is for the cautious rule: only for weights that take nothing away
        a = MassFunction.of(FRAME, {"a": 0.75, (): 0.25}, open_world=True)
        nothing, expected = MassFunction(FRAME, [0], [1.0], open_world=True), dense(a)
    np.testing.assert_allclose(together(name, [a, nothing]), expected, atol=1e-12, rtol=0)


@pytest.mark.parametrize("name", sorted(set(RULES) - NEEDS_EMPTY))
def test_layouts_agree(name: str) -> None:
    rng = np.random.default_rng(11)
    sets = ["a", "b", "c", FRAME]
    a, b, c = (MassFunction(FRAME, sets, rng.dirichlet(np.ones(4), (2, 3))) for _ in range(3))
    expected = combine([a, b, c], name, order_matters=True)
    for mine, other in product(LAYOUTS, LAYOUTS):
        result = combine([a.to(mine), b.to(other), c], name, order_matters=True)
        np.testing.assert_allclose(dense(result.mass), dense(expected.mass), atol=1e-12, rtol=0)
        np.testing.assert_allclose(result.conflict, expected.conflict, atol=1e-12, rtol=0)


@pytest.mark.parametrize("name", sorted(set(RULES) - NEEDS_EMPTY))
@pytest.mark.parametrize("layout", LAYOUTS)
def test_batches_are_their_cases(name: str, layout) -> None:
    rng = np.random.default_rng(12)
    sets = ["a", "b", "c", FRAME]
    a = MassFunction(FRAME, sets, rng.dirichlet(np.ones(4), (2, 1))).to(layout)
    b = MassFunction(FRAME, sets, rng.dirichlet(np.ones(4), (3,))).to(layout)
    mass, conflict = combine([a, b], name)
    assert mass.batch == conflict.shape == (2, 3)
    for i, j in product(range(2), range(3)):
        one = combine([a[i][0], b[j]], name)
        np.testing.assert_allclose(dense(mass[i][j]), dense(one.mass), atol=1e-14)
        np.testing.assert_allclose(conflict[i, j], one.conflict, atol=1e-14)


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("tiny", [1e-6, 1e-10, 1e-18, 1e-200])
def test_near_total_conflict_is_right(layout, tiny: float) -> None:
    """Of 1 - tiny on two different hypotheses, only the third remains, and the frame."""
    a = MassFunction(FRAME, ["a", "b", "c", FRAME], [1 - tiny, 0, tiny * 0.75, tiny * 0.25]).to(layout)
    b = MassFunction(FRAME, ["a", "b", "c", FRAME], [0, 1 - tiny, tiny * 0.25, tiny * 0.75]).to(layout)
    x, y = a.to("singletons").masses, b.to("singletons").masses
    left = np.array([x[0] * y[3], x[3] * y[1], x[2] * y[2] + x[2] * y[3] + x[3] * y[2], x[3] * y[3]])
    logs = np.log([x[0], y[3], x[3], y[1]])
    share = np.exp(logs[0] + logs[1]) + np.exp(logs[2] + logs[3])
    mass, conflict = combine([a, b], "dempster")
    expected = np.array([left[0] / share, left[1] / share, left[2] / share, left[3] / share])
    values = dense(mass)[[1, 2, 4, 7]]
    np.testing.assert_allclose(values, expected / expected.sum(), rtol=1e-6, atol=1e-12)
    assert values.sum() == pytest.approx(1, abs=1e-12)
    assert conflict == pytest.approx(1 - left.sum(), abs=1e-15)
    third = combine([a, b, b], "dempster")
    np.testing.assert_allclose(
        dense(third.mass), dense(dempster(mass, b.to("shared")).mass), rtol=1e-6, atol=1e-12
    )


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("conflict", [1 - 1e-6, 1 - 1e-10, 1 - 1e-16])
def test_every_rule_survives_near_total_conflict(layout, conflict: float) -> None:
    tiny = 1 - conflict
    a = MassFunction(FRAME, ["a", "b", "c", FRAME], [1 - tiny, 0, 0, tiny]).to(layout)
    b = MassFunction(FRAME, ["a", "b", "c", FRAME], [0, 1 - tiny, 0, tiny]).to(layout)
    for name in sorted(set(RULES) - NEEDS_EMPTY):
        mass, _ = combine([a, b], name)
        values = dense(mass)
        assert values.sum() == pytest.approx(1, abs=1e-12), name
        if name in ("dempster", "pcr5", "pcr6", "average", "murphy"):
            assert values[1] == pytest.approx(values[2], abs=1e-12), name
            assert values[1] == pytest.approx(0.5, abs=1e-5), name


@pytest.mark.parametrize("layout", LAYOUTS)
def test_total_conflict(layout) -> None:
    a, b = (MassFunction(FRAME, ["a", "b", "c", FRAME], v).to(layout) for v in ([1, 0, 0, 0], [0, 1, 0, 0]))
    for many in ([a, b], [a, b, b], [a] * 500 + [b] * 500):
        with pytest.raises(ConflictError, match=r"total conflict.*discount"):
            combine(many)
        joint, conflict = combine(many, "conjunctive")
        assert conflict == 1.0
        assert dense(joint)[0] == 1.0
    together = combine([a, b], "average")
    assert together.conflict == 1.0
    batch = MassFunction(FRAME, ["a", "b", "c", FRAME], [[0, 1, 0, 0], [1, 0, 0, 0]]).to(layout)
    with pytest.raises(ConflictError, match=r"total conflict at index \(1,\)"):
        combine([b, batch, batch])


@pytest.mark.parametrize("layout", LAYOUTS)
def test_a_thousand_contradicting_sources_do_not_underflow(layout) -> None:
    """Each side alone pushes the other below the smallest number; together they are even."""
    sets, slight = ["a", "b", "c", FRAME], 1e-3
    for_a = MassFunction(FRAME, sets, [1 - 3 * slight, slight, slight, slight]).to(layout)
    for_b = MassFunction(FRAME, sets, [slight, 1 - 3 * slight, slight, slight]).to(layout)
    mass, conflict = combine([for_a] * 600 + [for_b] * 600)
    np.testing.assert_allclose(dense(mass)[[1, 2]], [0.5, 0.5], rtol=1e-11)
    assert conflict == 1.0
    mass, _ = combine([for_a] * 600 + [for_b] * 599)
    odds = (1 - 2 * slight) / (2 * slight)
    np.testing.assert_allclose(dense(mass)[1] / dense(mass)[2], odds, rtol=1e-11)
    joint, conflict = combine([for_a] * 600 + [for_b] * 600, "conjunctive")
    assert conflict == 1.0
    assert dense(joint)[0] == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize("layout", ["shared", "padded", "dense"])
@pytest.mark.parametrize("tiny", [1e-6, 1e-10, 1e-18])
def test_near_total_conflict_with_every_set_focal_is_exact(layout, tiny: float) -> None:
    """Sources that see all subsets of {a, b} and of {c, d}, and very little else."""
    frame = Frame(["a", "b", "c", "d"])
    rng = np.random.default_rng(8)
    values = rng.dirichlet(np.ones(15), 2) * tiny
    values[0, [0, 1, 2]] += rng.dirichlet(np.ones(3)) * (1 - tiny)
    values[1, [3, 7, 11]] += rng.dirichlet(np.ones(3)) * (1 - tiny)
    a, b = (MassFunction(frame, range(1, 16), v) for v in values)
    exact = [Fraction(0)] * 16
    for i, j in product(range(15), range(15)):
        exact[(i + 1) & (j + 1)] += Fraction(values[0, i]) * Fraction(values[1, j])
    rest = sum(exact[1:])
    expected = np.array([0.0, *(float(x / rest) for x in exact[1:])])
    mass, conflict = combine([a.to(layout), b.to(layout)])
    np.testing.assert_allclose(dense(mass), expected, atol=1e-12, rtol=0)
    assert conflict == pytest.approx(float(exact[0]), abs=1e-14)


def test_agreement_of_many_sources_leaves_no_conflict() -> None:
    m = MassFunction.of(FRAME, {"a": 0.1, ("a", "b"): 0.2, FRAME: 0.7})
    for layout in ("shared", "padded", "dense"):
        mass, conflict = combine([m.to(layout)] * 1000)
        assert conflict == 0
        assert dense(mass)[1] == pytest.approx(1, abs=1e-12)


def test_large_sparse_frames() -> None:
    frame = Frame([f"h{i}" for i in range(62)])
    tails = [
        discount(MassFunction(frame, [frame.full & -(1 << i)], [1.0]), reliability=1 - 1e-9)
        for i in range(62)
    ]
    mass, conflict = combine([m for m in tails for _ in range(3)])
    assert mass.as_dict()["h61"] == pytest.approx(1, abs=1e-9)
    assert conflict == 0


def test_too_many_intersections_are_refused_before_memory_runs_out(monkeypatch) -> None:
    monkeypatch.setattr("evifuse.belief._joint.MOST_SETS", 1 << 12)
    frame = Frame([f"h{i}" for i in range(62)])
    for reliability in (0.5, 1 - 1e-15):
        holes = [
            discount(MassFunction(frame, [frame.full & ~(1 << i)], [1.0]), reliability=reliability)
            for i in range(61)
        ]
        with pytest.raises(MassError, match="intersections"):
            combine([MassFunction.vacuous(frame, (2,)), *holes])


@pytest.mark.parametrize("layout", ["shared", "padded", "dense"])
@given(data=st.data())
@settings(max_examples=25)
def test_pcr6_of_two_is_pcr5(layout, data: st.DataObject) -> None:
    frame = data.draw(frames())
    a, b = (data.draw(masses_over(frame, (2,))) for _ in range(2))
    left, right = pcr6([a.to(layout), b.to(layout)]), pcr5(a, b)
    np.testing.assert_allclose(dense(left.mass), dense(right.mass), atol=1e-12, rtol=0)
    np.testing.assert_allclose(left.conflict, right.conflict, atol=1e-12, rtol=0)


@given(st.data())
@settings(max_examples=20)
def test_pcr6_of_three_is_its_definition(data: st.DataObject) -> None:
    frame = data.draw(frames())
    many = [data.draw(masses_over(frame)) for _ in range(3)]
    expected = np.zeros(frame.full + 1)
    for way in product(*(zip(m.focal_sets.tolist(), m.masses.tolist(), strict=True) for m in many)):
        common = reduce(lambda s, t: s & t, (s for s, _ in way))
        p = np.prod([x for _, x in way])
        if common:
            expected[common] += p
        elif p > 0:
            for s, x in way:
                expected[s] += p * x / sum(y for _, y in way)
    mass, _ = pcr6(many)
    np.testing.assert_allclose(dense(mass), expected, atol=1e-14)


def test_pcr6_refuses_what_it_can_not_do() -> None:
    a = MassFunction(FRAME, ["a", "b", "c"], [0.5, 0.25, 0.25])
    with pytest.raises(MassError, match=r"3.49e\+09 ways"):
        pcr6([a] * 20)
    with pytest.raises(MassError, match="source 1 has mass on the empty set"):
        pcr6([a, opened(a)])


@pytest.mark.parametrize("name", RULES)
def test_one_source_is_itself(name: str) -> None:
    m = MassFunction(FRAME, ["a", FRAME], [[0.5, 0.5], [0.2, 0.8]])
    mass, conflict = combine([m], name)
    np.testing.assert_allclose(dense(mass), dense(m), atol=1e-15)
    np.testing.assert_array_equal(conflict, [0, 0])


@pytest.mark.parametrize(
    ("many", "rule", "error", "names"),
    [
        ([], "dempster", MassError, "at least one source"),
        (
            [MassFunction.vacuous(FRAME)],
            "zhang",
            MassError,
            "unknown rule 'zhang': choose one of conjunctive",
        ),
        (["a"], "dempster", MassError, "source 0 is a str"),
        (MassFunction.vacuous(FRAME), "dempster", MassError, "put it in a list"),
        (
            [MassFunction.vacuous(f) for f in (FRAME, Frame(["a"]))],
            "dempster",
            FrameError,
            "different frames",
        ),
        (
            [MassFunction.vacuous(FRAME, (n,)) for n in (2, 3)],
            "dempster",
            MassError,
            "source 1 has batch (3,)",
        ),
    ],
)
def test_bad_input_is_refused(many, rule, error, names: str) -> None:
    with pytest.raises(error) as caught:
        combine(many, rule)
    assert names in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_registry_can_not_be_changed() -> None:
    with pytest.raises(TypeError):
        RULES["mine"] = RULES["dempster"]  # type: ignore[index]
    assert all(rule.source for rule in RULES.values())


def test_a_batch_is_combined_along_its_first_dimension() -> None:
    m = MassFunction(FRAME, ["a", FRAME], [[0.5, 0.5], [0.2, 0.8], [0.0, 1.0]])
    np.testing.assert_allclose(dense(combine(m).mass)[[1, 7]], [0.6, 0.4])


def test_many_sets_and_sources_agree_in_every_layout() -> None:
    """Underflow, a batch and a frame of seven: the sweeps and the pairs with powers of two."""
    frame = Frame([f"h{i}" for i in range(7)])
    rng = np.random.default_rng(4)
    many = []
    for _ in range(300):
        sets = rng.choice(frame.full, 6, replace=False) + 1
        values = 0.99 * rng.dirichlet(np.full(6, 0.5), (2,)) + 0.01 / 6
        many.append(MassFunction(frame, sets, values / values.sum(axis=-1, keepdims=True)))
    expected = _scaled_pairs(many, normalise=True)
    for layout in ("shared", "padded", "dense"):
        mass, conflict = combine([m.to(layout) for m in many])
        np.testing.assert_allclose(dense(mass), dense(expected.mass), atol=1e-12, rtol=0)
        np.testing.assert_allclose(conflict, expected.conflict, atol=1e-12, rtol=0)


def test_the_documented_example_prints_what_the_page_shows() -> None:
    page = (Path(__file__).parents[2] / "docs" / "rules.md").read_text(encoding="utf-8")
    code = page.split("```python\n")[1].split("```")[0]
    shown = page.split("```text\n")[1].split("```")[0]
    printed = io.StringIO()
    with redirect_stdout(printed):
        exec(code, {})
    assert printed.getvalue() == shown


def test_the_table_of_rules_says_what_the_registry_does() -> None:
    page = (Path(__file__).parents[2] / "docs" / "rules.md").read_text(encoding="utf-8")
    rows = [line.split("|") for line in page.splitlines() if line.startswith("| `")]
    assert [row[1].strip(" `") for row in rows] == list(RULES)
    for row, rule in zip(rows, RULES.values(), strict=True):
        assert row[3].strip().startswith("yes") == rule.associative
        assert ("takes all at once" in row[3]) == rule.takes_many
        assert row[4].strip() == ("yes" if rule.idempotent else "no")
        assert row[7].strip() == rule.source


@pytest.mark.parametrize("layout", LAYOUTS)
def test_an_empty_batch_stays_empty(layout) -> None:
    m = MassFunction(FRAME, ["a", "b", "c", FRAME], np.zeros((0, 4))).to(layout)
    for name in RULES:
        mass, conflict = combine([m, m, m], name, order_matters=True)
        assert mass.batch == conflict.shape == (0,), name


@pytest.mark.parametrize("layout", LAYOUTS)
def test_products_at_the_edge_of_numbers_keep_their_digits(layout) -> None:
    tiny = 1e-161  # its square is a number, but with hardly a digit
    frame = Frame(["a", "b", "c", "d"])
    sets = ["a", "b", "c", "d", frame]
    a = MassFunction(frame, sets, [1 - tiny, 0, tiny / 3, tiny / 3, 0]).to(layout)
    b = MassFunction(frame, sets, [0, 1 - tiny, tiny / 4, 3 * tiny / 4, 0]).to(layout)
    for many in ([a, b], [a, b, MassFunction.vacuous(frame)]):
        values = dense(combine(many).mass)
        np.testing.assert_allclose(values[[4, 8]], [0.25, 0.75], rtol=1e-12)
