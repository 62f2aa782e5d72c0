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

HEIGHT_FLOOR = 1e-4
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
    from evifuse.touch._kernels_fit import fit
    from evifuse.touch._kernels_patch import PARAMETERS

    theta, error = np.zeros(PARAMETERS), np.zeros(2)
    if start is not None:
        theta, error = start.parameters, np.array([start.height_error_m, start.angle_error_rad])
    theta, covariance, error = fit(
        blocks.centre_m, blocks.normal, blocks.radius_m, blocks.tilt, blocks.weight, blocks.roll,
        float(blocks.scale_error), float(blocks.spacing_error_rad), iterations, start is not None, theta,
        error, (HEIGHT_FLOOR, ANGLE_FLOOR_RAD, LONGEST_STEP, SHARPEST_PER_M, HUBER),
    )  # fmt: skip
    return Patch(theta, covariance, *error.tolist())
