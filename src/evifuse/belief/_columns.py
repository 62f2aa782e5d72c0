"""Values for each hypothesis, checked at the door: what the sources of masses share."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evifuse.belief.frame import Frame
from evifuse.belief.mass import TOLERANCE
from evifuse.errors import MassError

Array = NDArray[np.float64]


def checked_probabilities(frame: Frame, given: ArrayLike) -> Array:
    """Probabilities that sum to 1 exactly, from such that do so within the rounding of their type.

    Parameters
    ----------
    frame : Frame
        K hypotheses.
    given : array_like of float, shape (..., K)
        Not negative; summing to 1 within 1e-9, or 1e-5 in single precision or less.

    Returns
    -------
    ndarray of float64, shape (..., K)
        A new array.

    Raises
    ------
    MassError
        If they are not probabilities.
    """
    p = columns(frame, given, "probabilities")
    refuse(frame, p, p < 0, "probability", "is negative")
    kind = np.asarray(given).dtype
    slack = 1e-5 if kind.kind == "f" and kind.itemsize < 8 else TOLERANCE
    total = p.sum(axis=-1, keepdims=True)
    off = np.abs(total[..., 0] - 1) > slack
    if off.any():
        where = np.argwhere(off)[0]
        raise MassError(f"probabilities{at_index(where)} sum to {float(total[(*where, 0)]):.9g}, not 1")
    return p / total


def columns(frame: Frame, given: ArrayLike, what: str, *, infinite: bool = False) -> Array:
    """A value for each hypothesis, checked: shape (..., K), finite (or also -inf, if ``infinite``)."""
    values = np.array(given, dtype=np.float64)
    if values.ndim == 0 or values.shape[-1] != len(frame):
        raise MassError(
            f"{len(frame)} hypotheses need {what} of shape (..., {len(frame)}), not {values.shape}"
        )
    bad = np.isnan(values) | (values == np.inf) if infinite else ~np.isfinite(values)
    refuse(frame, values, bad, what, "is not a finite number")
    return values


def refuse(frame: Frame, values: Array, bad: NDArray[np.bool_], what: str, why: str) -> None:
    """Raise for the first value that is bad, by name and place."""
    if bad.any():
        where = np.argwhere(bad)[0]
        name = frame.hypotheses[int(where[-1])]
        raise MassError(f"{what}: {float(values[tuple(where)])!r} of {name!r}{at_index(where[:-1])} {why}")


def at_index(where: NDArray[Any]) -> str:
    """Where in a batch, for a message."""
    return f" at index {tuple(int(i) for i in where)}" if len(where) else ""
