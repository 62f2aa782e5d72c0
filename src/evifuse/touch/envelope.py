"""Where a finger of any form touches a patch of surface: what the pose alone says (our own).

Taxels that are far apart tell roughly where on the finger the contact is. But the finger's form is known, and
the surface is the envelope of all poses of a finger that rolls on it. So the contact is where the finger's
own surface comes closest to the patch that was fitted so far; then the patch is fitted again, in turns. An
error of the contact changes the finger's height over the patch in the second order only.
"""

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.rotation import rotate
from evifuse.touch.fingersurface import FingerSurface

__all__ = ["closest_contacts"]

Array = NDArray[np.float64]

LONGEST_STEP = 0.15
"""A contact moves by no more than this share of the finger's radius in one step."""
FLATTEST = 0.1
"""Smallest curvature of the finger against the surface, over the finger's own, that a step is divided by."""
STILL = 1e-6
"""Where no contact moves by more than this share of the finger's radius, the next step moves none."""


def closest_contacts(
    surface: FingerSurface,
    radius_m: float,
    theta: Array,
    pose: tuple[Array, Array],
    contact_m: Array,
    patch_frame: tuple[Array, Array],
    steps: int = 4,
) -> Array:
    """Points of a finger that come closest to a patch, by Newton's method.

    Parameters
    ----------
    surface : FingerSurface
        The finger's surface.
    radius_m : float
        Its nominal radius, metres.
    theta : ndarray of float64, shape (16,)
        Parameters of the patch, see `Patch`.
    pose : (ndarray of float64, shape (B, 3), ndarray of float64, shape (B, 4))
        Positions, metres, and orientations of the finger.
    contact_m : ndarray of float64, shape (B, 3)
        Where to start, fingertip frame, metres.
    patch_frame : (ndarray of float64, shape (3,), ndarray of float64, shape (3, 3))
        Origin of the patch, metres, and its axes in columns.
    steps : int
        How many steps.

    Returns
    -------
    ndarray of float64, shape (B, 3)
        Points of the finger's surface, fingertip frame, metres.
    """
    from evifuse.touch._kernels_patch import feet

    (position_m, orientation_xyzw), (origin_m, frame), count = pose, patch_frame, len(contact_m)
    height, normal, tensor = np.zeros(count), np.zeros((count, 3)), np.zeros((count, 3, 3))
    nearest, facing = surface.project(contact_m)
    foot = np.zeros((count, 2))
    for step in range(steps):
        operator, axes = surface.shape_operators(nearest)
        point = (position_m + rotate(orientation_xyzw, nearest) - origin_m) @ frame
        if step == 0:
            foot = point[:, :2].copy()
        feet(theta, point, foot, height, normal, tensor, 8 if step == 0 else 3)
        along = np.stack([rotate(orientation_xyzw, axes[:, :, k]) @ frame for k in range(2)], axis=2)
        apart = normal + rotate(orientation_xyzw, facing) @ frame
        wrong = np.einsum("bia,bi->ba", along, apart)
        against = operator - np.einsum("bia,bij,bjc->bac", along, tensor, along)
        values, ways = np.linalg.eigh(0.5 * (against + against.transpose(0, 2, 1)))
        values = np.maximum(values, FLATTEST / radius_m)
        move = -np.einsum("bij,bj->bi", ways, np.einsum("bij,bi->bj", ways, wrong) / values)
        length = np.linalg.norm(move, axis=1, keepdims=True)
        move = move * np.minimum(1.0, LONGEST_STEP * radius_m / np.maximum(length, 1e-12))
        nearest, facing = surface.project(nearest + np.einsum("bia,ba->bi", axes, move))
        if float(length.max(initial=0.0)) < STILL * radius_m:
            break
    return nearest
