"""Inner loop of the fit of a patch of surface, compiled by numba on first use and cached on disk.

Nothing outside `evifuse.touch.patch` calls it.
"""

# numba finds the types itself
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUntypedFunctionDecorator=false
# pyright: reportUnknownVariableType=false, reportUnknownMemberType=false, reportUnknownArgumentType=false

import numba
import numpy as np

from evifuse.touch._kernels_rolls import solve

PARAMETERS = 16
"""Height, two slopes, three curvatures, four third and five fourth derivatives, scale of the contact."""
FLATTEST = 0.05
"""Smallest squared cosine of the surface's slope."""

njit = numba.njit(cache=True, nogil=True, error_model="numpy")


@njit
def _round(xx, xy, yy, x, y):
    """Height and gradient of the surface that keeps its curvature: exact for a sphere and a cylinder."""
    px, py = xx * x + xy * y, xy * x + yy * y
    q = px * x + py * y
    s = np.sqrt(max(1.0 - px * px - py * py, FLATTEST))
    o = 1.0 + s
    f, g = 2.0 / o, q / (o * o * s)
    return q / o, f * px + g * (xx * px + xy * py), f * py + g * (xy * px + yy * py)


@njit
def _gradient(theta, x, y):
    """Gradient of the surface."""
    _, gx, gy = _round(theta[3], theta[4], theta[5], x, y)
    x2, y2, xy = x * x, y * y, x * y
    gx += theta[1] + theta[6] * x2 / 2 + theta[7] * xy + theta[8] * y2 / 2
    gx += theta[10] * x2 * x / 6 + theta[11] * x2 * y / 2 + theta[12] * x * y2 / 2 + theta[13] * y2 * y / 6
    gy += theta[2] + theta[7] * x2 / 2 + theta[8] * xy + theta[9] * y2 / 2
    gy += theta[11] * x2 * x / 6 + theta[12] * x2 * y / 2 + theta[13] * x * y2 / 2 + theta[14] * y2 * y / 6
    return gx, gy


@njit
def _hessian(theta, x, y, gx, gy):
    """Second derivatives of the surface, by differences."""
    e = 1e-7
    ax, ay = _gradient(theta, x + e, y)
    bx, by = _gradient(theta, x, y + e)
    return (ax - gx) / e, 0.5 * ((ay - gy) + (bx - gx)) / e, (by - gy) / e


@njit
def _basis(theta, x, y, value, dx, dy):
    """Derivatives of height and gradient by the first 15 parameters."""
    x2, y2, xy = x * x, y * y, x * y
    value[0], dx[0], dy[0] = 1.0, 0.0, 0.0
    value[1], dx[1], dy[1] = x, 1.0, 0.0
    value[2], dx[2], dy[2] = y, 0.0, 1.0
    h, gx, gy = _round(theta[3], theta[4], theta[5], x, y)
    e = 1e-4
    h1, gx1, gy1 = _round(theta[3] + e, theta[4], theta[5], x, y)
    value[3], dx[3], dy[3] = (h1 - h) / e, (gx1 - gx) / e, (gy1 - gy) / e
    h1, gx1, gy1 = _round(theta[3], theta[4] + e, theta[5], x, y)
    value[4], dx[4], dy[4] = (h1 - h) / e, (gx1 - gx) / e, (gy1 - gy) / e
    h1, gx1, gy1 = _round(theta[3], theta[4], theta[5] + e, x, y)
    value[5], dx[5], dy[5] = (h1 - h) / e, (gx1 - gx) / e, (gy1 - gy) / e
    value[6], dx[6], dy[6] = x2 * x / 6, x2 / 2, 0.0
    value[7], dx[7], dy[7] = x2 * y / 2, xy, x2 / 2
    value[8], dx[8], dy[8] = x * y2 / 2, y2 / 2, xy
    value[9], dx[9], dy[9] = y2 * y / 6, 0.0, y2 / 2
    value[10], dx[10], dy[10] = x2 * x2 / 24, x2 * x / 6, 0.0
    value[11], dx[11], dy[11] = x2 * xy / 6, x2 * y / 2, x2 * x / 6
    value[12], dx[12], dy[12] = x2 * y2 / 4, x * y2 / 2, x2 * y / 2
    value[13], dx[13], dy[13] = xy * y2 / 6, y2 * y / 6, x * y2 / 2
    value[14], dx[14], dy[14] = y2 * y2 / 24, 0.0, y2 * y / 6
    polynomial = 0.0
    for k in range(6, 15):
        polynomial += theta[k] * value[k]
    return h + theta[0] + theta[1] * x + theta[2] * y + polynomial


@njit
def _height(theta, x, y):
    """Height of the surface."""
    h, _, _ = _round(theta[3], theta[4], theta[5], x, y)
    x2, y2, xy = x * x, y * y, x * y
    cubic = theta[6] * x2 * x / 6 + theta[7] * x2 * y / 2 + theta[8] * x * y2 / 2 + theta[9] * y2 * y / 6
    cubic += theta[10] * x2 * x2 / 24 + theta[11] * x2 * xy / 6 + theta[12] * x2 * y2 / 4
    cubic += theta[13] * xy * y2 / 6 + theta[14] * y2 * y2 / 24
    return h + theta[0] + theta[1] * x + theta[2] * y + cubic


