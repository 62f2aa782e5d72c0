"""The finger obeys the laws of rolling that the touch sensor relies on."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from evifuse.simulation import simulate
from evifuse.simulation.fingertip import Skin, grid_fingertip, pressures
from evifuse.simulation.procedure import Procedure
from evifuse.simulation.surfaces import surface

RADIUS_M = 0.01
CASES = [
    ("plane", {}),
    ("cylinder", {"radius_m": 0.015}),
    ("cylinder", {"radius_m": 0.06}),
    ("sphere", {"radius_m": 0.03}),
    ("bowl", {"radius_m": 0.04}),
    ("trough", {"radius_m": 0.03}),
    ("saddle", {"radius_m": 0.03}),
]
DIRECTIONS = Procedure().directions_rad


@pytest.fixture(scope="module", params=CASES, ids=lambda case: f"{case[0]}{case[1].get('radius_m', '')}")
def simulated(request):
    name, dimensions = request.param
    return simulate(name, picture=False, rate_hz=500, **dimensions)


def rolls(simulated):
    """Steady samples of every roll."""
    for number in range(8):
        samples = np.flatnonzero(simulated.truth.roll == number)
        assert len(samples) > 400
        yield samples[75:-50]


def contacts(simulated, samples):
    return simulated.truth.surface.nearest(simulated.scene.touch.position_m[samples])


def test_the_joint_turns_by_one_over_a_minus_k(simulated):
    """dpsi/ds = 1/a - K along the travelled direction, within 1 %, at every place of every roll."""
    touch, kind = simulated.scene.touch, simulated.truth.surface
    for samples in rolls(simulated):
        point, _ = contacts(simulated, samples)
        step = np.gradient(point, axis=0)
        arc = np.linalg.norm(step, axis=1)
        tangent = step / arc[:, None]
        tensors = np.array([kind.curvature_tensor(place) for place in point])
        curvature = np.einsum("ti,tij,tj->t", tangent, tensors, tangent)
        slope = np.gradient(touch.joint_angle_rad[samples]) / arc
        np.testing.assert_allclose(slope, 1 / RADIUS_M - curvature, rtol=0.01)


def test_orientation_agrees_with_the_joint(simulated):
    """The rotation between samples, about the axis perpendicular to travel, adds up to the joint's angle."""
    touch = simulated.scene.touch
    for samples in rolls(simulated):
        point, normal = contacts(simulated, samples)
        turned = Rotation.from_quat(touch.orientation_xyzw[samples])
        turn = (turned[1:] * turned[:-1].inv()).as_rotvec()
        along = np.diff(point, axis=0)
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        angle = np.einsum("ij,ij->i", turn, np.cross(normal[:-1], along)).sum()
        joint = touch.joint_angle_rad[samples]
        np.testing.assert_allclose(angle, joint[-1] - joint[0], rtol=0.002)


def test_there_is_no_slip_and_no_spin(simulated):
    """The material point of the nominal sphere at the contact is at rest."""
    touch = simulated.scene.touch
    for samples in rolls(simulated):
        _, normal = contacts(simulated, samples)
        turned = Rotation.from_quat(touch.orientation_xyzw[samples])
        turn = (turned[1:] * turned[:-1].inv()).as_rotvec()
        moved = np.diff(touch.position_m[samples], axis=0)
        slip = moved - RADIUS_M * np.cross(turn, normal[:-1])
        assert np.linalg.norm(slip.sum(axis=0)) < 0.01 * np.linalg.norm(moved.sum(axis=0))
        assert abs(np.einsum("ij,ij->i", turn, normal[:-1]).sum()) < 0.01


