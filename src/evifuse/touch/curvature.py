"""From rolls to curvature: the local curvature along each roll, and the shape operator of each site.

Rolling without slip turns the fingertip by dpsi/ds = 1/a - K per unit of contact path, so K_cone = -dpsi/ds
and K = K_cone + 1/a (section 4.1.2, signs as this project reads them). Three things go beyond the chapter:

- The direction is the travelled one, on the measured contact path p = c - a n (c from the pose, n from the
  pressures).
- Slip is measured. The centre's path is a times the turn that was really rolled; the turn that slipped is
  left out, so that K_cone = -(1 - slip) dpsi/ds.
- The path may bend sideways. With g = -dn/ds_c along the centre's path, g = S_c t_c holds as a vector, where
  S_c is the shape operator of the path's own surface, at distance a from the touched one. S_c is fitted over
  all rolls of a site, and then moved down to the surface: S = S_c (I + a S_c)^-1.
"""

from dataclasses import dataclass, replace
from math import atan2, hypot, pi

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import TouchRecording
from evifuse.touch.contact import ContactTrack
from evifuse.touch.fingertip import taxel_pitch_m
from evifuse.touch.rolling import tangents
from evifuse.touch.sites import ContactSite

__all__ = ["RollCurvature", "ShapeOperator", "along", "measure_roll", "shape_operator", "spread_rad"]

NARROWEST_RAD = 0.2
"""Directions of a site that differ by less than this (11 degrees) don't determine two curvatures."""
SYSTEMATIC = 0.001
"""What averaging doesn't remove: a relative error of the contact's angle, from the spacing of the taxels."""
MOST_BLOCKS = 60
"""Pieces that a roll is cut into, at most; they are as long as half the distance between taxels.

Neighbouring samples share the same taxels and hence the same error: half a taxel of travel is about one
independent measurement.
"""
NODES, SHARES = np.polynomial.legendre.leggauss(6)
SHARPEST = 0.05
"""Smallest 1 + a k of the offset surface that is believed: curvatures beyond -19 / a are cut off there."""


@dataclass(frozen=True)
class RollCurvature:
    """What one roll says about the curvature at its site.

    Parameters
    ----------
    samples : ndarray of int64, shape (M,)
        Samples of the recording that it was measured on.
    direction_rad : float
        Angle of the contact path's tangent at the site against the world's x axis projected into the tangent
        plane, counter-clockwise about the outward normal, in [0, pi).
    curvature_per_m : float
        Normal curvature K of the surface along it, 1/m, concave up positive.
    standard_error_per_m : float
        Standard error of K, 1/m.
    joint_curvature_per_m : float
        K from the joint angle with nothing known about slip, 1/m: the chapter's own estimate. NaN without a
        joint angle.
    slip : float
        Share of the turn that was not rolled; 0 without slip, NaN without a joint angle.
    tangent : ndarray of float64, shape (2,)
        Unit tangent of the centre's path in the site's tangent plane.
    bending_per_m : ndarray of float64, shape (2,)
        Bending g = -dn/ds_c in the site's tangent plane, 1/m.
    bending_error_per_m : ndarray of float64, shape (2,)
        Standard errors of g along and across the tangent, 1/m.
    """

    samples: NDArray[np.int64]
    direction_rad: float
    curvature_per_m: float
    standard_error_per_m: float
    joint_curvature_per_m: float
    slip: float
    tangent: NDArray[np.float64]
    bending_per_m: NDArray[np.float64]
    bending_error_per_m: NDArray[np.float64]


