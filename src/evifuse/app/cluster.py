"""Parts computed by the workers of a Dask cluster, which read their own rows and write their own parts."""

import logging
import re
import signal
import uuid
import warnings
from collections.abc import Generator
from contextlib import ExitStack, contextmanager, suppress
from itertools import islice
from multiprocessing import resource_tracker
from typing import Any

from evifuse.app.arrow import one_line
from evifuse.app.job import Job, classify_part, prepared, versions
from evifuse.app.parts import Parts
from evifuse.errors import EvifuseError, MissingExtraError, UsageError

__all__ = ["compute_on_worker", "on_cluster"]

PATIENCE = 10
"""Seconds to wait for a scheduler, and then for a first worker."""

ABSENCES = 3
"""How many times so long there may be no worker at all."""

WINDOW = 512
"""Parts that the scheduler knows of at a time."""

FAILURES = 10
"""Workers that a part may lose before it is given up."""

SILENT = logging.CRITICAL + 1
"""A worker that is told to stop is not worth a line of its own."""


def on_cluster(job: Job, todo: list[int], scheduler: str) -> Generator[int]:
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
    waiting, running = iter(todo), dict[Any, int]()
    with _client(scheduler) as client:
        try:
            while True:
                for index in islice(waiting, WINDOW - len(running)):
                    key = f"evifuse-{run}-{index}"
                    running[client.submit(compute_on_worker, job, index, key=key, pure=False)] = index
                if not running:
                    return
                for future in _some_done(client, list(running)):
                    future.result()
                    yield running.pop(future)
        except EvifuseError:
            raise
        except distributed.KilledWorker as error:
            raise UsageError(
                f"workers died {FAILURES} times on the same part: "
                "is their memory too small? A smaller --rows-per-part needs less"
            ) from error
        except Exception as error:  # not ours: the scheduler died, or a worker has other versions of Dask
            raise UsageError(
                f"--scheduler {scheduler}: {type(error).__name__}: {one_line(error)}; "
                "finished parts are kept for the same command"
            ) from error


def _some_done(client: Any, running: list[Any]) -> set[Any]:
    """Futures that are done, at least one, unless there is nobody left to do them."""
    import distributed

    absences = 0
    while absences < ABSENCES:
        with suppress(TimeoutError):
            found: Any = distributed.wait(running, timeout=PATIENCE, return_when="FIRST_COMPLETED")
            return found.done
        absences = 0 if client.nthreads() else absences + 1
    raise UsageError("all workers are gone: start some, and the same command goes on")


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

    with configured({"distributed.scheduler.allowed-failures": FAILURES}), _quietly():
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
                    dashboard_address="127.0.0.1:0",  # none is shown, but a fixed port may be taken
                    scheduler_kwargs={"dashboard": False},
                    memory_limit=0,
                    silence_logs=SILENT,
                )
                stack.enter_context(cluster)
            yield stack.enter_context(distributed.Client(cluster))


@contextmanager
def _quietly() -> Generator[None]:
    """Nothing is logged of what goes wrong and is put right."""
    names = [name for name in logging.root.manager.loggerDict if name.split(".")[0] == "distributed"]
    levels = {name: logging.getLogger(name).level for name in names}
    try:
        for name in names:
            logging.getLogger(name).setLevel(SILENT)
        yield
    finally:
        for name, level in levels.items():
            logging.getLogger(name).setLevel(level)


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
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of versions: those that matter are checked below
            client = distributed.Client(address, timeout=PATIENCE)
    except (OSError, TimeoutError, ValueError) as error:
        raise UsageError(f"--scheduler {address}: nobody answers there within {PATIENCE} s") from error
    with client:
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError as error:
            raise UsageError(f"--scheduler {address}: it has no workers") from error
        _check_versions(address, client)
        yield client


def _check_versions(address: str, client: Any) -> None:
    """Every worker needs what decides about the bytes, in the same version."""

    def found() -> str:  # goes to the workers by value, because they may lack this module
        try:
            from evifuse.app.job import versions
        except ImportError:
            return "no evifuse that can classify files"
        return versions()

    for worker, there in client.run(found).items():
        if there != versions():
            raise UsageError(f"--scheduler {address}: the worker {worker} has {there}; it needs {versions()}")
