"""What the transforms over all subsets share: the sweeps, what is a residue of rounding, and the door."""

from functools import cache
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evifuse.belief.frame import Frame
from evifuse.belief.mass import TOLERANCE, MassFunction, every_set
from evifuse.errors import MassError

__all__ = ["EPSILON", "expect_entry", "given_array", "lattice", "masses_of", "noise", "swept"]

Array = NDArray[np.float64]
EPSILON = float(np.finfo(np.float64).eps)

ROUNDINGS = 8.0
"""How many times the expected rounding error of a sum of differences still counts as nothing."""


@cache
def lattice() -> Any:
    """The compiled sweeps; numba is imported on the first transform, not before."""
    return import_module("evifuse.belief._kernels_lattice")


def swept(sweep: str, values: Array) -> Array:
    """A copy of values over all subsets after a sweep of `_kernels_lattice`, by name."""
    rows = np.array(values, dtype=np.float64, order="C")
    getattr(lattice(), sweep)(rows.reshape(-1, rows.shape[-1]))
    return rows


def noise(sums: str, errors: Array) -> Array:
    """What rounding may leave after a sweep of differences, of values that are off by ``errors`` x epsilon.

    Independent errors add up as squares (our own criterion), over the sets that the sweep ``sums`` adds.
    """
    spread = swept(sums, np.square(errors))
    np.sqrt(spread, out=spread)
    spread *= ROUNDINGS * EPSILON
    return spread


def masses_of(
    frame: Frame, sweep: str, values: Array, errors: Array, unlike: str = "these values belong to no"
) -> MassFunction:
    """Masses by a sweep of differences; residues become 0, real negative masses are an error.

    Parameters
    ----------
    frame : Frame
        K hypotheses.
    sweep : {"differences_up", "differences_down"}
        Inverse of the sum that the values are.
    values : ndarray of float64, shape (..., 2^K)
        Sums over subsets or supersets.
    errors : ndarray of float64, shape (..., 2^K)
        Rounding errors of the values, in units of the floating-point epsilon.
    unlike : str
        How the message about a negative mass begins.

    Returns
    -------
    MassFunction
        In the dense layout.

    Raises
    ------
    MassError
        If a mass is below zero by more than rounding explains.
    """
    masses = swept(sweep, values)
    masses[np.abs(masses) <= noise(sweep.replace("differences", "sums"), errors)] = 0.0
    bad = np.argwhere(masses < -TOLERANCE)
    if len(bad):
        *index, mask = bad[0].tolist()
        at = f" at index {tuple(index)}" if index else ""
        value = float(masses[tuple(bad[0])])
        raise MassError(f"{unlike} mass function{at}: the mass of {frame.label(mask)!r} would be {value:.6g}")
    np.maximum(masses, 0.0, out=masses)
    return MassFunction.trusted(frame, every_set(len(frame)), masses, "dense")


def given_array(
    frame: Frame, values: ArrayLike, what: str, *, least: float = 0.0, most: float = 1.0
) -> Array:
    """Values over all subsets as an array, after a check of their shape and range."""
    sets = every_set(len(frame))
    array = np.array(values, dtype=np.float64)
    if array.ndim == 0 or array.shape[-1] != len(sets):
        raise MassError(
            f"{what} of {len(frame)} hypotheses needs shape (..., {len(sets)}), not {array.shape}"
        )
    bad = np.argwhere(~(np.isfinite(array) & (array >= least - TOLERANCE) & (array <= most + TOLERANCE)))
    if len(bad):
        name, value = frame.label(int(bad[0][-1])), float(array[tuple(bad[0])])
        raise MassError(f"{what} {value:.6g} of {name!r} is not in [{least:.6g}, {most:.6g}]")
    return array


def expect_entry(frame: Frame, values: Array, mask: int, expected: float, what: str) -> None:
    """Refuse values whose entry for one set is not what it always is."""
    off = np.argwhere(np.abs(values[..., mask] - expected) > TOLERANCE)
    if len(off):
        value = float(values[(*off[0].tolist(), mask)])
        raise MassError(f"{what} of {frame.label(mask)!r} must be {expected:.6g}, not {value:.9g}")
