"""What is true about a simulated scene."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.simulation.surface import Surface
from evifuse.touch.edges import SHARP
from evifuse.touch.primitives import curvature_threshold_per_m
from evifuse.touch.rolling import tangents

__all__ = ["SiteTruth", "Truth", "primitive_of", "site_truth"]


@dataclass(frozen=True)
class SiteTruth:
    """What is true at one site.

    Parameters
    ----------
    position_m : ndarray of float64, shape (3,)
        The site, world frame, metres; on the plane of the opening where there is nothing to touch.
    k1_per_m, k2_per_m : float or None
        Largest and smallest normal curvature, 1/m, concave up positive; None without contact.
    contact : bool
        Whether there is something to touch.
    primitive : str
        ``"P"``, ``"C-"``, ``"C+"``, ``"H"``, ``"E-"``, ``"E+"`` (see `primitive_of`), ``"N"`` without
        contact, or ``"edge"`` where its radius is below an eighth of the fingertip's.
    direction_rad : float or None
        Direction of k1 in the tangent plane, from its first axis (`evifuse.touch.rolling.tangents`: the
        world's x axis projected), in [0, pi); None without contact or when both curvatures are the same.
    """

    position_m: NDArray[np.float64]
    k1_per_m: float | None
    k2_per_m: float | None
    contact: bool
    primitive: str = "P"
    direction_rad: float | None = None


@dataclass(frozen=True)
class Truth:
    """What is true about a simulated scene.

    Parameters
    ----------
    surface : Surface
        The surface with its dimensions.
    category : str
        ``"quasiplanar"``, ``"curved"``, ``"occluded"``, or ``"edge"``, which is none of these.
    sites : tuple of SiteTruth
        In the order in which they were touched.
    directions_rad : tuple of float
        Commanded directions of the rolls at every site, from the world x axis towards y, radians. Friction
        makes the finger travel a little aside of them where the surface is curved.
    roll : ndarray of int64, shape (T,)
        Number of the roll at every sample, sites outermost, from 0; -1 between rolls and without contact.
    """

    surface: Surface
    category: str
    sites: tuple[SiteTruth, ...]
    directions_rad: tuple[float, ...]
    roll: NDArray[np.int64]


def primitive_of(k1_per_m: float, k2_per_m: float, radius_m: float) -> str:
    """The curvature primitive (table 3) of two principal curvatures, or ``"edge"``.

    Parameters
    ----------
    k1_per_m, k2_per_m : float
        Largest and smallest curvature, 1/m, concave up positive.
    radius_m : float
        Radius of the fingertip, metres: flat is below ``1 / (20 a)``; a dome beyond ``8 / a`` is an edge, as
        for `evifuse.touch.edges`.

    Returns
    -------
    str
        The primitive.

    Examples
    --------
    >>> primitive_of(0.0, -50.0, 0.01), primitive_of(20.0, -30.0, 0.01), primitive_of(0.0, -2000.0, 0.01)
    ('C-', 'H', 'edge')
    """
    if k2_per_m < -1 / (SHARP * radius_m):
        return "edge"
    flat = curvature_threshold_per_m(radius_m)
    first, second = (0 if abs(k) < flat else int(np.sign(k)) for k in (k1_per_m, k2_per_m))
    if first * second < 0:
        return "H"
    kind = {0: "P", 1: "C", 2: "E"}[abs(first) + abs(second)]
    return kind + {0: "", 1: "+", -1: "-"}[int(np.sign(first + second))]


def site_truth(surface: Surface, site: tuple[float, ...], radius_m: float) -> SiteTruth:
    """What is true at a site.

    Parameters
    ----------
    surface : Surface
        What is touched.
    site : (x, y) or (x, y, z)
        Where, metres.
    radius_m : float
        Radius of the fingertip, metres.

    Returns
    -------
    SiteTruth
        Curvatures, their direction and the primitive.
    """
    place = surface.place(site)
    if place is None:
        return SiteTruth(np.array([*site[:2], 0.0]), None, None, contact=False, primitive="N")
    point, normal = place
    k1, k2 = surface.principal_curvatures(point)
    axes = np.stack(tangents(normal), axis=1)
    direction = None
    if k1 - k2 > 1e-6 * max(abs(k1), abs(k2), 1.0):
        x, y = np.linalg.eigh(axes.T @ surface.curvature_tensor(point) @ axes)[1][:, 1]
        direction = float(np.arctan2(y, x) % np.pi)
    return SiteTruth(point, k1, k2, True, primitive_of(k1, k2, radius_m), direction)
