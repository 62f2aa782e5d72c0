"""What tells outlines of one shape from those of another, in numbers that a linear model can weigh."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.geometry import area, corner_angles, cross, side_lengths
from evifuse.vision.primitives import Agreement, Fits, Outlines
from evifuse.vision.primitives.agreement import MOST_TOLERANCES
from evifuse.vision.primitives.odds import LEAST_DEVIATION

__all__ = ["features_of"]

Column = NDArray[np.float64]

WINDOW = 3
"""The turn of an outline at a point is measured over so many points on either side, of 64 (our own)."""

GAP_STEPS = 2.5
"""Points further apart than so many usual steps have a gap between them (our own)."""

STRAIGHT_RAD = 0.2
"""An outline that turns less than this over the window runs straight (our own)."""

SECTIONS = (3, 4, 5, 6)
"""More straight sections than a primitive needs follow a shape that is none of them (our own)."""

HARMONICS = (3, 4, 5, 6)
"""Waves of so many periods about an ellipse: three of them a triangle leaves, four a rectangle (our own)."""


def features_of(fits: Fits, accounts: Mapping[str, Column], scale: float) -> dict[str, Column]:
    """Features of outlines by name (our own).

    Lengths are relative to the tolerance of the outline, so that size and noise of the picture don't matter;
    ratios are given by their logarithm.

    Parameters
    ----------
    fits : Fits
        Outlines, and the triangle, the quadrilateral and the ellipse fitted to each of B.
    accounts : mapping of str to ndarray of float64, shape (B,)
        Share of the strokes that each of them accounts for, by family, in (0, 1].
    scale : float
        Working pixels per pixel of the picture.

    Returns
    -------
    dict of str to ndarray of float64, shape (B,)
        Finite numbers.
    """
    outlines = fits.outlines
    three, four, ellipse = fits.triangle, fits.quadrilateral, fits.ellipse
    found: dict[str, Column] = {}
    for name, match in (
        ("triangle", three.match),
        ("quadrilateral", four.match),
        ("ellipse", ellipse.match),
    ):
        found |= {f"{name} {k}": v for k, v in _of_match(match, outlines.tolerance).items()}
        found[f"{name} account"] = _log(accounts[name], 0.05)
    polygons = {"triangle": three.corners, "quadrilateral": four.corners, "ellipse": ellipse.shape}
    inside = np.maximum(outlines.inside, 1e-9)
    for name, polygon in polygons.items():
        found[f"{name} area"] = _log(np.fmin(area(polygon), 4 * inside) / inside, 0.25)
    found |= _form(three.corners, four.corners, ellipse.axes)
    for count in SECTIONS:
        mean = fits.sections.cost[:, count - 1] / (outlines.points.shape[1] * outlines.tolerance**2)
        found[f"{count} sections"] = 0.5 * np.log(np.minimum(mean, MOST_TOLERANCES**2) + LEAST_DEVIATION**2)
    found |= _turns(outlines.points)
    step = np.median(np.linalg.norm(np.diff(outlines.points, axis=1), axis=-1), axis=1)
    found["length"] = _log(step * outlines.points.shape[1] / outlines.around, 0.1)
    found["solid"] = _log(area(outlines.points) / np.maximum(outlines.inside, 1e-9), 0.1)
    found |= _waves(outlines, np.column_stack([ellipse.centre, ellipse.axes, ellipse.angle_rad]))
    found["width"] = np.log(outlines.width / scale)
    found["compact"] = _log(4 * np.pi * outlines.inside / outlines.around**2, 0.02)
    return dict(zip(found, np.nan_to_num(np.stack(list(found.values()))), strict=True))


def _log(values: Column, least: float) -> Column:
    return np.log(np.fmax(values, least))  # the least where there is no number


def _of_match(match: Agreement, tolerance: Column) -> dict[str, Column]:
    """How well a fitted shape and the outline agree."""
    return {
        "deviation": np.log(np.hypot(match.deviation / tolerance, LEAST_DEVIATION)),
        "unbroken": _log(match.unbroken, 0.1),
        "coverage": _log(match.coverage, 0.1),
        "explained": _log(match.explained, 0.1),
    }


def _form(three: Column, four: Column, axes: Column) -> dict[str, Column]:
    """How pointed, skew or long the fitted shapes are."""
    sides = side_lengths(four)
    ratios = np.minimum(sides[:, :2], sides[:, 2:]) / np.maximum(sides[:, :2], sides[:, 2:])
    return {
        "triangle pointed": _log(np.sin(corner_angles(three)).min(axis=1), 0.05),
        "quadrilateral ratio": _log(ratios.min(axis=1), 0.05),
        "quadrilateral skew": _log(np.sin(corner_angles(four)).prod(axis=1), 0.05),
        "ellipse ratio": _log(axes[:, 1] / axes[:, 0], 0.05),
    }


def _turns(points: Column) -> dict[str, Column]:
    """Where along an outline it turns: at corners, everywhere alike, or back."""
    step = np.roll(points, -1, axis=1) - points
    length = np.hypot(step[..., 0], step[..., 1])
    usual = np.median(length, axis=1, keepdims=True)
    gap = length > GAP_STEPS * np.maximum(usual, 1e-9)
    before = points - np.roll(points, WINDOW, axis=1)
    after = np.roll(points, -WINDOW, axis=1) - points
    turn = np.arctan2(cross(before, after), (before * after).sum(axis=-1))
    crossed = np.logical_or.reduce(_shifted(gap, -WINDOW + 1, WINDOW))
    turn = np.where(crossed, 0.0, turn)
    turn *= np.where(turn.sum(axis=1) < 0, -1.0, 1.0)[:, None]
    seen = np.maximum((~crossed).sum(axis=1), 1)
    total = np.maximum(np.abs(turn).sum(axis=1), 1e-9)
    around = np.maximum.reduce(_shifted(turn, -WINDOW - 1, WINDOW + 1))
    peaks = np.sort(np.where(turn >= around, turn, 0.0), axis=1)[:, ::-1]
    return {
        "straight": ((np.abs(turn) < STRAIGHT_RAD) & ~crossed).sum(axis=1) / seen,
        "backwards": np.abs(np.minimum(turn, 0)).sum(axis=1) / total,
        "evenness": _log(total**2 / ((turn**2).sum(axis=1) * seen + 1e-9), 0.02),
        "gaps": gap.sum(axis=1).astype(np.float64).clip(0, 8) / 8,
        "hidden": 1 - seen / points.shape[1],
        **{f"corner {k + 1}": peaks[:, k] for k in range(5)},
    }


def _shifted(values: NDArray[Any], first: int, last: int) -> list[NDArray[Any]]:
    """Values (B, N) around closed outlines, by all steps from the first to the last, as `numpy.roll`."""
    count, most = values.shape[1], max(-first, last)
    around = np.concatenate([values[:, count - most :], values, values[:, :most]], axis=1)
    return [around[:, most - k : most - k + count] for k in range(first, last + 1)]


def _waves(outlines: Outlines, ellipses: Column) -> dict[str, Column]:
    """Amplitude of waves of several periods that an outline makes about its ellipse."""
    c, s = np.cos(ellipses[:, 4, None]), np.sin(ellipses[:, 4, None])
    offset = outlines.points - ellipses[:, None, :2]
    x = (c * offset[..., 0] + s * offset[..., 1]) / (ellipses[:, None, 2] / 2)
    y = (c * offset[..., 1] - s * offset[..., 0]) / (ellipses[:, None, 3] / 2)
    gauge = np.hypot(x, y)
    away = np.clip(np.nan_to_num(gauge - 1), -1, 1)
    turn = (np.nan_to_num(x) + 1j * np.nan_to_num(y)) / np.fmax(gauge, 1e-12)  # on the unit circle
    found: dict[str, Column] = {}
    wave = away.astype(np.complex128)
    for k in range(1, max(HARMONICS) + 1):
        wave = wave * turn
        if k in HARMONICS:
            found[f"{k} waves"] = np.log(np.abs(wave.mean(axis=1)) + 0.01)
    return found
