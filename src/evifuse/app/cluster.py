"""Parts computed by the workers of a Dask cluster, which read their own rows and write their own parts."""

import logging
import re
import signal
import uuid
from collections.abc import Generator, Iterator
from contextlib import ExitStack, contextmanager
from multiprocessing import resource_tracker
from typing import Any

from evifuse.app.job import Job, classify_part, prepared
from evifuse.app.parts import Parts
from evifuse.errors import MissingExtraError, UsageError

__all__ = ["compute_on_worker", "on_cluster"]

PATIENCE = 10
"""Seconds to wait for a scheduler, and then for a first worker."""

FAILURES = 10
"""Workers that a part may lose before it is given up."""


def on_cluster(job: Job, todo: list[int], scheduler: str) -> Iterator[int]:
    """Compute parts on a cluster.

    Parameters
    ----------
    job : Job
        What is to be done.
    todo : list of int
        Numbers of the parts.
    scheduler : str
        ``local``, ``local:N`` for N processes, or ``tcp://host:port``.

    Yields
    ------
    int
        Number of a part that is finished.

    Raises
    ------
    MissingExtraError
        If distributed is not installed.
    UsageError
        If the scheduler is not one of these, nobody answers there, or workers were lost again and again.
    """
    try:
        import distributed
    except ImportError as error:
        raise MissingExtraError("--scheduler needs distributed: pip install 'evifuse[cluster]'") from error
    run = uuid.uuid4().hex
    with _client(scheduler) as client:
        futures = {
            client.submit(compute_on_worker, job, index, key=f"evifuse-{run}-{index}", pure=False): index
            for index in todo
        }
        try:
            for future in distributed.as_completed(futures):
                future.result()
                yield futures[future]
                future.release()
        except distributed.KilledWorker as error:
            raise UsageError(
                f"workers died {FAILURES} times on the same part: "
                "is their memory too small? A smaller --rows-per-part needs less"
            ) from error


def compute_on_worker(job: Job, index: int) -> None:
    """Compute one part, in a worker process.

    Parameters
    ----------
    job : Job
        What is to be done.
    index : int
        Number of the part.

    Raises
    ------
    UsageError
        If the worker does not see the same folder.
    """
    parts = Parts(job.folder)
    if parts.fingerprint() != dict(job.made_from):
        raise UsageError(
            f"{job.folder}: a worker does not see this folder: all workers need the same file system"
        )
    classify_part(prepared(job), parts, index, lambda rows: None)


@contextmanager
def _client(scheduler: str) -> Generator[Any]:
    import distributed
    from dask.config import set as configured

    quiet = {"distributed.scheduler.allowed-failures": FAILURES, "logging.distributed": "critical"}
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with configured(quiet):
        if scheduler.startswith("tcp://"):
            with _remote(scheduler) as client:
                yield client
            return
        match = re.fullmatch(r"local(?::([1-9]\d{0,3}))?", scheduler)
        if not match:
            raise UsageError(f"--scheduler {scheduler}: expected local, local:N or tcp://host:port")
        with ExitStack() as stack:
            with _without_interrupts():
                cluster = distributed.LocalCluster(
                    n_workers=int(match[1]) if match[1] else None,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address=None,  # pyright: ignore[reportArgumentType]
                    memory_limit=0,
                    silence_logs=logging.CRITICAL,
                )
                stack.enter_context(cluster)
            yield stack.enter_context(distributed.Client(cluster))


@contextmanager
def _without_interrupts() -> Generator[None]:
    """Threads and processes that begin here never see Ctrl-C: this process does, and stops them in order."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # which would lift the block if it began within it
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _remote(address: str) -> Generator[Any]:
    import distributed

    try:
        client = distributed.Client(address, timeout=PATIENCE)
    except (OSError, TimeoutError, ValueError) as error:
        raise UsageError(f"--scheduler {address}: nobody answers there within {PATIENCE} s") from error
    with client:
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError as error:
            raise UsageError(f"--scheduler {address}: it has no workers") from error
        yield client
