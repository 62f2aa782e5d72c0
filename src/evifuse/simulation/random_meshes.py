"""Random watertight bodies that have all which touch can tell apart: plates and balls with a relief.

A relief is a sum of smooth features at random places: bumps, dents, ridges, troughs, saddles, gentle swells,
and between them what is left flat. A plate has one on either side, and an opening that goes through it. All
lengths go with the radius of the fingertip that is to touch. What is touched, and what counts as the truth,
is the smooth surface that `load_mesh` makes of the triangles; the curvature of the relief itself is known as
well, and agrees within a few percent (`RandomBody.principal_of_relief`).
"""

from dataclasses import dataclass, fields, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from evifuse.simulation.mesh import MeshSurface, load_mesh
from evifuse.simulation.reliefs import Relief, random_relief
from evifuse.simulation.surface import Points, Sites

__all__ = ["RandomBody", "random_body"]

Array = NDArray[np.float64]
Triangles = NDArray[np.int64]

PLATE, THICK, CELL = 13.5, 5.5, 4.5
"""Side and thickness of a plate, and side of the square that one feature has, fingertip radii."""
SPACING, SMOOTHING = 0.115, 0.42
"""Distance between vertices, and what quadrics are fitted over, fingertip radii."""
BESIDE = 1.2
"""Sites are so far from the sides of a plate, fingertip radii."""
_STEP = 0.02
"""Step of the differences that the curvature of a relief is taken from, fingertip radii."""


@dataclass(frozen=True)
class RandomBody:
    """A random body: its mesh, what it was made from, and its opening.

    Parameters
    ----------
    surface : MeshSurface
        What is touched.
    reliefs : tuple of Relief
        Of a ball; or of the upper and the lower side of a plate.
    size_m : float
        Radius of the ball, or thickness of the plate, metres.
    radius_m : float
        Radius of the fingertip that it is made for, metres.
    opening_m : ndarray of float64, shape (4,), or None
        Middle (x, y) of a plate's opening, and its half axes along x and y, metres; None for a ball.
    """

    surface: MeshSurface
    reliefs: tuple[Relief, ...]
    size_m: float
    radius_m: float
    opening_m: Array | None

    def principal_of_relief(self, points: Points) -> tuple[Array, Array]:
        """Principal curvatures of the relief that the mesh stands for.

        Parameters
        ----------
        points : ndarray of float64, shape (M, 3)
            Points of the body away from the sides of a plate, metres.

        Returns
        -------
        k1, k2 : ndarray of float64, shape (M,)
            ``k1 >= k2``, 1/m, concave up positive, by central differences of the implicit function.
        """
        step = _STEP * self.radius_m * np.eye(3)
        upper = points[:, 2] > -self.size_m / 2  # a point stays on its side of the plate
        value = self._level(points, upper)
        ahead, back = ([self._level(points + s * e, upper) for e in step] for s in (1, -1))
        gradient = np.stack([(p - m) / (2 * step[0, 0]) for p, m in zip(ahead, back, strict=True)], axis=1)
        bent = np.empty((len(points), 3, 3))
        for i in range(3):
            bent[:, i, i] = (ahead[i] - 2 * value + back[i]) / step[0, 0] ** 2
            for j in range(i):
                mixed = sum(
                    s * t * self._level(points + s * step[i] + t * step[j], upper)
                    for s in (1, -1)
                    for t in (1, -1)
                )
                bent[:, i, j] = bent[:, j, i] = mixed / (4 * step[0, 0] ** 2)
        size = np.linalg.norm(gradient, axis=1)
        flat = np.linalg.svd((gradient / size[:, None])[:, None])[2][:, 1:]
        k = -np.linalg.eigvalsh(flat @ bent @ flat.transpose(0, 2, 1)) / size[:, None]
        return k[:, 0], k[:, 1]

    def _level(self, points: Points, upper: NDArray[np.bool_]) -> Array:
        """Implicit function, positive outside, 0 on the body."""
        if self.opening_m is None:
            distance = np.linalg.norm(points, axis=1)
            return distance - self.size_m - self.reliefs[0].height_m(self.size_m * points / distance[:, None])
        over, under = (
            relief.height_m(points * [1.0, 1.0, 0.0]) * _collar(self.opening_m, points)
            for relief in self.reliefs
        )
        return np.where(upper, points[:, 2] - over, -(points[:, 2] + self.size_m) - under)

    def on_relief(self, points: Points) -> NDArray[np.bool_]:
        """Which points are on the relief: not on the sides of a plate, nor in its opening.

        Parameters
        ----------
        points : ndarray of float64, shape (M, 3)
            Points of the body, metres.

        Returns
        -------
        ndarray of bool, shape (M,)
            All of a ball.
        """
        if self.opening_m is None:
            return np.ones(len(points), dtype=np.bool_)
        inner = np.abs(points[:, :2]).max(axis=1) < (PLATE / 2 - BESIDE) * self.radius_m
        return inner & (_level(self.opening_m, points) > 1 + BESIDE / 3)

    def pierced(self) -> MeshSurface:
        """The plate as something that may be missed: a site in its opening is one without contact.

        Returns
        -------
        MeshSurface
            The same surface, of the category ``"occluded"``.
        """
        return _PiercedMesh(**{item.name: getattr(self.surface, item.name) for item in fields(MeshSurface)})

    @property
    def opening(self) -> Sites:
        """The middle of the opening, ``(x, y)`` in metres; empty without one."""
        return () if self.opening_m is None else ((float(self.opening_m[0]), float(self.opening_m[1])),)


