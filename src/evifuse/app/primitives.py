"""Primitives of the user's own, from a Python file or module that the command line names."""

import importlib
import importlib.util
import sys
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

from evifuse.conductivity import KnowledgeBase
from evifuse.errors import UsageError
from evifuse.vision import PRIMITIVES
from evifuse.vision.primitives import Primitive

__all__ = ["find_primitives"]


def find_primitives(text: str, knowledge: KnowledgeBase) -> Mapping[str, Primitive]:
    """The built-in primitives and those of a module.

    The module is run: name only files that you trust.

    Parameters
    ----------
    text : str
        ``my_module:NAME`` or ``folder/my_file.py:NAME``, where NAME is a mapping of primitives by name, as
        for `evifuse.vision.sense_shapes`; a name of a built-in one replaces it.
    knowledge : KnowledgeBase
        Classes of shape features, which must know all of them.

    Returns
    -------
    mapping of str to callable
        What proposes each primitive.

    Raises
    ------
    UsageError
        If there is no such module, it can't be run, or it does not hold what it should.

    Examples
    --------
    >>> from evifuse.knowledge import load_knowledge
    >>> list(find_primitives("evifuse.vision:PRIMITIVES", load_knowledge("shape")))[:2]
    ['rectangle', 'square']
    """
    where, _, name = text.rpartition(":")
    if not where or not name.isidentifier():
        raise UsageError(f"--primitives {text}: give my_module:NAME or my_file.py:NAME, a mapping by name")
    found: Any = getattr(_module(where, text), name, None)
    if not isinstance(found, Mapping) or not found:
        raise UsageError(f"--primitives {text}: {name} in {where} is no mapping of names to functions")
    own: dict[Any, Any] = dict(found)  # pyright: ignore[reportUnknownArgumentType]
    for key, propose in own.items():
        if not (isinstance(key, str) and callable(propose)):
            raise UsageError(
                f"--primitives {text}: {key!r} must be a name with a function, as 'pentagon': propose"
            )
    primitives: dict[str, Primitive] = {**PRIMITIVES, **own}
    for key in primitives:
        if key not in knowledge.frame.hypotheses:
            raise UsageError(
                f"--primitives {text}: the classes of {knowledge.name} don't know {key!r}: add it to a copy "
                "of the YAML (evifuse knowledge shape) and name that with --shape-knowledge"
            )
    return primitives


def _module(where: str, text: str) -> ModuleType:
    """A module by name, with the current folder first, or by the path of its file."""
    try:
        if not where.endswith(".py"):
            sys.path.insert(0, str(Path.cwd()))
            try:
                return importlib.import_module(where)
            finally:
                sys.path.remove(str(Path.cwd()))
        spec = importlib.util.spec_from_file_location(Path(where).stem, where)
        if spec is None or spec.loader is None:
            raise ImportError(f"{where} is no Python file")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module
    except Exception as error:  # whatever a user's file does wrong is named in a line
        why = " ".join(f"{type(error).__name__}: {error}".split())
        raise UsageError(f"--primitives {text}: {where} can't be loaded: {why}") from error
