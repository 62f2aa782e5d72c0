"""Where an edge crosses short lines across it, to a small fraction of a pixel."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["REACH_PX", "crossings", "known_median"]

LARGEST_SIDE_PX = 32_000
"""OpenCV samples pictures of up to so many pixels on a side; in larger ones nothing is found."""

STEP_PX = 0.5
"""Profiles are sampled at such steps, px."""

SMOOTHING_PX = 0.8
"""Standard deviation of the Gaussian whose derivative finds the edge in a profile, px (our own)."""

REACH_STEPS = 5
"""An edge is looked for within so many steps on either side (our own)."""

REACH_PX = STEP_PX * REACH_STEPS
"""The same in pixels."""

NEAR_STEPS = 3.0
"""Of several edges in reach the nearer is preferred, by a Gaussian of so many steps (our own)."""

KERNEL_STEPS = 4
"""The kernel reaches so many steps to either side."""

LEAST_CONTRAST = 2.0
"""Of a step of fewer grey levels no place is told (our own)."""

LEAST_STRENGTH = 0.35
"""An edge of a smaller share of the median contrast of its group is not taken for the same edge (our own)."""

PER_ROW = 1024
"""Samples are taken from the picture in rows of so many."""

MOST_ROWS = 16_384
"""And in tables of at most so many rows: OpenCV can't fill larger ones."""


def crossings(
    picture: NDArray[np.uint8], places: NDArray[np.float64], normals: NDArray[np.float64], unit_px: float
) -> NDArray[np.float64]:
    """How far from each place, along its normal, the edge is.

    The edge is where the smoothed gradient of the profile is largest, by a parabola through the logarithms of
    three samples, which is exact for the profile of a blurred step. In colour, the gradient is taken along
    the direction of colours in which a group of places changes most (Di Zenzo, 1986), so that red on green of
    the same brightness has an edge too. The sign of the change is the same in all of a group.

    Parameters
    ----------
    picture : ndarray of uint8, shape (H, W) or (H, W, 3)
        Grey or BGR.
    places : ndarray of float64, shape (G, M, 2)
        Groups of places on one edge each, (x, y), px; pixel centres are whole numbers.
    normals : ndarray of float64, shape (G, M, 2)
        Unit vectors across the edge, all to the same side.
    unit_px : float
        All lengths of this module count in it, px; above 1 where a reduced copy was looked at.

    Returns
    -------
    ndarray of float64, shape (G, M)
        Along the normal, px; NaN where there is no such edge.
    """
    if max(picture.shape[:2]) > LARGEST_SIDE_PX or not len(places):
        return np.full(places.shape[:2], np.nan)
    gradient = _gradients(picture, places, normals, unit_px)
    steps = np.arange(-REACH_STEPS, REACH_STEPS + 1)
    near = np.exp(-0.5 * (steps / NEAR_STEPS) ** 2)
    by_group = (gradient * np.sqrt(near)).transpose(1, 0, 2, 3).reshape(len(places), len(gradient), -1)
    colour = np.linalg.eigh(by_group @ np.swapaxes(by_group, 1, 2))[1][..., -1]
    change = np.sum([g * c[:, None, None] for g, c in zip(gradient, colour.T, strict=True)], axis=0)
    change *= np.where((change.sum(axis=1) @ near) < 0, -1.0, 1.0)[:, None, None]
    before, at, after = change[..., :-2], change[..., 1:-1], change[..., 2:]
    peak = (at >= before) & (at > after) & (at > LEAST_CONTRAST)
    best = np.where(peak, at * near[1:-1], 0.0).argmax(axis=-1)[..., None]
    there = np.take_along_axis(peak, best, axis=-1)[..., 0]
    before, at, after = (np.take_along_axis(v, best, axis=-1)[..., 0] for v in (before, at, after))
    strength = np.where(there, at, np.nan)
    there &= at >= LEAST_STRENGTH * known_median(strength)[:, None]
    offset = (best[..., 0] - REACH_STEPS + 1 + _top(before, at, after)) * (STEP_PX * unit_px)
    return np.where(there, offset, np.nan)


def _gradients(
    picture: NDArray[np.uint8], places: NDArray[np.float64], normals: NDArray[np.float64], unit_px: float
) -> NDArray[np.float64]:
    """Smoothed change of each colour along the normals, shape (C, G, M, 11)."""
    import cv2

    half = REACH_STEPS + KERNEL_STEPS
    along = (np.arange(-half, half + 1) * (STEP_PX * unit_px)).astype(np.float32)
    start, step = (v.reshape(-1, 2).T.astype(np.float32) for v in (places, normals))
    count = start.shape[1]
    rows = -(-count * len(along) // PER_ROW)
    at = np.zeros((2, rows * PER_ROW), np.float32)
    at[:, : count * len(along)] = (start[..., None] + step[..., None] * along).reshape(2, -1)
    x, y = at.reshape(2, rows, PER_ROW)
    parts = [
        cv2.remap(picture, x[i:j], y[i:j], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        for i, j in ((i, i + MOST_ROWS) for i in range(0, rows, MOST_ROWS))
    ]
    channels = 1 if picture.ndim == 2 else picture.shape[2]
    profiles = np.concatenate(parts).reshape(-1, channels)[: count * len(along)]
    profiles = np.ascontiguousarray(profiles.T, np.float32).reshape(channels * count, len(along))
    kernel = np.arange(-KERNEL_STEPS, KERNEL_STEPS + 1) * (STEP_PX / SMOOTHING_PX)
    kernel *= np.exp(-0.5 * kernel**2)
    kernel /= kernel[kernel > 0].sum()
    slide = np.zeros((len(along), 2 * REACH_STEPS + 1), np.float32)
    for q in range(2 * REACH_STEPS + 1):
        slide[q : q + len(kernel), q] = kernel
    return (profiles @ slide).reshape(channels, *places.shape[:2], -1).astype(np.float64)


def known_median(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Median along the last dimension of what is not NaN.

    Parameters
    ----------
    values : ndarray of float64, shape (G, M)
        Numbers; NaN for what is not known.

    Returns
    -------
    ndarray of float64, shape (G,)
        Infinite where nothing is known.
    """
    ordered = np.sort(np.where(np.isnan(values), np.inf, values), axis=-1)
    count = np.count_nonzero(np.isfinite(ordered), axis=-1)
    low, high = np.maximum(count - 1, 0) // 2, np.minimum(count // 2, values.shape[-1] - 1)
    row = np.arange(len(values))
    return np.where(count > 0, (ordered[row, low] + ordered[row, high]) / 2, np.inf)


def _top(
    before: NDArray[np.float64], at: NDArray[np.float64], after: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Where between its neighbours a peak is highest, in steps, in [-0.5, 0.5]."""
    level = np.maximum(at, 1e-9)
    a, b = (np.log(np.clip(v / level, 0.02, 1.0)) for v in (before, after))
    return np.clip(0.5 * (a - b) / np.minimum(a + b, -1e-9), -0.5, 0.5)
