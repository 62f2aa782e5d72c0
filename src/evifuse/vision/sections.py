"""The straight sections that account best for the points of an outline, found by dynamic programming."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

__all__ = ["Divisions", "Sections", "straight_sections"]

CELLS = 32
"""A section starts and ends where one of so many equal parts of the outline does (our own)."""


@dataclass(frozen=True, eq=False)
class Sections:
    """Straight sections of many outlines, the same number of each.

    Parameters
    ----------
    starts, ends : ndarray of float64, shape (B, K, 2)
        End points of each section in order along the outline, on the line fitted to its points, px.
    centres, directions : ndarray of float64, shape (B, K, 2)
        A point of each line, px, and its unit direction.
    cost : ndarray of float64, shape (B,)
        Squared distances of the points from their sections, and the price of those left out, square px.
    """

    starts: NDArray[np.float64]
    ends: NDArray[np.float64]
    centres: NDArray[np.float64]
    directions: NDArray[np.float64]
    cost: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Divisions(Mapping[int, Sections]):
    """The best divisions of outlines, by the number of sections; lines are fitted when first asked for.

    Parameters
    ----------
    points : ndarray of float64, shape (B, N, 2)
        Points at equal steps along what is seen of each outline, px.
    bounds : ndarray of int64, shape (B, M, M, 2)
        Entry ``[:, k - 1, :k]`` are the points where each of k sections starts, and before which it ends.
    cost : ndarray of float64, shape (B, M)
        Of the division into 1 to M sections, as in `Sections`, square px.
    """

    points: NDArray[np.float64]
    bounds: NDArray[np.int64]
    cost: NDArray[np.float64]
    _fitted: dict[int, Sections] = field(default_factory=dict[int, Sections], init=False, repr=False)

    def __getitem__(self, count: int) -> Sections:
        """All outlines in so many sections."""
        if count not in self._fitted:
            self._fitted[count] = self.of(slice(None), count)
        return self._fitted[count]

    def __iter__(self) -> Iterator[int]:
        """Numbers of sections, from 1."""
        return iter(range(1, len(self) + 1))

    def __len__(self) -> int:
        """The largest number of sections."""
        return self.cost.shape[1]

    def of(self, which: slice | NDArray[np.intp], count: int) -> Sections:
        """Some of the outlines in so many sections.

        Parameters
        ----------
        which : slice or ndarray of intp, shape (Q,)
            Their places.
        count : int
            From 1 to M.

        Returns
        -------
        Sections
            Lines of least squares, without the points next to a bound, which may lie on the round of a
            corner, and without the farthest tenth of the others.
        """
        from evifuse.vision import _kernels_sections

        if not 1 <= count <= len(self):
            raise KeyError(count)
        points, bounds = self.points[which], np.ascontiguousarray(self.bounds[which, count - 1, :count])
        starts, ends, centres, directions = np.empty((4, len(points), count, 2))
        _kernels_sections.fit_sections(points, bounds, starts, ends, centres, directions)
        return Sections(starts, ends, centres, directions, self.cost[which, count - 1])


def straight_sections(points: NDArray[np.float64], price: NDArray[np.float64], most: int) -> Divisions:
    """Divide outlines into straight sections so that their points stray least (our own).

    The best division by total squared distance, found exactly over all divisions at the bounds of 32 equal
    parts. Points may be left out - the round of a corner, a hook, the end of a stroke - at a fixed price
    each.

    Parameters
    ----------
    points : ndarray of float64, shape (B, N, 2)
        Points at equal steps along what is seen of each outline, px; N is a multiple of 32.
    price : ndarray of float64, shape (B,)
        What leaving out one point costs, square px.
    most : int
        Divisions into 1 to so many sections are found.

    Returns
    -------
    Divisions
        By the number of sections.
    """
    from evifuse.vision import _kernels_sections

    points = np.ascontiguousarray(points)
    bounds = np.empty((len(points), most, most, 2), np.int64)
    cost = np.empty((len(points), most))
    _kernels_sections.divide(points, price, CELLS, bounds, cost)
    return Divisions(points, bounds, cost)
