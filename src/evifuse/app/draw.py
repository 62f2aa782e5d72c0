"""Pictures for people: image with fitted edges, taxel patch, curvatures and belief bars."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from evifuse.app.overlay import label_of, legend, overlay
from evifuse.app.path_panel import draw_path, draw_rolls
from evifuse.fusion import Fusion, project, touched_place
from evifuse.recordings.atomic import replacing
from evifuse.recordings.recording import Scene, TouchRecording
from evifuse.touch import FeltSurface
from evifuse.vision import SeenObject

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["draw_fusion", "draw_shapes", "draw_touch"]

SEEN, FELT, BOTH, NOBODY = "#2f7ebc", "#d97a27", "#3a3a3a", "#b8b8b8"


def draw_shapes(image: NDArray[np.uint8], objects: Sequence[SeenObject], path: Path) -> None:
    """Draw a picture with its objects, the scale of their colours, and the belief of the first.

    Parameters
    ----------
    image : ndarray of uint8, shape (H, W) or (H, W, 3)
        Grey or BGR.
    objects : sequence of SeenObject
        Most prominent first.
    path : Path
        PNG to write.
    """
    figure, left, scale, right = _sheet(image.shape[1], image.shape[0])
    unnamed = overlay(left, image, objects)
    title = f"Seen: {len(objects)} object{'' if len(objects) == 1 else 's'}"
    left.set_title(title + (f", {unnamed} of them weak or hidden: no label" if unnamed else ""), loc="left")
    legend(scale)
    _shape_bars(right, objects[0] if objects else None)
    if objects:
        right.set_title(f"Belief in the first: {label_of(objects[0])}", loc="left")
    _save(figure, path)


def draw_touch(recording: TouchRecording, felt: FeltSurface, path: Path) -> None:
    """Draw the taxel patch, the path with the sites' curvatures, the rolls, and the belief of a touch.

    Parameters
    ----------
    recording : TouchRecording
        What was rolled.
    felt : FeltSurface
        What was felt.
    path : Path
        PNG to write.
    """
    figure = _figure(13, 9.5)
    axes = figure.subplots(2, 2, width_ratios=[1.25, 1], height_ratios=[1.2, 1])
    draw_path(axes[0, 0], recording, felt)
    _patch(axes[0, 1], recording)
    _curvatures(axes[1, 0], felt)
    _touch_bars(axes[1, 1], felt)
    decision = felt.decision or "nothing"
    figure.suptitle(f"{recording.name}: {decision}", x=0.01, ha="left", fontweight="bold")
    _save(figure, path)


def draw_fusion(scene: Scene, fusion: Fusion, path: Path) -> None:
    """Draw both senses and what they say together.

    Parameters
    ----------
    scene : Scene
        Picture and touch.
    fusion : Fusion
        Their fusion.
    path : Path
        PNG to write.
    """
    figure = _figure(15, 8.5)
    axes = figure.subplots(2, 3, width_ratios=[1.5, 1, 1])
    place = None if fusion.touch is None else touched_place(fusion.touch)
    contact = None if scene.camera is None or place is None else project(scene.camera, place)
    _patch(axes[0, 1], scene.touch)
    _curvatures(axes[0, 2], fusion.touch)
    _shape_bars(axes[1, 1], fusion.shape)
    _touch_bars(axes[1, 2], fusion.touch)
    _fused_bars(axes[1, 0], fusion)
    _image(axes[0, 0], scene.image, fusion.objects, fusion.shape, contact)
    _save(figure, path)


def _figure(width: float, height: float) -> "Figure":
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _sheet(width: int, height: int) -> tuple["Figure", "Axes", "Axes", "Axes"]:
    """A figure with places for a picture, a scale of colours and bars; small pictures are enlarged."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    zoom = min(max(1.0, min(720 / width, 560 / height)), 1500 / width, 1100 / height)
    wide, high = max(width * zoom, 240), max(height * zoom, 420)
    sheet = wide + 440, high + 50
    figure = Figure(figsize=(sheet[0] / 100, sheet[1] / 100), dpi=100)
    FigureCanvasAgg(figure)

    def place(x: float, y: float, w: float, h: float) -> "Axes":
        return figure.add_axes((x / sheet[0], 1 - (y + h) / sheet[1], w / sheet[0], h / sheet[1]))

    picture = place(10, 34, wide, high)
    picture.set_anchor("NW")
    return figure, picture, place(wide + 120, 34, 300, 12), place(wide + 120, 104, 300, 240)


def _save(figure: "Figure", path: Path) -> None:
    """Write beside, then rename: nothing half written."""
    with replacing(path) as beside:
        figure.savefig(beside, format="png")


