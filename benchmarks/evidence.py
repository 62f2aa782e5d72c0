"""Labelled evidence of the project's own senses, as Parquet files to train and judge classifiers on.

- `shapes.parquet`: what the shape sensor says about human drawings (Hand-drawn Shapes Dataset, (c) 2022
  Francois Robert, CC BY 4.0), with the person who drew each, so that a split can keep people apart. Every
  drawing is seen once, under one of four conditions: clean, a quarter or 40 % erased, noise of 60 levels.
- `curvature.parquet`: what touch says about simulated surfaces: seven kinds, many sizes, strong noise, one to
  four rolling directions. Labels quasiplanar, curved, occluded.
- `objects-shape.parquet` and `objects-touch.parquet`: what both senses say about the same simulated body,
  row by row.

Each file is what `evifuse.belief.to_parquet` writes, with the columns `label`, `kind` and `group` added;
`from_parquet` reads it. Every case is kept in `cases.jsonl` as soon as it is sensed: a second call goes on.

Usage: python benchmarks/evidence.py DIR [--data DATA] [--scenes 240] [--quick]
DATA holds `drawings/`; without it no shapes.parquet is written.
"""

import argparse
import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet
from rich.progress import track
from vision import DRAWN, clean, noisy, occluded

from evifuse.belief import Frame, MassFunction, to_parquet
from evifuse.touch.primitives import CURVATURE_FRAME
from evifuse.vision.primitives import SHAPE_FRAME

SEED = 1989
CHANGES = {"clean": clean, "25 %": occluded(0.25), "40 %": occluded(0.40), "noise 60": noisy(60)}
CURVED = ("cylinder", "sphere", "saddle", "trough", "bowl")
HOLLOW = ("trough", "bowl")
FRAMES = {
    "shapes": SHAPE_FRAME,
    "curvature": CURVATURE_FRAME,
    "objects-shape": SHAPE_FRAME,
    "objects-touch": CURVATURE_FRAME,
}
Case = dict[str, Any]


def drawn_cases(data: Path, every: int) -> Iterator[tuple[str, Callable[[], list[Case]]]]:
    """One task for each drawing of a rectangle, triangle or ellipse."""
    for folder, label in DRAWN.items():
        files = sorted((data / "drawings" / folder).glob("*.png")) if label != "other" else []
        for number, file in enumerate(files):
            if number % every == 0:
                yield f"shapes/{file.name}", lambda f=file, c=label, n=number: [seen_drawing(f, c, n)]


def seen_drawing(file: Path, label: str, number: int) -> Case:
    """Evidence of the most believed object of one drawing; ignorance if nothing is seen."""
    from evifuse.recordings.images import read_image
    from evifuse.vision import sense_shapes

    kind, person, _, _ = file.name.split(".")
    rng = np.random.default_rng([SEED, number, len(kind)])
    condition = list(CHANGES)[rng.integers(len(CHANGES))]
    seen = sense_shapes(CHANGES[condition](read_image(file), rng))
    return case("shapes", label, f"{kind}, {condition}", person, seen[0].evidence if seen else None)


def case(name: str, label: str, kind: str, group: str, evidence: MassFunction | None) -> Case:
    masses = {"frame": 1.0} if evidence is None else evidence.as_dict()
    return {"set": name, "label": label, "kind": kind, "group": group, "masses": masses}


def touched_cases(scenes: int) -> Iterator[tuple[str, Callable[[], list[Case]]]]:
    """One task for each simulated scene: first those that are touched only, then those that are seen too."""
    for number in range(scenes):
        yield f"curvature/{number}", lambda n=number: sensed_scene(n, picture=False)
    for number in range(scenes):
        yield f"objects/{number}", lambda n=number: sensed_scene(n, picture=True)


