"""The compiled inner loops in NumPy, as they read on paper: what the fast ones are held against."""

import numpy as np

from evifuse.recordings.rotation import rotate
from evifuse.touch.rolling import distance_to_segment

NODES, SHARES = np.polynomial.legendre.leggauss(6)


def roll_rates(position, normal, psi, roll, origin, frame, step):
    """Rates and errors of tilt and joint angle along a roll, its heading and slope."""
    centre = (position[roll] - origin) @ frame
    heading = _heading(centre[:, :2])
    turn = np.stack([heading, [-heading[1], heading[0]]], axis=1)
    centre = np.concatenate([centre[:, :2] @ turn, centre[:, 2:]], axis=1)
    tilt = _tilt(normal[roll] @ frame) @ turn
    rows, weight = _blocks(np.concatenate([centre, tilt, psi[roll, None]], axis=1), step)
    arc, slope = _arc_length(rows[:, :3], weight)
    rates, errors = _rates(arc, rows[:, 3:6], weight)
    return rates, errors, *heading, slope


def _heading(flat):
    """Unit direction (2,) of a path (M, 2): its principal axis, pointing the way it went."""
    middle = flat - flat.mean(axis=0)
    heading = np.linalg.eigh(middle.T @ middle)[1][:, 1]
    return heading if heading @ (flat[-1] - flat[0]) >= 0 else -heading


def _tilt(normal):
    """Angle vectors (M, 2) of normals (M, 3) against the third axis, radians."""
    sine = np.linalg.norm(normal[:, :2], axis=1)
    angle = np.arctan2(sine, normal[:, 2])
    return normal[:, :2] * np.where(sine > 1e-9, angle / np.maximum(sine, 1e-9), 1.0)[:, None]


def _blocks(rows, step):
    """Means (B, C) of the rows over equal steps of their first column, with weights (B,) of at most 1.

    Neighbouring samples share the same taxels and hence the same error: half a taxel of travel is about one
    independent measurement.
    """
    first = rows[:, 0]
    low, extent = float(first.min()), float(np.ptp(first))
    count = int(np.clip(round(extent / step), 4, 60))
    label = np.minimum(((first - low) * (count / extent)).astype(np.int64), count - 1)
    size = np.bincount(label, minlength=count)
    sums = np.stack([np.bincount(label, column, count) for column in rows.T], axis=1)
    kept = size > 0
    return sums[kept] / size[kept, None], np.sqrt(np.minimum(size[kept] / np.median(size[kept]), 1.0))


def _arc_length(path, weight):
    """Arc length (B,) of a path (B, 3), 0 next to the origin, and the path's slope dy/dx there."""
    x = path[:, 0]
    scale = float(np.abs(x).max())
    order = np.arange(min(3, len(x) - 1) + 1)
    powers = (x / scale)[:, None] ** order * weight[:, None]
    fitted = np.linalg.lstsq(powers, path[:, 1:] * weight[:, None], rcond=None)[0]
    steepness = fitted[1:] * (order[1:, None] / scale)  # coefficients of dy/dx and dz/dx
    start = float(np.clip(0.0, x.min(), x.max()))
    grid = start + (x - start)[:, None] * (0.5 * (NODES + 1))
    slopes = (grid[..., None] / scale) ** order[:-1] @ steepness
    speed = np.sqrt(1 + np.square(slopes).sum(axis=-1))
    lateral = (start / scale) ** order[:-1] @ steepness[:, 0]
    return (x - start) * (speed @ (0.5 * SHARES)), float(lateral)


def _rates(arc, values, weight):
    """Derivatives (C,) of the values (B, C) at arc 0, and their standard errors.

    A line, unless a quadratic or a cubic is better by the Bayesian information criterion: curvature that
    changes along the roll then doesn't pull the value at the site.
    """
    scale = float(np.abs(arc).max())
    count = len(arc)
    best = np.full(values.shape[1], np.inf)
    rate, error = np.zeros((2, values.shape[1]))
    weighted = values * weight[:, None]
    for order in range(1, min(3, count - 2) + 1):
        powers = (arc / scale)[:, None] ** np.arange(order + 1) * weight[:, None]
        solution = np.linalg.lstsq(powers, weighted, rcond=None)[0]
        squares = np.square(weighted - powers @ solution).sum(axis=0) + 1e-20 * count
        score = count * np.log(squares / count) + (order + 1) * np.log(count)
        spread = np.sqrt(squares / (count - order - 1) * np.linalg.inv(powers.T @ powers)[1, 1])
        better = score < best - 2
        best = np.where(better, score, best)
        rate = np.where(better, solution[1] / scale, rate)
        error = np.where(better, spread / scale, error)
    return rate, error


