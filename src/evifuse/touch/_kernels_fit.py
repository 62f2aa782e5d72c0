"""The whole fit of a patch of surface, compiled by numba on first use and cached on disk.

Nothing outside `evifuse.touch.patch` calls it. It gives what its NumPy twin in the tests gives.
"""

# numba finds the types itself
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUntypedFunctionDecorator=false
# pyright: reportUnknownVariableType=false, reportUnknownMemberType=false, reportUnknownArgumentType=false

import numba
import numpy as np

from evifuse.touch._kernels_patch import PARAMETERS, linearise, normal_step, scatter, what_is_left
from evifuse.touch._kernels_rolls import normal_equations, solve

njit = numba.njit(cache=True, nogil=True, error_model="numpy")


@njit
def left_over(rows, values, found):
    """Standard deviation of all that is left of values (B, m) when rows (B, n) times found (n, m) are off."""
    total = squares = 0.0
    for b in range(rows.shape[0]):
        for k in range(values.shape[1]):
            left = values[b, k]
            for i in range(rows.shape[1]):
                left -= rows[b, i] * found[i, k]
            total += left
            squares += left * left
    count = rows.shape[0] * values.shape[1]
    return np.sqrt(max(squares / count - (total / count) ** 2, 0.0))


@njit
def under(centre, radius, weight, p, q, xx, xy, yy, reach):
    """Parameters (16,) of the surface one radius below that of the centres, with its slope and curvature."""
    middle, aside = 0.5 * (xx + yy), 0.5 * (xx - yy)
    apart = np.sqrt(aside * aside + xy * xy)
    low, high = middle - apart, middle + apart
    low = max(low / max(1 + reach * low, 0.05), -5 / reach)
    high = max(high / max(1 + reach * high, 0.05), -5 / reach)
    c, s = (aside / apart, xy / apart) if apart > 0 else (1.0, 0.0)
    middle, apart = 0.5 * (high + low), 0.5 * (high - low)
    theta = np.zeros(PARAMETERS)
    theta[1], theta[2] = p, q
    theta[3], theta[4], theta[5] = middle + apart * c, apart * s, middle - apart * c
    total = share = 0.0
    for b in range(centre.shape[0]):
        x, y, z = centre[b, 0], centre[b, 1], centre[b, 2]
        gx, gy = p + x * xx + y * xy, q + x * xy + y * yy
        length = radius[b] / np.sqrt(1 + gx * gx + gy * gy)
        x, y, z = x + length * gx, y + length * gy, z - length
        rise = p * x + q * y + 0.5 * (theta[3] * x * x + 2 * theta[4] * x * y + theta[5] * y * y)
        total += weight[b] * (z - rise)
        share += weight[b]
    theta[0] = total / share
    return theta


@njit
def first_guess(centre, normal, radius, weight, reach):
    """First guess (16,): the surface of the centres, from their heights or from the normals over them.

    Whichever scatters less by what it means for the curvature.
    """
    count = centre.shape[0]
    rows, values, heights = np.empty((count, 6)), np.empty((count, 2)), np.empty((count, 1))
    total = share = 0.0
    for b in range(count):
        root, x, y = np.sqrt(weight[b]), centre[b, 0], centre[b, 1]
        rows[b, 0], rows[b, 1], rows[b, 2] = root, x * root, y * root
        rows[b, 3], rows[b, 4], rows[b, 5] = 0.5 * x * x * root, x * y * root, 0.5 * y * y * root
        values[b, 0], values[b, 1] = -normal[b, 0] * root, -normal[b, 1] * root
        heights[b, 0] = centre[b, 2] * root
        total += weight[b] * (x * x + y * y)
        share += weight[b]
    flat = rows[:, :3].copy()
    system, linear = normal_equations(flat, values)
    ridge = count * (0.01 * reach) ** 2  # across one way nothing is known
    system[0, 0] += 1e-9 * ridge
    system[1, 1] += ridge
    system[2, 2] += ridge
    solve(system, linear, 0.0)
    for b in range(count):
        for k in range(1, 6):
            rows[b, k] /= reach if k < 3 else reach * reach
    system, bent = normal_equations(rows, heights)
    for k in range(1, 6):
        system[k, k] += 1e-5 * count
    solve(system, bent, 0.0)
    if 4 / np.sqrt(total / share) * left_over(rows, heights, bent) < left_over(flat, values, linear):
        square = reach * reach
        return under(
            centre, radius, weight, bent[1, 0] / reach, bent[2, 0] / reach,
            bent[3, 0] / square, bent[4, 0] / square, bent[5, 0] / square, reach,
        )  # fmt: skip
    xy = 0.5 * (linear[1, 1] + linear[2, 0])
    return under(centre, radius, weight, linear[0, 0], linear[0, 1], linear[1, 0], xy, linear[2, 1], reach)


