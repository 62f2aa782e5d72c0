"""From edges to outlines: straightened, cut where they bend back, joined across gaps, measured, ranked."""

from itertools import product

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from evifuse.vision.join import joined_paths
from evifuse.vision.link import Runs, link_chains, link_pieces
from evifuse.vision.outlines import find_outlines, suggested
from evifuse.vision.pieces import CORNER_PX, convex_pieces, straightened_edges, whole_edges


def steps(start: tuple[int, int], *runs: tuple[int, int, int]) -> NDArray[np.float64]:
    """Points one pixel apart along runs of (dx, dy, how many)."""
    points = [np.array(start, np.float64)]
    for dx, dy, count in runs:
        points += [points[-1] + np.array((dx, dy)) * k for k in range(1, count + 1)]
    return np.array(points)


def wandering(seed: int, count: int = 200) -> NDArray[np.float64]:
    """An edge that turns this way and that, one pixel at a time."""
    rng = np.random.default_rng(seed)
    heading = np.cumsum(rng.normal(0, 0.25, count)) + rng.uniform(0, 6)
    path = np.cumsum(np.stack([np.cos(heading), np.sin(heading)], axis=1), axis=0)
    return np.round(path - path.min(axis=0) + 5)


@given(st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_a_straightened_edge_stays_near_its_points(seed: int) -> None:
    edge = wandering(seed)
    corners = straightened_edges([edge]).corners
    u = np.diff(corners, axis=0)[None]
    p = edge[:, None] - corners[None, :-1]
    t = np.clip((p * u).sum(axis=2) / np.maximum((u * u).sum(axis=2), 1e-12), 0, 1)
    away = np.hypot(*np.moveaxis(p - t[..., None] * u, -1, 0)).min(axis=1)
    assert away.max() <= CORNER_PX + 1e-9
    assert len(corners) < len(edge) / 2
    np.testing.assert_array_equal(corners[[0, -1]], edge[[0, -1]])


@given(st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_pieces_turn_clockwise_and_lie_where_they_say(seed: int) -> None:
    edges = straightened_edges([wandering(seed), wandering(seed + 1)])
    pieces = convex_pieces(edges, shortest=12)
    assert (pieces.size >= 12).all()
    assert (pieces.turn >= 0).all()
    for i in range(len(pieces.edge)):
        points = edges.points[pieces.low[i] : pieces.high[i]]
        points = points[::-1] if pieces.back[i] else points
        np.testing.assert_array_equal(points[[0, -1]], [pieces.start[i], pieces.end[i]])
        a, b = pieces.span[i]
        turns = edges.turn[a + 1 : b] * (-1 if pieces.back[i] else 1)
        assert pieces.turn[i] == pytest.approx(turns.sum())


def test_an_edge_is_cut_where_it_bends_back() -> None:
    bent = steps((10, 10), (1, 0, 40), (0, 1, 40), (1, 0, 40))
    edges = straightened_edges([bent, steps((10, 200), (1, 0, 50))])
    pieces = convex_pieces(edges, shortest=12)
    whole = whole_edges(edges)
    assert pieces.edge.tolist().count(1) == 1
    assert (pieces.size == whole.size[pieces.edge]).tolist() == (pieces.edge == 1).tolist()
    assert pieces.length[pieces.edge == 1] == pytest.approx(50)
    np.testing.assert_allclose(whole.length, [120, 50], atol=4)


def test_pieces_are_joined_around_a_square() -> None:
    square = [
        steps((20, 20), (1, 0, 60)),
        steps((85, 24), (0, 1, 60)),
        steps((80, 90), (-1, 0, 60)),
        steps((15, 86), (0, -1, 60)),
        steps((300, 300), (1, 0, 60)),
    ]
    nodes, runs = joined_paths(convex_pieces(straightened_edges(square), shortest=12))
    paths = [nodes.edge[runs.nodes[a:b]].tolist() for a, b in zip(runs.offset, runs.offset[1:], strict=False)]
    assert [0, 1, 2, 3] in [sorted(p) for p, c in zip(paths, runs.closed, strict=True) if c]
    assert all(4 not in p for p in paths)


@pytest.mark.parametrize("seed", range(3))
def test_links_are_those_that_every_pair_compared_would_give(seed: int) -> None:
    from evifuse.vision import _kernels_paths as kernels

    rng = np.random.default_rng(seed)
    n = 60
    start, end = rng.uniform(0, 120, (2, n, 2))
    first, last = (np.stack([np.cos(a), np.sin(a)], axis=1) for a in rng.uniform(0, 6.3, (2, n)))
    span = np.stack([np.arange(n), np.arange(n) + 1], axis=1)
    size = rng.permutation(n) * 2.0 + 12
    after, before = kernels.cheapest_links(start, end, first, last, span, size, 0.35, 3.0)
    cost = np.full((n, n), np.inf)
    for i, j in product(range(n), range(n)):
        if i != j and np.hypot(*(start[j] - end[i])) <= 3 + 0.35 * min(size[i], size[j]):
            cost[i, j] = kernels._link(i, j, start, end, first, last, span, size)
    for i in range(n):
        best = [j for j in np.argsort(cost[i], kind="stable")[:2] if np.isfinite(cost[i, j])]
        assert [j for j in after[i] if j >= 0] == best
        assert before[i] == (cost[:, i].argmin() if np.isfinite(cost[:, i]).any() else -1)


@given(st.integers(0, 10_000))
@settings(max_examples=20, deadline=None)
def test_outlines_are_measured_as_opencv_measures_their_hulls(seed: int) -> None:
    found = suggested([wandering(seed + k, 150) + 40 * k for k in range(3)])
    corners = found.edges.corners.astype(np.float32)
    for i, (a, b) in enumerate(zip(found.runs.offset, found.runs.offset[1:], strict=False)):
        spans = found.pieces.span[found.runs.nodes[a:b]]
        points = np.concatenate([corners[p : q + 1] for p, q in spans])
        hull = cv2.convexHull(points)
        assert found.around[i] == pytest.approx(cv2.arcLength(hull, True), rel=1e-4)
        area = found.width[i] * found.around[i] / 4
        assert area == pytest.approx(cv2.contourArea(hull), rel=1e-4, abs=1e-3)
        np.testing.assert_array_equal(found.box[i], [*points.min(axis=0), *points.max(axis=0)])


def test_link_lists_of_pieces_are_those_of_their_chains() -> None:
    edges = straightened_edges([wandering(5), wandering(6)])
    pieces = convex_pieces(edges, shortest=12)
    runs = Runs.of([2, 1], [True, False])
    chains = [edges.points[a:b] for a, b in zip(pieces.low[:3], pieces.high[:3], strict=True)]
    chains = [c[::-1] if r else c for c, r in zip(chains, pieces.back, strict=False)]
    links = link_pieces(edges.points, pieces.low, pieces.high, pieces.back, runs)
    for link, expected in zip(
        links, (link_chains(chains[:2], True), link_chains(chains[2:], False)), strict=True
    ):
        for name in ("points", "first", "starts", "ends", "closed"):
            np.testing.assert_array_equal(getattr(link, name), getattr(expected, name))


def test_no_edges_suggest_no_outline() -> None:
    assert find_outlines([]) == []
    assert find_outlines([steps((5, 5), (1, 0, 80))]) == []
