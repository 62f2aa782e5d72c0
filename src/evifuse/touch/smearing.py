"""How much to believe a local curvature: the smearing of the array, and how well its class is resolved."""

from math import erf, sqrt
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import UsageError
from evifuse.recordings.recording import Fingertip

__all__ = [
    "BELIEF_MODELS",
    "BeliefModel",
    "chapter_belief",
    "check_belief_model",
    "class_probabilities",
    "resolved_belief",
    "smearing_discount",
]

BeliefModel = Literal["chapter", "resolved"]
BELIEF_MODELS: tuple[BeliefModel, ...] = ("resolved", "chapter")
"""``resolved`` is our own and the default; ``chapter`` is section 4.1.4."""


def check_belief_model(name: str) -> BeliefModel:
    """Check the name of a belief model.

    Parameters
    ----------
    name : str
        ``"resolved"`` or ``"chapter"``.

    Returns
    -------
    str
        The name.

    Raises
    ------
    UsageError
        If there is no such model.
    """
    for model in BELIEF_MODELS:
        if model == name:
            return model
    raise UsageError(f"unknown belief model {name!r}: choose {' or '.join(map(repr, BELIEF_MODELS))}")


def smearing_discount(
    fingertip: Fingertip,
    directions: NDArray[np.float64],
    pressure_pa: NDArray[np.float64],
    threshold_pa: float,
) -> float:
    """Share of the belief that is left after smearing, along one roll (section 4.1.4).

    ``sum_j (tau_j - sum_k v_jk d_jk / sum_k d_jk) / sum_j tau_j``, clipped to [0, 1], where tau is the
    pressure at the contact, v the pressures of its active neighbours and d their distances from the plane
    that is tangent to the sensing envelope at the contact: ``d = 2a (1 - n_q . n_p)`` in closed form (section
    4.1.3). A sample with a single active cell is not discounted.

    Parameters
    ----------
    fingertip : Fingertip
        Geometry of the fingertip, N taxels.
    directions : ndarray of float64, shape (M, 3)
        Contact direction n_p of each sample of the roll, fingertip frame.
    pressure_pa : ndarray of float64, shape (M, N)
        Pressures of these samples, pascals.
    threshold_pa : float
        Pressure above which a cell is active, pascals.

    Returns
    -------
    float
        Between 0 (smeared evenly) and 1 (one cell).
    """
    contact = np.argmax(pressure_pa, axis=1)
    rows = np.arange(len(contact))
    tau = pressure_pa[rows, contact]
    distance = 2 * fingertip.radius_m * np.maximum(1 - directions @ fingertip.normals.T, 0.0)
    neighbour = pressure_pa > threshold_pa
    neighbour[rows, contact] = False
    distance *= neighbour
    total = distance.sum(axis=1)
    spread = np.einsum("mn,mn->m", distance, pressure_pa) / np.where(total > 0, total, 1.0)
    return float(np.clip((tau - spread).sum() / tau.sum(), 0.0, 1.0)) if tau.sum() > 0 else 0.0


def chapter_belief(discount: float, cone_curvature_per_m: float, radius_m: float) -> float:
    """Belief of a local curvature as in section 4.1.4: ``|1 + a K_cone|`` times the smearing discount.

    It goes to zero on a plane by design: the flatter a surface is, the less the chapter trusts the estimate.

    Parameters
    ----------
    discount : float
        What `smearing_discount` leaves.
    cone_curvature_per_m : float
        Curvature K_cone of the cone signature, 1/m.
    radius_m : float
        Radius a of the fingertip, metres.

    Returns
    -------
    float
        In [0, 1].

    Examples
    --------
    >>> chapter_belief(0.5, -100.0, 0.010), chapter_belief(0.5, -120.0, 0.010)
    (0.0, 0.1)
    """
    return round(float(np.clip(abs(1 + radius_m * cone_curvature_per_m) * discount, 0.0, 1.0)), 15)


def class_probabilities(
    curvature_per_m: float, standard_error_per_m: float, gamma_per_m: float
) -> tuple[float, float, float]:
    """Probabilities that a curvature is down, flat, and up, given its standard error (our own).

    Parameters
    ----------
    curvature_per_m : float
        Estimate, 1/m.
    standard_error_per_m : float
        Its standard error, 1/m; the error is taken as normal.
    gamma_per_m : float
        Threshold between flat and curved, 1/m (table 3).

    Returns
    -------
    down, flat, up : float
        Probabilities of ``K < -gamma``, ``-gamma <= K <= gamma``, ``gamma < K``, with the sum 1.

    Examples
    --------
    >>> down, flat, up = class_probabilities(5.0, 1.0, 5.0)
    >>> round(down, 6), round(flat, 6), round(up, 6)
    (0.0, 0.5, 0.5)
    """
    scale = sqrt(2) * max(standard_error_per_m, 1e-12)
    up = 0.5 * (1 - erf((gamma_per_m - curvature_per_m) / scale))
    down = 0.5 * (1 - erf((gamma_per_m + curvature_per_m) / scale))
    return down, max(1 - down - up, 0.0), up


def resolved_belief(
    discount: float, curvature_per_m: float, standard_error_per_m: float, gamma_per_m: float
) -> float:
    """Belief that a local curvature is of the class it is counted for (our own, and the default).

    A discount times the probability that the true curvature lies in the same class of table 3 (down, flat or
    up) as its estimate. Unlike the chapter's belief, it lets a plane be believed to be a
    plane.

    Parameters
    ----------
    discount : float
        How far the estimate of the site is relied on (`evifuse.touch.reliance`).
    curvature_per_m, standard_error_per_m : float
        Estimate and its standard error, 1/m.
    gamma_per_m : float
        Threshold between flat and curved, 1/m.

    Returns
    -------
    float
        In [0, 1].
    """
    down, flat, up = class_probabilities(curvature_per_m, standard_error_per_m, gamma_per_m)
    own = up if curvature_per_m > gamma_per_m else down if curvature_per_m < -gamma_per_m else flat
    return discount * own
