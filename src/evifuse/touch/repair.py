"""What silent taxels would have read: from the taxels around them (our own)."""

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import Fingertip
from evifuse.touch.fingertip import taxel_pitch_m
from evifuse.touch.quadrics import tangent_axes
from evifuse.touch.remembered import per_fingertip

__all__ = ["opposite_pairs", "repair_weights"]

WITHIN = 2.3
"""Taxels further away than so many pitches say nothing about one."""
STRAIGHT = -0.9
"""Two taxels are on opposite sides of one when the cosine of the angle between them is less."""
AROUND = 24
"""Nearest taxels that pairs are made of, at most."""
USED = 10
"""Taxels that a silent one is filled in from."""

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def opposite_pairs(
    fingertip: Fingertip, middle: NDArray[np.bool_], beside: NDArray[np.bool_]
) -> tuple[Indices, Indices, Indices]:
    """Pairs of taxels on opposite sides of a taxel.

    Parameters
    ----------
    fingertip : Fingertip
        Geometry of the fingertip, N taxels.
    middle : ndarray of bool, shape (N,)
        Taxels that pairs are looked for around.
    beside : ndarray of bool, shape (N,)
        Taxels that may be one of a pair.

    Returns
    -------
    taxel, first, second : ndarray of int64, shape (P,)
        The taxel in the middle, in increasing order, and the two beside it.
    """
    taxel, first, second = _pairs(fingertip)
    kept = middle[taxel] & beside[first] & beside[second]
    return taxel[kept], first[kept], second[kept]


@per_fingertip
def _pairs(fingertip: Fingertip) -> tuple[Indices, Indices, Indices]:
    """Pairs of taxels on opposite sides of every taxel, as `opposite_pairs` gives them."""
    positions, reach = fingertip.positions_m, WITHIN * taxel_pitch_m(fingertip)
    away = positions - positions[:, None]
    size = np.sqrt(np.square(away).sum(axis=2))
    size[size == 0] = np.inf  # a taxel is not beside itself
    nearest = np.argsort(size, axis=1)[:, :AROUND]
    size = np.take_along_axis(size, nearest, axis=1)
    unit = np.take_along_axis(away, nearest[:, :, None], axis=1) / size[:, :, None]
    near = size < reach
    opposite = np.triu(unit @ unit.transpose(0, 2, 1) < STRAIGHT) & near[:, :, None] & near[:, None, :]
    i, a, b = np.nonzero(opposite)
    return i, nearest[i, a], nearest[i, b]


def repair_weights(fingertip: Fingertip, silent: NDArray[np.bool_]) -> Array:
    """Matrix that fills silent taxels in from the others.

    A quadratic in the tangent plane through the nearest sound taxels, nearer ones counting more: exact for a
    paraboloid, which the middle of a patch is. At the rim of the array a plane or a mean has to do.

    Parameters
    ----------
    fingertip : Fingertip
        Geometry of the fingertip, N taxels.
    silent : ndarray of bool, shape (N,)
        Taxels whose readings are not to be used.

    Returns
    -------
    ndarray of float64, shape (N, N)
        ``pressure @ weights`` are the pressures with silent taxels filled in; negative ones mean 0.
    """
    weights = np.diag((~silent).astype(np.float64))
    sound = np.flatnonzero(~silent)
    if not len(sound):
        return weights
    positions, pitch = fingertip.positions_m, taxel_pitch_m(fingertip)
    axes = tangent_axes(fingertip.normals)
    for i in np.flatnonzero(silent):
        away = positions[sound] - positions[i]
        size = np.linalg.norm(away, axis=1)
        used = np.argsort(size, kind="stable")[:USED]
        u, v = (away[used] @ axes[i] / pitch).T
        near = np.exp(-0.5 * np.square(size[used] / pitch))
        rows = np.stack([np.ones(len(u)), u, v, u * u, u * v, v * v], axis=1) * near[:, None]
        ridge = np.diag([1e-9, 1e-4, 1e-4, 3e-4, 3e-4, 3e-4])
        weights[sound[used], i] = np.linalg.solve(rows.T @ rows + ridge, rows.T * near)[0]
    return weights
