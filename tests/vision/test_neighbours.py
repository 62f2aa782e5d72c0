"""Edges that may belong to one object, against every pair compared."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from evifuse.vision.group import SHARED, same_object
from evifuse.vision.outlines import MAX_CHAINS, MOST_STROKES, NEAR, neighbours


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 9999), st.integers(1, 60), st.floats(50, 900))
def test_neighbours_are_those_of_every_pair_compared(seed: int, count: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    chains = [rng.uniform(0, 60, (5, 2)) * rng.random(2) + rng.uniform(0, spread, 2) for _ in range(count)]
    group = list(range(count))
    for i, a in enumerate(chains):
        for j, b in enumerate(chains):
            apart = np.maximum(a.min(axis=0) - b.max(axis=0), b.min(axis=0) - a.max(axis=0)).max()
            if apart <= NEAR * max(np.ptp(a, axis=0).max(), np.ptp(b, axis=0).max()):
                old, new = group[j], group[i]
                group = [new if k == old else k for k in group]
    expected = [[i for i in range(count) if group[i] == k] for k in dict.fromkeys(group)]
    assert neighbours(chains) == sorted(g for g in expected if len(g) <= MOST_STROKES)


def test_nothing_and_too_much_have_no_neighbours() -> None:
    assert neighbours([]) == []
    assert neighbours([np.eye(2) + 40 * i for i in range(MAX_CHAINS + 1)]) == []


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 9999), st.floats(1.5, 20))
def test_same_object_is_that_of_every_pair_compared(seed: int, most: float) -> None:
    rng = np.random.default_rng(seed)
    low = rng.integers(0, 12, (20, 2)).astype(float)
    boxes = np.concatenate([low, low + rng.integers(1, 9, (20, 2))], axis=1)
    boxes[5] = np.nan
    together = same_object(boxes, most)
    for i, a in enumerate(boxes):
        for j, b in enumerate(boxes):
            wide, high = (max(0.0, min(a[k + 2], b[k + 2]) - max(a[k], b[k])) for k in (0, 1))
            small, large = sorted(float((box[2] - box[0]) * (box[3] - box[1])) for box in (a, b))
            known = not np.isnan(small + large)
            assert together[i, j] == (known and wide * high > SHARED * small and large < most * small)
