"""``evifuse touch``: the surface that one recording felt, or many, one after another."""

import io
import json
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

from rich.console import Console

from evifuse.app.pictures import Sources, find_sources
from evifuse.app.shapes import Unusable, bar
from evifuse.conductivity import KnowledgeBase
from evifuse.errors import EvifuseError, RecordingError, UsageError
from evifuse.knowledge import load_knowledge
from evifuse.recordings.bags import is_bag
from evifuse.recordings.files import TOUCH_SUFFIXES, read_touch
from evifuse.recordings.raw import Given
from evifuse.recordings.recording import TouchRecording
from evifuse.touch import FeltSurface, sense_curvature
from evifuse.touch.smearing import BeliefModel

__all__ = ["Feeling", "line_of", "run_touch"]

LISTED = 4
"""Sites of a recording that the table of many recordings names."""


@dataclass(frozen=True)
class Feeling:
    """How recordings are to be felt.

    Parameters
    ----------
    knowledge : KnowledgeBase
        Classes of curvature features.
    belief : {"resolved", "chapter"}
        Belief of a local curvature.
    given : Given
        What recordings leave open.
    """

    knowledge: KnowledgeBase
    belief: BeliefModel
    given: Given


Felt: TypeAlias = "tuple[str, TouchRecording, FeltSurface]"
"""A path, what was recorded, and what was felt."""


def run_touch(
    recordings: tuple[str, ...],
    given: Given,
    live: bool,
    every: int | None,
    knowledge: str,
    belief: BeliefModel,
    as_json: bool,
    draw: Path | None,
) -> None:
    """Feel the curvature of surfaces.

    Parameters
    ----------
    recordings : tuple of str
        Files, bags, folders and patterns; ``-`` for samples on standard input.
    given : Given
        What the recordings leave open.
    live : bool
        Read samples from standard input as they come.
    every : int or None
        Live: a line after every so many samples, not only after each contact.
    knowledge : str
        Name or path of the classes of curvature features.
    belief : {"resolved", "chapter"}
        Belief of a local curvature.
    as_json : bool
        Print JSON.
    draw : Path or None
        PNG to write, or a folder for many.

    Raises
    ------
    UsageError
        If options contradict each other or there is nothing to feel.
    RecordingError
        If the recording, or one of many, could not be used.
    """
    for name in recordings:
        if name.startswith("--"):
            raise UsageError(f"unknown option {name}: evifuse touch --help lists them")
    live = live or recordings == ("-",)
    if live and recordings not in ((), ("-",)):
        raise UsageError("--live reads standard input: give '-' instead of recordings")
    if not live and not recordings:
        raise UsageError("nothing to feel: give a RECORDING, a folder, or '-' for standard input")
    if every is not None and (every < 1 or not live):
        raise UsageError(f"--every {every}: it needs --live, and 1 or more")
    feeling = Feeling(load_knowledge(knowledge), belief, given)
    if live:
        if draw is not None:
            raise UsageError("--draw needs a recording: live samples are not drawn")
        from evifuse.app.live import feel_live

        if isinstance(sys.stdin, io.TextIOWrapper):
            sys.stdin.reconfigure(encoding="utf-8", errors="replace")  # a broken byte spoils its line only
        feel_live(sys.stdin, feeling, every, as_json)
        return
    sources = find_sources(recordings, TOUCH_SUFFIXES, "recording of touch", is_bag)
    if sources.many:
        _many(sources, feeling, as_json, draw)
    else:
        _one(sources.paths[0], feeling, as_json, draw)


def _feel(path: str, feeling: Feeling) -> tuple[TouchRecording, FeltSurface]:
    given = feeling.given
    recording = read_touch(
        path, partial=True, fingertip=given.fingertip, topics=given.topics, unit=given.unit
    )
    return recording, sense_curvature(recording, feeling.knowledge, belief=feeling.belief)


def _one(path: str, feeling: Feeling, as_json: bool, draw: Path | None) -> None:
    """One recording: an object of JSON, or tables with the reasons."""
    recording, felt = _feel(path, feeling)
    for note in recording.notes:
        _notice(note)
    if draw is not None:
        _draw(recording, felt, draw / f"{Path(path).stem}.png" if draw.is_dir() else draw)
    tty = sys.stdout.isatty()
    if as_json:
        print(json.dumps(felt.to_json(), allow_nan=False, indent=2 if tty else None))
        return
    from evifuse.app.report import report_touch

    said = replace(felt, warnings=tuple(w for w in felt.warnings if w not in recording.notes))
    report_touch(said, Console(soft_wrap=not tty, width=None if tty else 160), why=True)


