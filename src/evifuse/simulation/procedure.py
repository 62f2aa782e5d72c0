"""How the finger explores, and the way of each of its rolls.

Section 4.1.4 rolls the finger along several meridian planes; the choreography around it is our own.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import UsageError
from evifuse.recordings import rotation
from evifuse.recordings.recording import Fingertip
from evifuse.simulation.kinematics import STEPS, Contact, Paths, put_down, relative_curvature, roll_paths
from evifuse.simulation.surface import Surface
from evifuse.touch.fingersurface import FingerSurface, SphereSurface, surface_of
from evifuse.touch.hull import HullSurface, flattest_per_m

__all__ = ["Finger", "Procedure", "Roll", "plan_rolls"]

Vector = NDArray[np.float64]
SHORTEST = 0.1
"""A roll is at least so long to either side, over the radius of the fingertip."""


@dataclass(frozen=True)
class Procedure:
    """How the finger explores.

    Parameters
    ----------
    directions_rad : tuple of float
        Directions of the rolls at every site, from the world x axis towards y, radians.
    arc_rad : float
        Length of the contact's way along each roll, over the radius of the fingertip. Where the patch of
        contact is so wide that it would leave the taxels, the way is shorter.
    roll_s, lower_s, settle_s, lift_s, transfer_s : float
        Duration of each phase, seconds.
    clearance_m : float
        Height to which the finger is lifted, metres.
    depth_m : float
        How far below the expected surface the finger goes before it gives up, metres.
    press_n : float
        Force with which the finger is pressed on the surface, newtons; the skin's stiffness says how deep
        that is.
    """

    directions_rad: tuple[float, ...] = (0.0, np.pi / 4, np.pi / 2, 3 * np.pi / 4)
    arc_rad: float = 0.9
    roll_s: float = 0.9
    lower_s: float = 0.1
    settle_s: float = 0.05
    lift_s: float = 0.08
    transfer_s: float = 0.12
    clearance_m: float = 0.005
    depth_m: float = 0.008
    press_n: float = 2.0


@dataclass(frozen=True)
class Finger:
    """A fingertip as the simulation needs it.

    Parameters
    ----------
    tip : Fingertip
        Its taxels.
    surface : FingerSurface
        The smooth surface through them.
    pole_m : ndarray of float64, shape (3,)
        The point that is put on a site, fingertip frame, metres: where the taxels face on the average.
    cover_m : float
        How deep its force would press a ball of 10 mm into a plane, metres: see `depth_m`.
    """

    tip: Fingertip
    surface: FingerSurface
    pole_m: Vector
    cover_m: float

    @property
    def size_m(self) -> float:
        """Its radius, or how far the taxels of a pad go from its pole where that is less, metres."""
        if not isinstance(self.surface, HullSurface):
            return self.tip.radius_m
        beside = np.linalg.norm(self.tip.positions_m - self.pole_m, axis=1)
        return min(self.tip.radius_m, max(float(beside.max()), 1e-3))

    @property
    def radii_m(self) -> tuple[float, float]:
        """Smallest radius of curvature at its pole, and the largest there or on a pad around it, metres."""
        flat, steep = np.linalg.eigvalsh(self.surface.shape_operators(self.pole_m[None])[0][0]).tolist()
        if isinstance(self.surface, HullSurface):
            flat = flattest_per_m(self.tip, self.surface, self.pole_m)
        return 1 / max(steep, 1.0), 1 / max(flat, 1.0)  # what is flatter than 1 m is flat

    @property
    def aside_m(self) -> float:
        """How far its taxels reach to the side of its pole, metres: an opening must be wider."""
        facing = self.surface.project(self.pole_m[None])[1][0]
        beside = self.tip.positions_m - self.pole_m
        return float(np.linalg.norm(beside - np.outer(beside @ facing, facing), axis=1).max())

    @property
    def extent_m(self) -> float:
        """Largest distance of the finger's surface from the origin of its frame, metres."""
        return float(np.linalg.norm(self.tip.positions_m, axis=1).max())

    @property
    def is_sphere(self) -> bool:
        """Whether it is a sphere around the origin of its frame."""
        shape = self.surface
        return isinstance(shape, SphereSurface) and float(np.abs(shape.centre_m).max()) < 1e-6

    @classmethod
    def of(cls, tip: Fingertip, cover_m: float) -> "Finger":
        """The finger that has given taxels.

        Parameters
        ----------
        tip : Fingertip
            Its taxels.
        cover_m : float
            How deep its force would press a ball of 10 mm into a plane, metres.

        Returns
        -------
        Finger
            The finger.
        """
        surface = surface_of(tip)
        facing = tip.normals.mean(axis=0)
        facing /= np.linalg.norm(facing)
        if isinstance(surface, SphereSurface):
            return cls(tip, surface, surface.centre_m + surface.radius_m * facing, cover_m)
        middle = tip.positions_m - tip.positions_m.mean(axis=0)
        aside = np.linalg.norm(middle - np.outer(middle @ facing, facing), axis=1)
        pole = surface.project(tip.positions_m[[int(np.argmin(aside))]])[0][0]
        if flattest_per_m(tip, surface, pole) > 0:
            return cls(tip, surface, pole, cover_m)
        hull = HullSurface(tip.positions_m, tip.normals, cover_m)
        return cls(tip, hull, hull.support(facing[None])[0][0], cover_m)

    def depth_m(self, relative_per_m: Vector) -> Vector:
        """How deep its force presses it into surfaces.

        In a bed of springs k a force F presses two bodies together by the square root of
        ``F sqrt(det(B - S)) / (pi k)``: the better they fit, the wider is the patch and the less deep.

        Parameters
        ----------
        relative_per_m : ndarray of float64, shape (M, 2, 2)
            B - S: how much more curved the finger is than the surface, 1/m.

        Returns
        -------
        ndarray of float64, shape (M,)
            Depths, metres.
        """
        ball = np.linalg.det(relative_per_m) * 0.01**2  # 1 for a ball of 10 mm on a plane
        return self.cover_m * np.clip(ball, 1e-4, 1e4) ** 0.25

    def reach_m(self, contact: Contact, way: Vector) -> Vector:
        """How far the taxels go from the pole, along both senses of given directions.

        Parameters
        ----------
        contact : Contact
            M fingers that touch with their pole.
        way : ndarray of float64, shape (M, 3)
            Directions, world frame.

        Returns
        -------
        ndarray of float64, shape (M,)
            The shorter of both lengths along the finger's surface, metres.
        """
        pole, facing = (values[0] for values in self.surface.project(self.pole_m[None]))
        beside = self.tip.positions_m - pole
        turn = np.arccos(np.clip(self.tip.normals @ facing, -1.0, 1.0)) / 2
        arc = np.linalg.norm(beside, axis=1) / np.sinc(turn / np.pi)
        inverse = contact.orientation_xyzw * [-1.0, -1.0, -1.0, 1.0]
        along = rotation.rotate(inverse, way) @ beside.T
        within = np.cos(np.deg2rad(30)) * np.linalg.norm(beside, axis=1)
        ends = [np.max(np.where(side * along >= within, arc, 0.0), axis=1) for side in (1, -1)]
        return np.minimum(*ends)


