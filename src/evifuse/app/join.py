"""Finished parts, joined in their order into one Parquet file."""

import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from types import TracebackType
from typing import Any

import numpy as np

from evifuse.app.arrow import pyarrow, writing
from evifuse.app.job import Worker, classify_part
from evifuse.app.parts import DamagedPartError, Parts

__all__ = ["ROW_GROUP", "Joiner"]

ROW_GROUP = 1 << 20
"""Rows of a row group of the output, but for its last and where a batch ends before."""


class Joiner:
    """Joins parts in a thread while others are still computed.

    It is a context: on leaving it, all parts have been joined and are on the disk.

    Parameters
    ----------
    worker : Worker
        Computes a part again that is found damaged.
    parts : Parts
        Where the parts are and the joined file goes.
    count : int
        How many parts there will be.
    notice : callable
        Gets lines for a person.
    """

    def __init__(self, worker: Worker, parts: Parts, count: int, notice: Callable[[str], None]) -> None:
        self.worker, self.parts, self.count, self.notice = worker, parts, count, notice
        self.decisions = np.zeros(len(worker.job.knowledge.classes) + 1, dtype=np.int64)
        self._there = parts.finished()
        self._joining: list[Future[None]] = []
        self._group: list[Any] = []
        self._pool = ThreadPoolExecutor(1)

    def __enter__(self) -> "Joiner":
        names = [*self.worker.rows.carried.names, "decision"]
        pa = pyarrow()
        with writing(self.parts.joined):
            self._file: Any = pa.OSFile(str(self.parts.joined), "wb")
            self._writer: Any = pa.parquet.ParquetWriter(
                self._file,
                self.worker.schema,
                compression="snappy",
                use_dictionary=names,
                write_statistics=names,
            )
        self._go_on()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self._pool.shutdown(cancel_futures=kind is not None)
            if kind is None:
                for join in self._joining:
                    join.result()
                self._flush()
        finally:
            with writing(self.parts.joined):
                try:
                    self._writer.close()
                finally:
                    self._file.close()
        with writing(self.parts.joined), self.parts.joined.open("rb+") as file:
            os.fsync(file.fileno())

    def ready(self, index: int) -> None:
        """Say that a part is finished.

        Parameters
        ----------
        index : int
            Its number.
        """
        self._there.add(index)
        self._go_on()

    def _go_on(self) -> None:
        """Join the parts whose turn it is; a failure so far comes up here."""
        for join in self._joining:
            if join.done():
                join.result()
        while len(self._joining) in self._there and len(self._joining) < self.count:
            self._joining.append(self._pool.submit(self._join, len(self._joining)))

    def _join(self, index: int) -> None:
        try:
            self._add(index)
        except DamagedPartError as error:
            self.notice(f"{error}: computing it again")
            classify_part(self.worker, self.parts, index, lambda rows: None)
            self._add(index)

    def _add(self, index: int) -> None:
        for batch in self.parts.read(index):
            codes = batch.column("decision").indices.fill_null(len(self.decisions) - 1)
            self.decisions += np.bincount(codes.to_numpy(), minlength=len(self.decisions))
            if sum(map(len, self._group)) + len(batch) > ROW_GROUP:
                self._flush()
            self._group.append(batch)

    def _flush(self) -> None:
        if self._group:
            with writing(self.parts.joined):
                table = pyarrow().Table.from_batches(self._group, self.worker.schema)
                self._writer.write_table(table, row_group_size=ROW_GROUP)
        self._group = []
