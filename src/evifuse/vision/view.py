"""The view of a known plane: outlines judged as they lie on it, not as perspective shows them.

A square that is seen obliquely is a quadrilateral of the picture with unlike sides and skew corners. With
the camera matrix and the plane on which things lie, each outline is seen as from straight above, about as
large as in the picture, judged there, and brought back. All of it is our own.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.candidates import Candidates
from evifuse.vision.conics import mapped_ellipse
from evifuse.vision.fit import FittedEdges
from evifuse.vision.lifting import Plane, basis_of, rays_of
from evifuse.vision.link import LinkList
from evifuse.vision.primitives import Geometry, Outlines, Proposals, outlines_of
from evifuse.vision.strokes import Strokes
from evifuse.vision.working import WorkingPicture

__all__ = ["FromAbove", "View", "from_above"]

MOST_STRETCH = 8.0
"""An outline that the view from above would stretch so much more one way than the other is judged as it is
seen: so near the horizon, little is known of its shape (our own)."""


LEAST_AHEAD = 0.02
"""A primitive with a point that is further away than the outline by the inverse of this is none (our own)."""


@dataclass(frozen=True, eq=False)
class View:
    """A camera that looks at a plane.

    Parameters
    ----------
    matrix : array_like of float, shape (3, 3)
        Camera matrix K, px, of a picture free of lens distortion (see
        `evifuse.recordings.intrinsics.undistorted`).
    plane : Plane
        Where things lie, camera frame, metres; what counts here is its direction.

    Raises
    ------
    UsageError
        If K is not a camera's.

    Examples
    --------
    A table that the camera looks down on at 45 degrees, 0.6 m away:

    >>> view = View([[800, 0, 320], [0, 800, 240], [0, 0, 1]], Plane(np.array([0, 1, 1]), 0.6))
    >>> view.matrix.shape
    (3, 3)
    """

    matrix: NDArray[np.float64]
    plane: Plane

    def __post_init__(self) -> None:
        rays_of([0.0, 0.0], self.matrix)
        object.__setattr__(self, "matrix", np.asarray(self.matrix, np.float64))

    def homography(self) -> NDArray[np.float64]:
        """From pixels (u, v, 1) to coordinates of the plane.

        Returns
        -------
        ndarray of float64, shape (3, 3)
            Its third component is positive where the plane is seen, 0 on its horizon.
        """
        across, along = basis_of(self.plane.normal)
        towards = self.plane.normal / self.plane.distance_m
        return np.stack([across, along, towards]) @ np.linalg.inv(self.matrix)


@dataclass(frozen=True, eq=False)
class FromAbove:
    """Outlines and their strokes as they are seen from straight above.

    Parameters
    ----------
    outlines : Outlines
        From above.
    strokes : Strokes
        From above.
    homographies : ndarray of float64, shape (B, 3, 3)
        Of each outline, from the working picture to the view from above.
    seen : Outlines
        The outlines of the working picture.
    """

    outlines: Outlines
    strokes: Strokes
    homographies: NDArray[np.float64]
    seen: Outlines

    def back(self, candidates: Candidates) -> Candidates:
        """What was judged from above, where it is in the working picture.

        Parameters
        ----------
        candidates : Candidates
            Of the outlines from above.

        Returns
        -------
        Candidates
            With the same beliefs.
        """
        inverse = np.asarray(np.linalg.inv(self.homographies), np.float64)
        proposals = tuple(_back(p, inverse) for p in candidates.proposals)
        return replace(candidates, outlines=self.seen, proposals=proposals)


def from_above(outlines: Outlines, strokes: Strokes, view: View, working: WorkingPicture) -> FromAbove:
    """See outlines from straight above the plane.

    Parameters
    ----------
    outlines : Outlines
        In working pixels.
    strokes : Strokes
        In working pixels.
    view : View
        Of the picture, not of the working one.
    working : WorkingPicture
        What the outlines were found in.

    Returns
    -------
    FromAbove
        Each outline in pixels of its own, which in its middle cover the same area as those of the working
        picture; an outline that does not lie on the plane in front of the camera is as it was.
    """
    origin, ahead = working.point(np.array([[0.0, 0.0], [1.0, 1.0]]))
    step = ahead - origin
    to_picture = np.array([[step[0], 0.0, origin[0]], [0.0, step[1], origin[1]], [0.0, 0.0, 1.0]])
    whole = view.homography() @ to_picture
    homographies = np.stack([_upright(whole, p) for p in outlines.points])
    links = tuple(_link(link, h) for link, h in zip(outlines.links, homographies, strict=True))
    return FromAbove(outlines_of(links), _seen(homographies[:, None], strokes), homographies, outlines)


def _upright(whole: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """The homography, made to keep the middle of one outline, its area there and its direction."""
    middle = points.mean(axis=0)
    to_middle = np.array([[1.0, 0.0, middle[0]], [0.0, 1.0, middle[1]], [0.0, 0.0, 1.0]])
    own = whole @ to_middle
    ahead = (points - middle) @ own[2, :2] + own[2, 2]
    if not (own[2, 2] > 0 and ahead.min() > 0):
        return np.eye(3)
    own = own / own[2, 2]
    slope = own[:2, :2] - np.outer(own[:2, 2], own[2, :2])
    u, stretch, v = np.linalg.svd(slope)
    if stretch[0] > MOST_STRETCH * stretch[1] or ahead.max() > MOST_STRETCH * ahead.min():
        return np.eye(3)
    turn = (u @ v).T / np.sqrt(stretch[0] * stretch[1])
    moved = np.eye(3)
    moved[:2, :2] = turn
    moved[:2, 2] = middle - turn @ own[:2, 2]
    from_middle = to_middle.copy()
    from_middle[:2, 2] = -middle
    return np.asarray(moved @ own @ from_middle, np.float64)


def _seen(homography: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (..., 2) through homographies (..., 3, 3)."""
    mapped = (homography[..., :2] @ points[..., None])[..., 0] + homography[..., 2]
    return mapped[..., :2] / mapped[..., 2:]