@dataclass(frozen=True)
class Roll:
    """The way of one roll.

    Parameters
    ----------
    contact : Contact
        K stations of the way in equal steps.
    arc_m, turn_rad : ndarray of float64, shape (K,)
        Length of the way and angle rolled, from the site.
    binormal : ndarray of float64, shape (3,)
        Unit normal of the plane in which the finger is to roll.
    depth_m : float
        How deep the finger is pressed in, metres.
    gap_m : ndarray of float64, shape (K,)
        What its nearest taxel is away from the surface before that; 0 on a finger as smooth as a ball.
    solid : bool
        Whether there is anything to touch; without, the finger turns on the spot.
    """

    contact: Contact
    arc_m: Vector
    turn_rad: Vector
    binormal: Vector
    depth_m: float
    gap_m: Vector
    solid: bool


def plan_rolls(
    surface: Surface, finger: Finger, sites: tuple[tuple[float, ...], ...], procedure: Procedure
) -> list[Roll]:
    """The rolls at every site, sites outermost.

    At the site the pole of the fingertip points into the surface. Rolls end early where the finger would
    hit another part of the surface or no longer fits.

    Parameters
    ----------
    surface : Surface
        What is touched.
    finger : Finger
        What rolls.
    sites : tuple of (x, y) or (x, y, z)
        The sites, metres.
    procedure : Procedure
        Directions, and how far to roll.

    Returns
    -------
    list of Roll
        One for each site and direction.

    Raises
    ------
    UsageError
        If the finger doesn't fit at a site.
    """
    angles = procedure.directions_rad
    places = [surface.place(site) for site in sites for _ in angles]
    solid = np.array([place is not None for place in places])
    normals = np.array([[0.0, 0.0, 1.0] if place is None else place[1] for place in places])
    points = np.array(
        [[*sites[i // len(angles)][:2], 0.0] if place is None else place[0] for i, place in enumerate(places)]
    )
    binormals = np.cross(normals, _headings(np.tile(angles, len(sites)), normals))
    binormals /= np.linalg.norm(binormals, axis=1, keepdims=True)
    start = put_down(finger.surface, finger.pole_m, points, normals)
    length = 0.5 * procedure.arc_rad * finger.size_m
    paths, depth = None, np.zeros(0)
    if solid.any():
        some = Contact(*(values[solid] for values in vars(start).values()))
        way = np.cross(binormals[solid], normals[solid])
        relative = relative_curvature(surface, finger.surface, some, way)
        depth = finger.depth_m(relative)
        patch = np.sqrt(2 * depth / np.maximum(relative[:, 0, 0], 0.01 / finger.size_m))
        room = finger.reach_m(some, way) - patch
        reach = np.clip(room, SHORTEST * finger.size_m, length)
        paths = roll_paths(surface, finger.surface, some, binormals[solid], reach)
    numbers = np.cumsum(solid) - 1
    rolls: list[Roll] = []
    for i, (binormal, number) in enumerate(zip(binormals, numbers.tolist(), strict=True)):
        if solid[i] and paths is not None:
            rolls.append(_cut(surface, finger, paths, number, binormal, float(depth[number])))
        else:
            rolls.append(_in_vain(start, i, binormal, procedure))
    return rolls


def _headings(angles: Vector, normals: Vector) -> Vector:
    """Commanded directions: horizontal, or on a wall from the horizontal towards up."""
    ahead = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=-1)
    level = np.cross([0.0, 0.0, 1.0], normals)
    wall = np.linalg.norm(level, axis=1) > 0.8
    level = np.where(wall[:, None], level, [1.0, 0.0, 0.0])
    level /= np.linalg.norm(level, axis=1, keepdims=True)
    on_wall = np.cos(angles)[:, None] * level + np.sin(angles)[:, None] * np.cross(normals, level)
    return np.where(wall[:, None], on_wall, ahead)


def _cut(
    surface: Surface, finger: Finger, paths: Paths, number: int, binormal: Vector, depth_m: float
) -> Roll:
    """One roll out of many, as far as the finger fits and touches in one place only."""
    stations = np.arange(2 * STEPS + 1)
    every = stations[:: STEPS // 5]
    free = paths.fits[number] & (
        np.interp(stations, every, _free(surface, finger, paths, number, every, depth_m)) > 0.5
    )
    if not free[STEPS]:
        x, y, z = paths.contact[STEPS].point_m[number]
        raise UsageError(
            f"the fingertip does not fit at ({x:.3g}, {y:.3g}, {z:.3g}) m of the {surface.name}: "
            f"choose another site, a smaller fingertip, or hollows of {1.2 * finger.radii_m[1]:.3g} m or more"
        )
    low = STEPS - int(np.argmin(np.append(free[STEPS::-1], False))) + 1
    high = STEPS + int(np.argmin(np.append(free[STEPS:], False)))
    kept = slice(low, high)
    stacked = (
        np.array([vars(contact)[key][number] for contact in paths.contact[kept]])
        for key in ("point_m", "normal", "finger_m", "orientation_xyzw")
    )
    arc, turn = paths.arc_m[number, kept], paths.turn_rad[number, kept]
    contact = Contact(*stacked)
    return Roll(contact, arc, turn, binormal, depth_m, _gap(surface, finger, contact), solid=True)


def _gap(surface: Surface, finger: Finger, contact: Contact) -> Vector:
    """How far the taxels of a finger that stands on some of them are from what it touches."""
    gap = np.zeros(len(contact.point_m))
    if not isinstance(finger.surface, HullSurface):
        return gap
    turned = rotation.to_matrix(contact.orientation_xyzw)
    for _ in range(3):
        centre = contact.centre_m(0.0) - gap[:, None] * contact.normal
        taxels = centre[:, None] + finger.tip.positions_m @ turned.transpose(0, 2, 1)
        gap += surface.distance(taxels.reshape(-1, 3)).reshape(taxels.shape[:2]).min(axis=1)
    return gap


def _free(
    surface: Surface, finger: Finger, paths: Paths, number: int, stations: NDArray[np.int64], depth_m: float
) -> NDArray[np.float64]:
    """1 where nothing but the contact touches, else 0, at some stations."""
    free = np.ones(len(stations))
    for i, station in enumerate(stations.tolist()):
        contact = Contact(*(values[[number]] for values in vars(paths.contact[station]).values()))
        centre = contact.centre_m(0.0)
        turned = rotation.to_matrix(contact.orientation_xyzw[0])
        depth = -surface.distance(centre + finger.tip.positions_m @ turned.T).min()
        if finger.is_sphere:
            depth = max(depth, finger.tip.radius_m - float(surface.distance(centre)[0]))
        free[i] = depth < 0.3 * depth_m + 2e-5
    return free


def _in_vain(start: Contact, number: int, binormal: Vector, procedure: Procedure) -> Roll:
    """Where nothing is met the joint turns the finger on the spot."""
    turn = np.linspace(-0.5, 0.5, 2 * STEPS + 1) * procedure.arc_rad
    values = {key: np.repeat(value[number][None], len(turn), axis=0) for key, value in vars(start).items()}
    below = rotation.rotate(values["orientation_xyzw"], values["finger_m"])
    turned = rotation.multiply(rotation.about_axis(binormal, turn), values["orientation_xyzw"])
    values["orientation_xyzw"] = turned
    values["finger_m"] = rotation.rotate(turned * [-1.0, -1.0, -1.0, 1.0], below)
    return Roll(Contact(**values), np.zeros_like(turn), turn, binormal, 0.0, np.zeros_like(turn), solid=False)
