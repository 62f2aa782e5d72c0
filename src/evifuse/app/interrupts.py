"""Ctrl-C while lines come in: it ends the waiting for the next one, not what is done with the last."""

import signal
import threading
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from types import FrameType

__all__ = ["UntilStopped", "until_stopped"]


class UntilStopped:
    """Hands lines on until Ctrl-C.

    Parameters
    ----------
    lines : iterable of str
        Where they come from; waiting for one may take any time.
    """

    def __init__(self, lines: Iterable[str]) -> None:
        self._lines = iter(lines)
        self._waiting = False
        self.stopped = False
        """Whether Ctrl-C ended it."""

    def __iter__(self) -> Iterator[str]:
        while not self.stopped:
            try:
                self._waiting = True
                line = None if self.stopped else next(self._lines, None)
            except KeyboardInterrupt:
                self.stopped = True
                return
            finally:
                self._waiting = False
            if line is None:
                return
            yield line

    def interrupt(self, number: int, frame: FrameType | None) -> None:
        """Take a signal; another one ends the process.

        Parameters
        ----------
        number : int
            Of the signal.
        frame : frame or None
            Where it came.

        Raises
        ------
        KeyboardInterrupt
            If a line was being waited for.
        """
        self.stopped = True
        signal.signal(number, signal.SIG_DFL)
        if self._waiting:
            raise KeyboardInterrupt


@contextmanager
def until_stopped(lines: Iterable[str]) -> Generator[UntilStopped]:
    """Lines until they end or Ctrl-C.

    Parameters
    ----------
    lines : iterable of str
        Where they come from.

    Yields
    ------
    UntilStopped
        The lines, and afterwards whether they were stopped. Signals are left alone outside the main thread.
    """
    taken = UntilStopped(lines)
    if threading.current_thread() is not threading.main_thread():
        yield taken
        return
    before = signal.signal(signal.SIGINT, taken.interrupt)
    try:
        yield taken
    finally:
        signal.signal(signal.SIGINT, before)
