"""How CSV writes focal sets and cases, and how a row is checked against what is due."""

from collections.abc import Iterator

import numpy as np

from evifuse.belief._portable import Header, Masses, Sets
from evifuse.belief.frame import Frame
from evifuse.belief.mass import MassFunction
from evifuse.errors import BeliefError


def case_columns(count: int) -> list[str]:
    """Names of the columns of the batch index."""
    return ["case"] if count == 1 else [f"case_{i}" for i in range(count)]


_ESCAPES = str.maketrans({"\\": "\\\\", "|": "\\|", "\n": "\\n", "\r": "\\r"})
_UNESCAPES = {"n": "\n", "r": "\r"}


def label_of(frame: Frame, mask: int) -> str:
    """Names of a focal set joined by ``|``, escaped so that they stay on one line."""
    return "|".join(name.translate(_ESCAPES) for name in frame.names(mask))


def _names(label: str) -> list[str]:
    """Names of a label, unescaped."""
    if not label:
        return []
    names = [""]
    signs = iter(label)
    for sign in signs:
        if sign == "|":
            names.append("")
        elif sign == "\\":
            escaped = next(signs, "\\")
            names[-1] += _UNESCAPES.get(escaped, escaped)
        else:
            names[-1] += sign
    return names


def slots_of(header: Header) -> Iterator[tuple[int, ...]]:
    """Index of each mass, in the order of the rows."""
    return iter(np.ndindex(header.shape))


def row_of(header: Header, slot: tuple[int, ...], row: list[str], masks: dict[str, int]) -> tuple[int, float]:
    """Focal set and mass of one row, which must be about the case and set that are due."""
    *case, focal = slot
    if len(row) != len(case) + 2:
        raise BeliefError(f"{len(row)} columns, not {len(case) + 2}")
    *at, label, number = row
    if at != [str(i) for i in case]:
        raise BeliefError(f"expected a row of case {','.join(map(str, case))}, not {','.join(at)}")
    if label not in masks:
        masks[label] = header.frame.mask(_names(label))
    if header.sets is not None and masks[label] != header.sets[focal]:
        due = label_of(header.frame, int(header.sets[focal]))
        raise BeliefError(f"expected the mass of {due!r} here, not of {label!r}")
    try:
        return masks[label], float(number)
    except ValueError:
        raise BeliefError(f"mass {number!r} of {label!r} is not a number") from None


def check_case(header: Header, sets: Sets, masses: Masses) -> None:
    """The door for one case, so that a message can name its last line."""
    keep = (sets != 0) | (masses != 0)
    MassFunction(header.frame, sets[keep].tolist(), masses[keep], open_world=header.open_world)
