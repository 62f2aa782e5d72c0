"""Inner loops of a surface of blended quadrics, compiled by numba on first use and cached on disk."""

import math
from typing import Any

import numba
import numpy as np

__all__ = ["distance_many", "nearest_many", "nearest_one"]

SHALLOW_M = 0.4e-3
"""Up to here the blended height over its gradient's length is the distance, to a tenth of a micrometre."""
_jit: Any = numba.njit(cache=True, fastmath=False, error_model="numpy")


@_jit
def _closest_sample(grid: Any, x: float, y: float, z: float) -> int:
    """Number of the nearest sample, ring by ring of cells around the point."""
    low, cell, shape, first, order, samples = grid
    i, j, k = int((x - low[0]) / cell), int((y - low[1]) / cell), int((z - low[2]) / cell)
    i, j, k = (min(max(i, 0), shape[0] - 1), min(max(j, 0), shape[1] - 1), min(max(k, 0), shape[2] - 1))
    best, found, ring = 1e300, -1, 0
    # what a point outside of the grid is away from its cell
    gap = 0.0
    for value, start, count in ((x, low[0], shape[0]), (y, low[1], shape[1]), (z, low[2], shape[2])):
        gap = max(gap, max(start - value, value - start - count * cell))
    while ring < 512:
        for a in range(max(i - ring, 0), min(i + ring, shape[0] - 1) + 1):
            for b in range(max(j - ring, 0), min(j + ring, shape[1] - 1) + 1):
                inner = abs(a - i) < ring and abs(b - j) < ring
                for c in range(max(k - ring, 0), min(k + ring, shape[2] - 1) + 1):
                    if inner and abs(c - k) < ring:
                        continue
                    at = (a * shape[1] + b) * shape[2] + c
                    for place in range(first[at], first[at + 1]):
                        s = order[place]
                        dx, dy, dz = samples[s, 0] - x, samples[s, 1] - y, samples[s, 2] - z
                        square = dx * dx + dy * dy + dz * dz
                        if square < best:
                            best, found = square, s
        ring += 1
        if found >= 0 and math.sqrt(best) <= max((ring - 1) * cell, gap):
            break
        if found >= 0 and ring * cell > math.sqrt(best) + cell:
            break
    return found


@_jit
def _outside(place: float, cell: float) -> float:
    """Square of the way to an interval from 0 to a cell's side."""
    beside = max(-place, place - cell, 0.0)
    return beside * beside


@_jit
def _value(grid: Any, frames: Any, heights: Any, reach: float, near: int, y: Any, out: Any) -> float:
    """Blended height over the quadrics (MPU implicits, Ohtake 2003); its gradient goes into out."""
    low, cell, shape, first, order, samples = grid
    i, j, k = int((y[0] - low[0]) / cell), int((y[1] - low[1]) / cell), int((y[2] - low[2]) / cell)
    total, value = 0.0, 0.0
    gx = gy = gz = wx = wy = wz = 0.0
    ax, ay, az = frames[near, 2, 0], frames[near, 2, 1], frames[near, 2, 2]
    far = reach * reach
    for a in range(max(i - 1, 0), min(i + 1, shape[0] - 1) + 1):
        aside_x = _outside(y[0] - low[0] - a * cell, cell)
        for b in range(max(j - 1, 0), min(j + 1, shape[1] - 1) + 1):
            aside_xy = aside_x + _outside(y[1] - low[1] - b * cell, cell)
            for c in range(max(k - 1, 0), min(k + 1, shape[2] - 1) + 1):
                if aside_xy + _outside(y[2] - low[2] - c * cell, cell) >= far:
                    continue
                at = (a * shape[1] + b) * shape[2] + c
                for place in range(first[at], first[at + 1]):
                    s = order[place]
                    dx, dy, dz = y[0] - samples[s, 0], y[1] - samples[s, 1], y[2] - samples[s, 2]
                    rest = 1.0 - (dx * dx + dy * dy + dz * dz) / (reach * reach)
                    if rest <= 0.0:
                        continue
                    f = frames[s]
                    if f[2, 0] * ax + f[2, 1] * ay + f[2, 2] * az <= 0.0:
                        continue  # the other side of a thin wall
                    u = f[0, 0] * dx + f[0, 1] * dy + f[0, 2] * dz
                    v = f[1, 0] * dx + f[1, 1] * dy + f[1, 2] * dz
                    h = f[2, 0] * dx + f[2, 1] * dy + f[2, 2] * dz
                    q = heights[s]
                    su = q[1] + 2 * q[3] * u + q[4] * v
                    sv = q[2] + q[4] * u + 2 * q[5] * v
                    over = h - (q[0] + q[1] * u + q[2] * v + q[3] * u * u + q[4] * u * v + q[5] * v * v)
                    w = rest * rest * rest * rest
                    slope = -8.0 * rest * rest * rest / (reach * reach)
                    total += w
                    value += w * over
                    gx += w * (f[2, 0] - su * f[0, 0] - sv * f[1, 0]) + slope * dx * over
                    gy += w * (f[2, 1] - su * f[0, 1] - sv * f[1, 1]) + slope * dy * over
                    gz += w * (f[2, 2] - su * f[0, 2] - sv * f[1, 2]) + slope * dz * over
                    wx += slope * dx
                    wy += slope * dy
                    wz += slope * dz
    if total <= 0.0:
        return math.nan
    value /= total
    out[0] = (gx - value * wx) / total
    out[1] = (gy - value * wy) / total
    out[2] = (gz - value * wz) / total
    return value


