"""`evifuse simulate`: one recording, a random data set, or the catalogue."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from evifuse.errors import UsageError
from evifuse.simulation import (
    NOISES,
    SURFACES,
    SimulatedScene,
    auto_sites,
    load_mesh,
    simulate,
    surface,
    truth_row,
    write_dataset,
)
from evifuse.touch.layouts import load_fingertip

__all__ = ["run_list", "run_random", "run_simulate"]

MESHES = (".stl", ".obj", ".ply")


def run_list(as_json: bool) -> None:
    """Print the catalogue of surfaces.

    Parameters
    ----------
    as_json : bool
        Print JSON.
    """
    rows: list[dict[str, Any]] = [
        {
            "surface": name,
            "class": kind.category,
            "dimensions": dict(vars(surface(name))),
            "what": (kind.__doc__ or "").strip().splitlines()[0],
        }
        for name, kind in SURFACES.items()
    ]
    if as_json:
        _print_json(rows)
        return
    table = Table(box=None, pad_edge=False)
    for title in ("surface", "class", "dimensions (m, rad)", "what"):
        table.add_column(title)
    for row in rows:
        sizes = ", ".join(f"{key}={value:.4g}" for key, value in row["dimensions"].items())
        table.add_row(row["surface"], row["class"], sizes, row["what"])
    _console().print(table)


def run_simulate(
    name: str,
    out: Path,
    seed: int,
    radius_m: float | None,
    sizes: Sequence[str],
    fingertip: str | None,
    noise: str,
    as_json: bool,
) -> None:
    """Simulate a scene and write it as MCAP.

    Parameters
    ----------
    name : str
        Name in the catalogue, or a mesh file.
    out : Path
        MCAP file to write.
    seed : int
        Seed of the noise and of the sites on a mesh.
    radius_m : float or None
        Radius of the surface, metres.
    sizes : sequence of str
        Other dimensions, ``name=value``.
    fingertip : str or None
        Layout of the taxels.
    noise : str
        Level of the noise.
    as_json : bool
        Print the truth as JSON.

    Raises
    ------
    UsageError
        If the file would not be an MCAP file, or an option does not fit the surface.
    """
    from evifuse.recordings import write_scene

    if out.suffix.lower() != ".mcap":
        raise UsageError(f"--out {out}: a scene is written as MCAP: name it {out.with_suffix('.mcap').name}")
    tip = None if fingertip is None else load_fingertip(fingertip)
    level, dimensions = _level(noise), _dimensions(radius_m, sizes)
    if Path(name).suffix.lower() in MESHES:
        if dimensions:
            raise UsageError(f"{name}: a mesh has the size it has: leave --radius and --size out")
        mesh = load_mesh(name)
        made = simulate(
            mesh, seed=seed, fingertip=tip, sites=auto_sites(mesh, 2, seed=seed, fingertip=tip), noise=level
        )
    else:
        kind = surface(name, **dimensions) if dimensions else name
        made = simulate(kind, seed=seed, fingertip=tip, noise=level)
    write_scene(out, made.scene)
    if as_json:
        _print_json({"file": str(out), "truth": _truth(made)})
        return
    touch = made.scene.touch
    samples = 0 if touch is None else len(touch.time_ns)
    shown = Path(name).name
    _console().print(f"Wrote {out}: {shown} ({made.truth.category}), {samples} samples, seed {seed}.")
    for site in made.truth.sites:
        k = "" if site.k1_per_m is None else f", k1 {site.k1_per_m:.2f} 1/m, k2 {site.k2_per_m:.2f} 1/m"
        x, y, z = (1000 * site.position_m).tolist()
        _console().print(f"  site ({x:.1f}, {y:.1f}, {z:.1f}) mm: {site.primitive}{k}")
    verb = "fuse" if made.scene.image is not None else "touch"
    _console().print(f"{verb.capitalize()} it: evifuse {verb} {out}")


def run_random(
    count: int,
    seed: int,
    out: Path,
    fingertip: str | None,
    noise: str | None,
    meshes: Sequence[str],
    as_json: bool,
) -> None:
    """Write a labelled data set of random recordings, with a progress bar.

    Parameters
    ----------
    count : int
        How many recordings.
    seed : int
        Seed of the data set.
    out : Path
        Folder.
    fingertip : str or None
        Layout of the taxels.
    noise : str or None
        Level of the noise; any by chance without it.
    meshes : sequence of str
        Mesh files, or folders of them; ``random`` alone for bodies that are drawn as well.
    as_json : bool
        Print a summary as JSON.

    Raises
    ------
    UsageError
        If the count is not positive or the folder holds another data set.
    """
    from rich.progress import Progress

    if count < 1:
        raise UsageError(f"--random {count}: at least one recording is needed")
    if noise is not None:
        _level(noise)
    tip = None if fingertip is None else load_fingertip(fingertip)
    bodies = "random" if tuple(meshes) == ("random",) else [load_mesh(file) for file in _mesh_files(meshes)]
    with Progress(console=Console(stderr=True), disable=not sys.stderr.isatty()) as progress:
        bar = progress.add_task("simulating", total=count)
        written = write_dataset(
            out,
            count,
            seed,
            fingertip=tip,
            fingertip_name=fingertip or "sphere",
            noise=noise,
            meshes=bodies,
            done=lambda _number, _kept: progress.advance(bar),
        )
    if as_json:
        _print_json(
            {"folder": str(out), "recordings": count, "written": written, "truth": str(out / "truth.jsonl")}
        )
        return
    kept = f", {count - written} were there" if written < count else ""
    _console().print(f"Wrote {written} recordings{kept}; the truth about them: {out / 'truth.jsonl'}.")


def _mesh_files(meshes: Sequence[str]) -> list[Path]:
    files: list[Path] = []
    for name in meshes:
        path = Path(name)
        inside = (
            sorted(file for file in path.glob("*") if file.suffix.lower() in MESHES)
            if path.is_dir()
            else [path]
        )
        if not inside:
            raise UsageError(f"{path}: no STL, OBJ or PLY file in this folder")
        files += inside
    return files


def _level(noise: str) -> Any:
    if noise not in NOISES:
        raise UsageError(f"--noise {noise}: use one of {', '.join(NOISES)}")
    return NOISES[noise]


def _dimensions(radius_m: float | None, sizes: Sequence[str]) -> dict[str, float]:
    found = {} if radius_m is None else {"radius_m": radius_m}
    for text in sizes:
        key, _, value = text.partition("=")
        try:
            found[key] = float(value)
        except ValueError:
            raise UsageError(f"--size {text}: write name=value, in metres, such as radius_m=0.02") from None
    return found


def _truth(made: SimulatedScene) -> dict[str, Any]:
    row = truth_row(made)
    return {**row, "decision": row["class"]}


def _print_json(value: Any) -> None:
    sys.stdout.write(json.dumps(value, allow_nan=False, indent=2 if sys.stdout.isatty() else None) + "\n")


def _console() -> Console:
    return Console(soft_wrap=not sys.stdout.isatty(), width=None if sys.stdout.isatty() else 160)