@dataclass(frozen=True)
class _PiercedMesh(MeshSurface):
    """A mesh with an opening, where a finger meets nothing."""

    category: ClassVar[str] = "occluded"


def random_body(seed: int, number: int = 0, *, radius_m: float = 0.01, kind: str | None = None) -> RandomBody:
    """Draw a body.

    Parameters
    ----------
    seed, number : int
        Seed, and number of the body.
    radius_m : float
        Radius of the fingertip that is to touch it, metres.
    kind : {"plate", "ball"}, optional
        A plate (two times in three) or a ball by chance without it.

    Returns
    -------
    RandomBody
        The body, its curvatures and its opening; the upper side of a plate is at z = 0, a ball is around the
        origin.
    """
    generator = np.random.default_rng(np.random.SeedSequence([seed, number, 7]))
    drawn = "plate" if generator.uniform() < 2 / 3 else "ball"
    return (_plate if (kind or drawn) == "plate" else _ball)(generator, radius_m, f"{seed}-{number}")


def _plate(generator: np.random.Generator, a: float, name: str) -> RandomBody:
    reliefs = tuple(_flat_relief(generator, a) for _ in range(2))
    half = generator.uniform(1.4, 3.0, 2) * a
    opening = np.concatenate([generator.uniform(-4.0, 4.0, 2) * a, half])
    count = round(PLATE / SPACING)
    steps = np.linspace(-PLATE / 2, PLATE / 2, count + 1) * a
    x, y = (axis.ravel() for axis in np.meshgrid(steps, steps, indexing="ij"))
    corner = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).ravel()
    quads = np.stack([corner, corner + count + 1, corner + count + 2, corner + 1], axis=1)
    level = _level(opening, np.stack([x, y], axis=1))
    quads = quads[(level[quads] >= 1.0).all(axis=1)]
    rim = np.zeros(len(x), dtype=np.bool_)
    rim[_border(quads)[:, 0]] = True
    rim &= level < 1 + 4 * SPACING / min(half / a)  # the vertices around the opening go to its rim
    x, y = (np.where(rim, m + (v - m) / level, v) for v, m in zip((x, y), opening[:2], strict=True))
    ground = np.stack([x, y, np.zeros_like(x)], axis=1)
    over, under = (relief.height_m(ground) * _collar(opening, ground) for relief in reliefs)
    top, bottom = ground + over[:, None] * [0, 0, 1], ground - (THICK * a + under)[:, None] * [0, 0, 1]
    points, walls = _walls(top, bottom, _border(quads))
    every = np.concatenate([quads, quads[:, ::-1] + len(top), walls])
    surface = _smooth(points, every, a, f"plate {name}")
    return RandomBody(surface, reliefs, THICK * a, a, opening)


