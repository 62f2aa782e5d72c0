"""Knowledge bases from YAML that a person can read, with errors that name file and line."""

from collections.abc import Callable
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import TypeVar, cast

import numpy as np
import yaml

from evifuse.belief import Frame, MassFunction
from evifuse.conductivity import READINGS, Aggregate, KnowledgeBase, Reading
from evifuse.errors import BeliefError, KnowledgeError

__all__ = ["BUILT_IN", "built_in_text", "load_knowledge", "parse_knowledge"]

BUILT_IN = ("shape", "curvature", "chapter-shape", "chapter-curvature")
"""Knowledge bases that come with the package: our own, and tables 1 and 4 of the chapter."""

T = TypeVar("T")


def built_in_text(name: str) -> str:
    """The YAML of a built-in knowledge base, to copy and change.

    Parameters
    ----------
    name : {"shape", "curvature", "chapter-shape", "chapter-curvature"}
        Which one.

    Returns
    -------
    str
        Its text.

    Raises
    ------
    KnowledgeError
        If there is no such knowledge base.
    """
    if name not in BUILT_IN:
        raise KnowledgeError(f"no built-in knowledge base {name!r}: there are {', '.join(BUILT_IN)}")
    return files("evifuse.knowledge").joinpath(f"{name}.yaml").read_text(encoding="utf-8")


def load_knowledge(name_or_path: str | Path) -> KnowledgeBase:
    """A knowledge base by built-in name, or from a YAML file.

    Parameters
    ----------
    name_or_path : str or Path
        ``shape``, ``curvature``, ``chapter-shape``, ``chapter-curvature``, or a path.

    Returns
    -------
    KnowledgeBase
        Validated.

    Raises
    ------
    KnowledgeError
        If the file can't be read or does not hold a knowledge base; the message names file and line.

    Examples
    --------
    >>> load_knowledge("chapter-shape").classes
    ('rectangular', 'triangular', 'elliptical')
    """
    if str(name_or_path) in BUILT_IN:
        return _built_in(str(name_or_path))
    path = Path(name_or_path)
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise KnowledgeError(
            f"{path}: no such file, and no built-in knowledge base of that name ({', '.join(BUILT_IN)})"
        ) from None
    except (OSError, UnicodeDecodeError) as e:
        reason = e.strerror if isinstance(e, OSError) else "not UTF-8 text"
        raise KnowledgeError(f"{path}: can't be read: {reason}") from None
    return parse_knowledge(text, str(path))


@cache
def _built_in(name: str) -> KnowledgeBase:
    return parse_knowledge(built_in_text(name), f"{name}.yaml")


def parse_knowledge(text: str, name: str = "knowledge") -> KnowledgeBase:
    """A knowledge base from YAML text.

    Parameters
    ----------
    text : str
        The YAML.
    name : str
        File name for messages.

    Returns
    -------
    KnowledgeBase
        Validated.

    Raises
    ------
    KnowledgeError
        If the text is not a knowledge base; the message names file, line and what was expected.
    """
    try:
        root = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.YAMLError as e:
        mark = getattr(e, "problem_mark", None)
        line = f":{mark.line + 1}" if mark is not None else ""
        raise KnowledgeError(f"{name}{line}: not YAML: {getattr(e, 'problem', None) or e}") from None
    return _Reader(name).knowledge(root)


