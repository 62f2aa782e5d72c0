"""Readings of appendix A compared: published figures, pure cases, accuracy on labelled evidence."""

import json
import sys
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track

from evifuse.app.published import named_readings, own_prototypes, published_examples, pure_cases
from evifuse.belief import MassFunction
from evifuse.belief.files import from_parquet
from evifuse.conductivity import KnowledgeBase, Reading
from evifuse.conductivity.choose import Judged, choose_reading, shortlist
from evifuse.conductivity.diagnose import diagnose
from evifuse.conductivity.sweep import (
    OUR_CHOICES,
    PRINT_CHOICES,
    Example,
    Outcome,
    differences,
    grid,
    single_changes,
    try_reading,
)
from evifuse.errors import EvifuseError, KnowledgeError, MissingExtraError, UsageError
from evifuse.knowledge import BUILT_IN, load_knowledge

__all__ = ["read_labelled", "run_readings"]


def read_labelled(path: Path) -> tuple[MassFunction, list[str], list[str] | None]:
    """Evidence with the class of each case, from a Parquet file as ``to_parquet`` writes it.

    Parameters
    ----------
    path : Path
        File with a column ``label`` beside the masses and, if cases belong together, a column ``group``.

    Returns
    -------
    MassFunction
        Batch of shape (N,).
    list of str
        The N labels.
    list of str or None
        The N groups, if there are any.

    Raises
    ------
    BeliefError
        If the file can't be read or holds no mass functions.
    KnowledgeError
        If there is no column ``label``, or a label is missing.
    MissingExtraError
        If pyarrow is not installed.
    """
    evidence = from_parquet(path)
    try:
        from pyarrow import parquet
    except ImportError as error:
        raise MissingExtraError("Parquet files need pyarrow: pip install 'evifuse[parquet]'") from error
    there = [name for name in ("label", "group") if name in parquet.read_schema(path).names]
    if "label" not in there:
        raise KnowledgeError(f"{path}: there is no column 'label' with the class of each case")
    table = parquet.read_table(path, columns=there)
    columns = {name: table.column(name).to_pylist() for name in there}
    for name, values in columns.items():
        if None in values:
            raise KnowledgeError(f"{path}: row {values.index(None)} of {name!r} is empty")
    groups = [str(v) for v in columns["group"]] if "group" in there else None
    return evidence, [str(v) for v in columns["label"]], groups


def run_readings(knowledge: str | None, evidence: Path | None, sweep: bool, seed: int, as_json: bool) -> None:
    """Compare readings on the published figures, or on labelled evidence.

    Parameters
    ----------
    knowledge : str or None
        Name or path of a knowledge base; the built-in ones without it.
    evidence : Path or None
        Labelled evidence.
    sweep : bool
        Also try the grid of choices.
    seed : int
        Of the split into a half for choosing and a half for judging.
    as_json : bool
        Print JSON.

    Raises
    ------
    UsageError
        If evidence is given without a knowledge base.
    """
    if evidence is None:
        found = _published(knowledge, sweep)
    elif knowledge is None:
        raise UsageError("--evidence needs --knowledge: the classes that its labels name")
    else:
        found = _labelled(load_knowledge(knowledge), knowledge, evidence, sweep, seed)
    terminal = sys.stdout.isatty()
    if as_json:
        sys.stdout.write(json.dumps(found, allow_nan=False, indent=2 if terminal else None) + "\n")
        return
    from evifuse.app.readings_report import report_readings

    report_readings(found, Console(soft_wrap=not terminal, width=None if terminal else 160))


def _bar(what: str) -> Callable[[Sequence[Any]], Iterable[Any]]:
    """Go through a list with a bar on standard error, where a person can see it."""
    console = Console(stderr=True)
    return partial(track, description=what, console=console, transient=True, disable=not console.is_terminal)


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _outcome(found: Outcome) -> dict[str, Any]:
    return {
        "differs": differences(found.reading),
        "computed": [_finite(v) for v in found.computed],
        "largest_gap": _finite(found.gap),
        "ranking": found.ranked,
    }


