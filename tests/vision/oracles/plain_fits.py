"""What is fitted to one outline, written as plainly as it can be: slow, one point or one line at a time."""

from itertools import pairwise

import numpy as np
from scipy.linalg import eig
from scipy.spatial import ConvexHull


def line_through(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Centre, and direction of the largest singular value."""
    centre = points.mean(axis=0)
    return centre, np.linalg.svd(points - centre)[2][0]


def section(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First and last point on the line through the nearest 90 % of the points between them."""
    inner = points[1:-1] if len(points) >= 6 else points
    centre, direction = line_through(inner)
    away = np.abs(np.cross(np.c_[inner - centre, np.zeros(len(inner))], [*direction, 0])[:, 2])
    kept = np.argsort(away, kind="stable")[: int(np.ceil(0.9 * len(inner)))]
    centre, direction = line_through(inner[kept])
    first, last = (centre + direction * ((p - centre) @ direction) for p in (points[0], points[-1]))
    return first, last


def prepared(chains: list[np.ndarray], count: int = 64) -> tuple[np.ndarray, float, float, float]:
    """Points at equal steps along chains, and length, area and extent of their hull."""
    points = np.concatenate(chains)
    hull = ConvexHull(points)
    corners = points[hull.vertices]
    after = np.roll(corners, -1, axis=0)
    twice = corners[:, 0] * after[:, 1] - corners[:, 1] * after[:, 0]
    middle = ((corners + after) * twice[:, None]).sum(axis=0) / (3 * twice.sum())
    steps = [np.linalg.norm(np.diff(c, axis=0), axis=1) for c in chains]
    length = sum(s.sum() for s in steps)
    begin, farthest, away = 0.0, 0.0, -1.0
    for c, s in zip(chains, steps, strict=True):
        for point, at in zip(c[1:], begin + np.cumsum(s), strict=True):
            if np.hypot(*(point - middle)) > away:
                farthest, away = at, np.hypot(*(point - middle))
        begin += s.sum()
    found = []
    for at in (farthest + (np.arange(count) + 0.5) / count * length) % length:
        begin = 0.0
        for c, s in zip(chains, steps, strict=True):
            if begin <= at < begin + s.sum():
                until = begin + np.append(0.0, np.cumsum(s))
                found.append([np.interp(at, until, c[:, axis]) for axis in (0, 1)])
            begin += s.sum()
    return np.array(found), hull.area, hull.volume, float(np.ptp(points, axis=0).max())


def direct_ellipse(points: np.ndarray) -> np.ndarray:
    """Coefficients of xx, xy, yy, x, y, 1 by the generalised eigenvalue problem as it was published."""
    x, y = points.T
    design = np.column_stack([x * x, x * y, y * y, x, y, np.ones_like(x)])
    constraint = np.zeros((6, 6))
    constraint[0, 2] = constraint[2, 0] = 2
    constraint[1, 1] = -1
    values, vectors = eig(constraint, design.T @ design)
    conic = vectors[:, np.argmax(values.real)].real
    return conic / np.linalg.norm(conic)


def agreed(distance: np.ndarray, place: np.ndarray, tolerance: float) -> tuple[float, ...]:
    """Fit, explained share, coverage, opening and deviation."""
    nearest = np.sort(distance)[: int(0.9 * len(distance))]
    near = distance <= 3 * tolerance
    parts = {min(int(p * 32), 31) for p in place[near]}
    longest = max(next((n for n in range(32) if (start + n) % 32 in parts), 32) for start in range(32))
    capped = np.minimum(distance, 2.5 * tolerance)
    return (
        float(np.exp(-0.5 * np.mean(nearest**2) / tolerance**2)),
        float(near.mean()),
        len(parts) / 32,
        longest / 32,
        float(np.sqrt(np.mean(capped**2))),
    )


def meeting(lines: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Where each line (centre, direction) meets the one before; NaN where they are nearly parallel."""
    corners = []
    for (p, u), (q, v) in pairwise([lines[-1], *lines]):
        if abs(u[0] * v[1] - u[1] * v[0]) < 0.05:
            corners.append([np.nan, np.nan])
        else:
            corners.append(p + u * np.linalg.solve(np.column_stack([u, -v]), q - p)[0])
    return np.array(corners)
