"""Curvature while the finger rolls: an estimate after every sample (our own).

Samples are gathered into the same blocks as in `site_shape`. After every finished block a few Gauss-Newton
steps go on from the last fit, with all blocks of the site: their errors are correlated and the first
direction says little across, so adding up information once and for all is too sure of itself. When the
finger is lifted the roll joins the site that its middle belongs to, and in the end it is the batch
estimate. A site forgets all but its last rolls.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import Fingertip
from evifuse.touch.curvature import NARROWEST_RAD, ShapeOperator, spread_rad
from evifuse.touch.fingertip import taxel_pitch_m
from evifuse.touch.online_contact import ContactFinder
from evifuse.touch.patch import Blocks, Patch, fit_patch
from evifuse.touch.profile import USUAL_DEPTH_M, press_depth_m
from evifuse.touch.rolling import SHORTEST_ROLL, tangents
from evifuse.touch.site_shape import operator_of_patch
from evifuse.touch.sites import SAME_MIDDLE

__all__ = ["CurvatureTracker", "TrackedSite", "Tracking"]

Array = NDArray[np.float64]

LIFT_NS = 20_000_000
"""So long without contact is a lift."""
STEPS = 2
"""Gauss-Newton steps after every block."""
MOST_ROLLS = 12
"""Rolls of a site that are remembered."""
FEWEST = 4
"""A patch is fitted to no fewer blocks."""


@dataclass(frozen=True)
class TrackedSite:
    """A site as it is known so far.

    Parameters
    ----------
    centre_m : ndarray of float64, shape (3,)
        Where the sphere's centre is over the site, world frame, metres.
    normal : ndarray of float64, shape (3,)
        Outward unit normal of the surface there, world frame.
    shape : ShapeOperator or None
        Its curvature, in the axes of `tangents` of the normal; None after one direction.
    """

    centre_m: Array
    normal: Array
    shape: ShapeOperator | None


@dataclass(frozen=True)
class Tracking:
    """What is known after a sample.

    Parameters
    ----------
    touching : bool
        Whether there is contact.
    site : int or None
        Index of the site that is being touched, in `CurvatureTracker.sites`; None in the air and at a new
        site.
    direction_rad : float or None
        Travelled direction, as `RollCurvature.direction_rad`; None until the finger has rolled a little.
    curvature_per_m, standard_error_per_m : float or None
        Normal curvature along it so far and its standard error, 1/m.
    shape : ShapeOperator or None
        Curvature there so far; None until the site was rolled over in two directions.
    """

    touching: bool
    site: int | None = None
    direction_rad: float | None = None
    curvature_per_m: float | None = None
    standard_error_per_m: float | None = None
    shape: ShapeOperator | None = None


class _Site:
    """Blocks of a site: means of centre, normal and pole, and how many samples, roll by roll."""

    def __init__(self, rolls: list[Array]) -> None:
        self.rolls = rolls
        self.shape: ShapeOperator | None = None
        self.patch: Patch | None = None
        self.place()

    def place(self) -> None:
        """Site and its frame: mean of the middles of its rolls, and the normal of the blocks next to it."""
        self.centre = np.mean([_middle(roll) for roll in self.rolls], axis=0)
        rows = np.concatenate(self.rolls)
        near = np.argsort(np.linalg.norm(rows[:, :3] - self.centre, axis=1))[: max(1, len(rows) // 8)]
        normal = rows[near, 3:6].sum(axis=0)
        self.normal = normal / np.linalg.norm(normal)
        self.frame = np.stack([*tangents(self.normal), self.normal], axis=1)

    def directions(self) -> list[float]:
        """Directions of the rolls in the tangent plane, radians."""
        ways = [self.frame[:, :2].T @ (roll[-1, :3] - roll[0, :3]) for roll in self.rolls]
        return [float(np.arctan2(way[1], way[0])) for way in ways]


class CurvatureTracker:
    """Estimates the curvature under a rolling finger, sample by sample.

    The first 64 samples only teach it how noisy the taxels are.

    Parameters
    ----------
    fingertip : Fingertip
        Geometry of the fingertip, N taxels.
    usable : ndarray of bool, shape (N,), optional
        Taxels that are known to respond, such as `FingertipHealth.usable` of an earlier recording. The
        others, and those that are found to be silent on the way, are filled in from the taxels around them.

    Examples
    --------
    >>> from evifuse.touch import spherical_fingertip
    >>> tip = spherical_fingertip(pitch_m=0.002)
    >>> tracker = CurvatureTracker(tip)
    >>> tracker.update(0, [0.0, 0.0, 0.02], [0.0, 0.0, 0.0, 1.0], 0.0, np.zeros(len(tip.normals))).touching
    False
    """

    def __init__(self, fingertip: Fingertip, usable: NDArray[np.bool_] | None = None) -> None:
        self._tip = fingertip
        self._finder = ContactFinder(fingertip, usable)
        self._step_m = 0.5 * taxel_pitch_m(fingertip)
        self._sum, self._start = np.zeros(10), np.zeros(3)
        self._blocks: list[Array] = []
        self._last_ns = 0
        self._site: _Site | None = None
        self._patch: Patch | None = None
        self._now = Tracking(True)
        self._sites: list[_Site] = []

    @property
    def sites(self) -> tuple[TrackedSite, ...]:
        """The sites so far, in the order in which they were first left."""
        return tuple(TrackedSite(site.centre, site.normal, site.shape) for site in self._sites)

    def update(
        self,
        time_ns: int,
        position_m: Array | list[float],
        orientation_xyzw: Array | list[float],
        joint_angle_rad: float,
        pressure_pa: Array,
    ) -> Tracking:
        """Take in the next sample.

        Parameters
        ----------
        time_ns : int
            Its time, nanoseconds, later than the last.
        position_m : array_like of float, shape (3,)
            Centre of the fingertip's sphere, world frame, metres.
        orientation_xyzw : array_like of float, shape (4,)
            Unit quaternion that turns fingertip coordinates into world coordinates.
        joint_angle_rad : float
            Angle of the distal joint, radians. The pose holds it, so it is not used.
        pressure_pa : ndarray of float64, shape (N,)
            Pressures, pascals; NaN where a taxel reads nothing.

        Returns
        -------
        Tracking
            What is known now.
        """
        touching, direction, centre = self._finder.find(pressure_pa)
        if not touching:
            if self._blocks and time_ns - self._last_ns > LIFT_NS:
                self._lift()
            return Tracking(False)
        self._last_ns = time_ns
        if direction is not None:
            position = np.asarray(position_m, dtype=np.float64) + _turned(orientation_xyzw, centre)
            self._gather(position, orientation_xyzw, direction)
        return self._now

    def finish(self) -> tuple[TrackedSite, ...]:
        """End of the stream: what is still under the finger joins its site.

        Returns
        -------
        tuple of TrackedSite
            All sites.
        """
        self._lift()
        return self.sites

    def _gather(self, position: Array, orientation: Array | list[float], direction: Array) -> None:
        """Add a sample to the block, and finish the block when the finger has moved on."""
        if self._sum[9] == 0:
            self._start = position
        self._sum[:3] += position
        self._sum[3:6] -= _turned(orientation, direction)
        self._sum[6:9] += _turned(orientation, self._finder.pole)
        self._sum[9] += 1
        way = position - self._start
        if float(way @ way) < self._step_m**2 or self._sum[9] < 4:
            return
        self._close()

    def _close(self) -> None:
        block = self._sum / self._sum[9]
        block[9] = self._sum[9]
        block[3:6] /= np.linalg.norm(block[3:6])
        self._sum = np.zeros(10)
        self._blocks.append(block)
        if len(self._blocks) == 1:
            self._begin()
        if self._site is None:
            self._site = _Site([np.array(self._blocks)])
        before = self._site.rolls if self._site in self._sites else []
        if len(self._blocks) < FEWEST and not before:
            return
        blocks = self._as_blocks(self._site, [*before, np.array(self._blocks)])
        self._patch = fit_patch(blocks, STEPS, self._patch)
        self._tell(self._site, self._patch)

    def _tell(self, site: _Site, patch: Patch) -> None:
        """What is known now, along the way and in all."""
        shape = operator_of_patch(patch, *self._depth(patch))
        way = site.frame[:, :2].T @ (self._blocks[-1][:3] - self._blocks[0][:3])
        direction = float(np.arctan2(way[1], way[0]) % np.pi)
        k, error = shape.along(direction)
        directions = [direction, *(site.directions() if site in self._sites else [])]
        whole = spread_rad(directions) >= NARROWEST_RAD
        index = self._sites.index(site) if site in self._sites else None
        self._now = Tracking(True, index, direction, k, error, shape if whole else None)

    def _begin(self) -> None:
        """At first touch: go on with the site that is near."""
        self._site = self._patch = None
        start = self._blocks[0][:3]
        near = [s for s in self._sites if np.linalg.norm(s.centre - start) < self._tip.radius_m]
        if near:
            self._site = min(near, key=lambda s: float(np.linalg.norm(s.centre - start)))
            self._patch = self._site.patch

    def _lift(self) -> None:
        """The roll is over: it joins a site, which is fitted again."""
        if self._sum[9] > 3:
            self._close()
        roll, self._blocks, self._sum = self._blocks, [], np.zeros(10)
        self._site = self._patch = None
        self._now = Tracking(True)
        if len(roll) < FEWEST:
            return
        rows = np.array(roll)
        length = float(np.linalg.norm(rows[-1, :3] - rows[0, :3]))
        if length < SHORTEST_ROLL * self._tip.radius_m:
            return
        middle = _middle(rows)
        same = [s for s in self._sites if np.linalg.norm(s.centre - middle) < SAME_MIDDLE * length]
        if same:
            site = min(same, key=lambda s: float(np.linalg.norm(s.centre - middle)))
            site.rolls = [*site.rolls, rows][-MOST_ROLLS:]
            site.place()
        else:
            site = _Site([rows])
            self._sites.append(site)
        site.patch = fit_patch(self._as_blocks(site, site.rolls))
        if spread_rad(site.directions()) >= NARROWEST_RAD:
            site.shape = operator_of_patch(site.patch, *self._depth(site.patch))

    def _depth(self, patch: Patch) -> tuple[float, float]:
        """Press depth and its error, metres."""
        radius = self._tip.radius_m
        if self._finder.profile is None:
            return USUAL_DEPTH_M, 0.5 * USUAL_DEPTH_M
        mean, pitch = 0.5 * float(patch.parameters[[3, 5]].sum()), 2 * self._step_m
        return press_depth_m(self._finder.profile, radius, mean, pitch)

    def _as_blocks(self, site: _Site, rolls: list[Array]) -> Blocks:
        rows = np.concatenate(rolls)
        origin = site.centre - self._tip.radius_m * site.normal
        label = np.repeat(np.arange(len(rolls)), [len(roll) for roll in rolls])
        return Blocks(
            centre_m=(rows[:, :3] - origin) @ site.frame,
            normal=rows[:, 3:6] @ site.frame,
            radius_m=np.full(len(rows), self._tip.radius_m),
            tilt=(rows[:, 3:6] + rows[:, 6:9]) @ site.frame,
            weight=np.minimum(rows[:, 9] / np.median(rows[:, 9]), 1.0),
            roll=label,
            scale_error=self._finder.scale_error,
        )


def _middle(rows: Array) -> Array:
    """Middle of a roll along its way, however long it stood still at an end."""
    along = (rows[:, :3] - rows[0, :3]) @ (rows[-1, :3] - rows[0, :3])
    near = np.argsort(np.abs(along - 0.5 * along[-1]), kind="stable")[: max(1, len(rows) // 8)]
    return rows[near, :3].mean(axis=0)


def _turned(orientation: Array | list[float], vector: Array) -> Array:
    """A vector turned by a unit quaternion, in plain floats: there is only one."""
    x, y, z, w = map(float, orientation)
    a, b, c = vector.tolist()
    p, q, r = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
    return np.array([a + w * p + y * r - z * q, b + w * q + z * p - x * r, c + w * r + x * q - y * p])