def _published(knowledge: str | None, sweep: bool) -> dict[str, Any]:
    names = BUILT_IN if knowledge is None else (knowledge,)
    bases = {name: load_knowledge(name) for name in names}
    own = None if knowledge is None else bases[knowledge].reading
    readings, published = named_readings(own), published_examples()
    found: dict[str, Any] = {
        "figures": [
            {"name": f"{e.name}: {k}", "published": v} for e in published for k, v in e.published.items()
        ],
        "readings": {name: _outcome(try_reading(r, published)) for name, r in readings.items()},
        "recognised": [
            {
                "knowledge": name,
                "reading": reading,
                "pure": list(pure_cases(base, how)),
                "prototypes": list(own_prototypes(base, how)),
            }
            for name, base in bases.items()
            for reading, how in readings.items()
        ],
    }
    if sweep:
        found["sweep"] = [
            {"choices": what, **_swept(grid(choices), published)}
            for what, choices in (("the print's choices", PRINT_CHOICES), ("our choices", OUR_CHOICES))
        ]
    return found


def _swept(readings: list[Reading], published: Iterable[Example]) -> dict[str, Any]:
    published = list(published)
    tried = [try_reading(r, published) for r in _bar("readings")(readings)]
    nearest = sorted(tried, key=lambda o: o.gap)[:5]
    ranked = sorted((o for o in tried if o.ranked), key=lambda o: o.gap)
    return {
        "tried": len(tried),
        "undefined": sum(not np.isfinite(o.gap) for o in tried),
        "ranking": len(ranked),
        "within_0.01": sum(o.gap <= 0.01 for o in tried),
        "nearest": [_outcome(o) for o in nearest],
        "nearest_ranked": [_outcome(o) for o in ranked[:1]],
    }


def _candidates() -> list[Reading]:
    """What is tried on labelled evidence: our choices, and each of the print's alone.

    ``members`` and ``pairs_between`` only move the branch point and are left as they are.
    """
    ours = {k: v for k, v in OUR_CHOICES.items() if k not in ("members", "pairs_between")}
    return list(dict.fromkeys([*single_changes(PRINT_CHOICES), *grid(ours)]))


def _judged(one: Judged) -> dict[str, Any]:
    return {
        "name": one.name,
        "differs": differences(one.reading),
        "chosen_on": one.chosen_on,
        "accuracy": one.accuracy,
        "interval": [one.low, one.high],
        "brier": one.brier,
        "undecided": one.undecided,
    }


def _labelled(base: KnowledgeBase, name: str, path: Path, sweep: bool, seed: int) -> dict[str, Any]:
    evidence, labels, groups = read_labelled(path)
    readings = named_readings(base.reading)
    every = {differences(r): r for r in _candidates() if r not in readings.values()} if sweep else {}
    try:
        if sweep:
            best = shortlist(
                evidence, labels, base, every, groups=groups, seed=seed, progress=_bar("readings")
            )
            readings |= {k: r for k, r in best.items() if r not in readings.values()}
        choice = choose_reading(
            evidence, labels, base, readings, groups=groups, seed=seed, progress=_bar("candidates")
        )
        found = diagnose(evidence, base, choice.best.reading)
    except EvifuseError as error:
        raise type(error)(f"{path}: {error}") from None
    return {
        "knowledge": name,
        "evidence": str(path),
        "seed": seed,
        "groups": len(set(groups)) if groups and len(set(groups)) < len(groups) else None,
        "swept": len(every),
        "choosing": choice.choosing,
        "held_out": choice.held_out,
        "commonest": choice.commonest,
        "chosen": choice.best.name,
        "judged": [{**_judged(j), "swept": j.name in every} for j in choice.judged],
        "diagnosis": found.to_json(),
    }
