"""Canonical decompositions: a mass function as weights of simple ones, and back.

Weights are computed and combined as logarithms: over many hypotheses they may be too large for a number.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evifuse.belief._lattice import expect_entry, given_array, masses_of, noise, swept
from evifuse.belief.frame import Frame
from evifuse.belief.mass import MassFunction
from evifuse.errors import MassError

__all__ = [
    "from_conjunctive_weights",
    "from_disjunctive_weights",
    "to_conjunctive_weights",
    "to_disjunctive_weights",
]

Array = NDArray[np.float64]
LARGEST = 700.0
"""Largest logarithm of a weight that is given out as a number."""


def to_conjunctive_weights(m: MassFunction) -> Array:
    """Weights of the conjunctive canonical decomposition (Smets 1995, Denoeux 2008).

    A mass function with mass on the frame is the conjunctive combination, over all A but the frame, of simple
    ones with ``1 - w(A)`` on A and ``w(A)`` on the frame; a weight above 1 takes evidence away.

    Parameters
    ----------
    m : MassFunction
        Masses over K hypotheses (up to 20) with mass on the frame, batch shape ``(...)``.

    Returns
    -------
    ndarray of float64, shape (..., 2^K)
        ``w(A)`` at the bitmask of A, positive; 1 for the frame itself, which has none.

    Raises
    ------
    MassError
        If the frame has more than 20 hypotheses or no mass (a dogmatic source), or a weight is too large for
        a number.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> to_conjunctive_weights(MassFunction.of(Frame(["a", "b"]), {"a": 0.75, ("a", "b"): 0.25})).tolist()
    [1.0, 0.25, 1.0, 1.0]
    """
    return _exponential(m.frame, log_conjunctive_weights(m))


def to_disjunctive_weights(m: MassFunction) -> Array:
    """Weights of the disjunctive canonical decomposition (Denoeux 2008).

    A mass function with mass on the empty set is the disjunctive combination, over all A but the empty set,
    of ones with ``1 - v(A)`` on A and ``v(A)`` on the empty set.

    Parameters
    ----------
    m : MassFunction
        Masses over K hypotheses (up to 20) with mass on the empty set, batch shape ``(...)``.

    Returns
    -------
    ndarray of float64, shape (..., 2^K)
        ``v(A)`` at the bitmask of A, positive; 1 for the empty set, which has none.

    Raises
    ------
    MassError
        If the frame has more than 20 hypotheses, the empty set has no mass, or a weight is too large for a
        number.
    """
    return _exponential(m.frame, log_disjunctive_weights(m))


def from_conjunctive_weights(frame: Frame, values: ArrayLike) -> MassFunction:
    """Mass function of conjunctive weights: the conjunctive combination of what each weight stands for.

    Parameters
    ----------
    frame : Frame
        K hypotheses, up to 20.
    values : array_like of float, shape (..., 2^K)
        ``w(A)`` at the bitmask of A, positive, 1 for the frame.

    Returns
    -------
    MassFunction
        In the dense layout, batch shape ``(...)``; what is only a residue of rounding is exactly 0.

    Raises
    ------
    MassError
        If a weight is not positive, the frame's is not 1, or they are not weights of a mass function: the
        message names the set whose mass would be negative.
    """
    return from_log_conjunctive_weights(
        frame, _logarithm(frame, values, frame.full, "the conjunctive weight")
    )


def from_disjunctive_weights(frame: Frame, values: ArrayLike) -> MassFunction:
    """Mass function of disjunctive weights: the disjunctive combination of what each weight stands for.

    Parameters
    ----------
    frame : Frame
        K hypotheses, up to 20.
    values : array_like of float, shape (..., 2^K)
        ``v(A)`` at the bitmask of A, positive, 1 for the empty set.

    Returns
    -------
    MassFunction
        In the dense layout, batch shape ``(...)``; what is only a residue of rounding is exactly 0.

    Raises
    ------
    MassError
        If a weight is not positive, that of the empty set is not 1, or they are not weights of a mass
        function: the message names the set whose mass would be negative.
    """
    return from_log_disjunctive_weights(frame, _logarithm(frame, values, 0, "the disjunctive weight"))


def log_conjunctive_weights(m: MassFunction) -> Array:
    """Logarithms of `to_conjunctive_weights`, 0 for the frame."""
    masses = m.to("dense").masses
    _check_positive(masses[..., -1], "the frame", "dogmatic", "discount the source first")
    return _log_weights(swept("sums_down", masses), "down", -1)


def log_disjunctive_weights(m: MassFunction) -> Array:
    """Logarithms of `to_disjunctive_weights`, 0 for the empty set."""
    masses = m.to("dense").masses
    remedy = "move a little mass there first (open_world=True)"
    _check_positive(masses[..., 0], "the empty set", "normal", remedy)
    return _log_weights(swept("sums_up", masses), "up", 0)


def from_log_conjunctive_weights(frame: Frame, logs: Array) -> MassFunction:
    """Inverse of `log_conjunctive_weights`: ln q(B) sums ln w(A) over the A that don't hold B."""
    mirrored = logs[..., ::-1]  # A doesn't hold B where its complement meets B
    q = np.exp(swept("hits", mirrored))
    return masses_of(frame, "differences_down", q, q * (1.0 + swept("hits", np.abs(mirrored))))


def from_log_disjunctive_weights(frame: Frame, logs: Array) -> MassFunction:
    """Inverse of `log_disjunctive_weights`: ln b(B) sums ln v(A) over the A that are not within B."""
    b = np.exp(swept("hits", logs))[..., ::-1]
    return masses_of(frame, "differences_up", b, b * (1.0 + swept("hits", np.abs(logs))[..., ::-1]))


def _log_weights(sums: Array, direction: str, own: int) -> Array:
    logs = np.log(sums)
    weights = -swept(f"differences_{direction}", logs)
    weights[np.abs(weights) <= noise(f"sums_{direction}", 1.0 + np.abs(logs))] = 0.0
    weights[..., own] = 0.0
    return weights


def _check_positive(values: Array, where: str, kind: str, remedy: str) -> None:
    bad = np.argwhere(~(values > 0))
    if len(bad):
        at = f" at index {tuple(bad[0].tolist())}" if values.ndim else ""
        raise MassError(f"the source{at} is {kind}, without mass on {where}: it has no weights; {remedy}")


def _exponential(frame: Frame, logs: Array) -> Array:
    large = np.argwhere(np.abs(logs) > LARGEST)
    if len(large):
        name = frame.label(int(large[0][-1]))
        raise MassError(f"the weight of {name!r} does not fit a number; discount the source first")
    return np.exp(logs)


def _logarithm(frame: Frame, values: ArrayLike, own: int, what: str) -> Array:
    weights = given_array(frame, values, what, most=np.inf)
    bad = np.argwhere(weights <= 0)
    if len(bad):
        name, value = frame.label(int(bad[0][-1])), float(weights[tuple(bad[0])])
        raise MassError(f"{what} {value:.6g} of {name!r} is not positive")
    expect_entry(frame, weights, own, 1.0, what)
    return np.log(weights)
