"""Figure (v): how fast touch is: the batch sensor and its stages, the online tracker, the simulation.

Batch times are the best of some calls in a row, in processor time and as it passed on the clock: other work
on the machine only makes them longer. The first call, which may compile, is printed beside them.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import perf_counter, process_time
from typing import Any

import numpy as np
import simulation_speed
from touch_sparse import sparse_fingertip

from evifuse.errors import EvifuseError
from evifuse.recordings.recording import Fingertip, TouchRecording
from evifuse.simulation import simulate
from evifuse.touch import CurvatureTracker, sense_curvature, sensor

STAGES = (
    "mended", "contact_track", "guided", "find_sites", "turned_by_joint", "as_sphere", "measure_roll",
    "site_shape", "find_edge", "missed_sites", "contact_quality", "site_evidence", "evidence_from_sites",
    "_classified",
)  # fmt: skip
PERCENTILES = (50, 99)


def best_ms(action: Callable[[], Any], times: int) -> tuple[float, float]:
    """Shortest processor time and shortest time on the clock of some calls, milliseconds."""
    spent: list[tuple[float, float]] = []
    for _ in range(times):
        started = process_time(), perf_counter()
        action()
        spent.append((process_time() - started[0], perf_counter() - started[1]))
    return 1e3 * min(s for s, _ in spent), 1e3 * min(s for _, s in spent)


@contextmanager
def timed_stages(spent: dict[str, float]) -> Iterator[None]:
    """Add up the processor time of each stage of the batch sensor."""

    def watched(name: str, stage: Callable[..., Any]) -> Callable[..., Any]:
        def run(*arguments: Any, **options: Any) -> Any:
            started = process_time()
            found = stage(*arguments, **options)
            spent[name] = spent.get(name, 0.0) + 1e3 * (process_time() - started)
            return found

        return run

    kept = {name: getattr(sensor, name) for name in STAGES if hasattr(sensor, name)}
    try:
        for name, stage in kept.items():
            setattr(sensor, name, watched(name, stage))
        yield
    finally:
        for name, stage in kept.items():
            setattr(sensor, name, stage)


def stages_ms(touch: TouchRecording, times: int) -> dict[str, float]:
    """Shortest processor time of each stage, milliseconds."""
    best: dict[str, float] = {}
    for _ in range(times):
        spent: dict[str, float] = {}
        with timed_stages(spent):
            sense_curvature(touch)
        best = {name: min(value, best.get(name, np.inf)) for name, value in spent.items()}
    return best


def fingertips() -> dict[str, Fingertip | None]:
    """The arrays that are timed; a real layout where the package that has it is installed."""
    from evifuse.touch import load_fingertip

    tips: dict[str, Fingertip | None] = {"8 x 8 taxels": sparse_fingertip(8), "305 taxels": None}
    try:
        tips["DP-M2826-Omega"] = load_fingertip("paxini:DP-M2826-Omega")
    except EvifuseError as error:
        print(f"no real layout: {error}")
    return tips


def measure(times: int) -> list[dict[str, Any]]:
    """What is measured, in its unit, and how many times real time it is."""
    found: list[dict[str, Any]] = []
    for label, tip in fingertips().items():
        touch = simulate("cylinder", picture=False, fingertip=tip, seed=1000).scene.touch
        length = 1e-6 * float(touch.time_ns[-1] - touch.time_ns[0])
        first = best_ms(lambda touch=touch: sense_curvature(touch), 1)[0]
        own, clock = best_ms(lambda touch=touch: sense_curvature(touch), 4 * times)
        row = {"what": f"batch, {label}", "ms": own, "clock_ms": clock, "first_ms": first}
        row |= {"real_time": length / own, "clock_real_time": length / clock}
        found.append(row | {"stages_ms": stages_ms(touch, 2 * times)})
        middle, late = per_sample_us(touch)
        found.append(
            {"what": f"online update, {label}", "us": middle, "late_us": late, "real_time": 1e3 / middle}
        )
    found += list(simulations(max(1, times // 3)))
    return found


def per_sample_us(touch: TouchRecording) -> tuple[float, ...]:
    """Median and 99th percentile of the processor time of one update of the tracker, microseconds."""
    tracker, spent = CurvatureTracker(touch.fingertip), list[float]()
    for i in range(min(len(touch.time_ns), 5000)):
        started = process_time()
        tracker.update(
            int(touch.time_ns[i]),
            touch.position_m[i],
            touch.orientation_xyzw[i],
            float(touch.joint_angle_rad[i]),
            touch.pressure_pa[i],
        )
        spent.append(process_time() - started)
    return tuple(1e6 * np.percentile(spent, PERCENTILES))


def simulations(times: int) -> Iterator[dict[str, Any]]:
    """Every surface and two meshes rolled over for 10 s by 305 taxels at 1 kHz, in both controls."""
    for row in simulation_speed.measure(times):
        for control in ("force", "pose"):
            faster = row[control]
            yield {
                "what": f"simulation, {row['surface']}, {control}",
                "ms": 1e4 / faster,
                "real_time": faster,
            }


def print_summary(rows: list[dict[str, Any]]) -> None:
    for row in rows:
        value = f"{row['us']:8.0f} us" if "us" in row else f"{row['ms']:8.1f} ms"
        more = f"  99 % below {row['late_us']:.0f} us" if "late_us" in row else ""
        if "clock_ms" in row:
            more = f"  on the clock {row['clock_ms']:.1f} ms, {row['clock_real_time']:.0f} x; "
            more += f"first call {row['first_ms']:.0f} ms"
        print(f"{row['what']:<34} {value}  {row['real_time']:8.0f} x real time{more}")
        if "stages_ms" in row:
            total = sum(row["stages_ms"].values())
            shares = sorted(row["stages_ms"].items(), key=lambda item: -item[1])
            print(
                "    "
                + ", ".join(
                    f"{name.strip('_')} {value / total:.0%}"
                    for name, value in shares
                    if value > 0.005 * total
                )
            )
