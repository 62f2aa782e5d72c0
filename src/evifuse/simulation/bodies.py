"""Bodies with the simulated surfaces on them, as the camera sees them: finite, with a clear outline.

Every body is a closed triangle mesh in the world frame. The plane and the trough are blocks, the cylinder
lies, the sphere is a ball, the bowl a round shell, the saddle a bent square sheet, and the hole and the slot
are in a plate that is larger than the picture. What has edges stands on a flat bottom.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.simulation.edges import Corner, Edge, Step
from evifuse.simulation.flat import Hole, Plane, Slot
from evifuse.simulation.oval import Ellipsoid, Torus
from evifuse.simulation.round import Bowl, Cylinder, Sphere, Trough
from evifuse.simulation.saddle import Saddle
from evifuse.simulation.surface import Surface

__all__ = ["Body", "body"]

SHELL_M = 0.003
"""Thickness of the bowl's wall and of the saddle's sheet."""


@dataclass(frozen=True)
class Body:
    """A closed triangle mesh on a table.

    Parameters
    ----------
    vertices_m : ndarray of float64, shape (V, 3)
        World frame, metres.
    faces : ndarray of int64, shape (F, 3)
        Vertices of each triangle, counter-clockwise from outside.
    outline_m : ndarray of float64, shape (P, 3)
        Points of the outline that a camera above sees: the body's edge or, for the hole, its rim.
    table_m : float
        Height of the table, world z, metres.
    """

    vertices_m: NDArray[np.float64]
    faces: NDArray[np.int64]
    outline_m: NDArray[np.float64]
    table_m: float


def body(surface: Surface) -> Body:
    """The body that carries a surface.

    Parameters
    ----------
    surface : Surface
        A surface of the catalogue.

    Returns
    -------
    Body
        Its mesh.
    """
    return _BODIES[type(surface)](surface)


def _grid_faces(rows: int, columns: int, *, ring: bool) -> NDArray[np.int64]:
    """Two triangles per cell of a grid of vertices; with ``ring`` the last row joins the first."""
    row, column = np.meshgrid(np.arange(rows if ring else rows - 1), np.arange(columns - 1), indexing="ij")
    following = (row + 1) % rows
    a, b = row * columns + column, following * columns + column
    return np.stack([a, b, b + 1, a, b + 1, a + 1], axis=-1).reshape(-1, 3)


def _extruded(profile: NDArray[np.float64], length_m: float) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Prism along x over a closed counter-clockwise profile in (y, z), star-shaped from its last point."""
    count = len(profile)
    ends = [np.column_stack([np.full(count, x), profile]) for x in (-length_m / 2, length_m / 2)]
    vertices = np.stack(ends, axis=1).reshape(-1, 3)
    sides = _grid_faces(count, 2, ring=True)
    fan = np.stack([np.full(count - 2, count - 1), np.arange(count - 2), np.arange(1, count - 1)], axis=-1)
    return vertices, np.vstack([sides, 2 * fan[:, ::-1], 2 * fan + 1])


