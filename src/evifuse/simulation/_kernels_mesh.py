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
def _outside(place: float, cell: float) -> float:
    """Square of the way to an interval from 0 to a cell's side."""
    beside = max(-place, place - cell, 0.0)
    return beside * beside


@_jit
def _closest_sample(grid: Any, x: float, y: float, z: float, hint: int) -> int:
    """Number of the nearest sample: in all cells that may hold a nearer one than a sample near by (hint).

    Of some that are as near it is the first, whatever the hint.
    """
    box, first, places, _ = grid
    cell = box[3]
    wide, deep, high = int(box[4]), int(box[5]), int(box[6])
    px, py, pz = x - box[0], y - box[1], z - box[2]
    found, q = hint, places[hint]
    best = (x - q[0]) ** 2 + (y - q[1]) ** 2 + (z - q[2]) ** 2
    if (
        best > 0.04 * cell * cell
        and 0 <= px < wide * cell
        and 0 <= py < deep * cell
        and 0 <= pz < high * cell
    ):
        at = (int(px / cell) * deep + int(py / cell)) * high + int(pz / cell)
        for s in range(first[at], first[at + 1]):
            q = places[s]
            best = min(best, (x - q[0]) ** 2 + (y - q[1]) ** 2 + (z - q[2]) ** 2)
    best = best * (1 + 1e-9) + 1e-30
    far = math.sqrt(best)
    start_j, stop_j = max(int((py - far) / cell), 0), min(int((py + far) / cell), deep - 1)
    start_k, stop_k = max(int((pz - far) / cell), 0), min(int((pz + far) / cell), high - 1)
    for a in range(max(int((px - far) / cell), 0), min(int((px + far) / cell), wide - 1) + 1):
        aside_x = (1 - 1e-9) * _outside(px - a * cell, cell)
        if aside_x >= best:
            continue
        for b in range(start_j, stop_j + 1):
            aside_xy = aside_x + (1 - 1e-9) * _outside(py - b * cell, cell)
            if aside_xy >= best:
                continue
            row = (a * deep + b) * high
            for c in range(start_k, stop_k + 1):
                begin, end = first[row + c], first[row + c + 1]
                if begin == end or aside_xy + (1 - 1e-9) * _outside(pz - c * cell, cell) >= best:
                    continue
                for s in range(begin, end):
                    dx, dy, dz = places[s, 0] - x, places[s, 1] - y, places[s, 2] - z
                    square = dx * dx + dy * dy + dz * dz
                    if square < best:
                        best, found = square, s
    return found


@_jit
def _value(grid: Any, near: int, x: float, y: float, z: float) -> Any:
    """Blended height over the quadrics (MPU implicits, Ohtake 2003), and its gradient."""
    box, first, places, table = grid
    cell = box[3]
    wide, deep, high = int(box[4]), int(box[5]), int(box[6])
    px, py, pz = x - box[0], y - box[1], z - box[2]
    i, j, k = int(px / cell), int(py / cell), int(pz / cell)
    low_k, high_k = max(k - 1, 0), min(k + 1, high - 1) + 1
    total, value = 0.0, 0.0
    gx = gy = gz = wx = wy = wz = 0.0
    ax, ay, az = table[near, 0], table[near, 1], table[near, 2]
    far = cell * cell
    per = 1.0 / far
    for a in range(max(i - 1, 0), min(i + 1, wide - 1) + 1):
        aside_x = _outside(px - a * cell, cell)
        for b in range(max(j - 1, 0), min(j + 1, deep - 1) + 1):
            if aside_x + _outside(py - b * cell, cell) >= far:
                continue
            row = (a * deep + b) * high
            for s in range(first[row + low_k], first[row + high_k]):
                dx, dy, dz = x - places[s, 0], y - places[s, 1], z - places[s, 2]
                rest = 1.0 - (dx * dx + dy * dy + dz * dz) * per
                if rest <= 0.0:
                    continue
                q = table[s]
                if q[0] * ax + q[1] * ay + q[2] * az <= 0.0:
                    continue  # the other side of a thin wall
                ux = q[3] + q[6] * dx + q[7] * dy + q[8] * dz
                uy = q[4] + q[7] * dx + q[9] * dy + q[10] * dz
                uz = q[5] + q[8] * dx + q[10] * dy + q[11] * dz
                over = q[12] + 0.5 * ((q[3] + ux) * dx + (q[4] + uy) * dy + (q[5] + uz) * dz)
                w = rest * rest * rest
                slope = -8.0 * per * w
                w *= rest
                total += w
                value += w * over
                tilt = slope * over
                gx += w * ux + tilt * dx
                gy += w * uy + tilt * dy
                gz += w * uz + tilt * dz
                wx += slope * dx
                wy += slope * dy
                wz += slope * dz
    if total <= 0.0:
        return math.nan, 0.0, 0.0, 0.0
    value /= total
    return value, (gx - value * wx) / total, (gy - value * wy) / total, (gz - value * wz) / total


