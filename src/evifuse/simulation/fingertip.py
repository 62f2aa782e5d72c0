"""The simulated fingertip: where its taxels are and what they read."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings import rotation
from evifuse.recordings.recording import Fingertip
from evifuse.simulation.physics import COVER_M, PRESS_N
from evifuse.simulation.surface import Surface

__all__ = ["Skin", "grid_fingertip", "pressures"]

BLOCK = 256
"""So many samples are worked on at once: their taxels stay in the processor's cache."""
CAP_RAD = np.deg2rad(40)
"""Angle between the pole of the fingertip and its outermost taxels."""


@dataclass(frozen=True)
class Skin:
    """An elastic layer over the rigid fingertip (our own model: a bed of independent springs).

    Parameters
    ----------
    stiffness_pa_per_m : float
        Pressure per penetration depth. With 3e9 Pa/m a 10 mm fingertip that is pressed 0.15 mm deep into a
        plane carries about 2 N.
    spread_m : float
        Standard deviation of the Gaussian point spread function between taxels, metres; 0 for none.
    """

    stiffness_pa_per_m: float = 3e9
    spread_m: float = 0.35e-3

    def depth_m(self, press_n: float) -> float:
        """How deep a force presses the skin of a fingertip of about 10 mm into a plane.

        A sphere in a bed of springs k is pressed in by the square root of ``F / (pi k a)``; the softer the
        skin and the larger the force, the wider is the patch of contact.

        Parameters
        ----------
        press_n : float
            Force, newtons.

        Returns
        -------
        float
            Depth, metres: 0.15 mm with the usual skin and 2 N.
        """
        return COVER_M * float(np.sqrt(press_n / PRESS_N * 3e9 / self.stiffness_pa_per_m))


def grid_fingertip(radius_m: float = 0.01, pitch_m: float = 0.7e-3, cap_rad: float = CAP_RAD) -> Fingertip:
    """A spherical fingertip with a nearly square grid of taxels around its pole.

    The grid is square in the azimuthal equidistant projection, so arcs from the pole keep their length.

    Parameters
    ----------
    radius_m : float
        Radius of the sphere, metres.
    pitch_m : float
        Distance between neighbours, metres.
    cap_rad : float
        Angle between the pole (-z of the fingertip frame) and the outermost taxels, radians.

    Returns
    -------
    Fingertip
        The taxels, row by row.
    """
    count = int(radius_m * cap_rad / pitch_m)
    steps = np.arange(-count, count + 1) * pitch_m
    x, y = (axis.ravel() for axis in np.meshgrid(steps, steps))
    arc = np.hypot(x, y)
    x, y, arc = (values[arc <= radius_m * cap_rad * (1 + 1e-9)] for values in (x, y, arc))
    angle = arc / radius_m
    scale = np.sinc(angle / np.pi) / radius_m
    normals = np.stack([x * scale, y * scale, -np.cos(angle)], axis=-1).astype(np.float64)
    return Fingertip(radius_m, radius_m * normals, normals)


def pressures(
    fingertip: Fingertip,
    skin: Skin,
    surface: Surface,
    position_m: NDArray[np.float64],
    orientation_xyzw: NDArray[np.float64],
) -> NDArray[np.float64]:
    """What the taxels read at given poses.

    Parameters
    ----------
    fingertip : Fingertip
        N taxels.
    skin : Skin
        Stiffness and point spread.
    surface : Surface
        What the fingertip is pressed into.
    position_m : ndarray of float64, shape (T, 3)
        Centres of the fingertip in the world frame, metres.
    orientation_xyzw : ndarray of float64, shape (T, 4)
        Orientations of the fingertip in the world frame.

    Returns
    -------
    ndarray of float64, shape (T, N)
        Pressures, Pa; exactly 0 far from the contact.
    """
    extent = float(np.linalg.norm(fingertip.positions_m, axis=1).max())
    values = np.zeros((len(position_m), len(fingertip.positions_m)))
    nearest, normals = surface.nearest(position_m)
    height = np.einsum("ij,ij->i", position_m - nearest, normals)
    touching = np.flatnonzero(height < extent)
    if not len(touching):
        return values
    for begin in range(0, len(touching), BLOCK):
        rows = touching[begin : begin + BLOCK]
        k1 = max(surface.principal_curvatures(point)[0] for point in nearest[rows[:: BLOCK // 2 - 1]])
        turned = rotation.to_matrix(orientation_xyzw[rows])
        down = np.einsum("tji,tj->ti", turned, normals[rows])
        sample, taxel = np.nonzero(_close(fingertip.positions_m, height[rows], down, k1))
        if not len(sample):
            continue
        moved = np.einsum("mij,mj->mi", turned[sample], fingertip.positions_m[taxel])
        depth = np.maximum(0.0, -surface.distance(position_m[rows[sample]] + moved))
        values[rows[sample], taxel] = skin.stiffness_pa_per_m * depth
    if skin.spread_m > 0:
        loaded = touching[values[touching].any(axis=1)]
        values[loaded] = values[loaded] @ _spread(fingertip, skin.spread_m)
    return values


def _close(
    positions_m: NDArray[np.float64], height_m: NDArray[np.float64], down: NDArray[np.float64], k1: float
) -> NDArray[np.bool_]:
    """Which taxels (T, N) may be loaded: those that the surface can reach.

    A convex surface stays under its tangent plane, a hollow one rises over it: half as much again as a
    circle's parabola where it gets steeper.
    """
    along = down @ positions_m.T
    over = along + height_m[:, None]
    if k1 <= 0:
        return over < 1e-6
    aside = np.square(positions_m).sum(axis=1) - np.square(along, out=along)
    return over < 0.75 * k1 * aside + 1e-6


def _spread(fingertip: Fingertip, spread_m: float) -> NDArray[np.float64]:
    """Point spread matrix: what one loaded taxel adds to each other; every row sums to 1."""
    apart = fingertip.positions_m[:, None] - fingertip.positions_m[None]
    weight = np.exp(-np.sum(apart**2, axis=-1) / (2 * spread_m**2))
    weight[weight < 1e-6] = 0.0
    return weight / weight.sum(axis=1, keepdims=True)
