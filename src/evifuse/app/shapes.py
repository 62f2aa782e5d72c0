"""``evifuse shape``: the objects of one picture or of many, one after another."""

import json
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from evifuse.app.overlay import label_of
from evifuse.app.pictures import Sources, find_sources, pictures_of
from evifuse.app.scale import Scale, find_scale
from evifuse.app.videos import Picture, camera_pictures
from evifuse.conductivity import KnowledgeBase
from evifuse.errors import EvifuseError, ImageError, UsageError
from evifuse.knowledge import load_knowledge
from evifuse.vision import SeenObject, sense_shapes

if TYPE_CHECKING:
    from evifuse.app.drawings import Drawings

__all__ = ["Unusable", "bar", "run_shape"]

LISTED = 4
"""Objects of a picture that the table of many pictures names."""


@dataclass(frozen=True)
class Unusable:
    """A file that could not be seen, or not to its end.

    Parameters
    ----------
    path : str
        The file.
    why : str
        In a line.
    """

    path: str
    why: str


Seen: TypeAlias = "tuple[Picture, tuple[SeenObject, ...]]"
"""A picture and its objects, most prominent first."""


def run_shape(
    pictures: tuple[str, ...],
    camera: int | None,
    every: int,
    frames: int | None,
    intrinsics: str | None,
    plane: str | None,
    depth: str | None,
    knowledge: str,
    primitives: str | None,
    as_json: bool,
    draw: Path | None,
) -> None:
    """See the shapes in pictures.

    Parameters
    ----------
    pictures : tuple of str
        Files, folders and patterns.
    camera : int or None
        Number of a camera, instead of files.
    every : int
        Take every so many frames of a video or camera.
    frames : int or None
        Take at most so many frames of each video or of the camera.
    intrinsics : str or None
        ``fx,fy,cx,cy`` in px, or a calibration file.
    plane : str or None
        ``nx,ny,nz,d``: where the objects lie.
    depth : str or None
        Their depth in metres, or a depth picture.
    knowledge : str
        Name or path of the classes of shape features.
    primitives : str or None
        ``my_module:NAME``: primitives beside the built-in ones.
    as_json : bool
        Print JSON.
    draw : Path or None
        PNG to write, or a folder for many.

    Raises
    ------
    UsageError
        If options contradict each other or there is nothing to see.
    ImageError
        If the picture, or one of many, could not be used.
    """
    if camera is not None and pictures:
        raise UsageError("give either pictures or --camera, not both")
    if camera is None and not pictures:
        raise UsageError("nothing to see: give an IMAGE, a folder, a video, or --camera 0")
    if camera is not None and not 0 <= camera < 100:  # further numbers mean something else to OpenCV
        raise UsageError(f"--camera {camera}: cameras are numbered from 0")
    for name, number in (("--every", every), ("--frames", 1 if frames is None else frames)):
        if number < 1:
            raise UsageError(f"{name} {number}: it must be 1 or more")
    base = load_knowledge(knowledge)
    own: dict[str, Any] = {}
    if primitives is not None:
        from evifuse.app.primitives import find_primitives

        own["primitives"] = find_primitives(primitives, base)
    sources = find_sources(pictures) if camera is None else Sources((f"camera {camera}",), True)
    scale = find_scale(intrinsics, plane, depth)
    drawings = None
    if draw is not None:
        from evifuse.app.drawings import Drawings

        drawings = Drawings(draw, sources)
    if not sources.many:
        _one(sources.paths[0], base, scale, own, as_json, drawings)
        return
    seen = _looked_at(sources, camera, every, frames, base, scale, own)
    _many(seen, sources, scale, as_json, drawings)


def _one(
    path: str,
    base: KnowledgeBase,
    scale: Scale | None,
    own: dict[str, Any],
    as_json: bool,
    drawings: "Drawings | None",
) -> None:
    """One picture: an object of JSON, or tables with the reasons."""
    picture = next(pictures_of(path))
    if scale is not None:
        picture = scale.rectified(picture)
    objects = sense_shapes(picture.image, base, **own, **_view(picture, scale))
    if picture.note:
        _notice(picture.note)
    if drawings is not None:
        drawings.draw(picture, objects)
    if as_json:
        indent = 2 if sys.stdout.isatty() else None
        print(json.dumps({"objects": _to_json(picture, objects, scale)}, allow_nan=False, indent=indent))
        return
    from evifuse.app.report import report_shapes

    tty = sys.stdout.isatty()
    console = Console(soft_wrap=not tty, width=None if tty else 160)
    report_shapes(objects, console, why=True)
    if scale is not None and objects:
        scale.report(picture, objects, console)