@njit
def scales_of(reach):
    """Size (16,) that each parameter's effect has per unit at 0.4 radii from the site."""
    out = np.ones(PARAMETERS)
    for k in range(1, 15):
        order = 1 if k < 3 else 2 if k < 6 else 3 if k < 10 else 4
        out[k] = (0.4 * reach) ** order
    return out


@njit
def prior_of(theta, scale_error, sharpest):
    """Inverse variances (16,): derivatives of curvature are of the order of powers of the curvature."""
    k = min(max(abs(theta[3]), abs(theta[5]), 3.0), sharpest)
    out = np.zeros(PARAMETERS)  # slopes below 1 and radii above 1 mm, in order of magnitude
    out[1:3], out[3:6], out[6:10], out[10:15] = 1.0, 1e-6, k**-4, (3 * k**3) ** -2
    out[15] = scale_error**-2
    return out


@njit
def fit(
    centre, normal, radius, tilt, block_weight, roll, scale_error, spacing_error,
    iterations, begun, theta, error, limits,
):  # fmt: skip
    """Parameters (16,), covariance (16, 16) and scatter (2,) of a patch: see `fit_patch`.

    If it was ``begun``, it goes on from ``theta`` (16,) and ``error`` (2,). Limits: floor of the heights'
    scatter over the radius, floor of the normals', longest step, sharpest curvature, and Huber's limit.
    """
    height_floor, angle_floor, longest, sharpest, huber = limits
    count, reach = centre.shape[0], radius.mean()
    scale = scales_of(reach)
    theta, error = theta.copy(), error.copy()
    if not begun:
        theta = first_guess(centre, normal, radius, block_weight, reach)
        error[0], error[1] = 1e-2 * reach, 1e-2
    foot, weight = np.empty((count, 2)), np.empty((count, 2))
    for b in range(count):
        for k in range(2):
            foot[b, k], weight[b, k] = centre[b, k] - radius[b] * normal[b, k], block_weight[b]
    design, residual = np.zeros((count, 3, PARAMETERS)), np.zeros((count, 3))
    left, used, change = np.zeros((count, 3)), np.zeros(2), np.zeros(PARAMETERS)
    covariance = np.eye(PARAMETERS)
    for step in range(iterations):
        linearise(theta, centre, normal, radius, tilt, foot, design, residual, 8 if step == 0 else 2)
        prior = prior_of(theta, scale_error, sharpest) / scale**2
        covariance, regular = normal_step(design, residual, weight, error, scale, prior, theta, change, used)
        if not regular:
            return np.full(PARAMETERS, np.nan), np.full((PARAMETERS, PARAMETERS), np.nan), error
        bend = reach * np.abs(change[3:6] / scale[3:6]).max()
        change *= min(1.0, longest / max(bend, 1e-12))
        theta = theta + change / scale
        what_is_left(design, residual, scale, change, left)
        own, chain, weight, joints = scatter(left, used, weight, block_weight, roll, huber)
        own *= np.sqrt((1 + chain) / (1 - chain))  # neighbours that err together say less
        own[1] = max(own[1], spacing_error)
        before = error.copy()
        error[0] = np.hypot(own[0], height_floor * reach * np.sqrt((count - 1) / (count - joints)))
        error[1] = np.hypot(own[1], angle_floor)
        smallest = np.inf
        for k in range(3, 6):
            smallest = min(smallest, np.sqrt(abs(covariance[k, k])))
        settled = np.abs(change[3:6]).max() < 0.02 * smallest
        if step > 2 and settled and np.abs(np.log(error / before)).max() < 0.02:
            break
    for k in range(PARAMETERS):
        for m in range(PARAMETERS):
            covariance[k, m] /= scale[k] * scale[m]
    return theta, covariance, error
