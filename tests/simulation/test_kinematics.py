"""Led rolls obey the laws of rolling, for spheres and for fingers of other shapes."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from evifuse.errors import UsageError
from evifuse.recordings.recording import Fingertip
from evifuse.simulation import Noise, Procedure, simulate, surface
from evifuse.simulation.fingertip import Skin, grid_fingertip
from evifuse.simulation.kinematics import curvature_tensors
from evifuse.simulation.procedure import Finger, plan_rolls
from evifuse.touch.fingersurface import SphereSurface
from evifuse.touch.hull import HullSurface

QUICK = Procedure(directions_rad=(0.0, 0.7, 1.9), roll_s=0.3)
SMOOTH = ("plane", "cylinder", "sphere", "bowl", "trough", "saddle", "ellipsoid", "torus")


def oval(count=300, axes=(0.012, 0.009, 0.010)):
    """Taxels on the lower half of an ellipsoid, with its normals."""
    index = np.arange(count) + 0.5
    down, turn = 1 - 0.6 * index / count, np.pi * (3 - np.sqrt(5)) * index
    unit = np.stack([np.sqrt(1 - down**2) * np.cos(turn), np.sqrt(1 - down**2) * np.sin(turn), -down], axis=1)
    places, normals = unit * axes, unit / axes
    return Fingertip(0.0115, places, normals / np.linalg.norm(normals, axis=1, keepdims=True))


@pytest.mark.parametrize("name", SMOOTH)
def test_many_curvatures_at_once_are_the_tensors_of_the_surface(name):
    kind = surface(name)
    site = np.array(kind.sites[0])
    places = np.array([kind.above(*(site + beside)) for beside in ((0, 0), (1e-3, 2e-3), (-2e-3, 1e-3))])
    found = curvature_tensors(kind, *kind.nearest(places))
    np.testing.assert_allclose(found, [kind.curvature_tensor(place) for place in places], atol=1e-3)


@pytest.mark.parametrize("name", SMOOTH)
@pytest.mark.parametrize("tip", [grid_fingertip(), oval()], ids=["sphere", "oval"])
def test_no_slip_no_spin_and_one_common_tangent_plane(name, tip):
    finger = Finger.of(tip, Skin().depth_m(2.0))
    assert isinstance(finger.surface, SphereSurface) == (tip.radius_m == 0.01)
    kind = surface(name)
    for roll in plan_rolls(kind, finger, kind.sites[:1], QUICK):
        way = roll.contact
        turned = Rotation.from_quat(way.orientation_xyzw)
        on_finger, facing = finger.surface.project(way.finger_m)
        np.testing.assert_allclose(on_finger, way.finger_m, atol=1e-6)
        np.testing.assert_allclose(turned.apply(facing), -way.normal, atol=1e-4)
        np.testing.assert_allclose(kind.distance(way.point_m), 0.0, atol=1e-8)
        # both ways have the same length, and the arcs are equal steps
        step = np.diff(way.point_m, axis=0)
        moved = np.linalg.norm(step, axis=1)
        np.testing.assert_allclose(moved, np.diff(roll.arc_m), rtol=2e-3)
        np.testing.assert_allclose(np.linalg.norm(np.diff(way.finger_m, axis=0), axis=1), moved, rtol=0.01)
        # the material point in the contact is at rest, and the finger does not turn about the normal
        turn = (turned[1:] * turned[:-1].inv()).as_rotvec()
        middle = (way.centre_m(0.0)[:-1] + way.centre_m(0.0)[1:]) / 2
        contact = (way.point_m[:-1] + way.point_m[1:]) / 2
        slip = np.diff(way.centre_m(0.0), axis=0) + np.cross(turn, contact - middle)
        assert np.linalg.norm(slip, axis=1).max() < 0.02 * moved.max()
        normal = way.normal[:-1] + way.normal[1:]
        spin = np.einsum("ij,ij->i", turn, normal / np.linalg.norm(normal, axis=1, keepdims=True))
        assert abs(spin.sum()) < 0.02 * np.linalg.norm(turn, axis=1).sum()


@pytest.mark.parametrize("name", ["cylinder", "saddle", "torus"])
def test_led_and_pushed_fingers_go_the_same_way(name):
    led, pushed = (
        simulate(name, control=c, procedure=QUICK, rate_hz=500, picture=False) for c in ("pose", "force")
    )
    for number in range(6):
        ends = [
            made.scene.touch.position_m[np.flatnonzero(made.truth.roll == number)[-1]]
            for made in (led, pushed)
        ]
        np.testing.assert_allclose(*ends, atol=3e-4)


def test_rolls_over_an_edge_turn_by_its_angle():
    kind = surface("edge", opening_rad=2.0)
    finger = Finger.of(grid_fingertip(), Skin().depth_m(2.0))
    (roll,) = plan_rolls(kind, finger, ((0.0, 0.0),), Procedure(directions_rad=(np.pi / 2,)))
    flat = (roll.arc_m[-1] - roll.arc_m[0]) / 0.01
    np.testing.assert_allclose(np.ptp(roll.turn_rad), flat + (np.pi - 2.0), rtol=0.02)


def test_a_finger_of_another_shape_is_led_and_feels():
    made = simulate("sphere", fingertip=oval(), procedure=QUICK, rate_hz=200, picture=False)
    touch = made.scene.touch
    for number in range(6):
        rolling = np.flatnonzero(made.truth.roll == number)[10:]
        assert (touch.pressure_pa[rolling].max(axis=1) > 1e5).all()
    with pytest.raises(UsageError, match="only a spherical fingertip can be pressed"):
        simulate("sphere", fingertip=oval(), control="force")


def test_slip_turns_the_finger_less_and_leaves_its_way():
    sure, slipping = (
        simulate("plane", control="pose", procedure=QUICK, rate_hz=500, picture=False, noise=Noise(slip=slip))
        for slip in (0.0, 0.2)
    )
    np.testing.assert_allclose(sure.scene.touch.position_m, slipping.scene.touch.position_m, atol=1e-6)
    share = []
    for number in range(6):
        samples = np.flatnonzero(sure.truth.roll == number)
        turns = []
        for made in (sure, slipping):
            turned = Rotation.from_quat(made.scene.touch.orientation_xyzw[samples])
            turns.append((turned[-1] * turned[0].inv()).magnitude())
        share.append(1 - turns[1] / turns[0])
    assert 0.1 < np.mean(share) < 0.3


def arcs(made, touches):
    """Lengths of the contact's ways over the finger and over the surface, roll by roll."""
    touch, kind = made.scene.touch, made.truth.surface
    for number in range(3):
        samples = np.flatnonzero(made.truth.roll == number)[30:]
        foot, normal = kind.nearest(touch.position_m[samples])
        facing = Rotation.from_quat(touch.orientation_xyzw[samples]).inv().apply(-normal)
        ways = (foot if kind.name != "plane" else None, touches(facing))
        if ways[0] is None:  # the finger may be no ball: add where it touches
            turned = Rotation.from_quat(touch.orientation_xyzw[samples]).apply(ways[1])
            ways = (touch.position_m[samples] + turned, ways[1])
        yield tuple(np.linalg.norm(np.diff(way, axis=0), axis=1).sum() for way in ways)


