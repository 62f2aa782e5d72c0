"""Random recordings with labels: as many of each curvature primitive, from surfaces, sizes and noises by chance.

Every recording depends on the seed and its own number only, so a data set can be continued, and the same seed
gives the same bytes.
"""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from evifuse.errors import UsageError
from evifuse.recordings import write_scene
from evifuse.recordings.atomic import replacing
from evifuse.recordings.recording import Fingertip, Scene
from evifuse.simulation.fingertip import grid_fingertip
from evifuse.simulation.mesh import MeshSurface
from evifuse.simulation.noise import NOISES, Noise
from evifuse.simulation.procedure import Procedure
from evifuse.simulation.simulate import SimulatedScene, simulate
from evifuse.simulation.sites import auto_sites
from evifuse.simulation.surface import Sites, Surface
from evifuse.simulation.surfaces import surface

__all__ = ["CASE_PRIMITIVES", "Case", "random_case", "random_scenes", "truth_row", "write_dataset"]

CASE_PRIMITIVES = ("P", "C-", "C+", "H", "E-", "E+", "N")
"""Primitives of a random data set: every seven recordings hold each once, in a random order."""
_SOURCES = {
    "P": ("plane",),
    "C-": ("cylinder",),
    "C+": ("trough",),
    "H": ("saddle", "torus"),
    "E-": ("sphere", "ellipsoid", "torus"),
    "E+": ("bowl",),
    "N": ("hole", "slot"),
}
TRUTH = "truth.jsonl"


@dataclass(frozen=True)
class Case:
    """One random recording before it is simulated.

    Parameters
    ----------
    number : int
        Number in the data set.
    primitive : str
        Its primitive.
    surface : Surface
        What is touched.
    sites : tuple of (x, y) or (x, y, z)
        Where, metres.
    procedure : Procedure
        How.
    noise : str
        Name of its noise in `NOISES`.
    seed : int
        Seed of its noise.
    """

    number: int
    primitive: str
    surface: Surface
    sites: Sites
    procedure: Procedure
    noise: str
    seed: int


def random_case(
    seed: int,
    number: int,
    *,
    fingertip: Fingertip | None = None,
    noise: str | None = None,
    meshes: Sequence[MeshSurface] = (),
) -> Case:
    """Draw one recording of a data set.

    Radii are drawn evenly on a logarithmic scale, from 0.8 (domes) or 1.4 (hollows, saddles) to 10 radii of the
    fingertip, where the threshold between flat and curved is at 20.

    Parameters
    ----------
    seed : int
        Seed of the data set.
    number : int
        Number of the recording in it.
    fingertip : Fingertip, optional
        What touches; by default a sphere of 10 mm with a grid of taxels.
    noise : str, optional
        Name in `NOISES`; any of them by chance without it.
    meshes : sequence of MeshSurface
        Where given, every recording with contact is on one of these meshes if one has a fitting place.

    Returns
    -------
    Case
        What is to be simulated.
    """
    tip = fingertip or grid_fingertip()
    seven, place = divmod(number, len(CASE_PRIMITIVES))
    order = np.random.default_rng(np.random.SeedSequence([seed, seven, 0])).permutation(len(CASE_PRIMITIVES))
    primitive = CASE_PRIMITIVES[int(order[place])]
    generator = np.random.default_rng(np.random.SeedSequence([seed, number, 1]))
    turn = float(generator.uniform(0, np.pi))
    procedure = Procedure(directions_rad=tuple(turn + np.arange(4) * np.pi / 4))
    level = list(NOISES)[int(generator.integers(len(NOISES)))] if noise is None else noise
    own_seed = int(generator.integers(2**31))
    chosen = _on_mesh(meshes, primitive, tip, procedure, generator)
    kind, sites = chosen if chosen is not None else _on_catalogue(primitive, tip.radius_m, generator)
    return Case(number, primitive, kind, sites, procedure, level, own_seed)


def _on_mesh(
    meshes: Sequence[MeshSurface],
    primitive: str,
    tip: Fingertip,
    procedure: Procedure,
    generator: np.random.Generator,
) -> tuple[Surface, Sites] | None:
    if primitive == "N":
        return None
    for i in generator.permutation(len(meshes)):
        mesh, seed = meshes[int(i)], int(generator.integers(2**31))
        try:
            sites = auto_sites(mesh, 1, seed=seed, fingertip=tip, primitive=primitive, procedure=procedure)
        except UsageError:
            continue
        return mesh, sites
    return None