def _turned(profile: NDArray[np.float64], steps: int = 128) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Solid of revolution about z over a profile in (r, z)."""
    angle = np.arange(steps) * 2 * np.pi / steps
    r, z = profile.T
    x, y = np.outer(np.cos(angle), r), np.outer(np.sin(angle), r)
    vertices = np.stack([x, y, np.broadcast_to(z, x.shape)], axis=-1).reshape(-1, 3)
    return vertices, _grid_faces(steps, len(profile), ring=True)


def _circle(radius_m: float, height_m: float) -> NDArray[np.float64]:
    angle = np.arange(128) * 2 * np.pi / 128
    return np.column_stack([radius_m * np.cos(angle), radius_m * np.sin(angle), np.full(128, height_m)])


def _rectangle(length_m: float, width_m: float, height_m: float) -> NDArray[np.float64]:
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) / 2
    return np.column_stack([corners * [length_m, width_m], np.full(4, height_m)])


def _arc(start_rad: float, end_rad: float, radius_m: float, steps: int = 64) -> NDArray[np.float64]:
    angle = np.linspace(start_rad, end_rad, steps)
    return radius_m * np.column_stack([np.sin(angle), np.cos(angle)])


def _block(surface: Plane) -> Body:
    y, z = surface.width_m / 2, surface.height_m
    profile = np.array([[-y, 0.0], [-y, -z], [y, -z], [y, 0.0]])
    outline = _rectangle(surface.length_m, surface.width_m, 0.0)
    return Body(*_extruded(profile, surface.length_m), outline, -z)


def _lying(surface: Cylinder) -> Body:
    radius = surface.radius_m
    profile = _arc(0.0, -2 * np.pi, radius, 257)[:-1] - [0.0, radius]
    outline = _rectangle(surface.length_m, 2 * radius, -radius)
    return Body(*_extruded(profile, surface.length_m), outline, -2 * radius)


def _ball(surface: Sphere) -> Body:
    radius = surface.radius_m
    profile = _arc(np.pi, 0.0, radius) - [0.0, radius]
    return Body(*_turned(profile), _circle(radius, -radius), -2 * radius)


def _shell(surface: Bowl) -> Body:
    inner, outer = surface.radius_m, surface.radius_m + SHELL_M
    rim = np.arcsin(surface.reach)
    profile = np.vstack([_arc(np.pi, np.pi - rim, outer), _arc(np.pi - rim, np.pi, inner)])
    profile += [0.0, inner]
    edge = profile[len(profile) // 2 - 1]
    return Body(*_turned(profile), _circle(float(edge[0]), float(edge[1])), -SHELL_M)


def _groove(surface: Trough) -> Body:
    opening = np.arcsin(surface.reach)
    groove = _arc(np.pi + opening, np.pi - opening, surface.radius_m)
    groove += [0.0, surface.radius_m]
    y, top, bottom = surface.radius_m, groove[0, 1], -2 * SHELL_M
    left = [[-y, top], [-y, bottom]]
    right = [[y, bottom], [y, top]]
    profile = np.vstack([right, groove[::-1], left, [[0.0, bottom]]])
    outline = _rectangle(surface.length_m, 2 * y, top)
    return Body(*_extruded(profile, surface.length_m), outline, bottom)


def _sheet(surface: Saddle) -> Body:
    steps = np.linspace(-surface.length_m / 2, surface.length_m / 2, 61)
    x, y = np.meshgrid(steps, steps, indexing="ij")
    z = (x**2 - y**2) / (2 * surface.radius_m)
    top = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    count = len(steps)
    faces = _grid_faces(count, count, ring=False)
    index = np.arange(count * count).reshape(count, count)
    edge = np.concatenate([index[:-1, 0], index[-1, :-1], index[:0:-1, -1], index[0, :0:-1]])
    following, below = np.roll(edge, -1), count * count
    wall = [[edge, edge + below, following + below], [edge, following + below, following]]
    walls = np.concatenate([np.stack(triangle, axis=-1) for triangle in wall])
    vertices = np.vstack([top, top - [0.0, 0.0, SHELL_M]])
    table = -(surface.length_m**2) / (8 * surface.radius_m) - 2 * SHELL_M
    return Body(vertices, np.vstack([faces, faces[:, ::-1] + below, walls]), top[edge], table)


def _pierced(surface: Hole) -> Body:
    angle = np.arange(128) * 2 * np.pi / 128
    towards = np.column_stack([np.cos(angle), np.sin(angle)])
    square = towards / np.abs(towards).max(axis=1, keepdims=True) * surface.length_m / 2
    half = surface.opening_m / 2 if isinstance(surface, Slot) else 0.0
    ends = np.column_stack([half * np.sign(towards[:, 0].round(9)), np.zeros(128)])
    rim = surface.radius_m * towards + ends
    low = -surface.height_m
    between = towards * min(2.0 * (surface.radius_m + half), 0.45 * surface.length_m)
    rings = [(rim, 0.0), (rim, low), (square, low), (square, 0.0), (between, 0.0), (rim, 0.0)]
    loops = [np.column_stack([ring, np.full(128, z)]) for ring, z in rings]
    vertices = np.stack(loops, axis=1).reshape(-1, 3)
    outline = np.column_stack([rim, np.zeros(128)])
    return Body(vertices, _grid_faces(128, len(rings), ring=True), outline, -0.04)


def _stretched(surface: Ellipsoid) -> Body:
    scale = np.array([surface.length_m, surface.width_m, surface.height_m])
    vertices, faces = _turned(_arc(np.pi, 0.0, 1.0))
    outline = _circle(1.0, 0.0)
    down = [0.0, 0.0, surface.height_m]
    return Body(vertices * scale - down, faces, outline * scale - down, -2 * surface.height_m)


def _ring(surface: Torus) -> Body:
    tube = _arc(0.0, -2 * np.pi, surface.tube_m, 65)
    tube += [surface.radius_m, -surface.tube_m]
    outline = _circle(surface.radius_m + surface.tube_m, -surface.tube_m)
    return Body(*_turned(tube), outline, -2 * surface.tube_m)


def _height_m(surface: Surface, x: float, y: float) -> float:
    point = surface.above(x, y)
    return 0.0 if point is None else float(point[2])


def _standing(surface: Edge | Step | Corner) -> Body:
    """Rings of the height map around the middle, finer where the rounding is, down to a flat bottom."""
    angle = np.arange(128) * 2 * np.pi / 128
    towards = np.column_stack([np.cos(angle), np.sin(angle)])
    if isinstance(surface, Corner):
        rim = towards * surface.width_m
    else:
        half = np.array([surface.length_m, surface.width_m]) / 2
        rim = towards / np.max(np.abs(towards) / half, axis=1, keepdims=True)
    steps = np.concatenate([np.linspace(0.0, 0.06, 16)[:-1], np.linspace(0.06, 1.0, 30)])
    place = rim[:, None] * steps[:, None] * (1 - 1e-12)
    heights = [[_height_m(surface, float(x), float(y)) for x, y in row] for row in place]
    top = np.concatenate([place, np.array(heights)[..., None]], axis=-1)
    low = float(top[..., 2].min()) - 2 * SHELL_M
    foot, middle = top[:, -1:] * [1.0, 1.0, 0.0] + [0.0, 0.0, low], np.zeros((128, 1, 3))
    rows = np.concatenate([top, foot, middle + np.array([0.0, 0.0, low])], axis=1)
    faces = _grid_faces(128, rows.shape[1], ring=True)[:, ::-1]
    return Body(rows.reshape(-1, 3), faces, top[:, -1], low)


_BODIES: dict[type[Surface], Callable[[Any], Body]] = {
    Plane: _block,
    Cylinder: _lying,
    Sphere: _ball,
    Bowl: _shell,
    Trough: _groove,
    Saddle: _sheet,
    Hole: _pierced,
    Slot: _pierced,
    Ellipsoid: _stretched,
    Torus: _ring,
    Edge: _standing,
    Step: _standing,
    Corner: _standing,
}
