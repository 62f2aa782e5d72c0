"""The compiled classifier beside one logarithm of the same masses, and beside the plain implementation.

All contestants take turns in one run, so that a busy machine slows them alike; medians and ratios count.
``--arrays`` runs in the peers' environment of `benchmarks/belief.py`, with PyTorch and JAX, on an accelerator
where there is one.
"""

import argparse
import json
import time
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from belief import in_own_environment

from evifuse.belief import Frame, MassFunction
from evifuse.conductivity import READINGS, Aggregate, KnowledgeBase, classify, compile  # noqa: A004
from evifuse.knowledge import load_knowledge

Row = dict[str, Any]


def focal_sets(frame: Frame, count: int, rng: np.random.Generator) -> np.ndarray:
    return np.append(rng.choice(frame.full - 1, count - 1, replace=False) + 1, frame.full)


def medians(contestants: dict[str, Callable[[], Any]], rounds: int) -> dict[str, float]:
    """Median seconds of each, taking turns; the first turn warms up and does not count."""
    times: dict[str, list[float]] = {name: [] for name in contestants}
    for turn in range(rounds + 1):
        for name, run in contestants.items():
            start = time.perf_counter()
            run()
            if turn:
                times[name].append(time.perf_counter() - start)
    return {name: float(np.median(t)) for name, t in times.items()}


