"""A recording without what defective taxels would do to the estimates (our own)."""

from dataclasses import replace

import numpy as np

from evifuse.recordings.recording import TouchRecording
from evifuse.touch.baseline import baseline_of, without_baseline
from evifuse.touch.health import drifting_taxels, glance_at, may_drift, named, silent_taxels
from evifuse.touch.repair import repair_weights

__all__ = ["mended"]


def mended(recording: TouchRecording) -> tuple[TouchRecording, tuple[str, ...]]:
    """Take moving baselines off, and fill silent taxels in from those around them.

    The middle of a patch then isn't pulled away from a taxel that says nothing.

    Parameters
    ----------
    recording : TouchRecording
        T samples of N taxels.

    Returns
    -------
    recording : TouchRecording
        The same one where nothing is wrong.
    said : tuple of str
        One line for each thing that was done.
    """
    seen = glance_at(recording)
    dead, stuck = silent_taxels(recording, seen)
    silent, said = dead | stuck, list[str]()
    if may_drift(seen):
        baseline = baseline_of(recording)
        drifting = drifting_taxels(recording, baseline) & ~silent
        if drifting.any():
            said.append(
                f"{recording.name}: {named(drifting)} drift without load; the running baseline is taken off"
            )
            recording = without_baseline(recording, baseline)
    if silent.any() and not silent.all():
        said.append(f"{recording.name}: {named(silent)} never respond; filled in from the taxels around them")
        weights = repair_weights(recording.fingertip, silent)
        pressure = recording.pressure_pa.copy()
        pressure[:, silent] = np.maximum(pressure @ weights[:, silent], 0.0)
        recording = replace(recording, pressure_pa=pressure)
    return recording, tuple(said)