def on_ball(facing):
    return 0.01 * facing


def on_oval(facing):
    axes = np.array([0.012, 0.009, 0.010])
    return axes**2 * facing / np.linalg.norm(axes * facing, axis=1, keepdims=True)


@pytest.mark.parametrize("slip", [0.0, 0.1, 0.3])
@pytest.mark.parametrize(
    ("name", "tip", "control", "touches"),
    [
        ("plane", None, "force", on_ball),
        ("saddle", None, "pose", on_ball),
        ("cylinder", None, "force", on_ball),
        ("plane", oval(), "pose", on_oval),
    ],
    ids=["plane-force", "saddle-pose", "cylinder-force", "oval"],
)
def test_the_ways_over_finger_and_surface_differ_by_the_share_of_slip(name, tip, control, touches, slip):
    procedure = Procedure(directions_rad=(0.0, 0.7, 1.9), roll_s=1.0)
    made = simulate(name, fingertip=tip, control=control, procedure=procedure, rate_hz=500, picture=False,
                    noise=Noise(slip=slip), sites=((0.0, 0.0),))  # fmt: skip
    for surface_m, finger_m in arcs(made, touches):
        # half a burst more or less at either end of 20 bursts
        np.testing.assert_allclose(1 - finger_m / surface_m, slip, atol=0.01 + 0.1 * slip)


