"""Learned prototypes: what they are, that they conduct held-out cases, and what training refuses."""

import doctest
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evifuse.belief import Frame, MassFunction
from evifuse.belief.mass import Layout
from evifuse.conductivity import (
    READINGS,
    TRAINED_READINGS,
    KnowledgeBase,
    Reading,
    classify,
    divergence,
    inner_entropy,
    train,
    train_report,
)
from evifuse.conductivity.clusters import centre, clustered, divergences, meet
from evifuse.conductivity.rehearse import EQUAL, folds_of, probabilities
from evifuse.errors import InputError, MassError

FRAME = Frame(["round", "flat", "long"])
SETS = ["round", "flat", "long", ("round", "flat"), FRAME]
LAYERS = TRAINED_READINGS["layers-32"]


def leaning(where: list[int], seed: int = 0, firm: float = 8.0, zeros: bool = False) -> MassFunction:
    """Evidence that leans to one focal set in each case."""
    rng = np.random.default_rng(seed)
    lean = np.full((len(where), len(SETS)), 0.7)
    lean[np.arange(len(where)), where] += firm
    masses = np.stack([rng.dirichlet(row) for row in lean])
    if zeros:
        masses[rng.random(masses.shape) < 0.3] = 0.0
        masses[:, -1] += 0.05
    return MassFunction(FRAME, SETS, masses / masses.sum(axis=1, keepdims=True))


def same(a: KnowledgeBase, b: KnowledgeBase) -> bool:
    return (
        a.classes == b.classes
        and a.reading == b.reading
        and all(x.prototypes == y.prototypes for x, y in zip(a.aggregates, b.aggregates, strict=True))
    )


@pytest.mark.parametrize(
    "reading",
    [
        READINGS["sound"],
        READINGS["working"],
        LAYERS,
        Reading(ties="first", divergence="printed"),
        Reading(log_base=2.0, ties="first", similarity_offset=1.0),
    ],
)
@given(st.integers(0, 2**32 - 1))
@settings(max_examples=15, deadline=None)
def test_divergences_of_clusters_are_those_of_the_appendix(reading: Reading, seed: int) -> None:
    rng = np.random.default_rng(seed)
    y = leaning(rng.integers(0, 5, 12).tolist(), seed, zeros=True)
    met = meet(y, reading)
    prototypes = rng.dirichlet(np.ones(len(met.focal_sets)), 3) * 0.99 + 0.01 / len(met.focal_sets)
    found = divergences(met, prototypes)
    rows = np.sort(rng.permutation(12)[:7])
    np.testing.assert_allclose(divergences(met.take(rows), prototypes), found[rows], atol=1e-12)
    for i in range(12):
        there = met.masses[i] > 0
        case = MassFunction(FRAME, met.focal_sets[there], met.masses[i][there])
        assert met.inner[i] == pytest.approx(float(inner_entropy(case, reading)), abs=1e-12)
        for j, x in enumerate(prototypes):
            expected = float(divergence(case, MassFunction(FRAME, met.focal_sets, x), reading))
            assert found[i, j] == pytest.approx(expected, abs=1e-9)


