"""Random cases: as many of each curvature primitive, from surfaces, sizes and noises by chance."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from evifuse.errors import UsageError
from evifuse.recordings.recording import Fingertip
from evifuse.simulation.fingertip import grid_fingertip
from evifuse.simulation.mesh import MeshSurface
from evifuse.simulation.noise import NOISES
from evifuse.simulation.procedure import Procedure
from evifuse.simulation.sites import auto_sites
from evifuse.simulation.surface import Sites, Surface
from evifuse.simulation.surfaces import surface

__all__ = ["CASE_PRIMITIVES", "Case", "random_case"]

CASE_PRIMITIVES = ("P", "C-", "C+", "H", "E-", "E+", "N")
"""Primitives of a random data set: every seven recordings hold each once, in a random order."""
_SOURCES = {
    "P": ("plane", "plane", "cylinder", "sphere"),
    "C-": ("cylinder",),
    "C+": ("trough",),
    "H": ("saddle", "torus"),
    "E-": ("sphere", "ellipsoid", "torus"),
    "E+": ("bowl",),
    "N": ("hole", "slot"),
}
_DOMES = ("cylinder", "sphere")
_Site = tuple[float, ...]
_Between = Callable[[float, float], float]


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

    Radii are drawn evenly on a logarithmic scale, from 1.05 (domes) or 1.4 (hollows, saddles) to 10 radii of
    the fingertip, and from 40 to 200 for what counts as flat: the threshold is at 20.

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

    if name == "torus":
        ring, site = _torus(primitive, between)
        return ring, (site,)
    if primitive == "N":
        sizes = {"opening_m": between(2, 8)} if name == "slot" else {}
        kind = surface(name, radius_m=between(1.4, 4), length_m=max(0.5, 20 * a), **sizes)
        return kind, kind.sites
    if name == "plane":
        kind = surface(name)
    elif name == "ellipsoid":
        kind = _ellipsoid(between)
    else:
        low, high = (40, 200) if primitive == "P" else (1.05 if name in _DOMES else 1.4, 10)
        kind = surface(name, radius_m=between(low, high))
    x, y = (generator.uniform(-0.2, 0.2, 2) * a).tolist()
    return kind, ((x, y),)


def _torus(primitive: str, between: _Between) -> tuple[Surface, _Site]:
    tube = between(1.05, 4.0)
    ring = tube + between(2.0, 4.0)
    beside = -0.6 if primitive == "H" else 0.8
    return surface("torus", tube_m=tube, radius_m=ring), (ring + beside * tube, 0.0)


def _ellipsoid(between: _Between) -> Surface:
    """Radii at the top by chance; the height between them."""
    first, second = between(1.05, 9.0), between(1.05, 9.0)
    height = float(np.sqrt(first * second))
    length, width = float(np.sqrt(first * height)), float(np.sqrt(second * height))
    return surface("ellipsoid", length_m=length, width_m=width, height_m=height)
