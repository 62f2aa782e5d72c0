"""What far taxels leave unknown of a single roll (our own).

Along one roll the places of the contact on the finger follow the taxels in steps, and a smooth way through
them agrees with itself better than with the truth. Where rolls in several directions describe one patch, its
fit takes this into account; a roll that is left alone gets it here.
"""

from dataclasses import replace

import numpy as np

from evifuse.recordings.recording import TouchRecording
from evifuse.touch.blocks import LONGEST, spacing_error_rad
from evifuse.touch.contact import ContactTrack
from evifuse.touch.curvature import RollCurvature
from evifuse.touch.fingertip import taxel_pitch_m
from evifuse.touch.sites import ContactSite

__all__ = ["with_spacing_error"]


def with_spacing_error(
    recording: TouchRecording, track: ContactTrack, site: ContactSite, roll: RollCurvature
) -> RollCurvature:
    """A roll whose standard error holds what the taxels' spacing leaves.

    The slope of a line through the contact angles of m pieces of a way W is off by ``sqrt(12 / m) / W`` times
    the error of each (`spacing_error_rad`).

    Parameters
    ----------
    recording : TouchRecording
        T samples.
    track : ContactTrack
        Its contact.
    site : ContactSite
        The site of the roll.
    roll : RollCurvature
        What was measured.

    Returns
    -------
    RollCurvature
        With a larger standard error.
    """
    place = recording.position_m[roll.samples]
    way = max(float(np.linalg.norm(place[-1] - place[0])), 1e-9)
    tip = recording.fingertip
    error = spacing_error_rad(recording, track, replace(site, rolls=(roll.samples,)))
    many = max(way / min(0.5 * taxel_pitch_m(tip), LONGEST * tip.radius_m), 1.0)
    length = float(np.linalg.norm(roll.tangent + tip.radius_m * roll.bending_per_m))
    wider = error * np.sqrt(12 / many) / way / max(length, 0.1) ** 2
    return replace(roll, standard_error_per_m=float(np.hypot(roll.standard_error_per_m, wider)))
