"""Where the drawings of ``evifuse shape`` go: one file, or one for each picture in a folder."""

from pathlib import Path

from evifuse.app.draw import draw_shapes
from evifuse.app.pictures import Sources
from evifuse.app.sketch import write_sketch
from evifuse.app.videos import Picture
from evifuse.errors import UsageError
from evifuse.vision import SeenObject

__all__ = ["Drawings"]


class Drawings:
    """Names for drawings, which never replace a picture that is looked at, nor each other.

    Parameters
    ----------
    target : Path
        PNG file for one picture; folder for many, made if it is not there.
    sources : Sources
        What is looked at.

    Raises
    ------
    UsageError
        If many pictures are to be drawn into one file, or a picture would be drawn over itself.
    """

    def __init__(self, target: Path, sources: Sources) -> None:
        self._inputs = {Path(p).resolve() for p in sources.paths}
        self._used: set[str] = set()
        self._names: dict[str, str] = {}
        self._many = sources.many
        self._folder = sources.many or target.is_dir()
        self._target = target
        if not self._folder:
            self._refuse_input(target)
            return
        if target.suffix.lower() == ".png" and not target.is_dir():
            raise UsageError(f"--draw {target}: for many pictures name a folder, not a file")
        target.mkdir(parents=True, exist_ok=True)

    def draw(self, picture: Picture, objects: tuple[SeenObject, ...]) -> None:
        """Draw a picture with its objects.

        Parameters
        ----------
        picture : Picture
            The picture.
        objects : tuple of SeenObject
            Most prominent first.

        Raises
        ------
        UsageError
            If it would be drawn over a picture that is looked at.
        RecordingError
            If it can't be written.
        """
        path = self._target
        if self._folder:
            frame = "" if picture.frame is None else f"-{picture.frame:06d}"
            path = self._target / f"{self._name(picture.path)}{frame}.png"
            self._refuse_input(path)
        if self._many:  # a sheet with bars takes a hundred times as long
            write_sketch(picture.image, objects, path)
        else:
            draw_shapes(picture.image, objects, path)

    def _name(self, path: str) -> str:
        """The file's own name without suffix, with a number behind it if another file took it."""
        if path not in self._names:
            stem = Path(path).stem
            name, number = stem, 1
            while name in self._used:
                number += 1
                name = f"{stem}-{number}"
            self._used.add(name)
            self._names[path] = name
        return self._names[path]

    def _refuse_input(self, path: Path) -> None:
        if path.resolve() in self._inputs:
            raise UsageError(f"--draw {path}: this is a picture that is looked at: draw to another place")
