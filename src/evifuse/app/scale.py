"""Metres beside pixels: the camera and the plane or depth that ``evifuse shape`` is given."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from evifuse.app.videos import Picture
from evifuse.errors import ImageError, UsageError
from evifuse.recordings.depth import read_depth
from evifuse.recordings.intrinsics import Intrinsics, read_intrinsics, undistorted
from evifuse.vision import SeenObject, View
from evifuse.vision.lifting import rays_of
from evifuse.vision.metric import Plane, Surface, measure

__all__ = ["Scale", "find_scale"]


@dataclass(frozen=True, eq=False)
class Scale:
    """Where objects lie and through which camera they are seen.

    Parameters
    ----------
    intrinsics : Intrinsics or None
        Of every picture; None if each recording brings its own.
    surface : Plane, float or ndarray of float64, shape (H, W)
        Plane, one depth, or a depth picture, metres.
    name : str
        Where the intrinsics are from, for messages.
    """

    intrinsics: Intrinsics | None
    surface: Surface
    name: str

    def rectified(self, picture: Picture) -> Picture:
        """The picture free of lens distortion, as a pinhole camera would have taken it.

        Parameters
        ----------
        picture : Picture
            As it was taken.

        Returns
        -------
        Picture
            With its camera; the same image if the lens has no distortion.

        Raises
        ------
        ImageError
            If camera or depth picture are for pictures of another size.
        UsageError
            If there are no intrinsics, or all of the plane is behind the camera.
        """
        camera = self.intrinsics or _intrinsics_of(picture)
        size = (picture.image.shape[1], picture.image.shape[0])
        if camera.size is not None and camera.size != size:
            raise ImageError(
                f"{picture.path} is {size[0]} x {size[1]} px, but its intrinsics are for "
                f"{camera.size[0]} x {camera.size[1]} px: calibrate for this size"
            )
        if isinstance(self.surface, np.ndarray) and self.surface.shape != size[::-1]:
            high, wide = self.surface.shape
            raise ImageError(
                f"{picture.path} is {size[0]} x {size[1]} px, but the depth picture {wide} x {high} px: "
                "they must cover the same pixels"
            )
        if isinstance(self.surface, Plane):
            self._check_in_view(self.surface, camera, picture.path, size)
        return replace(picture, image=undistorted(picture.image, camera, self.name), camera=camera)

    def view(self, picture: Picture) -> View | None:
        """What the shapes of a picture are judged by.

        Parameters
        ----------
        picture : Picture
            Rectified.

        Returns
        -------
        View or None
            None with a depth picture: there each object has a plane of its own.
        """
        if isinstance(self.surface, np.ndarray):
            return None
        camera = picture.camera or self.intrinsics or _intrinsics_of(picture)
        facing = np.array([0.0, 0.0, 1.0])
        plane = self.surface if isinstance(self.surface, Plane) else Plane(facing, self.surface)
        return View(camera.matrix, plane)

    @staticmethod
    def _check_in_view(plane: Plane, camera: Intrinsics, path: str, size: tuple[int, int]) -> None:
        """Refuse a plane that no corner of the picture sees."""
        ends = np.array([[0, 0], [size[0], 0], [0, size[1]], size], np.float64) - 0.5
        towards = rays_of(ends, camera.matrix) @ plane.normal
        if not (towards * plane.distance_m > 0).any():
            raise UsageError(
                f"{path}: the plane lies behind the camera: with normal {plane.normal.round(3).tolist()} its "
                f"distance must be {-plane.distance_m:g} m, not {plane.distance_m:g} m"
            )

    def to_json(self, picture: Picture, seen: SeenObject) -> dict[str, Any]:
        """An object with its metres beside its pixels.

        Parameters
        ----------
        picture : Picture
            Where it was seen, rectified.
        seen : SeenObject
            The object.

        Returns
        -------
        dict
            As `SeenObject.to_json`; fields that end in ``_m`` in each primitive and fitted edge, and
            `plane`. Where the object can't be measured, `not_measured` says why instead.
        """
        found = seen.to_json()
        camera = picture.camera or self.intrinsics or _intrinsics_of(picture)
        try:
            metres = measure(seen, camera.matrix, self.surface)
        except ImageError as error:
            return {**found, "not_measured": str(error)}
        for key in ("primitives", "fitted_edges"):
            found[key] = [{**px, **m} for px, m in zip(found[key], metres[key], strict=True)]
        return {**found, "plane": metres["plane"]}

    def report(self, picture: Picture, objects: tuple[SeenObject, ...], console: Console) -> None:
        """Print the size of each object as its best primitive has it.

        Parameters
        ----------
        picture : Picture
            Where they were seen, rectified.
        objects : tuple of SeenObject
            Most prominent first.
        console : Console
            Where to print.
        """
        table = Table(title="In metres", title_justify="left", title_style="bold", pad_edge=False, box=None)
        for column in ("object", "primitive", "size (m)", "at x, y, z (m)"):
            table.add_column(column)
        left_out: list[str] = []
        for seen in objects:
            found = self.to_json(picture, seen)
            first = found["primitives"][0] if found["primitives"] else {"kind": "-"}
            row = ["-", "-"] if "not_measured" in found else _sizes(first)
            table.add_row(found["decision"] or "unknown", first["kind"], *row)
            if "not_measured" in found:
                left_out.append(found["not_measured"])
        console.print(table)
        if left_out:
            console.print(
                f"Not measured: {len(left_out)} of {len(objects)}, the first because {left_out[0]}."
            )


def _sizes(primitive: dict[str, Any]) -> list[str]:
    """Lengths, and where the middle is."""
    lengths = primitive.get("sides_m", primitive.get("axes_m", []))
    middle = primitive.get("centre_m")
    if middle is None and "corners_m" in primitive:
        middle = np.mean(primitive["corners_m"], axis=0)
    place = "-" if middle is None else ", ".join(f"{v:.3f}" for v in middle)
    return [" x ".join(f"{v:.3f}" for v in lengths) or "-", place]


def _intrinsics_of(picture: Picture) -> Intrinsics:
    """What a recording says of its camera."""
    if picture.path.lower().endswith(".mcap"):
        return read_intrinsics(picture.path)
    raise UsageError(f"{picture.path}: this picture has no intrinsics with it: give --intrinsics fx,fy,cx,cy")


def find_scale(intrinsics: str | None, plane: str | None, depth: str | None) -> Scale | None:
    """What is needed for metres, from the texts of the command line.

    Parameters
    ----------
    intrinsics : str or None
        ``fx,fy,cx,cy`` in px, or a calibration file.
    plane : str or None
        ``nx,ny,nz,d``, normal and distance in metres, camera frame.
    depth : str or None
        A number of metres, or a depth picture.

    Returns
    -------
    Scale or None
        None if none of them is given.

    Raises
    ------
    UsageError
        If they contradict each other, one is missing, or they are not what they should be.
    ImageError
        If the depth picture can't be read.
    RecordingError
        If the calibration file can't be read.
    """
    if plane is None and depth is None:
        if intrinsics is None:
            return None
        raise UsageError("--intrinsics alone give no metres: give --plane nx,ny,nz,d or --depth too")
    if plane is not None and depth is not None:
        raise UsageError("give either --plane or --depth, not both")
    surface = _surface(plane, depth)
    if intrinsics is None:
        return Scale(None, surface, "")
    if Path(intrinsics).is_file():
        return Scale(read_intrinsics(intrinsics), surface, intrinsics)
    numbers = _numbers(intrinsics, 4)
    if numbers is None:
        raise UsageError(
            f"--intrinsics needs four numbers fx,fy,cx,cy in px, or a calibration file that exists, not "
            f"{intrinsics!r}"
        )
    return Scale(Intrinsics.of(*numbers), surface, "--intrinsics")


def _surface(plane: str | None, depth: str | None) -> "Plane | float | NDArray[np.float64]":
    if plane is not None:
        numbers = _numbers(plane, 4)
        if numbers is None:
            raise UsageError(f"--plane needs four numbers nx,ny,nz,d (d in metres), not {plane!r}")
        return Plane(np.array(numbers[:3]), numbers[3])
    text = str(depth)
    numbers = _numbers(text, 1)
    if numbers is None:
        return read_depth(text)
    if not (np.isfinite(numbers[0]) and numbers[0] > 0):
        raise UsageError(f"--depth {text}: a depth is a number of metres above 0, or a depth picture")
    return numbers[0]


def _numbers(text: str, count: int) -> list[float] | None:
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        return None
    return numbers if len(numbers) == count else None
