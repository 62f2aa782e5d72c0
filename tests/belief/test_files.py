import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from evifuse.belief import Frame, MassFunction, conjunctive
from evifuse.belief.files import from_csv, from_json, from_parquet, to_csv, to_json, to_parquet
from evifuse.errors import BeliefError, FrameError, MassError, MissingExtraError
from tests.belief.strategies import masses_over

FORMATS = {
    "json": (to_json, from_json),
    "csv": (to_csv, from_csv),
    "parquet": (to_parquet, from_parquet),
}
FRAME = Frame(["rectangle", "square", "triangle"], {"square": ["four sides", "equal sides"]})
BATCH = MassFunction(FRAME, ["rectangle", ("square", "triangle")], [[0.1, 0.9], [1 / 3, 2 / 3], [1.0, 0.0]])
formats = pytest.mark.parametrize("name", list(FORMATS))
names = st.lists(st.text(min_size=1, max_size=6), min_size=1, max_size=5, unique=True)


def _same(a: MassFunction, b: MassFunction) -> None:
    """Not one bit differs."""
    assert a.frame == b.frame
    assert a.layout == b.layout
    assert a.focal_sets.dtype == b.focal_sets.dtype == np.int64
    assert a.masses.dtype == b.masses.dtype == np.float64
    np.testing.assert_array_equal(a.focal_sets, b.focal_sets)
    assert a.masses.shape == b.masses.shape
    assert a.masses.tobytes() == b.masses.tobytes()


@st.composite
def anything(draw: st.DrawFn) -> MassFunction:
    """Any layout and batch over frames with awkward names, with and without attributes."""
    hypotheses = draw(names)
    listed = {hypotheses[0]: draw(st.lists(st.text(max_size=4), max_size=3))} if draw(st.booleans()) else None
    frame = Frame(hypotheses, listed)
    m = draw(masses_over(frame, draw(st.sampled_from([(), (1,), (3,), (0,), (2, 2), (2, 0)]))))
    if draw(st.booleans()) and m.masses.size:
        m = conjunctive(m, m).mass
    layout = draw(st.sampled_from([None, "shared", "padded", "dense", "singletons"]))
    if layout == "singletons":
        values = np.random.default_rng(1).dirichlet(np.ones(len(frame) + 1), size=m.batch)
        sets = [*(1 << k for k in range(len(frame))), frame.full]
        return MassFunction(frame, sets, values) if len(frame) > 1 else MassFunction.vacuous(frame, m.batch)
    return m.to(layout) if layout is not None and m.masses.size else m


@formats
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(m=anything())
def test_round_trips_are_exact(name: str, m: MassFunction, tmp_path: Path) -> None:
    write, read = FORMATS[name]
    path = tmp_path / f"m.{name}"
    write(m, path)
    _same(read(path), m)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@formats
def test_awkward_names_and_large_frames(name: str, tmp_path: Path) -> None:
    write, read = FORMATS[name]
    path = tmp_path / "m"
    frame = Frame(["a|b", "a", "b", "\\", "\\|", ",", '"', "\n", "\r\n", "∅", "frame", " x ", "#", "\x00"])
    m = MassFunction(frame, [1, 2, 6, 8, 16, 1 << 7, frame.full, frame.full - 1], np.full(8, 1 / 8))
    write(m, path)
    _same(read(path), m)
    large = Frame([f"h{i}" for i in range(62)])
    m = MassFunction(large, np.array([[1 << 61, 3], [large.full, 0]]), [[0.25, 0.75], [1.0, 0.0]])
    write(m, path)
    _same(read(path), m)
    tiny = MassFunction(FRAME, [1, 2], [5e-324, 1.0])
    write(tiny, path)
    _same(read(path), tiny)


def test_the_files_can_be_read_without_us(tmp_path: Path) -> None:
    to_csv(BATCH, tmp_path / "m.csv")
    lines = (tmp_path / "m.csv").read_text().splitlines()
    assert lines[0].startswith("# {")
    assert lines[1:4] == ["case,focal_set,mass", "0,rectangle,0.1", "0,square|triangle,0.9"]
    to_json(BATCH, tmp_path / "m.json")
    content = json.loads((tmp_path / "m.json").read_text())
    assert content["frame"] == ["rectangle", "square", "triangle"]
    assert content["attributes"]["square"] == ["equal sides", "four sides"]
    assert content["focal_sets"] == [["rectangle"], ["square", "triangle"]]
    assert content["masses"][1] == [1 / 3, 2 / 3]
    parquet = pytest.importorskip("pyarrow.parquet")
    to_parquet(BATCH, tmp_path / "m.parquet")
    assert parquet.read_table(tmp_path / "m.parquet").column("masses").to_pylist() == BATCH.masses.tolist()


