"""How far the distribution of an estimate is relied on: a logistic of a few named terms (our own).

The covariance of a fit says how well the samples agree, not whether the sensor can see what is asked of it.
Three things are not in it: taxels that are as far apart as the patch of contact is wide, pressures that
hardly rise above their noise, and a finger that slips. What each costs is in `knowledge/reliance.yaml`;
`benchmarks/touch_calibrate.py` learns it from simulated recordings, so that the pignistic probabilities of
the primitives are calibrated.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np
import yaml
from numpy.typing import NDArray

from evifuse.recordings.recording import TouchRecording
from evifuse.touch.contact import ContactTrack
from evifuse.touch.curvature import RollCurvature, ShapeOperator
from evifuse.touch.fingertip import taxel_pitch_m
from evifuse.touch.quantiles import median_of

__all__ = ["TERMS", "contact_quality", "load_reliance", "reliance", "resolution"]

TERMS = ("coarse", "noisy", "slip", "unresolved")
"""What makes a site less reliable, each 0 where there is nothing to complain of."""
MOST_UNRESOLVED = 10.0
"""Beyond that many thresholds an error says nothing more."""
SAMPLES = 128
"""How many samples of a site the quality of its contact is averaged over, about."""


@dataclass(frozen=True)
class Reliance:
    """A logistic: the log odds that the distribution of a site can be relied on.

    Parameters
    ----------
    constant : float
        With every term 0.
    weights : mapping of str to float
        What a unit of each of `TERMS` adds.
    """

    constant: float
    weights: Mapping[str, float]


def contact_quality(
    recording: TouchRecording, track: ContactTrack, samples: NDArray[np.int64], slip: float
) -> dict[str, float]:
    """What the contact of a site is like.

    Parameters
    ----------
    recording : TouchRecording
        T samples of N taxels.
    track : ContactTrack
        Its contact.
    samples : ndarray of int64, shape (M,)
        Samples of the site's rolls.
    slip : float
        Median share of the turn that was not rolled.

    Returns
    -------
    dict of str to float
        ``coarse``: pitch over patch radius (root 2 times the root mean square distance of the pressure from
        its centre), at most 2. ``noisy``: noise over the median peak pressure, in tenths, at most 5.
        ``slip``: its absolute value, in tenths, at most 5.
    """
    from evifuse.touch._kernels_sites import patch_spread

    tip = recording.fingertip
    some = samples[:: max(1, len(samples) // SAMPLES)]
    spread = patch_spread(recording.pressure_pa, some, track.threshold_pa, tip.positions_m)
    patch = float(np.sqrt(2 * max(median_of(spread), 0.0)))
    peak = max(median_of(track.peak_pa[some]), 1e-12)
    return {
        "coarse": min(taxel_pitch_m(tip) / max(patch, 1e-9), 2.0),
        "noisy": min(10 * track.noise_pa / peak, 5.0),
        "slip": min(10 * abs(slip), 5.0),
    }


def resolution(shape: ShapeOperator | None, rolls: Sequence[RollCurvature], gamma_per_m: float) -> float:
    """Term ``unresolved``: standard error over the threshold between flat and curved, at most 10.

    Parameters
    ----------
    shape : ShapeOperator or None
        The operator: the larger of its errors counts.
    rolls : sequence of RollCurvature
        Without an operator, the median of their errors counts.
    gamma_per_m : float
        Threshold of the fingertip, 1/m.

    Returns
    -------
    float
        0 for what is known exactly, or where there is nothing to know.
    """
    if shape is not None:
        error = max(shape.k1_error_per_m, shape.k2_error_per_m)
    else:
        error = median_of([roll.standard_error_per_m for roll in rolls]) if rolls else 0.0
    return min(error / gamma_per_m, MOST_UNRESOLVED)


def reliance(terms: Mapping[str, float], model: Reliance | None = None) -> float:
    """How far a site is relied on: what discounts its masses.

    Parameters
    ----------
    terms : mapping of str to float
        Some of `TERMS`; one that is not given counts as 0.
    model : Reliance, optional
        The one that comes with the package by default.

    Returns
    -------
    float
        In (0, 1).
    """
    model = load_reliance() if model is None else model
    odds = model.constant + sum(model.weights[name] * value for name, value in terms.items())
    return float(1 / (1 + np.exp(-np.clip(odds, -50.0, 50.0))))


@cache
def load_reliance() -> Reliance:
    """The model that comes with the package, `knowledge/reliance.yaml`.

    Returns
    -------
    Reliance
        Its constant and the weight of each of `TERMS`.
    """
    text = files("evifuse.knowledge").joinpath("reliance.yaml").read_text(encoding="utf-8")
    table = yaml.load(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    return Reliance(float(table["constant"]), {name: float(table["terms"][name]) for name in TERMS})
