"""Every outline that the edges of a picture suggest."""

from collections.abc import Sequence

import numpy as np

from evifuse.vision.detect import Chain
from evifuse.vision.geometry import perimeter
from evifuse.vision.join import convex_pieces, joined_paths
from evifuse.vision.link import link_chain, link_chains, outer_link_list
from evifuse.vision.primitives import Outline, outline_of

__all__ = ["clusters", "find_outlines"]

NEAR = 0.15
"""Chains belong together if their boxes are closer than this share of the larger extent (our own)."""

MAX_CHAINS = 300
"""In a picture with more chains everything is near something: neighbourhood says nothing."""

MOST_OUTLINES = 130
"""So many outlines, the widest and most nearly closed ones, are looked at closely (our own)."""


def find_outlines(chains: Sequence[Chain]) -> list[Outline]:
    """Outlines of single edges, of their convex pieces joined across gaps, and of neighbouring strokes.

    Parameters
    ----------
    chains : sequence of Chain
        Edges of the picture, px.

    Returns
    -------
    list of Outline
        The most promising first.
    """
    found = [outline_of(link_chain(c)) for c in chains]
    wound = [
        outline_of(outer_link_list((c,)))
        for c, o in zip(chains, found, strict=True)
        if o is not None and len(c) > 1.3 * perimeter(o.hull)
    ]
    pieces = [p for c in chains for p in convex_pieces(c, shortest=12)]
    found += [outline_of(link_chain(p.points)) for p in pieces if p.turn > 2.6]
    found += [outline_of(link_chains(path, closed)) for path, closed in joined_paths(pieces)]
    found += wound + [outline_of(outer_link_list(group)) for group in clusters(chains)]
    promise = [(_promise(o), o) for o in found if o is not None]
    ranked = sorted((pair for pair in promise if pair[0] > 0), key=lambda pair: -pair[0])
    return _without_twins([o for _, o in ranked])


def _without_twins(outlines: list[Outline]) -> list[Outline]:
    """Leave out outlines whose bounds nearly equal those of two better ones."""
    if not outlines:
        return []
    bounds = np.array([np.concatenate([o.hull.min(axis=0), o.hull.max(axis=0)]) for o in outlines])
    extent = (bounds[:, 2:] - bounds[:, :2]).max(axis=1)
    kept: list[int] = []
    for i, b in enumerate(bounds):
        alike = np.abs(bounds[kept] - b).max(axis=1) < 1 + 0.02 * extent[i] if kept else np.zeros(0, bool)
        if alike.sum() < 2:
            kept.append(i)
        if len(kept) == MOST_OUTLINES:
            break
    return [outlines[i] for i in kept]


def _promise(outline: Outline) -> float:
    """How nearly the outline is closed, and how wide it is; 0 for a tangle or a mere bend."""
    links = outline.links
    length = float(np.hypot(*(links.ends - links.starts).T).sum())
    share = length / perimeter(outline.hull)
    if not 0.4 <= share <= 1.6:
        return 0.0
    return min(share, 1.0) ** 4 * float(np.sqrt(outline.width))


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
    if not 2 <= len(chains) <= MAX_CHAINS:
        return []
    low = np.array([c.min(axis=0) for c in chains])
    high = np.array([c.max(axis=0) for c in chains])
    extent = (high - low).max(axis=1)
    apart = np.maximum(low[:, None] - high[None], low[None] - high[:, None]).max(axis=2)
    near = apart <= NEAR * np.maximum(extent[:, None], extent[None])
    groups: list[tuple[Chain, ...]] = []
    left = set(range(len(chains)))
    while left:
        group, grown = set[int](), {left.pop()}
        while grown:
            group |= grown
            grown = {int(j) for i in grown for j in np.flatnonzero(near[i])} - group
        left -= group
        members = sorted(group)
        spans = np.ptp(np.vstack([low[members], high[members]]), axis=0)
        if 2 <= len(members) <= 8 and not ((high - low)[members] >= 0.95 * spans).all(axis=1).any():
            groups.append(tuple(chains[i] for i in members))
    return groups
