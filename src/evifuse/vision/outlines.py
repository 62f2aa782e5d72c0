"""Every outline that the edges of a picture suggest, the most promising ones first."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.detect import Chain
from evifuse.vision.join import joined_paths
from evifuse.vision.link import LinkList, Runs, link_pieces, outer_path
from evifuse.vision.pieces import Edges, Pieces, convex_pieces, straightened_edges, whole_edges

__all__ = ["Suggestions", "clusters", "find_outlines", "neighbours", "suggested"]

NEAR = 0.15
"""Chains belong together if their boxes are closer than this share of the larger extent (our own)."""

MAX_CHAINS = 300
"""In a picture with more chains everything is near something: neighbourhood says nothing."""

MOST_STROKES = 8
"""So many chains that are near each other may be one object (our own)."""

MOST_OUTLINES = 130
"""So many outlines, the widest and most nearly closed ones, are looked at closely (our own)."""

POINTS_PER_OUTLINE = 400
"""Of a picture with more edges, one more for so many edge points (our own)."""

LEAST_WIDTH_PX = 10.0
"""Narrower outlines show no shape, working px (our own)."""

WOUND = 1.3
"""A chain with so many points per pixel around its hull runs round more than once (our own)."""

SHORTEST_PX = 12
"""Pieces of fewer points belong to no outline, px (our own)."""

LEAST_TURN_RAD = 2.6
"""A convex piece of an edge that turns by more than this may be an outline alone (our own)."""


@dataclass(frozen=True, eq=False)
class Suggestions:
    """Outlines that edges suggest, before they are looked at closely.

    Parameters
    ----------
    edges : Edges
        Edges, and what they show to the outside together.
    pieces : Pieces
        What the outlines are made of.
    runs : Runs
        Which pieces make each outline.
    length, around, width : ndarray of float64, shape (M,)
        Length along each, length of its hull, four times the area over the length of the hull, px.
    box : ndarray of float64, shape (M, 4)
        Bounds x0, y0, x1, y1 of each, px.
    """

    edges: Edges
    pieces: Pieces
    runs: Runs
    length: NDArray[np.float64]
    around: NDArray[np.float64]
    width: NDArray[np.float64]
    box: NDArray[np.float64]

    @staticmethod
    def of(edges: Edges, pieces: Pieces, runs: Runs) -> "Suggestions":
        """Measure runs of pieces.

        Parameters
        ----------
        edges : Edges
            Edges.
        pieces : Pieces
            Pieces of them.
        runs : Runs
            Which pieces make each outline.

        Returns
        -------
        Suggestions
            One per run.
        """
        from evifuse.vision import _kernels_outlines as kernels

        around, inside, box = kernels.measured(edges.corners, pieces.span, runs.nodes, runs.offset)
        width = 4 * inside / np.maximum(around, 1e-9)
        return Suggestions(edges, pieces, runs, runs.sums(pieces.length), around, width, box)

    @property
    def promise(self) -> NDArray[np.float64]:
        """How nearly each is closed and not more than that, and how wide it is; 0 for a line or a bend."""
        share = self.length / np.maximum(self.around, 1e-9)
        none = (self.width < np.maximum(LEAST_WIDTH_PX, 0.016 * self.around)) | (share < 0.4) | (share > 1.6)
        return np.where(none, 0.0, np.where(share < 1, share**2, share**-4.0) * self.width**0.75)

    def best(self) -> NDArray[np.intp]:
        """The most promising ones, without those whose bounds nearly equal those of two better ones.

        Returns
        -------
        ndarray of intp, shape (Q,)
            Their places, the most promising first.
        """
        from evifuse.vision import _kernels_outlines as kernels

        promise = self.promise
        most = MOST_OUTLINES + len(self.edges.points) // POINTS_PER_OUTLINE
        order = np.argsort(-promise, kind="stable")
        order = order[promise[order] > 0]
        return order[kernels.without_twins(self.box[order], 0.02, 1.0, 2, most)]

    def link_lists(self, which: NDArray[np.intp]) -> list[LinkList]:
        """Some of them in full.

        Parameters
        ----------
        which : ndarray of intp, shape (Q,)
            Their places.

        Returns
        -------
        list of LinkList
            In that order.
        """
        p = self.pieces
        return link_pieces(self.edges.points, p.low, p.high, p.back, self.runs.take(which))


def find_outlines(chains: Sequence[Chain]) -> list[LinkList]:
    """Outlines of single edges, of their convex pieces joined across gaps, and of neighbouring strokes.

    Parameters
    ----------
    chains : sequence of Chain
        Edges of the picture, px.

    Returns
    -------
    list of LinkList
        The most promising first; none encloses next to nothing.
    """
    if not chains:
        return []
    found = suggested(chains)
    return found.link_lists(found.best())


def suggested(chains: Sequence[Chain]) -> Suggestions:
    """Every outline that edges suggest.

    Parameters
    ----------
    chains : sequence of Chain
        At least one; edges of the picture, px.

    Returns
    -------
    Suggestions
        Whole edges; single convex pieces of them that turn far enough; pieces joined across gaps; and what
        tangled edges and neighbouring strokes show to the outside.
    """
    edges = straightened_edges(chains)
    whole = whole_edges(edges)
    single = Suggestions.of(edges, whole, _alone(whole))
    tangled = np.flatnonzero(whole.size > WOUND * np.maximum(single.around, 1e-9))
    groups = [*((chains[i],) for i in tangled.tolist()), *clusters(chains)]
    outer = [outer_path(group) for group in groups]
    if outer:
        edges = straightened_edges([*chains, *(run for path in outer for run in path)])
        whole = whole_edges(edges)
    pieces = convex_pieces(edges, SHORTEST_PX)
    pieces = pieces.take(np.flatnonzero(pieces.edge < len(chains)))
    bent = pieces.take(
        np.flatnonzero((pieces.turn > LEAST_TURN_RAD) & (pieces.size < whole.size[pieces.edge]))
    )
    nodes, joined = joined_paths(pieces, cluttered=len(chains) > MAX_CHAINS)
    count = len(chains)
    runs = _alone(whole.take(np.arange(count)))
    runs = runs.and_then(Runs.of([len(path) for path in outer], [True] * len(outer)), count)
    runs = runs.and_then(_alone(bent), len(whole.edge))
    runs = runs.and_then(joined, len(whole.edge) + len(bent.edge))
    return Suggestions.of(edges, whole.and_then(bent).and_then(nodes), runs)


def _alone(pieces: Pieces) -> Runs:
    """Every piece as an outline; closed if its ends are no further apart than 5 % of its length."""
    gap = pieces.end - pieces.start
    near = np.hypot(gap[:, 0], gap[:, 1]) <= np.maximum(3.0, 0.05 * pieces.size)
    return Runs.of(np.ones(len(near), np.int64), near & (pieces.size > 12))


def clusters(chains: Sequence[Chain]) -> list[tuple[Chain, ...]]:
    """Chains that may be strokes of one outline: neighbours, few in number, none of which spans the others.

    Parameters
    ----------
    chains : sequence of Chain
        Edges of the picture, px.

    Returns
    -------
    list of tuple of Chain
        Groups of 2 to 8 chains whose boxes are closer than 15 % of the larger extent.
    """
    groups: list[tuple[Chain, ...]] = []
    for group in neighbours(chains):
        spans = np.array([np.ptp(chains[i], axis=0) for i in group])
        whole = np.ptp(np.concatenate([chains[i] for i in group]), axis=0)
        if len(group) > 1 and not (spans >= 0.95 * whole).all(axis=1).any():
            groups.append(tuple(chains[i] for i in group))
    return groups


def neighbours(chains: Sequence[Chain]) -> list[list[int]]:
    """Chains that may belong to one object: near each other, and few in number.

    Parameters
    ----------
    chains : sequence of Chain
        Edges of the picture, px.

    Returns
    -------
    list of list of int
        Groups of 1 to 8 chains, by number, whose boxes are closer than 15 % of the larger extent; none in a
        picture with many chains.
    """
    if not 0 < len(chains) <= MAX_CHAINS:
        return []
    from evifuse.vision import _kernels_boxes

    points = np.concatenate(chains)
    sizes = np.array([len(c) for c in chains])
    first = np.cumsum(sizes) - sizes
    low, high = np.minimum.reduceat(points, first), np.maximum.reduceat(points, first)
    group = np.empty(len(chains), np.int64)
    found = _kernels_boxes.connected(low, high, NEAR, group)
    small = np.bincount(group, minlength=found) <= MOST_STROKES
    groups: list[list[int]] = [[] for _ in range(found)]
    for i, k in enumerate(group.tolist()):
        groups[k].append(i)
    return [members for members, few in zip(groups, small.tolist(), strict=True) if few]
