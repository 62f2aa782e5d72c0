"""Every outline that the edges of a picture suggest, the most promising ones first."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

import numpy as np

from evifuse.vision.detect import Chain
from evifuse.vision.join import joined_paths
from evifuse.vision.link import LinkList, link_chains, outer_path, straightened
from evifuse.vision.pieces import Pieces, convex_pieces

__all__ = ["clusters", "find_outlines", "neighbours"]

NEAR = 0.15
"""Chains belong together if their boxes are closer than this share of the larger extent (our own)."""

MAX_CHAINS = 300
"""In a picture with more chains everything is near something: neighbourhood says nothing."""

MOST_STROKES = 8
"""So many chains that are near each other may be one object (our own)."""

MOST_OUTLINES = 130
"""So many outlines, the widest and most nearly closed ones, are looked at closely (our own)."""

WOUND = 1.3
"""A chain with so many points per pixel around its hull runs round more than once (our own)."""

LEAST_TURN_RAD = 2.6
"""A convex piece of an edge that turns by more than this may be an outline alone (our own)."""


@dataclass(frozen=True, eq=False)
class _Path:
    """An outline before it is looked at closely: chains in order, closed or not, their length, their hull."""

    chains: tuple[Chain, ...]
    closed: bool
    length: float
    around: float
    width: float
    box: Sequence[int]

    @property
    def promise(self) -> float:
        """How nearly the outline is closed, and how wide it is; 0 for a straight line, a tangle, a bend."""
        share = self.length / max(self.around, 1e-9)
        if self.around < 12 or self.width < 0.016 * self.around or not 0.4 <= share <= 1.6:
            return 0.0
        return min(share, 1.0) ** 4 * self.width**0.5


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
    pieces = convex_pieces(chains, shortest=12)
    lengths = pieces.chain_length.tolist()
    single = [_path((c,), _returns(c), v) for c, v in zip(chains, lengths, strict=True)]
    wound = [p.chains for p in single if len(p.chains[0]) > WOUND * p.around > 0]
    outer = [outer_path(group) for group in [*wound, *clusters(chains)]]
    found = single + _bent(pieces) + _joined(pieces)
    found += [_path(path, True, sum(_length(c) for c in path)) for path in outer]
    promise = [(p.promise, p) for p in found]
    ranked = sorted((pair for pair in promise if pair[0] > 0), key=lambda pair: -pair[0])
    return [link_chains(p.chains, p.closed) for p in _without_twins([p for _, p in ranked])]


def _bent(pieces: Pieces) -> list[_Path]:
    """Outlines of one piece of an edge each."""
    alone = np.flatnonzero((pieces.turn > LEAST_TURN_RAD) & ~pieces.whole)
    points = [pieces.points[i] for i in alone.tolist()]
    return [_path((p,), _returns(p), v) for p, v in zip(points, pieces.length[alone].tolist(), strict=True)]


def _joined(pieces: Pieces) -> list[_Path]:
    """Outlines of several pieces each."""
    nodes, paths = joined_paths(pieces)
    lengths = nodes.length.tolist()
    return [
        _path(tuple(nodes.points[k] for k in p.nodes), p.closed, sum(lengths[k] for k in p.nodes))
        for p in paths
    ]


def _path(chains: tuple[Chain, ...], closed: bool, length: float) -> _Path:
    import cv2

    points = np.concatenate(chains, dtype=np.float32)
    hull = cv2.convexHull(points)
    around = cv2.arcLength(hull, True)
    width = 4 * cv2.contourArea(hull) / max(around, 1e-9)
    return _Path(chains, closed, length, around, width, cv2.boundingRect(hull))


def _returns(chain: Chain) -> bool:
    """Whether both ends of a chain nearly meet: no further apart than 5 % of its length."""
    dx, dy = (chain[-1] - chain[0]).tolist()
    return len(chain) > 12 and hypot(dx, dy) <= max(3.0, 0.05 * len(chain))


def _length(chain: Chain) -> float:
    """Length of a chain without the steps of the pixel grid, px."""
    steps = np.diff(straightened(chain, 1.5), axis=0)
    return float(np.hypot(steps[:, 0], steps[:, 1]).sum())


def _without_twins(paths: list[_Path]) -> list[_Path]:
    """Leave out outlines whose bounds nearly equal those of two better ones."""
    bounds = np.array([p.box for p in paths], np.float64).reshape(-1, 4)
    tolerance = 1 + 0.02 * bounds[:, 2:].max(axis=1, initial=0.0)
    bounds[:, 2:] += bounds[:, :2]
    kept: list[int] = []
    better = np.empty((MOST_OUTLINES, 4))
    for i, box in enumerate(bounds):
        apart = np.abs(better[: len(kept)] - box).max(axis=1)
        if np.count_nonzero(apart < tolerance[i]) < 2:
            better[len(kept)] = box
            kept.append(i)
        if len(kept) == MOST_OUTLINES:
            break
    return [paths[i] for i in kept]


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
    if len(chains) > MAX_CHAINS:
        return []
    low = np.array([c.min(axis=0) for c in chains])
    high = np.array([c.max(axis=0) for c in chains])
    extent = (high - low).max(axis=1)
    apart = np.maximum(low[:, None] - high[None], low[None] - high[:, None]).max(axis=2)
    near = apart <= NEAR * np.maximum(extent[:, None], extent[None])
    groups: list[list[int]] = []
    left = set(range(len(chains)))
    while left:
        group, grown = set[int](), {left.pop()}
        while grown:
            group |= grown
            grown = {int(j) for i in grown for j in np.flatnonzero(near[i])} - group
        left -= group
        if len(group) <= MOST_STROKES:
            groups.append(sorted(group))
    return groups
