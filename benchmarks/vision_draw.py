"""Diagrams of the figures of `vision.py`: how far probabilities can be trusted, precision over recall."""

from pathlib import Path
from typing import Any


def draw(results: dict[str, Any], folder: Path) -> list[Path]:
    """Draw what there are figures of; the files that were written."""
    folder.mkdir(parents=True, exist_ok=True)
    written: list[Path] = []
    measured = {k: v["calibration"] for k, v in results.get("sensor", {}).items()}
    if measured:
        written.append(_reliability(measured, folder / "reliability.png"))
    if "scenes" in results:
        written.append(_curve(results["scenes"], folder / "scenes.png"))
    return written


def _figure(columns: int, rows: int) -> Any:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(3.2 * columns, 3.2 * rows), dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _reliability(measured: dict[str, dict[str, Any]], path: Path) -> Path:
    columns = min(4, len(measured))
    rows = -(-len(measured) // columns)
    figure = _figure(columns, rows)
    places = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True).ravel()
    for axes, (name, one) in zip(places, measured.items(), strict=False):
        axes.plot([0, 1], [0, 1], color="grey", lw=0.8)
        counts = [b["count"] for b in one["bins"]]
        top = max(counts, default=1)
        axes.bar([b["from"] + 0.05 for b in one["bins"]], [n / top for n in counts], 0.09, color="#e2e2e2")
        axes.plot(*zip(*[(b["confidence"], b["accuracy"]) for b in one["bins"]], strict=True), "o-", ms=4)
        axes.set_title(f"{name}: {100 * one['error']:.1f} %", loc="left", fontsize=9)
        axes.set(xlim=(0, 1), ylim=(0, 1.02))
    for axes in places[len(measured) :]:
        axes.set_axis_off()
    figure.supxlabel("highest pignistic probability (bars: how often)", fontsize=9)
    figure.supylabel("share that is right", fontsize=9)
    figure.savefig(path)
    return path


def _curve(scenes: dict[str, Any], path: Path) -> Path:
    figure = _figure(2, 1)
    left, right = figure.subplots(1, 2)
    rows = [row for row in scenes["curve"] if row["precision"] is not None]
    for name, style in (("precision", "o-"), ("recall", "s--")):
        left.plot([row["belief"] for row in rows], [row[name] for row in rows], style, ms=4, label=name)
    left.set(xlabel="least belief", ylim=(0, 1.02))
    left.legend(fontsize=8)
    right.plot([row["recall"] for row in rows], [row["precision"] for row in rows], "o-", ms=4)
    right.set(xlabel="recall", ylabel="precision", xlim=(0, 1), ylim=(0, 1.02))
    figure.savefig(path)
    return path
