"""Recordings whose pose leaves out the distal joint: the joint angle then says how far the finger turned.

Some robots report the pose of the hand, not of the fingertip. The fingertip's orientation is then the hand's,
turned by the joint angle about the axis across the direction of travel (our own).
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import TouchRecording
from evifuse.recordings.rotation import about_axis, multiply
from evifuse.touch.contact import ContactTrack
from evifuse.touch.quantiles import median_of
from evifuse.touch.sites import ContactSite

__all__ = ["turned_by_joint"]

SMALLEST_TURN_RAD = 0.05
"""A joint that turns by less says nothing about whether the pose turns with it."""
FOLLOWS = 0.3
"""A pose that turns by less than this share of the joint's turn doesn't follow it."""


def turned_by_joint(
    recording: TouchRecording, track: ContactTrack, sites: list[ContactSite]
) -> TouchRecording | None:
    """Recording with the joint's turn added to the orientation, where the pose leaves it out.

    Parameters
    ----------
    recording : TouchRecording
        T samples.
    track : ContactTrack
        Its contact, with the orientation as recorded.
    sites : list of ContactSite
        Its sites and rolls.

    Returns
    -------
    TouchRecording or None
        None if the orientation turns with the joint, as it should, or there is no joint angle.
    """
    if not recording.has_joint:
        return None
    rolls = [roll for site in sites for roll in site.rolls]
    joint = np.array([abs(np.ptp(recording.joint_angle_rad[roll])) for roll in rolls])
    pose = np.array([_turn_rad(recording.orientation_xyzw[roll]) for roll in rolls])
    turning = joint > SMALLEST_TURN_RAD
    if not turning.any() or median_of(pose[turning] / joint[turning]) > FOLLOWS:
        return None
    orientation = recording.orientation_xyzw.copy()
    for roll in rolls:
        axis = _joint_axis(recording, track, roll)
        orientation[roll] = multiply(about_axis(axis, recording.joint_angle_rad[roll]), orientation[roll])
    return replace(recording, orientation_xyzw=orientation)


def _turn_rad(quaternions: NDArray[np.float64]) -> float:
    """Largest angle between the first of the orientations and another."""
    closest = np.clip(np.abs(quaternions @ quaternions[0]), 0.0, 1.0).min()
    return 2 * float(np.arccos(closest))


def _joint_axis(
    recording: TouchRecording, track: ContactTrack, roll: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Axis across the way and the normal; a positive angle about it rolls the way the finger went."""
    straight = roll[np.argmin(np.abs(recording.joint_angle_rad[roll]))]
    way = recording.position_m[roll[-1]] - recording.position_m[roll[0]]
    if recording.joint_angle_rad[roll[-1]] < recording.joint_angle_rad[roll[0]]:
        way = -way
    axis = np.cross(track.normal[straight], way)
    return axis / np.linalg.norm(axis)
