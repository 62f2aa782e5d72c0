"""What a recording says that can hardly be meant: another unit, another order of numbers.

A finger that rolls without slip turns about its point of contact: its centre moves at v = w x a n, with w its
turn rate, a its radius and n the surface's normal (any textbook of mechanics). Both sides are recorded. Where
they don't agree, but do agree after another reading of the numbers, that reading is suspected. All limits are
our own.
"""

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings import rotation
from evifuse.recordings.clock import FAST_M_PER_S, rate_hz, suspected_millimetres
from evifuse.recordings.recording import TouchRecording

__all__ = ["suspected_time_unit", "suspicions"]

Array = NDArray[np.float64]

FASTEST_HZ = 2e4
"""No taxels are read so often."""
STRONGEST_PA, WEAKEST_PA = 2e7, 1e3
"""No fingertip presses so hard, or so lightly all the time."""
RESTING = 0.05
"""Share of the highest pressure that the middle of all readings may have: most taxels are not loaded."""
STEPS = 400
"""How many steps of a recording are looked at, about."""
AGREES, BETTER = 0.8, 0.15
"""Correlation of both sides of the equation of rolling that is agreement, and how much more of it matters."""
LARGE = 20.0
"""Ratio of both sides that no slip explains."""


def suspected_time_unit(time_ns: NDArray[np.int64]) -> str:
    """What times are in, if it is hardly nanoseconds.

    Parameters
    ----------
    time_ns : ndarray of int64, shape (T,)
        Times, said to be nanoseconds; they may repeat or go back.

    Returns
    -------
    str
        Such as ``us? multiply by 1000``; empty if there is nothing to suspect.

    Examples
    --------
    >>> suspected_time_unit(np.arange(5) * 2000)
    'us? multiply by 1000'
    >>> suspected_time_unit(np.arange(5) * 2_000_000)
    ''
    """
    if len(time_ns) < 3:
        return ""
    length = float(time_ns[-1] - time_ns[0]) * 1e-9
    rate = max(rate_hz(time_ns), (len(time_ns) - 1) / length if length > 0 else 0.0)
    for unit, factor in (("us", 10**3), ("ms", 10**6), ("s", 10**9)):
        if FASTEST_HZ < rate <= FASTEST_HZ * factor:
            return f"{unit}? multiply by {factor}"
    return ""


def suspicions(touch: TouchRecording) -> list[tuple[str, str]]:
    """What may not be meant as it is said.

    Parameters
    ----------
    touch : TouchRecording
        Checked.

    Returns
    -------
    list of (str, str)
        The part (``pose``, ``fingertip``, ``pressures``), and a line that says what is suspected and what to
        do.
    """
    found = _of_pressures(touch)
    if len(touch.time_ns) >= 20 and len(touch.fingertip.normals) > 1:
        with np.errstate(all="ignore"):  # numbers may be of any size here
            found += _of_rolling(touch)
    if not any(part == "pose" for part, _ in found) and suspected_millimetres(
        touch.time_ns, touch.position_m
    ):
        text = f"the finger moves faster than {FAST_M_PER_S:g} m/s: is its position in mm? metres are needed"
        found.append(("pose", text))
    return found


