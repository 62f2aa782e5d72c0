"""The catalogue of surfaces, by name."""

from dataclasses import fields
from difflib import get_close_matches

import numpy as np

from evifuse.errors import UsageError
from evifuse.simulation.edges import Corner, Edge, Step
from evifuse.simulation.flat import Hole, Plane, Slot
from evifuse.simulation.oval import Ellipsoid, Torus
from evifuse.simulation.round import Bowl, Cylinder, Sphere, Trough
from evifuse.simulation.saddle import Saddle
from evifuse.simulation.surface import Surface

__all__ = ["SURFACES", "fitting_surface", "surface"]

SURFACES: dict[str, type[Surface]] = {
    kind.name: kind
    for kind in (
        Plane,
        Cylinder,
        Sphere,
        Bowl,
        Trough,
        Saddle,
        Hole,
        Ellipsoid,
        Torus,
        Edge,
        Step,
        Corner,
        Slot,
    )
}
"""The catalogue, by name."""


def surface(name: str, **dimensions: float) -> Surface:
    """A surface of the catalogue.

    Parameters
    ----------
    name : str
        One of `SURFACES`.
    **dimensions : float
        Its dimensions, metres (angles: radians); the rest keep their defaults.

    Returns
    -------
    Surface
        The surface.

    Raises
    ------
    UsageError
        If the name or a dimension is unknown, or a dimension is not positive.

    Examples
    --------
    >>> surface("cylinder", radius_m=0.02).principal_curvatures(np.zeros(3))
    (0.0, -50.0)
    """
    if name not in SURFACES:
        like = get_close_matches(name.lower(), SURFACES, n=1)
        meant = f"did you mean {like[0]!r}? There are" if like else "use one of"
        raise UsageError(f"unknown surface {name!r}: {meant} {', '.join(SURFACES)}, and any mesh file")
    kind = SURFACES[name]
    known = tuple(field.name for field in fields(kind))
    for key, value in dimensions.items():
        if key not in known:
            raise UsageError(f"surface {name!r} has no dimension {key!r}: it has {', '.join(known)}")
        if not (np.isfinite(value) and value > 0):
            raise UsageError(f"{key} of surface {name!r} must be positive, not {value:g}: give metres")
    return kind(**dimensions)


def fitting_surface(name: str, flattest_m: float, aside_m: float) -> Surface:
    """A surface of the catalogue with its usual dimensions, or as much larger as a large finger needs.

    The usual dimensions are for a fingertip of 10 mm; what is hollow, open or high grows with the finger.

    Parameters
    ----------
    name : str
        One of `SURFACES`.
    flattest_m : float
        Largest radius of curvature of the finger, metres.
    aside_m : float
        How far it reaches to the side, metres.

    Returns
    -------
    Surface
        The surface.

    Raises
    ------
    UsageError
        If the name is unknown.

    Examples
    --------
    >>> fitting_surface("bowl", 0.03, 0.02).radius_m, fitting_surface("sphere", 0.03, 0.02).radius_m
    (0.12, 0.03)
    """
    usual = surface(name)
    larger = {"hollow": flattest_m / 0.01, "open": aside_m / 0.0125}.get(_GROWS.get(name, ""), 1.0)
    if larger <= 1:
        return usual
    return surface(name, **{key: larger * value for key, value in vars(usual).items()})


_GROWS = {
    "bowl": "hollow",
    "trough": "hollow",
    "saddle": "hollow",
    "torus": "hollow",
    "hole": "open",
    "slot": "open",
    "step": "open",
}
