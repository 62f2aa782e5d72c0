"""Curvature primitives: table 3, and the chapter's belief of each from local curvatures with beliefs."""

from collections.abc import Collection, Sequence

import numpy as np

from evifuse.belief.frame import Frame
from evifuse.errors import UsageError

__all__ = [
    "CONDITIONS",
    "CURVATURE_FRAME",
    "NO_CONTACT",
    "PRIMITIVES",
    "curvature_threshold_per_m",
    "primitive_beliefs",
    "table_3_marks",
]

PRIMITIVES = ("P", "C-", "C+", "H", "E-", "E+")
"""Planar; cylindrical down (a dome's) and up (a trough's); hyperbolic; elliptical down and up."""
NO_CONTACT = "N"
CURVATURE_FRAME = Frame([*PRIMITIVES, NO_CONTACT])
"""Frame of the evidence from touch (section 4.3)."""

CONDITIONS: dict[str, tuple[int, ...]] = {
    "P": (0,),
    "C-": (0, -1),
    "C+": (1, 0),
    "H": (1, 0, -1),
    "E-": (-1, -1),
    "E+": (1, 1),
}
"""Table 3: the classes of local curvature (-1 down, 0 flat, 1 up) that must exist at a site."""


def curvature_threshold_per_m(radius_m: float) -> float:
    """Threshold gamma between flat and curved: ``1 / (20 a)`` (our own; the chapter only calls it small).

    A fingertip of 10 mm then calls a surface flat when its radius exceeds 200 mm: over the 4 mm that such a
    finger rolls to either side it rises by less than 0.04 mm. How sure that is follows from the standard
    error.

    Parameters
    ----------
    radius_m : float
        Radius a of the fingertip, metres.

    Returns
    -------
    float
        Threshold, 1/m.
    """
    return 1 / (20 * radius_m)


def table_3_marks(
    curvatures_per_m: Sequence[float], sites: Sequence[int], gamma_per_m: float
) -> list[tuple[str, ...]]:
    """Primitives that each local curvature supports, read literally from table 3.

    A primitive is possible at a site when all the curvatures that its row asks for exist there. A local
    curvature supports each possible primitive of its site that asks for a curvature of its class. With a
    threshold of 0.2 this gives 31 of the 32 marks printed in table 5.

    Parameters
    ----------
    curvatures_per_m : sequence of float
        Local curvatures, 1/m, concave up positive.
    sites : sequence of int
        Site of each.
    gamma_per_m : float
        Threshold between flat and curved, 1/m.

    Returns
    -------
    list of tuple of str
        Supported primitives of each local curvature.

    Examples
    --------
    >>> table_3_marks([0.1, 0.8], [0, 0], gamma_per_m=0.2)
    [('P', 'C+'), ('C+',)]
    """
    classes = [_class(k, gamma_per_m) for k in curvatures_per_m]
    marks: list[tuple[str, ...]] = []
    for own, site in zip(classes, sites, strict=True):
        there = [c for c, other in zip(classes, sites, strict=True) if other == site]
        possible = [
            p for p, asked in CONDITIONS.items() if all(there.count(c) >= asked.count(c) for c in asked)
        ]
        marks.append(tuple(p for p in possible if own in CONDITIONS[p]))
    return marks


def primitive_beliefs(
    curvatures_per_m: Sequence[float],
    beliefs: Sequence[float],
    marks: Sequence[Collection[str]] | None = None,
    *,
    sites: Sequence[int] | None = None,
    gamma_per_m: float = 0.2,
) -> dict[str, float]:
    """Belief of each primitive: the mean of the local curvatures that support it (section 4.2, table 5).

    Parameters
    ----------
    curvatures_per_m : sequence of float
        Local curvatures over all directions and sites, 1/m, concave up positive.
    beliefs : sequence of float
        Belief of each, in [0, 1].
    marks : sequence of collections of str, optional
        Primitives that each supports; without it, those of `table_3_marks`.
    sites : sequence of int, optional
        Site of each; one site without it. Only used when no marks are given.
    gamma_per_m : float
        Threshold between flat and curved, 1/m. Only used when no marks are given.

    Returns
    -------
    dict of str to float
        Mean belief of each of the six primitives, 0 where none supports it. The means may sum to more than 1.

    Raises
    ------
    UsageError
        If the lengths differ or a mark is not a primitive.

    Examples
    --------
    >>> primitive_beliefs([0.1, 0.8], [0.2, 0.6], [["P", "C+"], ["C+"]])
    {'P': 0.2, 'C-': 0.0, 'C+': 0.4, 'H': 0.0, 'E-': 0.0, 'E+': 0.0}
    """
    if marks is None:
        marks = table_3_marks(curvatures_per_m, sites or [0] * len(curvatures_per_m), gamma_per_m)
    if not len(curvatures_per_m) == len(beliefs) == len(marks):
        raise UsageError(
            f"{len(curvatures_per_m)} curvatures, {len(beliefs)} beliefs and {len(marks)} sets of marks: "
            "give one of each per rolling direction"
        )
    for unknown in (name for row in marks for name in row if name not in PRIMITIVES):
        raise UsageError(
            f"mark {unknown!r} is not a curvature primitive: choose from {', '.join(PRIMITIVES)}"
        )
    supporters = {p: [b for b, row in zip(beliefs, marks, strict=True) if p in row] for p in PRIMITIVES}
    return {p: float(np.mean(found)) if found else 0.0 for p, found in supporters.items()}


def _class(curvature_per_m: float, gamma_per_m: float) -> int:
    return int(curvature_per_m > gamma_per_m) - int(curvature_per_m < -gamma_per_m)
