"""Classifying Parquet files: the same bytes whatever happens on the way; one line when it can't be done."""

import json
import multiprocessing
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import distributed
import numpy as np
import psutil
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from evifuse.app import cluster as cluster_module
from evifuse.app import stream
from evifuse.app.job import make_job
from evifuse.app.main import main
from evifuse.app.parts import opened_parts
from evifuse.app.rows import open_rows
from evifuse.app.stream import classify_file
from evifuse.belief import Frame, MassFunction
from evifuse.belief.files import from_parquet, to_parquet
from evifuse.conductivity import READINGS, Aggregate, KnowledgeBase, classify
from evifuse.errors import (
    BeliefError,
    EvifuseError,
    FrameError,
    KnowledgeError,
    MissingExtraError,
    UsageError,
)
from evifuse.knowledge import built_in_text, load_knowledge

KNOWLEDGE = load_knowledge("curvature")
SETS = [
    ("triangle", "P"),
    ("rectangle", "square", "P"),
    ("ellipse", "bracket", "H"),
    ("P", "C-", "E-"),
    KNOWLEDGE.frame,
]
ROWS, PART = 2000, 450


def evidence(rows: int = ROWS, seed: int = 0) -> MassFunction:
    """Rows that lean to one focal set each, some without mass on others."""
    random = np.random.default_rng(seed)
    masses = random.standard_exponential((rows, len(SETS))) ** 2
    masses[np.arange(rows), random.integers(0, len(SETS), rows)] += 6.0
    masses[random.random(masses.shape) < 0.2] = 0.0
    masses[:, -1] += 0.01
    return MassFunction(KNOWLEDGE.frame, SETS, masses / masses.sum(axis=1, keepdims=True))


@pytest.fixture
def source(tmp_path: Path) -> Path:
    path = tmp_path / "masses.parquet"
    to_parquet(evidence(), path)
    return path


def rewrite(path: Path, change: Callable[[pa.Table], pa.Table], row_group_size: int = 700) -> None:
    table = pq.read_table(path)
    changed = change(table).replace_schema_metadata(table.schema.metadata)
    pq.write_table(changed, path, row_group_size=row_group_size)


def with_row(path: Path, row: int, values: object) -> None:
    """The same file with one row replaced by whatever it is."""

    def change(table: pa.Table) -> pa.Table:
        rows = table.column("masses").to_pylist()
        rows[row] = values
        kind = table.schema.field("masses").type
        return table.set_column(0, "masses", pa.array(rows, kind))

    rewrite(path, change)


def plain_bytes(source: Path) -> bytes:
    """The output without interruption, in this process."""
    out = source.with_name("plain.parquet")
    classify_file(source, out, KNOWLEDGE, rows_per_part=PART)
    return out.read_bytes()


