import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear, minimize

from evifuse.belief import Frame, MassFunction, dempster, discount, plausibility
from evifuse.belief.correct import (
    contextual_discounting,
    contextual_reinforcement,
    contour,
    fit_reliabilities,
)
from evifuse.errors import FrameError, MassError
from tests.belief.strategies import dense, frames, masses_over

FRAME = Frame(["airplane", "helicopter", "rocket"])


@st.composite
def corrected(draw: st.DrawFn, batch: tuple[int, ...] = ()) -> tuple[MassFunction, dict[int, float]]:
    frame = draw(frames())
    contexts = draw(st.lists(st.integers(1, frame.full), min_size=1, max_size=4, unique=True))
    trust = draw(st.lists(st.floats(0, 1), min_size=len(contexts), max_size=len(contexts)))
    return draw(masses_over(frame, batch)), dict(zip(contexts, trust, strict=True))


def _by_definition(m: MassFunction, contexts: dict[int, float], grow: bool) -> np.ndarray:
    masses = dense(m)
    for context, trust in contexts.items():
        after = np.zeros_like(masses)
        for s in range(masses.shape[-1]):
            after[..., s] += trust * masses[..., s]
            after[..., (s | context) if grow else (s & context)] += (1 - trust) * masses[..., s]
        masses = after
    return masses


@given(corrected(batch=(2, 3)), st.sampled_from(["shared", "padded", "dense"]))
def test_both_corrections_are_their_definition_in_every_layout(
    case: tuple[MassFunction, dict[int, float]], layout: str
) -> None:
    m, contexts = case
    m = m.to(layout)  # type: ignore[arg-type]
    grown = contextual_discounting(m, reliabilities=contexts)
    np.testing.assert_allclose(dense(grown), _by_definition(m, contexts, True), atol=1e-12)
    shrunk, conflict = contextual_reinforcement(m, reliabilities=contexts)
    expected = _by_definition(m, contexts, False)
    np.testing.assert_allclose(dense(shrunk), expected, atol=1e-12)
    np.testing.assert_allclose(conflict, expected[..., 0], atol=1e-12)
    if layout == "dense":
        assert grown.layout == shrunk.layout == "dense"
    one = contextual_discounting(m[1, 2], reliabilities=contexts)
    np.testing.assert_allclose(dense(one), dense(grown)[1, 2], atol=1e-12)


@given(corrected())
def test_order_of_contexts_does_not_matter(case: tuple[MassFunction, dict[int, float]]) -> None:
    m, contexts = case
    turned = dict(reversed(contexts.items()))
    a = contextual_discounting(m, reliabilities=contexts)
    np.testing.assert_allclose(dense(a), dense(contextual_discounting(m, reliabilities=turned)), atol=1e-12)
    b = contextual_reinforcement(m, reliabilities=contexts).mass
    other = contextual_reinforcement(m, reliabilities=turned).mass
    np.testing.assert_allclose(dense(b), dense(other), atol=1e-12)


@given(corrected(batch=(4,)))
def test_discounting_only_adds_plausibility_and_reinforcement_only_takes_it(
    case: tuple[MassFunction, dict[int, float]],
) -> None:
    m, contexts = case
    grown = contextual_discounting(m, reliabilities=contexts)
    shrunk = contextual_reinforcement(m, reliabilities=contexts).mass
    for s in range(1, m.frame.full + 1):
        assert np.all(plausibility(grown, s) >= plausibility(m, s) - 1e-12)
        assert np.all(plausibility(shrunk, s) <= plausibility(m, s) + 1e-12)


@given(frames().flatmap(lambda f: masses_over(f, (3,))), st.floats(0, 1))
def test_the_frame_as_only_context_is_plain_discounting(m: MassFunction, trust: float) -> None:
    plain = dense(discount(m, reliability=trust))
    whole = contextual_discounting(m, reliabilities={m.frame: trust})
    np.testing.assert_allclose(dense(whole), plain, atol=1e-12)


@given(frames().flatmap(lambda f: masses_over(f, (3,))), st.integers(0, 2**32 - 1))
def test_one_reliability_for_each_hypothesis_moves_its_own_plausibility(m: MassFunction, seed: int) -> None:
    trust = np.random.default_rng(seed).random(len(m.frame))
    grown = contextual_discounting(m, reliabilities=trust)
    np.testing.assert_allclose(contour(grown), 1 - trust * (1 - contour(m)), atol=1e-12)
    if len(m.frame) > 1:
        shrunk = contextual_reinforcement(m, reliabilities=trust).mass
        np.testing.assert_allclose(contour(shrunk), trust * contour(m), atol=1e-12)


def test_a_worked_case() -> None:
    # A sensor that is right about airplanes in 6 of 10 cases, about all else in 9 of 10; worked by hand.
    m = MassFunction.of(FRAME, {"airplane": 0.5, "rocket": 0.5})
    trust = {"airplane": 0.6, ("helicopter", "rocket"): 0.9}
    expected = {
        "airplane": 0.45,
        "rocket": 0.27,
        "airplane|rocket": 0.18,
        "frame": 0.07,
        "helicopter|rocket": 0.03,
    }
    assert contextual_discounting(m, reliabilities=trust).as_dict(12) == expected


