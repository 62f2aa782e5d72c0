"""The door of touch: from what a file says to a recording that an estimate can trust.

What is wrong in a way that can't be repaired honestly is refused in one line. What can be left out or
interpolated without inventing anything is, and a note says so. The rules are our own.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import RecordingError
from evifuse.recordings import rotation
from evifuse.recordings.checks import checked_touch, unit
from evifuse.recordings.clock import LONGEST_GAP_S, gaps, held_to_fresh, rate_hz
from evifuse.recordings.raw import RawTouch
from evifuse.recordings.recording import Fingertip, TouchRecording
from evifuse.recordings.suspicions import suspected_time_unit, suspicions
from evifuse.recordings.units import to_pascal

__all__ = ["touch_of"]

MOSTLY_NAN = 0.5
"""A taxel that is NaN in more than this share of the samples is left out of the fingertip."""


def touch_of(raw: RawTouch) -> TouchRecording:
    """Turn what a file says into a checked recording in SI units.

    Poses and joint angles are interpolated to the times of the pressures, over `LONGEST_GAP_S` at most;
    samples without a pose are left out. A taxel that is NaN throughout, or in more than half of the samples,
    is left out of the fingertip; then samples in which another taxel is NaN are left out.

    Parameters
    ----------
    raw : RawTouch
        As a reader put it together.

    Returns
    -------
    TouchRecording
        Checked; its notes say what was left out or interpolated.

    Raises
    ------
    RecordingError
        If a part is missing, times do not increase, the unit is unknown, or nothing usable is left.
    """
    for line in raw.lacking.values():
        raise RecordingError(line)
    name = raw.name
    notes = list(raw.notes)
    if raw.damage:
        notes.append(f"{name}: {raw.damage}; the {len(raw.time_ns)} samples before that are read")
    for part, time_ns in (("time", raw.time_ns), ("pose", raw.pose_time_ns), ("joint", raw.joint_time_ns)):
        _refuse_disorder(time_ns, raw.called.get(part, part), name)
    fingertip, pressure = _taxels(raw, notes)
    keep = _whole_samples(pressure, name, notes)
    pose = _known(raw.pose_time_ns, raw.pose, raw.called.get("pose", "pose"), name, notes)
    joint = _known_joint(raw, notes)
    turned = unit(pose.values[:, 3:], "finger orientations", name)
    if joint is None and _never_turns(turned):
        notes.append(
            f"{name}: the orientation never changes, and there is no joint angle: is it the fingertip's pose?"
        )
    keep &= _covered(raw.time_ns, [pose] if joint is None else [pose, joint], name, notes)
    time_ns = raw.time_ns[keep]
    _say_gaps(raw.time_ns, name, notes)
    origin = time_ns[0]
    at, pose_at = (_seconds(t, origin) for t in (time_ns, pose.time_ns))
    position = np.stack([np.interp(at, pose_at, pose.values[:, axis]) for axis in range(3)], axis=-1)
    orientation = rotation.interpolate(pose_at, turned, at)
    rolled = np.full(len(at), np.nan)
    if joint is not None:
        rolled = np.interp(at, _seconds(joint.time_ns, origin), joint.values[:, 0])
    pascal = to_pascal(pressure if keep.all() else pressure[keep], raw.unit, raw.area_m2, raw.offset, name)
    recording = TouchRecording(fingertip, time_ns, position, orientation, rolled, pascal, name)
    recording = checked_touch(recording)
    notes += [f"{name}: {text}" for _, text in suspicions(recording)]
    return replace(recording, notes=tuple(notes))


@dataclass(frozen=True)
class _Known:
    """Values at the times at which they are known, and what they are called."""

    time_ns: NDArray[np.int64]
    values: NDArray[np.float64]
    called: str


def _refuse_disorder(time_ns: NDArray[np.int64], called: str, name: str) -> None:
    late = np.flatnonzero(np.diff(time_ns) <= 0)
    unit = suspected_time_unit(time_ns)
    if unit:
        raise RecordingError(f"{name}: {called} is hardly in nanoseconds: is it in {unit}")
    if not len(late):
        return
    k = int(late[0]) + 1
    if time_ns[k] == time_ns[k - 1]:
        raise RecordingError(
            f"{name}: {called} has two samples at time {time_ns[k]} ns, {k - 1} and {k}: remove one"
        )
    raise RecordingError(
        f"{name}: {called} does not increase at sample {k} ({time_ns[k]} after {time_ns[k - 1]} ns): "
        "sort the samples and remove repeats"
    )


def _taxels(raw: RawTouch, notes: list[str]) -> tuple[Fingertip, NDArray[np.float64]]:
    """Fingertip and readings without the taxels that say nothing."""
    if len(raw.positions_m) == 0 or len(raw.normals) != len(raw.positions_m):
        raise RecordingError(
            f"{raw.name}: there are {len(raw.positions_m)} taxel positions and {len(raw.normals)} normals: "
            "the recording must give the fingertip's geometry, or --fingertip"
        )
    pressure = raw.pressure
    if pressure.ndim != 2 or pressure.shape[1] != len(raw.positions_m):
        raise RecordingError(
            f"{raw.name}: pressures of shape {pressure.shape} for {len(raw.positions_m)} taxels: "
            "one column per taxel is needed"
        )
    share = np.isnan(pressure).mean(axis=0) if len(pressure) else np.zeros(pressure.shape[1])
    silent = np.flatnonzero(share > MOSTLY_NAN)
    if not len(silent):
        return Fingertip(raw.radius_m, raw.positions_m, raw.normals), pressure
    if len(silent) == pressure.shape[1]:
        raise RecordingError(
            f"{raw.name}: the pressures of all taxels are NaN: check the sensor's connection"
        )
    throughout = "throughout" if share[silent].min() == 1 else f"in more than {MOSTLY_NAN:.0%} of the samples"
    notes.append(f"{raw.name}: {_counted(silent, 'taxel')} NaN {throughout}, left out of the fingertip")
    kept = share <= MOSTLY_NAN
    return Fingertip(raw.radius_m, raw.positions_m[kept], raw.normals[kept]), pressure[:, kept]


def _counted(numbers: NDArray[np.int64], what: str) -> str:
    """``taxel 4 is``, ``3 taxels (1, 5, 8) are``."""
    if len(numbers) == 1:
        return f"{what} {numbers[0]} is"
    shown = ", ".join(map(str, numbers[:8].tolist())) + (", ..." if len(numbers) > 8 else "")
    return f"{len(numbers)} {what}s ({shown}) are"


def _whole_samples(pressure: NDArray[np.float64], name: str, notes: list[str]) -> NDArray[np.bool_]:
    """Samples (T,) in which every taxel has a reading."""
    whole = ~_any_nan(pressure)
    broken = np.flatnonzero(~whole)
    if len(broken):
        if not whole.any():
            raise RecordingError(f"{name}: every sample has a NaN pressure: repair or leave out those taxels")
        notes.append(f"{name}: {_counted(broken, 'sample')} NaN in some pressure, left out")
    return whole


def _any_nan(values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Rows (M,) with a NaN in them."""
    return np.asarray(np.isnan(values).any(axis=1), dtype=np.bool_)


