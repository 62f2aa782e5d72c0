"""A patch of surface fitted to all contacts of a site at once (our own).

Each block of neighbouring samples says two things: how high the finger's centre was, which must be one radius
above the surface, and which way the surface faced, which the taxels say. The centre needs no taxels and the
normal needs no exact position, so the two are weighted by how far each of them scatters, and samples that
don't fit count less (Huber). The surface is a graph over its tangent plane: a shape operator, third and
fourth derivatives that stay small unless the data ask for them, and one scale for the contact's angle on the
finger, as a wide patch of pressure is cut off by the rim of the array. The residual of the normal is an angle
on the finger: an error of the contact on the array moves the contact's point and its normal together, and
this angle is what it changes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Blocks", "Patch", "fit_patch"]

Array = NDArray[np.float64]

HEIGHT_FLOOR = 1.3e-4
"""Smallest error of heights that all blocks of a roll share, over the finger's radius.

The press is steady to a fiftieth of its depth at best, and what is left changes slowly along a roll.
"""
ANGLE_FLOOR_RAD = 1e-4
"""Smallest scatter of normals that is believed."""
LONGEST_STEP = 2.0
"""Curvature changes by no more than so many times the finger's own in one step."""
SHARPEST_PER_M = 1000.0
"""Curvature beyond which its derivatives are not expected to grow."""
HUBER = 2.0
"""Residuals beyond so many standard deviations count less."""


@dataclass(frozen=True)
class Blocks:
    """Means over short pieces of the rolls of one site, in a frame of the site.

    Parameters
    ----------
    centre_m : ndarray of float64, shape (B, 3)
        Centre of the sphere that touches like the finger at the contact, metres.
    normal : ndarray of float64, shape (B, 3)
        Outward unit normal of the touched surface, from the taxels.
    radius_m : ndarray of float64, shape (B,)
        Radius of that sphere, metres.
    tilt : ndarray of float64, shape (B, 3)
        How the normal would change if the contact were further from the array's middle by its own distance.
    weight : ndarray of float64, shape (B,)
        Share of a full block, in (0, 1].
    roll : ndarray of int64, shape (B,)
        Number of the roll, not decreasing.
    scale_error : float
        Standard deviation of the relative scale of the contact's angle that the array leaves.
    spacing_error_rad : float
        Smallest scatter of normals that is believed, as the taxels' spacing leaves it, radians.
    """

    centre_m: Array
    normal: Array
    radius_m: Array
    tilt: Array
    weight: Array
    roll: NDArray[np.int64]
    scale_error: float
    spacing_error_rad: float = 0.0


@dataclass(frozen=True)
class Patch:
    """A fitted patch.

    Parameters
    ----------
    parameters : ndarray of float64, shape (16,)
        Height, two slopes, k_xx, k_xy, k_yy, four third and five fourth derivatives, scale of the angle.
    covariance : ndarray of float64, shape (16, 16)
        Their covariance.
    height_error_m, angle_error_rad : float
        Scatter of a full block.
    """

    parameters: Array
    covariance: Array
    height_error_m: float
    angle_error_rad: float


def fit_patch(blocks: Blocks, iterations: int = 10, start: Patch | None = None) -> Patch:
    """Fit a patch by Gauss-Newton steps with weights from the residuals.

    Parameters
    ----------
    blocks : Blocks
        What was measured.
    iterations : int
        At most so many steps.
    start : Patch, optional
        Where to start; by default from a linear law between centres and normals.

    Returns
    -------
    Patch
        In the frame of the blocks; NaN throughout where nothing can be fitted.
    """
    from evifuse.touch._kernels_patch import PARAMETERS, linearise, normal_step, what_is_left

    count, scale = len(blocks.weight), _scales(blocks.radius_m)
    reach = float(blocks.radius_m.mean())
    theta = _start(blocks) if start is None else start.parameters.copy()
    foot = blocks.centre_m[:, :2] - blocks.radius_m[:, None] * blocks.normal[:, :2]
    design, residual = np.zeros((count, 3, PARAMETERS)), np.zeros((count, 3))
    error = np.array([1e-2 * reach, 1e-2])
    if start is not None:
        error = np.array([start.height_error_m, start.angle_error_rad])
    weight = np.repeat(blocks.weight[:, None], 2, axis=1)
    covariance, change = np.eye(PARAMETERS), np.zeros(PARAMETERS)
    left, used = np.zeros((count, 3)), np.zeros(2)
    for step in range(iterations):
        linearise(
            theta, blocks.centre_m, blocks.normal, blocks.radius_m, blocks.tilt, foot, design, residual,
            8 if step == 0 else 2,
        )  # fmt: skip
        prior = _prior(theta, blocks.scale_error) / scale**2
        covariance, regular = normal_step(design, residual, weight, error, scale, prior, theta, change, used)
        if not regular:
            return Patch(
                np.full(PARAMETERS, np.nan), np.full((PARAMETERS, PARAMETERS), np.nan), *error.tolist()
            )
        bend = reach * float(np.abs(change[3:6] / scale[3:6]).max())
        change *= min(1.0, LONGEST_STEP / max(bend, 1e-12))
        theta = theta + change / scale
        what_is_left(design, residual, scale, change, left)
        before, error, weight = error, *_scatter(left, used, weight, blocks)
        settled = np.abs(change[3:6]).max() < 0.02 * np.sqrt(np.abs(np.diag(covariance)[3:6])).min()
        if step > 2 and settled and np.abs(np.log(error / before)).max() < 0.02:
            break
    return Patch(theta, covariance / np.outer(scale, scale), float(error[0]), float(error[1]))