def _walls(top: Points, bottom: Points, border: Triangles) -> tuple[Points, Triangles]:
    """All vertices of a plate, and the quads of its sides: as high as those above are wide, about."""
    layers = round(THICK / SPACING / 1.4)
    share = np.arange(1, layers)[:, None, None] / layers
    rim, place = np.unique(border, return_inverse=True)
    between = (top[rim] + share * (bottom[rim] - top[rim])).reshape(-1, 3)
    rows = 2 * len(top) + np.arange((layers - 1) * len(rim)).reshape(-1, len(rim))
    level = np.concatenate([rim[None], rows, rim[None] + len(top)])
    start, stop = level[:, place.reshape(-1, 2).T].transpose(1, 0, 2)
    quads = np.stack([stop[:-1], start[:-1], start[1:], stop[1:]], axis=-1).reshape(-1, 4)
    return np.concatenate([top, bottom, between]), quads


def _ball(generator: np.random.Generator, a: float, name: str) -> RandomBody:
    radius = float(generator.uniform(4.5, 8.0)) * a
    count = max(3, round(4 * np.pi * radius**2 / (CELL * a) ** 2))
    place = generator.normal(size=(count, 3))
    place /= np.linalg.norm(place, axis=1, keepdims=True)
    start = np.where(np.abs(place[:, :1]) < 0.7, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    first = np.cross(place, start)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    axes = np.stack([first, np.cross(place, first)], axis=1)
    relief = random_relief(generator, radius * place, axes, a, radius)
    steps = round(np.pi / 2 * radius / (SPACING * a))
    turn = np.tan(np.linspace(-np.pi / 4, np.pi / 4, steps + 1))
    u, v = (axis.ravel() for axis in np.meshgrid(turn, turn, indexing="ij"))
    corner = (np.arange(steps)[:, None] * (steps + 1) + np.arange(steps)).ravel()
    quads = np.stack([corner, corner + steps + 1, corner + steps + 2, corner + 1], axis=1)
    side = np.stack([u, v, np.ones_like(u)], axis=1)  # one face of a cube, and its turns
    sides = [np.roll(side * [1, 1, sign], axis, axis=1) for axis in range(3) for sign in (1, -1)]
    faces = [
        (quads if sign > 0 else quads[:, ::-1]) + (2 * axis + (sign < 0)) * len(u)
        for axis in range(3)
        for sign in (1, -1)
    ]
    points = np.concatenate(sides)
    points *= radius / np.linalg.norm(points, axis=1, keepdims=True)
    points *= 1 + relief.height_m(points)[:, None] / radius
    surface = _smooth(points, np.concatenate(faces), a, f"ball {name}")
    return RandomBody(surface, (relief,), radius, a, None)


def _smooth(points: Points, quads: Triangles, a: float, label: str) -> MeshSurface:
    halves = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return replace(load_mesh((points, halves), smoothing_m=SMOOTHING * a), label=label)


def _flat_relief(generator: np.random.Generator, a: float) -> Relief:
    count = round(PLATE / CELL)
    steps = (np.arange(count) - (count - 1) / 2) * CELL * a
    place = np.stack([axis.ravel() for axis in np.meshgrid(steps, steps)], axis=1)
    place = place + generator.uniform(-0.3, 0.3, place.shape) * CELL * a
    place = np.concatenate([place, np.zeros((len(place), 1))], axis=1)
    axes = np.broadcast_to(np.eye(3)[:2], (len(place), 2, 3))
    return random_relief(generator, place, axes, a)


def _collar(opening: Array, points: Points) -> Array:
    """How much of the relief is left near the opening: nothing at its rim, which is flat."""
    return 1 - np.exp(-(np.maximum(_level(opening, points) - 1, 0.0) ** 4) / 0.2)


def _level(opening: Array, points: Points) -> Array:
    """Distance from the middle of the opening over that of its rim in the same direction."""
    return np.hypot(*((points[:, :2] - opening[:2]) / opening[2:]).T)


def _border(quads: Triangles) -> Triangles:
    """Directed edges (E, 2) that belong to one quad only."""
    edges = np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2)
    _, index, count = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    return edges[index[count == 1]]
