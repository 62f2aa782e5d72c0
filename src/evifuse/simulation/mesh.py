"""Any watertight triangle mesh as a smooth surface that a fingertip can roll on.

A mesh is flat between its edges, so its curvature is nowhere what the body's is. Points are spread evenly
over it, a quadric is fitted to the neighbourhood of each, and the quadrics are blended into one smooth
implicit function (multi-level partition of unity, Ohtake et al. 2003). That smooth surface is what is
touched, and its curvature is the truth: on smooth parts it is the body's; an edge is rounded by about
the smoothing length.
"""

from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import MissingExtraError, UsageError
from evifuse.simulation.surface import Points, Sites, Surface, Triple
from evifuse.touch.quadrics import unit_rows

__all__ = ["MeshSurface", "load_mesh"]

SMALLEST_M, LARGEST_M = 0.005, 2.0
MOST_SAMPLES = 200_000
_PROBE_M = 0.25e-3


@dataclass(frozen=True)
class MeshSurface(Surface):
    """A smooth surface over a mesh; `load_mesh` makes one.

    Parameters
    ----------
    label : str
        Name of the mesh.
    vertices_m : ndarray of float64, shape (V, 3)
        Vertices, world frame, metres.
    faces : ndarray of int64, shape (F, 3)
        Vertices of each triangle, counter-clockwise from outside.
    samples_m : ndarray of float64, shape (S, 3)
        Points spread over the mesh, metres.
    frames : ndarray of float64, shape (S, 3, 3)
        Rows: two tangents and the outward normal at each sample.
    heights : ndarray of float64, shape (S, 6)
        Quadric at each sample: 1, u, v, u^2, uv, v^2.
    smoothing_m : float
        Radius of the neighbourhood that a quadric is fitted to, metres.
    grid : tuple
        The samples sorted into cubes, for the inner loops: corner, side and numbers of the cubes; where each
        starts; its samples and their quadrics.
    places : tuple of (x, y, z)
        Default sites, metres.
    last : ndarray of int64, shape (1,)
        The sample that was nearest last: where the next search begins, with the same result from anywhere.
    """

    label: str
    vertices_m: NDArray[np.float64] = field(repr=False)
    faces: NDArray[np.int64] = field(repr=False)
    samples_m: NDArray[np.float64] = field(repr=False)
    frames: NDArray[np.float64] = field(repr=False)
    heights: NDArray[np.float64] = field(repr=False)
    smoothing_m: float
    grid: tuple[Any, ...] = field(repr=False)
    places: Sites = ()
    last: NDArray[np.int64] = field(default_factory=lambda: np.zeros(1, np.int64), repr=False, compare=False)
    name: ClassVar[str] = "mesh"
    category: ClassVar[str] = "curved"
    probe_m: ClassVar[float] = _PROBE_M

    @property
    def around(self) -> tuple[Points, float]:
        """Centre and radius of a ball around the whole body, metres."""
        low, high = self.vertices_m.min(axis=0), self.vertices_m.max(axis=0)
        return (low + high) / 2, float(np.linalg.norm(high - low)) / 2

    @property
    def sites(self) -> Sites:
        """Where to roll by default; see `evifuse.simulation.auto_sites`."""
        return self.places

    def _nearest(self, points: Points) -> tuple[Points, Points]:
        """Of the blended quadrics."""
        from evifuse.simulation._kernels_mesh import nearest_many

        points = np.ascontiguousarray(points, dtype=np.float64)
        return nearest_many(self.grid, self.last, points)

    def nearest_one(self, x: float, y: float, z: float) -> tuple[Triple, Triple]:
        """Nearest point of one point, in plain floats.

        Parameters
        ----------
        x, y, z : float
            A point near the surface, world frame, metres.

        Returns
        -------
        nearest : tuple of float
            The nearest point, metres.
        normal : tuple of float
            The unit normal there.
        """
        from evifuse.simulation._kernels_mesh import nearest_one

        a, b, c, u, v, w = nearest_one(self.grid, self.last, x, y, z)
        return (a, b, c), (u, v, w)

    def distance(self, points: Points) -> NDArray[np.float64]:
        """Signed distance from the surface, negative inside the material: see `Surface`.

        Parameters
        ----------
        points : ndarray of float64, shape (M, 3)
            Points near the surface, metres.

        Returns
        -------
        ndarray of float64, shape (M,)
            Distances, metres, to within a tenth of a micrometre where the skin is pressed in.
        """
        from evifuse.simulation._kernels_mesh import distance_many

        points = np.ascontiguousarray(points, dtype=np.float64)
        return distance_many(self.grid, points)

    def _above(self, x: float, y: float) -> Points | None:
        """Highest triangle on the vertical line, then the smooth surface beside it."""
        corners = self.vertices_m[self.faces]
        sides = np.roll(corners, -1, axis=1)[..., :2] - corners[..., :2]
        beside = np.array([x, y]) - corners[..., :2]
        cross = sides[..., 0] * beside[..., 1] - sides[..., 1] * beside[..., 0]
        hit = np.all(cross >= 0, axis=1) & (cross.sum(axis=1) > 0)  # over an edge, either side
        if not hit.any():
            return None
        share = np.roll(cross[hit], -1, axis=1)
        height = np.sum(share * corners[hit, :, 2], axis=1) / share.sum(axis=1)
        return self._nearest(np.array([[x, y, float(height.max())]]))[0][0]

    def _curvature_tensor(self, point: Points) -> Points:
        """From how the normals turn over half a millimetre."""
        from evifuse.simulation.kinematics import curvature_tensors

        foot, normal = self._nearest(point[None])
        return curvature_tensors(self, foot, normal)[0]