@_jit
def nearest_one(
    grid: Any, frames: Any, heights: Any, reach: float, x: Any, foot: Any, normal: Any, near_enough: float
) -> None:
    """Nearest point of the blended surface: Newton's method with the curvature of the nearest sample."""
    samples = grid[5]
    near = _closest_sample(grid, x[0], x[1], x[2])
    square = 0.0
    for axis in range(3):
        square += (x[axis] - samples[near, axis]) ** 2
    for axis in range(3):
        foot[axis] = x[axis] if square < 0.25 * reach * reach else samples[near, axis]
        normal[axis] = frames[near, 2, axis]
    gradient = np.empty(3)
    for step in range(30):
        if step % 8 == 7:
            near = _closest_sample(grid, foot[0], foot[1], foot[2])
        value = _value(grid, frames, heights, reach, near, foot, gradient)
        if math.isnan(value):
            break
        size = math.sqrt(gradient[0] ** 2 + gradient[1] ** 2 + gradient[2] ** 2)
        for axis in range(3):
            normal[axis] = gradient[axis] / size
        rise = -value / size
        away = 0.0
        for axis in range(3):
            away += (x[axis] - foot[axis]) * normal[axis]
        f, q = frames[near], heights[near]
        ru = rv = 0.0
        for axis in range(3):
            aside = x[axis] - foot[axis] - away * normal[axis]
            ru += f[0, axis] * aside
            rv += f[1, axis] * aside
        # (I - d S) t = r in the axes of the sample
        d = min(max(away, -0.02), 0.05)
        p, o, r = 1 - 2 * d * q[3], -d * q[4], 1 - 2 * d * q[5]
        determinant = p * r - o * o
        if determinant < 0.1 or p + r < 0.5:
            p, o, r, determinant = 1.0, 0.0, 1.0, 1.0
        u, v = (r * ru - o * rv) / determinant, (p * rv - o * ru) / determinant
        length = math.sqrt(u * u + v * v)
        cut = (
            min(1.0, reach / max(length, 1e-300))
            if step < 10
            else 0.5 * min(1.0, reach / max(length, 1e-300))
        )
        moved = abs(rise) + cut * length
        for axis in range(3):
            tangential = u * f[0, axis] + v * f[1, axis]
            foot[axis] += cut * tangential
        # keep the step in the tangent plane of the blended surface
        off = 0.0
        for axis in range(3):
            off += cut * (u * f[0, axis] + v * f[1, axis]) * normal[axis]
        for axis in range(3):
            foot[axis] += (rise - off) * normal[axis]
        if moved < near_enough:
            break


@_jit
def nearest_many(grid: Any, frames: Any, heights: Any, reach: float, points: Any) -> Any:
    """Nearest points and normals of many points."""
    feet, normals = np.empty_like(points), np.empty_like(points)
    for i in range(len(points)):
        nearest_one(grid, frames, heights, reach, points[i], feet[i], normals[i], 1e-9)
    return feet, normals


@_jit
def distance_many(grid: Any, frames: Any, heights: Any, reach: float, points: Any) -> Any:
    """Signed distances of many points: one step of Newton's method tells those of a pressed skin."""
    samples = grid[5]
    away, foot, normal, gradient = np.empty(len(points)), np.empty(3), np.empty(3), np.empty(3)
    near, square = 0, 0.0
    for i in range(len(points)):
        x = points[i]
        for search in range(2):  # the sample of the point before is often near enough
            if search and square < 0.16 * reach * reach:
                break
            if search:
                near = _closest_sample(grid, x[0], x[1], x[2])
            square = 0.0
            for axis in range(3):
                square += (x[axis] - samples[near, axis]) ** 2
        first = math.nan
        if square < 0.25 * reach * reach:
            value = _value(grid, frames, heights, reach, near, x, gradient)
            first = value / math.sqrt(gradient[0] ** 2 + gradient[1] ** 2 + gradient[2] ** 2)
        if abs(first) < SHALLOW_M:
            away[i] = first
            continue
        # the error of a distance is the square of the foot's, so a micrometre is enough
        nearest_one(grid, frames, heights, reach, x, foot, normal, 1e-6)
        away[i] = 0.0
        for axis in range(3):
            away[i] += (x[axis] - foot[axis]) * normal[axis]
    return away
