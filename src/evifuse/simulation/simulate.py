"""Simulate one scene: a surface of the catalogue is touched, and photographed, and the truth is known."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import UsageError
from evifuse.recordings import rotation
from evifuse.recordings.recording import Scene, TouchRecording
from evifuse.simulation.camera import photograph
from evifuse.simulation.fingertip import Skin, grid_fingertip, pressures
from evifuse.simulation.procedure import Procedure
from evifuse.simulation.rolling import Motion, roll_finger
from evifuse.simulation.surface import Surface
from evifuse.simulation.surfaces import surface

__all__ = ["Noise", "SimulatedScene", "SiteTruth", "Truth", "simulate"]

START_NS = 1_700_000_000_000_000_000
"""Time of the first sample of every simulated recording, UTC nanoseconds since 1970."""


@dataclass(frozen=True)
class Noise:
    """Standard deviations of independent Gaussian noise on what is recorded.

    Parameters
    ----------
    pressure_pa : float
        On every taxel, pascals.
    position_m : float
        On the finger's position, metres per axis.
    angle_rad : float
        On the finger's orientation (per axis) and on the joint angle, radians.
    grey : float
        On every pixel, grey levels of 255.
    """

    pressure_pa: float = 0.0
    position_m: float = 0.0
    angle_rad: float = 0.0
    grey: float = 1.5


@dataclass(frozen=True)
class SiteTruth:
    """What is true at one site.

    Parameters
    ----------
    position_m : ndarray of float64, shape (3,)
        The site, world frame, metres; on the plane of the opening where there is nothing to touch.
    k1_per_m, k2_per_m : float or None
        Largest and smallest normal curvature, 1/m, concave up positive; None without contact.
    contact : bool
        Whether there is something to touch.
    """

    position_m: NDArray[np.float64]
    k1_per_m: float | None
    k2_per_m: float | None
    contact: bool


@dataclass(frozen=True)
class Truth:
    """What is true about a simulated scene.

    Parameters
    ----------
    surface : Surface
        The surface with its dimensions.
    category : str
        ``"quasiplanar"``, ``"curved"`` or ``"occluded"``.
    sites : tuple of SiteTruth
        In the order in which they were touched.
    directions_rad : tuple of float
        Commanded directions of the rolls at every site, from the world x axis towards y, radians. Friction
        makes the finger travel a little aside of them where the surface is curved.
    roll : ndarray of int64, shape (T,)
        Number of the roll at every sample, sites outermost, from 0; -1 between rolls and without contact.
    """

    surface: Surface
    category: str
    sites: tuple[SiteTruth, ...]
    directions_rad: tuple[float, ...]
    roll: NDArray[np.int64]


@dataclass(frozen=True)
class SimulatedScene:
    """A recording and what is true about it.

    Parameters
    ----------
    scene : Scene
        Picture, camera and touch, as from a real robot.
    truth : Truth
        What they show.
    """

    scene: Scene
    truth: Truth


def simulate(
    name: str,
    *,
    seed: int = 0,
    rate_hz: float = 1000.0,
    noise: Noise | None = None,
    sites: tuple[tuple[float, float], ...] | None = None,
    procedure: Procedure | None = None,
    fingertip_radius_m: float = 0.01,
    picture: bool = True,
    **dimensions: float,
) -> SimulatedScene:
    """Roll a fingertip over a surface and photograph it.

    The same arguments give the same scene, bit by bit.

    Parameters
    ----------
    name : str
        ``"plane"``, ``"cylinder"``, ``"sphere"``, ``"bowl"``, ``"trough"``, ``"saddle"`` or ``"hole"``.
    seed : int
        Seed of all noise.
    rate_hz : float
        Samples of the touch per second, at least 100.
    noise : Noise, optional
        How much noise; by default none on the touch and a little on the picture.
    sites : tuple of (x, y), optional
        Where to roll, world frame, metres; by default two places of the surface.
    procedure : Procedure, optional
        How to roll; by default in four directions at every site, 10 s in all.
    fingertip_radius_m : float
        Radius of the fingertip, metres.
    picture : bool
        Whether to photograph the surface; without it the scene has no image and no camera.
    **dimensions : float
        Dimensions of the surface, metres, as listed in `evifuse.simulation.surfaces`.

    Returns
    -------
    SimulatedScene
        The scene and the truth about it.

    Raises
    ------
    UsageError
        If the surface or a dimension is unknown, or the fingertip does not fit.
    MissingExtraError
        If MuJoCo is not installed.
    """
    kind = surface(name, **dimensions)
    procedure = procedure or Procedure()
    noise = noise or Noise()
    sites = kind.sites if sites is None else sites
    _check(kind, fingertip_radius_m, rate_hz, sites)
    for_touch, for_picture = np.random.default_rng(seed).spawn(2)
    motion = roll_finger(kind, fingertip_radius_m, sites, procedure, rate_hz)
    touch = _record(kind, fingertip_radius_m, motion, rate_hz, noise, for_touch)
    image, camera = photograph(kind, noise.grey, for_picture) if picture else (None, None)
    scene = Scene(image, camera, touch, f"simulated {name}")
    truths = tuple(_truth(kind, site) for site in sites)
    truth = Truth(kind, kind.category, truths, procedure.directions_rad, motion.phase)
    return SimulatedScene(scene, truth)


def _check(kind: Surface, radius_m: float, rate_hz: float, sites: tuple[tuple[float, float], ...]) -> None:
    if not rate_hz >= 100:
        raise UsageError(f"the sampling rate must be at least 100 Hz, not {rate_hz:g}")
    if not 0 < radius_m <= 0.1:
        raise UsageError(f"the fingertip's radius must be in (0, 0.1] m, not {radius_m:g}")
    if not sites:
        raise UsageError("at least one site is needed: give its x and y")
    for x, y in sites:
        point = kind.above(x, y)
        if point is None and kind.category != "occluded":
            raise UsageError(f"site ({x:g}, {y:g}) m is beside the {kind.name}: choose a place on it")
        room = getattr(kind, "radius_m", np.inf)
        if point is not None:
            k1 = kind.principal_curvatures(point)[0]
            room = np.inf if k1 <= 0 else 1 / k1
        if room < 1.2 * radius_m:
            raise UsageError(
                f"a fingertip of radius {radius_m:g} m does not fit into the {kind.name} "
                f"of radius {room:.3g} m: make the surface wider"
            )


def _record(
    kind: Surface,
    radius_m: float,
    motion: Motion,
    rate_hz: float,
    noise: Noise,
    generator: np.random.Generator,
) -> TouchRecording:
    """What the finger's sensors say about its motion."""
    fingertip = grid_fingertip(radius_m, pitch_m=0.07 * radius_m)
    pressure = pressures(fingertip, Skin(), kind, motion.position_m, motion.orientation_xyzw)
    samples = len(motion.phase)
    time_ns = START_NS + np.round(np.arange(samples) * 1e9 / rate_hz).astype(np.int64)
    touch = TouchRecording(
        fingertip,
        time_ns,
        motion.position_m,
        motion.orientation_xyzw,
        motion.joint_angle_rad,
        pressure,
        f"simulated {kind.name}",
    )
    return _with_noise(touch, noise, generator)