def test_singletons_and_reliabilities_for_each_case() -> None:
    m = MassFunction(FRAME, [1, 2, 4, 7], [[0.5, 0.25, 0.25, 0.0], [0.0, 0.5, 0.0, 0.5]])
    assert m.layout == "singletons"
    trust = np.array([0.5, 1.0])
    both = contextual_discounting(m, reliabilities={"rocket": trust})
    for i in range(2):
        alone = contextual_discounting(m[i], reliabilities={"rocket": trust[i]})
        np.testing.assert_allclose(dense(both)[i], dense(alone), atol=1e-15)
    one = contextual_discounting(m[0], reliabilities={"rocket": trust})
    assert one.batch == (2,)
    back = dempster(
        contextual_reinforcement(m, reliabilities={"rocket": 0.5}).mass, MassFunction.vacuous(FRAME)
    )
    np.testing.assert_allclose(back.mass.masses.sum(axis=-1), 1)


def test_large_frames_take_few_contexts_and_refuse_many() -> None:
    frame = Frame([f"h{i}" for i in range(40)])
    m = MassFunction.of(frame, {"h0": 0.5, ("h1", "h39"): 0.5})
    grown = contextual_discounting(m, reliabilities={"h0": 0.5, ("h2", "h3"): 0.25})
    assert float(plausibility(grown, "h3")) == pytest.approx(0.75)
    with pytest.raises(MassError, match="use fewer, coarser contexts"):
        contextual_discounting(m, reliabilities=np.full(40, 0.5))


@pytest.mark.parametrize(
    ("reliabilities", "error", "says"),
    [
        ({"boat": 0.5}, FrameError, "unknown hypothesis 'boat'"),
        ({(): 0.5}, FrameError, "not the empty set"),
        ({"rocket": 0.5, ("rocket",): 0.5}, FrameError, "'rocket' is given more than once"),
        ({"rocket": 1.5}, MassError, "'rocket' must be in"),
        ({"rocket": np.nan}, MassError, "'rocket' must be in"),
        ({"rocket": [0.5] * 3}, MassError, r"has shape \(3,\), the masses \(2,\)"),
        ([0.5, 0.5], MassError, "3 hypotheses need reliabilities"),
        (0.5, MassError, "3 hypotheses need reliabilities"),
    ],
)
def test_bad_reliabilities_are_named(reliabilities: object, error: type[Exception], says: str) -> None:
    m = MassFunction(FRAME, ["rocket"], [[1.0], [1.0]])
    for correction in (contextual_discounting, contextual_reinforcement):
        with pytest.raises(error, match=says):
            correction(m, reliabilities=reliabilities)  # type: ignore[arg-type, operator]


def _labelled(rng: np.random.Generator, count: int, dual: bool) -> tuple[MassFunction, list[str], np.ndarray]:
    """Cases of a perfect source that was spoilt with known reliabilities."""
    truth = rng.integers(0, 3, count)
    trust = np.array([0.9, 0.5, 0.7])
    said = np.eye(3)[truth]
    wrong = rng.random((count, 3)) > trust
    vague = (((said > 0) | wrong) * (1 << np.arange(3))).sum(axis=1)  # holds too much possible
    sets = vague if dual else 1 << truth
    return (
        MassFunction(FRAME, sets[:, None], np.ones((count, 1))),
        [FRAME.hypotheses[i] for i in truth],
        trust,
    )


@pytest.mark.parametrize("correction", ["discounting", "reinforcement"])
@pytest.mark.parametrize("contexts", [None, [("airplane", "rocket"), "helicopter"]])
def test_fitting_agrees_with_bounded_least_squares(correction: str, contexts: object) -> None:
    rng = np.random.default_rng(4)
    masses = rng.dirichlet(np.ones(7), size=50)
    m = MassFunction(FRAME, np.arange(1, 8), masses)
    names = [FRAME.hypotheses[i] for i in rng.integers(0, 3, 50)]
    truth = np.eye(3)[[FRAME.hypotheses.index(n) for n in names]]
    fitted = fit_reliabilities(m, names, contexts=contexts, correction=correction)  # type: ignore[arg-type]
    for context, value in fitted.items():
        mask = FRAME.mask(context)
        inside = [bool(mask >> k & 1) for k in range(3)]
        dual = correction == "reinforcement"
        columns = [k for k in range(3) if inside[k] != dual]
        r, t = (contour(m), truth) if dual else (1 - contour(m), 1 - truth)
        matrix = r[:, columns].reshape(-1, 1)
        best = lsq_linear(matrix, t[:, columns].ravel(), bounds=(0, 1), tol=1e-14).x[0]
        assert float(value) == pytest.approx(best, abs=1e-6)


