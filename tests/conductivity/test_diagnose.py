"""Diagnoses against counts by hand, against classifications with the evidence moved, and at the edges."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evifuse.belief import Frame, MassFunction
from evifuse.conductivity import READINGS, Aggregate, KnowledgeBase, Reading, classify
from evifuse.conductivity.diagnose import CHUNK, diagnose
from evifuse.errors import FrameError, KnowledgeError
from evifuse.knowledge import load_knowledge
from tests.belief.strategies import masses_over

SHAPE = load_knowledge("shape").frame
KNOWLEDGE = ("chapter-shape", "shape")


def random_evidence(count: int, seed: int = 0) -> MassFunction:
    masses = np.random.default_rng(seed).dirichlet([0.6, 0.6, 0.6, 0.6, 0.6], size=count)
    return MassFunction(SHAPE, ["rectangle", "square", "triangle", "ellipse", SHAPE], masses)


@pytest.mark.parametrize("pooling", ["sum", "mean", "max"])
@pytest.mark.parametrize("name", KNOWLEDGE)
def test_counts_are_those_of_one_case_after_the_other(name: str, pooling: str) -> None:
    knowledge, reading = load_knowledge(name), Reading(pooling=pooling)  # type: ignore[arg-type]
    evidence = random_evidence(60)
    found = diagnose(evidence, knowledge, reading)
    conducts, best, over_all, fires = (dict.fromkeys(found.prototypes, 0) for _ in range(4))
    for y in evidence:
        sigma = {(e.label, e.prototype): e.conductivity for e in classify(y, knowledge, reading).explain()}
        for (label, name_), value in sigma.items():
            own = [s for (other, _), s in sigma.items() if other == label]
            wins = value > 0 and value >= max(own) * (1 - 1e-12)
            conducts[label, name_] += value > 0
            best[label, name_] += wins
            over_all[label, name_] += wins and value >= max(sigma.values()) * (1 - 1e-12)
            fires[label, name_] += wins or (pooling != "max" and value >= 0.01 * sum(own) > 0)
    assert found.conducts.tolist() == list(conducts.values())
    assert found.best_of_class.tolist() == list(best.values())
    assert found.best_of_all.tolist() == list(over_all.values())
    assert found.fires.tolist() == list(fires.values())
    decided = [classify(y, knowledge, reading).decision for y in evidence]
    assert found.decided.tolist() == [decided.count(label) for label in knowledge.classes]
    assert found.cases == 60
    assert found.nothing == decided.count(None)


def test_decisive_is_what_leaving_its_conductivity_out_changes() -> None:
    knowledge, evidence = load_knowledge("shape"), random_evidence(300)
    found = diagnose(evidence, knowledge)
    c = classify(evidence, knowledge)
    for i, (label, _) in enumerate(found.prototypes):
        sigma = c.prototype_conductivities.copy()
        sigma[:, i] = 0
        totals = np.stack([sigma[:, [p[0] == k for p in c.prototypes]].max(axis=1) for k in c.classes], -1)
        after = np.where(totals.max(axis=1) > 0, totals.argmax(axis=1), -1)
        assert found.decisive[i] == np.sum(after != c.decisions), label
    assert found.decisive.sum() > 0


def test_prototypes_that_never_fire_and_classes_that_are_never_decided() -> None:
    evidence = MassFunction(
        SHAPE, ["rectangle", "square", SHAPE], [[0.7, 0.1, 0.2], [0.6, 0.2, 0.2], [0.1, 0.7, 0.2]]
    )
    found = diagnose(evidence, load_knowledge("shape"))
    assert found.never_decided == ("triangular", "elliptical")
    assert ("rectangular", "R_3") not in found.never_fire
    silent = dict(zip(found.prototypes, found.fires.tolist(), strict=True))
    assert [p for p, count in silent.items() if count == 0] == list(found.never_fire)
    everything = diagnose(random_evidence(200), load_knowledge("shape"))
    assert everything.never_decided == ()


def test_ignorance_conducts_into_nothing() -> None:
    found = diagnose(MassFunction.vacuous(SHAPE, (4,)), load_knowledge("shape"))
    assert found.nothing == 4
    assert found.never_decided == found.classes
    assert len(found.never_fire) == len(found.prototypes)
    assert not found.near_branch.any()


def line(count: int = 4001) -> MassFunction:
    """Evidence on a line from a triangle to a rectangle, past branch points of table 1."""
    t = np.linspace(0.0, 1.0, count)
    masses = np.stack([0.82 - 0.8 * t, 0.03 + 0.8 * t, np.full(count, 0.15)], axis=-1)
    return MassFunction(SHAPE, ["triangle", "rectangle", SHAPE], masses)


def test_near_is_a_band_around_the_branch_point() -> None:
    knowledge, evidence = load_knowledge("chapter-shape"), line()
    found, c = diagnose(evidence, knowledge), classify(evidence, knowledge)
    tops = np.array([c.properties[label].dimension for label, _ in c.prototypes])
    close = (np.abs(c.interaction_dimensions - tops) <= 0.05 * tops) & (tops < 1)
    assert 0 < close.any(axis=1).sum() < len(close)
    np.testing.assert_array_equal(found.near_branch, close.any(axis=1))
    np.testing.assert_array_equal(found.crossing >= 0, close.any(axis=1))
    np.testing.assert_array_equal(found.crossings, close.sum(axis=0))
    wider = diagnose(evidence, knowledge, near=0.1)
    assert (wider.near_branch >= found.near_branch).all()
    assert wider.near_branch.sum() > found.near_branch.sum()
    assert (found.change[found.near_branch] > 0.01).all()
    assert (found.change[~found.near_branch] == 0).all()


def follow(reading: Reading, knowledge: KnowledgeBase, evidence: MassFunction) -> int:
    """Follow a line through its jumps: what is foreseen on one side is what is found on the other."""
    found, c = diagnose(evidence, knowledge, reading), classify(evidence, knowledge, reading)
    jumps = np.argwhere(np.diff(c.branches, axis=0) != 0)
    for n, i in jumps:
        happened = 0.5 * np.abs(c.belief.masses[n + 1] - c.belief.masses[n]).sum()
        assert happened > 0.01
        for side in (n, n + 1):
            one = diagnose(evidence[side], knowledge, reading, near=1e-3)
            assert one.crossing == i
            assert one.change == pytest.approx(happened, abs=1e-3)
            assert found.near_branch[side]
            assert found.change[side] >= one.change
            assert one.flips == (c.decisions[n] != c.decisions[n + 1])
    return len(jumps)


@pytest.mark.parametrize("pooling", ["sum", "mean", "max"])
def test_the_foreseen_change_is_the_one_that_happens(pooling: str) -> None:
    reading = Reading(pooling=pooling)  # type: ignore[arg-type]
    assert follow(reading, load_knowledge("chapter-shape"), line(20_001)) == 3


def test_a_flip_is_foreseen() -> None:
    reading = Reading(pooling="max")
    knowledge, evidence = load_knowledge("chapter-shape"), line()
    c = classify(evidence, knowledge, reading)
    (turned,) = np.nonzero(np.diff(c.decisions))
    assert len(turned) > 0
    assert diagnose(evidence, knowledge, reading).flips[turned].any()


def test_the_second_jump_is_foreseen_too() -> None:
    """A large base of the logarithm makes the capacity large, so that the weak branch ends below 1."""
    frame = Frame(["a", "b", "c"])
    pair = {name: MassFunction.of(frame, {name: 0.6, frame: 0.4}) for name in ("a", "b")}
    single = {"c": MassFunction.of(frame, {"c": 0.7, frame: 0.3})}
    knowledge = KnowledgeBase("three", frame, (Aggregate("ab", pair), Aggregate("c", single)), Reading())
    t = np.linspace(0.0, 1.0, 20_001)
    masses = np.stack([0.6 - 0.59 * t, 0.01 + 0.59 * t, np.full(len(t), 0.39)], axis=-1)
    evidence = MassFunction(frame, ["a", "b", frame], masses)
    reading = Reading(log_base=30.0)
    assert set(classify(evidence, knowledge, reading).branches[:, :2].ravel()) == {1, 2}
    assert follow(reading, knowledge, evidence) == 4


def test_without_a_jump_nothing_is_near() -> None:
    knowledge, evidence = load_knowledge("chapter-shape"), line()
    assert diagnose(evidence, knowledge).near_branch.any()
    for reading in (Reading(projection=False), Reading(smoothing=0.2), READINGS["working"]):
        found = diagnose(evidence, knowledge, reading)
        assert not found.near_branch.any()
        assert not found.flips.any()
        assert found.crossings.sum() == 0
    assert diagnose(evidence, knowledge, Reading(smoothing=1e-6)).near_branch.any()


def test_a_single_prototype_can_not_be_passed() -> None:
    """Its branch point is 1, which no interaction dimension exceeds."""
    frame = Frame(["c", "d"])
    x = MassFunction.of(frame, {"c": 0.7, frame: 0.3})
    other = MassFunction.of(frame, {"d": 0.9, frame: 0.1})
    classes = (Aggregate("c", {"C": x}), Aggregate("d", {"D": other}))
    knowledge = KnowledgeBase("singles", frame, classes, Reading())
    assert classify(x, knowledge).interaction_dimensions[0] == 1
    assert not diagnose(x, knowledge).near_branch


def test_a_crossing_that_changes_nothing_does_not_matter() -> None:
    """Of a class that conducts as its best prototype, a worse one may fall without a trace."""
    knowledge, evidence, reading = load_knowledge("chapter-shape"), line(), Reading(pooling="max")
    c = classify(evidence, knowledge, reading)
    first, second = (c.prototypes.index(("triangular", name)) for name in ("T_1", "T_2"))
    top = c.properties["triangular"].dimension
    close = np.abs(c.interaction_dimensions[:, second] - top) <= 0.1 * top
    sigma = c.prototype_conductivities
    idle = close & (c.branches[:, second] == 0) & (sigma[:, second] < sigma[:, first])
    found = diagnose(evidence, knowledge, reading, near=0.1)
    assert idle.any()
    assert (found.crossing[idle] != second).all()
    assert found.crossings[second] <= np.sum(close & ~idle)


@given(st.data())
def test_a_batch_is_diagnosed_like_its_members(data: st.DataObject) -> None:
    knowledge = load_knowledge(data.draw(st.sampled_from(KNOWLEDGE)))
    evidence = data.draw(masses_over(SHAPE, (2, 3)))
    whole = diagnose(evidence, knowledge)
    ones = [[diagnose(evidence[i][j], knowledge) for j in range(3)] for i in range(2)]
    for field in ("near_branch", "flips", "change"):
        expected = np.array([[getattr(one, field) for one in row] for row in ones])
        np.testing.assert_allclose(getattr(whole, field), expected, atol=1e-12)
    for field in ("conducts", "best_of_class", "best_of_all", "fires", "decisive", "crossings", "decided"):
        total = sum(getattr(one, field) for row in ones for one in row)
        assert getattr(whole, field).tolist() == total.tolist(), field


def test_chunks_do_not_show() -> None:
    knowledge = load_knowledge("chapter-shape")
    few = random_evidence(100)
    repeats = CHUNK // 100 + 1
    many = MassFunction(few.frame, few.focal_sets, np.tile(few.masses, (repeats, 1)))
    assert len(many) > CHUNK
    small, large = diagnose(few, knowledge), diagnose(many, knowledge)
    assert large.near_branch.sum() == repeats * small.near_branch.sum() > 0
    for field in ("conducts", "best_of_class", "fires", "decisive", "crossings", "decided"):
        assert getattr(large, field).tolist() == (repeats * getattr(small, field)).tolist()
    np.testing.assert_allclose(large.change, np.tile(small.change, repeats), atol=1e-12)


def test_json_lists_the_worst_inputs_first() -> None:
    found = diagnose(random_evidence(400), load_knowledge("chapter-shape"))
    told = json.loads(json.dumps(found.to_json(worst=5), allow_nan=False))
    assert told["cases"] == 400
    assert len(told["worst"]) == 5
    changes = [w["change"] for w in told["worst"]]
    assert changes == sorted(changes, reverse=True)
    assert changes[0] == pytest.approx(found.change.max())
    assert told["flips"] == found.flips.sum() > 0
    assert [p["prototype"] for p in told["prototypes"]] == ["R_1", "T_1", "T_2", "E_1", "E_2"]
    assert sum(told["decided"].values()) + told["nothing"] == 400


@pytest.mark.parametrize("reading", list(READINGS))
def test_every_reading_can_be_diagnosed(reading: str) -> None:
    found = diagnose(random_evidence(50), load_knowledge("chapter-curvature"), READINGS[reading])
    assert np.isfinite(found.change).all()
    json.dumps(found.to_json(), allow_nan=False)


def test_an_empty_batch_and_what_is_refused() -> None:
    knowledge = load_knowledge("shape")
    nobody = diagnose(random_evidence(0), knowledge)
    assert nobody.cases == nobody.nothing == 0
    assert nobody.to_json()["worst"] == []
    for near in (0.0, 1.0, -0.1, float("nan")):
        with pytest.raises(KnowledgeError, match="near"):
            diagnose(random_evidence(1), knowledge, near=near)
    with pytest.raises(FrameError, match="'octagon'"):
        diagnose(MassFunction.vacuous(Frame(["octagon"])), knowledge)
