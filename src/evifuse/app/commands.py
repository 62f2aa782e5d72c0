"""What each command does, once its options are parsed."""

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from rich.console import Console

from evifuse.app.reproduce import reproduce
from evifuse.errors import UsageError
from evifuse.fusion import Box, Fusion, fuse, gather_scene
from evifuse.knowledge import load_knowledge
from evifuse.recordings import read_scene
from evifuse.recordings.raw import Given
from evifuse.recordings.recording import Scene

__all__ = ["run_demo", "run_fuse", "run_reproduce"]


def _print_json(value: Any) -> None:
    sys.stdout.write(json.dumps(value, allow_nan=False, indent=2 if sys.stdout.isatty() else None) + "\n")


def _console() -> Console:
    return Console(soft_wrap=not sys.stdout.isatty(), width=None if sys.stdout.isatty() else 160)


def _notice(text: str) -> None:
    """What a person wants to know, beside the output proper."""
    print(f"evifuse: {text}", file=sys.stderr)


def run_fuse(
    scene: Path | None,
    image: Path | None,
    touch: Path | None,
    box: Box | None,
    given: Given,
    shape_knowledge: str,
    curvature_knowledge: str,
    as_json: bool,
    draw: Path | None,
) -> None:
    """Fuse a picture and a rolled finger.

    Parameters
    ----------
    scene : Path or None
        MCAP with both senses.
    image : Path or None
        Picture.
    touch : Path or None
        Touch recording.
    box : tuple of float or None
        Pixel box of the object that was touched.
    given : Given
        What the recording leaves open.
    shape_knowledge : str
        Name or path of the classes of shape features.
    curvature_knowledge : str
        Name or path of the classes of curvature features.
    as_json : bool
        Print JSON.
    draw : Path or None
        Picture to write.

    Raises
    ------
    UsageError
        If both a scene and separate files are given, or nothing at all.
    """
    if scene is not None and (image is not None or touch is not None):
        raise UsageError("give either SCENE.mcap, or --image and --touch, not both")
    if scene is None and image is None and touch is None:
        raise UsageError("nothing to fuse: give SCENE.mcap, or --image and --touch")
    whole = gather_scene(scene if scene is not None else image, touch, given)
    notes = whole.notes + (() if whole.touch is None else whole.touch.notes)
    for note in notes:
        _notice(note)
    result = fuse(
        whole,
        box=box,
        shape_knowledge=load_knowledge(shape_knowledge),
        curvature_knowledge=load_knowledge(curvature_knowledge),
    )
    _show_fusion(whole, result if as_json else _without(result, notes), as_json, draw)


def _without(fusion: Fusion, notes: tuple[str, ...]) -> Fusion:
    """Without the warnings that were said on standard error already."""
    touch = fusion.touch
    if touch is not None:
        touch = replace(touch, warnings=tuple(w for w in touch.warnings if w not in notes))
    return replace(fusion, touch=touch, warnings=tuple(w for w in fusion.warnings if w not in notes))


def _show_fusion(scene: Scene, result: Fusion, as_json: bool, draw: Path | None) -> None:
    if draw is not None:
        from evifuse.app.draw import draw_fusion

        draw_fusion(scene, result, draw)
    if as_json:
        _print_json(result.to_json())
        return
    from evifuse.app.report import report_fusion

    report_fusion(result, _console())


def run_demo(surface: str, out: Path, seed: int, as_json: bool) -> None:
    """Simulate a scene, fuse it, print the tables and draw the picture.

    Parameters
    ----------
    surface : str
        Name in the catalogue.
    out : Path
        Folder for the scene and the picture.
    seed : int
        Seed of the noise.
    as_json : bool
        Print JSON.
    """
    from evifuse.recordings import write_scene
    from evifuse.simulation import simulate

    out.mkdir(parents=True, exist_ok=True)
    file, picture = out / f"{surface}.mcap", out / f"{surface}.png"
    if not as_json:
        _notice(f"rolling a fingertip over a simulated {surface} ...")
    made = simulate(surface, seed=seed)
    write_scene(file, made.scene)
    scene = read_scene(file)
    _show_fusion(scene, fuse(scene), as_json, picture)
    if not as_json:
        _console().print(f"The truth: {made.truth.category} ({surface}). Scene: {file}. Picture: {picture}.")


def run_reproduce(as_json: bool) -> None:
    """Print the chapter's figures beside the computed ones.

    Parameters
    ----------
    as_json : bool
        Print JSON.
    """
    figures = reproduce()
    if as_json:
        _print_json([vars(f) for f in figures])
        return
    from evifuse.app.report import report_reproduction

    report_reproduction(figures, _console())
