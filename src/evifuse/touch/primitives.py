"""Curvature primitives: from local curvatures with beliefs to evidence over P, C-, C+, H, E-, E+ and N."""

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from evifuse.belief.frame import Frame
from evifuse.belief.mass import MassFunction
from evifuse.errors import UsageError
from evifuse.touch.curvature import ShapeOperator
from evifuse.touch.smearing import class_probabilities

__all__ = [
    "CURVATURE_FRAME",
    "NO_CONTACT",
    "PRIMITIVES",
    "curvature_threshold_per_m",
    "evidence_from_sites",
    "primitive_beliefs",
    "site_evidence",
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


def site_evidence(
    shape: ShapeOperator | None,
    curvatures_per_m: Sequence[float],
    beliefs: Sequence[float],
    gamma_per_m: float,
) -> dict[tuple[str, ...], float]:
    """Masses from one touched site (our own).

    With two principal curvatures, a primitive gets the probability that they fulfil its condition in table 3
    (k1 and k2 with normal errors), times the mean of the local beliefs, where a local curvature of a class
    that the primitive doesn't have counts as 0. With one direction only, the mass goes to the set of the
    primitives that have such a direction. What is left is the frame's.

    Parameters
    ----------
    shape : ShapeOperator or None
        Principal curvatures, where known.
    curvatures_per_m : sequence of float
        Local curvatures of the site, 1/m.
    beliefs : sequence of float
        Their beliefs, in [0, 1].
    gamma_per_m : float
        Threshold between flat and curved, 1/m.

    Returns
    -------
    dict of tuple of str to float
        Mass of each set of primitives, with a sum of at most 1.
    """
    classes = [_class(k, gamma_per_m) for k in curvatures_per_m]
    if not classes:
        return {}
    masses: dict[tuple[str, ...], float] = {}
    if shape is None:
        for own, belief in zip(classes, beliefs, strict=True):
            focal = tuple(p for p, asked in CONDITIONS.items() if own in asked)
            masses[focal] = masses.get(focal, 0.0) + belief / len(classes)
        return masses
    for primitive, probability in _joint_probabilities(shape, gamma_per_m).items():
        counted = [b for b, own in zip(beliefs, classes, strict=True) if own in CONDITIONS[primitive]]
        masses[(primitive,)] = probability * sum(counted) / len(classes)
    return masses


def evidence_from_sites(
    touched: Sequence[Mapping[tuple[str, ...], float]], missed: Sequence[float]
) -> MassFunction:
    """Mean of the evidence of all sites, as a mass function over `CURVATURE_FRAME`.

    Parameters
    ----------
    touched : sequence of mapping
        Masses of each touched site, as `site_evidence` gives them.
    missed : sequence of float
        Belief in no contact at each missed site, in [0, 1].

    Returns
    -------
    MassFunction
        Every site weighs the same, the balance is on the frame; ignorance without sites.
    """
    sites = len(touched) + len(missed)
    masses: dict[int, float] = {CURVATURE_FRAME.mask(p): 0.0 for p in (*PRIMITIVES, NO_CONTACT)}
    for found in touched:
        for focal, mass in found.items():
            key = CURVATURE_FRAME.mask(focal)
            masses[key] = masses.get(key, 0.0) + mass / sites
    for belief in missed:
        masses[CURVATURE_FRAME.mask(NO_CONTACT)] += belief / sites
    total = sum(masses.values())
    if total > 1:  # only the means of table 5 can exceed 1 by more than rounding
        masses = {focal: mass / total for focal, mass in masses.items()}
    masses[CURVATURE_FRAME.full] = max(1 - sum(masses.values()), 0.0)
    return MassFunction(CURVATURE_FRAME, np.array(list(masses), dtype=np.int64), list(masses.values()))


def _class(curvature_per_m: float, gamma_per_m: float) -> int:
    return int(curvature_per_m > gamma_per_m) - int(curvature_per_m < -gamma_per_m)


def _joint_probabilities(shape: ShapeOperator, gamma_per_m: float) -> dict[str, float]:
    """Probability that the two principal curvatures make each primitive."""
    first: NDArray[np.float64] = np.array(
        class_probabilities(shape.k1_per_m, shape.k1_error_per_m, gamma_per_m)
    )
    second = np.array(class_probabilities(shape.k2_per_m, shape.k2_error_per_m, gamma_per_m))
    joint = np.outer(first, second)
    both = joint + joint.T
    return {
        "P": float(joint[1, 1]),
        "C-": float(both[0, 1]),
        "C+": float(both[1, 2]),
        "H": float(both[0, 2]),
        "E-": float(joint[0, 0]),
        "E+": float(joint[2, 2]),
    }
