"""Random cases on random bodies: as many of each primitive, each on a body of the data set's own."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import UsageError
from evifuse.recordings.recording import Fingertip
from evifuse.simulation.cases import CASE_PRIMITIVES, Case, random_case
from evifuse.simulation.fingertip import grid_fingertip
from evifuse.simulation.procedure import Procedure
from evifuse.simulation.random_meshes import RandomBody, random_body
from evifuse.simulation.sites import auto_sites
from evifuse.simulation.surface import Points, Sites

__all__ = ["random_body_case"]

BODIES = 12
"""So many bodies are looked at before giving up."""
NEXT = 100_000
"""Added to the number of a body when the one before has no fitting place."""
NEAR_OPENING = 6.0
"""The place that is touched beside an opening is so near, in radii of the fingertip."""
UPRIGHT, BELOW = 0.95, 0.5
"""Its normal has at least this share upwards, and it lies so much below the opening's rim at most, radii.

A finger that is lowered into the opening then comes to be below what was touched: nothing else says N.
"""


def random_body_case(
    seed: int, number: int, *, fingertip: Fingertip | None = None, noise: str | None = None
) -> Case:
    """Draw one recording of a data set on random bodies (`random_body`).

    Every seven recordings hold each primitive once and share a body; where it has no fitting place, others
    are drawn. For N a place beside the opening of a plate is touched first, then the opening. A site may have
    a curvature next to the threshold between flat and curved.

    Parameters
    ----------
    seed : int
        Seed of the data set.
    number : int
        Number of the recording in it.
    fingertip : Fingertip, optional
        What touches; by default a sphere of 10 mm with a grid of taxels.
    noise : str, optional
        Name in `NOISES`; any of them by chance without it.

    Returns
    -------
    Case
        What is to be simulated.

    Raises
    ------
    UsageError
        If no body has a place of this kind that the fingertip can roll over.
    """
    tip = fingertip or grid_fingertip()
    case = random_case(seed, number, fingertip=tip, noise=noise)
    for attempt in range(BODIES):
        kind = "plate" if attempt or case.primitive == "N" else None
        body = _body(seed, number // len(CASE_PRIMITIVES) + attempt * NEXT, tip.radius_m, kind)
        try:
            sites = _sites(body, case.primitive, case.seed, tip, case.procedure)
        except UsageError:
            continue
        return replace(case, surface=body.pierced() if case.primitive == "N" else body.surface, sites=sites)
    raise UsageError(
        f"no random body has a place of kind {case.primitive} for a fingertip of {tip.radius_m:g} m: "
        "take another seed or a smaller fingertip"
    )


def _sites(body: RandomBody, primitive: str, seed: int, tip: Fingertip, procedure: Procedure) -> Sites:
    if primitive != "N":
        return auto_sites(
            body.surface,
            1,
            seed=seed,
            fingertip=tip,
            primitive=primitive,
            procedure=procedure,
            within=body.on_relief,
            doubtful=True,
        )
    middle = np.array(body.opening[0])

    def beside(points: Points) -> NDArray[np.bool_]:
        near = np.linalg.norm(points[:, :2] - middle, axis=1) < NEAR_OPENING * tip.radius_m
        near &= body.on_relief(points) & (points[:, 2] > -BELOW * tip.radius_m)
        near[near] = body.surface.nearest(points[near])[1][:, 2] > UPRIGHT
        return near

    (place,) = auto_sites(
        body.surface, 1, seed=seed, fingertip=tip, procedure=procedure, within=beside, doubtful=True
    )
    return (place, *body.opening)


@lru_cache(maxsize=4)
def _body(seed: int, number: int, radius_m: float, kind: str | None) -> RandomBody:
    return random_body(seed, number, radius_m=radius_m, kind=kind)
