"""A photograph of a body, by casting rays in MuJoCo: no display and no OpenGL.

The shading is Lambert's, with one distant light and some ambient light, without shadows; this is our own.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings import rotation
from evifuse.recordings.recording import Camera
from evifuse.simulation.bodies import Body, body
from evifuse.simulation.physics import load_mujoco
from evifuse.simulation.surface import Surface

__all__ = ["look_at", "photograph"]

WIDTH, HEIGHT = 640, 480
FOCAL_PX = 2800.0
TILT_RAD = np.deg2rad(20)
"""Angle between the camera's view and straight down."""
DISTANCE = 9.0
"""Distance of the camera, over the size of the outline."""
LIGHT = np.array([-0.30, -0.35, 0.89])
AMBIENT = 0.5
BODY_BGR, TABLE_BGR = np.array([165.0, 200.0, 225.0]), np.array([52.0, 50.0, 46.0])
_BODY, _TABLE = 0, 1


def look_at(outline_m: NDArray[np.float64]) -> Camera:
    """A camera that looks down on an outline, obliquely, and has all of it in the picture.

    Parameters
    ----------
    outline_m : ndarray of float64, shape (P, 3)
        Points of the outline, world frame, metres.

    Returns
    -------
    Camera
        World x points right in its picture, world y up.
    """
    low, high = outline_m.min(axis=0), outline_m.max(axis=0)
    centre = (low + high) / 2
    distance = DISTANCE * float(np.max(high[:2] - low[:2]))
    back = np.array([0.0, -np.sin(TILT_RAD), np.cos(TILT_RAD)])
    right = np.array([1.0, 0.0, 0.0])
    axes = np.stack([right, np.cross(-back, right), -back], axis=-1)
    middle = (WIDTH - 1) / 2, (HEIGHT - 1) / 2
    matrix = np.array([[FOCAL_PX, 0.0, middle[0]], [0.0, FOCAL_PX, middle[1]], [0.0, 0.0, 1.0]])
    return Camera(WIDTH, HEIGHT, matrix, centre + distance * back, rotation.to_quaternion(axes))


def photograph(
    surface: Surface, grey_noise: float, generator: np.random.Generator
) -> tuple[NDArray[np.uint8], Camera]:
    """Photograph the body that carries a surface.

    Parameters
    ----------
    surface : Surface
        The surface.
    grey_noise : float
        Standard deviation of the noise on every pixel and colour, grey levels of 255.
    generator : numpy.random.Generator
        Where the noise comes from.

    Returns
    -------
    image : ndarray of uint8, shape (480, 640, 3)
        BGR picture, edges smoothed.
    camera : Camera
        Where it was taken from. Pixel ``(u, v)`` is the ray ``matrix^-1 [u, v, 1]``.
    """
    shape = body(surface)
    camera = look_at(shape.outline_m)
    world = _world(shape)
    v, u = np.mgrid[:HEIGHT, :WIDTH].reshape(2, -1).astype(np.float64)
    picture = _shade(world, surface, camera, u, v).reshape(HEIGHT, WIDTH, 3)
    edges = np.flatnonzero(_contrast(picture) > 8.0)
    fine = np.zeros((len(edges), 3))
    offsets = (np.arange(4) - 1.5) / 4
    for du in offsets:
        for dv in offsets:
            fine += _shade(world, surface, camera, u[edges] + du, v[edges] + dv)
    picture.reshape(-1, 3)[edges] = fine / len(offsets) ** 2
    picture += generator.normal(0.0, grey_noise, picture.shape)
    return np.clip(np.rint(picture), 0, 255).astype(np.uint8), camera


def _world(shape: Body) -> tuple[Any, Any]:
    """A MuJoCo model of the body on a table, and its data."""
    mujoco = load_mujoco()
    spec = mujoco.MjSpec()
    mesh = spec.add_mesh(name="body")
    mesh.uservert = shape.vertices_m.ravel()
    mesh.userface = shape.faces.ravel()
    mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="body")
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0.0, 0.0, 1.0], pos=[0.0, 0.0, shape.table_m]
    )
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def _shade(
    world: tuple[Any, Any],
    surface: Surface,
    camera: Camera,
    u: NDArray[np.float64],
    v: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Colours seen through image points, shape (M, 3)."""
    mujoco = load_mujoco()
    pixels = np.stack([u, v, np.ones_like(u)], axis=-1)
    rays = rotation.rotate(camera.orientation_xyzw, pixels @ np.linalg.inv(camera.matrix).T)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    count = len(rays)
    geometry, distance = np.empty(count, dtype=np.int32), np.empty(count)
    normals = np.empty(3 * count)
    mujoco.mj_multiRay(
        *world, camera.position_m, rays.ravel(), None, True, -1, geometry, distance, normals, count, 1e3
    )
    normals = normals.reshape(count, 3)
    points = camera.position_m + distance[:, None] * rays
    near = np.flatnonzero(geometry == _BODY)
    smooth = surface.nearest(points[near])
    on_surface = np.linalg.norm(points[near] - smooth[0], axis=1) < 2e-4
    normals[near[on_surface]] = smooth[1][on_surface]
    light = AMBIENT + (1 - AMBIENT) * np.maximum(0.0, normals @ (LIGHT / np.linalg.norm(LIGHT)))
    colour = np.where((geometry == _BODY)[:, None], BODY_BGR, TABLE_BGR)
    return colour * light[:, None]


def _contrast(picture: NDArray[np.float64]) -> NDArray[np.float64]:
    """Largest grey difference of every pixel to its four neighbours."""
    grey = np.pad(picture.mean(axis=2), 1, mode="edge")
    middle = grey[1:-1, 1:-1]
    around = (grey[:-2, 1:-1], grey[2:, 1:-1], grey[1:-1, :-2], grey[1:-1, 2:])
    return np.max([np.abs(middle - other) for other in around], axis=0)
