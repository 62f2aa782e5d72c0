"""Straight sides and ellipses fitted anew to sub-pixel edge points, with what is not known of them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.crossings import REACH_PX, crossings, known_median

__all__ = ["ExactEllipses", "ExactLines", "exact_ellipses", "exact_lines"]

PER_SIDE = 48
"""A side is crossed at so many places (our own)."""

PER_ARC = 12
"""An ellipse is crossed at so many places of each of its eight arcs (our own)."""

LEAST_LOCATED = 0.4
"""A side or ellipse is fitted anew if the edge is found at this share of the places (our own)."""

MARGIN = 0.1
"""So much of a side, at least 3 px, is left out at either corner: the other side blurs it (our own)."""

GRID_PX = 0.02
"""What the pixel grid and the interpolation leave of errors, px (our own, measured)."""

TUKEY = 4.685
"""Points further from a line than so many standard deviations have no weight (Beaton and Tukey, 1974)."""


@dataclass(frozen=True, eq=False)
class ExactLines:
    """Lines with what is not known of them.

    Parameters
    ----------
    found : ndarray of bool, shape (G,)
        Where the edge was found; the others are as they were given.
    centres : ndarray of float64, shape (G, 2)
        A point of each line, px.
    directions : ndarray of float64, shape (G, 2)
        Unit vector along it.
    covariances : ndarray of float64, shape (G, 2, 2)
        Of its offset at the centre (px^2) and its slope.
    """

    found: NDArray[np.bool_]
    centres: NDArray[np.float64]
    directions: NDArray[np.float64]
    covariances: NDArray[np.float64]

    @property
    def normals(self) -> NDArray[np.float64]:
        """Unit vector across each line, shape (G, 2)."""
        return np.stack([-self.directions[:, 1], self.directions[:, 0]], axis=-1)

    def part(self, at: slice | NDArray[np.intp]) -> "ExactLines":
        """Some of them.

        Parameters
        ----------
        at : slice or ndarray of intp
            Which.

        Returns
        -------
        ExactLines
            In that order.
        """
        return ExactLines(self.found[at], self.centres[at], self.directions[at], self.covariances[at])

    def foot(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """The places of the lines that are nearest to points.

        Parameters
        ----------
        points : ndarray of float64, shape (G, 2)
            One for each line, px.

        Returns
        -------
        ndarray of float64, shape (G, 2)
            Pixels.
        """
        s = ((points - self.centres) * self.directions).sum(axis=-1, keepdims=True)
        return self.centres + s * self.directions

    def variance_at(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Variance of a line's distance from points near it.

        Parameters
        ----------
        points : ndarray of float64, shape (G, 2)
            One for each line, px.

        Returns
        -------
        ndarray of float64, shape (G,)
            Square pixels.
        """
        s = ((points - self.centres) * self.directions).sum(axis=-1)
        c = self.covariances
        return c[:, 0, 0] + 2 * s * c[:, 0, 1] + s * s * c[:, 1, 1] + GRID_PX**2


def exact_lines(
    picture: NDArray[np.uint8],
    starts: NDArray[np.float64],
    ends: NDArray[np.float64],
    unit_px: float,
    rough_px: NDArray[np.float64],
) -> ExactLines:
    """Fit straight sides to the edge that is seen there.

    Twice: the second time about the line of the first. The line is fitted by least squares of the distances
    with Tukey's weights; its covariance is that of the weighted fit with the spread of the residuals, times
    ``(1 + r) / (1 - r)`` for residuals whose neighbours correlate by r (our own): a wavy side is less
    certain than its many points make believe.

    Parameters
    ----------
    picture : ndarray of uint8, shape (H, W) or (H, W, 3)
        Grey or BGR.
    starts, ends : ndarray of float64, shape (G, 2)
        Corners that each side joins, px.
    unit_px : float
        See `crossings`.
    rough_px : ndarray of float64, shape (G,)
        Standard deviation of a side that is not found, px.

    Returns
    -------
    ExactLines
        One for each side.
    """
    along = ends - starts
    lengths = np.maximum(np.hypot(along[:, 0], along[:, 1]), 1e-9)
    direction = along / lengths[:, None]
    centre = (starts + ends) / 2
    normal = np.stack([-direction[:, 1], direction[:, 0]], axis=-1)
    margin = np.minimum(np.maximum(MARGIN * lengths, 3 * unit_px), 0.25 * lengths)
    s = (0.5 * lengths - margin)[:, None] * np.linspace(-1, 1, PER_SIDE)
    found = np.ones(len(starts), np.bool_)
    line, covariance = np.zeros((len(starts), 2)), np.zeros((len(starts), 2, 2))
    old = centre, direction
    for _ in range(2):
        normal = np.stack([-direction[:, 1], direction[:, 0]], axis=-1)
        places = centre[:, None] + direction[:, None] * s[..., None]
        offset = crossings(picture, places, np.broadcast_to(normal[:, None], places.shape), unit_px)
        design = np.stack([np.ones_like(s), s], axis=-1)
        line, covariance, located = _robust(design, offset, GRID_PX * unit_px)
        found &= located
        line[~found] = 0.0
        centre = centre + normal * line[:, :1]
        turn = np.arctan(line[:, 1:])
        direction = direction * np.cos(turn) + normal * np.sin(turn)
    found &= np.hypot(*(centre - old[0]).T) <= 2 * REACH_PX * unit_px
    centre, direction = np.where(found[:, None], (centre, direction), old)
    rough = np.zeros((len(starts), 2, 2))
    rough[:, 0, 0] = rough_px**2
    rough[:, 1, 1] = 12 * (rough_px / lengths) ** 2
    return ExactLines(found, centre, direction, np.where(found[:, None, None], covariance, rough))


