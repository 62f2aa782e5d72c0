import re
from pathlib import Path

import pytest

from evifuse.belief import MassFunction
from evifuse.conductivity import READINGS, Reading
from evifuse.errors import KnowledgeError
from evifuse.knowledge import BUILT_IN, built_in_text, load_knowledge, parse_knowledge

GOOD = """\
frame: {R: rectangle, T: triangle}
classes:
  rectangular:
    R_1: {R: 0.5, R T: 0.25, frame: 0.25}
"""
GOOD = GOOD.replace("R T: 0.25, frame: 0.25", "frame: 0.5")


@pytest.mark.parametrize("name", BUILT_IN)
def test_built_in_files_load_by_name_and_by_path(name: str, tmp_path: Path) -> None:
    copy = tmp_path / "mine.yaml"
    copy.write_text(built_in_text(name), encoding="utf-8")
    a, b = load_knowledge(name), load_knowledge(copy)
    assert a.frame == b.frame
    assert a.classes == b.classes
    assert a.reading == b.reading
    assert a.source
    assert a.name


def test_table_1_as_printed() -> None:
    table = load_knowledge("chapter-shape")
    triangular = table.aggregates[1]
    assert triangular.label == "triangular"
    expected = {"triangle": 0.4, "ellipse": 0.1, ("triangle", "ellipse"): 0.3, table.frame: 0.2}
    assert triangular.prototypes["T_1"] == MassFunction.of(table.frame, expected)
    assert table.reading == READINGS["sound"]


def test_table_4_as_printed() -> None:
    table = load_knowledge("chapter-curvature")
    assert len(table.frame) == 13
    assert [len(a.prototypes) for a in table.aggregates] == [2, 2, 4]
    k_1 = table.aggregates[1].prototypes["K_1"]
    expected = {("triangle", "rectangle", "C-", "C+"): 0.5, ("bracket", "E-"): 0.4, table.frame: 0.1}
    assert k_1 == MassFunction.of(table.frame, expected)


def test_choices_of_a_reading_and_attributes() -> None:
    text = GOOD + "reading: {pooling: mean, log_base: 2}\nattributes: {R: [four, straight]}\n"
    base = parse_knowledge(text)
    assert base.reading == Reading(pooling="mean", log_base=2)
    assert base.frame.attributes == (frozenset({"four", "straight"}), frozenset({"triangle"}))
    assert parse_knowledge(GOOD).reading == READINGS["sound"]


@pytest.mark.parametrize(
    ("text", "line", "says"),
    [
        ("", None, "must be a mapping"),
        ("just a text", 1, "must be a mapping"),
        ("a: [1", 1, "not YAML"),
        (GOOD.replace("R: 0.5", "X: 0.5"), 4, "unknown label 'X' in rectangular/R_1: the frame has R, T"),
        (GOOD.replace("R: 0.5", "R: half"), 4, "must be a number, not 'half'"),
        (GOOD.replace("R: 0.5", "R: -0.5"), 4, "must be positive, not -0.5"),
        (GOOD.replace("R: 0.5", "R: .nan"), 4, "nan"),
        (GOOD.replace("R: 0.5", "R: 0.4"), 4, "sum to 0.9, not 1"),
        (GOOD.replace("R: 0.5", "R: 0.25, R: 0.25"), 4, "more than once"),
        (GOOD.replace("R: 0.5", "R T: 0.5"), 4, "listed more than once"),
        (GOOD.replace("T: triangle", "T: rectangle"), 1, "'rectangle' is in the frame more than once"),
        (GOOD.replace("T: triangle", "frame: triangle"), 1, "other than 'frame'"),
        (GOOD.replace("frame: {R", "fame: {R"), 1, "unknown entry 'fame'"),
        (GOOD.split("classes")[0], 1, "'classes' is missing"),
        (GOOD + "reading: loud\n", 5, "unknown reading 'loud'"),
        (GOOD + "reading: {pooling: median}\n", 5, "pooling must be one of"),
        (GOOD + "reading: {volume: 11}\n", 5, "unknown choice 'volume'"),
        (GOOD + "reading: {sharpness: much}\n", 5, "sharpness must be a number"),
        (GOOD + "attributes: {Q: [a]}\n", 5, "unknown label 'Q'"),
        (GOOD + "attributes: {R: four}\n", 5, "must be a list"),
        (GOOD.replace("{R: 0.5, frame: 0.5}", "{}"), 4, "at least one entry"),
        (GOOD.replace("{R: 0.5, frame: 0.5}", "[1]"), 4, "must be a mapping"),
        (GOOD.replace("R: 0.5", "[R]: 0.5"), 4, "must be a name"),
    ],
)
def test_errors_name_file_line_and_expectation(text: str, line: int | None, says: str) -> None:
    with pytest.raises(KnowledgeError) as caught:
        parse_knowledge(text, "mine.yaml")
    message = str(caught.value)
    assert says in message
    assert "\n" not in message
    found = re.match(r"mine\.yaml(?::(\d+))?: ", message)
    assert found is not None
    assert found.group(1) == (None if line is None else str(line))


def test_missing_and_unreadable_files(tmp_path: Path) -> None:
    with pytest.raises(KnowledgeError, match=r"nowhere\.yaml: no such file.*chapter-shape"):
        load_knowledge(tmp_path / "nowhere.yaml")
    with pytest.raises(KnowledgeError, match="can't be read"):
        load_knowledge(tmp_path)
    binary = tmp_path / "binary.yaml"
    binary.write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(KnowledgeError, match="not UTF-8"):
        load_knowledge(binary)
    with pytest.raises(KnowledgeError, match="no built-in"):
        built_in_text("tables")
