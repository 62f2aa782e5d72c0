"""Frames: refinement, coarsening, products and multivalued mappings, by definition and by law."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evifuse.belief import Frame, MassFunction, belief, conjunctive, disjunctive, plausibility
from evifuse.belief.product import ProductFrame, marginalise, product_frame, vacuous_extension
from evifuse.belief.remap import MultivaluedMapping, carry, coarsen, refine, refining
from evifuse.errors import FrameError
from tests.belief.strategies import NAMES, dense, masses_over

LAYOUTS = ("shared", "padded", "dense")
FINE = [f"f{i}" for i in range(7)]


@st.composite
def refinings(draw: st.DrawFn) -> MultivaluedMapping:
    coarse = Frame(NAMES[: draw(st.integers(1, 4))])
    fine = Frame(FINE[: draw(st.integers(len(coarse), 7))])
    extra = len(fine) - len(coarse)
    more = draw(st.lists(st.sampled_from(coarse.hypotheses), min_size=extra, max_size=extra))
    owner = draw(st.permutations([*coarse.hypotheses, *more]))
    parts = {c: [f for f, o in zip(fine.hypotheses, owner, strict=True) if o == c] for c in coarse.hypotheses}
    return refining(coarse, fine, parts)


@st.composite
def mappings(draw: st.DrawFn, source: Frame, target: Frame, partial: bool = False) -> MultivaluedMapping:
    images = {h: draw(st.integers(0 if partial else 1, target.full)) for h in source.hypotheses}
    return MultivaluedMapping(source, target, images, partial=partial)


def same(a: MassFunction, b: MassFunction) -> None:
    assert a.frame.hypotheses == b.frame.hypotheses
    np.testing.assert_allclose(dense(a), dense(b), atol=1e-12)


def layout_of(data: st.DataObject, m: MassFunction) -> MassFunction:
    return m.to(data.draw(st.sampled_from(LAYOUTS)))


@given(st.data())
def test_carrying_is_its_definition_in_every_layout(data: st.DataObject) -> None:
    source, target = Frame(NAMES[: data.draw(st.integers(1, 5))]), Frame(FINE[: data.draw(st.integers(1, 5))])
    mapping = data.draw(mappings(source, target, partial=True))
    m = data.draw(masses_over(source, (3,)))
    expected = np.zeros((3, target.full + 1))
    for a, masses in enumerate(dense(m).T):
        image = 0
        for i in range(len(source)):
            image |= mapping.masks[i] if a >> i & 1 else 0
        expected[:, image] += masses
    for layout in LAYOUTS:
        moved = carry(m.to(layout), mapping)
        assert moved.batch == (3,)
        np.testing.assert_allclose(dense(moved), expected, atol=1e-12)
        again = MassFunction(target, moved.focal_sets, moved.masses, open_world=True)  # a valid one
        same(again, moved)
        same(carry(m[1].to(layout), mapping), moved[1])


@given(st.data())
def test_coarsening_after_refinement_is_the_identity(data: st.DataObject) -> None:
    split = data.draw(refinings())
    m = layout_of(data, data.draw(masses_over(split.source, (2,))))
    same(coarsen(refine(m, split), split), m)
    same(coarsen(refine(m, split), split, outer=False), m)


@given(st.data())
def test_refinement_keeps_belief_and_plausibility(data: st.DataObject) -> None:
    split = data.draw(refinings())
    m = layout_of(data, data.draw(masses_over(split.source, (2,))))
    fine = refine(m, split)
    for a in range(1, split.source.full + 1):
        np.testing.assert_allclose(belief(fine, split.image(a)), belief(m, a), atol=1e-12)
        np.testing.assert_allclose(plausibility(fine, split.image(a)), plausibility(m, a), atol=1e-12)


@given(st.data())
def test_outer_coarsening_keeps_what_the_coarse_frame_can_say(data: st.DataObject) -> None:
    split = data.draw(refinings())
    m = layout_of(data, data.draw(masses_over(split.target, (2,))))
    coarse = coarsen(m, split)
    for a in range(1, split.source.full + 1):
        np.testing.assert_allclose(belief(coarse, a), belief(m, split.image(a)), atol=1e-12)
        np.testing.assert_allclose(plausibility(coarse, a), plausibility(m, split.image(a)), atol=1e-12)


@given(st.data())
def test_inner_coarsening_is_its_definition(data: st.DataObject) -> None:
    split = data.draw(refinings())
    m = data.draw(masses_over(split.target, (2,)))
    expected = np.zeros((2, split.source.full + 1))
    for a, masses in enumerate(dense(m).T):
        held = sum(1 << i for i, part in enumerate(split.masks) if part & ~a == 0)
        expected[:, held] += masses
    np.testing.assert_allclose(dense(coarsen(layout_of(data, m), split, outer=False)), expected, atol=1e-12)


@given(st.data())
def test_refinement_commutes_with_combination(data: st.DataObject) -> None:
    split = data.draw(refinings())
    a, b = (data.draw(masses_over(split.source)) for _ in range(2))
    for rule in (conjunctive, disjunctive):
        same(refine(rule(a, b).mass, split), rule(refine(a, split), refine(b, split)).mass)


@given(st.data())
def test_any_mapping_commutes_with_the_disjunctive_rule_and_with_mixing(data: st.DataObject) -> None:
    source, target = Frame(NAMES[:4]), Frame(FINE[:3])
    mapping = data.draw(mappings(source, target, partial=True))
    a, b = (data.draw(masses_over(source)) for _ in range(2))
    same(carry(disjunctive(a, b).mass, mapping), disjunctive(carry(a, mapping), carry(b, mapping)).mass)
    mixed = MassFunction(source, np.arange(16), (dense(a) + dense(b)) / 2)
    np.testing.assert_allclose(
        dense(carry(mixed, mapping)), (dense(carry(a, mapping)) + dense(carry(b, mapping))) / 2, atol=1e-12
    )


@given(st.data())
def test_two_mappings_in_a_row_are_one(data: st.DataObject) -> None:
    a, b, c = Frame(NAMES[:3]), Frame(FINE[:4]), Frame(["x", "y", "z"])
    one, two = data.draw(mappings(a, b)), data.draw(mappings(b, c, partial=True))
    m = layout_of(data, data.draw(masses_over(a, (2,))))
    same(carry(carry(m, one), two), carry(m, one.then(two)))
    with pytest.raises(FrameError, match="can't go on"):
        two.then(one)


@given(st.data())
def test_the_inverse_of_the_inverse_is_the_mapping(data: st.DataObject) -> None:
    mapping = data.draw(mappings(Frame(NAMES[:3]), Frame(FINE[:4]), partial=True))
    assert mapping.inverse.inverse == mapping


FACTORS = (Frame(["red", "blue"]), Frame(["round", "square", "flat"]), Frame(["hot", "cold"]))


@pytest.mark.parametrize("factors", [0, 1, 2, (0, 1), (2, 0), (0, 1, 2)])
@settings(max_examples=15)
@given(data=st.data())
def test_the_marginal_of_an_extension_is_the_identity(
    factors: int | tuple[int, ...], data: st.DataObject
) -> None:
    product = product_frame(*FACTORS)
    m = data.draw(masses_over(product.part(factors), (2,)))
    m = m.to(data.draw(st.sampled_from(LAYOUTS)))
    extended = vacuous_extension(m, product, factors)
    same(marginalise(extended, product, factors), m)
    for other in {0, 1, 2} - {factors} if isinstance(factors, int) else ():
        same(marginalise(extended, product, other), MassFunction.vacuous(FACTORS[other], (2,)))


@given(st.data())
def test_marginalising_in_steps_is_marginalising_at_once(data: st.DataObject) -> None:
    product = product_frame(*FACTORS)
    m = data.draw(masses_over(product.frame, (2,)))
    step = marginalise(m, product, (0, 2))
    same(marginalise(step, product_frame(FACTORS[0], FACTORS[2]), 1), marginalise(m, product, 2))


@given(st.data())
def test_independent_evidence_about_two_factors_does_not_change_either(data: st.DataObject) -> None:
    product = product_frame(*FACTORS[:2])
    a, b = (data.draw(masses_over(f)) for f in FACTORS[:2])
    joint = conjunctive(vacuous_extension(a, product, 0), vacuous_extension(b, product, 1))
    assert joint.conflict == pytest.approx(0, abs=1e-12)
    same(marginalise(joint.mass, product, 0), a)
    same(marginalise(joint.mass, product, 1), b)


def test_names_of_a_product_belong_to_their_factors() -> None:
    product = product_frame(*FACTORS[:2])
    assert product.frame.hypotheses[:4] == ("red, round", "red, square", "red, flat", "blue, round")
    red = vacuous_extension(MassFunction.of(FACTORS[0], {"red": 1.0}), product, 0)
    assert product.frame.names(int(red.focal_sets[0])) == ("red, round", "red, square", "red, flat")
    turned = product.part((1, 0))
    assert turned.hypotheses[:2] == ("round, red", "round, blue")


def test_62_hypotheses() -> None:
    a, b = Frame([f"a{i}" for i in range(31)]), Frame(["x", "y"])
    product = product_frame(a, b)
    assert len(product.frame) == 62
    m = MassFunction(a, [1 << 30, 5, a.full], [0.5, 0.25, 0.25])
    extended = vacuous_extension(m, product, 0)
    assert extended.focal_sets.tolist() == [0b11 << 0 | 0b11 << 4, 0b11 << 60, product.frame.full]
    assert marginalise(extended, product, 0) == m
    coarse = refining(b, product.frame, {"x": product.projection(1).inverse.masks[0], "y": [
        name for name in product.frame.hypotheses if name.endswith("y")]})  # fmt: skip
    assert coarsen(extended, coarse) == MassFunction.vacuous(b)


def test_a_dense_batch_stays_dense_and_singletons_stay_singletons() -> None:
    coarse, fine = Frame(["r", "s"]), Frame(["a", "b", "c"])
    split = refining(coarse, fine, {"r": ["a", "b"], "s": "c"})
    m = MassFunction(fine, ["a", "b", "c", fine], [[0.1, 0.2, 0.3, 0.4]] * 2)
    assert m.layout == "singletons"
    assert coarsen(m, split).layout == "singletons"
    assert coarsen(m, split)[0].as_dict(9) == {"frame": 0.4, "r": 0.3, "s": 0.3}
    assert coarsen(m.to("dense"), split).layout == "dense"
    assert refine(coarsen(m.to("dense"), split), split).layout == "shared"


def test_reordered_frames_are_remapped() -> None:
    coarse, fine = Frame(["r", "s"]), Frame(["a", "b", "c"])
    split = refining(coarse, fine, {"r": ["a", "b"], "s": "c"})
    m = MassFunction.of(Frame(["s", "r"]), {"r": 0.7, "s": 0.3})
    assert refine(m, split).as_dict() == {"a|b": 0.7, "c": 0.3}


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ({"r": ["a", "b"], "s": ["b", "c"]}, "'b' is in both 'r' and 's'"),
        ({"r": ["a"], "s": ["b"]}, "'c' of {a, b, c} is in no part"),
        ({"r": ["a", "b", "c"]}, "'s' of {r, s} has no image"),
        ({"r": ["a", "b"], "s": "d"}, "unknown hypothesis 'd'"),
        ({"r": ["a", "b"], "s": "c", "t": "a"}, "unknown hypothesis 't'"),
    ],
)
def test_what_is_no_refining_is_refused(parts: dict[str, list[str]], message: str) -> None:
    with pytest.raises(FrameError, match=message):
        refining(Frame(["r", "s"]), Frame(["a", "b", "c"]), parts)


def test_mappings_that_are_no_refining_are_refused_where_one_is_needed() -> None:
    coarse, fine = Frame(["r", "s"]), Frame(["a", "b"])
    mapping = MultivaluedMapping(coarse, fine, {"r": ["a", "b"], "s": "b"})
    for act in (refine, coarsen):
        with pytest.raises(FrameError, match="not a refining"):
            act(MassFunction.vacuous(fine), mapping)


def test_other_frames_are_refused() -> None:
    product = product_frame(*FACTORS[:2])
    with pytest.raises(FrameError, match="the mapping speaks of"):
        vacuous_extension(MassFunction.vacuous(FACTORS[1]), product, 0)
    with pytest.raises(FrameError, match="the mapping speaks of"):
        marginalise(MassFunction.vacuous(FACTORS[1]), product, 0)


def test_products_that_can_not_be_are_refused() -> None:
    big = Frame([f"a{i}" for i in range(32)])
    with pytest.raises(FrameError, match="32 x 2 hypotheses has 64 combinations"):
        product_frame(big, FACTORS[0])
    with pytest.raises(FrameError, match="at least two"):
        product_frame(big)
    with pytest.raises(FrameError, match="more than once"):
        product_frame(Frame(["a", "a, b"]), Frame(["b, c", "c"]))
    product = product_frame(*FACTORS)
    for wrong in (3, -1, (), (0, 0)):
        with pytest.raises(FrameError, match="among 3 factors"):
            marginalise(MassFunction.vacuous(product.frame), product, wrong)


def test_hypotheses_without_an_image() -> None:
    a, b = Frame(["r", "s"]), Frame(["x", "y"])
    m = MassFunction.of(a, {"r": 0.25, "s": 0.5, a: 0.25})
    partial = MultivaluedMapping(a, b, {"r": "x"}, partial=True)
    assert carry(m, partial).as_dict() == {"x": 0.5, "∅": 0.5}
    with pytest.raises(FrameError, match=r"'s' of \{r, s\} has no image"):
        MultivaluedMapping(a, b, {"r": "x"})


def test_a_product_is_a_value() -> None:
    assert product_frame(*FACTORS) == product_frame(*FACTORS)
    assert isinstance(product_frame(*FACTORS), ProductFrame)
    assert str(MultivaluedMapping(FACTORS[0], FACTORS[2], {"red": "hot", "blue": ["hot", "cold"]})) == (
        "red -> hot; blue -> frame"
    )
