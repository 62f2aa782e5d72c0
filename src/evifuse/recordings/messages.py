"""The messages of a recording: standard ROS 2 ones and one of our own for the taxels.

===========================  ===================================  ============================================
topic                        type                                 meaning
===========================  ===================================  ============================================
``/camera/image/compressed`` ``sensor_msgs/msg/CompressedImage``  the picture, PNG or JPEG
``/camera/camera_info``      ``sensor_msgs/msg/CameraInfo``       its intrinsics
``/camera/pose``             ``geometry_msgs/msg/PoseStamped``    optical frame in the world
``/finger/pose``             ``geometry_msgs/msg/PoseStamped``    fingertip frame in the world
``/finger/joint_states``     ``sensor_msgs/msg/JointState``       angle of the distal joint
``/finger/taxels``           ``evifuse_msgs/msg/TaxelArray``      readings and, once, the fingertip's geometry
===========================  ===================================  ============================================
"""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "CAMERA_INFO",
    "CAMERA_POSE",
    "FINGER_JOINT",
    "FINGER_POSE",
    "IMAGE",
    "JOINT_NAME",
    "TAXELS",
    "TAXEL_ARRAY",
    "TOPIC_TYPES",
    "header",
    "pose_message",
    "typestore",
]

IMAGE = "/camera/image/compressed"
CAMERA_INFO = "/camera/camera_info"
CAMERA_POSE = "/camera/pose"
FINGER_POSE = "/finger/pose"
FINGER_JOINT = "/finger/joint_states"
TAXELS = "/finger/taxels"

TOPIC_TYPES = {
    IMAGE: "sensor_msgs/msg/CompressedImage",
    CAMERA_INFO: "sensor_msgs/msg/CameraInfo",
    CAMERA_POSE: "geometry_msgs/msg/PoseStamped",
    FINGER_POSE: "geometry_msgs/msg/PoseStamped",
    FINGER_JOINT: "sensor_msgs/msg/JointState",
    TAXELS: "evifuse_msgs/msg/TaxelArray",
}

JOINT_NAME = "distal"
"""The joint that rolls the fingertip, where a ``JointState`` names several."""

TAXEL_ARRAY = """\
# Readings of a rigid spherical fingertip covered with taxels.
# The geometry (radius, positions, normals) is needed in the first message only; later ones may leave the two
# lists empty, which means "as before".

std_msgs/Header header            # when the taxels were read; frame_id is the fingertip frame
float64 radius                    # of the fingertip's sphere, m
string unit                       # of values: Pa, hPa, kPa, MPa, bar, N/m^2 or N
float64 area                      # of one taxel, m^2; needed when the unit is N, else 0
float64 offset                    # reading of an unloaded taxel, in that unit
geometry_msgs/Point[] positions   # taxel centres in the fingertip frame, m; origin at the sphere's centre
geometry_msgs/Vector3[] normals   # outward unit normals in the fingertip frame
float32[] values                  # one reading per taxel
"""


@cache
def typestore() -> Any:
    """Message classes and their CDR serialisation.

    Returns
    -------
    rosbags.typesys.store.Typestore
        The types of ROS 2 Humble and ``evifuse_msgs/msg/TaxelArray``.
    """
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg(TAXEL_ARRAY, TOPIC_TYPES[TAXELS]))
    return store


def header(time_ns: int, frame_id: str) -> Any:
    """A message header.

    Parameters
    ----------
    time_ns : int
        UTC nanoseconds since 1970.
    frame_id : str
        Name of the frame of reference.

    Returns
    -------
    std_msgs.msg.Header
        The header.
    """
    types = typestore().types
    stamp = types["builtin_interfaces/msg/Time"](sec=time_ns // 10**9, nanosec=time_ns % 10**9)
    return types["std_msgs/msg/Header"](stamp=stamp, frame_id=frame_id)


def pose_message(time_ns: int, position_m: NDArray[np.float64], orientation_xyzw: NDArray[np.float64]) -> Any:
    """A stamped pose in the world frame.

    Parameters
    ----------
    time_ns : int
        UTC nanoseconds since 1970.
    position_m : ndarray of float64, shape (3,)
        Origin of the moving frame, metres.
    orientation_xyzw : ndarray of float64, shape (4,)
        Unit quaternion that turns its coordinates into world coordinates.

    Returns
    -------
    geometry_msgs.msg.PoseStamped
        The message.
    """
    types = typestore().types
    x, y, z = map(float, position_m)
    qx, qy, qz, qw = map(float, orientation_xyzw)
    pose = types["geometry_msgs/msg/Pose"](
        position=types["geometry_msgs/msg/Point"](x=x, y=y, z=z),
        orientation=types["geometry_msgs/msg/Quaternion"](x=qx, y=qy, z=qz, w=qw),
    )
    return types["geometry_msgs/msg/PoseStamped"](header=header(time_ns, "world"), pose=pose)