def load_mesh(
    source: str | Path | tuple[NDArray[np.float64], NDArray[np.int64]], *, smoothing_m: float | None = None
) -> MeshSurface:
    """Read a watertight mesh and make it smooth.

    Parameters
    ----------
    source : str, Path, or (vertices (V, 3), faces (F, 3))
        STL, OBJ or PLY file, or the mesh itself; metres.
    smoothing_m : float, optional
        Radius of the neighbourhood that a quadric is fitted to, metres; by default one and a half times the
        usual longest edge of a triangle, but 3 to 8 mm.

    Returns
    -------
    MeshSurface
        The smooth surface.

    Raises
    ------
    UsageError
        If it can't be read, is not watertight, or is no object of 5 mm to 2 m.
    MissingExtraError
        If trimesh or SciPy is not installed.
    """
    try:
        import trimesh

        tree = import_module("scipy.spatial").cKDTree
    except ImportError as error:
        raise MissingExtraError(
            f"meshes need {error.name}, which is not installed: pip install 'evifuse[simulation]'"
        ) from error
    label = "mesh"
    if isinstance(source, tuple):
        mesh = trimesh.Trimesh(*source, process=True)
    else:
        label, mesh = str(source), _read(Path(source), trimesh)
    size = float(np.ptp(mesh.vertices, axis=0).max()) if len(mesh.vertices) else 0.0
    if not SMALLEST_M <= size <= LARGEST_M:
        raise UsageError(
            f"{label}: {size:.3g} m large, and only 5 mm to 2 m can be touched: "
            "coordinates are metres; were they millimetres?"
        )
    if not mesh.is_watertight:
        raise UsageError(f"{label}: the mesh is not watertight: close its holes first")
    if mesh.volume < 0:
        mesh.invert()
    return _smooth(Path(label).stem, mesh, smoothing_m, trimesh, tree)


def _read(path: Path, trimesh: Any) -> Any:
    if not path.is_file():
        raise UsageError(f"{path}: no such mesh file")
    try:
        mesh = trimesh.load(path, force="mesh")
    except Exception as error:
        raise UsageError(
            f"{path}: can't be read as a mesh ({type(error).__name__}): use STL, OBJ or PLY"
        ) from error
    if not len(mesh.faces) or not np.isfinite(mesh.vertices).all():
        raise UsageError(f"{path}: holds no triangles: use STL, OBJ or PLY")
    return mesh


def _smooth(label: str, mesh: Any, smoothing_m: float | None, trimesh: Any, tree: Any) -> MeshSurface:
    corners = mesh.vertices[mesh.faces]
    edge = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    usual = float(np.median(np.repeat(edge, np.maximum(1, (2000 * mesh.area_faces / mesh.area).astype(int)))))
    reach = float(np.clip(1.5 * usual, 0.003, 0.008)) if smoothing_m is None else smoothing_m
    spacing = max(reach / 2.2, float(np.sqrt(mesh.area / (0.4 * MOST_SAMPLES))))
    vertices, faces = trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, spacing, max_iter=30)
    fine = trimesh.Trimesh(vertices, faces, process=True)
    samples, normals = _thinned(np.array(fine.vertices), np.array(fine.vertex_normals), spacing / 2)
    frames, heights = _quadrics(samples, normals, reach, tree)
    return MeshSurface(
        label,
        np.array(mesh.vertices, dtype=np.float64),
        np.array(mesh.faces, dtype=np.int64),
        samples,
        frames,
        heights,
        reach,
        _grid(samples, frames, heights, reach),
    )