def corner_of(part):
    """Point where a path (M, 2) leaves its chord most, or turns back, by how much, and its extent."""
    aside = distance_to_segment(part, part[0], part[-1])
    chord = part[-1] - part[0]
    along = (part - part[0]) @ chord / max(np.linalg.norm(chord), 1e-12)
    behind = np.maximum.accumulate(along) - along
    back, extent = int(np.argmax(behind)), np.linalg.norm(np.ptp(part, axis=0))
    if behind[back] > aside.max():
        return int(np.argmax(along[: back + 1])), behind[back], extent
    return int(np.argmax(aside)), aside.max(), extent


def moving_mean(values, window):
    """Centred mean over up to 2 window + 1 rows."""
    return np.array([values[max(i - window, 0) : i + window + 1].mean(axis=0) for i in range(len(values))])


def middle_of(position, roll, share):
    """Middle of a roll along its way."""
    path = position[roll]
    along = (path - path[0]) @ (path[-1] - path[0])
    near = np.argsort(np.abs(along - 0.5 * along[-1]), kind="stable")[: max(1, len(roll) // share)]
    return path[near].mean(axis=0)


def normal_near(position, normal, samples, centre, share):
    """Sum of the normals of the samples nearest to a place."""
    apart = np.linalg.norm(position[samples] - centre, axis=1)
    return normal[samples[apart <= np.quantile(apart, share)]].sum(axis=0)


def roll_pieces(position, normal, quaternions, pole, roll, step, fewest, most):
    """Means over equal steps of a roll's smoothed way, in order of time, and how many samples each holds."""
    way = position[roll[-1]] - position[roll[0]]
    along = position[roll] @ (way / np.linalg.norm(way))
    smooth = np.maximum.accumulate(moving_mean(along[:, None], max(1, len(along) // 40))[:, 0])
    extent = smooth[-1] - smooth[0]
    count = int(np.clip(round(extent / step), fewest, most))
    piece = np.minimum(((smooth - smooth[0]) * (count / extent)).astype(int), count - 1)
    rows = np.concatenate([position[roll], normal[roll], rotate(quaternions[roll], pole)], axis=1)
    kept = [k for k in range(count) if (piece == k).any()]
    return np.array([rows[piece == k].mean(axis=0) for k in kept]), np.bincount(piece)[kept]


def contacts(pressure, threshold, areas, normals):
    """Peak, its taxel, and the mean normal weighted by area and squared pressure above the threshold."""
    weight = np.maximum(pressure - threshold, 0.0) ** 2 * areas
    mean = weight @ normals / np.maximum(weight.sum(axis=1, keepdims=True), 1e-300)
    peak = pressure.max(axis=1)
    return (
        peak,
        np.where(peak > 2 * threshold, pressure.argmax(axis=1), 0),
        mean * (peak > 2 * threshold)[:, None],
    )


def least_squares(design, residual, weight, error, scale, prior, theta):
    """Covariance of scaled parameters, their change, and what heights and normals use of the freedom."""
    row = np.sqrt(weight) / error
    a = (design / scale * row[:, [0, 1, 1], None]).reshape(-1, len(theta))
    b = (residual * row[:, [0, 1, 1]]).ravel()
    covariance = np.linalg.inv(a.T @ a + np.diag(prior))
    leverage = ((a @ covariance) * a).sum(axis=1).reshape(-1, 3)
    change = covariance @ (a.T @ b - prior * scale * theta)
    return covariance, change, np.array([leverage[:, 0].sum(), leverage[:, 1:].sum()])