def many_prototypes(frame: Frame, count: int, rng: np.random.Generator) -> KnowledgeBase:
    """Ten classes with a tenth of the prototypes each, three focal sets and the frame in every one."""
    aggregates = []
    for c in range(10):
        prototypes = {
            f"{c}_{i}": MassFunction(frame, focal_sets(frame, 4, rng), rng.dirichlet(np.full(4, 3.0)))
            for i in range(count // 10)
        }
        aggregates.append(Aggregate(f"class {c}", prototypes))
    return KnowledgeBase(f"{count} prototypes", frame, tuple(aggregates), READINGS["sound"])


def against_log(rows: int, rounds: int, rng: np.random.Generator) -> list[Row]:
    chapter, ours = load_knowledge("chapter-curvature"), load_knowledge("curvature")
    smooth = replace(READINGS["sound"], smoothing=0.05)
    hundred = many_prototypes(chapter.frame, 100, rng)
    out: list[Row] = []
    for knowledge, reading_name, reading, widths in (
        (chapter, "sound", READINGS["sound"], (4, 5, 6, 7)),
        (chapter, "smooth", smooth, (5,)),
        (ours, "working", READINGS["working"], (4, 7)),
        (hundred, "sound", READINGS["sound"], (5,)),
    ):
        for count in widths:
            sets = focal_sets(knowledge.frame, count, rng)
            masses = rng.dirichlet(np.ones(count), rows)
            fast = compile(knowledge, sets, reading)
            found = medians(
                {
                    "log": lambda m=masses: np.log(m),
                    "conductivities": lambda f=fast, m=masses: f.conductivities(m),
                    "belief": lambda f=fast, m=masses: f.belief(m),
                },
                rounds,
            )
            tracemalloc.start()
            fast.conductivities(masses)
            peak = tracemalloc.get_traced_memory()[1] / masses.nbytes
            tracemalloc.stop()
            prototypes = len(fast.prototypes)
            ratio = found["conductivities"] / found["log"]
            out.append(
                {
                    "knowledge": knowledge.name,
                    "reading": reading_name,
                    "focal sets": count,
                    "prototypes": prototypes,
                    "log ms": 1e3 * found["log"],
                    "conductivities": ratio,
                    "belief": found["belief"] / found["log"],
                    "of 8 prototypes": ratio * 8 / prototypes,
                    "ns a row": 1e9 * found["conductivities"] / rows,
                    "memory / input": peak,
                }
            )
    return out


def against_plain(rows: int, rounds: int, rng: np.random.Generator) -> list[Row]:
    knowledge = load_knowledge("chapter-curvature")
    sets = focal_sets(knowledge.frame, 5, rng)
    masses = rng.dirichlet(np.ones(5), rows)
    fast = compile(knowledge, sets)
    few, some = masses[:50], masses[:20_000]

    def one_by_one() -> None:
        for m in few:
            classify(MassFunction.trusted(knowledge.frame, sets, m), knowledge)

    found = medians(
        {
            "compiled": lambda: fast.conductivities(masses),
            "plain, a call for each case": one_by_one,
            "plain, one batch": lambda: classify(
                MassFunction.trusted(knowledge.frame, sets, some), knowledge
            ),
        },
        rounds,
    )
    found["compiled"] /= rows
    found["plain, a call for each case"] /= len(few)
    found["plain, one batch"] /= len(some)
    return [
        {"contestant": name, "us a row": 1e6 * t, "times the compiled": t / found["compiled"]}
        for name, t in found.items()
    ]


def other_arrays(rows: int, rounds: int, rng: np.random.Generator) -> list[Row]:
    knowledge = load_knowledge("chapter-curvature")
    sets = focal_sets(knowledge.frame, 5, rng)
    masses = rng.dirichlet(np.ones(5), rows)
    fast = compile(knowledge, sets)
    contestants: dict[str, Callable[[], Any]] = {
        "log": lambda: np.log(masses),
        "NumPy": lambda: fast.conductivities(masses),
    }
    bandwidth: dict[str, float] = {}
    try:
        import torch
    except ImportError:
        print("PyTorch is not installed: left out")
    else:
        here = torch.from_numpy(masses)
        contestants["PyTorch, processor"] = lambda: fast.conductivities(here)
        if torch.cuda.is_available():
            there, name = here.cuda(), f"PyTorch, {torch.cuda.get_device_name()}"
            contestants[name] = lambda: (fast.conductivities(there), torch.cuda.synchronize())
            bandwidth[name] = _bandwidth(torch, there)
    try:
        import jax
    except ImportError:
        print("JAX is not installed: left out")
    else:
        jax.config.update("jax_enable_x64", True)
        array = jax.numpy.asarray(masses)
        contestants[f"JAX, {jax.default_backend()}"] = lambda: fast.conductivities(array).block_until_ready()
    found = medians(contestants, rounds)
    moved = masses.nbytes + 8 * rows * len(fast.classes)
    return [
        {
            "contestant": name,
            "times the log": t / found["log"],
            "million rows/s": rows / t / 1e6,
            "share of memory bandwidth": moved / t / bandwidth[name] if name in bandwidth else None,
        }
        for name, t in found.items()
    ]


def _bandwidth(torch: Any, like: Any) -> float:
    """Bytes a second that a copy on the device reads and writes."""
    target = torch.empty_like(like)
    found = medians({"copy": lambda: (target.copy_(like), torch.cuda.synchronize())}, 20)
    return 2 * like.numel() * like.element_size() / found["copy"]


def show(title: str, rows: list[Row]) -> None:
    print(f"\n{title}")
    keys = list(rows[0])
    cells = [keys] + [[_text(row[key]) for key in keys] for row in rows]
    widths = [max(len(line[i]) for line in cells) for i in range(len(keys))]
    for line in cells:
        print(
            "  ".join(
                cell.rjust(w) if i else cell.ljust(w)
                for i, (cell, w) in enumerate(zip(line, widths, strict=True))
            )
        )


def _text(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=1_000_000)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", type=Path, default=Path("out/classifier.json"))
    parser.add_argument("--arrays", action="store_true", help="PyTorch and JAX too")
    options = parser.parse_args()
    if options.arrays:
        in_own_environment()
    rng = np.random.default_rng(options.seed)
    tables = {
        "times one np.log of the same masses": against_log(options.rows, options.rounds, rng),
        "beside the plain implementation": against_plain(options.rows, min(options.rounds, 5), rng),
        "other arrays": other_arrays(options.rows, options.rounds, rng),
    }
    print(f"{options.rows} rows, medians of {options.rounds} rounds")
    for title, rows in tables.items():
        show(title, rows)
    options.json.parent.mkdir(parents=True, exist_ok=True)
    options.json.write_text(json.dumps(tables, indent=1))


if __name__ == "__main__":
    main()
