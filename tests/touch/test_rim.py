"""The pull of an array's rim on a wide patch: what is seen of it, and that it is undone."""

import numpy as np

from evifuse.recordings.recording import Fingertip
from evifuse.simulation import grid_fingertip
from evifuse.touch._kernels_contact import held, match
from evifuse.touch.profile import Profile, pressure_profile
from evifuse.touch.rim import without_rim

A_M, SPREAD_M, CONTACT_M = 0.01, 2e-3, 1.6e-3


def ways(furthest_rad: float) -> np.ndarray:
    """Contacts along two meridians of a finger that points down."""
    angle = np.linspace(-furthest_rad, furthest_rad, 241)
    along = np.stack([np.sin(angle), np.zeros_like(angle), -np.cos(angle)], axis=1)
    return np.concatenate([along, along[:, [1, 0, 2]]])


def felt(tip: Fingertip, contact: np.ndarray, conserved: bool) -> tuple[np.ndarray, np.ndarray, Profile]:
    """Where wide patches seem to be: directions, heights and profile."""
    apart = np.square(tip.positions_m[None] - A_M * contact[:, None]).sum(axis=2)
    own = np.maximum(1 - apart / CONTACT_M**2, 0.0)
    between = np.square(tip.positions_m[:, None] - tip.positions_m[None]).sum(axis=2)
    weight = np.exp(-between / (2 * SPREAD_M**2))
    weight /= weight.sum(axis=1, keepdims=True) if conserved else weight.sum(axis=1).max()
    pressure, place = 1e5 * own @ weight, contact
    height, profile = np.zeros(len(contact)), Profile(1, 0.011, 0.0)
    for _ in range(2):
        profile = pressure_profile(tip, pressure, A_M * place, 0.011)
        place, height = match(
            pressure, np.arange(len(contact)), place, tip.positions_m, A_M, profile.reach_m, profile.power, 3
        )
    return place, height, profile


def stretch(place: np.ndarray, contact: np.ndarray) -> float:
    """By how much the angle from the pole is too large, as a share."""
    true = contact[:, :2]
    return float(np.sum((place[:, :2] - true) * true) / np.sum(true**2))


def test_the_share_on_the_array_and_its_slope():
    tip, contact = grid_fingertip(A_M), ways(0.5)[::40]
    share, slope = held(contact, tip.positions_m, A_M, 5e-3, 3)
    apart = tip.positions_m[None] - A_M * contact[:, None]
    left = np.maximum(1 - np.square(apart).sum(axis=2) / 5e-3**2, 0.0)
    total = (left**3).sum(axis=1)
    pull = np.einsum("mj,mji->mi", 6 * left**2 / 5e-3**2, apart)
    pull -= np.sum(pull * contact, axis=1, keepdims=True) * contact
    np.testing.assert_allclose(share, total / total.max(), rtol=1e-9)
    np.testing.assert_allclose(slope, pull / total[:, None], rtol=1e-9, atol=1e-9)


def test_the_pull_of_a_rim_that_keeps_all_pressure_is_undone():
    tip, contact = grid_fingertip(A_M), ways(0.45)
    place, height, profile = felt(tip, contact, conserved=True)
    moved = without_rim(tip, place, height, profile)
    assert stretch(place, contact) > 0.008
    assert abs(stretch(moved, contact)) < 0.004
    np.testing.assert_allclose(np.linalg.norm(moved, axis=1), 1.0)


def test_where_heights_do_not_grow_hardly_anything_is_moved():
    tip, contact = grid_fingertip(A_M), ways(0.45)
    place, height, profile = felt(tip, contact, conserved=False)
    moved = without_rim(tip, place, height, profile)
    assert abs(stretch(moved, contact)) < 0.004
    alone = without_rim(tip, place, np.zeros(len(place)), profile)
    np.testing.assert_allclose(alone, place, rtol=0, atol=1e-12)