def _known(
    time_ns: NDArray[np.int64],
    values: NDArray[np.float64],
    called: str,
    name: str,
    notes: list[str],
) -> _Known:
    """Poses or angles without those that are NaN, and without those that only repeat an old one."""
    missing = _any_nan(values)
    if missing.all():
        raise RecordingError(f"{name}: {called} is NaN or infinite at every row: record it")
    if np.isinf(values).any():
        row = int(np.argwhere(np.isinf(values))[0][0])
        raise RecordingError(
            f"{name}: {called} is NaN or infinite at row {row}: remove or repair that sample"
        )
    if missing.any():
        count = int(missing.sum())
        notes.append(
            f"{name}: {called} is NaN at {count} of {len(missing)} rows, interpolated between others"
        )
        time_ns, values = time_ns[~missing], values[~missing]
    fresh = held_to_fresh(time_ns, values)
    if fresh is not None:
        notes.append(
            f"{name}: {called} changes only at {rate_hz(time_ns[fresh]):.4g} Hz (it is repeated at "
            f"{rate_hz(time_ns):.4g} Hz): interpolated between changes"
        )
        time_ns, values = time_ns[fresh], values[fresh]
    return _Known(time_ns, values, called)


def _known_joint(raw: RawTouch, notes: list[str]) -> _Known | None:
    """Joint angles; None, and a note, if none was recorded."""
    if np.isnan(raw.joint_rad).all():
        notes.append(
            f"{raw.name}: no joint angle: slip can't be told, and there is no estimate by the chapter"
        )
        return None
    turn = float(np.nanmax(raw.joint_rad) - np.nanmin(raw.joint_rad))
    if np.isfinite(turn) and turn > 2 * np.pi:
        notes.append(
            f"{raw.name}: the joint turns through {turn:.0f} rad: in degrees? it is left out; give radians"
        )
        return None
    called = raw.called.get("joint", "joint")
    return _known(raw.joint_time_ns, raw.joint_rad[:, None], called, raw.name, notes)


