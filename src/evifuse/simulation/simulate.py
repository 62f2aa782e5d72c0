"""One call: a surface is touched, and photographed, and the truth is known."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import UsageError
from evifuse.recordings.recording import Fingertip, Scene, TouchRecording
from evifuse.simulation.camera import photograph
from evifuse.simulation.defects import Defects, with_defects
from evifuse.simulation.fingertip import Skin, grid_fingertip, pressures
from evifuse.simulation.noise import Noise, disturbed, gap, noisy
from evifuse.simulation.procedure import Finger, Procedure
from evifuse.simulation.rolling import Control, Motion, roll_finger
from evifuse.simulation.surface import Surface
from evifuse.simulation.surfaces import fitting_surface, surface
from evifuse.simulation.truth import Truth, site_truth

__all__ = ["SimulatedScene", "simulate"]

START_NS = 1_700_000_000_000_000_000
"""Time of the first sample of every simulated recording, UTC nanoseconds since 1970."""


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
    name: str | Surface,
    *,
    seed: int = 0,
    rate_hz: float = 1000.0,
    noise: Noise | None = None,
    sites: tuple[tuple[float, ...], ...] | None = None,
    procedure: Procedure | None = None,
    fingertip: Fingertip | None = None,
    fingertip_radius_m: float = 0.01,
    skin: Skin | None = None,
    defects: Defects | None = None,
    control: Control | None = None,
    picture: bool | None = None,
    **dimensions: float,
) -> SimulatedScene:
    """Roll a fingertip over a surface and photograph it.

    The same arguments give the same scene, bit by bit.

    Parameters
    ----------
    name : str or Surface
        A name of the catalogue (`evifuse.simulation.SURFACES`), or a surface such as a `MeshSurface`.
    seed : int
        Seed of all noise.
    rate_hz : float
        Samples of the touch per second, at least 100.
    noise : Noise, optional
        How much noise; by default none on the touch and a little on the picture.
    sites : tuple of (x, y) or (x, y, z), optional
        Where to roll, world frame, metres; by default two places of the surface.
        `evifuse.simulation.auto_sites` finds some.
    procedure : Procedure, optional
        How to roll; by default in four directions at every site, 10 s in all.
    fingertip : Fingertip, optional
        Any layout of taxels; by default a sphere with a grid.
    fingertip_radius_m : float
        Radius of the default fingertip, metres.
    skin : Skin, optional
        Stiffness and point spread.
    defects : Defects, optional
        Dead, stuck, drifting taxels and so on.
    control : {"force", "pose"}, optional
        Pressed with a force and driven by friction in MuJoCo (the default for spheres), or led along the
        ideal roll with the depth that the force would have (the default for other fingertips).
    picture : bool, optional
        Whether to photograph the surface; without it the scene has no image and no camera. By default
        surfaces of the catalogue are.
    **dimensions : float
        Dimensions of the surface, metres, as listed in `evifuse.simulation.surfaces`; without any, the usual
        ones, or larger ones where a large finger needs them.

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
    procedure, noise, skin = procedure or Procedure(), (noise or Noise()).checked(), skin or Skin()
    tip = fingertip or _sphere(fingertip_radius_m)
    finger = Finger.of(tip, skin.depth_m(procedure.press_n))
    kind = _kind(name, finger, dimensions)
    places = kind.sites if sites is None else sites
    _check(kind, finger, rate_hz, places)
    control = control or ("force" if finger.is_sphere else "pose")
    if not finger.is_sphere and control == "force":
        raise UsageError("only a spherical fingertip can be pressed with a force: use control='pose'")
    chance = np.random.SeedSequence(seed)
    for_touch, for_picture, for_motion = chance.spawn(3)
    motion = roll_finger(kind, finger, places, procedure, rate_hz, control)
    if noise.slip > 0 or noise.loss_of_contact > 0:
        motion = disturbed(motion, finger.surface, noise, rate_hz, for_motion)
    generator = np.random.default_rng(for_touch)
    touch, left = _record(kind, tip, skin, motion, rate_hz, noise, generator, defects)
    if picture is None:
        picture = kind.around is None
    image, camera = (
        photograph(kind, noise.grey, np.random.default_rng(for_picture)) if picture else (None, None)
    )
    scene = Scene(image, camera, touch, f"simulated {kind.name}")
    truths = tuple(site_truth(kind, site, tip.radius_m) for site in places)
    truth = Truth(kind, kind.category, truths, procedure.directions_rad, motion.phase[left])
    return SimulatedScene(scene, truth)


def _kind(name: str | Surface, finger: Finger, dimensions: dict[str, float]) -> Surface:
    """The surface that was asked for; one without dimensions is as large as the finger needs."""
    if not isinstance(name, str):
        return name
    return (
        surface(name, **dimensions)
        if dimensions
        else fitting_surface(name, finger.radii_m[1], finger.aside_m)
    )


def _sphere(radius_m: float) -> Fingertip:
    if not 0 < radius_m <= 0.1:
        raise UsageError(f"the fingertip's radius must be in (0, 0.1] m, not {radius_m:g}")
    return grid_fingertip(radius_m, pitch_m=0.07 * radius_m)


def _check(kind: Surface, finger: Finger, rate_hz: float, sites: tuple[tuple[float, ...], ...]) -> None:
    if not 100 <= rate_hz <= 1e5:
        raise UsageError(f"the sampling rate must be at least 100 Hz and at most 100 kHz, not {rate_hz:g}")
    if not sites:
        raise UsageError("at least one site is needed: give its x and y")
    for site in sites:
        place = kind.place(site)
        if place is None and kind.category != "occluded":
            where = ", ".join(f"{value:g}" for value in site)
            raise UsageError(f"site ({where}) m is beside the {kind.name}: choose a place on it")
        room, needed, fits = getattr(kind, "radius_m", np.inf), finger.aside_m, finger.aside_m
        if place is not None:
            k1 = kind.principal_curvatures(place[0])[0]
            room, (needed, fits) = np.inf if k1 <= 0 else 1 / k1, finger.radii_m
        elif finger.is_sphere:
            needed = fits = finger.tip.radius_m
        if room < 1.2 * needed:
            raise UsageError(
                f"the fingertip does not fit into the {kind.name} of radius {room:.3g} m: "
                f"the smallest radius that it fits into is {1.2 * fits:.3g} m"
            )


def _record(
    kind: Surface,
    fingertip: Fingertip,
    skin: Skin,
    motion: Motion,
    rate_hz: float,
    noise: Noise,
    generator: np.random.Generator,
    defects: Defects | None,
) -> tuple[TouchRecording, NDArray[np.bool_]]:
    """What the finger's sensors say about its motion, and which samples of it are left."""
    pressure = pressures(fingertip, skin, kind, motion.position_m, motion.orientation_xyzw)
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
    touch = noisy(touch, noise, rate_hz, generator)
    if defects is not None:
        touch = with_defects(touch, defects)
    left = gap(touch, noise.gap_s, generator)
    if left.all():
        return touch, left
    rows = ("time_ns", "position_m", "orientation_xyzw", "joint_angle_rad", "pressure_pa")
    return replace(touch, **{key: vars(touch)[key][left] for key in rows}), left
