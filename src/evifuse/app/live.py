"""``evifuse touch --live``: samples on standard input, one JSON object on each line, felt as they come.

What a line holds is in `evifuse.app.samples`.
"""

import json
import sys
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from evifuse.app.samples import Sample, UnknownFingertipError, parse_fingertip, parse_line, parse_sample
from evifuse.app.touches import Feeling, line_of
from evifuse.errors import InputError, RecordingError
from evifuse.recordings.checks import checked_touch
from evifuse.recordings.clock import LONGEST_GAP_S
from evifuse.recordings.recording import Fingertip, TouchRecording
from evifuse.touch import FeltSurface, sense_curvature
from evifuse.touch.contact import CONTACT_FLOOR_PA, noise_pa
from evifuse.touch.online import CurvatureTracker, Tracking

__all__ = ["LiveTouch", "feel_live"]

LONGEST_WINDOW = 60_000
"""Samples that are kept; older ones are forgotten."""
SETTLED_NS = 20_000_000
"""A contact has ended when there was none for so long: 20 ms."""
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
    samples : list of Sample
        The latest, oldest first.
    """

    feeling: Feeling
    fingertip: Fingertip
    samples: list[Sample] = field(default_factory=list[Sample])
    _tracker: CurvatureTracker = field(init=False)
    _floor_pa: float = field(init=False, default=CONTACT_FLOOR_PA)
    _touched_ns: int = field(init=False, default=0)
    _touching: bool = field(init=False, default=False)
    _now: Tracking | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        self._tracker = CurvatureTracker(self.fingertip)

    def add(self, sample: Sample) -> bool:
        """Take a sample.

        Parameters
        ----------
        sample : Sample
            Later than the last.

        Returns
        -------
        bool
            Whether a contact has just ended, so that there is something new to say.

        Raises
        ------
        RecordingError
            If it is not later.
        """
        last = self.samples[-1].time_ns if self.samples else -1
        if sample.time_ns <= last:
            raise RecordingError(f"time_ns does not increase ({sample.time_ns} after {last})")
        self._now = self._tracker.update(
            sample.time_ns, sample.pose[:3], sample.pose[3:], sample.joint_rad, sample.pressure_pa
        )
        gap = bool(self.samples) and sample.time_ns - last > LONGEST_GAP_S * 1e9
        self.samples.append(sample)
        if len(self.samples) > LONGEST_WINDOW:
            del self.samples[: LONGEST_WINDOW // 10]
        peak = float(sample.pressure_pa.max())
        if len(self.samples) % 500 == 0:
            recent = np.stack([s.pressure_pa for s in self.samples[-2000:]])
            self._floor_pa = max(CONTACT_FLOOR_PA, 8 * noise_pa(recent), 0.02 * float(recent.max()))
        ended = self._touching and (gap or sample.time_ns - self._touched_ns > SETTLED_NS)
        if peak > self._floor_pa:
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

    def feel(self) -> FeltSurface:
        """What the samples so far say.

        Returns
        -------
        FeltSurface
            As from a recording of them.
        """
        pose = np.stack([s.pose for s in self.samples])
        recording = TouchRecording(
            self.fingertip,
            np.array([s.time_ns for s in self.samples], dtype=np.int64),
            pose[:, :3],
            pose[:, 3:],
            np.array([s.joint_rad for s in self.samples]),
            np.stack([s.pressure_pa for s in self.samples]),
            "live",
        )
        return sense_curvature(checked_touch(recording), self.feeling.knowledge, belief=self.feeling.belief)


def feel_live(lines: Iterable[str], feeling: Feeling, every: int | None, as_json: bool) -> None:
    """Feel samples as they come, and print a line after each contact.

    A line that can't be used is named on standard error, and the next ones are read.

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
    """
    tip = feeling.given.fingertip
    live = None if tip is None else LiveTouch(feeling, tip)
    taken, left_out, said_at = 0, 0, 0
    try:
        for number, line in enumerate(lines, start=1):
            if not line.strip():
                continue
            try:
                said = parse_line(line)
                if isinstance(said, dict) and "fingertip" in said:
                    tip = parse_fingertip(said["fingertip"])
                    live = live or LiveTouch(feeling, tip)
                    continue
                if live is None:
                    raise UnknownFingertipError(
                        "the fingertip is not known: give --fingertip, or a first line with 'fingertip'"
                    )
                ended = live.add(parse_sample(said, len(live.fingertip.positions_m)))
            except UnknownFingertipError:
                raise
            except InputError as error:
                left_out += 1
                if left_out <= NAMED:
                    _notice(f"standard input, line {number} is left out: {error}")
                continue
            taken += 1
            if every and taken % every == 0:
                _say_now(live, taken, as_json)
            elif ended and not every:
                _say(live, taken, as_json)
                said_at = taken
    except UnicodeDecodeError as error:
        raise RecordingError("standard input is not text: send JSON lines in UTF-8") from error
    if live is None or not taken:
        raise RecordingError(
            f"standard input: no sample could be used ({left_out} lines left out): send JSON lines"
        )
    if said_at < taken:
        _say(live, taken, as_json)
    more = f", {left_out} lines left out" if left_out else ""
    _notice(f"{taken} samples felt{more}")


def _say(live: LiveTouch, taken: int, as_json: bool) -> None:
    felt = live.feel()
    time_ns = live.samples[-1].time_ns
    if as_json:
        line = json.dumps({"time_ns": time_ns, "samples": taken, **felt.to_json()}, allow_nan=False)
    else:
        line = f"{taken:8d} samples  {line_of(felt)}"
    print(line, flush=True)


def _say_now(live: LiveTouch, taken: int, as_json: bool) -> None:
    now = live.now()
    if as_json:
        print(json.dumps({"time_ns": live.samples[-1].time_ns, "samples": taken, **now}), flush=True)
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
