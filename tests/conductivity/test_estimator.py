"""The scikit-learn estimator: its contract, what sources say, and what is joined."""

import pickle
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.base import clone
from sklearn.datasets import load_digits, load_iris, load_wine
from sklearn.model_selection import cross_val_score, train_test_split
from sklearn.utils.estimator_checks import parametrize_with_checks

from evifuse.belief import Frame, dempster, pignistic
from evifuse.conductivity import READINGS, classify
from evifuse.conductivity.estimator import AGREEMENT, ConductivityClassifier, joined
from evifuse.conductivity.sources import cross_fitted, learn_source, squared_distances
from evifuse.errors import FrameError

NAN = float("nan")


@parametrize_with_checks([ConductivityClassifier(max_prototypes=1)])
def test_scikit_learn_accepts_it(estimator: ConductivityClassifier, check: object) -> None:
    check(estimator)  # type: ignore[operator]


def iris() -> tuple[np.ndarray, np.ndarray]:
    X, y = load_iris(return_X_y=True)
    return X, np.array(["setosa", "versicolor", "virginica"])[y]


SENSES = [[0, 1], [2, 3]]


def test_it_classifies_with_one_source_and_with_two() -> None:
    X, y = iris()
    assert cross_val_score(ConductivityClassifier(), X, y, cv=3).mean() > 0.94
    assert cross_val_score(ConductivityClassifier(sources=SENSES), X, y, cv=3).mean() > 0.92


def test_digits_with_few_cases_and_missing_features_are_better_than_means_of_features() -> None:
    X, y = load_digits(return_X_y=True)
    train, test, train_y, test_y = train_test_split(X, y, train_size=400, stratify=y, random_state=0)
    model = ConductivityClassifier(sources=[range(32), range(32, 64)]).fit(train, train_y)
    assert model.score(test, test_y) > 0.9
    test[np.random.default_rng(0).random(test.shape) < 0.5] = NAN
    filled = np.where(np.isnan(test), train.mean(axis=0), test)
    assert model.score(test, test_y) > max(0.75, model.score(filled, test_y) + 0.03)


def test_works_with_five_cases_of_each_class() -> None:
    X, y = load_wine(return_X_y=True)
    few = np.concatenate([np.flatnonzero(y == k)[:5] for k in range(3)])
    rest = np.setdiff1d(np.arange(len(y)), few)
    model = ConductivityClassifier(sources=[range(6), range(6, 13)]).fit(X[few], y[few])
    assert model.score(X[rest], y[rest]) > 0.8


def test_mass_probabilities_and_decisions_agree() -> None:
    X, y = iris()
    model = ConductivityClassifier(sources=SENSES).fit(X[::2], y[::2])
    test = X[1::2].copy()
    test[::3, 0] = NAN
    m = model.predict_mass(test)
    assert m.frame.hypotheses == ("setosa", "versicolor", "virginica")
    assert m.batch == (75,)
    p = model.predict_proba(test)
    np.testing.assert_allclose(p, pignistic(m), atol=1e-12)
    np.testing.assert_array_equal(model.predict(test), model.classes_[p.argmax(axis=1)])
    by_hand = [
        classify(said, base).belief.masses[:, :3]
        for said, base in zip(model.source_evidence(test), model.knowledge_, strict=True)
    ]
    assert all(base.classes == m.frame.hypotheses for base in model.knowledge_)
    np.testing.assert_allclose(joined(m.frame.hypotheses, by_hand).masses, m.masses, atol=1e-9)


