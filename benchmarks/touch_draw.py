"""Pictures of the figures of touch: error by radius, reliability, confusion."""

from pathlib import Path
from typing import Any

import numpy as np
from touch_cases import NAMES, SiteRow
from touch_primitives import calibration, confusion


def draw(folder: Path, rows: dict[str, list[SiteRow]]) -> None:
    """Write `error.png`, `reliability.png` and `confusion.png`, as far as there are rows for them."""
    import matplotlib as mpl

    mpl.use("Agg")
    folder.mkdir(parents=True, exist_ok=True)
    if rows.get("curvature"):
        _errors(rows["curvature"] + rows.get("layouts", []), folder / "error.png")
    if rows.get("primitives"):
        _reliability(rows["primitives"], folder / "reliability.png")
        _confusion(rows["primitives"], folder / "confusion.png")


def _errors(rows: list[SiteRow], path: Path) -> None:
    import matplotlib.pyplot as plt

    levels = list(dict.fromkeys((row.fingertip, row.noise) for row in rows))
    shapes = list(dict.fromkeys(row.surface for row in rows))
    figure, panels = plt.subplots(
        1, len(levels), figsize=(3.6 * len(levels), 3.8), sharey=True, squeeze=False, layout="constrained"
    )
    for panel, (finger, noise) in zip(panels[0], levels, strict=True):
        for colour, shape in enumerate(shapes):
            here = [r for r in rows if (r.fingertip, r.noise, r.surface) == (finger, noise, shape)]
            size = [1000 * row.size_m for row in here]
            panel.loglog(size, [100 * r.relative for r in here], "o", ms=4, color=f"C{colour}", label=shape)
            chapter = [100 * row.chapter_relative for row in here]
            panel.loglog(size, chapter, "x", ms=4, color=f"C{colour}", alpha=0.35)
        panel.set(title=f"{finger}, {noise}", xlabel="radius, mm", xticks=[5, 10, 20, 50, 100])
        panel.set_xticklabels(["5", "10", "20", "50", "100"])
        panel.minorticks_off()
        panel.grid(alpha=0.3)
    panels[0][0].set_ylabel("error, % of the larger curvature")
    panels[0][-1].legend(title="dots: ours\ncrosses: chapter", fontsize=8, title_fontsize=8)
    _save(figure, path)


def _reliability(rows: list[SiteRow], path: Path) -> None:
    import matplotlib.pyplot as plt

    figure, panel = plt.subplots(figsize=(4.6, 4.4), layout="constrained")
    panel.plot([0, 1], [0, 1], color="0.6", lw=1)
    for label, chapter in (("ours", False), ("chapter", True)):
        error, tenths = calibration(rows, chapter)
        count, sure, right = np.array(tenths).T
        panel.plot(sure, right, "-", lw=1, color="C1" if chapter else "C0")
        area = 15 + 250 * count / count.sum()
        panel.scatter(sure, right, s=area, color="C1" if chapter else "C0", label=f"{label}, ECE {error:.3f}")
    panel.set(
        xlabel="largest pignistic probability", ylabel="share right", xlim=(0, 1.02), ylim=(-0.02, 1.05)
    )
    panel.legend(loc="upper left")
    _save(figure, path)


def _confusion(rows: list[SiteRow], path: Path) -> None:
    import matplotlib.pyplot as plt

    table = np.array(confusion(rows))
    share = table / np.maximum(table.sum(axis=1, keepdims=True), 1)
    figure, panel = plt.subplots(figsize=(4.6, 4.4), layout="constrained")
    panel.imshow(share, cmap="Blues", vmin=0, vmax=1)
    for (i, j), count in np.ndenumerate(table):
        if count:
            panel.text(j, i, str(count), ha="center", va="center", color="w" if share[i, j] > 0.5 else "k")
    ticks = range(len(NAMES))
    panel.set(xticks=ticks, yticks=ticks, xticklabels=NAMES, yticklabels=NAMES, xlabel="felt", ylabel="true")
    _save(figure, path)


def _save(figure: Any, path: Path) -> None:
    import matplotlib.pyplot as plt

    figure.savefig(path, dpi=130)
    plt.close(figure)
    print(f"wrote {path}")
