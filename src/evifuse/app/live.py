"""``evifuse touch --live``: samples on standard input, one JSON object on each line, felt as they come.

A line holds ``time_ns``, ``position_m`` [3], ``orientation_xyzw`` [4], ``joint_angle_rad`` and the pressures
[N] with their unit in the name: ``pressure_pa``, ``pressure_kpa``, ``pressure_hpa``, ``pressure_mpa`` or
``pressure_bar``; or ``pressure`` and ``pressure_unit`` (and ``taxel_area_m2`` for newtons). Instead of the
option ``--fingertip``, the first line may be ``{"fingertip": {"radius_m": ..., "positions_m": ...,
"normals": ...}}``.
"""

import json
import sys
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.app.touches import Feeling, line_of
from evifuse.errors import InputError, RecordingError
from evifuse.recordings.checks import checked_touch
from evifuse.recordings.clock import LONGEST_GAP_S
from evifuse.recordings.recording import Fingertip, TouchRecording
from evifuse.recordings.units import to_pascal
from evifuse.touch import FeltSurface, sense_curvature
from evifuse.touch.contact import CONTACT_FLOOR_PA, noise_pa

__all__ = ["LiveTouch", "Sample", "feel_live", "parse_sample"]

LONGEST_WINDOW = 60_000
"""Samples that are kept; older ones are forgotten."""
SETTLED_NS = 20_000_000
"""A contact has ended when there was none for so long: 20 ms."""
NAMED = 5
"""Lines that can't be used and are named one by one."""

_KEYS = {
    "pressure_pa": "Pa",
    "pressure_hpa": "hPa",
    "pressure_kpa": "kPa",
    "pressure_mpa": "MPa",
    "pressure_bar": "bar",
}


@dataclass(frozen=True)
class Sample:
    """One sample of a fingertip.

    Parameters
    ----------
    time_ns : int
        UTC nanoseconds since 1970.
    pose : ndarray of float64, shape (7,)
        Position in metres and unit quaternion ``xyzw`` in the world frame.
    joint_rad : float
        Joint angle, radians.
    pressure_pa : ndarray of float64, shape (N,)
        Pressures, pascals.
    """

    time_ns: int
    pose: NDArray[np.float64]
    joint_rad: float
    pressure_pa: NDArray[np.float64]


def parse_sample(said: Any, taxels: int) -> Sample:
    """A sample from its JSON object.

    Parameters
    ----------
    said : Any
        The parsed line.
    taxels : int
        Number N of taxels.

    Returns
    -------
    Sample
        In SI units.

    Raises
    ------
    RecordingError
        If a key is missing, or a value is not what it should be.
    """
    if not isinstance(said, dict):
        raise RecordingError("it is not a JSON object with time_ns, position_m, ...")
    needed = ("time_ns", "position_m", "orientation_xyzw", "joint_angle_rad")
    for key in needed:
        if key not in said:
            raise RecordingError(f"{key!r} is missing")
    if type(said["time_ns"]) is not int or not 0 <= said["time_ns"] < 2**63:
        raise RecordingError("time_ns must be whole nanoseconds since 1970")
    pose = np.concatenate([_numbers(said, "position_m", 3), _numbers(said, "orientation_xyzw", 4)])
    length = float(np.linalg.norm(pose[3:]))
    if abs(length - 1) > 0.01:
        raise RecordingError(f"orientation_xyzw must have length 1, not {length:.3g}")
    joint = _numbers({"joint_angle_rad": [said["joint_angle_rad"]]}, "joint_angle_rad", 1)[0]
    return Sample(said["time_ns"], pose, float(joint), _pressure(said, taxels))


def _numbers(said: dict[str, Any], key: str, count: int) -> NDArray[np.float64]:
    try:
        values = np.array(said[key], dtype=np.float64)
    except (TypeError, ValueError):
        values = np.zeros(0)
    if values.shape != (count,):
        raise RecordingError(f"{key} must be {count} numbers")
    if not np.isfinite(values).all():
        raise RecordingError(f"{key} is NaN or infinite")
    return values


def _pressure(said: dict[str, Any], taxels: int) -> NDArray[np.float64]:
    for key, unit in _KEYS.items():
        if key in said:
            return to_pascal(_numbers(said, key, taxels), unit, name=key)
    if "pressure" not in said:
        raise RecordingError("'pressure_pa' is missing: the name of the pressures ends with their unit")
    if "pressure_unit" not in said:
        raise RecordingError("'pressure' has no unit: add 'pressure_unit', or name it 'pressure_pa'")
    area = _numbers({"taxel_area_m2": [said.get("taxel_area_m2", 0.0)]}, "taxel_area_m2", 1)[0]
    offset = _numbers({"pressure_offset": [said.get("pressure_offset", 0.0)]}, "pressure_offset", 1)[0]
    values = _numbers(said, "pressure", taxels)
    return to_pascal(values, str(said["pressure_unit"]), float(area), float(offset), "pressure")


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
    _floor_pa: float = CONTACT_FLOOR_PA
    _touched_ns: int = 0
    _touching: bool = False

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
        A line after every so many samples instead.
    as_json : bool
        Print JSON lines.

    Raises
    ------
    RecordingError
        If the fingertip is not known, or no line could be used.
    """
    live = None if feeling.fingertip is None else LiveTouch(feeling, feeling.fingertip)
    taken, left_out, said_at = 0, 0, 0
    try:
        for number, line in enumerate(lines, start=1):
            if not line.strip():
                continue
            try:
                said = _parsed(line)
                if isinstance(said, dict) and "fingertip" in said:
                    tip = _fingertip(said["fingertip"])
                    live = live or LiveTouch(feeling, tip)
                    continue
                if live is None:
                    raise _UnknownFingertipError(
                        "the fingertip is not known: give --fingertip, or a first line with 'fingertip'"
                    )
                ended = live.add(parse_sample(said, len(live.fingertip.positions_m)))
            except _UnknownFingertipError:
                raise
            except InputError as error:
                left_out += 1
                if left_out <= NAMED:
                    _notice(f"standard input, line {number} is left out: {error}")
                continue
            taken += 1
            if taken % every == 0 if every else ended:
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


class _UnknownFingertipError(RecordingError):
    """Nothing can be felt at all."""


def _parsed(line: str) -> Any:
    try:
        return json.loads(line)
    except (ValueError, RecursionError) as error:
        raise RecordingError("it is not JSON") from error


def _fingertip(said: Any) -> Fingertip:
    try:
        tip = Fingertip(
            float(said["radius_m"]),
            np.array(said["positions_m"], dtype=np.float64),
            np.array(said["normals"], dtype=np.float64),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise _UnknownFingertipError(
            "the fingertip needs the numbers radius_m, positions_m and normals"
        ) from error
    count = len(tip.positions_m)
    still = TouchRecording(
        tip,
        np.zeros(1, np.int64),
        np.zeros((1, 3)),
        np.array([[0.0, 0, 0, 1]]),
        np.zeros(1),
        np.zeros((1, count)),
        "live",
    )
    return checked_touch(still).fingertip


def _say(live: LiveTouch, taken: int, as_json: bool) -> None:
    felt = live.feel()
    time_ns = live.samples[-1].time_ns
    if as_json:
        line = json.dumps({"time_ns": time_ns, "samples": taken, **felt.to_json()}, allow_nan=False)
    else:
        line = f"{taken:8d} samples  {line_of(felt)}"
    print(line, flush=True)


def _notice(text: str) -> None:
    """What a person wants to know, beside the output proper."""
    print(f"evifuse: {text}", file=sys.stderr, flush=True)