@dataclass(frozen=True)
class ShapeOperator:
    """Principal curvatures of a surface at a site.

    Parameters
    ----------
    k1_per_m, k2_per_m : float
        Principal curvatures, 1/m, concave up positive, k1 >= k2.
    k1_error_per_m, k2_error_per_m : float
        Their standard errors, 1/m.
    k1_direction_rad : float
        Direction of k1, as `RollCurvature.direction_rad`.
    covariance : ndarray of float64, shape (3, 3), or None
        Covariance of the operator's k_xx, k_xy, k_yy in the site's tangent axes (`tangents`), 1/m^2; None if
        only the errors of k1 and k2 are known.
    """

    k1_per_m: float
    k2_per_m: float
    k1_error_per_m: float
    k2_error_per_m: float
    k1_direction_rad: float
    covariance: NDArray[np.float64] | None = None

    @property
    def matrix(self) -> NDArray[np.float64]:
        """The operator [[k_xx, k_xy], [k_xy, k_yy]] in the site's tangent axes, 1/m, shape (2, 2)."""
        c, s = np.cos(self.k1_direction_rad), np.sin(self.k1_direction_rad)
        axes = np.array([[c, -s], [s, c]])
        return axes @ np.diag([self.k1_per_m, self.k2_per_m]) @ axes.T

    def along(self, direction_rad: float) -> tuple[float, float]:
        """Normal curvature along a direction.

        Parameters
        ----------
        direction_rad : float
            As `RollCurvature.direction_rad`.

        Returns
        -------
        curvature_per_m, standard_error_per_m : float
            ``t S t`` and its standard error from the covariance, NaN without one, 1/m.
        """
        c, s = np.cos(direction_rad), np.sin(direction_rad)
        weights = np.array([c * c, 2 * c * s, s * s])
        k = float(weights @ self.matrix[[0, 0, 1], [0, 1, 1]])
        if self.covariance is None:
            return k, float("nan")
        return k, float(np.sqrt(max(float(weights @ self.covariance @ weights), 0.0)))


def measure_roll(
    recording: TouchRecording, track: ContactTrack, site: ContactSite, roll: NDArray[np.int64]
) -> RollCurvature:
    """Curvature along one roll, at the point of it that is closest to its site.

    Parameters
    ----------
    recording : TouchRecording
        T samples.
    track : ContactTrack
        Its contact.
    site : ContactSite
        The site that the roll crosses.
    roll : ndarray of int64, shape (M,)
        Samples of the roll.

    Returns
    -------
    RollCurvature
        In the tangent plane of the site.
    """
    from evifuse.touch._kernels_rolls import roll_rates

    radius, known = recording.fingertip.radius_m, recording.has_joint
    frame = np.stack([*tangents(site.normal), site.normal], axis=1)
    rates, errors, cosine, sine, slope = roll_rates(
        recording.position_m, track.normal, recording.joint_angle_rad, roll, site.centre_m, frame,
        0.5 * taxel_pitch_m(recording.fingertip), MOST_BLOCKS, NODES, SHARES,
    )  # fmt: skip
    along, across, psi = rates.tolist()
    along_error, across_error = (hypot(error, SYSTEMATIC / radius) for error in errors[:2].tolist())
    steep = hypot(1.0, slope)
    tx, ty = (cosine - sine * slope) / steep, (sine + cosine * slope) / steep
    gx, gy = sine * across - cosine * along, -sine * along - cosine * across
    px, py = tx + radius * gx, ty + radius * gy  # the contact's way
    if px * tx + py * ty < SHARPEST:  # the contact stands still while the finger goes on
        px, py = SHARPEST * tx, SHARPEST * ty
    length = hypot(px, py)
    px, py = px / length, py / length
    return RollCurvature(
        samples=roll,
        direction_rad=atan2(py, px) % pi,
        curvature_per_m=(px * gx + py * gy) / length,
        standard_error_per_m=along_error / length**2,
        joint_curvature_per_m=(1 / radius - abs(psi) * abs(px * tx + py * ty) / length)
        if known
        else float("nan"),
        slip=_slip(radius * abs(psi)) if known else float("nan"),
        tangent=np.array([tx, ty]),
        bending_per_m=np.array([gx, gy]),
        bending_error_per_m=np.array([along_error, across_error]),
    )


def _slip(turn: float) -> float:
    """Share of the turn that was not rolled, from the turn in units of that of rolling on the spot."""
    return 1 - 1 / turn if turn > 0.1 else 0.0


