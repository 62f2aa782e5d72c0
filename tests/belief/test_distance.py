"""Distances: metric axioms, the definition by brute force, layouts, batches."""

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evifuse.belief import Frame, MassFunction, conjunctive
from evifuse.belief.distance import _transform_pays, bhattacharyya, conflict, jousselme
from evifuse.errors import FrameError, MassError
from tests.belief.strategies import NAMES, dense, frames, masses_over, pairs

LAYOUTS = ("shared", "padded", "dense")


def jaccard(count: int) -> np.ndarray:
    size = 1 << count
    table = np.empty((size, size))
    for a in range(size):
        for b in range(size):
            table[a, b] = (a & b).bit_count() / (a | b).bit_count() if a | b else 1.0
    return table


def by_definition(a: MassFunction, b: MassFunction) -> np.ndarray:
    u = dense(a) - dense(b)
    return np.sqrt(np.maximum(np.einsum("...a,ab,...b->...", u, jaccard(len(a.frame)), u) / 2, 0))


def full(count: int, batch: tuple[int, ...], seed: int) -> MassFunction:
    """All subsets carry mass."""
    rng = np.random.default_rng(seed)
    masses = np.zeros((*batch, 1 << count))
    masses[..., 1:] = rng.dirichlet(np.ones((1 << count) - 1), size=batch)
    return MassFunction(Frame([f"h{i}" for i in range(count)]), np.arange(1 << count), masses)


@given(pairs((5,)))
def test_jousselme_is_its_definition(two: tuple[MassFunction, MassFunction]) -> None:
    np.testing.assert_allclose(jousselme(*two), by_definition(*two), atol=1e-9)


@pytest.mark.parametrize("count", range(1, 9))
@pytest.mark.parametrize("batch", [(), (3,)])
def test_the_transform_is_the_definition(count: int, batch: tuple[int, ...]) -> None:
    a, b = full(count, batch, 1), full(count, batch, 2)
    if count >= 5:
        assert _transform_pays(a, b)
    np.testing.assert_allclose(jousselme(a, b), by_definition(a, b), rtol=1e-12)


@pytest.mark.parametrize("count", [10, 13])
def test_the_transform_agrees_with_pairs_where_the_definition_is_too_large(count: int) -> None:
    a, b = full(count, (), 3), full(count, (), 4)
    few = MassFunction(a.frame, [3, 5, 9, 1000, a.frame.full], [0.2] * 5)
    assert _transform_pays(a, few.to("dense"))
    for other in (few, b):
        once = jousselme(a, other.to("dense"))
        np.testing.assert_allclose(once, jousselme(a.to("padded"), other.to("padded")), rtol=1e-12)


@given(pairs((3,)), st.sampled_from(LAYOUTS), st.sampled_from(LAYOUTS))
def test_layouts_agree(two: tuple[MassFunction, MassFunction], left: str, right: str) -> None:
    a, b = two
    for distance in (jousselme, bhattacharyya, conflict):
        usual = distance(a.to("padded"), b.to("padded"))
        np.testing.assert_allclose(distance(a.to(left), b.to(right)), usual, atol=1e-12)
        one = [float(distance(a[i].to(left), b[i].to(right))) for i in range(3)]
        np.testing.assert_allclose(one, usual, atol=1e-12)


@given(st.data())
def test_metric_axioms(data: st.DataObject) -> None:
    frame = data.draw(frames())
    a, b, c = (data.draw(masses_over(frame, (4,))) for _ in range(3))
    for distance in (jousselme, bhattacharyya):
        ab, bc, ac = distance(a, b), distance(b, c), distance(a, c)
        assert np.all((ab >= 0) & (ab <= 1))
        np.testing.assert_allclose(ab, distance(b, a), atol=1e-12)
        np.testing.assert_array_equal(distance(a, a), 0)
        assert np.all(ac <= ab + bc + 1e-12)
        different = np.abs(dense(a) - dense(b)).max(axis=-1) > 1e-6
        assert np.all(ab[different] > 1e-8)


@given(pairs((4,)))
def test_bhattacharyya_is_its_definition(two: tuple[MassFunction, MassFunction]) -> None:
    a, b = two
    expected = 1 - np.sqrt(dense(a) * dense(b)).sum(axis=-1)
    for x, y in ((a, b), (a.to("padded"), b), (a.to("padded"), b.to("padded"))):
        np.testing.assert_allclose(bhattacharyya(x, y) ** 2, expected, atol=1e-9)


@given(pairs((4,)))
def test_conflict_is_the_mass_of_disjoint_pairs(two: tuple[MassFunction, MassFunction]) -> None:
    a, b = (dense(m) for m in two)
    every = range(a.shape[-1])
    expected = sum(a[:, s] * b[:, t] for s in every for t in every if s & t == 0)
    np.testing.assert_allclose(conflict(*two), expected, atol=1e-12)