def _looked_at(
    sources: Sources,
    camera: int | None,
    every: int,
    frames: int | None,
    base: KnowledgeBase,
    scale: Scale | None,
    own: dict[str, Any],
) -> "Iterator[Seen | Unusable]":
    """See picture after picture; what can't be used is said, and the rest is done."""
    for path in sources.paths:
        found = pictures_of(path, every, frames) if camera is None else camera_pictures(camera, every, frames)
        try:
            for taken in found:
                picture = taken if scale is None else scale.rectified(taken)
                yield picture, sense_shapes(picture.image, base, **own, **_view(picture, scale))
        except (EvifuseError, OSError, MemoryError) as error:
            if camera is not None and isinstance(error, UsageError):
                raise
            yield Unusable(path, _why(path, error))


def _view(picture: Picture, scale: Scale | None) -> dict[str, Any]:
    """The camera and plane that shapes are judged by, if they are known."""
    view = None if scale is None else scale.view(picture)
    return {} if view is None else {"view": view}


def _why(path: str, error: BaseException) -> str:
    if isinstance(error, MemoryError):
        return f"{path}: not enough memory for this picture: scale it down"
    text = " ".join(str(error).split())
    return text if path in text else f"{path}: {text}"


def _many(
    found: "Iterator[Seen | Unusable]",
    sources: Sources,
    scale: Scale | None,
    as_json: bool,
    drawings: "Drawings | None",
) -> None:
    """A line for each picture as it is seen, what is broken on standard error, and a summary."""
    start, pictures, objects = time.monotonic(), 0, 0
    broken: list[str] = []
    width = min(max(len(p) for p in sources.paths), 60)
    header = (
        "" if as_json else f"{'picture'.ljust(width)}  objects and the belief in them, best primitive first\n"
    )
    with bar() as shown:
        task = shown.add_task("", total=len(sources.paths) if len(sources.paths) > 1 else None)
        done: set[str] = set()
        try:
            for one in found:
                path = one.path if isinstance(one, Unusable) else one[0].path
                done.add(path)
                if isinstance(one, Unusable):
                    broken.append(path)
                    _notice(one.why)
                else:
                    picture, seen = one
                    if picture.note:
                        _notice(picture.note)
                    if drawings is not None:
                        drawings.draw(picture, seen)
                    print(header + _line(picture, seen, scale, as_json, width), flush=True)
                    header = ""
                    pictures, objects = pictures + 1, objects + len(seen)
                frame = "" if isinstance(one, Unusable) or one[0].frame is None else f" {one[0].frame}"
                shown.update(task, completed=len(done), description=path + frame)
        except KeyboardInterrupt:
            raise KeyboardInterrupt(f"stopped: {_summary(pictures, objects, start)} until then") from None
    summary = _summary(pictures, objects, start)
    if broken:
        files = "file" if len(broken) == 1 else "files"
        raise ImageError(f"{summary}; {len(broken)} {files} could not be used, named above")
    _notice(summary)


def bar() -> Progress:
    """A bar on standard error, on a terminal only; output to a file or pipe passes it by.

    Returns
    -------
    rich.progress.Progress
        Without a task yet.
    """
    console = Console(stderr=True, soft_wrap=True)
    return Progress(
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.description}", markup=False),
        console=console,
        transient=True,
        disable=not console.is_terminal,
        redirect_stdout=sys.stdout.isatty(),
    )


def _summary(pictures: int, objects: int, start: float) -> str:
    seconds = time.monotonic() - start
    rate = f", {pictures / seconds:.1f} pictures per second" if pictures and seconds > 0 else ""
    return f"{_counted(objects, 'object')} in {_counted(pictures, 'picture')}{rate}"


def _counted(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def _line(
    picture: Picture, objects: tuple[SeenObject, ...], scale: Scale | None, as_json: bool, width: int
) -> str:
    """What one of many pictures shows, in a line."""
    if as_json:
        where: dict[str, Any] = {"path": picture.path}
        if picture.frame is not None:
            where |= {"frame": picture.frame, "time_s": picture.time_s}
        return json.dumps({**where, "objects": _to_json(picture, objects, scale)}, allow_nan=False)
    name = picture.path.encode("utf-8", "backslashreplace").decode().ljust(width)  # any bytes can be a name
    if picture.frame is not None:
        name += f" {picture.frame:6d} {picture.time_s:9.3f} s"
    shown = [label_of(o) for o in objects[:LISTED]]
    if len(objects) > LISTED:
        shown.append(f"{len(objects) - LISTED} more")
    return f"{name}  {', '.join(shown) or 'no object'}"


def _to_json(picture: Picture, objects: tuple[SeenObject, ...], scale: Scale | None) -> list[dict[str, Any]]:
    if scale is None:
        return [o.to_json() for o in objects]
    return [scale.to_json(picture, o) for o in objects]


def _notice(text: str) -> None:
    """What a person wants to know, beside the output proper."""
    print(f"evifuse: {text}", file=sys.stderr, flush=True)
