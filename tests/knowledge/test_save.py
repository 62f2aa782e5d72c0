from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evifuse.belief import Frame, MassFunction
from evifuse.conductivity import READINGS, Aggregate, KnowledgeBase, Reading, classify, train
from evifuse.errors import KnowledgeError
from evifuse.knowledge import BUILT_IN, knowledge_text, load_knowledge, parse_knowledge, save_knowledge

NAMES = st.text(st.characters(codec="utf-8", exclude_categories=["C", "Z"]), min_size=1, max_size=8)
TITLES = st.sampled_from(
    [
        "long bracket",
        "1",
        "1.0",
        "yes",
        "null",
        "a: b",
        "x, y",
        "#3",
        "it's",
        "{a}",
        "frame",
        "é",
        "-",
        "?",
        "~",
        "a #b",
        "off",
    ]
)
WORDS = TITLES | NAMES


def same(a: KnowledgeBase, b: KnowledgeBase) -> bool:
    return (
        (a.name, a.frame, a.classes, a.reading, a.source) == (b.name, b.frame, b.classes, b.reading, b.source)
        and all(
            list(x.prototypes) == list(y.prototypes) for x, y in zip(a.aggregates, b.aggregates, strict=True)
        )
        and all(
            x.prototypes[name] == y.prototypes[name]
            for x, y in zip(a.aggregates, b.aggregates, strict=True)
            for name in x.prototypes
        )
    )


@st.composite
def bases(draw: st.DrawFn) -> KnowledgeBase:
    names = draw(st.lists(WORDS, min_size=1, max_size=5, unique=True))
    lists = draw(st.none() | st.just({names[0]: ["round", "no", "2"]}))
    frame = Frame(names, lists)
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    aggregates = []
    for label in draw(st.lists(WORDS, min_size=1, max_size=3, unique=True)):
        prototypes = {}
        for name in draw(st.lists(WORDS, min_size=1, max_size=3, unique=True)):
            count = int(rng.integers(1, min(frame.full, 12) + 1))
            sets = rng.permutation(np.arange(1, frame.full + 1))[:count]
            masses = rng.dirichlet(np.ones(count)) + 1e-6
            prototypes[name] = MassFunction(frame, sets, masses / masses.sum())
        aggregates.append(Aggregate(label, prototypes))
    reading = draw(
        st.sampled_from(
            [
                *READINGS.values(),
                Reading(log_base=2.0),
                Reading(sharpness=64.0, commitment=0.8, projection=False),
            ]
        )
    )
    return KnowledgeBase(draw(WORDS), frame, tuple(aggregates), reading, draw(st.just("") | WORDS))


@settings(max_examples=50, deadline=None)
@given(bases())
def test_what_is_written_reads_back_the_same(base: KnowledgeBase) -> None:
    assert same(parse_knowledge(knowledge_text(base)), base)


@pytest.mark.parametrize("name", BUILT_IN)
def test_built_in_knowledge_survives(name: str, tmp_path: Path) -> None:
    base = load_knowledge(name)
    save_knowledge(base, tmp_path / "copy.yaml")
    assert same(load_knowledge(tmp_path / "copy.yaml"), base)
    assert [p.name for p in tmp_path.iterdir()] == ["copy.yaml"]


def test_a_trained_knowledge_base_conducts_the_same_from_its_file(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    frame = Frame(["round", "flat", "long"])
    masses = rng.dirichlet([4, 1, 1, 1], 60)
    masses[30:, :2] = masses[30:, 1::-1]
    seen = MassFunction(frame, ["round", "flat", "long", frame], masses)
    base = train(seen, ["ball"] * 30 + ["tile"] * 30)
    save_knowledge(base, tmp_path / "mine.yaml")
    again = load_knowledge(tmp_path / "mine.yaml")
    np.testing.assert_array_equal(classify(seen, again).conductivities, classify(seen, base).conductivities)
    lines = (tmp_path / "mine.yaml").read_text().splitlines()
    assert max(map(len, lines)) <= 110


def test_a_reading_is_named_or_given_by_what_differs() -> None:
    base = load_knowledge("curvature")
    assert "reading: working\n" in knowledge_text(base)
    other = KnowledgeBase(base.name, base.frame, base.aggregates, Reading(pooling="mean", smoothing=0.1))
    assert "reading:\n  pooling: mean\n  smoothing: 0.1\nframe:" in knowledge_text(other)


@pytest.mark.parametrize(
    ("name", "label", "prototype", "says"),
    [
        (" title", "a", "p", "the name  title would be read back as title"),
        ("title", "a ", "p", "the classes"),
        ("title", "a", " p", "prototypes ' p' of 'a'"),
        ("title", "a", " ", "can't be written"),
    ],
)
def test_what_could_not_be_read_back_is_refused(name: str, label: str, prototype: str, says: str) -> None:
    frame = Frame(["x", "y"])
    base = KnowledgeBase(
        name, frame, (Aggregate(label, {prototype: MassFunction.vacuous(frame)}),), Reading()
    )
    with pytest.raises(KnowledgeError, match=says) as caught:
        knowledge_text(base)
    assert "\n" not in str(caught.value)


def test_a_class_without_prototypes_and_a_missing_folder(tmp_path: Path) -> None:
    frame = Frame(["x", "y"])
    with pytest.raises(KnowledgeError, match="can't be written"):
        knowledge_text(KnowledgeBase("t", frame, (Aggregate("a", {}),), Reading()))
    with pytest.raises(KnowledgeError, match="create it first"):
        save_knowledge(load_knowledge("shape"), tmp_path / "nowhere" / "mine.yaml")
    with pytest.raises(KnowledgeError, match="folder"):
        save_knowledge(load_knowledge("shape"), tmp_path)
