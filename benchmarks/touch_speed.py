"""Figure (v): how fast touch is: the batch sensor, the online tracker, the simulation."""

from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np
from touch_sparse import sparse_fingertip

from evifuse.simulation import simulate
from evifuse.touch import sense_curvature


def seconds(action: Callable[[], Any], times: int) -> float:
    """Median wall-clock time; the first call, which may compile, is not counted."""
    action()
    spent: list[float] = []
    for _ in range(times):
        started = perf_counter()
        action()
        spent.append(perf_counter() - started)
    return float(np.median(spent))


def measure(times: int) -> list[dict[str, Any]]:
    """What is measured, in its unit, and how many times real time it is."""
    found: list[dict[str, Any]] = []
    for label, tip in (("305 taxels", None), ("8 x 8 taxels", sparse_fingertip(8))):
        touch = simulate("cylinder", picture=False, fingertip=tip, seed=1000).scene.touch
        length = 1e-9 * float(touch.time_ns[-1] - touch.time_ns[0])
        batch = seconds(lambda touch=touch: sense_curvature(touch), times)
        found.append({"what": f"batch, {label}", "ms": 1e3 * batch, "real_time": length / batch})
        online = per_sample_us(touch)
        if online is not None:
            found.append({"what": f"online update, {label}", "us": online, "real_time": 1e3 / online})
    for control in ("force", "pose"):
        spent = seconds(lambda c=control: simulate("cylinder", picture=False, control=c), max(1, times // 3))
        found.append(
            {"what": f"simulation, {control}, 305 taxels", "ms": 1e3 * spent, "real_time": 10 / spent}
        )
    return found


def per_sample_us(touch: Any) -> float | None:
    """Median time of one update of the tracker, microseconds."""
    try:
        from evifuse.touch import CurvatureTracker
    except ImportError:
        return None
    tracker = CurvatureTracker(touch.fingertip)
    spent: list[float] = []
    for i in range(min(len(touch.time_ns), 5000)):
        started = perf_counter()
        tracker.update(
            int(touch.time_ns[i]),
            touch.position_m[i],
            touch.orientation_xyzw[i],
            float(touch.joint_angle_rad[i]),
            touch.pressure_pa[i],
        )
        spent.append(perf_counter() - started)
    return 1e6 * float(np.median(spent))


def print_summary(rows: list[dict[str, Any]]) -> None:
    for row in rows:
        value = f"{row['us']:8.0f} us" if "us" in row else f"{row['ms']:8.1f} ms"
        print(f"{row['what']:<34} {value}  {row['real_time']:8.0f} x real time")
