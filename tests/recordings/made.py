"""Small recordings made up for the tests."""

import numpy as np

from evifuse.recordings import Camera, Fingertip, Scene, TouchRecording

START_NS = 1_700_000_000_000_000_000


def made_touch(samples: int = 40, taxels: int = 5, seed: int = 0) -> TouchRecording:
    """Numbers without a meaning, but valid."""
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(taxels, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    quaternions = rng.normal(size=(samples, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    return TouchRecording(
        Fingertip(0.01, 0.01 * normals, normals),
        START_NS + np.cumsum(rng.integers(500_000, 1_500_000, samples)),
        rng.normal(size=(samples, 3)),
        quaternions,
        rng.normal(size=samples),
        rng.uniform(0, 1e5, (samples, taxels)) * (rng.random((samples, taxels)) < 0.3),
        "made",
    )


def made_camera(width: int = 64, height: int = 48) -> Camera:
    matrix = np.array([[80.0, 0.0, 31.5], [0.0, 80.0, 23.5], [0.0, 0.0, 1.0]])
    return Camera(width, height, matrix, np.array([0.1, -0.2, 0.5]), np.array([1.0, 0.0, 0.0, 0.0]))


def made_scene(samples: int = 40, taxels: int = 5, seed: int = 0) -> Scene:
    rng = np.random.default_rng(seed)
    image = rng.integers(0, 256, (48, 64, 3), dtype=np.uint8)
    return Scene(image, made_camera(), made_touch(samples, taxels, seed), "made")


def assert_same_touch(first: TouchRecording, second: TouchRecording, pressure_rtol: float = 1e-6) -> None:
    np.testing.assert_array_equal(first.time_ns, second.time_ns)
    np.testing.assert_allclose(first.fingertip.radius_m, second.fingertip.radius_m, rtol=1e-12)
    np.testing.assert_allclose(first.fingertip.positions_m, second.fingertip.positions_m, rtol=1e-12)
    np.testing.assert_allclose(first.fingertip.normals, second.fingertip.normals, rtol=1e-12)
    np.testing.assert_allclose(first.position_m, second.position_m, rtol=1e-12)
    np.testing.assert_allclose(first.orientation_xyzw, second.orientation_xyzw, rtol=1e-9)
    np.testing.assert_allclose(first.joint_angle_rad, second.joint_angle_rad, rtol=1e-12)
    np.testing.assert_allclose(first.pressure_pa, second.pressure_pa, rtol=pressure_rtol)