def _with_noise(touch: TouchRecording, noise: Noise, generator: np.random.Generator) -> TouchRecording:
    if noise.pressure_pa > 0:
        values = touch.pressure_pa + generator.normal(0, noise.pressure_pa, touch.pressure_pa.shape)
        touch = replace(touch, pressure_pa=values)
    if noise.position_m > 0:
        values = touch.position_m + generator.normal(0, noise.position_m, touch.position_m.shape)
        touch = replace(touch, position_m=values)
    if noise.angle_rad > 0:
        half = generator.normal(0, noise.angle_rad / 2, touch.position_m.shape)
        small = np.concatenate([half, np.ones((len(half), 1))], axis=1)
        turned = rotation.multiply(small, touch.orientation_xyzw)
        turned = turned / np.linalg.norm(turned, axis=1, keepdims=True)
        angle = touch.joint_angle_rad + generator.normal(0, noise.angle_rad, touch.joint_angle_rad.shape)
        touch = replace(touch, orientation_xyzw=turned, joint_angle_rad=angle)
    return touch


def _truth(kind: Surface, site: tuple[float, float]) -> SiteTruth:
    point = kind.above(*site)
    if point is None:
        return SiteTruth(np.array([*site, 0.0]), None, None, contact=False)
    k1, k2 = kind.principal_curvatures(point)
    return SiteTruth(point, k1, k2, contact=True)