def _felt(sources: Sources, feeling: Feeling) -> "Iterator[Felt | Unusable]":
    """Feel one recording after another; what can't be used is said, and the rest is done."""
    for path in sources.paths:
        try:
            yield (path, *_feel(path, feeling))
        except (EvifuseError, OSError) as error:
            text = " ".join(str(error).split())
            yield Unusable(path, text if Path(path).name in text else f"{path}: {text}")
        except MemoryError:
            yield Unusable(path, f"{path}: not enough memory for this recording: split it")


def _many(sources: Sources, feeling: Feeling, as_json: bool, draw: Path | None) -> None:
    """A line for each recording, what is broken on standard error, and a summary."""
    names = _drawing_names(sources, draw)
    start, seconds, done, broken = time.monotonic(), 0.0, 0, 0
    width = min(max(len(p) for p in sources.paths), 60)
    header = "" if as_json else f"{'recording'.ljust(width)}  class, best primitive, and each site (1/m)\n"
    with bar() as shown:
        task = shown.add_task("", total=len(sources.paths))
        for one in _felt(sources, feeling):
            if isinstance(one, Unusable):
                broken += 1
                _notice(one.why)
                shown.update(task, advance=1, description=one.path)
                continue
            path, recording, felt = one
            for note in recording.notes:
                _notice(note)
            if draw is not None:
                _draw(recording, felt, names[path])
            line = json.dumps({"path": path, **felt.to_json()}, allow_nan=False)
            if not as_json:
                line = f"{path.encode('utf-8', 'backslashreplace').decode().ljust(width)}  {line_of(felt)}"
            print(header + line, flush=True)
            header = ""
            done += 1
            seconds += float(recording.time_ns[-1] - recording.time_ns[0]) * 1e-9
            shown.update(task, advance=1, description=path)
    took = max(time.monotonic() - start, 1e-9)
    summary = (
        f"{done} recordings of {seconds:.1f} s in all, {seconds / took:.0f} times as fast as they were made"
    )
    if broken:
        files = "file" if broken == 1 else "files"
        raise RecordingError(f"{summary}; {broken} {files} could not be used, named above")
    _notice(summary)


def line_of(felt: FeltSurface) -> str:
    """What was felt, in a line.

    Parameters
    ----------
    felt : FeltSurface
        What was felt.

    Returns
    -------
    str
        For example ``curved  H 0.97  site 0: k1 33.1 ± 0.2, k2 -33.0 ± 0.3``.
    """
    masses: dict[str, Any] = felt.evidence.as_dict()
    best = max(masses, key=masses.__getitem__)
    sites: list[str] = []
    for i, site in enumerate(felt.sites[:LISTED]):
        if not site.contact:
            sites.append(f"site {i}: no contact")
        elif site.edge is not None:
            sites.append(f"site {i}: {site.edge}")
        elif site.shape is None:
            sites.append(f"site {i}: k1 and k2 not known")
        else:
            s = site.shape
            sites.append(
                f"site {i}: k1 {s.k1_per_m:.2f} ± {s.k1_error_per_m:.2f}, "
                f"k2 {s.k2_per_m:.2f} ± {s.k2_error_per_m:.2f}"
            )
    if len(felt.sites) > LISTED:
        sites.append(f"{len(felt.sites) - LISTED} more sites")
    decision = felt.decision or "nothing"
    return f"{decision.ljust(11)}  {best} {masses[best]:.2f}  {'; '.join(sites)}"


def _drawing_names(sources: Sources, folder: Path | None) -> dict[str, Path]:
    """A PNG in a folder for each recording, none of them twice."""
    if folder is None:
        return {}
    if folder.suffix.lower() == ".png" and not folder.is_dir():
        raise UsageError(f"--draw {folder}: for many recordings name a folder, not a file")
    folder.mkdir(parents=True, exist_ok=True)
    names: dict[str, Path] = {}
    for path in sources.paths:
        stem, number = Path(path).stem, 1
        name = folder / f"{stem}.png"
        while name in names.values():
            number += 1
            name = folder / f"{stem}-{number}.png"
        names[path] = name
    return names


def _draw(recording: TouchRecording, felt: FeltSurface, path: Path) -> None:
    from evifuse.app.draw import draw_touch

    draw_touch(recording, felt, path)


def _notice(text: str) -> None:
    """What a person wants to know, beside the output proper."""
    print(f"evifuse: {text}", file=sys.stderr, flush=True)