def test_rolls_pass_their_site_with_the_pole_down(simulated):
    touch = simulated.scene.touch
    for number, samples in enumerate(rolls(simulated)):
        site = simulated.truth.sites[number // 4].position_m
        point, _ = contacts(simulated, samples)
        assert np.linalg.norm(point - site, axis=1).min() < 5e-4
        assert np.linalg.norm(point[-1] - point[0]) > 0.006
        middle = np.abs(touch.joint_angle_rad[samples]).argmin()
        pole = -Rotation.from_quat(touch.orientation_xyzw[samples[middle]]).as_matrix()[:, 2]
        assert pole @ -contacts(simulated, samples[[middle]])[1][0] > np.cos(0.05)


def test_the_patch_stays_on_the_array_and_under_the_pole_of_contact(simulated):
    touch = simulated.scene.touch
    reach = np.arccos(-touch.fingertip.normals[:, 2])
    for samples in rolls(simulated):
        pressure = touch.pressure_pa[samples]
        _, normal = contacts(simulated, samples)
        assert (pressure.max(axis=1) > 1e5).all()
        assert pressure[:, reach > np.deg2rad(39.5)].max() < 0.05 * pressure.max()
        centre = pressure @ touch.fingertip.positions_m / pressure.sum(axis=1, keepdims=True)
        turned = Rotation.from_quat(touch.orientation_xyzw[samples]).apply(centre)
        turned /= np.linalg.norm(turned, axis=1, keepdims=True)
        assert (np.einsum("ij,ij->i", turned, -normal) > np.cos(np.deg2rad(2))).all()


def test_the_finger_is_lifted_between_rolls(simulated):
    touch, roll = simulated.scene.touch, simulated.truth.roll
    for number in range(7):
        between = np.arange(np.flatnonzero(roll == number)[-1], np.flatnonzero(roll == number + 1)[0])
        assert (touch.pressure_pa[between].max(axis=1) == 0).sum() > 100
    steps = np.linalg.norm(np.diff(touch.position_m, axis=0), axis=1)
    assert steps.max() * 500 < 1.5  # m/s: the finger never jumps
    assert np.abs(np.diff(touch.joint_angle_rad)).max() < 0.1


def test_the_finger_passes_over_what_is_between_far_sites():
    simulated = simulate(
        "sphere", radius_m=0.06, sites=((-0.04, 0.0), (0.04, 0.0)), picture=False, rate_hz=200
    )
    touch, roll = simulated.scene.touch, simulated.truth.roll
    between = np.arange(np.flatnonzero(roll == 3)[-1], np.flatnonzero(roll == 4)[0])
    height = simulated.truth.surface.distance(touch.position_m[between])
    assert (np.sort(height)[10:] > RADIUS_M - 3e-4).all()
    assert touch.pressure_pa[between].max() < 5e5
    assert height[len(height) // 3 : len(height) // 2].min() > RADIUS_M


def test_commanded_directions_are_travelled_on_a_plane_only():
    for name, apart in (("plane", 0.5), ("cylinder", 5.0)):
        simulated = simulate(name, picture=False, rate_hz=200)
        angles = []
        for number in range(4):
            samples = np.flatnonzero(simulated.truth.roll == number)
            first, last = simulated.scene.touch.position_m[samples[[0, -1]]] * [1, 1, 0]
            contact = contacts(simulated, samples[[0, -1]])[0]
            way = contact[1] - contact[0]
            angles.append(np.rad2deg(np.arctan2(way[1], way[0]) - DIRECTIONS[number]))
            assert np.linalg.norm(last - first) > 0.005
        assert (max(map(abs, angles)) < 0.5) == (apart < 1)
        assert abs(angles[0]) < 0.5


def test_the_finger_lands_without_a_blow(simulated):
    load = simulated.scene.touch.pressure_pa.sum(axis=1)
    touching = load > 0.1 * np.median(load[load > 0])
    assert load.max() < 1.3 * np.median(load[touching])


def test_pressure_is_depth_times_stiffness():
    """One taxel per case on a plane, by hand."""
    finger, kind = grid_fingertip(), surface("plane")
    upright = np.array([[0.0, 0.0, 0.0, 1.0]])
    position = np.array([[0.0, 0.0, RADIUS_M - 1e-4]])
    values = pressures(finger, Skin(3e9, 0.0), kind, position, upright)[0]
    depth = np.maximum(0.0, -(position[0, 2] + finger.positions_m[:, 2]))
    np.testing.assert_allclose(values, 3e9 * depth, rtol=1e-9, atol=1e-6)
    assert (values > 0).sum() > 5
    spread = pressures(finger, Skin(), kind, position, upright)[0]
    np.testing.assert_allclose(spread.sum(), values.sum(), rtol=1e-9)
    assert spread.max() < values.max()
    assert not pressures(finger, Skin(), kind, position + np.array([0, 0, 2e-4]), upright).any()


@pytest.mark.parametrize(
    ("name", "radius"),
    [("bowl", 0.0121), ("trough", 0.02), ("sphere", 0.015), ("saddle", 0.02), ("plane", None)],
)
def test_no_loaded_taxel_is_left_out(name, radius):
    """Against the depth of every taxel, near the contact or not."""
    kind = surface(name, **({} if radius is None else {"radius_m": radius}))
    finger = grid_fingertip()
    rng = np.random.default_rng(2)
    points = np.array([kind.above(*place) for place in rng.uniform(-2e-3, 2e-3, (20, 2))])
    centres = points + (RADIUS_M - 1.5e-4) * kind.nearest(points)[1]
    turned = Rotation.from_rotvec(rng.normal(0, 0.1, (20, 3)))
    taxels = centres[:, None] + np.einsum("tij,nj->tni", turned.as_matrix(), finger.positions_m)
    depth = np.array([np.maximum(0.0, -kind.distance(sample)) for sample in taxels])
    values = pressures(finger, Skin(1.0, 0.0), kind, centres, turned.as_quat())
    assert (values > 0).sum() > 200
    np.testing.assert_allclose(values, depth, atol=1e-9)


def test_the_taxels_are_a_grid_on_the_cap():
    finger = grid_fingertip(0.01, 0.7e-3)
    np.testing.assert_allclose(np.linalg.norm(finger.positions_m, axis=1), 0.01)
    np.testing.assert_allclose(finger.positions_m, 0.01 * finger.normals)
    assert 250 < len(finger.normals) < 350
    cosine = np.clip(finger.normals @ finger.normals.T, -1, 1)
    nearest = np.sort(np.arccos(cosine), axis=1)[:, 1] * 0.01
    assert nearest.min() > 0.55e-3
    assert nearest.max() < 0.75e-3
