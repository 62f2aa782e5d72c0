import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from evifuse.recordings import rotation


def random_quaternions(seed: int, count: int) -> np.ndarray:
    quaternions = np.random.default_rng(seed).normal(size=(count, 4))
    return quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)


@given(st.integers(0, 10**6))
def test_agrees_with_scipy(seed):
    first, second = random_quaternions(seed, 2)
    vector = np.random.default_rng(seed).normal(size=3)
    ours, theirs = rotation.multiply(first, second), Rotation.from_quat(first) * Rotation.from_quat(second)
    np.testing.assert_allclose(rotation.to_matrix(ours), theirs.as_matrix(), atol=1e-12)
    np.testing.assert_allclose(
        rotation.rotate(first, vector), Rotation.from_quat(first).apply(vector), atol=1e-12
    )


@given(st.integers(0, 10**6))
def test_matrix_and_quaternion_are_inverse(seed):
    quaternion = random_quaternions(seed, 1)[0]
    again = rotation.to_quaternion(rotation.to_matrix(quaternion))
    np.testing.assert_allclose(again * np.sign(quaternion[3]), quaternion, atol=1e-9)


@pytest.mark.parametrize("axis", np.eye(3))
def test_half_turns_are_recovered(axis):
    half_turn = rotation.about_axis(axis, np.pi)
    matrix = rotation.to_matrix(half_turn)
    np.testing.assert_allclose(rotation.to_matrix(rotation.to_quaternion(matrix)), matrix, atol=1e-12)


@given(st.integers(0, 10**6))
def test_interpolation_agrees_with_scipy(seed):
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.1, 1.0, 6))
    known = random_quaternions(seed, 6)
    at = np.append(rng.uniform(times[0], times[-1], 10), times)
    ours = rotation.interpolate(times, known, at)
    theirs = Slerp(times, Rotation.from_quat(known))(at).as_matrix()
    np.testing.assert_allclose(rotation.to_matrix(ours), theirs, atol=1e-7)


def test_interpolation_ignores_signs_and_holds_a_single_orientation():
    known = random_quaternions(3, 4)
    times, at = np.arange(4.0), np.linspace(0, 3, 13)
    flipped = known * np.array([[1], [-1], [-1], [1]])
    ours, other = rotation.interpolate(times, known, at), rotation.interpolate(times, flipped, at)
    np.testing.assert_allclose(rotation.to_matrix(ours), rotation.to_matrix(other), atol=1e-12)
    assert (rotation.interpolate(times[:1], known[:1], at) == known[0]).all()


def test_interpolation_between_equal_orientations():
    known = np.repeat(random_quaternions(5, 1), 2, axis=0)
    at = np.array([0.0, 0.3, 1.0])
    np.testing.assert_allclose(rotation.interpolate(np.array([0.0, 1.0]), known, at), known[[0, 0, 0]])