@dataclass(frozen=True, eq=False)
class ExactEllipses:
    """Ellipses with what is not known of them.

    Parameters
    ----------
    found : ndarray of bool, shape (E,)
        Where the edge was found; the others are as they were given.
    centre : ndarray of float64, shape (E, 2)
        (x, y), px.
    axes : ndarray of float64, shape (E, 2)
        Full lengths of the long and the short axis, px.
    angle_rad : ndarray of float64, shape (E,)
        Direction of the long axis from x towards y, radians, in [-pi / 2, pi / 2).
    centre_covariance : ndarray of float64, shape (E, 2, 2)
        Of the centre, square px.
    axes_std : ndarray of float64, shape (E, 2)
        Standard deviations of the axes, px.
    angle_std : ndarray of float64, shape (E,)
        Standard deviation of the angle, radians; pi / 4 where nothing is known of it.
    """

    found: NDArray[np.bool_]
    centre: NDArray[np.float64]
    axes: NDArray[np.float64]
    angle_rad: NDArray[np.float64]
    centre_covariance: NDArray[np.float64]
    axes_std: NDArray[np.float64]
    angle_std: NDArray[np.float64]

    def shape(self, i: int) -> NDArray[np.float64]:
        """Points on one of them.

        Parameters
        ----------
        i : int
            Which.

        Returns
        -------
        ndarray of float64, shape (48, 2)
            In order from an end of the long axis on, px.
        """
        c, s = np.cos(self.angle_rad[i]), np.sin(self.angle_rad[i])
        return self.centre[i] + (_circle(48) * self.axes[i] / 2) @ np.array([[c, s], [-s, c]])


def exact_ellipses(
    picture: NDArray[np.uint8],
    centre: NDArray[np.float64],
    axes: NDArray[np.float64],
    angle_rad: NDArray[np.float64],
    unit_px: float,
    rough_px: NDArray[np.float64],
) -> ExactEllipses:
    """Fit ellipses to the edge that is seen there.

    With an ellipse as ``c + S u``, u on the unit circle and S symmetric, the five numbers of c and S are
    corrected by the edge's distances along the normals, twice, as in `exact_lines`. Unlike axes and angle
    these are well defined for a circle too.

    Parameters
    ----------
    picture : ndarray of uint8, shape (H, W) or (H, W, 3)
        Grey or BGR.
    centre, axes : ndarray of float64, shape (E, 2)
        Centres and full lengths of the axes, px.
    angle_rad : ndarray of float64, shape (E,)
        Direction of the first axis from x towards y, radians.
    unit_px : float
        See `crossings`.
    rough_px : ndarray of float64, shape (E,)
        Standard deviation of an outline that is not found, px.

    Returns
    -------
    ExactEllipses
        One for each.
    """
    middle, form = centre, _form(axes, angle_rad)
    unit = _circle(8 * PER_ARC)
    found = np.ones(len(centre), np.bool_)
    covariance = np.zeros((len(centre), 5, 5))
    for _ in range(2):
        normal = unit @ np.linalg.inv(form)
        normal /= np.hypot(normal[..., 0], normal[..., 1])[..., None]
        places = middle[:, None] + unit @ form
        by_arc = (v.reshape(-1, PER_ARC, 2) for v in (places, normal))
        offset = crossings(picture, *by_arc, unit_px).reshape(len(centre), 8 * PER_ARC)
        nx, ny, ux, uy = normal[..., 0], normal[..., 1], unit[:, 0], unit[:, 1]
        design = np.stack([nx, ny, nx * ux, nx * uy + ny * ux, ny * uy], axis=-1)
        change, covariance, located = _robust(design, offset, GRID_PX * unit_px)
        found &= located & (np.abs(change).max(axis=1) <= 2 * REACH_PX * unit_px)
        change[~found] = 0.0
        middle = middle + change[:, :2]
        form = form + change[:, [2, 3, 3, 4]].reshape(-1, 2, 2)
        sound = np.linalg.eigvalsh(form)[:, 0] > 0.5
        found &= sound
        form[~sound] = _form(axes, angle_rad)[~sound]
    half, vectors = np.linalg.eigh(form)
    long, short = vectors[..., 1], vectors[..., 0]
    rows = np.stack([_effect(long, long), _effect(short, short), _effect(long, short)], axis=1)
    known = np.einsum("eij,ejk,eik->ei", rows, covariance[:, 2:, 2:], rows) + (GRID_PX * unit_px) ** 2
    spread = np.where(found[:, None], known, rough_px[:, None] ** 2)
    floor = np.where(found, GRID_PX * unit_px, rough_px) ** 2
    angle = np.arctan2(long[:, 1], long[:, 0])
    return ExactEllipses(
        found=found,
        centre=middle,
        axes=2 * half[:, ::-1],
        angle_rad=(angle + np.pi / 2) % np.pi - np.pi / 2,
        centre_covariance=np.where(found[:, None, None], covariance[:, :2, :2], 0.0)
        + np.eye(2) * floor[:, None, None],
        axes_std=2 * np.sqrt(spread[:, :2]),
        angle_std=np.minimum(np.sqrt(spread[:, 2]) / np.maximum(half[:, 1] - half[:, 0], 1e-9), np.pi / 4),
    )


