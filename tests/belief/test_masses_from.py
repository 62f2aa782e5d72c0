import doctest
import itertools
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evifuse.belief import Frame, MassFunction, belief, dempster, discount, pignistic, plausibility
from evifuse.belief.correct import contour
from evifuse.belief.intervals import from_intervals
from evifuse.belief.logistic import from_logistic_regression, from_logits
from evifuse.belief.masses_from import (
    consonant_from_probabilities,
    from_counts,
    from_likelihoods,
    from_probabilities,
    from_samples,
)
from evifuse.errors import FrameError, MassError
from tests.belief.strategies import dense

FRAME = Frame(["cat", "dog", "fox"])
seeds = st.integers(0, 2**32 - 1)
sizes = st.integers(1, 6)


def _frame(count: int) -> Frame:
    return Frame([f"h{i}" for i in range(count)])


def _probabilities(count: int, seed: int) -> np.ndarray:
    p = np.random.default_rng(seed).dirichlet(np.full(count, 0.5), size=(2, 3))
    p[0, 0] = np.eye(count)[0]
    p[0, 1] = 1 / count
    return p


def _valid(m: MassFunction, batch: tuple[int, ...] = (2, 3)) -> None:
    """The result would pass the door."""
    assert m.batch == batch
    MassFunction(m.frame, m.focal_sets, m.masses)


@given(sizes, seeds, st.floats(0, 1))
def test_probabilities_with_a_reliability_are_discounted_bayesian_masses(
    count: int, seed: int, trust: float
) -> None:
    frame, p = _frame(count), _probabilities(count, seed)
    m = from_probabilities(frame, p, reliability=trust)
    _valid(m)
    assert m.layout == "singletons"
    bayes = MassFunction(frame, [1 << k for k in range(count)], p)
    np.testing.assert_allclose(dense(m), dense(discount(bayes, reliability=trust)), atol=1e-12)
    np.testing.assert_allclose(pignistic(m), trust * p + (1 - trust) / count, atol=1e-12)
    np.testing.assert_allclose(dense(from_probabilities(frame, p)), dense(bayes), atol=1e-12)


def test_accuracies_come_from_a_confusion_matrix() -> None:
    table = [[8, 0, 0], [2, 5, 0], [0, 5, 0]]  # says cat rightly 8 of 10 times, dog 5 of 10, never fox
    p = [[1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.0, 0.0, 1.0]]
    m = from_probabilities(FRAME, p, confusion=table)
    np.testing.assert_allclose(m.masses, [[0.8, 0, 0, 0.2], [0.4, 0.25, 0, 0.35], [0, 0, 0, 1]])
    same = from_probabilities(FRAME, p, accuracies=[0.8, 0.5, 0.0])
    np.testing.assert_allclose(m.masses, same.masses)
    each = from_probabilities(FRAME, p, reliability=[1.0, 0.5, 0.25])
    np.testing.assert_allclose(each.masses[:, -1], [0, 0.5, 0.75])


def test_single_precision_probabilities_are_taken_and_wrong_ones_refused() -> None:
    rng = np.random.default_rng(3)
    p = rng.dirichlet(np.ones(3), size=500).astype(np.float32)
    _valid(from_probabilities(FRAME, p), (500,))
    _valid(consonant_from_probabilities(FRAME, p), (500,))
    with pytest.raises(MassError, match=r"probabilities at index \(0,\) sum to 0.9999"):
        from_probabilities(FRAME, [[0.4, 0.5, 0.09999]])


@given(sizes, seeds)
def test_consonant_masses_bet_as_the_probabilities_and_claim_least(count: int, seed: int) -> None:
    frame, p = _frame(count), _probabilities(count, seed)
    m = consonant_from_probabilities(frame, p)
    _valid(m)
    np.testing.assert_allclose(pignistic(m), p, atol=1e-12)
    bayes = from_probabilities(frame, p)
    for s in range(1, frame.full + 1):
        assert np.all(plausibility(m, s) >= plausibility(bayes, s) - 1e-12)
    _nested(m)
    alone = consonant_from_probabilities(frame, p[1, 2])
    np.testing.assert_allclose(dense(alone), dense(m)[1, 2], atol=1e-15)
    assert np.all(alone.masses > 0)
    half = consonant_from_probabilities(frame, p, reliability=0.5)
    np.testing.assert_allclose(dense(half), dense(discount(m, reliability=0.5)), atol=1e-12)


def _nested(m: MassFunction) -> None:
    sets = np.broadcast_to(m.focal_sets, m.masses.shape)
    for where in np.ndindex(m.batch):
        focal = [int(s) for s, v in zip(sets[where], m.masses[where], strict=True) if v > 0]
        assert all(a & b in (a, b) for a, b in itertools.combinations(focal, 2))


