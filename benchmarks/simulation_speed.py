"""How fast the simulation is: every surface and control, 1 kHz, 305 taxels, one core, processor time."""

import argparse
import json
from time import process_time
from typing import Any

from evifuse.simulation import SURFACES, auto_sites, load_mesh, simulate
from evifuse.simulation.surface import Sites, Surface


def bodies() -> list[tuple[str, str | Surface, Sites | None]]:
    """What is touched: its name, itself, and where, if not at its own sites. Meshes are smoothed before."""
    named: list[tuple[str, str | Surface, Sites | None]] = [(name, name, None) for name in SURFACES]
    try:
        import trimesh
    except ImportError:
        return named
    ball, ring = trimesh.creation.icosphere(4, 0.02), trimesh.creation.torus(0.04, 0.015, 96, 64)
    ball, ring = (load_mesh((mesh.vertices, mesh.faces)) for mesh in (ball, ring))
    some = auto_sites(ring, 2, seed=1)
    return [*named, ("mesh, ball", ball, ((0.0, 0.0), (0.004, 0.0))), ("mesh, torus", ring, some)]


def measure(times: int) -> list[dict[str, Any]]:
    """Seconds of recording for each second of work; the best of some, as others may use the machine."""
    rows: list[dict[str, Any]] = []
    for name, kind, sites in bodies():
        row: dict[str, Any] = {"surface": name}
        for control in ("force", "pose"):
            best = 0.0
            for _ in range(times + 1):  # the first compiles
                started = process_time()
                made = simulate(kind, control=control, sites=sites, picture=False)
                spent = process_time() - started
                best = max(best, 1e-3 * len(made.truth.roll) / spent)
            row[control] = best
        rows.append(row)
    return rows


def print_summary(rows: list[dict[str, Any]]) -> None:
    print("surface        force     pose   (times real time)")
    for row in rows:
        print(f"{row['surface']:<12} {row['force']:7.1f}  {row['pose']:7.1f}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=3)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    found = measure(arguments.times)
    if arguments.json:
        print(json.dumps(found))
    else:
        print_summary(found)