@_jit
def _newton(grid: Any, x: float, y: float, z: float, near: int, near_enough: float) -> Any:
    """Foot and normal of a point, with the curvature of the nearest sample."""
    box, _, places, table = grid
    reach = box[3]
    q = table[near]
    nx, ny, nz = q[0], q[1], q[2]
    fx, fy, fz = places[near, 0], places[near, 1], places[near, 2]
    if (x - fx) ** 2 + (y - fy) ** 2 + (z - fz) ** 2 < 0.25 * reach * reach:
        fx, fy, fz = x, y, z
    for step in range(30):
        if step % 8 == 7:
            near = _closest_sample(grid, fx, fy, fz, near)
        value, gx, gy, gz = _value(grid, near, fx, fy, fz)
        if math.isnan(value):
            break
        size = math.sqrt(gx * gx + gy * gy + gz * gz)
        nx, ny, nz = gx / size, gy / size, gz / size
        rise = -value / size
        away = (x - fx) * nx + (y - fy) * ny + (z - fz) * nz
        rx, ry, rz = x - fx - away * nx, y - fy - away * ny, z - fz - away * nz
        q = table[near]
        ru = q[13] * rx + q[14] * ry + q[15] * rz
        rv = q[16] * rx + q[17] * ry + q[18] * rz
        # (I - d S) t = r in the axes of the sample
        d = min(max(away, -0.02), 0.05)
        p, o, r = 1 - 2 * d * q[19], -d * q[20], 1 - 2 * d * q[21]
        determinant = p * r - o * o
        if determinant < 0.1 or p + r < 0.5:
            p, o, r, determinant = 1.0, 0.0, 1.0, 1.0
        u, v = (r * ru - o * rv) / determinant, (p * rv - o * ru) / determinant
        length = math.sqrt(u * u + v * v)
        cut = min(1.0, reach / max(length, 1e-300))
        if step >= 10:
            cut *= 0.5
        tx, ty, tz = u * q[13] + v * q[16], u * q[14] + v * q[17], u * q[15] + v * q[18]
        # keep the step in the tangent plane of the blended surface
        up = rise - cut * (tx * nx + ty * ny + tz * nz)
        fx, fy, fz = fx + cut * tx + up * nx, fy + cut * ty + up * ny, fz + cut * tz + up * nz
        if abs(rise) + cut * length < near_enough:
            break
    return fx, fy, fz, nx, ny, nz


@_jit
def nearest_one(grid: Any, last: Any, x: float, y: float, z: float) -> Any:
    """Nearest point of the blended surface and its normal; the last nearest sample shortens the search."""
    last[0] = _closest_sample(grid, x, y, z, last[0])
    return _newton(grid, x, y, z, last[0], 1e-9)


@_jit
def nearest_many(grid: Any, last: Any, points: Any) -> Any:
    """Nearest points and normals of many points."""
    feet, normals = np.empty_like(points), np.empty_like(points)
    for i in range(len(points)):
        found = nearest_one(grid, last, points[i, 0], points[i, 1], points[i, 2])
        feet[i, 0], feet[i, 1], feet[i, 2] = found[0], found[1], found[2]
        normals[i, 0], normals[i, 1], normals[i, 2] = found[3], found[4], found[5]
    return feet, normals


@_jit
def distance_many(grid: Any, points: Any) -> Any:
    """Signed distances of many points: one step of Newton's method tells those of a pressed skin."""
    box, _, places, _ = grid
    wide = box[3] * box[3]
    away = np.empty(len(points))
    near, square = 0, 0.0
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        for search in range(2):  # the sample of the point before is often near enough
            if search and square < 0.16 * wide:
                break
            if search:
                near = _closest_sample(grid, x, y, z, near)
            square = (x - places[near, 0]) ** 2 + (y - places[near, 1]) ** 2 + (z - places[near, 2]) ** 2
        first = math.nan
        if square < 0.25 * wide:
            value, gx, gy, gz = _value(grid, near, x, y, z)
            first = value / math.sqrt(gx * gx + gy * gy + gz * gz)
        if abs(first) < SHALLOW_M:
            away[i] = first
            continue
        # the error of a distance is the square of the foot's, so a micrometre is enough
        near = _closest_sample(grid, x, y, z, near)
        fx, fy, fz, nx, ny, nz = _newton(grid, x, y, z, near, 1e-6)
        away[i] = (x - fx) * nx + (y - fy) * ny + (z - fz) * nz
    return away