@njit
def _foot(theta, cx, cy, cz, x, y, steps):
    """Foot (x, y) of the perpendicular from a point, by Newton's method."""
    for _ in range(steps):
        h = _height(theta, x, y)
        gx, gy = _gradient(theta, x, y)
        hxx, hxy, hyy = _hessian(theta, x, y, gx, gy)
        d = cz - h
        fx, fy = cx - x + d * gx, cy - y + d * gy
        a, b, c = 1.0 - d * hxx + gx * gx, -d * hxy + gx * gy, 1.0 - d * hyy + gy * gy
        determinant = a * c - b * b
        if determinant < 0.02:
            x, y = x + 0.3 * fx, y + 0.3 * fy
            continue
        mx, my = (c * fx - b * fy) / determinant, (a * fy - b * fx) / determinant
        length = np.sqrt(mx * mx + my * my)
        scale = min(1.0, 1e-3 / max(length, 1e-12))
        x, y = x + scale * mx, y + scale * my
        if length < 1e-8:
            break
    return x, y


@njit
def linearise(theta, centre, normal, radius, tilt, foot, design, residual, steps):
    """Residuals of blocks (B,) against a patch, and their derivatives.

    ``design`` (B, 3, 16) and ``residual`` (B, 3) are filled: height above the patch in metres, and the two
    components of the normal in radians. ``foot`` (B, 2) holds where each contact is, and is improved.
    """
    value, dx, dy = np.zeros(15), np.zeros(15), np.zeros(15)
    for i in range(centre.shape[0]):
        cx, cy, cz, rho = centre[i, 0], centre[i, 1], centre[i, 2], radius[i]
        x, y = _foot(theta, cx, cy, cz, foot[i, 0], foot[i, 1], steps)
        foot[i, 0], foot[i, 1] = x, y
        h = _basis(theta, x, y, value, dx, dy)
        gx, gy = _gradient(theta, x, y)
        hxx, hxy, hyy = _hessian(theta, x, y, gx, gy)
        s = np.sqrt(1.0 + gx * gx + gy * gy)
        nx, ny, nz = -gx / s, -gy / s, 1.0 / s
        a, b, c = 1.0 - nx * nx / (1.0 + nz), -nx * ny / (1.0 + nz), 1.0 - ny * ny / (1.0 + nz)
        # shape operator in the axes (a, b, -nx), (b, c, -ny) of the tangent plane
        ux, uy, vx, vy = a * hxx + b * hxy, a * hxy + b * hyy, b * hxx + c * hxy, b * hxy + c * hyy
        kxx, kxy, kyy = (ux * a + uy * b) / s, (ux * b + uy * c) / s, (vx * b + vy * c) / s
        # a change of slope moves the foot as well: (1 - rho S)^-1
        p, q, r = 1.0 - rho * kxx, -rho * kxy, 1.0 - rho * kyy
        determinant = p * r - q * q
        if determinant < 0.01:
            p, q, r, determinant = 1.0, 0.0, 1.0, 1.0
        wxx, wxy, wyy = r / determinant, -q / determinant, p / determinant
        ox, oy, oz = normal[i, 0] - nx, normal[i, 1] - ny, normal[i, 2] - nz
        residual[i, 0] = (cx - x) * nx + (cy - y) * ny + (cz - h) * nz - rho
        residual[i, 1] = a * ox + b * oy - nx * oz
        residual[i, 2] = b * ox + c * oy - ny * oz
        mxx, mxy = (wxx * a + wxy * b) / s, (wxx * b + wxy * c) / s
        myx, myy = (wxy * a + wyy * b) / s, (wxy * b + wyy * c) / s
        for k in range(15):
            design[i, 0, k] = value[k] / s
            design[i, 1, k] = -(mxx * dx[k] + mxy * dy[k])
            design[i, 2, k] = -(myx * dx[k] + myy * dy[k])
        tx, ty, tz = tilt[i, 0], tilt[i, 1], tilt[i, 2]
        design[i, 0, 15] = 0.0
        design[i, 1, 15] = a * tx + b * ty - nx * tz
        design[i, 2, 15] = b * tx + c * ty - ny * tz
        residual[i, 1] -= theta[15] * design[i, 1, 15]
        residual[i, 2] -= theta[15] * design[i, 2, 15]


