"""Write a scene as one MCAP file: chunked, compressed, checksummed, readable by Foxglove and ``ros2 bag``."""

import os
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import RecordingError
from evifuse.recordings import messages
from evifuse.recordings.atomic import replacing
from evifuse.recordings.images import as_image
from evifuse.recordings.recording import Camera, Scene, TouchRecording

__all__ = ["write_mcap"]

_CHUNK_BYTES = 1 << 20
_LAST_NS = 2**31 * 10**9


def write_mcap(path: str | os.PathLike[str], scene: Scene) -> None:
    """Write a scene as an MCAP file; the file appears whole or not at all.

    Pressures are stored in single precision, everything else of the touch in double precision.

    Parameters
    ----------
    path : str or path-like
        The file to be created or replaced.
    scene : Scene
        What to store; the parts that are None get no topic.

    Raises
    ------
    RecordingError
        If the scene is empty, its times are outside of 1970 to 2038, its camera is not that of the image, or
        the file can't be written.
    ImageError
        If the image is not one.
    """
    scene = _checked(scene, str(path))
    from mcap.writer import CompressionType, Writer

    with replacing(path) as beside, beside.open("wb") as stream:
        writer = Writer(
            stream, chunk_size=_CHUNK_BYTES, compression=CompressionType.ZSTD, enable_data_crcs=True
        )
        writer.start(profile="ros2", library="evifuse")
        channels: dict[str, int] = {}
        sequence: dict[str, int] = {}
        for topic, time_ns, message in _scene_messages(scene):
            if topic not in channels:
                channels[topic] = _register(writer, topic)
            data = bytes(messages.typestore().serialize_cdr(message, messages.TOPIC_TYPES[topic]))
            sequence[topic] = sequence.get(topic, 0) + 1
            writer.add_message(channels[topic], time_ns, data, time_ns, sequence[topic])
        writer.finish()


def _checked(scene: Scene, path: str) -> Scene:
    if scene.image is None and scene.touch is None:
        raise RecordingError(
            f"{path}: the scene has neither an image nor a touch, so there is nothing to write"
        )
    if scene.touch is not None and not 0 <= scene.touch.time_ns[0] <= scene.touch.time_ns[-1] < _LAST_NS:
        raise RecordingError(
            f"{path}: ROS times are between 1970 and 2038: give time_ns as UTC nanoseconds since 1970"
        )
    if scene.image is None:
        return replace(scene, camera=None)
    image = as_image(scene.image, scene.name)
    if scene.camera is not None and (scene.camera.height, scene.camera.width) != image.shape[:2]:
        raise RecordingError(
            f"{path}: the camera is for {scene.camera.width}x{scene.camera.height} px, but the image has "
            f"{image.shape[1]}x{image.shape[0]} px: give the camera that took it"
        )
    return replace(scene, image=image)


def _register(writer: Any, topic: str) -> int:
    kind = messages.TOPIC_TYPES[topic]
    text = messages.typestore().generate_msgdef(kind, ros_version=2)[0]
    schema = writer.register_schema(name=kind, encoding="ros2msg", data=text.encode())
    return writer.register_channel(topic=topic, message_encoding="cdr", schema_id=schema)


def _scene_messages(scene: Scene) -> Iterator[tuple[str, int, Any]]:
    start = 0 if scene.touch is None else int(scene.touch.time_ns[0])
    if scene.camera is not None:
        yield messages.CAMERA_INFO, start, _camera_info(scene.camera, start)
        pose = messages.pose_message(start, scene.camera.position_m, scene.camera.orientation_xyzw)
        yield messages.CAMERA_POSE, start, pose
    if scene.image is not None:
        yield messages.IMAGE, start, _compressed_image(scene.image, start)
    if scene.touch is not None:
        yield from _touch_messages(scene.touch)


def _camera_info(camera: Camera, time_ns: int) -> Any:
    types = messages.typestore().types
    region = types["sensor_msgs/msg/RegionOfInterest"](
        x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
    )
    return types["sensor_msgs/msg/CameraInfo"](
        header=messages.header(time_ns, "camera_optical"),
        height=camera.height,
        width=camera.width,
        distortion_model="plumb_bob",
        d=np.zeros(5),
        k=np.asarray(camera.matrix, dtype=np.float64).ravel(),
        r=np.eye(3).ravel(),
        p=np.hstack([camera.matrix, np.zeros((3, 1))]).ravel(),
        binning_x=0,
        binning_y=0,
        roi=region,
    )


def _compressed_image(image: NDArray[np.uint8], time_ns: int) -> Any:
    import cv2

    done, data = cv2.imencode(".png", image)
    if not done:
        raise RecordingError(
            f"the image of shape {image.shape} and type {image.dtype} can't be stored as PNG"
        )
    return messages.typestore().types["sensor_msgs/msg/CompressedImage"](
        header=messages.header(time_ns, "camera_optical"), format="png", data=data.ravel()
    )


def _touch_messages(touch: TouchRecording) -> Iterator[tuple[str, int, Any]]:
    types = messages.typestore().types
    point, vector = types["geometry_msgs/msg/Point"], types["geometry_msgs/msg/Vector3"]
    positions = [point(x=x, y=y, z=z) for x, y, z in touch.fingertip.positions_m.tolist()]
    normals = [vector(x=x, y=y, z=z) for x, y, z in touch.fingertip.normals.tolist()]
    nothing = np.empty(0)
    values = touch.pressure_pa.astype(np.float32)
    jointed = touch.has_joint
    for i, time_ns in enumerate(touch.time_ns.tolist()):
        pose = messages.pose_message(time_ns, touch.position_m[i], touch.orientation_xyzw[i])
        yield messages.FINGER_POSE, time_ns, pose
        if jointed:
            joint = types["sensor_msgs/msg/JointState"](
                header=messages.header(time_ns, "fingertip"),
                name=[messages.JOINT_NAME],
                position=touch.joint_angle_rad[i : i + 1],
                velocity=nothing,
                effort=nothing,
            )
            yield messages.FINGER_JOINT, time_ns, joint
        taxels = types[messages.TOPIC_TYPES[messages.TAXELS]](
            header=messages.header(time_ns, "fingertip"),
            radius=touch.fingertip.radius_m,
            unit="Pa",
            area=0.0,
            offset=0.0,
            positions=positions if i == 0 else [],
            normals=normals if i == 0 else [],
            values=values[i],
        )
        yield messages.TAXELS, time_ns, taxels
