"""``evifuse touch --live``: samples on standard input, one JSON object on each line, felt as they come.

What a line holds is in `evifuse.app.samples`. What is said after a contact comes from the samples of a window
of bounded length, so that it takes no longer after an hour than after a minute.
"""

import json
import sys
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from evifuse.app.interrupts import until_stopped
from evifuse.app.samples import UnknownFingertipError, parse_fingertip, parse_line, parse_sample
from evifuse.app.touches import Feeling, line_of
from evifuse.app.window import Window
from evifuse.errors import InputError, RecordingError
from evifuse.recordings.clock import LONGEST_GAP_S
from evifuse.recordings.recording import Fingertip
from evifuse.touch import FeltSurface, sense_curvature
from evifuse.touch.contact import CONTACT_FLOOR_PA, noise_pa
from evifuse.touch.online import CurvatureTracker, Tracking

__all__ = ["LiveTouch", "feel_live"]

LONGEST_WINDOW = 60_000
"""Samples that are kept for what is said in the end; older ones are forgotten."""
RECENT = 10_000
"""Samples that a line after a contact tells about: they take a tenth of a second, more or less."""
SETTLED_NS = 20_000_000
"""A contact has ended when there was none for so long: 20 ms."""
RESTARTED = 50
"""After so many samples in a row that are not later than the last good one, the clock has been set anew."""
NAMED = 5
"""Lines that can't be used and are named one by one."""


@dataclass
class LiveTouch:
    """The samples so far, and whether the finger touches.

    Parameters
    ----------
    feeling : Feeling
        How they are to be felt.
    fingertip : Fingertip
        Geometry of the fingertip.
    taken : int
        Samples that were taken.
    """

    feeling: Feeling
    fingertip: Fingertip
    taken: int = 0
    _window: Window = field(init=False)
    _tracker: CurvatureTracker = field(init=False)
    _floor_pa: float = field(init=False, default=CONTACT_FLOOR_PA)
    _touched_ns: int = field(init=False, default=0)
    _touching: bool = field(init=False, default=False)
    _now: Tracking | None = field(init=False, default=None)
    _late: int = field(init=False, default=0)
    _noted: set[str] = field(init=False, default_factory=set[str])

    def __post_init__(self) -> None:
        self._begin()

    def _begin(self) -> None:
        self._window = Window(self.fingertip, LONGEST_WINDOW)
        self._tracker, self._now, self._touching = CurvatureTracker(self.fingertip), None, False

    @property
    def time_ns(self) -> int:
        """Time of the last sample; -1 without one."""
        return self._window.time_ns

    def take(self, said: Any) -> bool:
        """Take a line that was parsed.

        Parameters
        ----------
        said : Any
            What the line holds.

        Returns
        -------
        bool
            Whether a contact has just ended, so that there is something new to say.

        Raises
        ------
        RecordingError
            If it is no sample, or not later than the last one.
        """
        sample = parse_sample(said, len(self.fingertip.positions_m), self.feeling.given.unit)
        last = self.time_ns
        if sample.time_ns <= last:
            self._late += 1
            if self._late < RESTARTED:
                raise RecordingError(f"time_ns does not increase ({sample.time_ns} after {last})")
            _notice(f"the clock was set back by {(last - sample.time_ns) * 1e-9:.1f} s: starting afresh")
            self._begin()
            last = -1
        self._late = 0
        pressure = np.nan_to_num(sample.pressure_pa)
        self._now = self._tracker.update(
            sample.time_ns, sample.pose[:3], sample.pose[3:], sample.joint_rad, pressure
        )
        gap = last >= 0 and sample.time_ns - last > LONGEST_GAP_S * 1e9
        self._window.add(sample)
        self.taken += 1
        if self.taken % 500 == 0:
            recent = np.nan_to_num(self._window.pressure_pa(2000))
            self._floor_pa = max(CONTACT_FLOOR_PA, 8 * noise_pa(recent), 0.02 * float(recent.max()))
        ended = self._touching and (gap or sample.time_ns - self._touched_ns > SETTLED_NS)
        if float(pressure.max()) > self._floor_pa:
            self._touched_ns, self._touching = sample.time_ns, True
        elif ended:
            self._touching = False
        return ended

    def now(self) -> dict[str, Any]:
        """What is known of the curvature under the finger.

        Returns
        -------
        dict
            ``touching``, ``site``, ``direction_rad``, ``curvature_per_m``, ``standard_error_per_m``,
            ``k1_per_m`` and ``k2_per_m`` with their errors; null where it is not known.
        """
        now = self._now
        shape = None if now is None else now.shape
        known: dict[str, Any] = dict.fromkeys(
            ("site", "direction_rad", "curvature_per_m", "standard_error_per_m"), None
        )
        known = {"touching": now is not None and now.touching} | known
        if now is not None:
            known |= {key: getattr(now, key) for key in known}
        return known | {
            "k1_per_m": None if shape is None else shape.k1_per_m,
            "k2_per_m": None if shape is None else shape.k2_per_m,
            "k1_standard_error_per_m": None if shape is None else shape.k1_error_per_m,
            "k2_standard_error_per_m": None if shape is None else shape.k2_error_per_m,
        }

    def feel(self, samples: int = LONGEST_WINDOW) -> FeltSurface:
        """What the last samples say; what the door notes about them is said on standard error, once.

        Parameters
        ----------
        samples : int
            How many at most.

        Returns
        -------
        FeltSurface
            As from a recording of them.
        """
        recording = self._window.recording(samples)
        for note in recording.notes:
            kind = "".join(c for c in note if not c.isdigit())  # numbers grow with the window
            if kind not in self._noted:
                self._noted.add(kind)
                _notice(note)
        return sense_curvature(recording, self.feeling.knowledge, belief=self.feeling.belief)


