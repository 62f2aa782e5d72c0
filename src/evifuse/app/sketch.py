"""A picture with what was seen in it, drawn fast: for many pictures, without the bars of belief."""

from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from evifuse.app.labels import place_labels
from evifuse.app.overlay import LEAST_NAMED, label_of, strength
from evifuse.errors import RecordingError
from evifuse.recordings.atomic import replacing
from evifuse.vision import SeenObject

__all__ = ["sketch", "write_sketch"]

INK, PAPER = (28, 28, 28), (255, 255, 255)
TEXT_SCALE = 0.42
STRIP_PX = 24
"""Height of what is written above and below the picture."""

LEAST_WIDTH_PX = 480
"""Narrower pictures get white paper beside them, for what is written."""

SHIFT = 4
"""Binary digits of a pixel's fractions in OpenCV's coordinates."""

FARTHEST_PX = 1e6
"""What lies farther away is drawn towards there."""

DASH_PX, PERIOD_PX = 5.0, 11.0

Image: TypeAlias = NDArray[np.uint8]
Points: TypeAlias = NDArray[np.float64]


def write_sketch(image: Image, objects: Sequence[SeenObject], path: Path) -> None:
    """Draw a picture with its objects into a PNG file.

    Parameters
    ----------
    image : ndarray of uint8, shape (H, W) or (H, W, 3)
        Grey or BGR.
    objects : sequence of SeenObject
        Most prominent first.
    path : Path
        The file, which appears whole or not at all.

    Raises
    ------
    RecordingError
        If it can't be written.
    """
    import cv2

    done, content = cv2.imencode(".png", sketch(image, objects), [cv2.IMWRITE_PNG_COMPRESSION, 1])
    if not done:
        raise RecordingError(f"{path}: the drawing could not be encoded: draw another picture")
    with replacing(path) as beside:
        beside.write_bytes(content.tobytes())


def sketch(image: Image, objects: Sequence[SeenObject]) -> Image:
    """Draw fitted edges tinted by belief, the best primitives dashed, and labels.

    Parameters
    ----------
    image : ndarray of uint8, shape (H, W) or (H, W, 3)
        Grey or BGR; small ones are enlarged, large ones reduced.
    objects : sequence of SeenObject
        Most prominent first.

    Returns
    -------
    ndarray of uint8, shape (H', W', 3)
        BGR, with a line of text above and the scale of colours below.
    """
    import cv2

    height, width = image.shape[:2]
    zoom = min(max(1.0, min(720 / width, 560 / height)), 1500 / width, 1100 / height)
    size = max(1, round(width * zoom)), max(1, round(height * zoom))
    how = cv2.INTER_AREA if zoom < 1 else cv2.INTER_CUBIC
    picture = np.asarray(cv2.resize(image, size, interpolation=how), np.uint8)
    if picture.ndim == 2:
        picture = np.asarray(cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR), np.uint8)
    levels = np.arange(256, dtype=np.uint8)
    tints = np.asarray(cv2.applyColorMap(levels, cv2.COLORMAP_PLASMA), np.uint8).reshape(256, 3)
    for seen in reversed(objects):
        _object(picture, seen, zoom, tints)
    named = [seen for seen in objects if strength(seen) >= LEAST_NAMED]
    unnamed = len(objects) - len(named) + _labels(picture, named, zoom)
    return _framed(picture, _title(len(objects), unnamed), tints)


def _title(count: int, unnamed: int) -> str:
    title = f"Seen: {count} object{'' if count == 1 else 's'}"
    return title + (f", {unnamed} of them weak or hidden: no label" if unnamed else "")


def _object(picture: Image, seen: SeenObject, zoom: float, tints: Image) -> None:
    """The fitted edges on a dark rim, and the best primitive dashed over them."""
    thick = 3 if strength(seen) >= LEAST_NAMED else 1
    if seen.fitted_edges:
        ends = np.array([[e.start, e.end] for e in seen.fitted_edges])
        lines = _fixed(_enlarged(ends, zoom))
        _strokes(picture, lines, INK, thick + 2)
        for line, edge in zip(lines, seen.fitted_edges, strict=True):
            _strokes(picture, line[None], tints[round(255 * edge.belief)].tolist(), thick)
    if seen.primitives:
        best = seen.primitives[0]
        outline = np.vstack([best.shape, best.shape[:1]]) if best.kind != "bracket" else best.shape
        dashes = _fixed(_dashes(_enlarged(outline, zoom)))
        _strokes(picture, dashes, INK, 2)
        _strokes(picture, dashes, PAPER, 1)