def test_a_finger_that_slipped_does_not_jump_back():
    made = simulate(
        "sphere", fingertip=oval(), procedure=QUICK, rate_hz=500, picture=False, noise=Noise(slip=0.3)
    )
    touch = made.scene.touch
    turned = Rotation.from_quat(touch.orientation_xyzw)
    assert (turned[1:] * turned[:-1].inv()).magnitude().max() < 0.06
    assert np.linalg.norm(np.diff(touch.position_m, axis=0), axis=1).max() * 500 < 1.5


@pytest.mark.parametrize("control", ["force", "pose"])
def test_lost_contact_is_no_roll_and_unloaded_in_its_middle(control):
    clean, lifted = (
        simulate("cylinder", control=control, procedure=QUICK, rate_hz=500, picture=False, noise=noise)
        for noise in (Noise(), Noise(loss_of_contact=5.0))
    )
    lost = (clean.truth.roll >= 0) & (lifted.truth.roll < 0)
    assert lost.sum() > 20
    edges = np.flatnonzero(np.diff(np.concatenate([[False], lost, [False]]))).reshape(-1, 2)
    for start, stop in edges:
        if stop - start > 2:
            assert lifted.scene.touch.pressure_pa[(start + stop) // 2].max() == 0
    # but for where it is lifted the finger goes its way, and is loaded there
    kept = clean.truth.roll == lifted.truth.roll
    np.testing.assert_array_equal(kept, ~lost)
    np.testing.assert_allclose(lifted.scene.touch.position_m[kept], clean.scene.touch.position_m[kept])
    on_surface = kept & (clean.truth.roll >= 0)
    assert (lifted.scene.touch.pressure_pa[on_surface].max(axis=1) > 0).mean() > 0.99


def test_slow_poses_and_gaps():
    clean = simulate("cylinder", control="pose", procedure=QUICK, rate_hz=500, picture=False)
    slow = simulate("cylinder", control="pose", procedure=QUICK, rate_hz=500, picture=False,
                    noise=Noise(pose_rate_hz=50.0)).scene.touch  # fmt: skip
    change = np.diff(slow.position_m, n=2, axis=0)
    straight = np.abs(change).max(axis=1) < 1e-12
    assert straight.mean() > 0.8
    np.testing.assert_allclose(slow.position_m[::10], clean.scene.touch.position_m[::10])
    gone = simulate("cylinder", control="pose", procedure=QUICK, rate_hz=500, picture=False,
                    noise=Noise(gap_s=0.5))  # fmt: skip
    steps = np.diff(gone.scene.touch.time_ns) / 1e9
    assert 0.49 < steps.max() < 0.52
    assert len(gone.truth.roll) == len(gone.scene.touch.time_ns) == len(clean.truth.roll) - 250


@pytest.mark.parametrize("noise", [Noise(slip=0.5), Noise(pressure_pa=-1.0), Noise(pose_rate_hz=1.0)])
def test_impossible_noise_is_refused(noise):
    with pytest.raises(UsageError, match="of the noise"):
        simulate("plane", noise=noise)


def test_softer_skin_and_more_force_make_wider_patches():
    def loaded(skin, force):
        procedure = Procedure(directions_rad=(0.0,), roll_s=0.3, press_n=force)
        made = simulate("plane", skin=skin, procedure=procedure, control="pose", rate_hz=200, picture=False)
        middle = np.flatnonzero(made.truth.roll == 0)[40]
        return int((made.scene.touch.pressure_pa[middle] > 0).sum())

    usual = loaded(Skin(spread_m=0.0), 2.0)
    assert loaded(Skin(stiffness_pa_per_m=5e8, spread_m=0.0), 2.0) > 1.5 * usual
    assert loaded(Skin(spread_m=0.0), 8.0) > 1.5 * usual


FINE = grid_fingertip(pitch_m=0.35e-3)


@pytest.mark.parametrize("control", ["pose", "force"])
@pytest.mark.parametrize(
    ("name", "radius"),
    [("plane", None), ("sphere", 0.03), ("cylinder", 0.01), ("bowl", 0.014), ("saddle", 0.03)],
)
def test_pressures_add_up_to_the_force(name, radius, control):
    size = {} if radius is None else {"radius_m": radius}
    procedure = Procedure(directions_rad=(0.5,), roll_s=0.3)
    patches = []
    for force in (1.0, 4.0):
        how = {"control": control, "procedure": replace(procedure, press_n=force), "sites": ((0.0, 0.0),)}
        made = simulate(
            name, fingertip=FINE, skin=Skin(spread_m=0.0), rate_hz=200, picture=False, **how, **size
        )
        rolling = np.flatnonzero(made.truth.roll == 0)[15:-5]
        pressure = made.scene.touch.pressure_pa[rolling]
        total = 0.35e-3**2 * pressure.sum(axis=1)
        np.testing.assert_allclose(total.mean(), force, rtol=0.04)
        assert total.std() < 0.04 * force
        patches.append((pressure > 0).sum(axis=1).mean())
    # the area of a patch grows with the root of the force
    np.testing.assert_allclose(patches[1] / patches[0], 2.0, rtol=0.05)


@pytest.mark.parametrize("name", ["plane", "sphere", "trough", "torus", "ellipsoid"])
def test_a_led_finger_is_as_deep_in_the_surface_as_planned(name):
    kind, tip = surface(name), grid_fingertip()
    finger = Finger.of(tip, Skin().depth_m(2.0))
    rolls = plan_rolls(kind, finger, kind.sites[:1], QUICK)
    made = simulate(name, control="pose", procedure=QUICK, rate_hz=500, picture=False, sites=kind.sites[:1])
    for number, roll in enumerate(rolls):
        rolling = np.flatnonzero(made.truth.roll == number)[25:]
        gap = kind.distance(made.scene.touch.position_m[rolling]) - tip.radius_m
        np.testing.assert_allclose(gap, -roll.depth_m, atol=1e-6)


def pad():
    """Taxels of a flat pad that is bent up at its rim and a little hollow in its middle."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(-8e-3, 8e-3, 7), np.linspace(-8e-3, 8e-3, 7)))
    across = np.hypot(x, y)
    z = -0.01 + 0.1e-3 * np.exp(-((across / 3e-3) ** 2)) + 40 * np.maximum(across - 5e-3, 0.0) ** 2
    slope = (80 * np.maximum(across - 5e-3, 0.0) / np.maximum(across, 1e-9))[:, None]
    normals = np.column_stack([x, y, np.zeros_like(x)]) * slope - [0.0, 0.0, 1.0]
    return Fingertip(
        0.02, np.column_stack([x, y, z]), normals / np.linalg.norm(normals, axis=1, keepdims=True)
    )


@pytest.mark.parametrize("name", ["plane", "sphere", "bowl", "saddle", "slot"])
def test_a_pad_that_is_flat_or_hollow_rolls_and_always_feels(name):
    tip = pad()
    assert isinstance(Finger.of(tip, 1.5e-4).surface, HullSurface)
    made = simulate(name, fingertip=tip, procedure=QUICK, rate_hz=200, picture=False)
    rolling = made.truth.roll >= 0
    highest = made.scene.touch.pressure_pa[rolling].max(axis=1)
    assert (np.sort(highest)[20:] > 1e4).all()
    dimensions = vars(made.truth.surface)
    if name in ("bowl", "saddle"):
        assert dimensions["radius_m"] > vars(surface(name))["radius_m"]
    with pytest.raises(UsageError, match="smallest radius that it fits into is"):
        simulate("bowl", fingertip=tip, radius_m=0.01)


def test_the_body_that_a_pad_rolls_on_is_smooth_and_convex():
    hull = HullSurface(pad().positions_m, pad().normals, 1.5e-4)
    rng = np.random.default_rng(3)
    directions = np.column_stack([rng.normal(0, 0.2, (40, 2)), -np.ones(40)])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    points, radii, axes = hull.support(directions)
    assert (np.linalg.eigvalsh(radii) > 0).all()
    assert (directions @ hull.positions_m.T <= np.sum(points * directions, axis=1)[:, None]).all()
    step = 1e-6 * axes[:, :, 0]
    ahead, back = (hull.support((directions + s * step) / np.sqrt(1 + 1e-12))[0] for s in (1, -1))
    moved = np.einsum("mi,mia->ma", ahead - back, axes) / 2e-6
    np.testing.assert_allclose(moved, radii[:, 0], rtol=1e-3, atol=2e-4)
    feet, normals = hull.project(points + 1e-3 * directions)
    np.testing.assert_allclose(feet, points, atol=1e-8)
    np.testing.assert_allclose(normals, directions, atol=1e-6)