def feel_live(lines: Iterable[str], feeling: Feeling, every: int | None, as_json: bool) -> None:
    """Feel samples as they come, and print a line after each contact.

    A line that can't be used is named on standard error, and the next ones are read. When the input ends or
    is stopped by Ctrl-C, the last line tells what the samples in the window say.

    Parameters
    ----------
    lines : iterable of str
        A JSON object on each.
    feeling : Feeling
        How they are to be felt.
    every : int or None
        A line after every so many samples instead, with the curvature under the finger so far.
    as_json : bool
        Print JSON lines.

    Raises
    ------
    RecordingError
        If the fingertip is not known, or no line could be used.
    KeyboardInterrupt
        After Ctrl-C, with what was done until then.
    """
    stream = _Stream(feeling, every, as_json)
    with until_stopped(lines) as taken:
        stream.read(taken)
        summary = stream.end()
    if taken.stopped:
        raise KeyboardInterrupt(f"stopped: {summary}")
    _notice(summary)


@dataclass
class _Stream:
    """Lines as they come, and what is printed for them."""

    feeling: Feeling
    every: int | None
    as_json: bool
    live: LiveTouch | None = None
    left_out: int = 0
    said_at: int = 0

    def read(self, lines: Iterable[str]) -> None:
        """Take one line after another."""
        tip = self.feeling.given.fingertip
        self.live = None if tip is None else LiveTouch(self.feeling, tip)
        for number, line in enumerate(lines, start=1):
            if not line.strip():
                continue
            try:
                ended = self._take(parse_line(line))
            except UnknownFingertipError:
                raise
            except InputError as error:
                self.left_out += 1
                if self.left_out <= NAMED:
                    _notice(f"standard input, line {number} is left out: {error}")
                continue
            live = self.live
            if live is None or ended is None:
                continue
            if self.every and live.taken % self.every == 0:
                _say_now(live, self.as_json)
            elif ended and not self.every:
                self._say(live, RECENT)

    def _take(self, said: Any) -> bool | None:
        """Whether a contact has ended; None for a line that is no sample."""
        if isinstance(said, dict) and "fingertip" in said:
            tip = parse_fingertip(said["fingertip"])
            self.live = self.live or LiveTouch(self.feeling, tip)
            return None
        if self.live is None:
            raise UnknownFingertipError(
                "the fingertip is not known: give --fingertip, or a first line with 'fingertip'"
            )
        return self.live.take(said)

    def _say(self, live: LiveTouch, samples: int) -> None:
        """What the last samples say; what makes that impossible for now is named."""
        self.said_at = live.taken
        try:
            felt = live.feel(samples)
        except InputError as error:
            _notice(str(error))
            return
        if self.as_json:
            known = {"time_ns": live.time_ns, "samples": live.taken, **felt.to_json()}
            print(json.dumps(known, allow_nan=False), flush=True)
        else:
            print(f"{live.taken:8d} samples  {line_of(felt)}", flush=True)

    def end(self) -> str:
        """Say what is left to say."""
        live = self.live
        if live is None or not live.taken:
            raise RecordingError(
                f"standard input: no sample could be used ({self.left_out} lines left out): send JSON lines"
            )
        if self.said_at < live.taken or live.taken > RECENT:
            self._say(live, LONGEST_WINDOW)
        more = f", {self.left_out} lines left out" if self.left_out else ""
        return f"{live.taken} samples felt{more}"


def _say_now(live: LiveTouch, as_json: bool) -> None:
    now, taken = live.now(), live.taken
    if as_json:
        print(json.dumps({"time_ns": live.time_ns, "samples": taken, **now}), flush=True)
        return
    text = "touching" if now["touching"] else "no contact"
    if now["curvature_per_m"] is not None:
        text = (
            f"{np.rad2deg(now['direction_rad']):3.0f} degrees: "
            f"{now['curvature_per_m']:.2f} ± {now['standard_error_per_m']:.2f}"
        )
    if now["k1_per_m"] is not None:
        text += f", k1 {now['k1_per_m']:.2f} ± {now['k1_standard_error_per_m']:.2f}"
        text += f", k2 {now['k2_per_m']:.2f} ± {now['k2_standard_error_per_m']:.2f}"
    print(f"{taken:8d} samples  {text}", flush=True)


def _notice(text: str) -> None:
    """What a person wants to know, beside the output proper."""
    print(f"evifuse: {text}", file=sys.stderr, flush=True)