def _nothing(axes: "Axes", title: str, text: str) -> None:
    axes.set_title(title, loc="left")
    axes.text(0.5, 0.5, text, ha="center", va="center", color="grey", transform=axes.transAxes)
    axes.set_axis_off()


def _image(
    axes: "Axes",
    image: NDArray[np.uint8] | None,
    objects: Sequence[SeenObject],
    touched: SeenObject | None,
    contact: tuple[float, float] | None,
) -> None:
    title = "Seen: fitted edges, brighter with belief"
    if image is None:
        _nothing(axes, title, "no picture")
        return
    overlay(axes, image, objects, touched)
    if contact is not None:
        axes.plot(*contact, marker="+", ms=14, mew=2.5, color="red")
        axes.annotate("touched", contact, xytext=(8, 6), textcoords="offset points", color="red", fontsize=9)
    axes.set_title(title, loc="left")


def _patch(axes: "Axes", recording: TouchRecording | None) -> None:
    title = "Felt: highest pressure of each taxel (kPa)"
    if recording is None:
        _nothing(axes, title, "no touch recording")
        return
    peak = recording.pressure_pa.max(axis=0) / 1000
    places = recording.fingertip.positions_m * 1000
    apex = places.mean(axis=0)
    axis = int(np.argmax(np.abs(apex)))
    u, v = (i for i in range(3) if i != axis)
    side = max(4.0, min(120.0, 9000 / len(peak)))
    highest = max(float(peak.max()), 1.0)  # without contact, all is dark
    dots = axes.scatter(
        places[:, u], places[:, v], c=peak, s=side, cmap="inferno", marker="o", vmin=0, vmax=highest
    )
    dots.set(edgecolors="#9a9a9a", linewidths=0.4)
    axes.figure.colorbar(dots, ax=axes, shrink=0.8)
    axes.set(aspect="equal", xlabel=f"{'xyz'[u]} of the fingertip (mm)")
    axes.set_ylabel(f"{'xyz'[v]} of the fingertip (mm)")
    axes.set_title(title, loc="left")


def _curvatures(axes: "Axes", felt: FeltSurface | None) -> None:
    if felt is None or not felt.local_curvatures:
        title = "Felt: curvature along each roll (1/m)"
        _nothing(axes, title, "no roll" if felt is not None else "no touch recording")
        return
    draw_rolls(axes, felt)


def _bars(axes: "Axes", title: str, shares: Mapping[str, float], colour: str) -> None:
    labels = list(shares)
    values = [shares[k] for k in labels]
    colours = [NOBODY if k == "frame" else colour for k in labels]
    axes.barh(labels, values, color=colours)
    for i, value in enumerate(values):
        axes.text(value + 0.01, i, f"{value:.2f}", va="center", fontsize=8)
    axes.invert_yaxis()
    axes.set(xlim=(0, 1.15), xticks=[0, 0.5, 1], xlabel="mass")
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_title(title, loc="left")


def _masses(evidence: Any) -> dict[str, float]:
    found = evidence.as_dict()
    names = (*evidence.frame.hypotheses, *(k for k in found if "|" in k), "frame")
    return {k: found.get(k, 0.0) for k in names}


def _shape_bars(axes: "Axes", seen: SeenObject | None) -> None:
    title = "Belief over shape primitives"
    if seen is None:
        _nothing(axes, title, "no object")
        return
    _bars(axes, title, _masses(seen.evidence), SEEN)


def _touch_bars(axes: "Axes", felt: FeltSurface | None) -> None:
    title = "Belief over curvature primitives"
    if felt is None:
        _nothing(axes, title, "no touch recording")
        return
    _bars(axes, title, _masses(felt.evidence), FELT)


def _fused_bars(axes: "Axes", fusion: Fusion) -> None:
    labels = list(fusion.total)
    rows = np.arange(len(labels) + 1)
    touch = np.array([fusion.from_touch[k] for k in labels] + [0.0])
    shape = np.array([fusion.from_shape[k] for k in labels] + [0.0])
    found = fusion.belief.as_dict()
    belief = [found.get(k, 0.0) for k in (*labels, "frame")]
    axes.barh(rows - 0.2, touch, height=0.36, color=FELT, label="conductivity from touch")
    axes.barh(rows - 0.2, shape, left=touch, height=0.36, color=SEEN, label="conductivity from shape")
    axes.barh(rows + 0.2, belief, height=0.36, color=[BOTH] * len(labels) + [NOBODY], label="fused belief")
    for i, value in enumerate(belief):
        axes.text(value + 0.01, rows[i] + 0.2, f"{value:.2f}", va="center", fontsize=8)
    axes.set_yticks(rows, [*labels, "frame"])
    axes.invert_yaxis()
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(loc="lower right", fontsize=8)
    axes.set_title(f"Fused: {fusion.decision or 'no decision'}", loc="left", fontweight="bold")
