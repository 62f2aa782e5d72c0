"""Knowledge bases as YAML that a person can read and change, and that reads back as the very same."""

import os
import re
from dataclasses import fields

import yaml

from evifuse.belief import Frame, MassFunction
from evifuse.conductivity import READINGS, KnowledgeBase, Reading
from evifuse.errors import KnowledgeError, RecordingError
from evifuse.knowledge.load import parse_knowledge
from evifuse.recordings.atomic import replacing

__all__ = ["knowledge_text", "save_knowledge"]

WIDTH = 110


def save_knowledge(knowledge: KnowledgeBase, path: str | os.PathLike[str]) -> None:
    """Write a knowledge base as YAML, in one step: the file appears whole or not at all.

    Parameters
    ----------
    knowledge : KnowledgeBase
        What to write.
    path : str or path-like
        File to create or replace; its folder must exist.

    Raises
    ------
    KnowledgeError
        If the knowledge base has something that the file could not give back, or it can't be written.
    """
    text = knowledge_text(knowledge)
    try:
        with replacing(path) as beside:
            beside.write_text(text, encoding="utf-8")
    except RecordingError as error:
        raise KnowledgeError(str(error)) from error


def knowledge_text(knowledge: KnowledgeBase) -> str:
    """The YAML of a knowledge base.

    A reading is written by name if it has one, else by the choices in which it differs from the default.
    Numbers are written so that the very same ones are read back.

    Parameters
    ----------
    knowledge : KnowledgeBase
        What to write.

    Returns
    -------
    str
        Text that `parse_knowledge` reads back as the same knowledge base.

    Raises
    ------
    KnowledgeError
        If the knowledge base has something that the text could not give back: names with spaces around them,
        a class without prototypes.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> from evifuse.conductivity import Aggregate
    >>> frame = Frame(["rectangle", "long bracket"])
    >>> seen = MassFunction.of(frame, {"long bracket": 0.75, frame: 0.25})
    >>> hook = Aggregate("hook", {"h": seen})
    >>> print(knowledge_text(KnowledgeBase("tools", frame, (hook,), READINGS["sound"])))
    title: tools
    reading: sound
    frame:
      rectangle: rectangle
      long_bracket: long bracket
    classes:
      hook:
        h: {long_bracket: 0.75, frame: 0.25}
    <BLANKLINE>
    """
    symbols = _symbols(knowledge.frame)
    lines = [f"title: {_scalar(knowledge.name)}"]
    if knowledge.source:
        lines.append(f"source: {_scalar(knowledge.source)}")
    lines += [*_reading(knowledge.reading), "frame:"]
    lines += [
        f"  {_scalar(s)}: {_scalar(name)}"
        for s, name in zip(symbols, knowledge.frame.hypotheses, strict=True)
    ]
    if knowledge.frame.attributes is not None:
        lines.append("attributes:")
        for symbol, items in zip(symbols, knowledge.frame.attributes, strict=True):
            lines.append(f"  {_scalar(symbol)}: [{', '.join(_scalar(item) for item in sorted(items))}]")
    lines.append("classes:")
    for aggregate in knowledge.aggregates:
        lines.append(f"  {_scalar(aggregate.label)}:")
        for name, prototype in aggregate.prototypes.items():
            lines += _prototype(name, prototype, symbols)
    text = "\n".join(lines) + "\n"
    _check(knowledge, text)
    return text


def _scalar(value: object) -> str:
    """A text or number on one line, quoted where YAML might take it for something else."""
    if not isinstance(value, str):
        return yaml.safe_dump(value).removesuffix("...\n").strip()
    if re.fullmatch(r"[^\W\d_](?:[\w .|+/-]*[\w.+/-])?", value) and yaml.safe_load(value) == value:
        return value
    if value.isprintable():
        return "'" + value.replace("'", "''") + "'"
    return yaml.safe_dump(value, default_style='"', width=float("inf")).strip()


def _symbols(frame: Frame) -> list[str]:
    """One word for each hypothesis, its own name where that is one."""
    out: list[str] = []
    for name in frame.hypotheses:
        word = re.sub(r"\s+", "_", name.strip()) or "_"
        word = f"{word}_" if word == "frame" else word
        while word in out:
            word += "_"
        out.append(word)
    return out


def _reading(reading: Reading) -> list[str]:
    for name, known in READINGS.items():
        if known == reading:
            return [f"reading: {name}"]
    usual = Reading()
    own = [f for f in fields(Reading) if getattr(reading, f.name) != getattr(usual, f.name)]
    return ["reading:", *(f"  {f.name}: {_scalar(getattr(reading, f.name))}" for f in own)]


def _prototype(name: str, x: MassFunction, symbols: list[str]) -> list[str]:
    """Focal sets and masses on as many lines as they need."""
    entries: list[str] = []
    for mask, mass in zip(x.focal_sets.tolist(), x.masses.tolist(), strict=True):
        words = [s for i, s in enumerate(symbols) if mask >> i & 1]
        key = "frame" if mask == x.frame.full else " ".join(words)
        entries.append(f"{_scalar(key)}: {_scalar(mass)}")
    head = f"    {_scalar(name)}: {{"
    lines = [head]
    for i, entry in enumerate(entries):
        piece = entry + (", " if i < len(entries) - 1 else "}")
        if len(lines[-1]) + len(piece) > WIDTH and lines[-1] != head:
            lines[-1] = lines[-1].rstrip()
            lines.append(" " * 6)
        lines[-1] += piece
    return lines


def _check(knowledge: KnowledgeBase, text: str) -> None:
    """Refuse what would not be read back as it is."""
    try:
        again = parse_knowledge(text)
    except KnowledgeError as error:
        raise KnowledgeError(f"knowledge base {knowledge.name!r} can't be written: {error}") from error
    for what in ("name", "frame", "classes", "reading", "source"):
        if getattr(again, what) != getattr(knowledge, what):
            given, read = getattr(knowledge, what), getattr(again, what)
            raise KnowledgeError(
                f"the {what} {given!s} would be read back as {read!s}: change it before saving"
            )
    for a, b in zip(knowledge.aggregates, again.aggregates, strict=True):
        if list(a.prototypes) != list(b.prototypes):
            names = ", ".join(map(repr, a.prototypes))
            raise KnowledgeError(
                f"the prototypes {names} of {a.label!r} would be read back under other names"
            )
        for name, x in a.prototypes.items():
            if x != b.prototypes[name]:
                raise KnowledgeError(f"the prototype {name!r} of {a.label!r} would be read back differently")
