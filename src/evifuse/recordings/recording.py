"""A touch recording and a scene as plain values: what every file format is read into."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Camera", "Fingertip", "Scene", "TouchRecording"]


@dataclass(frozen=True)
class Fingertip:
    """A rigid spherical fingertip covered with taxels.

    Parameters
    ----------
    radius_m : float
        Radius of the sphere, metres.
    positions_m : ndarray of float64, shape (N, 3)
        Taxel centres in the fingertip frame (origin at the centre of the sphere), metres.
    normals : ndarray of float64, shape (N, 3)
        Outward unit normals of the taxels in the fingertip frame.
    """

    radius_m: float
    positions_m: NDArray[np.float64]
    normals: NDArray[np.float64]


@dataclass(frozen=True)
class TouchRecording:
    """A finger that rolls over a surface, sampled T times.

    Parameters
    ----------
    fingertip : Fingertip
        Geometry of the fingertip, N taxels.
    time_ns : ndarray of int64, shape (T,)
        UTC nanoseconds since 1970, strictly increasing.
    position_m : ndarray of float64, shape (T, 3)
        Centre of the fingertip's sphere in the world frame, metres.
    orientation_xyzw : ndarray of float64, shape (T, 4)
        Unit quaternion that turns fingertip coordinates into world coordinates.
    joint_angle_rad : ndarray of float64, shape (T,)
        Angle by which the distal joint has rolled the fingertip, radians, positive in the direction of
        travel; NaN throughout where it was not recorded.
    pressure_pa : ndarray of float64, shape (T, N)
        Normal pressure on each taxel, pascals.
    name : str
        Where the recording comes from (a file name), for messages.
    notes : tuple of str
        What was left out, interpolated or cut off when it was read, one line each.
    """

    fingertip: Fingertip
    time_ns: NDArray[np.int64]
    position_m: NDArray[np.float64]
    orientation_xyzw: NDArray[np.float64]
    joint_angle_rad: NDArray[np.float64]
    pressure_pa: NDArray[np.float64]
    name: str = "recording"
    notes: tuple[str, ...] = ()

    @property
    def has_joint(self) -> bool:
        """Whether the joint angle was recorded; without it slip can't be told."""
        return not np.isnan(self.joint_angle_rad).all()


@dataclass(frozen=True)
class Camera:
    """A pinhole camera without distortion.

    Parameters
    ----------
    width : int
        Image width, px.
    height : int
        Image height, px.
    matrix : ndarray of float64, shape (3, 3)
        Intrinsics K, px.
    position_m : ndarray of float64, shape (3,)
        Optical centre in the world frame, metres.
    orientation_xyzw : ndarray of float64, shape (4,)
        Unit quaternion that turns optical-frame coordinates (x right, y down, z forward) into world
        coordinates.
    """

    width: int
    height: int
    matrix: NDArray[np.float64]
    position_m: NDArray[np.float64]
    orientation_xyzw: NDArray[np.float64]


@dataclass(frozen=True)
class Scene:
    """What one recording holds: a picture, a touch, or both.

    Parameters
    ----------
    image : ndarray of uint8, shape (H, W) or (H, W, 3), or None
        Grey or BGR picture.
    camera : Camera or None
        Where the picture was taken from; None if the recording does not say.
    touch : TouchRecording or None
        The rolled finger; None if there is none.
    name : str
        Where the scene comes from (a file name), for messages.
    notes : tuple of str
        What was cut off when it was read, one line each; those of the touch are its own.
    """

    image: NDArray[np.uint8] | None
    camera: Camera | None
    touch: TouchRecording | None
    name: str = "scene"
    notes: tuple[str, ...] = ()
