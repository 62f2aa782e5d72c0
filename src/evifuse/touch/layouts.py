"""Fingertips by name or from a file: what `load_fingertip` accepts.

- ``sphere``: taxels 0.7 mm apart on a sphere of 10 mm; ``sphere:0.008:0.001`` for a radius of 8 mm and a
  pitch of 1 mm.
- ``paxini:DP-S2015-Elite``: a sensor of the installed package ``paxini-sdk``, by model or part code.
- ``tip.csv``: columns ``x_m,y_m,z_m`` and, where known, ``nx,ny,nz``; ``x_mm,y_mm,z_mm`` for millimetres. A
  comment line ``# radius_m: 0.01`` may stand above them.
- ``tip.json``: ``{"positions_m": [[x, y, z], ...], "normals": [...], "radius_m": 0.01}``, or
  ``positions_mm``; normals and radius may be left out.

A file's frame is kept: it is the frame whose pose a recording gives. Normals that a file leaves out are
estimated, a radius is that of the best sphere at the pole.
"""

import json
import os
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import RecordingError, UsageError
from evifuse.recordings.checks import finite, unit
from evifuse.recordings.recording import Fingertip
from evifuse.touch.blended import layout_normals
from evifuse.touch.fingertip import spherical_fingertip
from evifuse.touch.paxini import paxini_fingertip
from evifuse.touch.pole import pole_of

__all__ = ["load_fingertip"]

LARGEST_M = 0.3
"""A layout that extends further is not in metres."""
SMALLEST_M = 1e-4
"""A layout of several taxels that is smaller is not in the unit that it says."""


def load_fingertip(name: str | os.PathLike[str]) -> Fingertip:
    """Load the layout of a fingertip by name or from a file.

    Parameters
    ----------
    name : str or path-like
        ``"sphere"``, ``"sphere:RADIUS_M:PITCH_M"``, ``"paxini:MODEL"``, or a ``.csv`` or ``.json`` file; see
        the top of this module.

    Returns
    -------
    Fingertip
        Places in metres and outward unit normals.

    Raises
    ------
    UsageError
        If the name is not one.
    RecordingError
        If the file can't be read, lacks a column or a key, or its numbers can't be those of a fingertip.
    MissingExtraError
        If the layout is in a package that is not installed.

    Examples
    --------
    >>> load_fingertip("sphere:0.01:0.002").positions_m.shape
    (28, 3)
    """
    text = os.fspath(name)
    kind, colon, rest = text.partition(":")
    if kind == "paxini" and colon:
        return paxini_fingertip(rest)
    if kind == "sphere":
        return _sphere(text, rest)
    file = Path(text)
    if file.suffix.lower() not in (".csv", ".json"):
        raise UsageError(
            f"{text}: no fingertip has that name: use sphere, sphere:RADIUS_M:PITCH_M, paxini:MODEL, "
            "or a .csv or .json file"
        )
    try:
        content = file.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "it is not text in UTF-8"
        raise RecordingError(f"{file}: can't read the layout: {why}") from error
    found = _from_csv(content, file) if file.suffix.lower() == ".csv" else _from_json(content, file)
    return _checked(*found, str(file))


def _sphere(text: str, rest: str) -> Fingertip:
    if not rest:
        return spherical_fingertip()
    try:
        radius, pitch = (float(part) for part in rest.split(":"))
    except ValueError as error:
        raise UsageError(f"{text}: write sphere:RADIUS_M:PITCH_M, both in metres") from error
    return spherical_fingertip(radius, pitch)


def _from_csv(content: str, file: Path) -> tuple[Any, Any, Any]:
    """Places in metres, normals or None, radius or None."""
    lines = [line.strip() for line in content.splitlines()]
    comments = [line.lstrip("# ").partition(":") for line in lines if line.startswith("#")]
    radius = next((value for key, _, value in comments if key.strip() == "radius_m"), None)
    rows = [(i, line) for i, line in enumerate(lines, start=1) if line and not line.startswith("#")]
    if not rows:
        raise RecordingError(f"{file}: the file is empty: write x_m,y_m,z_m,nx,ny,nz and one line per taxel")
    names = [name.strip() for name in rows[0][1].split(",")]
    scale = 1e-3 if "x_mm" in names else 1.0
    places = [f"{axis}_{'m' if scale == 1 else 'mm'}" for axis in "xyz"]
    for column in places:
        if column not in names:
            raise RecordingError(
                f"{file}: column {column!r} is missing: "
                "the unit is part of the name, x_m,y_m,z_m or x_mm,y_mm,z_mm"
            )
    table: list[list[float]] = []
    for number, row in rows[1:]:
        cells = row.split(",")
        if len(cells) != len(names):
            raise RecordingError(f"{file}:{number}: {len(cells)} values for {len(names)} columns")
        try:
            table.append([float(cell) for cell in cells])
        except ValueError as error:
            raise RecordingError(f"{file}:{number}: not a number: repair that line") from error
    values = np.array(table, dtype=np.float64).reshape(-1, len(names))
    facing = [f"n{axis}" for axis in "xyz"]
    normals = values[:, [names.index(key) for key in facing]] if set(facing) <= set(names) else None
    return scale * values[:, [names.index(key) for key in places]], normals, radius


def _from_json(content: str, file: Path) -> tuple[Any, Any, Any]:
    """Places in metres, normals or None, radius or None."""
    try:
        found = json.loads(content)
    except ValueError as error:
        raise RecordingError(f"{file}: this is not JSON: {error}") from error
    facts = cast("dict[str, Any]", found) if isinstance(found, dict) else {}
    key = next((key for key in ("positions_m", "positions_mm") if key in facts), None)
    if key is None:
        raise RecordingError(
            f"{file}: key 'positions_m' (or 'positions_mm') is missing: give x, y, z of every taxel"
        )
    try:
        places = np.array(facts[key], dtype=np.float64)
        normals = None if facts.get("normals") is None else np.array(facts["normals"], dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise RecordingError(f"{file}: places and normals must be lists of three numbers") from error
    return places * (1e-3 if key == "positions_mm" else 1.0), normals, facts.get("radius_m")


def _checked(places: NDArray[np.float64], normals: Any, radius: Any, name: str) -> Fingertip:
    shape = places.shape
    if len(shape) != 2 or shape[1] != 3 or shape[0] == 0:
        raise RecordingError(f"{name}: places of taxels must have shape (N, 3) with N >= 1, not {shape}")
    places = finite(places, "taxel positions", shape, name)
    extent = float(np.ptp(places, axis=0).max())
    if extent > LARGEST_M or (len(places) > 1 and extent < SMALLEST_M):
        raise RecordingError(
            f"{name}: the taxels extend over {extent:.3g} m, which is no fingertip: "
            f"are the places in {'millimetres? then name the columns _mm' if extent > 1 else 'another unit?'}"
        )
    if normals is None:
        if len(places) < 4:
            raise RecordingError(
                f"{name}: {len(places)} taxels are too few to estimate normals: give columns nx,ny,nz"
            )
        normals = layout_normals(places)
    normals = unit(finite(normals, "taxel normals", shape, name), "taxel normals", name)
    if radius is None:
        return Fingertip(pole_of(Fingertip(1.0, places, normals))[2], places, normals)
    try:
        value = float(radius)
    except (TypeError, ValueError) as error:
        raise RecordingError(f"{name}: radius_m must be one number, not {radius!r}") from error
    if not 0 < value < 1:
        raise RecordingError(f"{name}: radius_m must be in (0, 1) m, not {value:g}: give it in metres")
    return Fingertip(value, places, normals)
