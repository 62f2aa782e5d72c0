"""The compiled classifier against the plain one: every reading, zeros and ties, every kind of array."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from evifuse.belief import Frame, MassFunction, on_frame
from evifuse.conductivity import READINGS, Aggregate, KnowledgeBase, Reading, classify, compile, divergence  # noqa: A004
from evifuse.conductivity import _batch as batch_module
from evifuse.errors import FrameError, KnowledgeError, MassError
from evifuse.knowledge import load_knowledge

EXACT = 1e-10
SOUND = READINGS["sound"]
CHOICES = {
    "sound": SOUND,
    "working": READINGS["working"],
    "smooth": replace(SOUND, smoothing=0.05),
    "first of ties, base 2": replace(SOUND, ties="first", log_base=2.0, pooling="mean"),
    "printed, but near": replace(READINGS["printed"], similarity_offset=0.3),
    "sharp": replace(SOUND, projection=False, sharpness=2.5, pooling="max", pairs_within=2, members="within"),
    "committed": replace(SOUND, commitment=0.6, negligible=0.2, sharpness=3.0, smoothing=0.1),
}


@pytest.fixture(params=["array API", "kernel"])
def engine(request, monkeypatch):
    monkeypatch.setattr(batch_module, "LARGE", 1 if request.param == "kernel" else 1 << 60)


def masses_with_zeros_and_ties(rng, count, rows):
    """Plain masses, masses with zeros, rounded ones that tie, and total ignorance where the frame is last."""
    plain = rng.dirichlet(np.full(count, 0.7), rows)
    gaps = np.where(rng.random(plain.shape) < 0.4, 0.0, plain)
    gaps[gaps.sum(axis=1) == 0, -1] = 1.0
    gaps /= gaps.sum(axis=1, keepdims=True)
    even = np.floor(plain * 8) / 8
    even[:, -1] += 1.0 - even.sum(axis=1)
    return np.concatenate([plain, gaps, even, np.eye(count)])


def far_from_jumps(found, knowledge):
    """Rows without a dimension or projection that rounding could carry over a branch point."""
    top = np.array([found.properties[label].dimension for label, _ in found.prototypes])
    near = np.abs(found.interaction_dimensions - top) < 1e-9
    single = np.array([len(a.prototypes) == 1 for a in knowledge.aggregates for _ in a.prototypes])
    return ~((near & ~single) | (np.abs(found.projected_dimensions - top) < 1e-9)).any(axis=-1)


def assert_close(found, expected):
    np.testing.assert_allclose(found, expected, rtol=EXACT, atol=EXACT)


def assert_agrees(knowledge, sets, masses, reading):
    plain = classify(MassFunction(knowledge.frame, sets, masses), knowledge, reading)
    fast = compile(knowledge, sets, reading)
    assert_close(fast.interaction_dimensions(masses), plain.interaction_dimensions)
    sure = far_from_jumps(plain, knowledge)
    assert sure.mean() > 0.9
    assert_close(fast.conductivities(masses)[sure], plain.conductivities[sure])
    assert_close(fast.belief(masses)[sure], plain.belief.masses[sure])
    into = fast.prototype_conductivities(masses)
    assert_close(into[sure], plain.prototype_conductivities[sure])
    assert fast.classes == plain.classes
    assert fast.prototypes == plain.prototypes


@pytest.mark.usefixtures("engine")
@pytest.mark.parametrize("reading", CHOICES.values(), ids=list(CHOICES))
@pytest.mark.parametrize("name", ["chapter-shape", "chapter-curvature", "shape", "curvature"])
def test_agrees_with_the_plain_implementation(name, reading):
    knowledge = load_knowledge(name)
    rng = np.random.default_rng(7)
    sets = np.append(rng.choice(knowledge.frame.full - 1, 5, replace=False) + 1, knowledge.frame.full)
    assert_agrees(knowledge, sets, masses_with_zeros_and_ties(rng, 6, 60), reading)


@st.composite
def cases(draw):
    """A small knowledge base, with or without attributes, and focal sets that overlap and tie."""
    count = draw(st.integers(2, 4))
    names = "abcd"[:count]
    attributes = None
    if draw(st.booleans()):
        lists = st.lists(st.sampled_from("uvwx"), min_size=1, max_size=3, unique=True)
        attributes = {name: draw(lists) for name in names}
    frame = Frame(list(names), attributes)
    some_sets = st.lists(st.integers(1, frame.full), min_size=1, max_size=4, unique=True)
    weights = st.integers(1, 6)
    aggregates = []
    for label in ("one", "two")[: draw(st.integers(1, 2))]:
        prototypes = {}
        for name in ("x", "y")[: draw(st.integers(1, 2))]:
            sets = draw(some_sets)
            w = np.array([draw(weights) for _ in sets], dtype=float)
            prototypes[name] = MassFunction(frame, np.array(sets), w / w.sum())
        aggregates.append(Aggregate(label, prototypes))
    sets = np.array(draw(some_sets))
    w = np.array([[draw(st.integers(0, 6)) for _ in sets] for _ in range(3)], dtype=float)
    w[w.sum(axis=1) == 0] = 1.0
    return (
        KnowledgeBase("k", frame, tuple(aggregates), SOUND),
        sets,
        w / w.sum(axis=1, keepdims=True),
        draw(st.sampled_from(list(CHOICES.values()))),
    )


@pytest.mark.usefixtures("engine")
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(cases())
def test_agrees_on_any_small_knowledge_base(case):
    knowledge, sets, masses, reading = case
    plain = classify(MassFunction(knowledge.frame, sets, masses), knowledge, reading)
    fast = compile(knowledge, sets, reading)
    assert_close(fast.interaction_dimensions(masses), plain.interaction_dimensions)
    sure = far_from_jumps(plain, knowledge)
    assert_close(fast.belief(masses)[sure], plain.belief.masses[sure])


@pytest.mark.usefixtures("engine")
@pytest.mark.parametrize("reading", CHOICES.values(), ids=CHOICES)
def test_reasons_are_those_of_the_plain_implementation(reading):
    base = load_knowledge("shape")
    sets = [*base.frame.hypotheses, base.frame]
    masses = masses_with_zeros_and_ties(np.random.default_rng(5), len(sets), 20)
    plain = classify(MassFunction(base.frame, sets, masses), base, reading)
    fast = compile(base, sets, reading).classify(masses)
    assert (fast.classes, fast.prototypes) == (plain.classes, plain.prototypes)
    assert_close(fast.interaction_dimensions, plain.interaction_dimensions)
    assert_close(fast.projected_dimensions, plain.projected_dimensions)
    rows = far_from_jumps(plain, base)
    assert rows.sum() > 20
    np.testing.assert_array_equal(fast.branches[rows], plain.branches[rows])
    assert_close(fast.prototype_conductivities[rows], plain.prototype_conductivities[rows])
    assert_close(fast.belief.masses[rows], plain.belief.masses[rows])


def test_divergences_are_those_of_the_formula():
    knowledge = load_knowledge("chapter-shape")
    rng = np.random.default_rng(1)
    sets = np.array([1, 6, 12, knowledge.frame.full])
    masses = rng.dirichlet(np.ones(4), 20)
    masses[10:, 1] = 0.0
    masses[10:] /= masses[10:].sum(axis=1, keepdims=True)
    fast = compile(knowledge, sets)
    for i, (label, name) in enumerate(fast.prototypes):
        (x,) = (a.prototypes[name] for a in knowledge.aggregates if a.label == label)
        for row, m in zip(fast.divergences(masses)[:, i], masses, strict=True):
            y = MassFunction(knowledge.frame, sets[m > 0], m[m > 0])
            assert row == pytest.approx(float(divergence(y, x, SOUND)), abs=EXACT)


@pytest.mark.usefixtures("engine")
@pytest.mark.parametrize("reading", CHOICES.values(), ids=list(CHOICES))
def test_next_to_nothing_stays_finite(reading):
    knowledge = load_knowledge("shape")
    sets = ["rectangle", "triangle", "ellipse", knowledge.frame]
    tiny = np.array([1e-320, 1e-300, 1e-13, 1e-11, 1e-3])
    masses = np.stack([tiny, tiny / 7, np.full(5, 1e-310), 1.0 - tiny - tiny / 7 - 1e-310], axis=-1)
    plain = classify(MassFunction(knowledge.frame, sets, masses), knowledge, reading)
    assert np.isfinite(plain.belief.masses).all()
    assert_close(compile(knowledge, sets, reading).belief(masses), plain.belief.masses)


@pytest.mark.usefixtures("engine")
def test_batch_dimensions_lists_and_empty_batches():
    knowledge = load_knowledge("shape")
    fast = compile(knowledge, ["rectangle", knowledge.frame])
    one = fast.belief([0.4, 0.6])
    assert one.shape == (4,)
    many = fast.belief(np.full((2, 3, 2), 0.5))
    assert many.shape == (2, 3, 4)
    np.testing.assert_allclose(many[1, 2], fast.belief([0.5, 0.5]), atol=1e-15)
    assert fast.conductivities(np.empty((0, 2))).shape == (0, 3)


@pytest.mark.usefixtures("engine")
def test_evidence_on_part_of_the_frame_is_brought_to_it_first():
    knowledge = load_knowledge("shape")
    small = MassFunction.of(
        Frame(["rectangle", "triangle"]), {"triangle": 0.7, ("rectangle", "triangle"): 0.3}
    )
    brought = on_frame(small, knowledge.frame)
    fast = compile(knowledge, brought.focal_sets)
    np.testing.assert_allclose(
        fast.belief(brought.masses), classify(small, knowledge).belief.masses, atol=EXACT
    )


@pytest.mark.usefixtures("engine")
@pytest.mark.parametrize("row", [[0.5, 0.6], [-0.1, 1.1], [np.nan, 0.5], [0.5, np.inf]])
def test_rows_that_are_no_masses_are_named(row):
    knowledge = load_knowledge("shape")
    fast = compile(knowledge, ["rectangle", knowledge.frame])
    with pytest.raises(MassError, match=r"row 2: masses must be numbers from 0 that sum to 1"):
        fast.conductivities([[0.5, 0.5], [0.1, 0.9], row, [0.5, 0.5]])


def test_other_shapes_unknown_sets_and_infinite_distances_are_refused():
    knowledge = load_knowledge("shape")
    with pytest.raises(MassError, match=r"shape \(\.\.\., 1\), not \(2,\)"):
        compile(knowledge, [knowledge.frame]).belief([0.5, 0.5])
    with pytest.raises(FrameError):
        compile(knowledge, ["pentagon"])
    with pytest.raises(KnowledgeError, match="similarity_offset 0"):
        compile(knowledge, ["rectangle", "triangle"], Reading(similarity_offset=0.0))


@pytest.mark.parametrize("count", [12, 13, 40])
def test_many_focal_sets_with_zeros(count, monkeypatch):
    monkeypatch.setattr(batch_module, "LARGE", 1)
    knowledge = load_knowledge("curvature")
    rng = np.random.default_rng(3)
    sets = np.append(rng.choice(knowledge.frame.full - 1, count - 1, replace=False) + 1, knowledge.frame.full)
    assert_agrees(knowledge, sets, masses_with_zeros_and_ties(rng, count, 20), SOUND)


@pytest.mark.parametrize("library", ["array_api_strict", "torch", "jax.numpy"])
@pytest.mark.parametrize("reading", ["sound", "working"])
@pytest.mark.usefixtures("engine")
def test_other_array_libraries_give_the_same(library, reading):
    xp = pytest.importorskip(library)
    knowledge = load_knowledge("chapter-curvature")
    rng = np.random.default_rng(5)
    sets = np.array([3, 65, 512, 4096, knowledge.frame.full])
    masses = masses_with_zeros_and_ties(rng, 5, 40)
    fast = compile(knowledge, sets, READINGS[reading])
    given_there = xp.asarray(masses)  # 32 bits in JAX unless the user asks for 64
    there = fast.belief(given_there)
    assert type(there) is type(given_there)
    exact = "float64" in str(given_there.dtype)
    np.testing.assert_allclose(np.asarray(there), fast.belief(masses), atol=EXACT if exact else 2e-3)


def test_single_precision_stays_single():
    knowledge = load_knowledge("shape")
    fast = compile(knowledge, ["rectangle", knowledge.frame])
    found = fast.belief(np.array([[0.25, 0.75]], dtype=np.float32))
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, fast.belief([[0.25, 0.75]]), atol=1e-5)


def test_no_array_library_is_imported_for_numpy():
    code = (
        "import sys; from evifuse.conductivity import compile; from evifuse.knowledge import load_knowledge; "
        "k = load_knowledge('shape'); compile(k, ['rectangle', k.frame]).belief([[0.5, 0.5]]); "
        "print([m for m in ('torch', 'jax', 'numba', 'cupy') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