class _Reader:
    """Walks the YAML nodes, which know their lines."""

    def __init__(self, name: str) -> None:
        self.name = name

    def fail(self, node: yaml.Node | None, message: str) -> KnowledgeError:
        line = f":{node.start_mark.line + 1}" if node is not None else ""
        return KnowledgeError(f"{self.name}{line}: {message}")

    def mapping(self, node: yaml.Node | None, what: str) -> dict[str, tuple[yaml.Node, yaml.Node]]:
        if not isinstance(node, yaml.MappingNode) or not node.value:
            raise self.fail(node, f"{what} must be a mapping with at least one entry")
        out: dict[str, tuple[yaml.Node, yaml.Node]] = {}
        for key, value in cast(list[tuple[yaml.Node, yaml.Node]], node.value):
            label = self.text(key, f"a key of {what}")
            if label in out:
                raise self.fail(key, f"{label!r} is in {what} more than once")
            out[label] = (key, value)
        return out

    def text(self, node: yaml.Node, what: str) -> str:
        if not isinstance(node, yaml.ScalarNode) or not str(node.value).strip():
            raise self.fail(node, f"{what} must be a name")
        return str(node.value).strip()

    def value(self, node: yaml.Node) -> object:
        return yaml.SafeLoader("").construct_object(node, deep=True)

    def checked(self, node: yaml.Node, make: Callable[[], T]) -> T:
        try:
            return make()
        except (BeliefError, KnowledgeError) as e:
            raise self.fail(node, str(e)) from None

    def knowledge(self, root: yaml.Node | None) -> KnowledgeBase:
        top = self.mapping(root, "a knowledge base")
        allowed = ("title", "source", "reading", "frame", "attributes", "classes")
        for key, (node, _) in top.items():
            if key not in allowed:
                raise self.fail(node, f"unknown entry {key!r}: expected {', '.join(allowed)}")
        for key in ("frame", "classes"):
            if key not in top:
                raise self.fail(root, f"the entry {key!r} is missing")
        names, frame = self.frame(top)
        aggregates = [
            self.aggregate(label, node, names, frame)
            for label, (_, node) in self.mapping(top["classes"][1], "classes").items()
        ]
        reading = self.reading(top["reading"][1]) if "reading" in top else READINGS["sound"]
        title = self.text(top["title"][1], "title") if "title" in top else self.name
        source = self.text(top["source"][1], "source") if "source" in top else ""
        return KnowledgeBase(title, frame, tuple(aggregates), reading, source)

    def frame(self, top: dict[str, tuple[yaml.Node, yaml.Node]]) -> tuple[dict[str, str], Frame]:
        node = top["frame"][1]
        names = {
            symbol: self.text(value, f"the name of {symbol!r}")
            for symbol, (_, value) in self.mapping(node, "frame").items()
        }
        for symbol in names:
            if symbol == "frame" or " " in symbol:
                raise self.fail(node, f"symbol {symbol!r} must be one word other than 'frame'")
        lists: dict[str, list[str]] | None = None
        if "attributes" in top:
            lists = {}
            for symbol, (key, value) in self.mapping(top["attributes"][1], "attributes").items():
                if symbol not in names:
                    raise self.fail(key, f"unknown label {symbol!r}: the frame has {', '.join(names)}")
                items = self.value(value)
                if not isinstance(items, list):
                    raise self.fail(value, f"attributes of {symbol!r} must be a list of names")
                lists[names[symbol]] = [str(item) for item in cast(list[object], items)]
        return names, self.checked(node, lambda: Frame(names.values(), lists))

    def reading(self, node: yaml.Node) -> Reading:
        if isinstance(node, yaml.ScalarNode):
            name = str(node.value)
            if name not in READINGS:
                raise self.fail(
                    node, f"unknown reading {name!r}: expected {', '.join(READINGS)} or a mapping"
                )
            return READINGS[name]
        fields = {key: self.value(value) for key, (_, value) in self.mapping(node, "reading").items()}
        known = Reading.__dataclass_fields__
        for key, (key_node, value) in self.mapping(node, "reading").items():
            if key not in known:
                raise self.fail(key_node, f"unknown choice {key!r}: a reading has {', '.join(known)}")
            number = isinstance(known[key].default, int | float) or key in ("log_base", "commitment")
            if number and not isinstance(fields[key], int | float | None):
                raise self.fail(value, f"{key} must be a number, not {fields[key]!r}")
        return self.checked(node, lambda: Reading(**fields))  # pyright: ignore[reportArgumentType]

    def aggregate(self, label: str, node: yaml.Node, names: dict[str, str], frame: Frame) -> Aggregate:
        prototypes = {
            name: self.prototype(f"{label}/{name}", value, names, frame)
            for name, (_, value) in self.mapping(node, f"class {label!r}").items()
        }
        return Aggregate(label, prototypes)

    def prototype(self, what: str, node: yaml.Node, names: dict[str, str], frame: Frame) -> MassFunction:
        sets: list[int] = []
        masses: list[float] = []
        for key, (key_node, value) in self.mapping(node, f"prototype {what!r}").items():
            mask = frame.full if key == "frame" else 0
            for symbol in [] if key == "frame" else key.split():
                if symbol not in names:
                    raise self.fail(
                        key_node, f"unknown label {symbol!r} in {what}: the frame has {', '.join(names)}"
                    )
                mask |= frame.mask(names[symbol])
            number = self.value(value)
            if isinstance(number, bool) or not isinstance(number, int | float):
                raise self.fail(value, f"mass of {key!r} in {what} must be a number, not {number!r}")
            if number <= 0:
                raise self.fail(value, f"mass of {key!r} in {what} must be positive, not {number:g}")
            sets.append(mask)
            masses.append(float(number))
        return self.checked(node, lambda: MassFunction(frame, np.array(sets), masses))
