import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from evifuse.errors import UsageError
from evifuse.simulation.bodies import body
from evifuse.simulation.surfaces import SURFACES, surface
from evifuse.simulation.truth import primitive_of

NAMES = list(SURFACES)
SMOOTH = [name for name in NAMES if surface(name).category not in ("occluded", "edge")]


def near(kind, seed, count=1):
    """Points up to 5 mm beside surface points around the sites."""
    rng = np.random.default_rng(seed)
    places = [kind.above(*(np.array(kind.sites[0]) + rng.uniform(-4e-3, 4e-3, 2))) for _ in range(count)]
    return np.array(places) + rng.uniform(-3e-3, 3e-3, (count, 3))


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=25)
@given(st.integers(0, 10**6))
def test_nearest_is_nearest(name, seed):
    """Against a general minimiser over the height map."""
    kind = surface(name)
    point = near(kind, seed)
    foot, normal = (values[0] for values in kind.nearest(point))
    np.testing.assert_allclose(np.linalg.norm(normal), 1.0, rtol=1e-12)
    np.testing.assert_allclose(np.cross(foot - point[0], normal), 0.0, atol=1e-9)
    np.testing.assert_allclose(kind.above(*foot[:2]), foot, atol=1e-9)

    def squared(at):
        place = kind.above(*(at * 1e-3))
        return 1e3 if place is None else 1e6 * np.sum((place - point[0]) ** 2)

    found = minimize(
        squared, point[0, :2] * 1e3, method="Nelder-Mead", options={"xatol": 1e-7, "fatol": 1e-12}
    )
    np.testing.assert_allclose(found.x * 1e-3, foot[:2], atol=1e-7)


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=30)
@given(st.integers(0, 10**6))
def test_many_points_at_once_are_the_same_as_one_by_one(name, seed):
    kind = surface(name)
    points = near(kind, seed, 5)
    single = np.array([kind.nearest(point[None])[0][0] for point in points])
    np.testing.assert_allclose(kind.nearest(points)[0], single, atol=1e-9)
    plain = np.array([kind.nearest_one(*point) for point in points.tolist()])
    np.testing.assert_allclose(plain, np.stack(kind.nearest(points), axis=1), atol=1e-9)


@pytest.mark.parametrize("name", SMOOTH)
@given(st.integers(0, 10**6), st.floats(0, np.pi))
def test_curvature_agrees_with_how_the_surface_leaves_its_tangent(name, seed, angle):
    kind = surface(name)
    point, normal = (values[0] for values in kind.nearest(near(kind, seed)))
    first, second = np.linalg.svd(normal[None])[2][1:]
    tangent = np.cos(angle) * first + np.sin(angle) * second
    tensor = kind.curvature_tensor(point)
    np.testing.assert_allclose(tensor @ normal, 0.0, atol=1e-9)
    step = 2e-4
    rise = [-kind.distance((point + sign * step * tangent)[None])[0] for sign in (-1, 1)]
    np.testing.assert_allclose(sum(rise) / step**2, tangent @ tensor @ tangent, atol=0.02)
    k1, k2 = kind.principal_curvatures(point)
    assert k2 - 1e-9 <= tangent @ tensor @ tangent <= k1 + 1e-9


@pytest.mark.parametrize(
    ("name", "radius", "expected"),
    [
        ("cylinder", 0.02, (0.0, -50.0)),
        ("sphere", 0.05, (-20.0, -20.0)),
        ("bowl", 0.05, (20.0, 20.0)),
        ("trough", 0.02, (50.0, 0.0)),
        ("saddle", 0.04, (25.0, -25.0)),
    ],
)
def test_concave_up_is_positive(name, radius, expected):
    np.testing.assert_allclose(
        surface(name, radius_m=radius).principal_curvatures(np.zeros(3)), expected, atol=1e-9
    )


def test_the_hole_is_a_hole():
    hole = surface("hole", radius_m=0.02)
    assert hole.above(0.0, 0.0) is None
    assert hole.above(0.019, 0.0) is None
    np.testing.assert_array_equal(hole.above(0.021, 0.0), [0.021, 0.0, 0.0])
    np.testing.assert_allclose(
        hole.distance(np.array([[0.016, 0.0, 0.003], [0.0, 0.03, 0.003]])), [0.005, 0.003]
    )


@pytest.mark.parametrize("name", NAMES)
def test_there_is_nothing_to_touch_beside_the_body(name):
    assert surface(name).above(1.0, 1.0) is None


def test_the_catalogue_names_what_is_unknown():
    with pytest.raises(UsageError, match="plane, cylinder, sphere, bowl, trough, saddle, hole"):
        surface("cube")
    with pytest.raises(UsageError, match="no dimension 'depth_m'"):
        surface("plane", depth_m=1.0)
    for value in (0.0, -1.0, np.nan):
        with pytest.raises(UsageError, match="radius_m of surface 'sphere' must be positive"):
            surface("sphere", radius_m=value)


@pytest.mark.parametrize("name", NAMES)
def test_bodies_are_closed_and_carry_their_surface(name):
    shape = body(surface(name))
    _, same = np.unique(shape.vertices_m.round(9), axis=0, return_inverse=True)
    faces = same.ravel()[shape.faces]
    faces = faces[[len(set(face)) == 3 for face in faces.tolist()]]
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    forward, back = sorted(map(tuple, edges.tolist())), sorted(map(tuple, edges[:, ::-1].tolist()))
    assert forward == back
    corners = shape.vertices_m[shape.faces]
    assert np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) > 0
    assert shape.vertices_m[:, 2].min() >= shape.table_m - 1e-9
    for site in surface(name).sites:
        if surface(name).above(*site) is not None:
            apart = np.linalg.norm(shape.vertices_m - surface(name).above(*site), axis=1)
            assert apart.min() < 0.25


@pytest.mark.parametrize(
    ("k1", "k2", "primitive"),
    [(0.0, -500.0, "C-"), (-500.0, -500.0, "E-"), (0.0, -850.0, "edge"), (-850.0, -900.0, "edge")],
)
def test_a_dome_is_an_edge_below_an_eighth_of_the_fingertip(k1, k2, primitive):
    assert primitive_of(k1, k2, 0.01) == primitive
