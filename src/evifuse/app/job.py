"""One part of a file of masses through a knowledge base: the same bytes wherever it is computed."""

import json
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from evifuse._version import __version__
from evifuse.app.arrow import pyarrow
from evifuse.app.parts import Parts
from evifuse.app.results import RESULTS, knowledge_hash, output_schema, result_columns
from evifuse.app.rows import MassRows, open_rows
from evifuse.belief import MassFunction, on_frame
from evifuse.conductivity import KnowledgeBase, Reading, normalised_belief
from evifuse.conductivity.compiled import CompiledClassifier
from evifuse.conductivity.compiled import compile as compile_knowledge
from evifuse.errors import BeliefError, FrameError, MassError

__all__ = ["Job", "Worker", "classify_part", "make_job", "prepared", "versions"]

T = TypeVar("T")


@dataclass(frozen=True)
class Job:
    """All that the parts depend on. Equal jobs give the same parts in the same place.

    Parameters
    ----------
    source : Path
        Parquet file of masses, absolute.
    folder : Path
        Folder for parts, absolute.
    rows_per_part : int
        Rows of each part but the last.
    reading : Reading
        How the formulas are read.
    knowledge : KnowledgeBase
        What the masses are conducted into.
    made_from : tuple of (str, str)
        What the content of the parts depends on, by name.
    """

    source: Path
    folder: Path
    rows_per_part: int
    reading: Reading
    knowledge: KnowledgeBase = field(compare=False)  # its hash is in made_from
    made_from: tuple[tuple[str, str], ...]

    def part(self, index: int, count: int) -> tuple[int, int]:
        """First row of a part, and the row after its last.

        Parameters
        ----------
        index : int
            Number of the part.
        count : int
            Rows in the file.

        Returns
        -------
        tuple of int
            Start and stop.
        """
        start = index * self.rows_per_part
        return start, min(start + self.rows_per_part, count)


def make_job(
    rows: MassRows, folder: Path, knowledge: KnowledgeBase, reading: Reading, rows_per_part: int
) -> Job:
    """A job from its ingredients.

    Parameters
    ----------
    rows : MassRows
        The input.
    folder : Path
        Where parts are kept.
    knowledge : KnowledgeBase
        The classes.
    reading : Reading
        How the formulas are read.
    rows_per_part : int
        Rows of each part but the last.

    Returns
    -------
    Job
        Ready to be sent to workers.
    """
    made_from = (
        ("input", rows.identity),
        ("knowledge", f"{knowledge.name} {knowledge_hash(knowledge)}"),
        ("reading", json.dumps(asdict(reading))),
        ("rows per part", str(rows_per_part)),
        ("versions", versions()),
    )
    return Job(rows.path.absolute(), folder.absolute(), rows_per_part, reading, knowledge, made_from)


def versions() -> str:
    """Versions of what decides about the bytes.

    Returns
    -------
    str
        Of evifuse, NumPy and pyarrow.
    """
    return f"evifuse {__version__}, NumPy {np.__version__}, pyarrow {pyarrow().__version__}"


@dataclass(frozen=True)
class Worker:
    """A job made ready to compute parts.

    Parameters
    ----------
    job : Job
        What is to be done.
    rows : MassRows
        The input, opened.
    classifier : CompiledClassifier
        For the focal sets of the input.
    columns : ndarray of int64, shape (F,)
        Which numbers of a row the classifier takes: all but that of the empty set.
    schema : pyarrow.Schema
        Columns of the output.
    """

    job: Job
    rows: MassRows
    classifier: CompiledClassifier
    columns: NDArray[np.int64]
    schema: Any


@lru_cache(maxsize=1)
def prepared(job: Job) -> Worker:
    """Open the input of a job and compile its knowledge base.

    Parameters
    ----------
    job : Job
        What is to be done.

    Returns
    -------
    Worker
        Remembered for the next part.

    Raises
    ------
    BeliefError
        If the input can't be read, or has a column by the name of a result.
    FrameError
        If it is about a hypothesis that the knowledge base lacks.
    """
    rows, base = open_rows(job.source), job.knowledge
    columns = np.flatnonzero(rows.focal_sets != 0)
    sets = rows.focal_sets[columns]
    like = MassFunction.trusted(rows.frame, sets, np.full(len(sets), 1 / len(sets)))
    try:
        met = on_frame(like, base.frame).focal_sets
    except FrameError as error:
        raise FrameError(f"{rows.path}: {error} (knowledge base {base.name!r})") from None
    for name in RESULTS:
        if name in rows.carried.names:
            raise BeliefError(f"{rows.path}: has a column {name!r} already: give it another name")
    classifier = compile_knowledge(base, met, job.reading)
    return Worker(job, rows, classifier, columns, output_schema(rows, job.knowledge, job.reading))


def classify_part(worker: Worker, parts: Parts, index: int, progress: Callable[[int], None]) -> None:
    """Compute one part and write it into the folder.

    Parameters
    ----------
    worker : Worker
        The job, prepared.
    parts : Parts
        Where the part goes.
    index : int
        Its number.
    progress : callable
        Gets the number of rows of each batch that is done.

    Raises
    ------
    BeliefError
        If a row is not a mass function.
    """
    rows = worker.rows.read(*worker.job.part(index, worker.rows.count))

    def batches() -> Iterator[Any]:
        for at, masses, carried in _ahead(rows):
            yield _classified(worker, at, masses, carried)
            progress(len(masses))

    parts.write(index, worker.schema, batches())


def _classified(worker: Worker, at: int, masses: NDArray[np.float64], carried: list[Any]) -> Any:
    """A batch of the output."""
    classifier = worker.classifier
    given = masses if len(worker.columns) == masses.shape[1] else masses[:, worker.columns]
    try:
        # by columns, because steps along the few classes of a row are slow
        conductivities = np.asfortranarray(classifier.conductivities(given))
    except MassError as error:
        worker.rows.refuse(masses, at)  # in the words of the door, with file and row
        raise MassError(f"{worker.rows.path}: from row {at}: {error}") from None
    whole = classifier.focal_sets == classifier.frame.full
    kept = given[:, whole].sum(axis=1) if classifier.reading.keep_ignorance else 0.0
    belief = normalised_belief(classifier.classes, conductivities, kept).masses
    if not belief.min(initial=0.0) >= 0:
        row = at + int(np.flatnonzero(~(belief >= 0).all(axis=1))[0])
        raise MassError(
            f"{worker.rows.path}: row {row}: this reading gives no valid belief: try another, such as 'sound'"
        )
    columns = [*carried, *result_columns(classifier.classes, conductivities, belief)]
    return pyarrow().record_batch(columns, schema=worker.schema)


def _ahead(items: Iterator[T]) -> Iterator[T]:
    """The same items, each next one fetched in a thread while the one before is used."""
    with ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(next, items, None)
        while (item := waiting.result()) is not None:
            waiting = pool.submit(next, items, None)
            yield item
