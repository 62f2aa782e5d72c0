"""Belief functions: the toolbox beside a bare compiled kernel and beside its peers, all in one run.

The first run makes a virtual environment (``.venv-peers``), installs the peers and evifuse there, and
starts again in it. Every contestant solves the same problem; rounds are interleaved, so that a busy machine
slows all alike, and medians are printed with ratios. A peer that can't solve a problem in reasonable time is
left out of it, and that is said. The bare kernels are what a person would write with numba for that problem
alone: no objects, no checks.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
VENV = ROOT / ".venv-peers"
PEERS = ["torchbelief", "evidencelib", "evtools-dst", "pybelief", "py-dempster-shafer", "ecolaf", "jax"]
OWN = ["numpy", "numba", "pyyaml", "array-api-compat"]
TORCH = os.environ.get("EVIFUSE_TORCH", "torch==2.13.0")
Work = Callable[[], Any]


def in_own_environment() -> None:
    """Start again in the peers' environment, made on first use."""
    python = VENV / "bin" / "python"
    ready = VENV / ".ready"
    wanted = " ".join([TORCH, *OWN, *PEERS])
    if not ready.exists() or ready.read_text() != wanted:
        print(f"setting up {VENV} (once) ...", file=sys.stderr)
        subprocess.run([sys.executable, "-m", "venv", str(VENV)], check=True)
        pip = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        subprocess.run([*pip, TORCH, *OWN, *PEERS], check=True)
        subprocess.run([*pip, "--no-deps", "--editable", str(ROOT)], check=True)
        ready.write_text(wanted)
    if Path(sys.prefix).resolve() != VENV.resolve():
        os.execv(str(python), [str(python), *sys.argv])


def measure(contestants: dict[str, Work], rounds: int, budget_s: float = 0.02) -> dict[str, float]:
    """Median seconds of one call, rounds interleaved; fast calls are repeated within a round."""
    repeats: dict[str, int] = {}
    for name, work in contestants.items():
        work()
        start = time.perf_counter()
        work()
        repeats[name] = max(1, int(budget_s / max(time.perf_counter() - start, 1e-7)))
    times: dict[str, list[float]] = {name: [] for name in contestants}
    for _ in range(rounds):
        for name, work in contestants.items():
            number = repeats[name]
            start = time.perf_counter()
            for _ in range(number):
                work()
            times[name].append((time.perf_counter() - start) / number)
    return {name: statistics.median(values) for name, values in times.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--json", type=Path, help="also write the figures here")
    arguments = parser.parse_args()
    in_own_environment()
    import belief_contestants as contestants

    results: list[dict[str, Any]] = []
    for problem in contestants.problems():
        times = measure(problem.contestants, arguments.rounds if not problem.slow else 3)
        base = times[problem.reference]
        print(f"\n{problem.name}")
        for name, seconds in sorted(times.items(), key=lambda item: item[1]):
            print(f"  {name:<22} {1e6 * seconds:14.1f} us   {seconds / base:9.2f} x {problem.reference}")
        for line in problem.left_out:
            print(f"  left out: {line}")
        verdicts = problem.judge(times)
        for text, fine in verdicts:
            print(f"  {'met   ' if fine else 'MISSED'} {text}")
        results.append({"problem": problem.name, "seconds": times, "verdicts": verdicts})
    imports = measure_imports()
    print("\nimports (whole process)")
    for name, seconds in imports.items():
        print(f"  {name:<34} {1e3 * seconds:8.1f} ms")
    memory = contestants.memory_ratio()
    print(f"\npeak memory of a batch of 100,000 pairs over its input and output: {memory:.2f} (target 3)")
    results.append({"problem": "imports", "seconds": imports})
    results.append({"problem": "memory", "ratio": memory})
    if arguments.json:
        arguments.json.write_text(json.dumps(results, indent=2) + "\n")


def measure_imports() -> dict[str, float]:
    """Whole processes: the belief package must cost little more than NumPy, and no numba."""
    done = subprocess.run(
        [sys.executable, "-c", "import evifuse.belief, sys; print('numba' in sys.modules)"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.strip() == "False", "evifuse.belief imports numba"
    code = {
        "import numpy": "import numpy",
        "import evifuse.belief": "import evifuse.belief",
        "first dempster() of a process": (
            "from evifuse.belief import Frame, MassFunction, dempster; f = Frame(['a', 'b']);"
            "m = MassFunction.of(f, {'a': 0.5, f: 0.5}); dempster(m, m)"
        ),
    }
    work = {
        name: (lambda text=text: subprocess.run([sys.executable, "-c", text], check=True))
        for name, text in code.items()
    }
    return measure(work, 5, budget_s=0.0)


if __name__ == "__main__":
    main()