def _on_catalogue(primitive: str, a: float, generator: np.random.Generator) -> tuple[Surface, Sites]:
    names = _SOURCES[primitive]
    name = names[int(generator.integers(len(names)))]

    def between(low: float, high: float) -> float:
        return a * float(np.exp(generator.uniform(np.log(low), np.log(high))))

    x, y = (generator.uniform(-0.2, 0.2, 2) * a).tolist()
    kind, site = _MAKERS[name](primitive, a, between, x, y)
    return kind, (kind.sites if primitive == "N" else (site,))


def _torus(
    primitive: str, a: float, between: Callable[[float, float], float]
) -> tuple[Surface, tuple[float, ...]]:
    tube = between(1.0, 4.0)
    kind = surface("torus", tube_m=tube, radius_m=tube + between(2.5, 6.0))
    side = -0.6 if primitive == "H" else 0.6
    return kind, (kind.__dict__["radius_m"] + side * tube, 0.0)


_Maker = Callable[
    [str, float, Callable[[float, float], float], float, float], tuple[Surface, tuple[float, ...]]
]
_MAKERS: dict[str, _Maker] = {
    "plane": lambda _p, _a, _b, x, y: (surface("plane"), (x, y)),
    "cylinder": lambda _p, _a, b, x, y: (surface("cylinder", radius_m=b(0.8, 10)), (x, y)),
    "trough": lambda _p, _a, b, x, y: (surface("trough", radius_m=b(1.4, 10)), (x, y)),
    "saddle": lambda _p, _a, b, x, y: (surface("saddle", radius_m=b(1.4, 10)), (x, y)),
    "sphere": lambda _p, _a, b, x, y: (surface("sphere", radius_m=b(0.8, 10)), (x, y)),
    "bowl": lambda _p, _a, b, x, y: (surface("bowl", radius_m=b(1.4, 10)), (x, y)),
    "torus": lambda p, a, b, _x, _y: _torus(p, a, b),
    "ellipsoid": lambda _p, _a, b, x, y: (_ellipsoid(b), (x, y)),
    "hole": lambda _p, a, b, _x, _y: (
        surface("hole", radius_m=b(1.4, 4), length_m=max(0.5, 20 * a)),
        (0.0, 0.0),
    ),
    "slot": lambda _p, a, b, _x, _y: (
        surface("slot", radius_m=b(1.4, 4), length_m=max(0.5, 20 * a), opening_m=b(2, 8)),
        (0.0, 0.0),
    ),
}


def _ellipsoid(between: Callable[[float, float], float]) -> Surface:
    """Radii at the top by chance; the height between them."""
    first, second = between(1.0, 9.0), between(1.0, 9.0)
    height = float(np.sqrt(first * second))
    return surface(
        "ellipsoid",
        length_m=float(np.sqrt(first * height)),
        width_m=float(np.sqrt(second * height)),
        height_m=height,
    )


def random_scenes(
    count: int,
    seed: int,
    *,
    fingertip: Fingertip | None = None,
    noise: str | Noise | None = None,
    meshes: Sequence[MeshSurface] = (),
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
    meshes : sequence of MeshSurface
        Bodies to touch instead of the catalogue's surfaces.
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
        case = random_case(seed, number, fingertip=fingertip, noise=level, meshes=meshes)
        own = noise if isinstance(noise, Noise) else NOISES[case.noise]
        yield case, simulated(case, fingertip, own, rate_hz)


def simulated(case: Case, fingertip: Fingertip | None, noise: Noise, rate_hz: float) -> SimulatedScene:
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
    meshes: Sequence[MeshSurface] = (),
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
    meshes : sequence of MeshSurface
        Bodies to touch instead of the catalogue's surfaces.
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
    names = [mesh.label for mesh in meshes]
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
            case = random_case(seed, number, fingertip=fingertip, noise=noise, meshes=meshes)
            made = simulated(case, fingertip, NOISES[case.noise], rate_hz)
            write_scene(file, replace_name(made.scene, file.name))
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


def replace_name(scene: Scene, name: str) -> Scene:
    """The scene under another name.

    Parameters
    ----------
    scene : Scene
        A scene.
    name : str
        Its name in messages.

    Returns
    -------
    Scene
        The same values.
    """
    return replace(scene, name=name)


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