def begun(*arguments: object) -> "subprocess.Popen[str]":
    command = [sys.executable, "-m", "evifuse", "classify", *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def wait_for(happened: Callable[[], object]) -> None:
    """Look often, so that something short is not missed."""
    until = time.monotonic() + 60
    while not happened():
        assert time.monotonic() < until
        time.sleep(0.001)


def parts_of(out: Path) -> list[Path]:
    return list(out.with_name(out.name + ".parts").glob("part-*.arrow"))


# What is written


@pytest.mark.parametrize("reading", [None, *(name for name in READINGS if name != "printed")])
def test_output_is_what_classify_gives(source: Path, tmp_path: Path, reading: str | None) -> None:
    out = tmp_path / "out.parquet"
    chosen = None if reading is None else READINGS[reading]
    summary = classify_file(source, out, KNOWLEDGE, chosen, rows_per_part=PART)
    expected = classify(from_parquet(source), KNOWLEDGE, chosen)
    table = pq.read_table(out)
    assert table.column_names == ["decision", "conductivities", "masses"]
    found = np.array(table.column("conductivities").to_pylist())
    np.testing.assert_allclose(found, expected.conductivities, rtol=0, atol=1e-10)
    names = [None if i < 0 else KNOWLEDGE.classes[i] for i in expected.decisions.tolist()]
    assert table.column("decision").to_pylist() == names
    assert pa.types.is_dictionary(table.schema.field("decision").type)
    belief = from_parquet(out)
    assert belief.frame == expected.belief.frame
    np.testing.assert_allclose(belief.on(expected.belief.focal_sets), expected.belief.masses, atol=1e-10)
    assert (summary.rows, summary.computed) == (ROWS, ROWS)
    assert {**summary.decisions, None: summary.undecided} == {
        name: names.count(name) for name in [*KNOWLEDGE.classes, None]
    }
    assert reading == "sound" or set(names) >= set(KNOWLEDGE.classes)
    assert not out.with_name("out.parquet.parts").exists()


def test_nothing_is_decided_where_nothing_conducts(tmp_path: Path) -> None:
    source, out = tmp_path / "in.parquet", tmp_path / "out.parquet"
    to_parquet(MassFunction(KNOWLEDGE.frame, SETS, [[0, 0, 0, 0, 1], [0.8, 0, 0, 0, 0.2]]), source)
    summary = classify_file(source, out, KNOWLEDGE)
    assert pq.read_table(out).column("decision").to_pylist() == [None, "quasiplanar"]
    assert summary.undecided == 1
    assert from_parquet(out)[0].as_dict() == {"frame": 1.0}


def test_metadata_names_knowledge_and_reading(source: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.parquet"
    classify_file(source, out, KNOWLEDGE, READINGS["sound"])
    made = json.loads(pq.read_schema(out).metadata[b"evifuse.classify"])
    assert made["knowledge"] == KNOWLEDGE.name
    assert len(made["sha256"]) == 64
    assert made["reading"]["commitment"] is None


def test_other_columns_are_carried_over(source: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.parquet"
    labels = [None if i % 7 == 0 else f"l{i % 5}" for i in range(ROWS)]

    def change(table: pa.Table) -> pa.Table:
        table = table.add_column(0, "id", pa.array(range(ROWS)))
        chunks = [pa.array(labels[:900]).dictionary_encode(), pa.array(labels[900:]).dictionary_encode()]
        table = table.append_column("label", pa.chunked_array(chunks))
        return table.append_column("tags", pa.array([["a"] * (i % 3) for i in range(ROWS)]))

    rewrite(source, change)
    classify_file(source, out, KNOWLEDGE, rows_per_part=PART)
    table = pq.read_table(out)
    assert table.column_names == ["id", "label", "tags", "decision", "conductivities", "masses"]
    assert table.column("id").to_pylist() == list(range(ROWS))
    assert table.column("label").to_pylist() == labels
    assert table.column("tags").to_pylist() == [["a"] * (i % 3) for i in range(ROWS)]


def test_every_layout_with_the_same_sets_for_all_rows(tmp_path: Path) -> None:
    base, source, out = load_knowledge("shape"), tmp_path / "in.parquet", tmp_path / "out.parquet"
    m = MassFunction(base.frame, ["square", "circle", base.frame], np.full((2, 3, 3), 1 / 3))
    single = MassFunction.of(base.frame, {"triangle": 0.9, base.frame: 0.1})
    part = MassFunction.of(Frame(["circle", "ellipse"]), {"circle": 0.7, ("circle", "ellipse"): 0.3})
    for given in (m, m.to("singletons"), m.to("dense"), single, part, m[:0]):
        to_parquet(given, source)
        classify_file(source, out, base)
        expected, found = classify(given, base).belief, from_parquet(out)
        assert found.batch == expected.batch
        np.testing.assert_allclose(found.on(expected.focal_sets), expected.masses, atol=1e-10)


def test_lists_of_any_length_do_if_all_are_right(source: Path, tmp_path: Path) -> None:
    expected = plain_bytes(source)

    def change(table: pa.Table) -> pa.Table:
        return table.set_column(0, "masses", table.column("masses").cast(pa.list_(pa.float64())))

    rewrite(source, change)
    assert plain_bytes(source) == expected
    with_row(source, 1234, [0.5, 0.5])
    with pytest.raises(BeliefError, match=r"masses.parquet: row 1234 of 'masses' has 2 numbers, not 5"):
        classify_file(source, tmp_path / "out.parquet", KNOWLEDGE)


@pytest.mark.parametrize("name", ["local:4.parquet", "s3:", "a b%20c ü.pq", "-dash"])
def test_names_that_look_like_something_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.chdir(tmp_path)
    to_parquet(evidence(9), name)
    classify_file(Path(name), Path("out-" + name), KNOWLEDGE)
    classify_file(Path(name), Path("plain"), KNOWLEDGE)
    assert Path("out-" + name).read_bytes() == Path("plain").read_bytes()


def test_a_single_class(source: Path, tmp_path: Path) -> None:
    one = KnowledgeBase("one", KNOWLEDGE.frame, (KNOWLEDGE.aggregates[0],), KNOWLEDGE.reading)
    classify_file(source, tmp_path / "out.parquet", one)
    assert from_parquet(tmp_path / "out.parquet") == classify(from_parquet(source), one).belief


def test_a_row_group_of_the_input_may_be_larger_or_smaller_than_a_part(source: Path) -> None:
    expected = plain_bytes(source)
    for size in (7, ROWS):
        rewrite(source, lambda table: table, size)
        assert plain_bytes(source) == expected


# Bad input: one line with file and row


@pytest.mark.parametrize(
    ("values", "what"),
    [
        ([0.5, np.nan, 0.0, 0.0, 0.5], r"mass nan of 'rectangle\|square\|P' is not a finite number"),
        ([np.inf, 0.0, 0.0, 0.0, 0.5], r"mass inf of 'triangle\|P' is not a finite number"),
        ([1.5, -0.5, 0.0, 0.0, 0.0], r"mass -0.5 of 'rectangle\|square\|P' is negative"),
        ([0.5, 0.4, 0.0, 0.0, 0.0], "masses sum to 0.9, not 1: put the balance on the frame"),
        ([0.5, None, 0.0, 0.0, 0.5], "lacks a number"),
        (None, "is empty"),
    ],
)
def test_a_bad_row_is_named(source: Path, tmp_path: Path, values: object, what: str) -> None:
    with_row(source, 1717, values)
    with pytest.raises(BeliefError, match=rf"masses\.parquet: row 1717.* {what}"):
        classify_file(source, tmp_path / "out.parquet", KNOWLEDGE, rows_per_part=PART)
    assert not (tmp_path / "out.parquet").exists()
    with_row(source, 1717, [0.5, 0.0, 0.0, 0.0, 0.5])
    classify_file(source, tmp_path / "out.parquet", KNOWLEDGE, rows_per_part=PART)


def test_the_row_number_counts_through_the_whole_file(tmp_path: Path) -> None:
    source, rows = tmp_path / "masses.parquet", 200_000
    m = evidence(rows)
    bad = m.masses.copy()
    bad[177_777, 0] += 0.25
    to_parquet(m, source)
    wrong = pa.FixedSizeListArray.from_arrays(pa.array(bad.ravel()), len(SETS))
    rewrite(source, lambda table: table.set_column(0, "masses", wrong), 30_000)
    with pytest.raises(BeliefError, match=r"row 177777: masses sum to 1.25"):
        classify_file(source, tmp_path / "out.parquet", KNOWLEDGE, rows_per_part=90_000)


def refused(source: Path, what: str, kind: type[EvifuseError] = BeliefError) -> None:
    out = source.with_name("out.parquet")
    with pytest.raises(kind, match=what) as error:
        classify_file(source, out, KNOWLEDGE)
    assert "\n" not in str(error.value)
    assert not out.exists()
    assert not out.with_name("out.parquet.parts").exists()


def test_input_of_another_kind_is_refused(source: Path) -> None:
    refused(source.with_name("none.parquet"), "none.parquet: can't be read: No such file")
    to_parquet(evidence(9).to("padded"), source)
    refused(source, r"each row has focal sets of its own.*\.to\(\"shared\"\)")
    to_parquet(MassFunction.of(Frame(["egg", "hen"]), {"egg": 1.0}), source)
    refused(
        source, "masses.parquet: the frame .* lacks 'egg'.*knowledge base 'curvature features'", FrameError
    )
    to_parquet(MassFunction(KNOWLEDGE.frame, [(), "P"], [0.1, 0.9], open_world=True), source)
    refused(source, "empty set")
    pq.write_table(pa.table({"masses": [[1.0]]}), source)
    refused(source, "not an evifuse mass function")
    to_parquet(evidence(9), source)
    rewrite(source, lambda t: t.append_column("decision", pa.array(range(9))))
    refused(source, "has a column 'decision' already: give it another name")
    to_parquet(evidence(9), source)
    rewrite(source, lambda t: t.slice(0, 5))
    refused(source, "5 rows in 'masses', not the 9 of the header")
    to_parquet(evidence(9), source)
    rewrite(source, lambda t: t.set_column(0, "masses", t.column(0).cast(pa.list_(pa.float32(), 5))))
    refused(source, "not lists of doubles")
    source.write_bytes(b"")
    refused(source, "not Parquet, or was cut off")


def test_a_file_that_was_cut_off_or_damaged(source: Path, tmp_path: Path) -> None:
    rewrite(source, lambda table: table)
    whole = source.read_bytes()
    source.write_bytes(whole[: len(whole) // 2])
    refused(source, "masses.parquet: this is not Parquet, or was cut off")
    hole = len(whole) // 3
    source.write_bytes(whole[:hole] + bytes(4000) + whole[hole + 4000 :])
    with pytest.raises(BeliefError, match=r"masses\.parquet: "):
        classify_file(source, tmp_path / "out.parquet", KNOWLEDGE)
    assert not (tmp_path / "out.parquet").exists()


def test_where_nothing_can_be_written(source: Path, tmp_path: Path) -> None:
    for out, what in (
        (source, "would replace its input"),
        (tmp_path, "this is a folder"),
        (tmp_path / "no" / "out.parquet", "does not exist: create it first"),
    ):
        with pytest.raises(UsageError, match=what):
            classify_file(source, out, KNOWLEDGE)
    alias = tmp_path / "alias.parquet"
    alias.hardlink_to(source)
    with pytest.raises(UsageError, match="would replace its input"):
        classify_file(source, alias, KNOWLEDGE)
    with pytest.raises(UsageError, match="at least 1"):
        classify_file(source, tmp_path / "out.parquet", KNOWLEDGE, rows_per_part=0)


def test_a_reading_that_cannot_be_used_is_refused(source: Path, tmp_path: Path) -> None:
    with pytest.raises(KnowledgeError, match="similarity_offset"):
        classify_file(source, tmp_path / "out.parquet", KNOWLEDGE, READINGS["printed"])


def test_an_output_that_exists_is_replaced_in_one_step(source: Path, tmp_path: Path) -> None:
    expected = plain_bytes(source)
    out = tmp_path / "out.parquet"
    out.write_bytes(b"old")
    classify_file(source, out, KNOWLEDGE, rows_per_part=PART)
    assert out.read_bytes() == expected


# What survives a kill


def die_at(step: int, source: Path, out: Path) -> None:
    """In a process of its own: be killed before or after a file is put on the disk or into its place."""
    count = 0

    def counted(real: Callable[..., object]) -> Callable[..., object]:
        def call(*arguments: object) -> object:
            nonlocal count
            count += 1
            if count == step:
                os.kill(os.getpid(), signal.SIGKILL)
            done = real(*arguments)
            count += 1
            if count == step:
                os.kill(os.getpid(), signal.SIGKILL)
            return done

        return call

    os.fsync, os.replace = counted(os.fsync), counted(os.replace)  # type: ignore[assignment]
    classify_file(source, out, KNOWLEDGE, rows_per_part=1000)


STEPS = 16  # the manifest, two parts and the joined file: each before and after two calls


@pytest.mark.parametrize("every", [3, pytest.param(1, marks=pytest.mark.slow)])
def test_killed_at_any_moment_and_done_again_gives_the_same_bytes(
    source: Path, tmp_path: Path, every: int
) -> None:
    plain = tmp_path / "plain.parquet"
    classify_file(source, plain, KNOWLEDGE, rows_per_part=1000)
    processes = multiprocessing.get_context("forkserver")
    processes.set_forkserver_preload(["evifuse.app.stream", "tests.app.test_classify"])
    computed: list[int] = []
    for step in [*range(1, STEPS + 1, every), STEPS + 1]:
        out = tmp_path / f"out-{step}.parquet"
        process = processes.Process(target=die_at, args=(step, source, out))
        process.start()
        process.join()
        assert process.exitcode == (-signal.SIGKILL if step <= STEPS else 0)
        summary = classify_file(source, out, KNOWLEDGE, rows_per_part=1000)
        computed.append(summary.computed)
        assert out.read_bytes() == plain.read_bytes()
        assert not out.with_name(out.name + ".parts").exists()
    assert set(computed) == {0, 1000, 2000}


def test_a_real_kill_of_the_command(source: Path, tmp_path: Path) -> None:
    out, arguments = tmp_path / "out.parquet", ["--knowledge", "curvature", "--rows-per-part", 20]
    classify_file(source, tmp_path / "plain.parquet", KNOWLEDGE, rows_per_part=20)
    process = begun(source, "-o", out, *arguments)
    wait_for(lambda: len(parts_of(out)) >= 3)
    process.kill()
    process.communicate()
    assert not out.exists()
    there = len(parts_of(out))
    assert 3 <= there < 100
    notices: list[str] = []
    classify_file(source, out, KNOWLEDGE, rows_per_part=20, notice=notices.append)
    assert notices == [f"going on: {there} of 100 parts are there already"]
    assert out.read_bytes() == (tmp_path / "plain.parquet").read_bytes()


def test_an_interrupt_says_how_to_go_on(source: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.parquet"
    process = begun(source, "-o", out, "--knowledge", "curvature", "--rows-per-part", 2)
    wait_for(lambda: parts_of(out))
    process.send_signal(signal.SIGINT)
    _, error = process.communicate()
    assert process.returncode == 130
    assert error.startswith("evifuse: stopped: ")
    assert error.endswith("of 1000 parts are done; the same command goes on from there\n")
    assert error.count("\n") == 1
    assert not out.exists()


@pytest.mark.parametrize("rows_per_part", [100, ROWS])  # fails while joining, and while writing a part
def test_a_full_disk_is_one_line(source: Path, tmp_path: Path, rows_per_part: int) -> None:
    out = tmp_path / "out.parquet"
    command = [sys.executable, "-m", "evifuse", "classify", str(source), "--knowledge", "curvature"]
    done = subprocess.run(
        [*command, "-o", str(out), "--rows-per-part", str(rows_per_part)],
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, 50_000)),
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert done.stderr.endswith(": writing failed: File too large (the same command goes on later)\n")
    assert not out.exists()


def interrupted(source: Path, out: Path) -> Path:
    """A folder as a kill leaves it: all parts there, nothing joined."""
    job = make_job(open_rows(source), Path(f"{out}.parts"), KNOWLEDGE, KNOWLEDGE.reading, PART)
    with opened_parts(job.folder, dict(job.made_from)) as (parts, _):
        worker = stream.prepared(job)
        for index in range(-(-ROWS // PART)):
            stream.classify_part(worker, parts, index, lambda rows: None)
    (job.folder / "part-00000009.0123.tmp").write_bytes(b"half of a part")
    return job.folder


@pytest.mark.parametrize("harm", ["flipped", "cut", "empty", "removed"])
def test_a_damaged_part_is_computed_again(source: Path, tmp_path: Path, harm: str) -> None:
    expected, out = plain_bytes(source), tmp_path / "out.parquet"
    part = interrupted(source, out) / "part-00000003.arrow"
    content = part.read_bytes()
    if harm == "removed":
        part.unlink()
    elif harm == "flipped":
        part.write_bytes(content[:2000] + bytes([content[2000] ^ 1]) + content[2001:])
    else:
        part.write_bytes(content[: len(content) - 100] if harm == "cut" else b"")
    notices: list[str] = []
    summary = classify_file(source, out, KNOWLEDGE, rows_per_part=PART, notice=notices.append)
    assert out.read_bytes() == expected
    there = 4 if harm == "removed" else 5
    assert notices[0] == f"going on: {there} of 5 parts are there already"
    assert notices[1:] == ([] if harm == "removed" else ["part 3 is damaged: computing it again"])
    assert summary.rows == ROWS
    assert summary.computed == (PART if harm == "removed" else 0)


@pytest.mark.parametrize("change", ["input", "knowledge", "reading", "rows per part"])
def test_parts_of_something_else_are_not_used(source: Path, tmp_path: Path, change: str) -> None:
    out, other = tmp_path / "out.parquet", tmp_path / "other.parquet"
    interrupted(source, out)
    base, reading, size = KNOWLEDGE, KNOWLEDGE.reading, PART
    if change == "input":
        to_parquet(evidence(seed=1), source)
    elif change == "knowledge":
        masses = MassFunction.of(base.frame, {("triangle", "P"): 0.6, base.frame: 0.4})
        changed = Aggregate("quasiplanar", {**base.aggregates[0].prototypes, "Q_2": masses})
        base = KnowledgeBase(base.name, base.frame, (changed, *base.aggregates[1:]), base.reading)
    elif change == "reading":
        reading = READINGS["sound"]
    else:
        size = 460
    notices: list[str] = []
    summary = classify_file(source, out, base, reading, rows_per_part=size, notice=notices.append)
    assert notices == [f"{out}.parts was made from something else ({change} changed): starting afresh"]
    assert summary.computed == ROWS
    classify_file(source, other, base, reading, rows_per_part=size)
    assert out.read_bytes() == other.read_bytes()


def test_a_folder_of_another_kind_is_left_alone(source: Path, tmp_path: Path) -> None:
    folder = tmp_path / "out.parquet.parts"
    folder.mkdir()
    (folder / "thesis.txt").write_text("years of work")
    with pytest.raises(UsageError, match=r"thesis.txt is not of this command"):
        classify_file(source, tmp_path / "out.parquet", KNOWLEDGE)
    assert (folder / "thesis.txt").read_text() == "years of work"


def test_two_runs_do_not_share_a_folder(source: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.parquet"
    folder = interrupted(source, out)
    with opened_parts(folder, {}), pytest.raises(UsageError, match="another run is using it"):
        classify_file(source, out, KNOWLEDGE, rows_per_part=PART)


def test_an_input_that_changes_meanwhile_gives_no_output(source: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.parquet"

    def touch(done: int, rows: int) -> None:
        os.utime(source, ns=(1, 1))

    with pytest.raises(UsageError, match="was changed while it was read"):
        classify_file(source, out, KNOWLEDGE, progress=touch)
    assert not out.exists()


# The command


def test_json_says_what_was_decided(source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, knowledge = tmp_path / "out.parquet", tmp_path / "own.yaml"
    knowledge.write_text(built_in_text("curvature"))
    with pytest.raises(SystemExit) as stopped:
        main(["classify", str(source), "--knowledge", str(knowledge), "-o", str(out), "--json"])
    assert stopped.value.code == 0
    printed, error = capsys.readouterr()
    assert error == ""
    found = json.loads(printed)
    assert found["rows"] == sum(found["decisions"].values()) + found["undecided"] == ROWS
    assert found["rows_per_second"] > 0
    plain = tmp_path / "plain.parquet"
    classify_file(source, plain, KNOWLEDGE)
    assert pq.read_table(plain).equals(pq.read_table(out))


@pytest.mark.parametrize(
    ("arguments", "what"),
    [
        (["--reading", "loud"], "--reading loud: expected sound, "),
        (["--scheduler", "remote"], "--scheduler remote: expected local, local:N or tcp://host:port"),
        (["--scheduler", "local:0"], "--scheduler local:0: expected local"),
        (["--rows-per-part", "-1"], "--rows-per-part must be at least 1"),
    ],
)
def test_wrong_options_are_one_line(
    source: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], what: str
) -> None:
    out = source.with_name("out.parquet")
    with pytest.raises(SystemExit) as stopped:
        main(["classify", str(source), "--knowledge", "curvature", "-o", str(out), *arguments])
    assert stopped.value.code == 2
    error = capsys.readouterr().err
    assert error.startswith(f"evifuse: {what}")
    assert error.count("\n") == 1


# On a cluster


def workers_of(process: "subprocess.Popen[str]") -> list[psutil.Process]:
    children = psutil.Process(process.pid).children(recursive=True)
    return [child for child in children if "spawn_main" in " ".join(child.cmdline())]


def test_workers_of_a_local_cluster_give_the_same_bytes_although_one_is_killed(
    source: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out.parquet"
    classify_file(source, tmp_path / "plain.parquet", KNOWLEDGE, rows_per_part=20)
    arguments = ["--knowledge", "curvature", "--rows-per-part", 20, "--scheduler", "local:2"]
    process = begun(source, "-o", out, *arguments)
    wait_for(lambda: len(parts_of(out)) >= 2)
    victim = workers_of(process)[0]
    victim.kill()
    assert len(parts_of(out)) < 100
    printed, error = process.communicate()
    assert (process.returncode, error) == (0, "")
    assert printed.startswith(f"Wrote {out}: 2000 rows in ")
    assert out.read_bytes() == (tmp_path / "plain.parquet").read_bytes()


@pytest.mark.slow
def test_one_and_four_workers_and_none_give_the_same_bytes(tmp_path: Path) -> None:
    source = tmp_path / "masses.parquet"
    to_parquet(evidence(300_000), source)  # enough for the way that large batches take
    made: list[bytes] = []
    for scheduler in (None, "local:1", "local:4"):
        out = tmp_path / f"{scheduler}.parquet"
        classify_file(source, out, KNOWLEDGE, scheduler=scheduler, rows_per_part=40_000)
        made.append(out.read_bytes())
    assert made[0] == made[1] == made[2]


@pytest.mark.slow
@pytest.mark.parametrize("scheduler", ["local:2", None])
def test_an_interrupt_of_everything_in_the_terminal_is_one_line(
    source: Path, tmp_path: Path, scheduler: str | None
) -> None:
    out = tmp_path / "out.parquet"
    command = [sys.executable, "-m", "evifuse", "classify", str(source), "--knowledge", "curvature"]
    command += ["-o", str(out), "--rows-per-part", "5", *(["--scheduler", scheduler] if scheduler else [])]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
    wait_for(lambda: len(parts_of(out)) >= 3)
    os.killpg(process.pid, signal.SIGINT)
    _, error = process.communicate()
    assert process.returncode == 130
    assert error.startswith("evifuse: stopped: ")
    assert error.count("\n") == 1


def test_a_scheduler_elsewhere(source: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    expected, out = plain_bytes(source), tmp_path / "out.parquet"
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, protocol="tcp", dashboard_address=None
    ) as cluster:
        address = cluster.scheduler_address
        assert address.startswith("tcp://")
        classify_file(source, out, KNOWLEDGE, scheduler=address, rows_per_part=PART)
        assert out.read_bytes() == expected
        with_row(source, 1717, [0.5, 0.0, 0.0, 0.0, 0.4])
        with pytest.raises(BeliefError, match=r"masses\.parquet: row 1717: masses sum to 0.9"):
            classify_file(source, out, KNOWLEDGE, scheduler=address, rows_per_part=PART)
        cluster.scale(0)
        cluster.sync(cluster._correct_state)
        monkeypatch.setattr(cluster_module, "PATIENCE", 0.3)
        with pytest.raises(UsageError, match="it has no workers"):
            classify_file(source, out, KNOWLEDGE, scheduler=address, rows_per_part=PART)
    assert out.read_bytes() == expected


def test_a_scheduler_that_does_not_answer(
    source: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster_module, "PATIENCE", 0.3)
    for address in ("tcp://127.0.0.1:9", "tcp://nowhere.invalid:8786", "tcp://127.0.0.1", "tcp://:x"):
        with pytest.raises(UsageError, match=f"--scheduler {address}: nobody answers there"):
            classify_file(source, tmp_path / "out.parquet", KNOWLEDGE, scheduler=address)


def test_extras_that_are_missing_are_named(
    source: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out.parquet"
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'evifuse\[cluster\]'"):
        classify_file(source, out, KNOWLEDGE, scheduler="local:1")
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'evifuse\[parquet\]'"):
        classify_file(source, out, KNOWLEDGE)


def test_a_worker_without_the_folder_is_told(source: Path, tmp_path: Path) -> None:
    folder = tmp_path / "elsewhere" / "out.parquet.parts"
    job = make_job(open_rows(source), folder, KNOWLEDGE, KNOWLEDGE.reading, PART)
    with pytest.raises(UsageError, match="all workers need the same file system"):
        cluster_module.compute_on_worker(job, 0)
