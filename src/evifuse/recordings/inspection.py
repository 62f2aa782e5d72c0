"""What a recording of touch lacks, part by part, before any estimate (all limits are our own)."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import RecordingError
from evifuse.recordings.checks import LARGEST_TIP_M
from evifuse.recordings.clock import LONGEST_GAP_S, gaps, held_to_fresh, rate_hz, suspected_millimetres
from evifuse.recordings.raw import RawTouch
from evifuse.recordings.suspicions import RESTING, STRONGEST_PA, WEAKEST_PA, suspected_time_unit
from evifuse.recordings.units import to_pascal

__all__ = ["Finding", "inspect_touch"]

PLENTY = 8
"""So many numbers of samples or taxels are listed."""
SLOW_HZ = 50.0
"""Fewer samples in a second hardly resolve a roll."""


@dataclass(frozen=True)
class Finding:
    """One thing about a recording.

    Parameters
    ----------
    part : str
        ``file``, ``time``, ``pose``, ``pressures``, ``fingertip``, ``joint``, ``contact`` or ``picture``.
    verdict : {"fine", "note", "refused"}
        Whether it is as it should be, worth knowing, or reason to refuse an estimate.
    text : str
        In a line.
    """

    part: str
    verdict: Literal["fine", "note", "refused"]
    text: str


def inspect_touch(raw: RawTouch) -> list[Finding]:
    """Look at every part of a touch.

    Parameters
    ----------
    raw : RawTouch
        As its file has it.

    Returns
    -------
    list of Finding
        By part; at least one for each.
    """
    found: list[Finding] = []
    for part, look in (
        ("time", _time),
        ("pose", _pose),
        ("joint", _joint),
        ("pressure", _pressure),
        ("fingertip", _fingertip),
    ):
        name = "pressures" if part == "pressure" else part
        missing = raw.lacking.get(part)
        if missing is not None:
            found.append(Finding(name, "refused", missing))
        else:
            with np.errstate(all="ignore"):  # numbers may be of any size here
                found += [Finding(name, verdict, text) for verdict, text in look(raw)]
    return found


Said = list[tuple[Literal["fine", "note", "refused"], str]]


def _time(raw: RawTouch) -> Said:
    said: Said = []
    steps = np.diff(raw.time_ns)
    wrong = np.flatnonzero(steps <= 0) + 1
    if len(wrong):
        back = int((steps < 0).sum())
        text = f"{len(wrong) - back} samples repeat a time and {back} go back: samples {_listed(wrong)}"
        said.append(("refused", text))
    unit = suspected_time_unit(raw.time_ns)
    if unit:
        said.append(("refused", f"hardly in nanoseconds: is it in {unit}"))
    length = float(raw.time_ns[-1] - raw.time_ns[0]) * 1e-9
    rate = rate_hz(raw.time_ns)
    text = f"{len(raw.time_ns)} samples in {length:.3f} s, {rate:.5g} Hz"
    slow = 0 < rate < SLOW_HZ
    said.append(("note", f"{text}: 100 Hz and more resolve a roll") if slow else ("fine", text))
    return said if len(wrong) or unit else said + _gaps(raw.time_ns, "rolls end there")


def _gaps(time_ns: NDArray[np.int64], meaning: str) -> Said:
    steps = np.diff(time_ns) * 1e-9
    return [
        ("note", f"gap of {steps[i]:.2f} s after {(time_ns[i] - time_ns[0]) * 1e-9:.2f} s: {meaning}")
        for i in gaps(time_ns)[:PLENTY]
    ]


def _pose(raw: RawTouch) -> Said:
    said = _clocked(raw, raw.pose_time_ns, raw.pose)
    whole = raw.pose[np.isfinite(raw.pose).all(axis=1)]
    if not len(whole):
        return [*said, ("refused", "no pose has seven numbers: position and quaternion are needed")]
    extent = np.ptp(whole[:, :3], axis=0) * 1000
    text = "moves over {:.1f} x {:.1f} x {:.1f} mm".format(*extent)
    if suspected_millimetres(raw.pose_time_ns, raw.pose[:, :3]):
        said.append(("note", f"{text}, too fast for a finger: is the position in mm? metres are needed"))
    elif extent.max() < 0.1:
        said.append(("note", f"{text}: it hardly moves; is this the pose of the fingertip, in metres?"))
    else:
        said.append(("fine", text))
    length = np.linalg.norm(whole[:, 3:], axis=1)
    off = np.flatnonzero(np.abs(length - 1) > 0.01)
    if len(off):
        said.append(
            (
                "refused",
                f"quaternions must have length 1, {len(off)} have not (row {off[0]}: {length[off[0]]:.3g})",
            )
        )
    elif float(np.abs(whole[:, 3:] @ whole[0, 3:]).min()) > 1 - 1e-9:
        known = not np.isnan(raw.joint_rad).all()
        where = "the turn must be in the joint angle" if known else "is this the pose of the fingertip?"
        said.append(("note", f"the orientation never changes: {where}"))
    return said


def _joint(raw: RawTouch) -> Said:
    if np.isnan(raw.joint_rad).all():
        return [("note", "none: slip can't be told, and there is no estimate by the chapter")]
    said = _clocked(raw, raw.joint_time_ns, raw.joint_rad[:, None])
    whole = raw.joint_rad[np.isfinite(raw.joint_rad)]
    if len(whole):
        turn = float(np.ptp(whole))
        text = f"turns through {turn:.3f} rad"
        if turn > 2 * np.pi:
            said.append(("note", f"{text}: is it in degrees? it is left out, radians are needed"))
        elif turn == 0:
            said.append(("note", f"{text}: slip can't be told"))
        else:
            said.append(("fine", text))
    return said


def _clocked(raw: RawTouch, time_ns: NDArray[np.int64], values: NDArray[np.float64]) -> Said:
    """What the times of poses or angles say beside those of the pressures."""
    said: Said = []
    wrong = np.flatnonzero(np.diff(time_ns) <= 0) + 1
    own, wanted = rate_hz(time_ns), rate_hz(raw.time_ns)
    missing = int(np.isnan(values).any(axis=1).sum())
    if len(wrong) and not np.array_equal(time_ns, raw.time_ns):
        said.append(("refused", f"times repeat or go back at samples {_listed(wrong)}"))
        return said
    fresh = None if len(wrong) else held_to_fresh(time_ns, values)
    if fresh is not None:
        own = rate_hz(time_ns[fresh])
    if 0 < own < 1 / LONGEST_GAP_S:
        said.append(
            ("refused", f"{own:.3g} Hz: too rare to interpolate, {1 / LONGEST_GAP_S:.0f} Hz are needed")
        )
    elif own < 0.9 * wanted:
        held = " (repeated in between)" if fresh is not None else ""
        said.append(("note", f"{own:.4g} Hz{held}, the pressures at {wanted:.4g} Hz: interpolated"))
    else:
        said.append(("fine", f"{len(time_ns)} samples, {own:.4g} Hz"))
    if missing:
        said.append(("note", f"NaN at {missing} of {len(time_ns)} rows: interpolated where others are near"))
    if not np.array_equal(time_ns, raw.time_ns):
        said += _gaps(time_ns, "the samples there are left out")
    return said


def _pressure(raw: RawTouch) -> Said:
    said: Said = []
    values = raw.pressure
    try:
        pascal = to_pascal(values, raw.unit, raw.area_m2, raw.offset, raw.name)
    except RecordingError as error:
        return [("refused", str(error))]
    silent = np.isnan(values)
    never, some = np.flatnonzero(silent.all(axis=0)), int(silent.any(axis=1).sum())
    if silent.all():
        return [("refused", "all pressures are NaN")]
    if len(never):
        said.append(("note", f"NaN throughout: taxels {_listed(never)}, left out"))
    if some and not len(never):
        said.append(("note", f"NaN in some taxel at {some} of {len(values)} samples, left out"))
    if np.isinf(values).any():
        said.append(("refused", "some pressures are infinite: remove or repair those samples"))
        return said
    low, high = float(np.nanmin(pascal)) / 1000, float(np.nanmax(pascal)) / 1000
    text = f"{raw.unit}, from {low:.4g} to {high:.4g} kPa"
    if high * 1000 > STRONGEST_PA:
        said.append(("note", f"{text}: no fingertip presses so hard; is the unit right?"))
    elif 0 < high * 1000 < WEAKEST_PA:
        said.append(("note", f"{text}: so little is hardly felt; is the unit right?"))
    elif high <= 0:
        said.append(("note", f"{text}: nothing was pressed"))
    else:
        said.append(("fine", text))
    rest = float(np.nanmedian(pascal)) / 1000
    if high > 0 and abs(rest) > RESTING * max(high, -low):
        said.append(
            ("note", f"the middle of all readings is {rest:.3g} kPa: give the reading at no load as offset")
        )
    return said


def _fingertip(raw: RawTouch) -> Said:
    positions, normals = raw.positions_m, raw.normals
    if positions.ndim != 2 or positions.shape[1:] != (3,) or not len(positions):
        return [("refused", f"taxel positions must have shape (N, 3), not {positions.shape}")]
    if normals.shape != positions.shape:
        return [("refused", f"{len(positions)} taxel positions, but {len(normals)} normals: both are needed")]
    if not (np.isfinite(positions).all() and np.isfinite(normals).all()):
        return [("refused", "taxel positions or normals are NaN or infinite")]
    said: Said = []
    extent = np.ptp(positions, axis=0)
    text = "{} taxels on {:.1f} x {:.1f} x {:.1f} mm".format(len(positions), *(extent * 1000))
    if extent.max() > LARGEST_TIP_M:
        said.append(("refused", f"{text}: are positions in mm? metres are needed"))
    else:
        said.append(("fine", f"{text}{_pitch(positions)}"))
    length = np.linalg.norm(normals, axis=1)
    if (np.abs(length - 1) > 0.01).any():
        row = int(np.argmax(np.abs(length - 1)))
        said.append(("refused", f"normals must have length 1, but that of taxel {row} has {length[row]:.3g}"))
    else:
        said += _outward(positions, normals)
    if not 0 < raw.radius_m < 1:
        said.append(("refused", f"the radius must be in (0, 1) m, not {raw.radius_m:g}"))
    elif len(positions) >= 4:
        own = float(np.linalg.norm(positions, axis=1).mean())
        same = abs(own - raw.radius_m) < 0.05 * raw.radius_m
        words = "as the taxels have it" if same else f"but taxels are {own * 1000:.2f} mm from the origin"
        said.append(("fine" if same else "note", f"radius {raw.radius_m * 1000:.2f} mm, {words}"))
    return said


def _pitch(positions: NDArray[np.float64]) -> str:
    """Median distance to the nearest neighbour; for a few thousand taxels at most."""
    if not 2 <= len(positions) <= 3000:
        return ""
    squared = np.square(positions).sum(axis=1)
    apart = squared[:, None] + squared - 2 * positions @ positions.T
    np.fill_diagonal(apart, np.inf)
    return f", {np.sqrt(max(float(np.median(apart.min(axis=1))), 0.0)) * 1000:.2f} mm apart"


def _outward(positions: NDArray[np.float64], normals: NDArray[np.float64]) -> Said:
    inner = positions.mean(axis=0) - np.ptp(positions, axis=0).max() * normals.mean(axis=0)
    inward = np.flatnonzero(((positions - inner) * normals).sum(axis=1) < 0)
    from_origin = float(np.mean((positions * normals).sum(axis=1) > 0))
    if len(positions) >= 4 and from_origin < 0.5:
        return [("note", "most normals point at the fingertip's origin: they must point outwards")]
    if len(inward):
        return [("note", f"normals of taxels {_listed(inward)} point inwards")]
    return []


def _listed(numbers: NDArray[np.int64]) -> str:
    """``3, 5, 8 and 4 more``."""
    text = ", ".join(map(str, numbers[:PLENTY].tolist()))
    return text if len(numbers) <= PLENTY else f"{text} and {len(numbers) - PLENTY} more"
