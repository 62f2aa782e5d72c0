"""The shape operator of a site from all its rolls at once (our own)."""

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import TouchRecording
from evifuse.touch.blocks import directions_of, pieces_of, site_frame, spacing_error_rad
from evifuse.touch.contact import ContactTrack
from evifuse.touch.curvature import NARROWEST_RAD, ShapeOperator, spread_rad
from evifuse.touch.fingersurface import SphereSurface, surface_of
from evifuse.touch.fingertip import taxel_pitch_m
from evifuse.touch.patch import Blocks, Patch, fit_patch
from evifuse.touch.profile import press_depth_m, pressure_profile
from evifuse.touch.sites import ContactSite
from evifuse.touch.thin import thin_shape

__all__ = ["operator_of_patch", "site_shape"]

Array = NDArray[np.float64]

THIN = 2.5
"""A dome that is more curved than so many fingertips is no graph over a plane."""


def site_shape(recording: TouchRecording, track: ContactTrack, site: ContactSite) -> ShapeOperator | None:
    """Shape operator of a touched site.

    Parameters
    ----------
    recording : TouchRecording
        T samples.
    track : ContactTrack
        Its contact.
    site : ContactSite
        The site and its rolls.

    Returns
    -------
    ShapeOperator or None
        None if the rolls have one direction only, so that two curvatures can't be told from it, or if no
        patch can be fitted to what was felt.
    """
    tip = recording.fingertip
    if not site.rolls or spread_rad(directions_of(recording, site)) < NARROWEST_RAD:
        return None
    patch = fit_patch(_blocks(recording, track, site))
    xx, _, yy = patch.parameters[3:6]
    if not min(xx, yy) > -THIN / tip.radius_m:  # or nothing fits
        thin = thin_shape(recording, track, site)
        if thin is not None or not np.isfinite(patch.parameters).all():
            return thin
    samples = np.concatenate(site.rolls)[:: max(1, sum(map(len, site.rolls)) // 200)]
    profile = pressure_profile(
        tip,
        recording.pressure_pa[samples],
        tip.radius_m * track.direction[samples],
        max(4 * taxel_pitch_m(tip), 0.6 * tip.radius_m),
    )
    shape = operator_of_patch(
        patch, *press_depth_m(profile, tip.radius_m, 0.5 * float(xx + yy), taxel_pitch_m(tip))
    )
    return shape if np.isfinite([shape.k1_error_per_m, shape.k2_error_per_m]).all() else None


def operator_of_patch(patch: Patch, depth_m: float, depth_error_m: float) -> ShapeOperator:
    """Shape operator at the origin of a patch, freed of the depth to which the finger was pressed in.

    The finger's sphere touches where it would without being pressed in, so the patch lies below the surface
    by the press depth d: ``S = S_patch (I - d S_patch)^-1``.

    Parameters
    ----------
    patch : Patch
        A fitted patch.
    depth_m, depth_error_m : float
        Press depth and its standard error, metres.

    Returns
    -------
    ShapeOperator
        In the axes of the patch.
    """
    xx, xy, yy = patch.parameters[3:6]
    below = np.array([[xx, xy], [xy, yy]])
    values, axes = np.linalg.eigh(below)
    scale = np.maximum(1 - depth_m * values, 0.1)
    k = values / scale
    square = below @ below
    shift = np.array([square[0, 0], square[0, 1], square[1, 1]]) * depth_error_m
    covariance = patch.covariance[3:6, 3:6] + np.outer(shift, shift)
    design = np.stack([axes[0] ** 2, 2 * axes[0] * axes[1], axes[1] ** 2], axis=1)
    error = np.sqrt(np.einsum("ij,jk,ik->i", design, covariance, design)) / scale
    direction = float(np.arctan2(axes[1, 1], axes[0, 1]) % np.pi)
    return ShapeOperator(float(k[1]), float(k[0]), float(error[1]), float(error[0]), direction, covariance)


def _blocks(recording: TouchRecording, track: ContactTrack, site: ContactSite) -> Blocks:
    """Means over short pieces of all rolls, in the frame of the site."""
    tip = recording.fingertip
    origin, frame = site_frame(site, tip.radius_m)
    pieces = pieces_of(recording, _felt(recording, track, site), site)
    rows = pieces.means
    normal = rows[:, 3:6] / np.linalg.norm(rows[:, 3:6], axis=1, keepdims=True)
    return Blocks(
        centre_m=(rows[:, :3] - origin) @ frame,
        normal=normal @ frame,
        radius_m=np.full(len(rows), tip.radius_m),
        tilt=(normal + rows[:, 6:9]) @ frame,
        weight=pieces.share,
        roll=pieces.roll,
        scale_error=track.scale_error,
        spacing_error_rad=spacing_error_rad(recording, track, site),
    )


def _felt(recording: TouchRecording, track: ContactTrack, site: ContactSite) -> Array:
    """Normals (T, 3) as the taxels alone say; those of the track are smooth where the finger is no sphere."""
    from evifuse.touch._kernels_contact import turned

    if isinstance(surface_of(recording.fingertip), SphereSurface):
        return track.normal
    samples, normal = np.concatenate(site.rolls), track.normal.copy()
    normal[samples] = -turned(recording.orientation_xyzw, samples, track.direction[samples])
    return normal