def sensed_scene(number: int, picture: bool) -> list[Case]:
    """Simulate a body of a random kind, size and noise, and sense it."""
    from evifuse.fusion import fuse_scene
    from evifuse.simulation import simulate
    from evifuse.simulation.procedure import Procedure
    from evifuse.simulation.simulate import Noise

    rng = np.random.default_rng([SEED, number, int(picture)])
    name = ("plane", CURVED[number // 3 % 5], "hole")[number % 3]
    strength = float(np.exp(rng.uniform(np.log(0.5), np.log(8.0))))
    noise = Noise(1000 * strength, 1e-4 * strength, 1e-2 * strength, grey=float(rng.uniform(1.5, 40.0)))
    count = int(rng.integers(1, 5))
    turn = rng.uniform(0, np.pi)
    directions = tuple(float(turn + i * np.pi / count) for i in range(count))
    procedure = Procedure(directions_rad=directions, arc_rad=float(rng.uniform(0.5, 0.9)))
    scene = simulate(
        name,
        seed=number,
        rate_hz=250.0,
        noise=noise,
        procedure=procedure,
        picture=picture,
        **dimensions(name, rng),
    )
    fused = fuse_scene(scene.scene)
    touch = None if fused.touch is None else fused.touch.evidence
    label = scene.truth.category
    if not picture:
        return [case("curvature", label, name, str(number), touch)]
    shape = None if fused.shape is None else fused.shape.evidence
    return [
        case("objects-shape", label, name, str(number), shape),
        case("objects-touch", label, name, str(number), touch),
    ]


def dimensions(name: str, rng: np.random.Generator) -> dict[str, float]:
    """Random size: plates of 5 to 12 cm, holes of 12 to 30 mm radius, curves of 15 (25 hollow) to 150 mm."""
    if name == "plane":
        return {"length_m": float(rng.uniform(0.06, 0.12)), "width_m": float(rng.uniform(0.05, 0.1))}
    low, high = (0.012, 0.03) if name == "hole" else (0.025 if name in HOLLOW else 0.015, 0.15)
    return {"radius_m": float(np.exp(rng.uniform(np.log(low), np.log(high))))}


def stacked(frame: Frame, cases: list[Case]) -> MassFunction:
    """One batch over every focal set that occurs, hypotheses and frame always among them."""
    single = [MassFunction.of(frame, {_subset(frame, k): v for k, v in c["masses"].items()}) for c in cases]
    singletons = [1 << i for i in range(len(frame))]
    others = sorted({int(s) for m in single for s in m.focal_sets} - {*singletons, frame.full})
    sets = np.array([*singletons, *others, frame.full], dtype=np.int64)
    return MassFunction(frame, sets, np.stack([m.on(sets) for m in single]))


def _subset(frame: Frame, label: str) -> Any:
    return frame if label == "frame" else tuple(label.split("|"))


def write_evidence(path: Path, frame: Frame, cases: list[Case]) -> None:
    """A file of `to_parquet` with the columns label, kind and group beside the masses."""
    to_parquet(stacked(frame, cases), path)
    table = pa.parquet.read_table(path)
    for column in ("label", "kind", "group"):
        table = table.append_column(column, pa.array([c[column] for c in cases]))
    pa.parquet.write_table(table, path)


def read_done(path: Path) -> dict[str, list[Case]]:
    """Cases of earlier calls by task; a line that was cut short by a kill is left out."""
    done: dict[str, list[Case]] = {}
    for line in path.read_text().splitlines() if path.exists() else []:
        try:
            row = json.loads(line)
        except ValueError:
            continue
        done[row["task"]] = row["cases"]
    return done


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("out", type=Path)
    parser.add_argument("--data", type=Path, help="folder that holds drawings/")
    parser.add_argument("--scenes", type=int, default=240, help="simulated scenes of each of two sets")
    parser.add_argument("--quick", action="store_true", help="every 20th drawing and 12 scenes")
    options = parser.parse_args()
    if options.data is not None and not (options.data / "drawings").is_dir():
        sys.exit(f"{options.data}: there is no folder drawings in it")
    options.out.mkdir(parents=True, exist_ok=True)
    log = options.out / "cases.jsonl"
    done = read_done(log)
    tasks = list(drawn_cases(options.data, 20 if options.quick else 1)) if options.data else []
    tasks += touched_cases(12 if options.quick else options.scenes)
    with log.open("a") as handle:
        for name, sense in track(tasks, description="sensing"):
            if name not in done:
                done[name] = sense()
                handle.write("\n" * (handle.tell() > 0) + json.dumps({"task": name, "cases": done[name]}))
                handle.flush()
    cases = [c for name, _ in tasks for c in done[name]]
    for name, frame in FRAMES.items():
        chosen = [c for c in cases if c["set"] == name]
        if chosen:
            write_evidence(options.out / f"{name}.parquet", frame, chosen)
            ignorant = float(np.mean([c["masses"].get("frame", 0.0) for c in chosen]))
            print(f"{name:14} {len(chosen):5} cases, mean mass of the frame {ignorant:.2f}")


if __name__ == "__main__":
    sys.exit(main())