@formats
def test_writing_is_whole_or_not_at_all(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write, read = FORMATS[name]
    path = tmp_path / f"m.{name}"
    write(BATCH, path)

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", full)
        with pytest.raises(BeliefError, match=r"writing failed: No space left"):
            write(BATCH[:1], path)
    _same(read(path), BATCH)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    with pytest.raises(BeliefError, match="this is a folder"):
        write(BATCH, tmp_path)
    with pytest.raises(BeliefError, match="create its folder first"):
        write(BATCH, tmp_path / "none" / "m")


@formats
def test_what_could_not_be_read_again_is_not_written(name: str, tmp_path: Path) -> None:
    bad = MassFunction.trusted(FRAME, np.array([1, 2], dtype=np.int64), np.array([0.5, 0.4]))
    with pytest.raises(MassError, match=r"sum to 0\.9"):
        FORMATS[name][0](bad, tmp_path / "m")
    assert not list(tmp_path.iterdir())


@formats
def test_files_that_are_not_ours(name: str, tmp_path: Path) -> None:
    read = FORMATS[name][1]
    with pytest.raises(BeliefError, match=r"none: can't be read: No such file"):
        read(tmp_path / "none")
    path = tmp_path / f"m.{name}"
    for content in (
        b"",
        b"PAR1",
        b"\xff\xfe\x00",
        b"{}",
        b"[1, 2]",
        b"null",
        b"# {}\n",
        b"# [\n",
        b"[" * 100_000,
    ):
        path.write_bytes(content)
        with pytest.raises(BeliefError, match=path.name):
            read(path)


@formats
@pytest.mark.parametrize("m", [BATCH, BATCH.to("padded"), BATCH.to("dense")], ids=lambda m: m.layout)
def test_spoilt_files_raise_our_errors_only(name: str, m: MassFunction, tmp_path: Path) -> None:
    write, read = FORMATS[name]
    path = tmp_path / f"m.{name}"
    write(m, path)
    content, rng = path.read_bytes(), np.random.default_rng(0)
    messages: list[str] = []
    for _ in range(80):
        spoilt = bytearray(content)
        if rng.random() < 0.3:
            del spoilt[rng.integers(len(spoilt)) :]
        else:
            for at in rng.integers(0, len(spoilt), rng.integers(1, 4)):
                spoilt[at] = rng.integers(32, 127)
        path.write_bytes(bytes(spoilt))
        try:
            read(path)
        except BeliefError as error:
            messages.append(str(error))
    assert len(messages) > 20
    assert all(message.startswith(str(path)) and "\n" not in message for message in messages)


def _edited(tmp_path: Path, name: str, m: MassFunction, edit: Callable[[str], str]) -> Path:
    path = tmp_path / f"m.{name}"
    FORMATS[name][0](m, path)
    before = path.read_text()
    after = edit(before)
    assert after != before
    path.write_text(after)
    return path


@pytest.mark.parametrize(
    ("old", "new", "error", "says"),
    [
        (
            "1,rectangle,0.333",
            "1,rectangle,x0.333",
            BeliefError,
            r"m.csv:5: mass 'x0.333\d+' of 'rectangle' is not",
        ),
        ("1,rectangle,0.333", "1,rectangle,0.433", MassError, "m.csv:6: masses sum to 1.1"),
        ("1,rectangle,0.333", "1,rectangle,-0.333", MassError, "m.csv:6: mass -0.333.* is negative"),
        ("1,rectangle,0.333", "1,rectangle,nan#", BeliefError, "m.csv:5: mass 'nan#"),
        ("2,rectangle,1.0", "2,rectangle,inf", MassError, "m.csv:8: mass inf of 'rectangle'"),
        ("1,rectangle,", "1,circle,", FrameError, "m.csv:5: unknown hypothesis 'circle'"),
        (
            "1,rectangle,",
            "1,square,",
            BeliefError,
            "m.csv:5: expected the mass of 'rectangle' here, not of 'square'",
        ),
        ("1,rectangle,", "2,rectangle,", BeliefError, "m.csv:5: expected a row of case 1, not 2"),
        ("1,rectangle,", "1,1,rectangle,", BeliefError, "m.csv:5: 4 columns, not 3"),
        ("2,square|triangle,0.0\n", "", BeliefError, "m.csv:7: the file ends before the 6 rows"),
        (
            "2,square|triangle,0.0\n",
            "2,square|triangle,0.0\n" * 2,
            BeliefError,
            "m.csv:9: more rows than the 6",
        ),
        ("case,focal_set", "focal_set", BeliefError, "m.csv:2: columns must be case,focal_set,mass"),
        ("[3, 2]", "[9000, 2]", BeliefError, "m.csv:2: the file is shorter"),
        ("[3, 2]", "[3, 5]", BeliefError, "m.csv:1: the header's shape"),
        ('"shared"', '"wide"', BeliefError, "m.csv:1: unknown layout 'wide'"),
        ('"layout"', '"layouts"', BeliefError, "m.csv:1: the header lacks or spoils 'layout'"),
        ('["rectangle", "square"', '["square", "square"', FrameError, "m.csv:1: hypothesis 'square' is in"),
    ],
)
def test_messages_of_csv_name_the_line(
    old: str, new: str, error: type[Exception], says: str, tmp_path: Path
) -> None:
    path = _edited(tmp_path, "csv", BATCH, lambda text: text.replace(old, new, 1))
    with pytest.raises(error, match=says):
        from_csv(path)


@pytest.mark.parametrize(
    ("old", "new", "error", "says"),
    [
        ("[0.1, 0.9]", "[0.1, 0.8]", MassError, r"m.json: masses at index \(0,\) sum to 0.9"),
        ("[0.1, 0.9]", "[0.1, NaN]", MassError, r"m.json: mass nan of .* at index \(0,\)"),
        ("[1.0, 0.0]", "[1.0]", BeliefError, r"m.json: row 2 of 'masses' is not numbers of shape \[2\]"),
        ("[1.0, 0.0]", '[1.0, "0"]', BeliefError, "m.json: row 2 of 'masses'"),
        ("[1.0, 0.0]", "[1.0, null]", BeliefError, "m.json: row 2 of 'masses'"),
        ('["rectangle"], [', '["circle"], [', FrameError, "m.json: unknown hypothesis 'circle'"),
        ('["rectangle"], [', '["rectangle"], ["rectangle"], [', BeliefError, "m.json: the header's shape"),
        ("[3, 2]", "[2, 2]", BeliefError, r"m.json: 'masses' has 3 rows, not shape \[2, 2\]"),
    ],
)
def test_messages_of_json_name_the_case(
    old: str, new: str, error: type[Exception], says: str, tmp_path: Path
) -> None:
    path = _edited(tmp_path, "json", BATCH, lambda text: text.replace(old, new, 1))
    with pytest.raises(error, match=says):
        from_json(path)


def test_messages_of_padded_json(tmp_path: Path) -> None:
    padded = BATCH.to("padded")
    for old, new, says in (
        ('"which": [\n  [1', '"which": [\n  [9', "points outside the 3 focal sets"),
        ('"which": [\n  [1', '"which": [\n  [0.5', "row 0 of 'which'"),
        ('[], ["rectangle"]', '[], ["circle"]', "focal_sets: unknown hypothesis 'circle'"),
    ):
        path = _edited(tmp_path, "json", padded, lambda text, o=old, n=new: text.replace(o, n, 1))
        with pytest.raises(BeliefError, match=says):
            from_json(path)


def test_messages_of_parquet_name_the_row(tmp_path: Path) -> None:
    pa, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    path = tmp_path / "m.parquet"
    to_parquet(BATCH, path)
    metadata = parquet.read_table(path).schema.metadata
    kind = pa.list_(pa.float64(), 2)
    for column, says in (
        (pa.array([[0.1, 0.9], [0.5, 0.4], [1, 0]], kind), r"m.parquet: masses at index \(1,\) sum to 0.9"),
        (pa.array([[0.1, 0.9], None, [1, 0]], kind), "m.parquet: row 1 of 'masses' is empty"),
        (pa.array([[0.1, 0.9], [0.5, None], [1, 0]], kind), "m.parquet: row 1 of 'masses' lacks a number"),
        (pa.array([[0.1, 0.9]], kind), "m.parquet: 1 rows in 'masses', not the 3"),
        (pa.array([[1, 0]] * 3, pa.list_(pa.int64(), 2)), "'masses' holds int64"),
        (pa.array([1.0] * 3), "'masses' does not hold lists of 2 numbers"),
        (pa.array([[1.0]] * 3, pa.list_(pa.float64(), 1)), "'masses' does not hold lists of 2 numbers"),
    ):
        parquet.write_table(pa.table({"masses": column}).replace_schema_metadata(metadata), path)
        with pytest.raises(BeliefError, match=says):
            from_parquet(path)
    parquet.write_table(pa.table({"x": [1]}).replace_schema_metadata(metadata), path)
    with pytest.raises(BeliefError, match="no column 'masses'"):
        from_parquet(path)


def test_without_pyarrow_the_message_says_how_to_get_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'evifuse\[parquet\]'"):
        to_parquet(BATCH, tmp_path / "m")
    with pytest.raises(MissingExtraError, match="parquet"):
        from_parquet(tmp_path / "m")


def test_importing_the_module_does_not_import_pyarrow() -> None:
    code = "import sys, evifuse.belief.files; print('pyarrow' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