def _circle(count: int) -> NDArray[np.float64]:
    """Points on the unit circle."""
    t = 2 * np.pi * np.arange(count) / count
    return np.stack([np.cos(t), np.sin(t)], axis=-1)


def _form(axes: NDArray[np.float64], angle_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """The symmetric matrices S of ellipses, shape (E, 2, 2)."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    turn = np.stack([np.stack([c, -s], axis=-1), np.stack([s, c], axis=-1)], axis=-2)
    return (turn * (axes / 2)[:, None, :]) @ np.swapaxes(turn, 1, 2)


def _effect(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """What changes of the three numbers of S do to a . S b, shape (E, 3)."""
    (ax, ay), (bx, by) = a.T, b.T
    return np.stack([ax * bx, ax * by + ay * bx, ay * by], axis=-1)


def _robust(
    design: NDArray[np.float64], offset: NDArray[np.float64], least: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Solutions, covariances and whether enough was located, of many least squares with Tukey's weights.

    Shapes (G, P), (G, P, P), (G,), of design (G, M, P) and offset (G, M); NaN for what was not located.
    """
    there = np.isfinite(offset)
    size = design.shape[-1]
    enough = there.sum(axis=1) >= max(LEAST_LOCATED * offset.shape[1], size + 3)
    target = np.nan_to_num(offset)
    start = np.where(enough, known_median(offset), 0.0)
    residual = target - start[:, None] * design[..., :1].sum(axis=-1) if size == 2 else target
    solution, inverse = np.zeros((len(offset), size)), np.zeros((len(offset), size, size))
    weight = there.astype(np.float64)
    for _ in range(5):
        spread = np.maximum(1.4826 * known_median(np.abs(np.where(there, residual, np.nan))), least)
        weight = there * np.clip(1 - (residual / (TUKEY * spread[:, None])) ** 2, 0, None) ** 2
        weighted = np.swapaxes(design * weight[..., None], 1, 2)
        normal = weighted @ design
        ridge = 1e-9 * np.trace(normal, axis1=1, axis2=2)[:, None, None] + 1e-12
        inverse = np.linalg.inv(normal + ridge * np.eye(size))
        solution = (inverse @ (weighted @ target[..., None]))[..., 0]
        residual = target - (design @ solution[..., None])[..., 0]
    freedom = np.maximum(weight.sum(axis=1) - size, 1.0)
    squares = (weight * residual**2).sum(axis=1)
    both = np.sqrt(weight[:, 1:] * weight[:, :-1]) * residual[:, 1:] * residual[:, :-1]
    correlation = np.clip(both.sum(axis=1) / np.maximum(squares, 1e-12), 0.0, 0.9)
    variance = squares / freedom * (1 + correlation) / (1 - correlation)
    enough &= (weight > 0.1).sum(axis=1) >= max(LEAST_LOCATED * offset.shape[1] / 2, size + 2)
    return solution, inverse * variance[:, None, None], enough
