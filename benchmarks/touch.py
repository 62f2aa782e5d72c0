"""How well touch works: curvature, sparse arrays, primitives, edges and speed, on seeded simulation.

Errors of curvature are in percent of the larger principal curvature; the larger error of k1 and k2 counts.
Surfaces and noise are drawn from the seed. Seeds below 1000 were used to tune and to learn; the default is
1000. Noise levels: clean; modest (200 Pa, 0.02 mm, 2 mrad); slipping (modest, and 15 % of the turn slips);
strong (2 mm point spread, each reading 10 % off, 0.2 mm and 0.5 degrees on each pose); strong peak (the same,
but 10 % of the peak on every taxel at all times). `chapter` is the chapter's estimator and belief.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import touch_curvature
import touch_edges
import touch_primitives
import touch_sparse
import touch_speed
from touch_cases import SiteRow

from evifuse.errors import EvifuseError
from evifuse.recordings.recording import Fingertip

PARTS = ("curvature", "layouts", "sparse", "edges", "primitives", "speed")


def real_layouts(names: tuple[str, ...] = touch_curvature.FEW_LAYOUTS) -> dict[str, Fingertip | None]:
    """Layouts of real fingertips, where the package that has them is installed."""
    from evifuse.touch.layouts import load_fingertip

    try:
        return {name: load_fingertip(name) for name in names}
    except EvifuseError as error:
        print(f"no real layouts: {error}")
        return {}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "parts",
        nargs="*",
        choices=[*PARTS, PARTS],
        default=PARTS,
        metavar="PART",
        help=f"{', '.join(PARTS)}; all by default",
    )
    parser.add_argument("--quick", action="store_true", help="a third of the surfaces")
    parser.add_argument("--seed", type=int, default=1000)
    parser.add_argument("--objects", type=Path, metavar="DIR", help="meshes (STL, OBJ, PLY) to feel as well")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--draw", type=Path, metavar="DIR", help="pictures of the figures")
    arguments = parser.parse_args()
    found: dict[str, Any] = {"seed": arguments.seed}
    seen: dict[str, list[SiteRow]] = {}
    for part in arguments.parts:
        rows, summary, show = _measured(part, arguments.seed, arguments.quick, arguments.objects)
        found[part], seen[part] = summary, rows
        if not arguments.json:
            print(f"\n{part}, seed {arguments.seed}")
            show(summary)
    if arguments.draw is not None:
        from touch_draw import draw

        draw(arguments.draw, seen)
    if arguments.json:
        sites = {part: [row.to_json() for row in rows] for part, rows in seen.items()}
        print(json.dumps(found | {"rows": sites}))


def _measured(
    part: str, seed: int, quick: bool, objects: Path | None
) -> tuple[list[SiteRow], list[dict[str, Any]], Any]:
    if part == "curvature":
        levels = touch_curvature.LEVELS
        rows = list(touch_curvature.run(seed, 3 if quick else 10, levels, {"sphere 305": None}))
        return rows, touch_curvature.summary(rows), touch_curvature.print_summary
    if part == "layouts":
        names = touch_curvature.FEW_LAYOUTS if quick else touch_curvature.LAYOUTS
        rows = list(touch_curvature.run(seed, 2 if quick else 5, ("clean", "modest"), real_layouts(names)))
        return rows, touch_curvature.summary(rows), touch_curvature.print_summary
    if part == "sparse":
        rows = list(
            touch_sparse.run(seed, ("clean", "modest"), (8,) if quick else (4, 6, 8), 6 if quick else 2)
        )
        return rows, touch_sparse.summary(rows), touch_sparse.print_summary
    if part == "edges":
        rows = list(touch_edges.run(seed, 1 if quick else 4, real_layouts((touch_edges.LAYOUT,))))
        return rows, touch_edges.summary(rows), touch_edges.print_summary
    if part == "primitives":
        meshes = touch_primitives.load_meshes(objects)
        tips: dict[str, Fingertip | None] = {"sphere 305": None} | real_layouts()
        rows = list(touch_primitives.run(seed, 7 if quick else 35, tips, meshes))
        return rows, touch_primitives.summary(rows), touch_primitives.print_summary
    return [], touch_speed.measure(2 if quick else 7), touch_speed.print_summary


if __name__ == "__main__":
    main()