def shape_operator(rolls: list[RollCurvature], radius_m: float) -> ShapeOperator | None:
    """Shape operator of a site, fitted over the directions of its rolls.

    Parameters
    ----------
    rolls : list of RollCurvature
        The rolls of one site.
    radius_m : float
        Radius a of the fingertip, metres.

    Returns
    -------
    ShapeOperator or None
        None if the rolls have one direction only: two curvatures can't be told from it.
    """
    if not rolls or spread_rad([roll.direction_rad for roll in rolls]) < NARROWEST_RAD:
        return None
    system, target = np.zeros((3, 3)), np.zeros(3)
    for roll in rolls:
        t, error = roll.tangent, roll.bending_error_per_m
        axes = np.stack([t, [-t[1], t[0]]])
        equations = axes @ np.array([[t[0], t[1], 0.0], [0.0, t[0], t[1]]]) / error[:, None]
        system += equations.T @ equations
        target += equations.T @ (axes @ roll.bending_per_m / error)
    xx, xy, yy = np.linalg.solve(system, target)
    misfit = sum(
        float(np.square(roll.bending_per_m - np.array([[xx, xy], [xy, yy]]) @ roll.tangent).sum())
        / float(np.square(roll.bending_error_per_m).sum())
        for roll in rolls
    ) / max(len(rolls) - 1.5, 0.5)
    covariance = np.linalg.inv(system) * max(misfit, 1.0)
    offset, axes = np.linalg.eigh(np.array([[xx, xy], [xy, yy]]))
    scale = np.maximum(1 + radius_m * offset, SHARPEST)
    k = offset / scale
    design = np.stack([axes[0] ** 2, 2 * axes[0] * axes[1], axes[1] ** 2], axis=1)
    error = np.sqrt(np.einsum("ij,jk,ik->i", design, covariance, design)) / scale**2
    direction = float(np.arctan2(axes[1, 1], axes[0, 1]) % np.pi)
    moved = _moved_down(np.array([[xx, xy], [xy, yy]]), radius_m)
    return ShapeOperator(
        float(k[1]), float(k[0]), float(error[1]), float(error[0]), direction, moved @ covariance @ moved.T
    )


def _moved_down(offset: NDArray[np.float64], radius_m: float) -> NDArray[np.float64]:
    """Derivative (3, 3) of S = S_c (I + a S_c)^-1 by S_c, both as k_xx, k_xy, k_yy: dS = M dS_c M."""
    values, axes = np.linalg.eigh(offset)
    m = axes @ np.diag(1 / np.maximum(1 + radius_m * values, SHARPEST)) @ axes.T
    (a, b), (_, c) = m
    return np.array([[a * a, 2 * a * b, b * b], [a * b, a * c + b * b, b * c], [b * b, 2 * b * c, c * c]])


def along(roll: RollCurvature, shape: ShapeOperator | None) -> RollCurvature:
    """A roll with the curvature that the shape operator of its site has along it.

    Parameters
    ----------
    roll : RollCurvature
        What the roll alone says.
    shape : ShapeOperator or None
        What all rolls of the site say together; None leaves the roll as it is.

    Returns
    -------
    RollCurvature
        With ``t S t`` and its standard error from the covariance of S.
    """
    if shape is None or shape.covariance is None:
        return roll
    k, error = shape.along(roll.direction_rad)
    return replace(roll, curvature_per_m=k, standard_error_per_m=error)


def spread_rad(directions_rad: list[float]) -> float:
    """Smallest angle that holds all directions, directions being lines.

    Parameters
    ----------
    directions_rad : list of float
        At least one direction.

    Returns
    -------
    float
        Radians, in [0, pi).
    """
    ordered = np.sort(np.array(directions_rad) % np.pi)
    gaps = np.diff(np.concatenate([ordered, ordered[:1] + np.pi]))
    return float(np.pi - gaps.max())
