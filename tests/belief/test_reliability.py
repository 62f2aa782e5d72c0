import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evifuse.belief import Frame, MassFunction, dempster, discount, pignistic
from evifuse.belief.distance import jousselme
from evifuse.belief.reliability import disagreement, reliability_from_disagreement
from evifuse.errors import FrameError, MassError
from tests.belief.strategies import frames, masses_over

FRAME = Frame(["rectangle", "square", "triangle"])


@st.composite
def sources(draw: st.DrawFn, batch: tuple[int, ...] = (2, 3)) -> list[MassFunction]:
    frame = draw(frames())
    return [draw(masses_over(frame, batch)) for _ in range(draw(st.integers(2, 4)))]


@given(sources())
def test_disagreement_is_the_mean_distance_to_the_others(many: list[MassFunction]) -> None:
    got = disagreement(many, by_case=True)
    assert got.shape == (len(many), 2, 3)
    for i, m in enumerate(many):
        mean = np.mean([jousselme(m, other) for j, other in enumerate(many) if j != i], axis=0)
        np.testing.assert_allclose(got[i], mean, atol=1e-12)
    np.testing.assert_allclose(disagreement(many), got.mean(axis=(1, 2)), atol=1e-12)


@given(sources(), st.floats(0.2, 5))
def test_reliabilities_are_shares_and_fall_with_disagreement(many: list[MassFunction], power: float) -> None:
    trust = reliability_from_disagreement(many, exponent=power)
    apart = disagreement(many)
    assert np.all((trust >= 0) & (trust <= 1))
    order = np.argsort(apart)
    assert np.all(np.diff(trust[order]) <= 1e-12)
    again = reliability_from_disagreement([m.to("padded") for m in many[::-1]], exponent=power)
    np.testing.assert_allclose(again[::-1], trust, atol=1e-7)


@given(frames().flatmap(lambda f: masses_over(f, (3,))))
def test_sources_that_agree_are_trusted(m: MassFunction) -> None:
    np.testing.assert_allclose(reliability_from_disagreement([m, m, m]), 1.0, atol=1e-6)


def _sensors(rng: np.random.Generator, truth: np.ndarray, broken: int, how: str) -> list[MassFunction]:
    """Five noisy sensors of three shapes; one of them is broken."""
    many = []
    for i in range(5):
        lean = np.eye(3)[truth]
        if i == broken and how == "stuck":
            lean = np.eye(3)[np.zeros_like(truth)]
        elif i == broken and how == "random":
            lean = np.eye(3)[rng.integers(0, 3, len(truth))]
        elif i == broken and how == "inverted":
            lean = np.eye(3)[(truth + 1) % 3]
        values = np.concatenate([lean * 6, np.full((len(truth), 1), 3.0)], axis=1)
        values = values + rng.random(values.shape) * 2
        many.append(MassFunction(FRAME, [1, 2, 4, 7], values / values.sum(axis=1, keepdims=True)))
    return many


@pytest.mark.parametrize("how", ["stuck", "random", "inverted"])
@pytest.mark.parametrize("broken", range(5))
def test_one_broken_sensor_among_five_is_found(broken: int, how: str) -> None:
    rng = np.random.default_rng(broken)
    truth = rng.integers(0, 3, 60)
    many = _sensors(rng, truth, broken, how)
    trust = reliability_from_disagreement(many)
    assert int(trust.argmin()) == broken
    assert trust[broken] < np.delete(trust, broken).min() - 0.05


def test_a_broken_sensor_does_less_harm_once_discounted() -> None:
    rng = np.random.default_rng(9)
    truth = rng.integers(0, 3, 200)
    many = _sensors(rng, truth, 2, "inverted")
    trust = reliability_from_disagreement(many, exponent=1.0)

    def to_truth(many: list[MassFunction]) -> float:
        joint = many[0]
        for m in many[1:]:
            joint = dempster(joint, m).mass
        return float(pignistic(joint)[np.arange(200), truth].mean())

    discounted = [discount(m, reliability=t) for m, t in zip(many, trust, strict=True)]
    assert to_truth(discounted[1:3]) > to_truth(many[1:3])
    assert to_truth(discounted[2:3] * 2 + discounted[:1]) > to_truth(many[2:3] * 2 + many[:1])


def test_another_distance_and_a_batch_of_sources() -> None:
    def bets(a: MassFunction, b: MassFunction) -> np.ndarray:
        return np.abs(pignistic(a) - pignistic(b)).max(axis=-1)

    many = MassFunction(FRAME, ["rectangle", "square"], [[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    np.testing.assert_allclose(disagreement(many, distance=bets), [0.5, 0.5, 1.0])
    np.testing.assert_allclose(disagreement(list(many)), [0.5, 0.5, 1.0])


def test_frames_are_aligned_and_mistakes_are_named() -> None:
    a = MassFunction.of(FRAME, {"square": 1.0})
    turned = MassFunction.of(Frame(["triangle", "square", "rectangle"]), {"square": 1.0})
    np.testing.assert_allclose(disagreement([a, turned]), 0.0)
    with pytest.raises(FrameError, match="different frames"):
        disagreement([a, MassFunction.vacuous(Frame(["x"]))])
    with pytest.raises(MassError, match="two sources at least"):
        disagreement([a])
    with pytest.raises(MassError, match="batch"):
        disagreement([MassFunction.vacuous(FRAME, (2,)), MassFunction.vacuous(FRAME, (3,))])
    with pytest.raises(MassError, match="at least one case"):
        disagreement([MassFunction.vacuous(FRAME, (0,))] * 2)
    for bad in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(MassError, match="positive number"):
            reliability_from_disagreement([a, a], exponent=bad)