def _thinned(points: Points, normals: Points, apart_m: float) -> tuple[Points, Points]:
    """One point for each small cube and side: dense parts of a mesh count no more than others."""
    key = np.hstack([np.floor(points / apart_m), np.rint(normals)]).astype(np.int64)
    _, first = np.unique(key, axis=0, return_index=True)
    first = np.sort(first)
    size = np.linalg.norm(normals[first], axis=1)
    kept = first[size > 0.5]
    return np.ascontiguousarray(points[kept]), np.ascontiguousarray(normals[kept])


def _quadrics(samples: Points, normals: Points, reach_m: float, tree: Any) -> tuple[Points, Points]:
    """Frames and weighted quadrics of the neighbourhoods of all samples, some at a time."""
    near = tree(samples).query(samples, k=min(48, len(samples)))[1]
    frames, heights = np.empty((len(samples), 3, 3)), np.empty((len(samples), 6))
    for start in range(0, len(samples), 1024):
        rows = slice(start, start + 1024)
        beside = (samples[near[rows]] - samples[rows, None]) / reach_m
        facing = normals[near[rows]]
        weight = np.exp(-2 * np.square(beside).sum(axis=2))
        # not the other side of a wall
        weight *= np.clip((facing @ normals[rows, :, None])[..., 0], 0.0, 1.0)
        mean = unit_rows((weight[:, None] @ facing)[:, 0])
        start_axis = np.where(np.abs(mean[:, :1]) < 0.7, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
        first = unit_rows(np.cross(mean, start_axis))
        frames[rows] = np.stack([first, np.cross(mean, first), mean], axis=1)
        u, v, h = (beside @ frames[rows].transpose(0, 2, 1)).transpose(2, 0, 1)
        terms = np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], axis=1)
        weighted = terms * weight[:, None]
        normal = weighted @ terms.transpose(0, 2, 1) + 1e-6 * np.eye(6)
        heights[rows] = np.linalg.solve(normal, weighted @ h[..., None])[..., 0]
    return frames, heights * reach_m / reach_m ** np.array([0, 1, 1, 2, 2, 2])


def _grid(samples: Points, frames: Points, heights: Points, cell: float) -> tuple[Any, ...]:
    """Samples sorted into cubes of the blending radius, and their quadrics in this order."""
    low = samples.min(axis=0) - cell
    shape = np.ceil((samples.max(axis=0) + cell - low) / cell).astype(np.int64)
    place = ((samples - low) / cell).astype(np.int64)
    key = (place[:, 0] * shape[1] + place[:, 1]) * shape[2] + place[:, 2]
    first = np.concatenate([[0], np.cumsum(np.bincount(key, minlength=int(shape.prod())))])
    order = np.argsort(key, kind="stable")
    box = np.array([*low, cell, *shape])
    return box, first.astype(np.int64), samples[order], _in_the_world(frames[order], heights[order])


def _in_the_world(frames: Points, heights: Points) -> Points:
    """What the inner loops need of each sample's quadric: (S, 22).

    Normal, g, the upper half of the symmetric H by rows, and c: a place at d from the sample is
    c + g . d + d . H d / 2 over the quadric, and this grows by g + H d. Then the frame's two tangents, and
    the quadric's u^2, uv, v^2.
    """
    axes, normals = frames[:, :2], frames[:, 2]
    gradient = normals - np.einsum("sa,sai->si", heights[:, 1:3], axes)
    bend = -np.stack([2 * heights[:, 3], heights[:, 4], heights[:, 4], 2 * heights[:, 5]], axis=1)
    hessian = axes.transpose(0, 2, 1) @ bend.reshape(-1, 2, 2) @ axes
    upper = hessian[:, [0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]]
    plane = axes.reshape(-1, 6)
    return np.hstack([normals, gradient, upper, -heights[:, :1], plane, heights[:, 3:]])