def _of_pressures(touch: TouchRecording) -> list[tuple[str, str]]:
    some = touch.pressure_pa[:: max(1, len(touch.pressure_pa) // 2000)]
    high, low, rest = float(touch.pressure_pa.max()), float(some.min()), float(np.median(some))
    said: list[str] = []
    if high > STRONGEST_PA:
        said.append(f"the highest is {high / 1000:.4g} kPa: no fingertip presses so hard; is the unit right?")
    elif 0 < high < WEAKEST_PA:
        said.append(f"the highest is {high:.3g} Pa: so little is hardly felt; is the unit right?")
    if high > 0 and abs(rest) > RESTING * max(high, -low):
        said.append(
            f"the middle of all readings is {rest / 1000:.3g} kPa: give the reading at no load as offset"
        )
    return [("pressures", text) for text in said]


def _of_rolling(touch: TouchRecording) -> list[tuple[str, str]]:
    steps = _steps(touch)
    if steps is None:
        return []
    moved, before, after, inward = steps
    ratio, agreement = _rolling(moved, before, after, inward)
    w_first = [1, 2, 3, 0]
    others = {
        "is the quaternion in the order w, x, y, z? give x, y, z, w": (
            before[:, w_first], after[:, w_first], inward,
        ),
        "does the quaternion turn the world into the fingertip? give its inverse": (
            _inverse(before), _inverse(after), inward,
        ),
        "is it w, x, y, z, and from the world into the fingertip? give x, y, z, w of the inverse": (
            _inverse(before[:, w_first]), _inverse(after[:, w_first]), inward,
        ),
        "do the normals point inwards? they must point outwards": (before, after, -inward),
    }  # fmt: skip
    fits = {text: _rolling(moved, *reading)[1] for text, reading in others.items()}
    best = max(fits, key=fits.__getitem__)
    if fits[best] < max(AGREES, agreement + BETTER):
        return _of_scale(ratio) if agreement > AGREES else []
    part = "fingertip" if "normals" in best else "pose"
    return [(part, f"the finger does not roll the way it goes, but would otherwise: {best}")]


def _of_scale(ratio: float) -> list[tuple[str, str]]:
    """Lengths that don't fit to each other, though the directions do."""
    if ratio > LARGE:
        unit = "mm" if ratio > 300 else "cm"
        text = f"the finger goes {ratio:.0f} times as far as it rolls: is the position in {unit}?"
        return [("pose", f"{text} metres are needed")]
    if ratio < 1 / LARGE:
        return [
            (
                "fingertip",
                f"the finger rolls {1 / ratio:.0f} times as far as it goes: is its radius in metres?",
            )
        ]
    return []


def _steps(touch: TouchRecording) -> tuple[Array, Array, Array, Array] | None:
    """Ways (M, 3) of the centre while touching, orientations before and after, a times the contact's normal.

    The last is in the fingertip's frame, from the taxels that feel most. A step takes 50 ms, so that noise is
    small beside it.
    """
    tip, pressure = touch.fingertip, touch.pressure_pa
    lag = max(1, min(len(pressure) // 8, round(0.05 * rate_hz(touch.time_ns))))
    first = np.arange(0, len(pressure) - lag, max(1, len(pressure) // STEPS))
    load = np.maximum(pressure[first] - 0.5 * pressure[first].max(axis=1, keepdims=True), 0.0)
    strong = pressure[first].max(axis=1) > 0.2 * max(float(pressure.max()), 1e-12)
    stays = pressure[first + lag].max(axis=1) > 0.2 * max(float(pressure.max()), 1e-12)
    brief = touch.time_ns[first + lag] - touch.time_ns[first] < 3 * lag * 1e9 / rate_hz(touch.time_ns)
    kept = strong & stays & brief & (load.sum(axis=1) > 0)
    if kept.sum() < 10:
        return None
    first = first[kept]
    inward = load[kept] @ tip.normals
    length = np.linalg.norm(inward, axis=1, keepdims=True)
    inward = -tip.radius_m * inward / np.maximum(length, 1e-12)
    moved = touch.position_m[first + lag] - touch.position_m[first]
    return moved, touch.orientation_xyzw[first], touch.orientation_xyzw[first + lag], inward


def _rolling(moved: Array, before: Array, after: Array, inward: Array) -> tuple[float, float]:
    """Ratio of the way to the rolled way, and the correlation of both."""
    turn = rotation.multiply(after, _inverse(before))
    turn = 2 * turn[:, :3] * np.sign(turn[:, 3:] + 1e-300)
    middle = before + np.where((before * after).sum(axis=1, keepdims=True) < 0, -after, after)
    normal = rotation.rotate(middle / np.linalg.norm(middle, axis=1, keepdims=True), inward)
    rolled = np.cross(turn, normal)
    both = float((moved * rolled).sum())
    own = float(np.square(rolled).sum())
    whole = float(np.square(moved).sum())
    if not (0 < own < np.inf and 0 < whole < np.inf):
        return 1.0, 1.0
    return both / own, both / np.sqrt(own * whole)


def _inverse(quaternion: Array) -> Array:
    return quaternion * np.array([-1.0, -1.0, -1.0, 1.0])
