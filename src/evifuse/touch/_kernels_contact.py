"""Inner loops over the samples of a recording, compiled by numba on first use and cached on disk.

Nothing outside `evifuse.touch` calls them. They give what their NumPy twins in the tests give.
"""

# numba finds the types itself
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUntypedFunctionDecorator=false
# pyright: reportUnknownVariableType=false, reportUnknownMemberType=false, reportUnknownArgumentType=false

import numba
import numpy as np

njit = numba.njit(cache=True, nogil=True, error_model="numpy")


@njit
def largest(row):
    """Largest of some numbers."""
    count = row.shape[0]
    a = b = c = d = row[0]  # four at a time, so that none waits for another
    whole = count - count % 4
    for j in range(0, whole, 4):
        p, q, r, s = row[j], row[j + 1], row[j + 2], row[j + 3]
        a = p if p > a else a
        b = q if q > b else b
        c = r if r > c else c
        d = s if s > d else d
    for j in range(whole, count):
        a = row[j] if row[j] > a else a
    return max(max(a, b), max(c, d))


@njit
def peaks(pressure, every):
    """Largest pressure of every so many of the samples (T, N), from the first on."""
    out = np.empty((pressure.shape[0] + every - 1) // every)
    for t in range(out.shape[0]):
        out[t] = largest(pressure[t * every])
    return out


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})
def weighted(row, threshold, areas, x, y, z):
    """Sums of areas, and of areas times normals, each times the squared pressure above the threshold."""
    total = p = q = r = 0.0
    for j in range(row.shape[0]):
        above = row[j] - threshold
        above = above if above > 0.0 else 0.0
        above *= above
        total += above * areas[j]
        p += above * x[j]
        q += above * y[j]
        r += above * z[j]
    return total, p, q, r


@njit
def contacts(pressure, threshold, weights):
    """Largest pressure (T,) of each sample, its taxel (T,), and the mean normal (T, 3) of the active taxels.

    They are weighted by area and squared pressure above the threshold; `weights` (4, N) are areas and areas
    times normals. Samples that don't exceed twice the threshold have zeros.
    """
    count = pressure.shape[0]
    peak, taxel, mean = np.empty(count), np.zeros(count, np.int64), np.zeros((count, 3))
    areas, x, y, z = weights[0], weights[1], weights[2], weights[3]
    for t in range(count):
        row = pressure[t]
        peak[t] = largest(row)
        if peak[t] > 2 * threshold:
            total, p, q, r = weighted(row, threshold, areas, x, y, z)
            mean[t, 0], mean[t, 1], mean[t, 2] = p / total, q / total, r / total
            for j in range(row.shape[0]):
                if row[j] == peak[t]:
                    taxel[t] = j
                    break
    return peak, taxel, mean


@njit
def to_unit(vectors):
    """Make vectors (M, 3) unit vectors in their place, and give their lengths (M,)."""
    length = np.empty(vectors.shape[0])
    for m in range(vectors.shape[0]):
        x, y, z = vectors[m]
        length[m] = np.sqrt(x * x + y * y + z * z)
        if length[m] > 0:
            vectors[m, 0], vectors[m, 1], vectors[m, 2] = x / length[m], y / length[m], z / length[m]
    return length


@njit
def turned(quaternions, rows, vectors):
    """Vectors (M, 3) turned by the quaternions (T, 4) of their rows."""
    out = np.empty_like(vectors)
    for m in range(rows.shape[0]):
        x, y, z, w = quaternions[rows[m]]
        a, b, c = vectors[m]
        p, q, r = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
        out[m, 0] = a + w * p + y * r - z * q
        out[m, 1] = b + w * q + z * p - x * r
        out[m, 2] = c + w * r + x * q - y * p
    return out


@njit
def placed(rows, contact, quaternions, position, radius):
    """Direction, outward normal and point (T, 3) of contacts (M, 3) in their rows; else zeros."""
    direction, normal, point = np.zeros(position.shape), np.zeros(position.shape), position.copy()
    facing = turned(quaternions, rows, contact)
    for m in range(rows.shape[0]):
        t = rows[m]
        for k in range(3):
            direction[t, k] = contact[m, k]
            normal[t, k] = -facing[m, k]
            point[t, k] = position[t, k] + radius * facing[m, k]
    return direction, normal, point