@given(sizes, seeds)
def test_plausibilities_from_likelihoods_are_relative_likelihoods(count: int, seed: int) -> None:
    frame = _frame(count)
    likelihoods = np.random.default_rng(seed).exponential(size=(2, 3, count)) ** 3
    likelihoods[0, 0, 1:] = 0
    m = from_likelihoods(frame, likelihoods)
    _valid(m)
    _nested(m)
    expected = likelihoods / likelihoods.max(axis=-1, keepdims=True)
    np.testing.assert_allclose(contour(m), expected, atol=1e-12)
    with np.errstate(divide="ignore"):
        logs = np.log(likelihoods) - 5000  # far below the smallest number
    by_logs = from_likelihoods(frame, logs, logarithms=True)
    np.testing.assert_allclose(contour(by_logs), expected, atol=1e-9)


def test_two_independent_likelihoods_multiply_for_the_likelier_of_two() -> None:
    frame = Frame(["cat", "dog"])
    a, b = [0.5, 0.25], [0.125, 1.0]
    both = dempster(from_likelihoods(frame, a), from_likelihoods(frame, b)).mass
    pl = contour(both)
    assert pl[1] / pl[0] == pytest.approx(0.25 * 1.0 / (0.5 * 0.125))


@given(sizes, seeds, st.floats(0.1, 5))
def test_counts_bound_the_next_observation(count: int, seed: int, unseen: float) -> None:
    frame = _frame(count)
    n = np.random.default_rng(seed).integers(0, 20, size=(2, 3, count))
    m = from_counts(frame, n, unseen=unseen)
    _valid(m)
    total = n.sum(axis=-1)
    for k in range(count):
        if count > 1:
            np.testing.assert_allclose(belief(m, 1 << k), n[..., k] / (total + unseen), atol=1e-12)
            np.testing.assert_allclose(
                plausibility(m, 1 << k), (n[..., k] + unseen) / (total + unseen), atol=1e-12
            )
    np.testing.assert_allclose(dense(from_counts(frame, np.zeros(count))), dense(MassFunction.vacuous(frame)))


def test_samples_are_counted_by_name() -> None:
    names = np.array([["cat", "cat", "fox"], ["dog", "dog", "dog"]])
    m = from_samples(FRAME, names, unseen=1)
    np.testing.assert_allclose(m.masses, from_counts(FRAME, [[2, 0, 1], [0, 3, 0]], unseen=1).masses)
    assert from_samples(FRAME, []) == MassFunction.vacuous(FRAME)
    assert from_samples(FRAME, (n for n in ["cat", "dog"])).as_dict() == {
        "frame": 0.5,
        "cat": 0.25,
        "dog": 0.25,
    }
    with pytest.raises(FrameError, match="unknown hypothesis 'cow'"):
        from_samples(FRAME, ["cat", "cow"])
    with pytest.raises(MassError, match="not the one string 'cat'"):
        from_samples(FRAME, "cat")
    with pytest.raises(MassError, match="must be a list of names"):
        from_samples(FRAME, np.array("cat"))


@given(st.integers(1, 5), seeds, st.floats(0.3, 4))
def test_logits_are_evidence_combined_by_dempsters_rule(count: int, seed: int, temperature: float) -> None:
    frame = _frame(count)
    logits = np.random.default_rng(seed).normal(size=(2, 3, count)) * 2
    m = from_logits(frame, logits, temperature=temperature)
    _valid(m)
    weights = logits / temperature
    weights = weights - weights.mean(axis=-1, keepdims=True)
    np.testing.assert_allclose(dense(m), _by_rule(frame, weights[..., None]), atol=1e-12)
    pl = contour(m)
    soft = np.exp(weights) / np.exp(weights).sum(axis=-1, keepdims=True)
    np.testing.assert_allclose(pl / pl.sum(axis=-1, keepdims=True), soft, atol=1e-12)


def _by_rule(frame: Frame, weights: np.ndarray) -> np.ndarray:
    """Simple mass functions for each weight (..., K, J), one after the other."""
    joint = MassFunction.vacuous(frame, weights.shape[:-2])
    for k, j in np.ndindex(weights.shape[-2:]):
        w = weights[..., k, j]
        keep = np.exp(-np.abs(w))
        for about, right in ((1 << k, w > 0), (frame.full & ~(1 << k), w < 0)):
            if about and about != frame.full:
                share = np.where(right, 1 - keep, 0.0)
                simple = MassFunction(frame, [about, frame], np.stack([share, 1 - share], axis=-1))
                joint = dempster(joint, simple).mass
    return dense(joint)


