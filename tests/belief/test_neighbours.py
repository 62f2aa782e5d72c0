import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sklearn.base import clone
from sklearn.datasets import load_iris
from sklearn.model_selection import cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.estimator_checks import parametrize_with_checks

from evifuse.belief import MassFunction, dempster, pignistic
from evifuse.belief.neighbours import EvidentialNeighbours
from evifuse.errors import FrameError


@parametrize_with_checks([EvidentialNeighbours(), EvidentialNeighbours(n_neighbours=3, scale=0.5)])
def test_scikit_learn_accepts_it(estimator: EvidentialNeighbours, check: object) -> None:
    check(estimator)  # type: ignore[operator]


@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.integers(1, 4))
def test_masses_are_dempsters_combination_of_the_neighbours(seed: int, near: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    X, y = rng.normal(size=(12, 2)), np.concatenate([np.arange(count), rng.integers(0, count, 12 - count)])
    model = EvidentialNeighbours(near, confidence=0.9).fit(X, y)
    at = rng.normal(size=(3, 2))
    m = model.predict_mass(at)
    assert m.layout == "singletons"
    for i in range(3):
        distance = np.linalg.norm(X - at[i], axis=1)
        joint = MassFunction.vacuous(m.frame)
        for n in np.argsort(distance)[:near]:
            same = X[y == y[n]]
            pairs = [((a - b) ** 2).sum() for s, a in enumerate(same) for b in same[:s]]
            gamma = 1 / np.mean(pairs) if pairs else 1.0
            share = 0.9 * np.exp(-gamma * distance[n] ** 2) if count > 1 else 1.0
            simple = MassFunction.of(
                m.frame, {str(y[n]): share, m.frame: 1 - share} if count > 1 else {"0": 1.0}
            )
            joint = dempster(joint, simple).mass
        np.testing.assert_allclose(m[i].masses, joint.on(m.focal_sets), atol=1e-10)
    np.testing.assert_allclose(model.predict_proba(at), pignistic(m), atol=1e-12)
    np.testing.assert_array_equal(model.predict(at), model.classes_[m.masses[:, :count].argmax(axis=1)])


def test_it_classifies_iris_in_a_pipeline() -> None:
    X, y = load_iris(return_X_y=True)
    names = np.array(["setosa", "versicolor", "virginica"])[y]
    model = make_pipeline(StandardScaler(), EvidentialNeighbours())
    assert cross_val_score(model, X, names, cv=5).mean() > 0.93
    model.fit(X, names)
    assert model[-1].predict_mass(X[:1]).frame.hypotheses == ("setosa", "versicolor", "virginica")


def test_far_from_everything_it_knows_nothing() -> None:
    X, y = load_iris(return_X_y=True)
    model = EvidentialNeighbours(7).fit(X, y)
    near, far = model.predict_mass(X[:1]), model.predict_mass(X[:1] + 100)
    assert float(near.masses[0, -1]) < 1e-3
    assert float(far.masses[0, -1]) > 1 - 1e-12
    np.testing.assert_allclose(model.predict_proba(X[:1] + 100), 1 / 3)


def test_thousands_of_certain_neighbours_do_not_overflow() -> None:
    X, y = np.zeros((4000, 1)), np.repeat([0, 1], [2500, 1500])
    m = EvidentialNeighbours(4000, confidence=0.999999).fit(X, y).predict_mass([[0.0]])
    np.testing.assert_allclose(m.masses, [[1.0, 0.0, 0.0]])


@pytest.mark.parametrize(
    ("parameters", "says"),
    [
        ({"n_neighbours": 0}, "n_neighbours must be"),
        ({"n_neighbours": 2.5}, "n_neighbours must be"),
        ({"confidence": 1.0}, "confidence must be"),
        ({"confidence": float("nan")}, "confidence must be"),
        ({"scale": 0.0}, "scale must be"),
    ],
)
def test_parameters_out_of_range_are_named(parameters: dict[str, float], says: str) -> None:
    model = clone(EvidentialNeighbours()).set_params(**parameters)
    with pytest.raises(ValueError, match=says):
        model.fit([[0.0], [1.0]], [0, 1])


def test_too_many_classes_for_a_frame_still_predict() -> None:
    X, y = np.arange(140.0)[:, None] // 2, np.arange(140) // 2
    model = EvidentialNeighbours(1).fit(X, y)
    np.testing.assert_array_equal(model.predict(X), y)
    with pytest.raises(FrameError, match="1 to 62 hypotheses"):
        model.predict_mass(X)


def test_without_scikit_learn_the_message_says_how_to_get_it() -> None:
    code = (
        "import sys; sys.modules['sklearn'] = None\n"
        "from evifuse.errors import MissingExtraError\n"
        "import evifuse.belief\n"
        "try:\n    import evifuse.belief.neighbours\n"
        "except MissingExtraError as error:\n    print(error)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "pip install 'evifuse[learn]'" in done.stdout