@njit
def match(pressure, rows, directions, positions, radius, reach, power, steps):
    """Best places (M, 3) of a profile A (1 - r^2 / reach^2)^power on a sphere, and the heights A (M,).

    Least squares by Gauss-Newton steps from the given unit directions. Only taxels within reach count, so
    nothing pulls the place towards the middle of an array that ends nearby.
    """
    place, height = directions.copy(), np.zeros(rows.shape[0])
    square = reach * reach
    for m in range(rows.shape[0]):
        ux, uy, uz = place[m]
        for _ in range(steps):
            if abs(ux) < 0.7:
                ax, ay, az = 1.0 - ux * ux, -ux * uy, -ux * uz
            else:
                ax, ay, az = -uy * ux, 1.0 - uy * uy, -uy * uz
            scale = 1.0 / np.sqrt(ax * ax + ay * ay + az * az)
            ax, ay, az = ax * scale, ay * scale, az * scale
            bx, by, bz = uy * az - uz * ay, uz * ax - ux * az, ux * ay - uy * ax
            ff = fg = fh = gg = gh = hh = fv = gv = hv = 0.0
            for j in range(positions.shape[0]):
                dx, dy = positions[j, 0] - radius * ux, positions[j, 1] - radius * uy
                dz = positions[j, 2] - radius * uz
                left = 1.0 - (dx * dx + dy * dy + dz * dz) / square
                if left > 0.0:
                    f = 1.0
                    for _k in range(power - 1):
                        f *= left
                    slope = f * power * 2.0 / square
                    f *= left
                    g, h = slope * (dx * ax + dy * ay + dz * az), slope * (dx * bx + dy * by + dz * bz)
                    v = pressure[rows[m], j]
                    ff, fg, fh = ff + f * f, fg + f * g, fh + f * h
                    gg, gh, hh = gg + g * g, gh + g * h, hh + h * h
                    fv, gv, hv = fv + f * v, gv + g * v, hv + h * v
            ridge = 4e-3 * ff / square
            if ff <= 0.0:
                height[m] = 0.0
                break
            gg, gh, hh = gg + ridge - fg * fg / ff, gh - fg * fh / ff, hh + ridge - fh * fh / ff
            gv, hv = gv - fg * fv / ff, hv - fh * fv / ff
            determinant = gg * hh - gh * gh
            s, t = (hh * gv - gh * hv) / determinant, (gg * hv - gh * gv) / determinant
            height[m] = (fv - fg * s - fh * t) / ff
            if not (height[m] > 0.0 and determinant > 0.0):
                height[m] = 0.0
                break
            s, t = s / height[m], t / height[m]
            length = np.sqrt(s * s + t * t)
            shrink = min(1.0, 0.5 * reach / max(length, 1e-12)) / radius
            ux, uy, uz = (
                ux + shrink * (ax * s + bx * t),
                uy + shrink * (ay * s + by * t),
                uz + shrink * (az * s + bz * t),
            )
            scale = 1.0 / np.sqrt(ux * ux + uy * uy + uz * uz)
            ux, uy, uz = ux * scale, uy * scale, uz * scale
            if length < 1e-3 * reach:
                break
        place[m, 0], place[m, 1], place[m, 2] = ux, uy, uz
    return place, height


@njit
def rings(positions, contact, pressure, count, furthest):
    """Taxels at equal steps from contacts (M, 3): number, sums of pressures and squared distances."""
    size, total, squares = np.zeros(count), np.zeros(count), np.zeros(count)
    for m in range(contact.shape[0]):
        for j in range(positions.shape[0]):
            dx, dy = positions[j, 0] - contact[m, 0], positions[j, 1] - contact[m, 1]
            dz = positions[j, 2] - contact[m, 2]
            square = dx * dx + dy * dy + dz * dz
            ring = int(np.sqrt(square) * (count / furthest))
            if ring < count:
                size[ring] += 1.0
                total[ring] += pressure[m, j]
                squares[ring] += square
    return size, total, squares


@njit
def held(directions, positions, radius, reach, power):
    """Share (M,) of a profile (1 - r^2 / reach^2)^power that lies on the array, and its slope (M, 3).

    The share is over the largest one; the slope is that of its logarithm along the sphere, 1/m.
    """
    count, square = directions.shape[0], reach * reach
    share, slope = np.zeros(count), np.zeros((count, 3))
    for m in range(count):
        ux, uy, uz = directions[m]
        total = x = y = z = 0.0
        for j in range(positions.shape[0]):
            dx, dy = positions[j, 0] - radius * ux, positions[j, 1] - radius * uy
            dz = positions[j, 2] - radius * uz
            left = 1.0 - (dx * dx + dy * dy + dz * dz) / square
            if left > 0.0:
                f = 1.0
                for _k in range(power - 1):
                    f *= left
                total += f * left
                f *= power * 2.0 / square
                x, y, z = x + f * dx, y + f * dy, z + f * dz
        if total > 0.0:
            inward = x * ux + y * uy + z * uz
            share[m] = total
            slope[m, 0] = (x - inward * ux) / total
            slope[m, 1] = (y - inward * uy) / total
            slope[m, 2] = (z - inward * uz) / total
    return share / max(share.max(), 1e-300), slope