@given(st.integers(2, 4), st.integers(1, 3), seeds)
def test_every_feature_of_a_logistic_regression_is_evidence(count: int, features: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    frame, x = _frame(count), rng.normal(size=(2, 3, features))
    b, b0, mean = rng.normal(size=(count, features)), rng.normal(size=count), rng.normal(size=features)
    m = from_logistic_regression(frame, x, b, b0, feature_means=mean)
    _valid(m)
    c, c0 = b - b.mean(axis=0), b0 - b0.mean()
    alpha = np.array(
        [
            [
                (c0[k] + sum(c[k, q] * mean[q] for q in range(features))) / features - c[k, j] * mean[j]
                for j in range(features)
            ]
            for k in range(count)
        ]
    )
    np.testing.assert_allclose(dense(m), _by_rule(frame, x[..., None, :] * c + alpha), atol=1e-10)
    pl, logits = contour(m), x @ b.T + b0
    soft = np.exp(logits) / np.exp(logits).sum(axis=-1, keepdims=True)
    np.testing.assert_allclose(pl / pl.sum(axis=-1, keepdims=True), soft, atol=1e-10)


def test_the_constant_terms_make_the_training_weights_least() -> None:
    rng = np.random.default_rng(1)
    x, b, b0 = rng.normal(size=(50, 2)) + 1, np.array([[1.0, -2.0], [-1.0, 2.0]]), np.array([0.5, -0.5])

    def weights(a: np.ndarray) -> float:
        return float(((x[:, None, :] * b + a) ** 2).sum())

    mean = x.mean(axis=0)
    best = (b0 + b @ mean)[:, None] / 2 - b * mean
    np.testing.assert_allclose(best.sum(axis=1), b0)  # the same logits
    for _ in range(20):
        step = rng.normal(size=(2, 1)) * np.array([[1.0, -1.0]])
        assert weights(best) <= weights(best + step)


def test_conflict_and_ignorance_are_told_apart_by_features_alone() -> None:
    frame, b = Frame(["no", "yes"]), [[3.0, 3.0]]
    clash = from_logistic_regression(frame, [2.0, -2.0], b, [0.0], feature_means=[0.0, 0.0])
    nothing = from_logistic_regression(frame, [0.0, 0.0], b, [0.0], feature_means=[0.0, 0.0])
    assert float(clash.where(clash.focal_sets == frame.full)) < 0.01
    assert nothing == MassFunction.vacuous(frame)
    assert clash.layout == "singletons"


def test_huge_logits_do_not_overflow() -> None:
    m = from_logits(FRAME, [[2000.0, -2000.0, 0.0], [1e-300, 0.0, 0.0], [0.0, 0.0, 0.0]])
    _valid(m, (3,))
    assert float(m.where(m.focal_sets == 1)[0]) == 1.0
    np.testing.assert_allclose(m.where(m.focal_sets == FRAME.full)[1:], 1.0)
    x = from_logistic_regression(
        FRAME, [1.0, -1.0], [[3000.0, 2999.0]] * 2 + [[0, 0]], [0] * 3, feature_means=[0, 0]
    )
    _valid(x, ())


@given(sizes, seeds)
def test_intervals_give_beliefs_below_the_lower_probabilities(count: int, seed: int) -> None:
    frame, rng = _frame(count), np.random.default_rng(seed)
    p = rng.dirichlet(np.ones(count), size=(2, 3))
    low = np.maximum(p - rng.random(p.shape) * 0.4, 0)
    high = np.minimum(p + rng.random(p.shape) * 0.4, 1)
    m = from_intervals(frame, low, high)
    _valid(m)
    for s in range(1, frame.full + 1):
        inside = np.array([s >> k & 1 == 1 for k in range(count)])
        smallest = np.maximum(low[..., inside].sum(-1), 1 - high[..., ~inside].sum(-1))
        assert np.all(belief(m, s) <= _tightest(low, high, inside) + 1e-9)
        if count <= 2:
            np.testing.assert_allclose(belief(m, s), _tightest(low, high, inside), atol=1e-12)
        assert np.all(smallest <= _tightest(low, high, inside) + 1e-12)
    order = rng.permutation(count)
    turned = from_intervals(frame, low[..., order], high[..., order])
    for k in range(count):
        np.testing.assert_allclose(belief(turned, 1 << k), belief(m, 1 << int(order[k])), atol=1e-9)


def _tightest(low: np.ndarray, high: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Smallest probability of a set, by moving as much as may be out of it."""
    free = 1 - low.sum(-1)
    room = np.where(inside, 0, high - low).sum(-1)
    return low[..., inside].sum(-1) + np.maximum(free - room, 0)


def test_intervals_that_are_beliefs_come_back() -> None:
    m = MassFunction.of(FRAME, {"cat": 0.25, "dog": 0.25, FRAME: 0.5})
    bounds = [[float(f(m, h)) for h in FRAME.hypotheses] for f in (belief, plausibility)]
    np.testing.assert_allclose(dense(from_intervals(FRAME, *bounds)), dense(m))
    np.testing.assert_allclose(
        dense(from_intervals(FRAME, [0.2, 0.3, 0.5], [0.2, 0.3, 0.5]))[[1, 2, 4]], [0.2, 0.3, 0.5]
    )
    cut = from_intervals(FRAME, [0.0] * 3, [0.5] * 3)  # pairs would have 0.5 each
    np.testing.assert_allclose(dense(cut)[[3, 5, 6]], 1 / 3)


@pytest.mark.parametrize(
    ("call", "error", "says"),
    [
        (lambda: from_probabilities(FRAME, [0.5, 0.5]), MassError, r"of shape \(..., 3\), not \(2,\)"),
        (lambda: from_probabilities(FRAME, [1.5, -0.5, 0]), MassError, "-0.5 of 'dog' is negative"),
        (lambda: from_probabilities(FRAME, [[np.nan, 0, 1]]), MassError, r"nan of 'cat' at index \(0,\)"),
        (lambda: from_probabilities(FRAME, [0, 0, 1], reliability=1.5), MassError, r"in \[0, 1\], not 1.5"),
        (lambda: from_probabilities(FRAME, [0, 0, 1], accuracies=[0.5]), MassError, "3 accuracies"),
        (lambda: from_probabilities(FRAME, [0, 0, 1], confusion=[[1.0]]), MassError, "square confusion"),
        (lambda: from_probabilities(FRAME, [0, 0, 1], confusion=-np.eye(3)), MassError, "none negative"),
        (
            lambda: from_probabilities(FRAME, [0, 0, 1], reliability=[1.0], accuracies=[1.0, 1, 1]),
            MassError,
            "one of reliability",
        ),
        (
            lambda: from_probabilities(FRAME, [[0, 0, 1]] * 2, reliability=[1.0, 1, 1]),
            MassError,
            "does not fit cases",
        ),
        (lambda: from_likelihoods(FRAME, [0, 0, 0]), MassError, "no hypothesis explains"),
        (lambda: from_likelihoods(FRAME, [[0, -1, 0]]), MassError, "-1.0 of 'dog'"),
        (lambda: from_likelihoods(FRAME, [-np.inf] * 3, logarithms=True), MassError, "are 0"),
        (lambda: from_counts(FRAME, [1, -1, 0]), MassError, "'dog' is negative"),
        (lambda: from_counts(FRAME, [1, 1, 0], unseen=0.0), MassError, "positive number"),
        (lambda: from_logits(FRAME, [np.inf, 0, 0]), MassError, "inf of 'cat'"),
        (lambda: from_logits(FRAME, [0, 0, 0], temperature=-1.0), MassError, "temperature"),
        (lambda: from_logits(_frame(21), np.zeros(21)), FrameError, "more than 20"),
        (lambda: from_intervals(FRAME, [0.5] * 3, [0.6] * 3), MassError, "leave no probability"),
        (lambda: from_intervals(FRAME, [0.5, 0, 0], [0.4, 1, 1]), MassError, r"\[0.5, 0.4\] of 'cat'"),
        (lambda: from_intervals(_frame(11), np.zeros(11), np.ones(11)), FrameError, "limit is 10"),
        (
            lambda: from_logistic_regression(FRAME, [0.0], [[1.0]], [0.0], feature_means=[0.0]),
            MassError,
            "coefficients of shape",
        ),
        (
            lambda: from_logistic_regression(
                FRAME, [0.0, 0.0], np.zeros((3, 1)), np.zeros(3), feature_means=[0.0]
            ),
            MassError,
            "so many features",
        ),
    ],
)
def test_mistakes_are_named(call: object, error: type[Exception], says: str) -> None:
    with pytest.raises(error, match=says):
        call()  # type: ignore[operator]


GUIDE = Path(__file__).parents[2] / "docs" / "where-masses-come-from.md"


def test_the_guide_prints_what_it_shows() -> None:
    blocks = re.findall(r"```python\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) >= 6
    shown = doctest.DocTestParser().get_doctest("\n".join(blocks), {}, GUIDE.name, str(GUIDE), 0)
    wrong: list[str] = []
    result = doctest.DocTestRunner(verbose=False).run(shown, out=wrong.append)
    assert result.attempted > 15
    assert not result.failed, "".join(wrong)
