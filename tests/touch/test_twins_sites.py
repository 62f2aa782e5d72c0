"""Compiled loops over a site's samples give what plain NumPy gives."""

import numpy as np
import pytest

from evifuse.recordings.rotation import rotate
from evifuse.touch import _kernels_contact as contact
from evifuse.touch import _kernels_rolls as rolls
from evifuse.touch import _kernels_sites as sites
from evifuse.touch.quantiles import median_of, quantile_of


@pytest.fixture
def random() -> np.random.Generator:
    return np.random.default_rng(11)


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


@pytest.mark.parametrize("count", [1, 2, 7, 64, 301])
def test_quantiles(random: np.random.Generator, count: int) -> None:
    values = random.integers(0, 40, count) * 0.3
    before = values.copy()
    assert median_of(values) == pytest.approx(np.median(values), abs=1e-12)
    for share in (0.0, 0.05, 0.75, 0.9, 1.0):
        assert quantile_of(values, share) == pytest.approx(np.percentile(values, 100 * share), abs=1e-12)
    assert np.array_equal(values, before)  # what is given stays as it was


def test_placed(random: np.random.Generator) -> None:
    turn, place = unit(random.normal(size=(30, 4))), random.normal(size=(30, 3))
    rows = np.flatnonzero(random.random(30) < 0.6)
    felt = unit(random.normal(size=(len(rows), 3)))
    direction, normal, point = np.zeros((30, 3)), np.zeros((30, 3)), np.zeros((30, 3))
    direction[rows], normal[rows] = felt, -rotate(turn[rows], felt)
    point = place - 0.01 * normal
    for one, other in zip(
        contact.placed(rows, felt, turn, place, 0.01), (direction, normal, point), strict=True
    ):
        assert one == pytest.approx(other, abs=1e-12)


def test_least_along(random: np.random.Generator) -> None:
    values, samples, way = random.normal(size=(40, 3)), np.arange(5, 31, 2), unit(random.normal(size=3))
    assert rolls.least_along(values, samples, way) == pytest.approx((values[samples] @ way).min(), abs=1e-12)


def test_active_taxels_and_spread(random: np.random.Generator) -> None:
    pressure = random.gamma(0.5, 100.0, (50, 23)) - 20.0
    positions, samples = 0.01 * unit(random.normal(size=(23, 3))), np.arange(3, 50, 4)
    own = pressure[samples]
    above = np.maximum(own - np.maximum(60.0, 0.15 * own.max(axis=1, keepdims=True)), 0.0)
    many = above.sum(axis=1) ** 2 / np.maximum(np.square(above).sum(axis=1), 1e-300)
    assert sites.active_taxels(pressure, samples, 60.0, 0.15) == pytest.approx(many, rel=1e-12)
    above = np.maximum(own - 60.0, 0.0)
    total = above.sum(axis=1, keepdims=True)
    apart = positions - (above @ positions / total)[:, None]
    spread = (above * np.square(apart).sum(axis=2)).sum(axis=1) / total[:, 0]
    assert sites.patch_spread(pressure, samples, 60.0, positions) == pytest.approx(spread, rel=1e-9)
    pressure[samples[0], 4] = np.nan  # says nothing
    without = np.where(np.isnan(pressure), 0.0, pressure)
    assert np.array_equal(
        sites.patch_spread(pressure, samples, 60.0, positions),
        sites.patch_spread(without, samples, 60.0, positions),
    )


def test_best_profile(random: np.random.Generator) -> None:
    powers, ends = np.array([1, 2, 3, 6]), np.geomspace(1e-3, 6e-3, 30)
    for power, reach in ((1, 3e-3), (3, 5e-3), (6, 4e-3)):
        size = random.integers(0, 400, 24).astype(np.float64)
        r = np.linspace(0.0, 6e-3, 24)
        height = 900.0 * np.maximum(1 - r**2 / reach**2, 0.0) ** power + random.normal(0, 5.0, 24)
        total, squares, kept = size * height, size * r**2, size > 0
        weight, mean = np.minimum(size[kept], 200.0), height[kept]
        left = np.maximum(1 - r[kept] ** 2 / ends[:, None] ** 2, 0.0)
        shape = np.stack([left**p for p in powers])
        own, along = shape**2 @ weight, shape @ (weight * mean)
        gain = np.where(own > 0, along**2 / np.maximum(own, 1e-300), 0.0)
        best, width = np.unravel_index(int(np.argmax(gain)), gain.shape)
        found = sites.best_profile(size, total, squares, ends, powers)
        assert (found[0], found[1]) == (best, ends[width])
        assert found[2] == pytest.approx(along[best, width] / own[best, width], rel=1e-9)


def test_depths(random: np.random.Generator) -> None:
    place, touching = 0.02 * random.normal(size=(60, 3)), random.random(60) < 0.3
    centre = 0.005 * random.normal(size=(3, 3))
    frame = np.stack([np.linalg.qr(random.normal(size=(3, 3)))[0] for _ in range(3)])
    angle, first, second = random.random(3), random.normal(0, 60, 3), random.normal(0, 60, 3)
    every = np.full((60, 3), np.inf)
    for s in range(3):
        x, y, z = ((place - centre[s]) @ frame[s]).T
        a, b = x * np.cos(angle[s]) + y * np.sin(angle[s]), y * np.cos(angle[s]) - x * np.sin(angle[s])
        expected = np.minimum(0.5 * (first[s] * a**2 + second[s] * b**2), 0.0)
        every[:, s] = np.where((np.hypot(x, y) <= 0.03) & ~touching, expected - z, np.inf)
    turn = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    nearest, least, most = sites.depths(place, touching, centre, frame, turn, first, second, 0.03)
    assert np.array_equal(nearest, every.argmin(axis=1))
    assert least == pytest.approx(every.min(axis=1), abs=1e-12)
    assert most == pytest.approx(np.where(np.isfinite(every), every, -np.inf).max(axis=1), abs=1e-12)
    assert np.isinf(least[~touching]).any()  # some are out of reach
