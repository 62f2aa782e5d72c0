"""Grids of readings, the published figures under them, and choosing a reading without peeking."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evifuse.belief import Frame, MassFunction
from evifuse.conductivity import READINGS, Reading, classify
from evifuse.conductivity.choose import Choice, choose_reading, halves, shortlist
from evifuse.conductivity.sweep import (
    OUR_CHOICES,
    PRINT_CHOICES,
    Example,
    differences,
    grid,
    same_order,
    single_changes,
    try_reading,
)
from evifuse.errors import FrameError, KnowledgeError
from evifuse.knowledge import load_knowledge

KNOWLEDGE = load_knowledge("shape")
SHAPE = KNOWLEDGE.frame
HOMES = {
    "rectangular": ("rectangle", "square"),
    "triangular": ("triangle",),
    "elliptical": ("ellipse", "circle", "bracket"),
}


def labelled(count: int, seed: int = 0) -> tuple[MassFunction, list[str]]:
    """Evidence that leans to a primitive of its class, more or less."""
    rng = np.random.default_rng(seed)
    labels = [list(HOMES)[i % 3] for i in range(count)]
    masses = np.zeros((count, 4))
    for i, label in enumerate(labels):
        lean = np.array([0.5, 0.5, 0.5, 1.5])
        lean[list(HOMES).index(label)] = 2.0
        masses[i] = rng.dirichlet(lean)
    return MassFunction(SHAPE, ["rectangle", "triangle", "ellipse", SHAPE], masses), labels


def example(published: dict[str, float]) -> Example:
    evidence = MassFunction.of(SHAPE, {"rectangle": 0.19, "square": 0.10, "triangle": 0.20, SHAPE: 0.51})
    return Example("made", evidence, load_knowledge("chapter-shape"), published)


def test_grids_hold_every_combination_once() -> None:
    printed = grid(PRINT_CHOICES)
    assert len(printed) == np.prod([len(v) for v in PRINT_CHOICES.values()]) == len(set(printed))
    for name, values in PRINT_CHOICES.items():
        for value in values:
            share = sum(getattr(r, name) == value for r in printed) / len(printed)
            assert share == pytest.approx(1 / len(values)), (name, value)
    assert READINGS["sound"] in printed
    ours = grid(OUR_CHOICES)
    assert len(ours) == len(set(ours))
    assert READINGS["sound"] in ours


@given(st.data())
def test_what_a_grid_leaves_out_makes_no_difference(data: st.DataObject) -> None:
    choices = {**OUR_CHOICES, "log_base": (None, 2.0)}
    wanted = {name: data.draw(st.sampled_from(values), label=name) for name, values in choices.items()}
    kept = grid({name: (value,) for name, value in wanted.items()})
    assert len(kept) == 1
    evidence, _ = labelled(5, seed=data.draw(st.integers(0, 99)))
    for name in ("chapter-shape", "shape"):
        knowledge = load_knowledge(name)
        full = classify(evidence, knowledge, Reading(**wanted)).conductivities
        np.testing.assert_allclose(
            classify(evidence, knowledge, kept[0]).conductivities, full, rtol=1e-9, atol=1e-12
        )


def test_single_changes_differ_from_the_sound_reading_in_one_choice() -> None:
    changed = single_changes(PRINT_CHOICES)
    assert changed[0] == READINGS["sound"]
    assert len(changed) == 1 + sum(len(v) - 1 for v in PRINT_CHOICES.values())
    assert all(differences(r).count("=") == 1 for r in changed[1:])


def test_a_reading_is_described_by_what_differs() -> None:
    assert differences(Reading()) == "sound"
    assert differences(Reading(pooling="max", projection=False)) == "projection=False, pooling=max"
    assert differences(Reading(), Reading(ties="first")) == "ties=mean"
    rebuilt = [r for r in grid(OUR_CHOICES) if differences(r) == "smoothing=0.05, sharpness=2.0"]
    assert rebuilt == [Reading(smoothing=0.05, sharpness=2.0)]


@pytest.mark.parametrize(
    ("published", "computed", "same"),
    [
        ([2, 1, 0], [9, 5, 1], True),
        ([2, 1, 0], [9, 1, 5], False),
        ([1, 0, 0], [3, 1, 2], True),
        ([1, 0, 0], [2, 2, 1], False),
        ([1, 1], [1, 5], True),
        ([1, 0], [np.nan, 0], False),
        ([1, 0], [np.inf, 0], False),
    ],
)
def test_same_order(published: list[float], computed: list[float], same: bool) -> None:
    assert same_order(published, computed) is same


def test_the_gap_is_the_largest_one_and_every_example_must_be_ranked() -> None:
    exact = example({"rectangular": 0.0, "triangular": 0.0})
    found = try_reading(READINGS["sound"], [exact])
    truth = classify(exact.evidence, exact.knowledge).conductivity
    assert found.computed == pytest.approx((truth["rectangular"], truth["triangular"]))
    assert found.gap == pytest.approx(truth["triangular"])
    assert found.ranked
    right = example({"triangular": 1.5, "rectangular": 0.9})
    wrong = example({"triangular": 0.9, "rectangular": 1.5})
    assert try_reading(Reading(), [right]).ranked
    assert not try_reading(Reading(), [right, wrong]).ranked
    assert not try_reading(Reading(), [wrong, right]).ranked
    assert try_reading(Reading(), [right, wrong]).gap == pytest.approx(
        max(try_reading(Reading(), [right]).gap, try_reading(Reading(), [wrong]).gap)
    )


def test_undefined_figures_are_infinitely_far_off() -> None:
    """Disjoint sets without a common attribute are infinitely far apart within a prototype."""
    knowledge = load_knowledge("chapter-shape")
    evidence = MassFunction.of(SHAPE, {"triangle": 0.4, "ellipse": 0.6})
    reading = Reading(similarity_offset=0.0, divergence="printed", projection=False)
    found = try_reading(reading, [Example("bad", evidence, knowledge, {"elliptical": 1.0})])
    assert found.gap == np.inf
    assert np.isnan(found.computed[0])
    assert not found.ranked


@given(st.lists(st.integers(0, 3), min_size=2, max_size=60), st.integers(0, 9))
def test_halves_share_every_class(truth: list[int], seed: int) -> None:
    classes = np.array(truth)
    first, second = halves(classes, seed)
    assert sorted([*first, *second]) == list(range(len(truth)))
    assert 0 <= len(first) - len(second) <= 1
    for k in set(truth):
        assert abs(np.sum(classes[first] == k) - np.sum(classes[second] == k)) <= 1
    again = halves(classes, seed)
    assert (again[0] == first).all()


@given(st.lists(st.sampled_from("abcdefg"), min_size=2, max_size=60), st.integers(0, 9))
def test_a_group_is_not_parted(groups: list[str], seed: int) -> None:
    truth = np.arange(len(groups)) % 3
    if len(set(groups)) == 1:
        with pytest.raises(KnowledgeError, match="can't be split"):
            halves(truth, seed, groups)
        return
    first, second = halves(truth, seed, groups)
    assert sorted([*first, *second]) == list(range(len(groups)))
    assert len(first)
    assert len(second)
    if len(set(groups)) < len(groups):
        assert not {groups[i] for i in first} & {groups[i] for i in second}
        assert abs(len(first) - len(second)) <= max(groups.count(g) for g in groups)


def choose(count: int = 90, **options: object) -> Choice:
    evidence, labels = labelled(count)
    return choose_reading(evidence, labels, KNOWLEDGE, READINGS, **options)  # type: ignore[arg-type]


def test_accuracy_is_counted_by_hand_on_the_other_half() -> None:
    evidence, labels = labelled(91)
    found = choose_reading(evidence, labels, KNOWLEDGE, READINGS, seed=4)
    truth = np.array([KNOWLEDGE.classes.index(label) for label in labels])
    first, second = halves(truth, 4)
    assert (found.choosing, found.held_out) == (len(first), len(second)) == (46, 45)
    for judged in found.judged:
        with np.errstate(all="ignore"):
            c = classify(evidence, KNOWLEDGE, judged.reading)
        right = c.decisions == truth
        assert judged.chosen_on == pytest.approx(right[first].mean())
        assert judged.accuracy == pytest.approx(right[second].mean())
        assert judged.undecided == pytest.approx(np.mean(c.decisions[second] < 0))
        assert judged.low <= judged.accuracy <= judged.high
        assert judged.high - judged.low < 0.35
        assert 0 <= judged.brier <= 2
    assert found.best.chosen_on == max(j.chosen_on for j in found.judged)
    assert found.best.name == "working"
    assert found.commonest == pytest.approx(1 / 3)


def test_brier_score_of_the_pignistic_probabilities() -> None:
    evidence, labels = labelled(40)
    found = choose_reading(evidence, labels, KNOWLEDGE, {"own": KNOWLEDGE.reading})
    truth = np.array([KNOWLEDGE.classes.index(label) for label in labels])
    belief = classify(evidence, KNOWLEDGE).belief.masses
    p = belief[:, :3] + belief[:, 3:] / 3
    _, second = halves(truth, 0)
    assert found.best.brier == pytest.approx(((p - np.eye(3)[truth]) ** 2).sum(axis=1)[second].mean())


def test_held_out_labels_have_no_part_in_choosing() -> None:
    evidence, labels = labelled(90)
    truth = np.array([KNOWLEDGE.classes.index(label) for label in labels])
    _, second = halves(truth, 0)
    readings = {str(i): r for i, r in enumerate(single_changes(OUR_CHOICES))}
    before = choose_reading(evidence, labels, KNOWLEDGE, readings)
    listed = shortlist(evidence, labels, KNOWLEDGE, readings, keep=4)
    spoilt = evidence.masses.copy()
    spoilt[second] = [0.0, 0.0, 0.0, 1.0]
    other = MassFunction(SHAPE, evidence.focal_sets.tolist(), spoilt)
    after = choose_reading(other, labels, KNOWLEDGE, readings)
    assert after.best.name == before.best.name
    assert [j.chosen_on for j in after.judged] == [j.chosen_on for j in before.judged]
    assert [j.accuracy for j in after.judged] != [j.accuracy for j in before.judged]
    assert shortlist(other, labels, KNOWLEDGE, readings, keep=4) == listed
    assert len(listed) == 4


def test_the_shortlist_keeps_the_best() -> None:
    evidence, labels = labelled(200)
    readings = {**READINGS, "blunt": Reading(projection=False)}
    listed = shortlist(evidence, labels, KNOWLEDGE, readings, keep=2)
    assert next(iter(listed)) == "working"
    assert "printed" not in listed


def test_the_same_seed_gives_the_same_figures() -> None:
    assert choose(seed=1) == choose(seed=1)
    assert choose(seed=1) != choose(seed=2)


def test_progress_sees_every_reading_once() -> None:
    seen: list[str] = []

    def watch(names):  # type: ignore[no-untyped-def]
        for name in names:
            seen.append(name)
            yield name

    choose(progress=watch)
    assert seen == list(READINGS)


def test_labels_that_do_not_fit_are_refused() -> None:
    evidence, labels = labelled(9)
    with pytest.raises(KnowledgeError, match="as many cases"):
        choose_reading(evidence, labels[:-1], KNOWLEDGE, READINGS)
    with pytest.raises(KnowledgeError, match="'round' is not a class"):
        choose_reading(evidence, [*labels[:-1], "round"], KNOWLEDGE, READINGS)
    with pytest.raises(KnowledgeError, match="4 at least"):
        choose_reading(evidence[:3], labels[:3], KNOWLEDGE, READINGS)
    nothing = MassFunction.vacuous(Frame(["octagon"]), (9,))
    with pytest.raises(FrameError, match="'octagon'"):
        choose_reading(nothing, labels, KNOWLEDGE, READINGS)