def test_fitting_overlapping_contexts_finds_a_minimum() -> None:
    rng = np.random.default_rng(5)
    m = MassFunction(FRAME, np.arange(1, 8), rng.dirichlet(np.ones(7), size=40))
    names = [FRAME.hypotheses[i] for i in rng.integers(0, 3, 40)]
    truth = np.eye(3)[[FRAME.hypotheses.index(n) for n in names]]
    contexts = [("airplane", "helicopter"), ("helicopter", "rocket"), FRAME.hypotheses]

    def loss(x: np.ndarray) -> float:
        after = contextual_discounting(m, reliabilities=dict(zip(contexts, x, strict=True)))
        return float(((contour(after) - truth) ** 2).sum())

    fitted = fit_reliabilities(m, names, contexts=contexts)
    assert list(fitted) == contexts
    ours = loss(np.array([float(v) for v in fitted.values()]))
    best = min(
        minimize(loss, start, bounds=[(0, 1)] * 3, method="L-BFGS-B").fun for start in rng.random((4, 3))
    )
    assert ours <= best + 1e-6


def test_a_source_that_errs_in_one_context_is_found() -> None:
    rng = np.random.default_rng(6)
    truth = rng.integers(0, 3, 4000)
    said = np.where((truth == 1) & (rng.random(4000) < 0.4), 0, truth)  # helicopters pass for airplanes
    m = MassFunction(FRAME, (1 << said)[:, None], np.ones((4000, 1)))
    names = np.array(FRAME.hypotheses)[truth]
    by_context = fit_reliabilities(m, names)
    assert [round(float(v), 1) for v in by_context.values()] == [1.0, 0.8, 1.0]
    plain = fit_reliabilities(m, names, contexts=[FRAME])
    assert list(plain) == [FRAME.hypotheses]
    target = np.eye(3)[truth]

    def loss(a: MassFunction) -> float:
        return float(((contour(a) - target) ** 2).sum())

    contextual = loss(contextual_discounting(m, reliabilities=by_context))
    assert contextual < loss(discount(m, reliability=plain[FRAME.hypotheses])) < loss(m)


@pytest.mark.parametrize("dual", [False, True])
def test_a_spoilt_source_is_fitted_back(dual: bool) -> None:
    m, names, trust = _labelled(np.random.default_rng(7), 6000, dual)
    fitted = fit_reliabilities(m, names, correction="reinforcement" if dual else "discounting")
    values = [float(v) for v in fitted.values()]
    if not dual:
        assert values == [1.0, 1.0, 1.0]  # it is perfect
    else:  # pl(k) is 1 if k, and with 1 - trust if not: β = P(k) / P(pl(k) = 1)
        np.testing.assert_allclose(values, (1 / 3) / (1 / 3 + (1 - trust) * 2 / 3), atol=0.03)


def test_labels_may_be_uncertain_and_batches_are_fitted_apart() -> None:
    rng = np.random.default_rng(8)
    m = MassFunction(FRAME, np.arange(1, 8), rng.dirichlet(np.ones(7), size=(2, 30)))
    names = np.array(FRAME.hypotheses)[rng.integers(0, 3, 30)]
    both = fit_reliabilities(m, names)
    for i in range(2):
        alone = fit_reliabilities(m[i], names)
        assert {k: float(v[i]) for k, v in both.items()} == pytest.approx(
            {k: float(v) for k, v in alone.items()}
        )
    sure = MassFunction(FRAME, np.array([[FRAME.mask(n)] for n in names]), np.ones((30, 1)))
    assert {k: v.tolist() for k, v in fit_reliabilities(m, sure).items()} == {
        k: v.tolist() for k, v in both.items()
    }
    vague = MassFunction.vacuous(FRAME, (30,))
    assert all(np.all(v == 0) for v in fit_reliabilities(m, vague).values())
    assert all(np.all(v == 1) for v in fit_reliabilities(vague, names).values())


def test_bad_labels_are_named() -> None:
    m = MassFunction.vacuous(FRAME, (2,))
    with pytest.raises(FrameError, match="unknown hypothesis 'boat'"):
        fit_reliabilities(m, ["rocket", "boat"])
    with pytest.raises(FrameError, match="give names, not positions"):
        fit_reliabilities(m, [0, 1])  # type: ignore[list-item]
    with pytest.raises(MassError, match="need labels of that shape"):
        fit_reliabilities(m, ["rocket"])
    with pytest.raises(MassError, match="at least one labelled case"):
        fit_reliabilities(MassFunction.vacuous(FRAME), ["rocket"])
    with pytest.raises(MassError, match="at least one labelled case"):
        fit_reliabilities(MassFunction.vacuous(FRAME, (0,)), [])
    with pytest.raises((MassError, TypeError), match=r"'discounting'.*'reinforcement'"):
        fit_reliabilities(m, ["rocket", "rocket"], correction="both")  # type: ignore[arg-type]
