"""Large files of mass functions through a knowledge base, part by part, resumable after a kill."""

import json
import sys
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from evifuse.app.arrow import writing
from evifuse.app.job import Worker, classify_part, make_job, prepared
from evifuse.app.join import Joiner
from evifuse.app.parts import opened_parts
from evifuse.app.rows import MassRows, open_rows
from evifuse.conductivity import READINGS, KnowledgeBase, Reading
from evifuse.errors import UsageError
from evifuse.knowledge import load_knowledge

__all__ = ["ROWS_PER_PART", "Summary", "classify_file", "run_classify"]

ROWS_PER_PART = 1 << 20
"""Rows of a part."""


@dataclass(frozen=True)
class Summary:
    """What was done.

    Parameters
    ----------
    rows : int
        Rows of the output.
    computed : int
        Rows that were computed this time; the others were there from before.
    seconds : float
        Time that it took.
    decisions : mapping of str to int
        How many rows decide for each class.
    undecided : int
        How many rows conduct nothing.
    """

    rows: int
    computed: int
    seconds: float
    decisions: dict[str, int]
    undecided: int


def classify_file(
    source: Path,
    out: Path,
    knowledge: KnowledgeBase,
    reading: Reading | None = None,
    *,
    scheduler: str | None = None,
    rows_per_part: int = ROWS_PER_PART,
    notice: Callable[[str], None] = lambda text: None,
    progress: Callable[[int, int], None] = lambda done, rows: None,
) -> Summary:
    """Classify every row of a Parquet file of masses into another Parquet file.

    Parts are kept in a folder beside the output until all are done, so that the same call goes on after a
    kill. The bytes of the output depend on the input, the knowledge base, the reading, the rows per part and
    the versions of the libraries only: not on workers, interruptions or time.

    Parameters
    ----------
    source : Path
        What `evifuse.belief.to_parquet` writes, with the same focal sets for all rows; further columns are
        carried over.
    out : Path
        File to create or replace, in one step.
    knowledge : KnowledgeBase
        The classes; the masses are over its frame or some of its hypotheses.
    reading : Reading, optional
        How the formulas are read; the knowledge base's own by default.
    scheduler : str, optional
        ``local``, ``local:N`` or ``tcp://host:port``; in this process without it.
    rows_per_part : int
        How many rows a kill can cost, and what a worker gets at a time.
    notice : callable
        Gets lines for a person.
    progress : callable
        Gets how many rows are done, and of how many, from time to time.

    Returns
    -------
    Summary
        Rows, time and decisions.

    Raises
    ------
    BeliefError
        If the input is damaged or a row is not a mass function; the message names file and row.
    FrameError
        If the masses are about a hypothesis that the knowledge base's frame lacks.
    UsageError
        If the output can't be written there, or nobody answers at the scheduler's address.
    """
    began = time.monotonic()
    rows = _checked(source, out, rows_per_part)
    folder = out.with_name(out.name + ".parts")
    job = make_job(rows, folder, knowledge, reading or knowledge.reading, rows_per_part)
    worker = prepared(job)  # refuses what can't be classified before a folder is made
    count = -(-rows.count // rows_per_part)
    with opened_parts(folder, dict(job.made_from)) as (parts, changed):
        todo = sorted(set(range(count)) - parts.finished())
        if changed:
            notice(f"{folder} was made from something else ({changed} changed): starting afresh")
        elif len(todo) < count:
            notice(f"going on: {count - len(todo)} of {count} parts are there already")
        lengths = [stop - start for start, stop in (job.part(index, rows.count) for index in todo)]
        computed, done = sum(lengths), rows.count - sum(lengths)

        def advanced(by: int) -> None:
            nonlocal done
            done += by
            progress(done, rows.count)

        try:
            with Joiner(worker, parts, count, notice) as joiner:
                _compute(worker, joiner, todo, scheduler, advanced)
        except KeyboardInterrupt:
            there = f"{len(parts.finished())} of {count} parts are done"
            raise KeyboardInterrupt(f"stopped: {there}; the same command goes on from there") from None
        if open_rows(source).identity != rows.identity:
            raise UsageError(f"{source}: was changed while it was read: run the same command again")
        with writing(out):
            parts.joined.replace(out)
        parts.remove()
    counts = joiner.decisions.tolist()
    decisions = dict(zip(knowledge.classes, counts, strict=False))
    return Summary(rows.count, computed, time.monotonic() - began, decisions, counts[-1])


def _checked(source: Path, out: Path, rows_per_part: int) -> MassRows:
    """The input, once everything that can be known to go wrong has been refused."""
    if rows_per_part < 1:
        raise UsageError(f"--rows-per-part must be at least 1, not {rows_per_part}")
    if out.is_dir():
        raise UsageError(f"{out}: this is a folder, so nothing can be written there: name a file")
    if not out.absolute().parent.is_dir():
        raise UsageError(f"{out}: the folder {out.parent} does not exist: create it first")
    if out.exists() and source.exists() and out.samefile(source):
        raise UsageError(f"{out}: the output would replace its input: give another name")
    return open_rows(source)


def _compute(
    worker: Worker, joiner: Joiner, todo: list[int], scheduler: str | None, advanced: Callable[[int], None]
) -> None:
    """Compute the parts, here or on a cluster, and hand them on to be joined."""
    if scheduler is None:
        for index in todo:
            classify_part(worker, joiner.parts, index, advanced)
            joiner.ready(index)
        return
    from evifuse.app.cluster import on_cluster

    with closing(on_cluster(worker.job, todo, scheduler)) as finished:
        for index in finished:
            joiner.ready(index)
            start, stop = worker.job.part(index, worker.rows.count)
            advanced(stop - start)


def run_classify(
    source: Path,
    out: Path,
    knowledge: str,
    reading: str | None,
    scheduler: str | None,
    rows_per_part: int,
    as_json: bool,
) -> None:
    """Classify a file, with a bar on a terminal and a line at the end.

    Parameters
    ----------
    source : Path
        Parquet file of masses.
    out : Path
        Parquet file to write.
    knowledge : str
        Name or path of the classes.
    reading : str or None
        Name of a reading; the knowledge base's own without it.
    scheduler : str or None
        Where to compute.
    rows_per_part : int
        Rows of a part.
    as_json : bool
        Print JSON.

    Raises
    ------
    UsageError
        If there is no reading of that name.
    """
    if reading is not None and reading not in READINGS:
        raise UsageError(f"--reading {reading}: expected {', '.join(READINGS)}")
    base = load_knowledge(knowledge)
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(out.name, total=None)
        done = classify_file(
            source,
            out,
            base,
            None if reading is None else READINGS[reading],
            scheduler=scheduler,
            rows_per_part=rows_per_part,
            notice=lambda text: print(f"evifuse: {text}", file=sys.stderr),
            progress=lambda rows, total: bar.update(task, completed=rows, total=total),
        )
    speed = done.computed / done.seconds
    if as_json:
        found = {"file": str(out), **asdict(done), "rows_per_second": speed}
        sys.stdout.write(json.dumps(found) + "\n")
        return
    print(f"Wrote {out}: {done.rows} rows in {done.seconds:.2f} s, {speed:.0f} rows per second.")
