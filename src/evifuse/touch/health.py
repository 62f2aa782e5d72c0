"""Which taxels of a fingertip can be trusted: from the pressures of one recording alone (our own).

A patch of pressure has one hill: between two loaded taxels a taxel is loaded too. One that stays silent
although taxels on opposite sides of it respond is dead, or stuck if it is silent at another value than 0.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import Fingertip, TouchRecording
from evifuse.touch.baseline import FREE, PAUSES, QUIET, WINDOWS, Baseline, baseline_of
from evifuse.touch.converter import quantisation_step_pa, saturation_pa
from evifuse.touch.glance import Glance, glance_at
from evifuse.touch.quantiles import median_of, quantile_of
from evifuse.touch.repair import opposite_pairs

__all__ = [
    "FingertipHealth",
    "drifting_taxels",
    "health",
    "may_drift",
    "named",
    "silent_among",
    "silent_taxels",
]

LOADED = 0.2
"""A taxel counts as surrounded by contact when the lesser of two opposite ones has this share of the peak."""
SILENT = 0.2
"""A taxel that responds with less than this share of what its neighbours say is silent."""
ENOUGH = 3
"""Samples that must show it."""
STUCK = 0.05
"""A silent taxel that reads more than this share of the peak is stuck, else dead."""
MUCH_DRIFT = 0.03
"""A baseline that moves by more than this share of the peak, and clear of the noise, drifts."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FingertipHealth:
    """What is wrong with the taxels of a fingertip.

    Parameters
    ----------
    dead, stuck : ndarray of bool, shape (N,)
        Taxels that never respond though their neighbours do, at 0 or at another value.
    saturated : ndarray of bool, shape (N,)
        Taxels that were clipped at the common top.
    drifting : ndarray of bool, shape (N,)
        Taxels whose baseline moves.
    drift_pa : ndarray of float64, shape (N,)
        How far each baseline moves over the recording, pascals.
    saturation_pa : float
        The common top, pascals; infinity when nothing is clipped.
    step_pa : float
        Quantisation step, pascals; 0 when there is none to be seen.
    """

    dead: NDArray[np.bool_]
    stuck: NDArray[np.bool_]
    saturated: NDArray[np.bool_]
    drifting: NDArray[np.bool_]
    drift_pa: Array
    saturation_pa: float
    step_pa: float

    @property
    def usable(self) -> NDArray[np.bool_]:
        """Taxels that respond, shape (N,)."""
        return ~(self.dead | self.stuck)

    def lines(self) -> tuple[str, ...]:
        """Say in plain words what is wrong.

        Returns
        -------
        tuple of str
            One line for each kind of defect; none for a sound fingertip.
        """
        said: list[str] = []
        for mask, what in (
            (self.dead, "never respond although their neighbours do: dead"),
            (self.stuck, "stay at one value although their neighbours respond: stuck"),
            (self.saturated, f"are clipped at {self.saturation_pa:.6g} Pa: saturated"),
            (self.drifting, f"move their baseline, up to {_most(self.drift_pa):.3g} Pa: drifting"),
        ):
            if mask.any():
                said.append(f"{named(mask)} {what}")
        if self.step_pa > 0:
            said.append(f"pressures come in steps of {self.step_pa:.4g} Pa")
        return tuple(said)


def health(recording: TouchRecording) -> FingertipHealth:
    """Look for defective taxels.

    Parameters
    ----------
    recording : TouchRecording
        T samples of N taxels, with some contact.

    Returns
    -------
    FingertipHealth
        What is wrong. A taxel that no contact surrounded is never called dead.
    """
    pressure = recording.pressure_pa
    dead, stuck = silent_taxels(recording)
    base = baseline_of(recording)
    drifting = drifting_taxels(recording, base) & ~(dead | stuck)
    top = saturation_pa(np.where(dead | stuck, 0.0, pressure))
    saturated = (pressure >= top).any(axis=0) & ~stuck
    return FingertipHealth(
        dead,
        stuck,
        saturated,
        drifting,
        np.ptp(base.level_pa, axis=0),
        top,
        quantisation_step_pa(pressure),
    )


def drifting_taxels(recording: TouchRecording, baseline: Baseline) -> NDArray[np.bool_]:
    """Taxels whose unloaded reading moves.

    Parameters
    ----------
    recording : TouchRecording
        T samples of N taxels.
    baseline : Baseline
        Its baseline.

    Returns
    -------
    ndarray of bool, shape (N,)
        Those whose baseline moves by more than 3 % of the peak and six times its error.
    """
    peak = _peak(glance_at(recording).rise)
    return np.ptp(baseline.level_pa, axis=0) > max(MUCH_DRIFT * peak, 6 * baseline.error_pa)