@given(st.integers(1, 40), st.integers(1, 8), st.integers(0, 2**32 - 1))
@settings(max_examples=50, deadline=None)
def test_a_centre_is_the_mean_with_a_residual(cases: int, sets: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    masses = rng.dirichlet(np.full(sets, 0.3), cases)
    weights = rng.random(cases)
    x = centre(masses, weights)
    assert x.sum() == pytest.approx(1.0, abs=1e-12)
    assert (x > 0).all()
    np.testing.assert_array_equal(x, np.round(x, 4))
    residual = np.zeros(sets)
    residual[-1] = 1.0
    exact = (weights @ masses + residual) / (weights.sum() + 1.0)
    np.testing.assert_allclose(x, exact, atol=0.005 * sets + 1e-4)


def test_few_cases_commit_to_less() -> None:
    case = leaning([0])
    seen = [train(case[[0] * n], ["ball"] * n, reading=READINGS["sound"]) for n in (1, 3, 30)]
    frame_mass = [
        float(b.aggregates[0].prototypes["ball_1"].where(case.focal_sets == FRAME.full)) for b in seen
    ]
    assert frame_mass[0] > frame_mass[1] > frame_mass[2]
    own = float(case.masses[0, -1])
    assert frame_mass[2] == pytest.approx((30 * own + 1) / 31, abs=0.02)


def test_clusters_are_found_and_no_case_is_nearer_to_another() -> None:
    y = leaning([0] * 20 + [1] * 12 + [2] * 6, firm=30.0)
    met = meet(y, LAYERS)
    found = clustered(met, 3, np.random.default_rng(0))
    assert len(found) == 3
    assert found[:, :3].argmax(axis=1).tolist() == [0, 1, 2]  # from the most cases to the fewest
    owner = divergences(met, found).argmin(axis=1)
    assert owner.tolist() == [0] * 20 + [1] * 12 + [2] * 6
    for i in range(3):
        np.testing.assert_array_equal(centre(met.masses[owner == i], met.weights[owner == i]), found[i])


def test_identical_cases_are_one_cluster() -> None:
    y = leaning([0])[[0] * 9]
    assert len(clustered(meet(y, LAYERS), 3, np.random.default_rng(0))) == 1


def test_two_kinds_in_a_class_get_two_prototypes_when_that_helps() -> None:
    where = [0] * 20 + [2] * 20 + [1] * 30  # a ball is round or long, a tile flat
    report = train_report(leaning(where, firm=12.0), ["ball"] * 40 + ["tile"] * 30, max_prototypes=3)
    ball, tile = report.knowledge.aggregates
    assert len(ball.prototypes) >= 2
    assert len(tile.prototypes) == 1
    chosen = [t for t in report.trials if t.chosen]
    assert len(chosen) == 1
    assert chosen[0].log_loss <= min(t.log_loss for t in report.trials) + EQUAL
    assert chosen[0].prototypes == (len(ball.prototypes), len(tile.prototypes))
    one = [t for t in report.trials if t.reading == chosen[0].reading and t.prototypes == (1, 1)]
    assert chosen[0].log_loss < one[0].log_loss
    assert report.cases == {"ball": 40, "tile": 30}


def test_held_out_cases_are_recognised() -> None:
    where = [0, 1, 2] * 30
    labels = [["ball", "tile", "rod"][k] for k in where]
    base = train(leaning(where, seed=1), labels)
    found = classify(leaning(where, seed=2), base)
    right = np.array([base.classes[i] for i in found.decisions]) == np.array(labels)
    assert right.mean() > 0.9


def test_figures_of_a_trial_are_what_classify_gives_the_held_out_cases() -> None:
    where = [0, 1] * 8 + [0]
    y, labels = leaning(where, firm=2.0), np.array(["ab"[k] for k in where])
    for name in ("smooth", "layers-64", "firm-8", "sound"):
        reading = TRAINED_READINGS[name]
        report = train_report(y, labels, reading={name: reading}, max_prototypes=1, seed=4)
        codes = (labels == "b").astype(int)
        fold_of = folds_of(codes, 5, 4)
        losses = []
        for fold in range(5):
            out = fold_of == fold
            base = train(y[~out], labels[~out], reading=reading, max_prototypes=1, seed=4)
            found = classify(y[out], base)
            p = found.belief.masses[:, :2] + found.belief.masses[:, 2:] / 2
            losses += (-np.log(0.999 * p[np.arange(out.sum()), codes[out]] + 0.0005)).tolist()
        assert report.trials[0].log_loss == pytest.approx(np.mean(losses), abs=1e-9)


@given(st.integers(0, 2**32 - 1), st.integers(1, 3))
@settings(max_examples=8, deadline=None)
def test_the_same_seed_gives_the_same_knowledge_in_any_layout(seed: int, most: int) -> None:
    rng = np.random.default_rng(seed)
    where = rng.integers(0, 3, 14).tolist()
    y = leaning(where, seed % 1000, zeros=True)
    labels = rng.integers(0, 2, 14).tolist()
    reading = {"a": LAYERS, "b": READINGS["sound"]}
    base = train(y, labels, reading=reading, max_prototypes=most, seed=3)
    assert same(train(y, labels, reading=reading, max_prototypes=most, seed=3), base)
    layout: Layout
    for layout in ("padded", "dense"):
        other = train(y.to(layout), labels, reading=reading, max_prototypes=most, seed=3)
        assert same(other, base)


def test_labels_of_any_kind() -> None:
    y = leaning([0, 1] * 6)
    for labels in (
        [1, 2] * 6,
        [10, 9] * 6,
        np.array([True, False] * 6),
        [("a", 1), ("b", 2)] * 6,
        ["x", 2] * 6,
    ):
        base = train(y, labels, reading=LAYERS)
        assert set(base.classes) == {
            str(label) for label in np.asarray(labels, dtype=object).ravel()
        } or isinstance(labels[0], tuple)
    assert train(y, [10, 9] * 6, reading=LAYERS).classes == ("9", "10")


def test_one_case_of_a_class_one_class_and_ignorance() -> None:
    y = leaning([0, 0, 0, 1])
    lonely = train_report(y, ["a", "a", "a", "b"], reading=LAYERS)
    assert [len(x.prototypes) for x in lonely.knowledge.aggregates] == [1, 1]
    assert train_report(y[[0, 3]], ["a", "b"]).trials == ()
    assert train_report(y, ["a"] * 4).knowledge.classes == ("a",)
    nothing = MassFunction.vacuous(FRAME, (6,))
    for reading in (LAYERS, READINGS["sound"]):
        base = train(nothing, ["a", "b"] * 3, reading=reading)
        assert all(x.as_dict() == {"frame": 1.0} for a in base.aggregates for x in a.prototypes.values())
        assert np.isfinite(classify(nothing, base).conductivities).all()
    some = MassFunction(FRAME, SETS, np.concatenate([y.masses, np.eye(5)[[4, 4]]]))
    with_ignorance = train(some, ["a", "a", "a", "b", "a", "b"], reading=LAYERS)
    without = train(y, ["a", "a", "a", "b"], reading=LAYERS)
    assert same(replace(with_ignorance, source=""), replace(without, source=""))  # ignorance teaches nothing


@given(st.lists(st.integers(0, 3), min_size=1, max_size=40), st.integers(2, 5), st.integers(0, 99))
def test_folds_are_stratified_and_learn_from_every_class(codes: list[int], count: int, seed: int) -> None:
    of = np.array(codes)
    folds = folds_of(of, count, seed)
    for k in set(codes):
        mine = folds[of == k]
        if len(mine) == 1:
            assert mine[0] == -1
            continue
        sizes = np.bincount(mine, minlength=count)
        assert sizes.max() - sizes.min() <= 1
        assert sizes.max() < len(mine)


@given(st.integers(0, 2**32 - 1))
def test_probabilities_share_what_is_not_known(seed: int) -> None:
    rng = np.random.default_rng(seed)
    sigma, known = rng.random((5, 3)), rng.random(5)
    sigma[0] = 0.0
    p = probabilities(sigma, known)
    np.testing.assert_allclose(p.sum(axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(p[0], 1 / 3)
    np.testing.assert_allclose(p[1], known[1] * sigma[1] / sigma[1].sum() + (1 - known[1]) / 3)


@pytest.mark.parametrize(
    ("evidence", "labels", "options", "error", "says"),
    [
        (leaning([0, 1]), ["a"], {}, InputError, "2 cases of evidence need as many labels, not 1"),
        (leaning([0, 1])[:0], [], {}, InputError, "no cases"),
        (leaning([0]), "a", {"max_prototypes": 0}, InputError, "1 or more, not 0"),
        (leaning([0])[0], ["a"], {}, MassError, "batch shape"),
        (leaning([0, 1]), ["a", None], {}, InputError, "case 1: None is not a label"),
        (leaning([0, 1]), ["a", float("nan")], {}, InputError, "case 1: nan is not a label"),
        (leaning([0, 1]), ["a", " "], {}, InputError, "case 1: ' ' is not a label"),
        (leaning([0, 1]), [1, "1"], {}, InputError, "same text '1'"),
        (
            MassFunction(FRAME, [(), "round"], [[0.5, 0.5]], open_world=True),
            ["a"],
            {},
            MassError,
            "empty set",
        ),
    ],
)
def test_refusals(
    evidence: MassFunction, labels: list[object], options: dict[str, int], error: type[Exception], says: str
) -> None:
    with pytest.raises(error) as caught:
        train(evidence, labels, **options)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_trained_readings_have_names_of_their_own() -> None:
    assert len(set(TRAINED_READINGS.values())) == len(TRAINED_READINGS)


def test_the_guide_says_what_happens() -> None:
    guide = Path(__file__).parents[2] / "docs" / "training.md"
    found = doctest.testfile(str(guide), module_relative=False)
    assert found.attempted >= 10
    assert found.failed == 0


def _felt(rng: np.random.Generator, count: int) -> tuple[MassFunction, list[str]]:
    """Evidence of a sensor: flat things show one set, bent ones one of three others, with crumbs."""
    frame = Frame(["flat", "dome", "bowl", "saddle"])
    labels, rows = [], []
    for i in range(count):
        masses = rng.uniform(0, 0.02, 4)
        masses[0 if i % 2 else 1 + rng.integers(3)] = rng.uniform(0.5, 0.9)
        labels.append("plate" if i % 2 else "body")
        rows.append([*masses.tolist(), 1.0 - masses.sum()])
    return MassFunction(frame, [*frame.hypotheses, frame], rows), labels


def test_kinds_of_evidence_become_prototypes_where_a_mean_resembles_none() -> None:
    seen, labels = _felt(np.random.default_rng(0), 120)
    base = train(seen, labels, reading=READINGS["working"], max_prototypes=4)
    body, plate = base.aggregates
    leaders = {
        max(x.as_dict(), key=lambda s: x.as_dict()[s] * (s != "frame")) for x in body.prototypes.values()
    }
    assert leaders == {"dome", "bowl", "saddle"}
    assert len(plate.prototypes) == 1
    assert all(
        (x.masses > 0).all() and len(x.focal_sets) == 2
        for a in base.aggregates
        for x in a.prototypes.values()
    )
    fresh, truth = _felt(np.random.default_rng(1), 200)
    found = classify(fresh, base)
    right = np.array(base.classes)[found.decisions] == np.array(truth)
    assert right.mean() > 0.95


def test_the_best_choice_of_readings_can_be_one_of_kinds() -> None:
    seen, labels = _felt(np.random.default_rng(2), 80)
    report = train_report(seen, labels, max_prototypes=4)
    tried = {t.reading.rsplit("-", 1)[0] for t in report.trials}
    assert {"layers", "firm", "kinds", "firm-kinds"} <= tried
    fresh, truth = _felt(np.random.default_rng(3), 200)
    right = np.array(report.knowledge.classes)[classify(fresh, report.knowledge).decisions] == np.array(truth)
    assert right.mean() > 0.9


def test_folds_hold_whole_groups_out() -> None:
    rng = np.random.default_rng(0)
    codes = rng.integers(0, 2, 60)
    groups = rng.integers(0, 7, 60)
    folds = folds_of(codes, 5, 0, groups)
    assert set(folds) == set(range(5))
    assert all(len(set(folds[groups == g])) == 1 for g in range(7))
    only = folds_of(np.array([0, 0, 1, 1, 0]), 5, 0, np.array([0, 0, 1, 1, 1]))
    assert only[[2, 3]].tolist() == [-1, -1]


def test_groups_are_kept_apart_where_copies_would_deceive() -> None:
    """Ten copies of every case: parted at random, the copies give the answer."""
    rng = np.random.default_rng(5)
    frame = Frame(["a", "b", "c"])
    own = rng.dirichlet([1.0, 1.0, 1.0, 1.0], 20)
    seen = MassFunction(frame, ["a", "b", "c", frame], np.repeat(own, 10, axis=0))
    labels = np.repeat(["x", "y"] * 10, 10)
    people = np.repeat(np.arange(10), 20)
    parted = train_report(seen, labels, reading={"one": TRAINED_READINGS["layers-64"]}, max_prototypes=6)
    apart = train_report(
        seen, labels, reading={"one": TRAINED_READINGS["layers-64"]}, max_prototypes=6, groups=people
    )
    best = {name: min(t.log_loss for t in r.trials) for name, r in {"parted": parted, "apart": apart}.items()}
    assert best["apart"] > best["parted"]
    with pytest.raises(InputError, match="as many groups"):
        train(seen, labels, groups=people[:-1])
