"""Smooth reliefs: bumps, dents, ridges, troughs, saddles and gentle swells over a plane or a ball."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.simulation.surface import Points

__all__ = ["Relief", "random_relief"]

Array = NDArray[np.float64]

TALLEST = 1.0
"""Features are lower than this, fingertip radii."""
KINDS = ("bump", "dent", "ridge", "trough", "saddle", "swell", "nothing")


@dataclass(frozen=True)
class Relief:
    """Smooth heights over a plane or a ball, the sum of F features.

    A feature with curvatures k of one sign is a Gaussian hill of height ``-k w^2``, where w is its width; one
    with a curvature of 0 is level that way, as far as its width, and then ends softly; opposite signs make a
    saddle that dies away with the fourth power of the distance.

    Parameters
    ----------
    place_m : ndarray of float64, shape (F, 3)
        Middle of each, metres.
    axes : ndarray of float64, shape (F, 2, 3)
        Rows: unit directions of its first and second curvature.
    curvature_per_m : ndarray of float64, shape (F, 2)
        Both curvatures at its middle, 1/m, concave up positive.
    width_m : ndarray of float64, shape (F, 2)
        How far it reaches in both directions, metres.
    ball_m : float or None
        Radius of the ball, metres, where a feature dies away towards the other half; None for a plane.
    """

    place_m: Array
    axes: Array
    curvature_per_m: Array
    width_m: Array
    ball_m: float | None = None

    def height_m(self, points: Points) -> Array:
        """Heights of the relief over points of the plane or the ball.

        Parameters
        ----------
        points : ndarray of float64, shape (M, 3)
            Points, metres.

        Returns
        -------
        ndarray of float64, shape (M,)
            Heights, metres.
        """
        total = np.zeros(len(points))
        for place, axes, bent, width in zip(
            self.place_m, self.axes, self.curvature_per_m, self.width_m, strict=True
        ):
            u, v = axes @ (points - place).T / width[:, None]
            height = _feature(u, v, *(bent * width**2).tolist())
            if self.ball_m is not None:
                facing = np.maximum(points @ place, 0.0) / self.ball_m**2
                height = height * (1 - np.exp(-((facing / 0.35) ** 4)))
            total += height
        return total


def _feature(u: Array, v: Array, first_m: float, second_m: float) -> Array:
    if second_m == 0.0:
        return -first_m * np.exp(-u * u / 2 - v**6 / 2)
    if first_m * second_m < 0:
        return (first_m * u * u + second_m * v * v) / 2 * np.exp(-((u * u + v * v) ** 2) / 4)
    return -first_m * np.exp(-(u * u + v * v) / 2)


def random_relief(
    generator: np.random.Generator, place: Array, axes: Array, a: float, ball_m: float | None = None
) -> Relief:
    """Features of random kinds, curvatures, widths and directions at given places.

    Parameters
    ----------
    generator : numpy.random.Generator
        Where the chance comes from.
    place : ndarray of float64, shape (F, 3)
        Middle of each, metres.
    axes : ndarray of float64, shape (F, 2, 3)
        Two perpendicular unit tangents at each.
    a : float
        Radius of the fingertip, metres.
    ball_m : float, optional
        Radius of the ball, metres.

    Returns
    -------
    Relief
        Domes of at least 1.2 and hollows of at least twice the fingertip's radius.
    """
    bent, width = np.zeros((len(place), 2)), np.ones((len(place), 2)) * a
    for row, kind in enumerate(generator.choice(KINDS, len(place))):

        def between(low: float, high: float) -> float:
            return float(np.exp(generator.uniform(np.log(low), np.log(high))))

        wide = between(1.3, 2.5)
        if kind in ("bump", "dent"):
            first = between(0.1, 0.85 if kind == "bump" else 0.5) * (-1 if kind == "bump" else 1)
            second = first * between(0.4, 1.0)
        elif kind in ("ridge", "trough"):
            first, second = (
                between(0.1, 0.85 if kind == "ridge" else 0.5) * (-1 if kind == "ridge" else 1),
                0.0,
            )
        elif kind == "saddle":
            first, second, wide = between(0.1, 0.5), -between(0.1, 0.5), between(2.0, 3.0)
        elif kind == "swell":
            first, second, wide = between(0.01, 0.1) * generator.choice([-1, 1]), 0.0, between(2.5, 4.0)
        else:
            continue
        wide = max(min(wide, float(np.sqrt(TALLEST / abs(first)))), 1.2)
        other = (
            between(2.0, 4.0)
            if second == 0
            else wide * (np.sqrt(first / second) if first * second > 0 else 1)
        )
        bent[row], width[row] = np.array([first, second]) / a, np.array([wide, other]) * a
    turn = generator.uniform(0, np.pi, len(place))[:, None]
    along, across = axes[:, 0], axes[:, 1]
    turned = [np.cos(turn) * along + np.sin(turn) * across, np.cos(turn) * across - np.sin(turn) * along]
    return Relief(place, np.stack(turned, axis=1), bent, width, ball_m)
