"""A picture with what was seen in it: fitted edges tinted by belief, primitives, and labels."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from evifuse.app.labels import place_labels
from evifuse.vision import SeenObject

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["LEAST_NAMED", "TINT", "label_of", "legend", "overlay", "strength"]

TINT = "plasma"
"""Colours of belief from 0, dark, to 1, bright."""

INK, PAPER = "#1c1c1c", "white"

LEAST_NAMED = 0.2
"""Objects that less is believed of are drawn thin and without a label."""

MOST_PX = 2000
"""Larger pictures are reduced before they are drawn."""


def overlay(
    axes: "Axes",
    image: NDArray[np.uint8],
    objects: Sequence[SeenObject],
    touched: SeenObject | None = None,
) -> int:
    """Draw a picture with its objects.

    Parameters
    ----------
    axes : Axes
        Where to draw, in a figure with a canvas of Agg; other axes of a layout are drawn before.
    image : ndarray of uint8, shape (H, W) or (H, W, 3)
        Grey or BGR.
    objects : sequence of SeenObject
        Most prominent first.
    touched : SeenObject, optional
        The only one to be drawn in bold.

    Returns
    -------
    int
        Objects without a label, because little is believed of them or there was no room for it.
    """
    height, width = image.shape[:2]
    axes.imshow(_shown(image), cmap="gray", vmin=0, vmax=255, extent=(-0.5, width - 0.5, height - 0.5, -0.5))
    axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), xticks=[], yticks=[])
    for seen in reversed(objects):
        _object(axes, seen, bold=strength(seen) >= LEAST_NAMED if touched is None else seen is touched)
    named = [seen for seen in objects if strength(seen) >= LEAST_NAMED or seen is touched]
    return len(objects) - len(named) + _labels(axes, named)


def legend(axes: "Axes") -> None:
    """Draw what the colours and lines mean.

    Parameters
    ----------
    axes : Axes
        Wide and low, for the scale of colours.
    """
    axes.imshow(np.linspace(0, 1, 128)[None], cmap=TINT, aspect="auto", extent=(0, 1, 0, 1))
    axes.set(yticks=[], xticks=[0, 0.5, 1])
    axes.tick_params(labelsize=8, length=2)
    axes.set_title("solid: fitted edge, by belief; dashed: primitive", loc="left", fontsize=8)


def label_of(seen: SeenObject) -> str:
    """What an object is and the belief in it.

    Parameters
    ----------
    seen : SeenObject
        The object.

    Returns
    -------
    str
        For example ``elliptical 0.87``.
    """
    return f"{seen.classification.decision or 'unknown'} {strength(seen):.2f}"


def strength(seen: SeenObject) -> float:
    """Belief in what an object is said to be.

    Parameters
    ----------
    seen : SeenObject
        The object.

    Returns
    -------
    float
        In [0, 1]; of an object without a decision the mass on the frame.
    """
    return seen.classification.belief.as_dict().get(seen.classification.decision or "frame", 0.0)


def _shown(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    import cv2

    scale = MOST_PX / max(image.shape[:2])
    if scale < 1:
        size = (max(1, round(image.shape[1] * scale)), max(1, round(image.shape[0] * scale)))
        image = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)
    return image if image.ndim == 2 else image[..., ::-1]


def _object(axes: "Axes", seen: SeenObject, *, bold: bool) -> None:
    """The best primitive dashed, and the fitted edges over it, all on a dark rim."""
    from matplotlib import colormaps
    from matplotlib.collections import LineCollection
    from matplotlib.patheffects import Normal, Stroke

    thick = 2.4 if bold else 1.2
    if seen.fitted_edges:
        lines = [np.array([e.start, e.end]) for e in seen.fitted_edges]
        rim: list[Any] = [Stroke(linewidth=thick + 1.6, foreground=INK), Normal()]
        colours = colormaps[TINT]([e.belief for e in seen.fitted_edges])
        axes.add_collection(
            LineCollection(lines, colors=colours, linewidths=thick, capstyle="round", path_effects=rim)
        )
    if seen.primitives:
        best = seen.primitives[0]
        closed = best.kind != "bracket"
        outline = np.vstack([best.shape, best.shape[:1]]) if closed else best.shape
        rim = [Stroke(linewidth=2.2, foreground=INK, alpha=0.6), Normal()]
        axes.plot(*outline.T, color=PAPER, lw=0.9, ls=(0, (4, 3)), path_effects=rim)


def _labels(axes: "Axes", objects: Sequence[SeenObject]) -> int:
    """Write labels where none covers another, with a line to the object from a label far away."""
    figure: Any = axes.figure
    if figure.get_layout_engine() is not None:
        figure.draw_without_rendering()  # settles where the axes are
    renderer = figure.canvas.get_renderer()
    to_display, to_data = axes.transData, axes.transData.inverted()
    frame = axes.get_window_extent()
    texts = [_text(axes, label_of(seen), renderer) for seen in objects]
    extents = [t.get_bbox_patch().get_window_extent(renderer) for t in texts]
    boxes = np.zeros((len(objects), 4))
    for i, seen in enumerate(objects):
        x, y, w, h = seen.box
        left, top = to_display.transform((x - 0.5, y - 0.5))
        right, bottom = to_display.transform((x + w - 0.5, y + h - 0.5))
        boxes[i] = left - frame.x0, frame.y1 - top, right - left, top - bottom
    sizes = [(e.width, e.height) for e in extents]
    places = place_labels(boxes, sizes, (frame.width, frame.height))
    for text, place, (w, h), box in zip(texts, places, sizes, boxes, strict=True):
        if place is None:
            text.remove()
            continue
        middle = np.array([place[0] + w / 2, place[1] + h / 2])
        nearest = np.clip(middle, box[:2], box[:2] + box[2:])
        ends = to_data.transform([(frame.x0 + p[0], frame.y1 - p[1]) for p in (middle, nearest)])
        text.set_position(tuple(ends[0]))
        if abs(nearest - middle)[1] > h or abs(nearest - middle)[0] > w:
            axes.plot(*ends.T, color=INK, lw=1.8, zorder=3)
            axes.plot(*ends.T, color=PAPER, lw=0.8, zorder=3)
    return sum(place is None for place in places)


def _text(axes: "Axes", label: str, renderer: Any) -> Any:
    paper = {"facecolor": INK, "alpha": 0.8, "pad": 1.5, "edgecolor": "none"}
    where = axes.get_xlim()[0], axes.get_ylim()[0]
    text = axes.text(*where, label, color=PAPER, fontsize=8, ha="center", va="center", bbox=paper, zorder=4)
    text.update_bbox_position_size(renderer)
    return text
