"""``evifuse check``: what recordings of touch lack, part by part, before any estimate."""

import json
import sys
from pathlib import Path
from typing import Literal

from rich.console import Console
from rich.table import Table

from evifuse.app.pictures import find_sources
from evifuse.errors import EvifuseError, RecordingError, UsageError
from evifuse.recordings.bags import is_bag
from evifuse.recordings.door import touch_of
from evifuse.recordings.files import TOUCH_SUFFIXES, read_raw_scene
from evifuse.recordings.inspection import Finding, inspect_touch
from evifuse.recordings.mcap_scene import RawScene
from evifuse.recordings.raw import NOTHING_GIVEN, Given
from evifuse.recordings.recording import TouchRecording
from evifuse.recordings.suspicions import suspicions
from evifuse.touch import FeltSurface, sense_curvature
from evifuse.touch.health import health

__all__ = ["findings_of", "run_check"]

_PARTS = ("file", "time", "pose", "joint", "pressures", "fingertip", "contact")
_MARKS = {"fine": "fine", "note": "[yellow]note[/]", "refused": "[red]refused[/]"}


def run_check(recordings: tuple[str, ...], given: Given, as_json: bool) -> None:
    """Say what recordings lack.

    Parameters
    ----------
    recordings : tuple of str
        Files, bags, folders and patterns.
    given : Given
        What the recordings leave open.
    as_json : bool
        Print a JSON object for each recording.

    Raises
    ------
    UsageError
        If no recording is named.
    RecordingError
        If an estimate of one of them would be refused.
    """
    if not recordings:
        raise UsageError("nothing to check: give a RECORDING or a folder")
    sources = find_sources(recordings, TOUCH_SUFFIXES, "recording of touch", is_bag)
    if not sources.many and not Path(sources.paths[0]).exists():
        raise RecordingError(f"{sources.paths[0]}: there is no such file: check its name")
    refused: list[str] = []
    for path in sources.paths:
        found = findings_of(path, given)
        usable = all(f.verdict != "refused" for f in found)
        if not usable:
            refused.append(path)
        if as_json:
            listed = [vars(f) for f in found]
            indent = 2 if sys.stdout.isatty() and not sources.many else None
            print(json.dumps({"path": path, "usable": usable, "findings": listed}, indent=indent))
        else:
            _print(path, found, many=len(sources.paths) > 1)
    if len(sources.paths) == 1 and refused:
        raise RecordingError(f"{refused[0]}: an estimate would be refused, for the reasons above")
    if refused:
        raise RecordingError(f"{len(refused)} of {len(sources.paths)} recordings would be refused")


def findings_of(path: str, given: Given = NOTHING_GIVEN) -> list[Finding]:
    """Look at a recording.

    Parameters
    ----------
    path : str
        The file or bag.
    given : Given
        What the file leaves open.

    Returns
    -------
    list of Finding
        By part; a file that can't be read has one.
    """
    try:
        raw = read_raw_scene(path, given=given)
    except (EvifuseError, OSError) as error:
        return [Finding("file", "refused", _one_line(error))]
    found: list[Finding] = []
    if raw.damage:
        found.append(Finding("file", "note", f"{raw.damage}: what was read before that is used"))
    if raw.touch is None:
        return [*found, Finding("file", "refused", f"no touch in it; {raw.held}"), *_picture(raw)]
    if not raw.damage:
        found.append(Finding("file", "fine", f"{Path(path).name} is whole"))
    found += [Finding("file", "note", _short(line, raw.name)) for line in raw.touch.notes]
    found += inspect_touch(raw.touch)
    try:
        recording = touch_of(raw.touch)
    except EvifuseError as error:
        if all(f.verdict != "refused" for f in found):
            found.append(Finding("file", "refused", _one_line(error)))
    else:
        found += _suspected(recording, found)
        found += _felt(recording)
    return [*sorted(found, key=lambda f: _PARTS.index(f.part)), *_picture(raw)]


def _suspected(recording: TouchRecording, found: list[Finding]) -> list[Finding]:
    """What may not be meant as it is said, where that was not said yet."""
    doubted = {
        f.part for f in found if f.verdict == "note" and f.text.endswith(("needed", "right?", "offset"))
    }
    return [Finding(part, "note", text) for part, text in suspicions(recording) if part not in doubted]


def _felt(recording: TouchRecording) -> list[Finding]:
    """Taxels, contacts and directions."""
    felt = sense_curvature(recording)
    said = [Finding("pressures", "note", _short(line, recording.name)) for line in _health(recording)]
    touched = [i for i, site in enumerate(felt.sites) if site.contact]
    if not touched:
        return [*said, Finding("contact", "note", "none: this is evidence of N, no surface")]
    said.append(Finding("contact", "fine", f"{len(felt.local_curvatures)} rolls over {len(touched)} sites"))
    return said + [_site(felt, i) for i in touched]


def _health(recording: TouchRecording) -> tuple[str, ...]:
    """Taxels that are dead, stuck, saturated or drift; one sample tells nothing about that."""
    return health(recording).lines() if len(recording.time_ns) > 1 else ()


def _site(felt: FeltSurface, index: int) -> Finding:
    """In which directions a site was rolled over, and what can be known from that."""
    site = felt.sites[index]
    directions = sorted(
        round(c.direction_rad * 57.29578) % 180 for c in felt.local_curvatures if c.site == index
    )
    degrees = ", ".join(map(str, dict.fromkeys(directions)))
    verdict: Literal["fine", "note"] = "fine"
    if site.edge is not None:
        text = f"it is {site.edge}: it has no curvature"
    elif site.shape is not None:
        text = f"rolled along {degrees} degrees: k1 and k2 can be known"
    elif directions:
        across = (directions[0] + 90) % 180
        verdict = "note"
        text = (
            f"rolled along {degrees} degrees only: the curvature across, at {across} degrees, can't be known"
        )
    else:
        verdict = "note"
        text = "touched, not rolled over: no curvature can be known"
    return Finding("contact", verdict, f"site {index} {text}")


def _picture(raw: RawScene) -> list[Finding]:
    if raw.trouble:
        return [Finding("picture", "note", _short(raw.trouble, raw.name))]
    if raw.image is None:
        return [Finding("picture", "fine", "none: touch needs none, fusion takes one with --image")]
    height, width = raw.image.shape[:2]
    if raw.camera is None:
        text = "without the camera's intrinsics and pose: fusion needs --box to know what was touched"
        return [Finding("picture", "note", f"{width} x {height} px, {text}")]
    return [Finding("picture", "fine", f"{width} x {height} px, with camera and pose")]


def _print(path: str, found: list[Finding], *, many: bool) -> None:
    tty = sys.stdout.isatty()
    console = Console(soft_wrap=not tty, width=None if tty else 200, highlight=False)
    table = Table("part", "", "what", box=None, title=path if many else None, title_justify="left")
    previous = ""
    for finding in found:
        table.add_row(
            "" if finding.part == previous else finding.part, _MARKS[finding.verdict], _plain(finding.text)
        )
        previous = finding.part
    console.print(table)


def _plain(text: str) -> str:
    """Without what would be taken for markup."""
    return text.replace("[", r"\[")


def _short(text: str, name: str) -> str:
    """Without the file's name before it, which is in the title."""
    return text.removeprefix(f"{name}: ")


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split())