def _never_turns(orientation_xyzw: NDArray[np.float64]) -> bool:
    return float(np.abs(orientation_xyzw @ orientation_xyzw[0]).min()) > 1 - 1e-9


def _covered(
    time_ns: NDArray[np.int64], known: list[_Known], name: str, notes: list[str]
) -> NDArray[np.bool_]:
    """Samples at which pose and joint are known, or lie between two that are not far apart."""
    first, last = max(part.time_ns[0] for part in known), min(part.time_ns[-1] for part in known)
    inside = (time_ns >= first) & (time_ns <= last)
    if not inside.any():
        both = " and ".join(part.called for part in known)
        raise RecordingError(f"{name}: no taxel sample lies within the times of {both}: check the clocks")
    if not inside.all():
        notes.append(f"{name}: {int((~inside).sum())} samples before or after the poses are left out")
    for part in known:
        silent, longest = _silent(part.time_ns, time_ns)
        lost = inside & silent
        if not lost.any():
            continue
        around = (time_ns[int(np.argmax(lost))] - time_ns[0]) * 1e-9
        said = f"{name}: {part.called} is silent for up to {longest:.2f} s, first around {around:.2f} s"
        inside &= ~silent
        if not inside.any() or rate_hz(part.time_ns) < 1 / LONGEST_GAP_S:
            raise RecordingError(f"{said}, longer than {LONGEST_GAP_S} s: record it more often")
        notes.append(f"{said}: the {int(lost.sum())} samples there are left out")
    for part in known:
        _say_rate(part, time_ns, name, notes)
    return inside


def _silent(known_ns: NDArray[np.int64], time_ns: NDArray[np.int64]) -> tuple[NDArray[np.bool_], float]:
    """Samples (T,) in the midst of a silence that is too long to interpolate over, and the longest, s."""
    if len(known_ns) < 2:
        return np.zeros(len(time_ns), dtype=np.bool_), 0.0
    gap = np.diff(known_ns) * 1e-9
    before = np.clip(np.searchsorted(known_ns, time_ns, side="right") - 1, 0, len(gap) - 1)
    inside = (known_ns[before] < time_ns) & (time_ns < known_ns[before + 1])
    return inside & (gap[before] > LONGEST_GAP_S), float(gap.max())


def _say_rate(part: _Known, time_ns: NDArray[np.int64], name: str, notes: list[str]) -> None:
    own, wanted = rate_hz(part.time_ns), rate_hz(time_ns)
    already = any(part.called in note and "interpolated" in note for note in notes)
    if own < 0.9 * wanted and not already:
        notes.append(
            f"{name}: {part.called} comes at {own:.4g} Hz, the pressures at {wanted:.4g} Hz: interpolated"
        )


def _say_gaps(time_ns: NDArray[np.int64], name: str, notes: list[str]) -> None:
    found = gaps(time_ns)
    if len(found):
        first, length = found[0], float(np.diff(time_ns)[found[0]]) * 1e-9
        where = (time_ns[first] - time_ns[0]) * 1e-9
        more = f", and {len(found) - 1} more gaps" if len(found) > 1 else ""
        notes.append(
            f"{name}: no samples for {length:.2f} s after {where:.2f} s{more}: not bridged, rolls end there"
        )


def _seconds(time_ns: NDArray[np.int64], origin: np.int64) -> NDArray[np.float64]:
    return (time_ns - origin).astype(np.float64) * 1e-9