def _enlarged(points: Points, zoom: float) -> Points:
    """Coordinates of the picture as those of the drawing; pixel centres are whole numbers in both."""
    return (points + 0.5) * zoom - 0.5


def _fixed(lines: Points) -> NDArray[np.int32]:
    """Coordinates as OpenCV counts fractions of a pixel, in 32 bits."""
    return np.round(lines.clip(-FARTHEST_PX, FARTHEST_PX) * (1 << SHIFT)).astype(np.int32)


def _strokes(picture: Image, lines: NDArray[np.int32], colour: Sequence[int], thick: int) -> None:
    import cv2

    cv2.polylines(picture, list(lines), False, tuple(colour), thick, cv2.LINE_AA, SHIFT)


def _dashes(outline: Points) -> Points:
    """Pieces of a line of equal length, with gaps; shape (N, 3, 2)."""
    along = np.concatenate([[0.0], np.hypot(*np.diff(outline, axis=0).T).cumsum()])
    starts = np.arange(0.0, along[-1], max(PERIOD_PX, along[-1] / 2000))
    at = starts[:, None] + np.linspace(0.0, DASH_PX, 3)
    x, y = (np.interp(at, along, outline[:, i]) for i in (0, 1))
    return np.stack([x, y], axis=2)


def _labels(picture: Image, objects: Sequence[SeenObject], zoom: float) -> int:
    """Write labels where none covers another; how many found no room."""
    import cv2

    texts = [label_of(seen) for seen in objects]
    sizes = [(w + 6.0, h + 7.0) for w, h in (_extent(text) for text in texts)]
    boxes = np.array([seen.box for seen in objects], np.float64).reshape(-1, 4) * zoom
    places = place_labels(boxes, sizes, (picture.shape[1], picture.shape[0]))
    for text, place, (w, h), box in zip(texts, places, sizes, boxes, strict=True):
        if place is None:
            continue
        left, top = round(place[0]), round(place[1])
        right, bottom = left + round(w), top + round(h)
        middle = np.array([place[0] + w / 2, place[1] + h / 2])
        nearest = np.clip(middle, box[:2], box[:2] + box[2:])
        if abs(nearest - middle)[1] > h or abs(nearest - middle)[0] > w:
            leader = _fixed(np.stack([middle, nearest])[None])
            _strokes(picture, leader, INK, 3)
            _strokes(picture, leader, PAPER, 1)
        under = picture[max(top, 0) : bottom, max(left, 0) : right]
        under[:] = np.round(under * 0.2 + np.array(INK) * 0.8)
        cv2.putText(picture, text, (left + 3, bottom - 4), *_font(), PAPER, 1, cv2.LINE_AA)
    return sum(place is None for place in places)


def _font() -> tuple[int, float]:
    import cv2

    return cv2.FONT_HERSHEY_SIMPLEX, TEXT_SCALE


def _extent(text: str) -> tuple[int, int]:
    import cv2

    width, height = cv2.getTextSize(text, *_font(), 1)[0]
    return int(width), int(height)


def _framed(picture: Image, title: str, tints: Image) -> Image:
    """White paper around the picture, with a title above and the scale of colours below."""
    import cv2

    height, width = picture.shape[:2]
    sheet = np.full((height + 2 * STRIP_PX, max(width, LEAST_WIDTH_PX), 3), 255, np.uint8)
    sheet[STRIP_PX : STRIP_PX + height, :width] = picture

    def write(text: str, left: int, bottom: int) -> None:
        cv2.putText(sheet, text, (left, bottom), *_font(), INK, 1, cv2.LINE_AA)

    write(title, 4, STRIP_PX - 8)
    below = STRIP_PX + height
    write("belief 0", 4, below + 16)
    sheet[below + 7 : below + 18, 66:194] = tints[::2]
    write("1;  solid: fitted edge, dashed: primitive", 200, below + 16)
    return sheet