def test_conflict_is_no_distance() -> None:
    frame = Frame(["a", "b"])
    m = MassFunction.of(frame, {"a": 0.5, "b": 0.5})
    assert conflict(m, m) == 0.5
    assert conflict(m, MassFunction.vacuous(frame)) == 0.0


def test_a_small_difference_is_not_lost_to_rounding() -> None:
    frame = Frame(["a", "b", "c"])
    a = MassFunction.of(frame, {"a": 0.5, ("a", "b"): 0.5})
    b = MassFunction.of(frame, {"a": 0.5 - 1e-12, ("a", "b"): 0.5 + 1e-12})
    expected = np.sqrt(0.5 * (2 - 2 * 0.5)) * 1e-12
    for layout in LAYOUTS:
        np.testing.assert_allclose(jousselme(a.to(layout), b.to(layout)), expected, rtol=1e-3)
        assert bhattacharyya(a.to(layout), b.to(layout)) < 2e-12


@settings(max_examples=40)
@given(st.data())
def test_batches_broadcast(data: st.DataObject) -> None:
    frame = data.draw(frames())
    a, b = data.draw(masses_over(frame, (3, 1))), data.draw(masses_over(frame, (4,)))
    left, right = data.draw(st.sampled_from(LAYOUTS)), data.draw(st.sampled_from(LAYOUTS))
    for distance in (jousselme, bhattacharyya, conflict):
        d = distance(a.to(left), b.to(right))
        assert d.shape == (3, 4)
        np.testing.assert_allclose(d[2, 1], distance(a[2, 0], b[1]), atol=1e-12)


def test_many_hypotheses() -> None:
    frame = Frame([f"h{i}" for i in range(62)])
    a = MassFunction(frame, [1, frame.full], [0.5, 0.5])
    b = MassFunction(frame, [1 << 61, frame.full], [0.5, 0.5])
    assert jousselme(a, b) == pytest.approx(0.5)
    assert jousselme(MassFunction.of(frame, {1: 1.0}), MassFunction.vacuous(frame)) == pytest.approx(
        np.sqrt(1 - 1 / 62)
    )
    assert conflict(a, b) == pytest.approx(0.25)


def test_mass_on_the_empty_set_resembles_only_itself() -> None:
    frame = Frame(NAMES[:4])
    a = conjunctive(
        MassFunction.of(frame, {"h0": 0.5, frame: 0.5}), MassFunction.of(frame, {"h1": 0.5, frame: 0.5})
    ).mass
    b = MassFunction.of(frame, {("h0", "h1"): 0.5, frame: 0.5})
    expected = by_definition(a, b)
    for layout in LAYOUTS:
        np.testing.assert_allclose(jousselme(a.to(layout), b.to(layout)), expected, atol=1e-12)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_mass_on_the_empty_set_in_batches_and_full_tables(layout: str) -> None:
    rng = np.random.default_rng(5)
    frame = Frame(NAMES[:6])
    a, b = (
        MassFunction(frame, np.arange(64), rng.dirichlet(np.ones(64), 5), open_world=True) for _ in range(2)
    )
    assert _transform_pays(a, b)
    np.testing.assert_allclose(jousselme(a.to(layout), b.to(layout)), by_definition(a, b), rtol=1e-9)
    few = MassFunction(frame, [0, 3, 5], rng.dirichlet(np.ones(3), 5), open_world=True).to(layout)
    np.testing.assert_allclose(jousselme(few, few[::-1]), by_definition(few, few[::-1]), atol=1e-9)


def test_reordered_frames_are_matched_and_others_refused() -> None:
    a = MassFunction.of(Frame(["a", "b"]), {"a": 0.6, "b": 0.4})
    b = MassFunction.of(Frame(["b", "a"]), {"a": 0.6, "b": 0.4})
    for distance in (jousselme, bhattacharyya):
        assert distance(a, b) == 0
        with pytest.raises(FrameError, match="different frames"):
            distance(a, MassFunction.vacuous(Frame(["a", "c"])))


def test_batches_that_do_not_broadcast_are_refused() -> None:
    frame = Frame(["a", "b"])
    for distance in (jousselme, bhattacharyya, conflict):
        with pytest.raises(MassError, match=r"\(2,\) and \(3,\)"):
            distance(MassFunction.vacuous(frame, (2,)), MassFunction.vacuous(frame, (3,)))


def test_numba_is_imported_on_first_use_only() -> None:
    code = "import sys, evifuse.belief.distance; print('numba' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