def _link(link: LinkList, homography: NDArray[np.float64]) -> LinkList:
    points, starts, ends = (_seen(homography, p) for p in (link.points, link.starts, link.ends))
    return replace(link, points=points, starts=starts, ends=ends)


def _back(found: Proposals, inverse: NDArray[np.float64]) -> Proposals:
    """One primitive's proposals in the working picture."""
    edges = found.edges
    ahead = (found.shape @ inverse[:, 2, :2, None])[..., 0] + inverse[:, None, 2, 2]
    if edges is not None:
        starts, ends = (_seen(inverse[:, None], p) for p in (edges.starts, edges.ends))
        edges = FittedEdges(starts, ends, edges.beliefs)
    return replace(
        found,
        proposed=found.proposed & (np.nan_to_num(ahead).min(axis=1) > LEAST_AHEAD),
        shape=_seen(inverse[:, None], found.shape),
        geometry=_geometry(found.geometry, inverse),
        edges=edges,
    )


def _geometry(above: Callable[[int], Geometry], inverse: NDArray[np.float64]) -> Callable[[int], Geometry]:
    """Where primitives lie in the working picture; a circle is seen as an ellipse."""

    def seen(i: int) -> Geometry:
        geometry = above(i)
        if "corners" in geometry:
            corners = np.asarray(geometry["corners"], np.float64)
            return {**geometry, "corners": _seen(inverse[i], corners).tolist()}
        if "centre" not in geometry:
            return geometry
        diameter = 2 * np.asarray(geometry.pop("radius", 0.0), np.float64)
        centre, axes, angle = mapped_ellipse(
            np.asarray(geometry["centre"], np.float64),
            np.asarray(geometry.get("axes", [diameter, diameter]), np.float64),
            np.asarray(geometry.get("angle_rad", 0.0), np.float64),
            inverse[i],
        )
        return {**geometry, "centre": centre.tolist(), "axes": axes.tolist(), "angle_rad": float(angle)}

    return seen
