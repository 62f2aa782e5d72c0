"""The picture shows the body where the camera in the scene projects it."""

import numpy as np
import pytest

from evifuse.recordings import rotation
from evifuse.simulation.bodies import body
from evifuse.simulation.camera import look_at, photograph
from evifuse.simulation.surfaces import SURFACES, surface

NAMES = list(SURFACES)


def projected(camera, points):
    """Pixel coordinates of world points, by the pinhole formula."""
    turned = rotation.to_matrix(camera.orientation_xyzw)
    seen = (points - camera.position_m) @ turned @ camera.matrix.T
    return seen[:, :2] / seen[:, 2:]


@pytest.fixture(scope="module", params=NAMES)
def pictured(request):
    kind = surface(request.param)
    image, camera = photograph(kind, 0.0, np.random.default_rng(0))
    return kind, body(kind), image, camera


def shows_body(kind, image):
    """Mask of the body by its brightness; for a hole or slot, of what is not the top of the plate."""
    grey = image.mean(axis=2)
    return np.abs(grey - grey[0, 0]) > 4 if kind.category == "occluded" else grey > 72


def test_the_body_is_where_the_camera_projects_it(pictured):
    kind, shape, image, camera = pictured
    v, u = np.nonzero(shows_body(kind, image))
    seen = np.array([u.min(), v.min(), u.max(), v.max()])
    corners = projected(camera, shape.outline_m if kind.category == "occluded" else shape.vertices_m)
    expected = np.concatenate([corners.min(axis=0), corners.max(axis=0)])
    np.testing.assert_allclose(seen, expected, atol=1.5)


def test_the_outline_is_in_the_picture_with_room_around_it(pictured):
    kind, shape, image, camera = pictured
    assert image.shape == (camera.height, camera.width, 3) == (480, 640, 3)
    outline = projected(camera, shape.outline_m)
    assert (outline > 20).all()
    assert (outline < [620, 460]).all()
    share = shows_body(kind, image).mean()
    assert 0.1 < share < 0.5


def test_the_sites_are_seen_on_the_body(pictured):
    kind, _, image, camera = pictured
    for x, y in kind.sites:
        point = kind.above(x, y)
        u, v = np.rint(projected(camera, np.array([[x, y, 0.0] if point is None else point]))[0]).astype(int)
        bright = image[v, u].mean() > 72
        assert bright == (point is not None)


def test_edges_are_smooth(pictured):
    """Between body and table there are greys that are neither: the edges are sampled finer than a pixel."""
    kind, _, image, _ = pictured
    grey = image.astype(float).mean(axis=2)
    table = np.bincount(grey.astype(int).ravel()).argmax() if kind.name != "hole" else grey.min()
    mask = shows_body(kind, image)
    border = np.zeros_like(mask)
    border[1:-1, 1:-1] = mask[1:-1, 1:-1] & ~(
        mask[:-2, 1:-1] & mask[2:, 1:-1] & mask[1:-1, :-2] & mask[1:-1, 2:]
    )
    assert len(np.unique(grey[border].round())) > 10
    assert np.abs(grey - table).max() > 60


def test_noise_has_the_stated_size_and_comes_from_the_seed():
    kind = surface("plane")
    quiet, _ = photograph(kind, 0.0, np.random.default_rng(1))
    first, _ = photograph(kind, 3.0, np.random.default_rng(1))
    again, _ = photograph(kind, 3.0, np.random.default_rng(1))
    np.testing.assert_array_equal(first, again)
    assert 2.8 < (first.astype(float) - quiet).std() < 3.2


def test_the_camera_looks_at_the_middle_from_above():
    outline = np.array([[0.1, 0.2, 0.0], [0.2, 0.25, 0.02]])
    camera = look_at(outline)
    np.testing.assert_allclose(projected(camera, outline.mean(axis=0)[None])[0], [319.5, 239.5], atol=1e-9)
    right, up = projected(camera, outline.mean(axis=0) + 0.01 * np.eye(3)[:2])
    assert right[0] > 320
    assert up[1] < 239
