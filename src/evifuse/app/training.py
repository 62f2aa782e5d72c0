"""``evifuse train``: a knowledge base from labelled evidence, and what was tried to get there."""

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from evifuse.app.readings import read_labelled
from evifuse.belief import MassFunction
from evifuse.belief.files import from_csv, from_json, from_parquet
from evifuse.conductivity import READINGS, TRAINED_READINGS, TrainingReport, Trial, train_report
from evifuse.errors import EvifuseError, UsageError
from evifuse.knowledge import save_knowledge

__all__ = ["read_evidence", "run_train"]


def read_evidence(path: Path, labels: Path | None) -> tuple[MassFunction, list[str], list[str] | None]:
    """Evidence, the class of each case, and its group.

    Parameters
    ----------
    path : Path
        Mass functions as Parquet, CSV or JSON.
    labels : Path or None
        Text file with a label on each line, under a line ``label`` or without; without it, the column
        ``label`` of a Parquet file.

    Returns
    -------
    MassFunction
        Batch shape (N,).
    list of str
        The N labels.
    list of str or None
        The column ``group`` of a Parquet file, if there is one.

    Raises
    ------
    BeliefError
        If the file can't be read or holds no mass functions.
    KnowledgeError
        If a Parquet file has no column ``label``, or a label is missing there.
    UsageError
        If the format is unknown, labels are needed, or their file can't be used.
    """
    readers = {".parquet": from_parquet, ".csv": from_csv, ".json": from_json}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise UsageError(f"{path}: evidence is a file {', '.join('*' + suffix for suffix in readers)}")
    if labels is None:
        if reader is not from_parquet:
            raise UsageError(f"{path}: give --labels, a text file with the class of each case on a line")
        return read_labelled(path)
    evidence = reader(path)
    try:
        lines = [line.strip() for line in labels.read_text(encoding="utf-8-sig").splitlines()]
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "not UTF-8 text"
        raise UsageError(f"{labels}: can't be read: {why}") from None
    count = len(evidence) if evidence.batch else 1
    if len(lines) == count + 1 and lines[0] == "label":
        lines = lines[1:]
    if len(lines) != count:
        raise UsageError(f"{labels}: {len(lines)} labels for the {count} cases of {path}")
    if "" in lines:
        raise UsageError(f"{labels}:{lines.index('') + 1}: there is no label")
    return evidence, lines, None


def run_train(
    evidence: Path,
    out: Path,
    labels: Path | None,
    reading: str | None,
    max_prototypes: int,
    seed: int,
    as_json: bool,
) -> None:
    """Learn a knowledge base and write it as YAML.

    Parameters
    ----------
    evidence : Path
        Labelled mass functions.
    out : Path
        YAML file to write.
    labels : Path or None
        Text file with the labels, if the evidence does not hold them.
    reading : str or None
        Name of the reading; the best of several on held-out cases without it.
    max_prototypes : int
        At most so many prototypes for each class.
    seed : int
        Seed of folds and clusters.
    as_json : bool
        Print JSON.

    Raises
    ------
    UsageError
        If an option or a file is not usable; the message says which.
    """
    known = {**READINGS, **TRAINED_READINGS}
    if reading is not None and reading not in known:
        raise UsageError(f"--reading {reading!r}: there are {', '.join(known)}")
    if out.suffix.lower() not in (".yaml", ".yml"):
        raise UsageError(f"--out {out}: a knowledge base is written as YAML: name it {out.stem}.yaml")
    m, names, groups = read_evidence(evidence, labels)
    try:
        report = train_report(
            m,
            names,
            reading=None if reading is None else {reading: known[reading]},
            max_prototypes=max_prototypes,
            seed=seed,
            groups=groups,
            name=out.stem,
        )
    except EvifuseError as error:
        raise UsageError(f"{evidence}: {error}") from error
    save_knowledge(report.knowledge, out)
    if as_json:
        sys.stdout.write(json.dumps(_to_json(report, out), allow_nan=False) + "\n")
        return
    tty = sys.stdout.isatty()
    report_training(report, out, Console(soft_wrap=not tty, width=None if tty else 160))


def report_training(report: TrainingReport, out: Path, console: Console) -> None:
    """Print what was learned and what was tried.

    Parameters
    ----------
    report : TrainingReport
        What training gave.
    out : Path
        Where the knowledge base was written.
    console : Console
        Where to print.
    """
    learned = _table("Prototypes", "class", "cases", "prototype", "masses", right=(1,))
    for aggregate in report.knowledge.aggregates:
        cases = str(report.cases[aggregate.label])
        for i, (name, x) in enumerate(aggregate.prototypes.items()):
            first = (aggregate.label, cases) if i == 0 else ("", "")
            learned.add_row(*first, name, _masses(x.as_dict()))
    console.print(learned)
    if report.trials:
        console.print()
        console.print(_tried(report.trials, [a.label for a in report.knowledge.aggregates]))
    else:
        console.print(
            "Nothing could be held out to choose by: no class has two cases, or there is one class."
        )
    console.print()
    console.print(f"Wrote {out}. Use it: evifuse classify MASSES.parquet --knowledge {out} -o OUT.parquet")


def _tried(trials: tuple[Trial, ...], classes: list[str]) -> Table:
    """The best trial of each reading."""
    best: dict[str, Trial] = {}
    for trial in trials:
        if trial.reading not in best or trial.log_loss < best[trial.reading].log_loss:
            best[trial.reading] = trial
    title = f"On held-out cases ({', '.join(classes)})"
    table = _table(title, "reading", "prototypes", "log loss (nats)", "accuracy", "", right=(2, 3))
    for name, trial in best.items():
        table.add_row(
            name,
            ", ".join(map(str, trial.prototypes)),
            f"{trial.log_loss:.3f}",
            f"{trial.accuracy:.3f}",
            "chosen" if trial.chosen else "",
        )
    return table


def _table(title: str, *columns: str, right: tuple[int, ...]) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold", pad_edge=False, box=None)
    for i, column in enumerate(columns):
        table.add_column(column, justify="right" if i in right else "left")
    return table


def _masses(masses: Mapping[str, float]) -> str:
    """The largest masses of a prototype, and how many more there are."""
    shown = [f"{name} {value:.3f}" for name, value in list(masses.items())[:5]]
    return ", ".join(shown) + (f", {len(masses) - 5} more" if len(masses) > 5 else "")


def _to_json(report: TrainingReport, out: Path) -> dict[str, Any]:
    return {
        "file": str(out),
        "cases": report.cases,
        "prototypes": {
            a.label: {name: x.as_dict() for name, x in a.prototypes.items()}
            for a in report.knowledge.aggregates
        },
        "reading": vars(report.knowledge.reading),
        "trials": [vars(t) for t in report.trials],
    }