@given(st.integers(0, 2**32 - 1), st.integers(2, 4), st.integers(1, 3))
@settings(max_examples=40, deadline=None)
def test_joined_adds_and_multiplies(seed: int, classes: int, sources: int) -> None:
    rng = np.random.default_rng(seed)
    shares = [rng.dirichlet(np.ones(classes + 1), 4)[:, :classes] for _ in range(sources)]
    names = [f"c{k}" for k in range(classes)]
    m = joined(names, shares)
    np.testing.assert_allclose(m.masses.sum(axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(
        m.masses[:, -1], np.prod([1 - s.sum(axis=1) for s in shares], axis=0), atol=1e-12
    )
    if sources == 1:
        np.testing.assert_allclose(m.masses[:, :-1], shares[0], atol=1e-12)
    if sources == 2:
        total = shares[0] + shares[1] + AGREEMENT * shares[0] * shares[1]
        known = 1 - m.masses[:, -1:]
        np.testing.assert_allclose(
            m.masses[:, :-1], known * total / total.sum(axis=1, keepdims=True), atol=1e-12
        )
    again = joined(names, [*shares, np.zeros((4, classes))])
    np.testing.assert_allclose(again.masses, m.masses, atol=1e-12)  # a source that knows nothing
    np.testing.assert_allclose(joined(names, shares[::-1]).masses, m.masses, atol=1e-12)


def test_ignorant_where_nothing_is_present_or_familiar() -> None:
    X, y = iris()
    model = ConductivityClassifier(sources=SENSES).fit(X, y)
    strange = np.array(
        [[NAN] * 4, [1e3, -1e3, 1e3, -1e3], [NAN, NAN, *X[0, 2:]], [1e3, 1e3, *X[0, 2:]], X[0]]
    )
    sepal, petal = model.source_evidence(strange)
    assert sepal.layout == petal.layout == "singletons"
    for m, ignorant in ((sepal, [1, 1, 1, 1, 0]), (petal, [1, 1, 0, 0, 0])):
        np.testing.assert_array_equal(m.masses[:, -1] > 0.99, np.array(ignorant, dtype=bool))
    joint = model.predict_mass(strange)
    assert joint[0].as_dict() == {"frame": 1.0}
    np.testing.assert_allclose(model.predict_proba(strange)[0], 1 / 3)
    assert model.predict(strange)[2:].tolist() == ["setosa"] * 3
    alone = ConductivityClassifier(sources=[[2, 3]]).fit(X, y)
    assert (alone.predict(strange[2:]) == "setosa").all()


def test_training_cases_may_lack_features_too() -> None:
    X, y = iris()
    X = X.copy()
    X[np.random.default_rng(1).random(X.shape) < 0.2] = NAN
    X[:, 1][:40] = NAN
    model = ConductivityClassifier().fit(X[::2], y[::2])
    assert model.score(X[1::2], y[1::2]) > 0.85


def test_evidence_to_learn_from_is_not_that_of_the_own_fit() -> None:
    rng = np.random.default_rng(0)
    X, codes = rng.normal(size=(40, 30)), np.arange(40) % 2  # features say nothing about the class
    frame, columns = Frame(["a", "b"]), np.arange(30)
    told, strength = cross_fitted(X, codes, frame, columns, 0)
    fitted = learn_source(X, codes, 2, columns, strength, 0).evidence(X, frame)
    own = pignistic(fitted)[np.arange(40), codes].mean()
    held_out = pignistic(told)[np.arange(40), codes].mean()
    assert own > 0.8
    assert held_out < 0.6


def test_what_could_be_missing_makes_evidence_less_sure() -> None:
    X, y = iris()
    codes = np.unique(y, return_inverse=True)[1]
    source = learn_source(X, codes, 3, np.arange(4), 10.0, 0)
    frame = Frame(["a", "b", "c"])
    lacking = X.copy()
    lacking[:, 2:] = NAN
    whole, part = (pignistic(source.evidence(x, frame)) for x in (X, lacking))
    sure = lambda p: float((-p * np.log(p + 1e-300)).sum(axis=1).mean())  # noqa: E731
    assert sure(part) > sure(whole) + 0.05
    assert (part.argmax(axis=1) == codes).mean() > 0.65


def test_distances_leave_missing_features_out() -> None:
    a, b = np.array([[1.0, NAN, 3.0], [NAN, 2.0, NAN]]), np.array([[0.0, 5.0, 1.0], [2.0, NAN, NAN]])
    np.testing.assert_allclose(squared_distances(a, b), [[2.5, 1.0], [9.0, NAN]])
    np.testing.assert_allclose(squared_distances(b[:, :1], a[:1, :1]), [[1.0], [1.0]])
    np.testing.assert_allclose(squared_distances(a[:1, ::2], b[:1, ::2]), [[2.5]])


def test_one_corrupted_source_costs_less_than_dempster_pays() -> None:
    X, y = load_digits(return_X_y=True)
    train, test, train_y, test_y = train_test_split(X, y, train_size=400, stratify=y, random_state=1)
    model = ConductivityClassifier(sources=[range(32), range(32, 64)]).fit(train, train_y)
    test[:, :32] = test[np.random.default_rng(0).permutation(len(test)), :32]
    by_dempster = pignistic(dempster(*model.source_evidence(test)).mass)

    def brier(p: np.ndarray) -> float:
        return float(((p - np.eye(10)[test_y]) ** 2).sum(axis=1).mean())

    assert brier(model.predict_proba(test)) < brier(by_dempster)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"max_prototypes": 0}, "max_prototypes must be a positive whole number, not 0"),
        ({"sources": []}, "at least one list"),
        ({"sources": [[0], []]}, "source 1 must be a list of columns from 0 to 3"),
        ({"sources": [[4]]}, "source 0 must be a list of columns from 0 to 3"),
        ({"sources": [[-1]]}, "source 0"),
        ({"sources": [[0.5]]}, "source 0"),
    ],
)
def test_refusals(options: dict[str, object], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        ConductivityClassifier(**options).fit(*iris())  # type: ignore[arg-type]


def test_too_many_classes_for_a_frame_are_refused() -> None:
    with pytest.raises(FrameError, match="1 to 62 hypotheses"):
        ConductivityClassifier().fit(np.arange(140.0)[:, None], np.arange(140) % 70)


def test_seeds_copies_and_readings() -> None:
    X, y = iris()
    model = ConductivityClassifier(sources=SENSES, random_state=3).fit(X, y)
    np.testing.assert_array_equal(clone(model).fit(X, y).predict_proba(X), model.predict_proba(X))
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(model)).predict_proba(X), model.predict_proba(X))
    sound = ConductivityClassifier(sources=SENSES, reading=READINGS["sound"]).fit(X, y)
    assert all(base.reading == READINGS["sound"] for base in sound.knowledge_)
    assert sound.score(X, y) > 0.6


def test_the_package_does_not_need_scikit_learn() -> None:
    code = (
        "import sys, evifuse.conductivity as c; assert 'sklearn' not in sys.modules;"
        "c.ConductivityClassifier; print('sklearn' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "True"
