"""Places of a surface that a fingertip can reach and roll over, found by chance and checked."""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import UsageError
from evifuse.recordings.recording import Fingertip
from evifuse.simulation.fingertip import Skin, grid_fingertip
from evifuse.simulation.kinematics import STEPS, curvature_tensors
from evifuse.simulation.mesh import MeshSurface
from evifuse.simulation.procedure import Finger, Procedure, plan_rolls
from evifuse.simulation.surface import Points, Sites, Surface
from evifuse.simulation.truth import primitive_of
from evifuse.touch.quadrics import unit_rows

__all__ = ["auto_sites"]

TRIES = 2000
"""So many places are looked at before giving up."""
EVEN = 0.35
"""Around a site the curvature tensor changes by no more than this share of its size, or half of the threshold
between flat and curved."""


def auto_sites(
    surface: Surface,
    count: int = 2,
    *,
    seed: int = 0,
    fingertip: Fingertip | None = None,
    primitive: str | None = None,
    procedure: Procedure | None = None,
    within: Callable[[Points], NDArray[np.bool_]] | None = None,
    doubtful: bool = False,
) -> Sites:
    """Choose sites where the finger fits, rolls freely, and the curvature stays about the same.

    Parameters
    ----------
    surface : Surface
        What is to be touched.
    count : int
        Number of sites; two are at least two fingertip radii apart.
    seed : int
        Seed of the choice.
    fingertip : Fingertip, optional
        What is to touch; by default a sphere of 10 mm.
    primitive : str, optional
        Only places of this primitive (see `primitive_of`).
    procedure : Procedure, optional
        How the finger is to roll.
    within : callable, optional
        Says of points (M, 3), metres, which may be sites.
    doubtful : bool
        Also places with a curvature within 0.6 to 1.6 times the threshold between flat and curved, which
        nobody can name for sure.

    Returns
    -------
    tuple of (x, y, z)
        Points of the surface, metres.

    Raises
    ------
    UsageError
        If there are not so many.
    """
    procedure = procedure or Procedure()
    tip = fingertip or grid_fingertip()
    finger = Finger.of(tip, Skin().depth_m(procedure.press_n))
    found: list[Points] = []
    generator = np.random.default_rng(np.random.SeedSequence([seed, 6]))
    for point in _candidates(surface, tip.radius_m, primitive, generator, within, doubtful):
        if any(np.linalg.norm(point - other) < 2 * tip.radius_m for other in found):
            continue
        if _rolls_freely(surface, finger, point, procedure):
            found.append(point)
            if len(found) == count:
                return tuple(tuple(place.tolist()) for place in found)
    kind = f" of kind {primitive}" if primitive else ""
    name = surface.label if isinstance(surface, MeshSurface) else surface.name
    raise UsageError(
        f"only {len(found)} of {count} sites{kind} found on {name} where a fingertip of {tip.radius_m:g} m "
        "can roll: ask for fewer, or take a smaller fingertip"
    )


def _candidates(
    surface: Surface,
    radius_m: float,
    primitive: str | None,
    generator: np.random.Generator,
    within: Callable[[Points], NDArray[np.bool_]] | None,
    doubtful: bool,
) -> Iterator[Points]:
    """Places in a random order that are smooth, and open enough for a sphere."""
    for points in np.array_split(_scattered(surface, generator), 10):
        some = points if within is None or not len(points) else points[within(points)]
        if len(some):
            yield from _good(surface, radius_m, primitive, some, doubtful)


def _good(
    surface: Surface, radius_m: float, primitive: str | None, points: Points, doubtful: bool
) -> Iterator[Points]:
    points, normals = surface.nearest(points)
    fine = np.isfinite(normals).all(axis=1)
    points, normals = points[fine], normals[fine]
    for height, least in ((radius_m, radius_m - 1e-5), (1.5 * radius_m, 1.4 * radius_m)):
        open_ = surface.distance(points + height * normals) > least
        points, normals = points[open_], normals[open_]
    if not len(points):
        return
    tensors = curvature_tensors(surface, points, normals)
    start = np.where(np.abs(normals[:, :1]) < 0.7, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    first = np.cross(normals, start)
    first = unit_rows(first)
    second = np.cross(normals, first)
    size = np.maximum(EVEN * np.linalg.norm(tensors, axis=(1, 2)), 0.5 / (20 * radius_m))
    even = np.ones(len(points), dtype=np.bool_)
    for axis in (first, -first, second, -second):
        beside, turned = surface.nearest(points + 0.35 * radius_m * axis)
        change = np.linalg.norm(curvature_tensors(surface, beside, turned) - tensors, axis=(1, 2))
        even &= change < size
    flat = 1 / (20 * radius_m)
    for point in points[even]:
        k1, k2 = surface.principal_curvatures(point)
        if k1 > 0.75 / radius_m or k2 < -1 / radius_m:
            continue
        # too near to the threshold nobody can say what it is
        clear = doubtful or all(not 0.6 * flat < abs(k) < 1.6 * flat for k in (k1, k2))
        if clear and (primitive is None or primitive_of(k1, k2, radius_m) == primitive):
            yield point


def _scattered(surface: Surface, generator: np.random.Generator) -> Points:
    if isinstance(surface, MeshSurface):
        order = generator.permutation(len(surface.samples_m))[:TRIES]
        return surface.samples_m[order]
    middle = np.mean([site[:2] for site in surface.sites], axis=0)
    places = [
        surface.above(*(middle + beside)) for beside in generator.uniform(-0.03, 0.03, (TRIES // 10, 2))
    ]
    solid = [place for place in places if place is not None]
    return np.array(solid) if solid else np.empty((0, 3))


def _rolls_freely(surface: Surface, finger: Finger, point: Points, procedure: Procedure) -> bool:
    """Whether every roll is as long as it would be on a plane, nearly."""
    try:
        rolls = plan_rolls(surface, finger, (tuple(point.tolist()),), procedure)
    except UsageError:
        return False
    return all(roll.solid and len(roll.arc_m) > 0.9 * (2 * STEPS + 1) for roll in rolls)