def _scatter(left: Array, used: Array, weight: Array, blocks: Blocks) -> tuple[Array, Array]:
    """Scatter of heights and normals that is left, freed of the fit's share, and weights for the next fit."""
    from evifuse.touch._kernels_patch import scatter

    own, chain, robust, joints = scatter(left, used, weight, blocks.weight, blocks.roll, HUBER)
    own = own * np.sqrt((1 + chain) / (1 - chain))  # neighbours that err together say less
    own[1] = max(float(own[1]), blocks.spacing_error_rad)
    shared = np.sqrt((len(left) - 1) / (len(left) - joints))
    floor = np.array([HEIGHT_FLOOR * float(blocks.radius_m.mean()) * shared, ANGLE_FLOOR_RAD])
    return np.hypot(own, floor), robust


def _scales(radius_m: Array) -> Array:
    """Size (16,) that each parameter's effect has per unit at half a radius from the site."""
    reach = 0.4 * float(radius_m.mean())
    return reach ** np.array([0.0, *[1.0] * 2, *[2.0] * 3, *[3.0] * 4, *[4.0] * 5, 0.0])


def _prior(theta: Array, scale_error: float) -> Array:
    """Inverse variances (16,): derivatives of curvature are of the order of powers of the curvature."""
    k = min(max(float(np.abs(theta[[3, 5]]).max()), 3.0), SHARPEST_PER_M)
    widest = [0.0, 1.0, 1.0, *[1e-6] * 3]  # slopes below 1 and radii above 1 mm, in order of magnitude
    return np.concatenate([widest, [k**-4] * 4, [(3 * k**3) ** -2] * 5, [scale_error**-2]])


def _start(blocks: Blocks) -> Array:
    """First guess (16,): the surface of the centres, from their heights or from the normals over them.

    Whichever scatters less by what it means for the curvature.
    """
    root = np.sqrt(blocks.weight)[:, None]
    x, y, z = blocks.centre_m.T
    radius = float(blocks.radius_m.mean())
    flat = np.stack([np.ones_like(x), x, y], axis=1) * root
    ridge = len(root) * (0.01 * radius) ** 2 * np.diag([1e-9, 1.0, 1.0])  # across one way nothing is known
    target = -blocks.normal[:, :2] * root
    linear = np.linalg.solve(flat.T @ flat + ridge, flat.T @ target)
    slope, offset = linear[0], 0.5 * (linear[1:] + linear[1:].T)
    square = 0.5 * np.stack([x * x, 2 * x * y, y * y], axis=1) * root
    rows = np.concatenate([flat, square], axis=1) / radius ** np.array([0.0, 1.0, 1.0, 2.0, 2.0, 2.0])
    ridge = 1e-5 * len(root) * np.diag([0.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    bent = np.linalg.solve(rows.T @ rows + ridge, rows.T @ (z * root[:, 0]))
    reach = float(np.sqrt(np.average(x * x + y * y, weights=blocks.weight)))
    by_normals = float(np.std(target - flat @ linear))
    by_heights = 4 / reach * float(np.std(z * root[:, 0] - rows @ bent))
    if by_heights < by_normals:
        slope, offset = bent[1:3] / radius, bent[[[3, 4], [4, 5]]] / radius**2
    return _under(blocks, slope, offset)


def _under(blocks: Blocks, slope: Array, offset: Array) -> Array:
    """Parameters (16,) of the surface one radius below that of the centres, with its slope and curvature."""
    radius = float(blocks.radius_m.mean())
    values, axes = np.linalg.eigh(offset)
    k = np.maximum(values / np.maximum(1 + radius * values, 0.05), -5 / radius)
    (xx, xy), (_, yy) = axes @ np.diag(k) @ axes.T
    theta = np.zeros(16)
    theta[1:6] = *slope, xx, xy, yy
    steep = slope + blocks.centre_m[:, :2] @ offset
    upright = np.concatenate([-steep, np.ones((len(steep), 1))], axis=1)
    upright /= np.sqrt(1 + np.square(steep).sum(axis=1, keepdims=True))
    contact = blocks.centre_m - blocks.radius_m[:, None] * upright
    x, y = contact[:, 0], contact[:, 1]
    rise = theta[1] * x + theta[2] * y + 0.5 * (xx * x**2 + 2 * xy * x * y + yy * y**2)
    theta[0] = np.average(contact[:, 2] - rise, weights=blocks.weight)
    return theta
