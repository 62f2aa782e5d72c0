"""Labelled data sets of random recordings, with and without files.

Every recording depends on the seed and its own number only, so a data set can be continued, and the same seed
gives the same bytes.
"""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from evifuse.errors import UsageError
from evifuse.recordings import write_scene
from evifuse.recordings.atomic import replacing
from evifuse.recordings.recording import Fingertip
from evifuse.simulation.cases import Case, random_case
from evifuse.simulation.mesh import MeshSurface
from evifuse.simulation.noise import NOISES, Noise
from evifuse.simulation.random_cases import random_body_case
from evifuse.simulation.simulate import SimulatedScene, simulate

__all__ = ["random_scenes", "simulated_case", "truth_row", "write_dataset"]

TRUTH = "truth.jsonl"

Bodies = Sequence[MeshSurface] | Literal["random"]
"""Bodies to touch instead of the catalogue's surfaces; ``"random"`` draws them (`random_body_case`)."""


def random_scenes(
    count: int,
    seed: int,
    *,
    fingertip: Fingertip | None = None,
    noise: str | Noise | None = None,
    meshes: Bodies = (),
    rate_hz: float = 1000.0,
) -> Iterator[tuple[Case, SimulatedScene]]:
    """The recordings of a data set, one after the other, without files.

    Parameters
    ----------
    count : int
        How many.
    seed : int
        Seed of the data set.
    fingertip : Fingertip, optional
        What touches.
    noise : str or Noise, optional
        Level of the noise; any of `NOISES` by chance without it.
    meshes : sequence of MeshSurface, or "random"
        Bodies to touch instead of the catalogue's surfaces; with ``"random"`` they are drawn as well.
    rate_hz : float
        Samples per second.

    Yields
    ------
    case : Case
        What was drawn.
    scene : SimulatedScene
        The recording and the truth.
    """
    level = noise if isinstance(noise, str) or noise is None else "none"
    for number in range(count):
        case = _drawn(seed, number, fingertip, level, meshes)
        own = noise if isinstance(noise, Noise) else NOISES[case.noise]
        yield case, simulated_case(case, fingertip, own, rate_hz)


def _drawn(seed: int, number: int, fingertip: Fingertip | None, noise: str | None, meshes: Bodies) -> Case:
    if meshes == "random":
        return random_body_case(seed, number, fingertip=fingertip, noise=noise)
    return random_case(seed, number, fingertip=fingertip, noise=noise, meshes=meshes)


def simulated_case(case: Case, fingertip: Fingertip | None, noise: Noise, rate_hz: float) -> SimulatedScene:
    """Simulate one case, without a picture.

    Parameters
    ----------
    case : Case
        What was drawn.
    fingertip : Fingertip or None
        What touches.
    noise : Noise
        How much noise.
    rate_hz : float
        Samples per second.

    Returns
    -------
    SimulatedScene
        The recording and the truth.
    """
    return simulate(
        case.surface,
        seed=case.seed,
        sites=case.sites,
        procedure=case.procedure,
        noise=noise,
        fingertip=fingertip,
        picture=False,
        rate_hz=rate_hz,
    )


def truth_row(made: SimulatedScene) -> dict[str, Any]:
    """The truth about a recording as plain values.

    Parameters
    ----------
    made : SimulatedScene
        A simulated recording.

    Returns
    -------
    dict
        ``surface``, ``dimensions`` (metres, radians), ``class`` and ``sites``: each with ``position_m``,
        ``k1_per_m``, ``k2_per_m``, ``direction_rad``, ``contact`` and ``primitive``.
    """
    kind = made.truth.surface
    mesh = isinstance(kind, MeshSurface)
    sizes = {"smoothing_m": kind.smoothing_m} if mesh else dict(vars(kind))
    sites = [
        {key: value.tolist() if isinstance(value, np.ndarray) else value for key, value in vars(site).items()}
        for site in made.truth.sites
    ]
    name = kind.label if mesh else kind.name
    return {"surface": name, "dimensions": sizes, "class": made.truth.category, "sites": sites}


def write_dataset(
    folder: Path,
    count: int,
    seed: int,
    *,
    fingertip: Fingertip | None = None,
    fingertip_name: str = "sphere",
    noise: str | None = None,
    meshes: Bodies = (),
    rate_hz: float = 1000.0,
    done: Callable[[int, bool], None] = lambda number, kept: None,
) -> int:
    """Write recordings as MCAP and the truth about them as JSON lines; go on where an earlier run stopped.

    Parameters
    ----------
    folder : Path
        Where: ``00000.mcap`` and so on, and ``truth.jsonl``.
    count, seed : int
        How many, and the seed of the data set.
    fingertip : Fingertip, optional
        What touches.
    fingertip_name : str
        How it is called in the truth.
    noise : str, optional
        Name in `NOISES`.
    meshes : sequence of MeshSurface, or "random"
        Bodies to touch instead of the catalogue's surfaces; with ``"random"`` they are drawn as well.
    rate_hz : float
        Samples per second.
    done : callable
        Called after each recording with its number and whether it was there already.

    Returns
    -------
    int
        How many recordings were written now.

    Raises
    ------
    UsageError
        If the folder holds another data set.
    """
    folder.mkdir(parents=True, exist_ok=True)
    names = meshes if meshes == "random" else [mesh.label for mesh in meshes]
    settings = {
        "seed": seed,
        "fingertip": fingertip_name,
        "noise": noise,
        "meshes": names,
        "rate_hz": rate_hz,
    }
    rows = _earlier(folder / TRUTH, settings)
    written = 0
    for number in range(count):
        file = folder / f"{number:05d}.mcap"
        kept = file.name in rows and _whole(file)
        if not kept:
            case = _drawn(seed, number, fingertip, noise, meshes)
            made = simulated_case(case, fingertip, NOISES[case.noise], rate_hz)
            write_scene(file, replace(made.scene, name=file.name))
            rows[file.name] = {
                "file": file.name,
                "primitive": case.primitive,
                **truth_row(made),
                "noise": case.noise,
                "noise_levels": vars(NOISES[case.noise]),
                "directions_rad": list(made.truth.directions_rad),
                "fingertip": fingertip_name,
                "settings": settings,
            }
            written += 1
            with (folder / TRUTH).open("a", encoding="utf-8") as lines:
                lines.write(json.dumps(rows[file.name], allow_nan=False) + "\n")
        done(number, kept)
    with replacing(folder / TRUTH) as path:
        text = "".join(json.dumps(rows[name], allow_nan=False) + "\n" for name in sorted(rows))
        path.write_text(text, encoding="utf-8")
    return written


def _earlier(file: Path, settings: dict[str, Any]) -> dict[str, Any]:
    """Rows of an earlier run; the last one may be cut."""
    rows: dict[str, Any] = {}
    if not file.is_file():
        return rows
    for line in file.read_text(encoding="utf-8").splitlines():
        try:
            row = json.loads(line)
        except ValueError:
            continue
        if not isinstance(row, dict) or row.get("settings") != settings:
            raise UsageError(f"{file}: is of another data set: choose an empty folder, or the same options")
        rows[row["file"]] = row
    return rows


def _whole(file: Path) -> bool:
    """Whether a file has both ends of an MCAP file."""
    magic = b"\x89MCAP0\r\n"
    if not file.is_file() or file.stat().st_size < 16:
        return False
    with file.open("rb") as data:
        head = data.read(8)
        data.seek(-8, 2)
        return head == magic and data.read(8) == magic