@njit
def normal_step(design, residual, weight, error, scale, prior, theta, change, used):
    """One step of weighted least squares: covariance (16, 16) of the scaled parameters, and if there is one.

    The ``change`` (16,) of the scaled parameters, and what the fit has ``used`` (2,) of the freedom of
    heights and of normals are filled. ``weight`` (B, 2) and ``error`` (2,) are those of heights and normals;
    ``prior`` (16,) are inverse variances of the scaled parameters.
    """
    count = design.shape[0]
    gram = np.zeros((2, PARAMETERS, PARAMETERS))
    target = np.empty((PARAMETERS, 1))
    row = np.empty(PARAMETERS)
    for k in range(PARAMETERS):
        target[k, 0] = -prior[k] * scale[k] * theta[k]
    for i in range(count):
        for c in range(3):
            kind = 0 if c == 0 else 1
            size = np.sqrt(weight[i, kind]) / error[kind]
            b = residual[i, c] * size
            for k in range(PARAMETERS):
                row[k] = design[i, c, k] / scale[k] * size
                target[k, 0] += row[k] * b
            for k in range(PARAMETERS):
                for m in range(k + 1):
                    gram[kind, k, m] += row[k] * row[m]
    covariance = np.empty((PARAMETERS, PARAMETERS))
    for k in range(PARAMETERS):
        for m in range(k + 1):
            gram[0, m, k], gram[1, m, k] = gram[0, k, m], gram[1, k, m]
            covariance[k, m] = covariance[m, k] = gram[0, k, m] + gram[1, k, m]
        covariance[k, k] += prior[k]
    regular = solve(covariance, target, 0.0)
    used[0] = used[1] = 0.0
    for k in range(PARAMETERS):
        change[k] = target[k, 0]
        for m in range(PARAMETERS):
            used[0] += covariance[k, m] * gram[0, k, m]
            used[1] += covariance[k, m] * gram[1, k, m]
    return covariance, regular


@njit
def what_is_left(design, residual, scale, change, left):
    """Residuals (B, 3) that are ``left`` after a change (16,) of the scaled parameters."""
    for i in range(design.shape[0]):
        for c in range(3):
            value = residual[i, c]
            for k in range(PARAMETERS):
                value -= design[i, c, k] / scale[k] * change[k]
            left[i, c] = value


@njit
def feet(theta, points, foot, height, normal, tensor, steps):
    """Feet of points (B, 3) on a patch: height (B,) above it, outward normal (B, 3), curvature (B, 3, 3).

    ``foot`` (B, 2) holds where each foot is, and is improved. A step dx along the patch turns its normal by
    ``-tensor dx``.
    """
    value, dx, dy = np.zeros(15), np.zeros(15), np.zeros(15)
    e = np.empty((2, 3))
    for i in range(points.shape[0]):
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        x, y = _foot(theta, px, py, pz, foot[i, 0], foot[i, 1], steps)
        foot[i, 0], foot[i, 1] = x, y
        h = _basis(theta, x, y, value, dx, dy)
        gx, gy = _gradient(theta, x, y)
        hxx, hxy, hyy = _hessian(theta, x, y, gx, gy)
        s = np.sqrt(1.0 + gx * gx + gy * gy)
        nx, ny, nz = -gx / s, -gy / s, 1.0 / s
        height[i] = (px - x) * nx + (py - y) * ny + (pz - h) * nz
        normal[i, 0], normal[i, 1], normal[i, 2] = nx, ny, nz
        e[0, 0], e[0, 1], e[0, 2] = 1.0 - nx * nx, -nx * ny, -nx * nz
        e[1, 0], e[1, 1], e[1, 2] = -nx * ny, 1.0 - ny * ny, -ny * nz
        for j in range(3):
            for k in range(3):
                tensor[i, j, k] = (
                    e[0, j] * hxx * e[0, k]
                    + e[0, j] * hxy * e[1, k]
                    + e[1, j] * hxy * e[0, k]
                    + e[1, j] * hyy * e[1, k]
                ) / s


@njit
def scatter(left, used, weight, block_weight, roll, huber):
    """Scatter (2,) of heights and normals, how neighbours go together (2,), robust weights (B, 2), joints.

    ``left`` (B, 3) are residuals, ``used`` (2,) is the fit's share of the freedom; joints are how many
    neighbouring blocks are of the same roll.
    """
    count = left.shape[0]
    square, robust = np.empty((count, 2)), np.empty((count, 2))
    own, total, free, product = np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2)
    joints = 0
    for i in range(count):
        square[i, 0] = left[i, 0] ** 2
        square[i, 1] = left[i, 1] ** 2 + left[i, 2] ** 2
        for k in range(2):
            own[k] += weight[i, k] * square[i, k]
            total[k] += square[i, k]
            free[k] += (k + 1) * weight[i, k]
        if i and roll[i] == roll[i - 1]:
            joints += 1
            product[0] += left[i, 0] * left[i - 1, 0]
            product[1] += left[i, 1] * left[i - 1, 1] + left[i, 2] * left[i - 1, 2]
    for k in range(2):
        own[k] = np.sqrt(own[k] / max(free[k] - used[k], 1.0)) + 1e-12
        product[k] = min(max(product[k] / max(total[k], 1e-300), 0.0), 0.8)
        for i in range(count):
            size = np.sqrt(square[i, k] / (k + 1)) / own[k]
            robust[i, k] = block_weight[i] * min(1.0, huber / max(size, 1e-9))
    return own, product, robust, joints
