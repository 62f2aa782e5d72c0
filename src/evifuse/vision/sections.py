"""The straight sections that account best for the points of an outline, found by dynamic programming."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.geometry import cross, fit_line

__all__ = ["Sections", "straight_sections"]

CELLS = 32
"""A section starts and ends where one of so many equal parts of the outline does (our own)."""


LEAST_TRIMMED = 6
"""A section of so many points is fitted without its first and its last (our own)."""

KEPT = 0.9
"""A line is fitted to this share of its points, the nearest ones (our own)."""


@dataclass(frozen=True, eq=False)
class Sections:
    """Straight sections of many outlines, the same number of each.

    Parameters
    ----------
    starts, ends : ndarray of float64, shape (B, K, 2)
        End points of each section in order along the outline, on the line fitted to its points, px.
    centres, directions : ndarray of float64, shape (B, K, 2)
        A point of each line, px, and its unit direction.
    cost : ndarray of float64, shape (B,)
        Squared distances of the points from their sections, and the price of those left out, square px.
    """

    starts: NDArray[np.float64]
    ends: NDArray[np.float64]
    centres: NDArray[np.float64]
    directions: NDArray[np.float64]
    cost: NDArray[np.float64]


def straight_sections(
    points: NDArray[np.float64], price: NDArray[np.float64], most: int
) -> dict[int, Sections]:
    """Divide outlines into straight sections so that their points stray least (our own).

    The best division by total squared distance, found exactly over all divisions at the bounds of 32 equal
    parts. Points may be left out - the round of a corner, a hook, the end of a stroke - at a fixed price
    each.

    Parameters
    ----------
    points : ndarray of float64, shape (B, N, 2)
        Points at equal steps along what is seen of each outline, px; N is a multiple of 32.
    price : ndarray of float64, shape (B,)
        What leaving out one point costs, square px.
    most : int
        Divisions into 1 to so many sections are found.

    Returns
    -------
    dict of int to Sections
        By the number of sections.
    """
    per_cell = points.shape[1] // CELLS
    left_out = price[:, None] * per_cell * np.arange(CELLS + 1)
    lines = _costs_of_lines(points, per_cell)
    every = np.arange(len(points))
    cost = left_out
    steps: list[tuple[NDArray[np.intp], NDArray[np.intp]]] = []
    found: dict[int, Sections] = {}
    for count in range(1, most + 1):
        cost, start, end = _one_more(cost, lines, left_out)
        steps.append((start, end))
        bounds = np.empty((len(points), count, 2), np.intp)
        at = np.full(len(points), CELLS)
        for k in range(count - 1, -1, -1):
            start, end = steps[k]
            bounds[:, k, 1] = end[every, at]
            at = start[every, bounds[:, k, 1]]
            bounds[:, k, 0] = at
        found[count] = _fitted(points, bounds * per_cell, cost[:, -1])
    return found


def _costs_of_lines(points: NDArray[np.float64], per_cell: int) -> NDArray[np.float64]:
    """Squared distances of the points of cells i to j from their best line, shape (B, 32, 32)."""
    offset = points - points.mean(axis=1, keepdims=True)
    x, y = offset[..., 0], offset[..., 1]
    moments = np.stack([x, y, x * x, x * y, y * y]).reshape(5, len(points), CELLS, per_cell).sum(axis=-1)
    sums = np.zeros((5, len(points), CELLS + 1))
    np.cumsum(moments, axis=2, out=sums[:, :, 1:])
    x, y, xx, xy, yy = sums[:, :, None, 1:] - sums[:, :, :-1, None]
    place = np.arange(CELLS)
    longer = place[None, :] - place[:, None]
    count = per_cell * np.maximum(longer + 1, 1)
    xx, xy, yy = xx - x * x / count, xy - x * y / count, yy - y * y / count
    cost = 0.5 * (xx + yy - np.sqrt((xx - yy) ** 2 + 4 * xy * xy))
    return np.where(longer >= 1, np.maximum(cost, 0.0), np.inf)


def _one_more(
    cost: NDArray[np.float64], lines: NDArray[np.float64], left_out: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.intp], NDArray[np.intp]]:
    """Least cost of the first n cells with one section more, and where that section starts and ends."""
    total = cost[:, :-1, None] + lines
    start = total.argmin(axis=1)
    least = np.take_along_axis(total, start[:, None], axis=1)[:, 0] - left_out[:, 1:]
    ending = np.pad(least, ((0, 0), (1, 0)), constant_values=np.inf)
    best = np.minimum.accumulate(ending, axis=1)
    end = np.maximum.accumulate(np.where(ending <= best, np.arange(CELLS + 1), 0), axis=1)
    return best + left_out, np.pad(start, ((0, 0), (1, 0))), end


def _fitted(points: NDArray[np.float64], bounds: NDArray[np.intp], cost: NDArray[np.float64]) -> Sections:
    """Lines through the points from the first to before the second bound of each section.

    The points next to a bound, which may lie on the round of a corner, and then the farthest tenth are left
    out.
    """
    place = np.arange(points.shape[1])
    rim = np.where(bounds[..., 1:] - bounds[..., :1] >= LEAST_TRIMMED, 1, 0)
    mine = (place >= bounds[..., :1] + rim) & (place < bounds[..., 1:] - rim)
    centre, direction = fit_line(points[:, None], mine.astype(np.float64))
    away = np.abs(cross(points[:, None] - centre[:, :, None], direction[:, :, None]))
    count = mine.sum(axis=-1, keepdims=True)
    rank = np.maximum(np.ceil(KEPT * count).astype(np.intp) - 1, 0)
    limit = np.take_along_axis(np.sort(np.where(mine, away, np.inf), axis=-1), rank, axis=-1)
    centre, direction = fit_line(points[:, None], (mine & (away <= limit)).astype(np.float64))
    first = np.take_along_axis(points, np.minimum(bounds[..., 0], len(place) - 1)[..., None], axis=1)
    last = np.take_along_axis(points, np.maximum(bounds[..., 1] - 1, 0)[..., None], axis=1)
    backwards = ((last - first) * direction).sum(axis=-1, keepdims=True) < 0
    direction = np.where(backwards, -direction, direction)
    start = centre + direction * ((first - centre) * direction).sum(axis=-1, keepdims=True)
    end = centre + direction * ((last - centre) * direction).sum(axis=-1, keepdims=True)
    return Sections(start, end, centre, direction, cost)