def may_drift(seen: Glance) -> bool:
    """Whether it's worth while to measure the baseline: a quick look that errs on the side of yes.

    Parameters
    ----------
    seen : Glance
        Some samples of a recording.

    Returns
    -------
    bool
        False if mean readings without contact move by less than half of what counts as drift, or by no more
        than noise makes them.
    """
    from evifuse.touch._kernels_health import baseline_moves

    moves = baseline_moves(seen.sample, seen.quiet, WINDOWS, FREE, QUIET, PAUSES)
    noise = 1.48 * median_of(seen.spread)
    return float(moves.max(initial=0.0)) > max(0.5 * MUCH_DRIFT * _peak(seen.rise), 1.5 * noise)


def silent_taxels(
    recording: TouchRecording, seen: Glance | None = None
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Taxels that say nothing although their neighbours do.

    Where taxels are noisy, one without any noise is silent too.

    Parameters
    ----------
    recording : TouchRecording
        T samples of N taxels.
    seen : Glance, optional
        Some of its samples, where they were looked at before.

    Returns
    -------
    dead, stuck : ndarray of bool, shape (N,)
        Silent at about 0, and at another value.
    """
    return silent_among(recording.fingertip, glance_at(recording) if seen is None else seen)


def silent_among(fingertip: Fingertip, seen: Glance) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Taxels that say nothing although their neighbours do, in some samples: see `silent_taxels`.

    Parameters
    ----------
    fingertip : Fingertip
        Geometry of the fingertip, N taxels.
    seen : Glance
        The samples.

    Returns
    -------
    dead, stuck : ndarray of bool, shape (N,)
        Silent at about 0, and at another value.
    """
    quiet, reach = seen.quiet, seen.reach
    peak = _peak(seen.rise)
    if peak <= 0:  # nothing ever changes: no taxel can be told from another
        return np.zeros(len(quiet), dtype=np.bool_), np.zeros(len(quiet), dtype=np.bool_)
    noise = 1.48 * seen.spread
    floor = median_of(noise)
    numb = (noise == 0) & (floor > 0) & (reach <= 1e-3 * peak)
    high = (np.abs(quiet) > STUCK * peak) & (reach <= 1e-3 * peak)
    silent = numb | high
    suspect = (reach < 0.5 * peak + 5 * floor) & ~silent
    least = max(LOADED * peak, 5 * floor)
    for _ in range(2):  # what is silent itself says nothing about its neighbours
        touched = (seen.rise > least) & ~silent
        found = _unanswering(fingertip, seen, suspect & ~silent, touched, least)
        silent = silent | found
        if not found.any():
            break
    stuck = silent & (np.abs(quiet) > STUCK * peak)
    return silent & ~stuck, stuck


def _unanswering(
    tip: Fingertip,
    seen: Glance,
    suspect: NDArray[np.bool_],
    touched: NDArray[np.bool_],
    least_pa: float,
) -> NDArray[np.bool_]:
    """Suspects (N,) that answer with next to nothing when the taxels around them are loaded."""
    from evifuse.touch._kernels_health import answers

    found = np.zeros(len(suspect), dtype=np.bool_)
    taxel, first, second = opposite_pairs(tip, suspect, touched)
    if not len(taxel):
        return found
    ends = np.flatnonzero(np.diff(taxel, prepend=-1, append=-1))
    answer, asked, often = answers(seen.columns, seen.quiet, ends, taxel, first, second, least_pa)
    found[taxel[ends[:-1]]] = (often >= ENOUGH) & (answer < SILENT * asked)
    return found


def _peak(rise: Array) -> float:
    """Pressure that the most loaded taxels reach, pascals: constant ones don't count."""
    rises = rise[rise > 0]
    return quantile_of(rises, 0.9) if len(rises) else 0.0


def _most(values: Array) -> float:
    return float(np.abs(values).max(initial=0.0))


def named(mask: NDArray[np.bool_]) -> str:
    """Name the taxels of a mask.

    Parameters
    ----------
    mask : ndarray of bool, shape (N,)
        Which taxels.

    Returns
    -------
    str
        Their numbers, from 0, at most eight of them.
    """
    numbers = np.flatnonzero(mask).tolist()
    shown = ", ".join(map(str, numbers[:8])) + (f" and {len(numbers) - 8} more" if len(numbers) > 8 else "")
    return f"taxel{'s' if len(numbers) > 1 else ''} {shown}"
