"""Which object of a picture the finger touched: the contact projected into it, or a given box."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import UsageError
from evifuse.recordings.recording import Camera
from evifuse.recordings.rotation import to_matrix

__all__ = ["Box", "Touched", "find_touched", "overlap", "project"]

Box = tuple[float, float, float, float]
"""A pixel box ``(x, y, width, height)`` with the origin at the top left corner of the image."""


@dataclass(frozen=True)
class Touched:
    """Which object was touched, and what had to be assumed.

    Parameters
    ----------
    index : int or None
        Position in the list of boxes; None if there is nothing to choose.
    pixel : tuple of float or None
        Where the contact is in the image, px.
    warning : str or None
        What was assumed, in a line.
    """

    index: int | None
    pixel: tuple[float, float] | None
    warning: str | None


def project(camera: Camera, point_m: NDArray[np.float64]) -> tuple[float, float] | None:
    """Pixel of a world point through a pinhole camera.

    Parameters
    ----------
    camera : Camera
        Intrinsics and pose.
    point_m : ndarray of float64, shape (3,)
        Point in the world frame, metres.

    Returns
    -------
    tuple of float or None
        ``(u, v)`` in px; None if the point is behind the camera.
    """
    x, y, z = to_matrix(camera.orientation_xyzw).T @ (point_m - camera.position_m)
    if z <= 0:
        return None
    u, v, w = camera.matrix @ np.array([x, y, z])
    return float(u / w), float(v / w)


def overlap(a: Box, b: Box) -> float:
    """Intersection over union of two boxes.

    Parameters
    ----------
    a : tuple of float
        First box, px.
    b : tuple of float
        Second box, px.

    Returns
    -------
    float
        In [0, 1].
    """
    width = max(0.0, min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0]))
    height = max(0.0, min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1]))
    both = width * height
    return both / (a[2] * a[3] + b[2] * b[3] - both) if both else 0.0


def _distance(box: Box, pixel: tuple[float, float]) -> float:
    dx = max(box[0] - pixel[0], 0.0, pixel[0] - box[0] - box[2])
    dy = max(box[1] - pixel[1], 0.0, pixel[1] - box[1] - box[3])
    return float(np.hypot(dx, dy))


def find_touched(
    boxes: Sequence[Box],
    *,
    box: Box | None = None,
    camera: Camera | None = None,
    contact_m: NDArray[np.float64] | None = None,
) -> Touched:
    """Which of several objects was touched.

    Parameters
    ----------
    boxes : sequence of tuple of float
        Pixel boxes of the objects, most prominent first.
    box : tuple of float, optional
        Where to look, px: the object that overlaps it most.
    camera : Camera, optional
        With ``contact_m``: the smallest object that holds the projected contact, else the nearest.
    contact_m : ndarray of float64, shape (3,), optional
        Where the finger met the surface (or expected to), world frame, metres.

    Returns
    -------
    Touched
        The choice; without box, camera or contact the most believed, and a warning if there are several.

    Raises
    ------
    UsageError
        If the box has no area.
    """
    if box is not None and not (box[2] > 0 and box[3] > 0):
        raise UsageError(f"--box x,y,w,h needs a width and a height above 0, not {box[2]:g} x {box[3]:g}")
    if not boxes:
        return Touched(None, None, None)
    if box is not None:
        shares = [overlap(box, other) for other in boxes]
        best = int(np.argmax(shares))
        if shares[best] > 0:
            return Touched(best, None, None)
        return Touched(None, None, f"no object was found in the box {tuple(box)}")
    pixel = project(camera, contact_m) if camera is not None and contact_m is not None else None
    if pixel is not None:
        distances = [_distance(other, pixel) for other in boxes]
        inside = [i for i, d in enumerate(distances) if d == 0]
        if inside:
            return Touched(min(inside, key=lambda i: boxes[i][2] * boxes[i][3]), pixel, None)
        nearest = int(np.argmin(distances))
        text = (
            f"the contact projects to ({pixel[0]:.0f}, {pixel[1]:.0f}) px, outside every object: the nearest"
        )
        return Touched(nearest, pixel, f"{text}, {distances[nearest]:.0f} px away, is taken")
    if len(boxes) > 1:
        why = "no camera pose" if camera is None else "no contact"
        text = f"the picture shows {len(boxes)} objects and there is {why} to tell which was touched"
        return Touched(0, None, f"{text}: the most believed is taken (or give --box x,y,w,h)")
    return Touched(0, None, None)
