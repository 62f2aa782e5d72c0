"""From what was felt at each site to evidence over P, C-, C+, H, E-, E+ and N (our own)."""

from collections.abc import Mapping, Sequence

import numpy as np

from evifuse.belief.mass import MassFunction
from evifuse.touch.curvature import NARROWEST_RAD, RollCurvature, ShapeOperator, spread_rad
from evifuse.touch.primitives import CONDITIONS, CURVATURE_FRAME, NO_CONTACT, PRIMITIVES
from evifuse.touch.resolved import primitive_probabilities, resolved_threshold_per_m
from evifuse.touch.smearing import class_probabilities

__all__ = ["evidence_from_sites", "site_evidence"]


def site_evidence(
    shape: ShapeOperator | None, rolls: Sequence[RollCurvature], reliance: float, gamma_per_m: float
) -> dict[tuple[str, ...], float]:
    """Masses from one touched site.

    With two principal curvatures, a primitive gets the probability that they fulfil its row of table 3, given
    the operator's covariance. With one direction only, a set of primitives gets the probability of the class
    of curvature that all of them have in some direction. Rolls in several directions that no operator fits
    contradict each other and tell nothing. All is discounted: what is not relied on is the frame's.

    Parameters
    ----------
    shape : ShapeOperator or None
        Principal curvatures, where known.
    rolls : sequence of RollCurvature
        The rolls of the site.
    reliance : float
        How far their distribution is relied on, in [0, 1].
    gamma_per_m : float
        Threshold of the fingertip between flat and curved, 1/m.

    Returns
    -------
    dict of tuple of str to float
        Mass of each set of primitives, with the sum `reliance`; nothing where nothing is known.
    """
    if reliance == 0 or (shape is not None and not np.isfinite([shape.k1_per_m, shape.k2_error_per_m]).all()):
        return {}
    if shape is not None:
        found = primitive_probabilities(shape, resolved_threshold_per_m(gamma_per_m, shape))
        return {(primitive,): reliance * probability for primitive, probability in found.items()}
    if rolls and spread_rad([roll.direction_rad for roll in rolls]) >= NARROWEST_RAD:
        return {}
    masses: dict[tuple[str, ...], float] = {}
    for roll in rolls:
        shares = class_probabilities(roll.curvature_per_m, roll.standard_error_per_m, gamma_per_m)
        for own, probability in zip((-1, 0, 1), shares, strict=True):
            focal = tuple(p for p, asked in CONDITIONS.items() if own in asked)
            masses[focal] = masses.get(focal, 0.0) + reliance * probability / len(rolls)
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
