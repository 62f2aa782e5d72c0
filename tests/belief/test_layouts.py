"""The four layouts hold the same masses, and every function gives the same in all of them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evifuse.belief import (
    Frame,
    MassFunction,
    belief,
    conjunctive,
    dempster,
    discount,
    disjunctive,
    dubois_prade,
    pcr5,
    pignistic,
    plausibility,
    yager,
)
from evifuse.errors import ConflictError, FrameError, MassError
from tests.belief.strategies import dense, frames, masses_over, pairs

LAYOUTS = ("shared", "padded", "dense")
RULES = (conjunctive, dempster, disjunctive, yager, dubois_prade, pcr5)


@given(st.data())
def test_conversions_keep_every_mass(data: st.DataObject) -> None:
    m = data.draw(masses_over(data.draw(frames()), (3,)))
    for first in LAYOUTS:
        there = m.to(first)
        assert there.layout == first
        for second in LAYOUTS:
            assert there.to(second) == m
        np.testing.assert_array_equal(dense(there), dense(m))
        np.testing.assert_array_equal(dense(there[1]), dense(m[1]))


@given(pairs((3,)))
def test_rules_agree_in_every_layout(two: tuple[MassFunction, MassFunction]) -> None:
    a, b = (discount(m, reliability=0.9) for m in two)
    for rule in RULES:
        expected, conflict = rule(a, b)
        for first in LAYOUTS:
            for second in LAYOUTS:
                joint, found = rule(a.to(first), b.to(second))
                np.testing.assert_allclose(dense(joint), dense(expected), atol=1e-12)
                np.testing.assert_allclose(found, conflict, atol=1e-12)
                single, one = rule(a.to(first)[0], b.to(second)[0])
                np.testing.assert_allclose(dense(single), dense(expected)[0], atol=1e-12)
                np.testing.assert_allclose(one, conflict[0], atol=1e-12)


@given(st.data())
def test_measures_agree_in_every_layout(data: st.DataObject) -> None:
    m = data.draw(masses_over(data.draw(frames()), (2, 2)))
    for layout in LAYOUTS:
        there = m.to(layout)
        np.testing.assert_allclose(pignistic(there), pignistic(m), atol=1e-12)
        for a in range(1, m.frame.full + 1):
            np.testing.assert_allclose(belief(there, a), belief(m, a), atol=1e-12)
            np.testing.assert_allclose(plausibility(there, a), plausibility(m, a), atol=1e-12)


def test_singletons_and_the_frame() -> None:
    frame = Frame(["a", "b", "c"])
    rng = np.random.default_rng(1)
    m, n = (MassFunction(frame, ["a", "b", "c", frame], rng.dirichlet(np.ones(4), 5)) for _ in range(2))
    assert m.layout == "singletons"
    for rule in RULES:
        joint, conflict = rule(m, n)
        expected, other = rule(m.to("padded"), n.to("padded"))
        np.testing.assert_allclose(dense(joint), dense(expected), atol=1e-12)
        np.testing.assert_allclose(conflict, other, atol=1e-12)
    assert dempster(m, n).mass.layout == "singletons"
    with pytest.raises(MassError, match="singletons"):
        MassFunction.of(frame, {("a", "b"): 1.0}).to("singletons")
    assert MassFunction(Frame(["only"]), ["only"], [1.0]).layout == "singletons"


def test_layouts_are_recognised() -> None:
    frame = Frame(["a", "b"])
    assert MassFunction(frame, [0, 1, 2, 3], [0, 0.5, 0.25, 0.25]).layout == "dense"
    assert MassFunction(frame, np.array([[1, 3], [2, 0]]), [[0.5, 0.5], [1, 0]]).layout == "padded"
    assert MassFunction(frame, ["a"], [1.0]).layout == "shared"


def test_padded_masses_are_checked_too() -> None:
    frame = Frame(["a", "b"])
    with pytest.raises(MassError, match="empty set"):
        MassFunction(frame, np.array([[1, 0]]), [[0.5, 0.5]])
    with pytest.raises(FrameError, match="more than once"):
        MassFunction(frame, np.array([[1, 1]]), [[0.5, 0.5]])
    with pytest.raises(FrameError, match="0x8"):
        MassFunction(frame, np.array([[1, 8]]), [[0.5, 0.5]])
    with pytest.raises(MassError, match="that shape"):
        MassFunction(frame, np.array([[1, 2]]), [0.5, 0.5])
    with pytest.raises(MassError, match="too many subsets"):
        MassFunction.vacuous(Frame([f"h{i}" for i in range(21)])).to("dense")


def test_an_open_world_must_be_asked_for() -> None:
    frame = Frame(["a", "b"])
    with pytest.raises(MassError, match="empty set"):
        MassFunction.of(frame, {(): 0.5, "a": 0.5})
    m = MassFunction.of(frame, {(): 0.5, "a": 0.5}, open_world=True)
    assert m.as_dict() == {"∅": 0.5, "a": 0.5}
    assert belief(m, "a") == 0.5


def test_sixty_two_hypotheses() -> None:
    frame = Frame([f"h{i}" for i in range(62)])
    rng = np.random.default_rng(2)
    a, b = (
        MassFunction(
            frame, [*{int(s) for s in rng.integers(1, frame.full, 40)}, frame], rng.dirichlet(np.ones(41))
        )
        for _ in range(2)
    )
    for rule in RULES:
        joint, conflict = rule(a, b)
        assert float(joint.masses.sum()) == pytest.approx(1)
        expected = sum(
            x * y
            for s, x in zip(a.focal_sets.tolist(), a.masses.tolist(), strict=True)
            for t, y in zip(b.focal_sets.tolist(), b.masses.tolist(), strict=True)
            if s & t == 0
        )
        if rule is not disjunctive:
            assert float(conflict) == pytest.approx(expected, abs=1e-15)


def test_a_reordered_frame_is_remapped_and_a_different_one_refused() -> None:
    a = MassFunction.of(Frame(["x", "y", "z"]), {"x": 0.5, ("y", "z"): 0.5})
    b = MassFunction.of(Frame(["z", "x", "y"]), {"x": 0.5, ("x", "y", "z"): 0.5})
    joint, _ = dempster(a, b)
    assert joint == dempster(a, MassFunction.of(a.frame, {"x": 0.5, a.frame: 0.5})).mass
    with pytest.raises(FrameError, match="different frames"):
        dempster(a, MassFunction.vacuous(Frame(["x", "y", "w"])))
    with_lists = MassFunction.vacuous(Frame(["x", "y", "z"], {"x": ["sharp"]}))
    other_lists = MassFunction.vacuous(Frame(["z", "y", "x"], {"x": ["blunt"]}))
    with pytest.raises(FrameError, match="different attributes"):
        dempster(with_lists, other_lists)


@pytest.mark.parametrize("tiny", [1e-6, 1e-10, 1e-18, 1e-100, 1e-200, 1e-300])
@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("batched", [False, True])
def test_near_total_conflict_is_right(tiny: float, layout: str, batched: bool) -> None:
    frame = Frame(["a", "b", "c"])
    a = MassFunction(frame, ["a", "c", ("b", "c")], [1 - 2 * tiny, tiny, tiny])
    b = MassFunction(frame, ["b", "c", ("a", "c")], [1 - 1.5 * tiny, tiny, tiny / 2])
    if batched:
        a, b = (MassFunction(frame, m.focal_sets, np.stack([m.masses, m.masses])) for m in (a, b))
    joint, conflict = dempster(a.to(layout), b.to(layout))  # type: ignore[arg-type]
    x, y = {"a": 1 - 2 * tiny, "c": tiny, "bc": tiny}, {"b": 1 - 1.5 * tiny, "c": tiny, "ac": tiny / 2}
    products: dict[str, float] = {}
    for s, p in x.items():
        for t, q in y.items():
            meet = "".join(sorted(set(s) & set(t)))
            if meet:  # scaled by 1 / tiny, so that nothing underflows
                products[meet] = products.get(meet, 0.0) + (p / tiny) * q
    total = sum(products.values())
    single = joint[0] if batched else joint
    for meet, value in products.items():
        expected = value / total
        assert single.as_dict().get(meet, 0.0) == pytest.approx(expected, rel=1e-9, abs=1e-150)
    assert np.all(conflict == pytest.approx(1 - total * tiny))


@pytest.mark.parametrize("layout", LAYOUTS)
def test_products_whose_digits_run_out(layout: str) -> None:
    frame = Frame(["a", "b", "c", "d"])
    t = 1e-161
    a = MassFunction(frame, ["a", "c", "d"], [1 - t, t / 3, t / 3]).to(layout)  # type: ignore[arg-type]
    b = MassFunction(frame, ["b", "c", "d"], [1 - t, t / 4, 3 * t / 4]).to(layout)  # type: ignore[arg-type]
    assert dempster(a, b).mass.as_dict() == pytest.approx({"c": 0.25, "d": 0.75})
    many = [
        MassFunction(frame, m.focal_sets, np.stack([m.masses] * 2)) for m in (a.to("shared"), b.to("shared"))
    ]
    assert dempster(*many).mass[1].as_dict() == pytest.approx({"c": 0.25, "d": 0.75})


@pytest.mark.parametrize("doubt", [1e-3, 1e-6, 1e-10, 1e-14])
def test_full_tables_near_total_conflict(doubt: float) -> None:
    rng = np.random.default_rng(4)
    frame = Frame([f"h{i}" for i in range(8)])

    def believer(mask: int) -> MassFunction:
        masses = np.concatenate([[0.0], doubt * rng.dirichlet(np.ones(255))])
        masses[mask] += 1 - masses.sum()
        return MassFunction(frame, np.arange(256), masses)

    a, b = believer(1), believer(2)
    joint, conflict = dempster(a, b)
    expected, other = dempster(a.to("padded"), b.to("padded"))
    np.testing.assert_allclose(dense(joint), dense(expected), atol=1e-12)
    assert float(conflict) == pytest.approx(float(other), abs=1e-12)


def test_total_conflict_is_an_error_in_every_layout() -> None:
    frame = Frame(["a", "b"])
    a, b = MassFunction.of(frame, {"a": 1.0}), MassFunction.of(frame, {"b": 1.0})
    for layout in (*LAYOUTS, "singletons"):
        with pytest.raises(ConflictError, match="total conflict"):
            dempster(a.to(layout), b.to(layout))  # type: ignore[arg-type]
        many = MassFunction(frame, ["a", "b"], [[0.5, 0.5], [1.0, 0.0]]).to(layout)  # type: ignore[arg-type]
        with pytest.raises(ConflictError, match=r"index \(1,\)"):
            dempster(many, b.to(layout))  # type: ignore[arg-type]
