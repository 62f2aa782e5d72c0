"""Inner loops over the quadrics of a blended surface, compiled by numba on first use and cached on disk.

Nothing outside `evifuse.touch.blended` calls them. They give what their NumPy twins in the tests give.
"""

# numba finds the types itself
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUntypedFunctionDecorator=false
# pyright: reportUnknownVariableType=false, reportUnknownMemberType=false, reportUnknownArgumentType=false

import numba
import numpy as np

FAINTEST = 30.0
"""Weights below the exponential of minus this count as this, against the largest: 1e-13."""
NEXT = 0.2
"""A point nearer than so many widths to the one before starts from what was found there."""

njit = numba.njit(cache=True, nogil=True, error_model="numpy")


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})
def blend(x, y, z, table, width, weight):
    """Value and gradient of the blend at a point; ``weight`` (N,) is worked in.

    Rows of the table (13, N): places, constant, linear and quadratic terms (xx, xy, xz, yy, yz, zz) of the
    quadrics. The exponential is a power of 1024 of a series, so that many are taken at once.
    """
    count = table.shape[1]
    least = np.inf
    for j in range(count):
        a, b, c = x - table[0, j], y - table[1, j], z - table[2, j]
        weight[j] = a * a + b * b + c * c
        least = weight[j] if weight[j] < least else least
    scale = -0.5 / (width * width * 1024)
    for j in range(count):
        u = (weight[j] - least) * scale
        u = u if u > -FAINTEST / 1024 else -FAINTEST / 1024
        e = 1 + u * (1 + u * (1 / 2 + u * (1 / 6 + u * (1 / 24 + u * (1 / 120 + u * (1 / 720 + u / 5040))))))
        e *= e
        e *= e
        e *= e
        e *= e
        e *= e
        e *= e
        e *= e
        e *= e
        e *= e
        weight[j] = e * e
    total = value = gx = gy = gz = px = py = pz = vx = vy = vz = 0.0
    for j in range(count):
        w = weight[j]
        a = table[7, j] * x + table[8, j] * y + table[9, j] * z
        b = table[8, j] * x + table[10, j] * y + table[11, j] * z
        c = table[9, j] * x + table[11, j] * y + table[12, j] * z
        p, q, r = table[4, j], table[5, j], table[6, j]
        own = w * (table[3, j] + x * (0.5 * a + p) + y * (0.5 * b + q) + z * (0.5 * c + r))
        total += w
        value += own
        gx += w * (a + p)
        gy += w * (b + q)
        gz += w * (c + r)
        px += w * table[0, j]
        py += w * table[1, j]
        pz += w * table[2, j]
        vx += own * table[0, j]
        vy += own * table[1, j]
        vz += own * table[2, j]
    value /= total
    square = width * width
    gx = (gx + (vx - value * px) / square) / total
    gy = (gy + (vy - value * py) / square) / total
    gz = (gz + (vz - value * pz) / square) / total
    return value, gx, gy, gz


@njit
def gradients(points, table, width):
    """Gradients (M, 3) of the blend at points (M, 3)."""
    out, weight = np.empty_like(points), np.empty(table.shape[1])
    for m in range(points.shape[0]):
        _, out[m, 0], out[m, 1], out[m, 2] = blend(
            points[m, 0], points[m, 1], points[m, 2], table, width, weight
        )
    return out


@njit
def nearest(points, table, width, steps, close):
    """Nearest points (M, 3) of the surface, and outward unit normals (M, 3)."""
    found, normal, weight = np.empty_like(points), np.empty_like(points), np.empty(table.shape[1])
    for m in range(points.shape[0]):
        px, py, pz = points[m, 0], points[m, 1], points[m, 2]
        x, y, z = px, py, pz
        if m:
            ax, ay, az = px - points[m - 1, 0], py - points[m - 1, 1], pz - points[m - 1, 2]
            if ax * ax + ay * ay + az * az < (NEXT * width) ** 2:
                x, y, z = found[m - 1, 0] + ax, found[m - 1, 1] + ay, found[m - 1, 2] + az
        value, gx, gy, gz = blend(x, y, z, table, width, weight)
        for _ in range(steps):
            size = gx * gx + gy * gy + gz * gz
            ax, ay, az = px - x, py - y, pz - z
            along = (ax * gx + ay * gy + az * gz + value) / size
            ax, ay, az = ax - along * gx, ay - along * gy, az - along * gz
            x, y, z = x + ax, y + ay, z + az
            value, gx, gy, gz = blend(x, y, z, table, width, weight)
            if ax * ax + ay * ay + az * az < (close * width) ** 2:
                break
        size = np.sqrt(gx * gx + gy * gy + gz * gz)
        found[m, 0], found[m, 1], found[m, 2] = x, y, z
        normal[m, 0], normal[m, 1], normal[m, 2] = gx / size, gy / size, gz / size
    return found, normal
