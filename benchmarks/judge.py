"""Conductivity beside its peers: how right, how sure and how fast, on public tables and own evidence.

Every method learns from 5, 20, 100 or all training cases per class and is judged on the same held-out 40 %,
complete, with 20 % or 50 % of the features missing, and with each source's features in turn permuted between
cases.
Figures are means over seeds with 95 % t intervals; each seed splits the data anew. Results are kept in OUT,
one JSON line for each set, size, seed and unit of methods: a second call goes on where the first one ended.

Usage: python benchmarks/judge.py [--out out/judge] [--evidence out/judge/evidence] [--seeds 10] [--quick]
       [--json FILE] [--tables FILE] [--figure FILE] [--again UNIT ...] [--only SET ...]
`evidence.py` writes the evidence. `--again` judges a unit anew that has changed.
"""

import argparse
import json
import sys
import warnings
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from judge_data import SIZES, Split, Table, shortened, split, tables
from judge_measures import scores
from judge_methods import UNITS
from judge_report import draw, report
from rich.progress import Progress
from threadpoolctl import threadpool_limits

Record = dict[str, Any]
MARK = "<!-- What follows is written by benchmarks/judge.py --tables -->"


def cells(table: Table, seeds: int, sizes: tuple[str, ...]) -> Iterator[tuple[str, int, Split]]:
    """Every training set of a table: seed by seed, so that a run that is cut short is still balanced."""
    for seed in range(seeds):
        whole = split(table, seed)
        for size in sizes:
            short = shortened(whole, size)
            if short is not None:
                yield size, seed, short


def judge_unit(unit: str, size: str, seed: int, short: Split) -> Record:
    """Fit one unit of methods on one training set and score it under every condition."""
    started = process_time()
    predictors = UNITS[unit](short)
    fit_s = process_time() - started
    methods: dict[str, Any] = {}
    for name, predict in predictors.items():
        found, elapsed = {}, 0.0
        for condition, x in short.tests.items():
            started = process_time()
            probabilities = predict(x)
            elapsed += process_time() - started
            found[condition] = asdict(scores(probabilities, np.resize(short.truth, len(x))))
        cases = sum(map(len, short.tests.values()))
        methods[name] = {"scores": found, "fit_s": fit_s, "predict_us": 1e6 * elapsed / cases}
    return {
        "set": short.table.name,
        "size": size,
        "seed": seed,
        "unit": unit,
        "train": len(short.labels),
        "test": len(short.truth),
        "methods": methods,
    }


def read_records(path: Path, forget: set[str]) -> dict[tuple[str, int, str], Record]:
    """Results of earlier calls by size, seed and unit; the last line of each counts, cut lines don't."""
    found = {}
    for line in path.read_text().splitlines() if path.exists() else []:
        try:
            record = json.loads(line)
        except ValueError:
            continue
        if record["unit"] not in forget:
            found[record["size"], record["seed"], record["unit"]] = record
    return found


def judge(options: argparse.Namespace, chosen: list[Table]) -> list[Record]:
    """Judge everything that has not been judged yet."""
    options.out.mkdir(parents=True, exist_ok=True)
    sizes = ("5", "all") if options.quick else SIZES
    units = options.unit or list(UNITS)
    records: list[Record] = []
    with Progress(disable=options.silent) as progress:
        bar = progress.add_task("judging", total=len(chosen) * options.seeds * len(sizes) * len(units))
        for table in chosen:
            path = options.out / f"{table.name.replace(' ', '-')}.jsonl"
            done = read_records(path, set(options.again))
            kept = [
                r
                for r in done.values()
                if r["seed"] < options.seeds and r["size"] in sizes and r["unit"] in units
            ]
            if options.again and path.exists():
                path.write_text("".join(json.dumps(r) + "\n" for r in done.values()))
            with path.open("a") as handle:
                for size, seed, short in cells(table, options.seeds, sizes):
                    for unit in units:
                        progress.update(bar, advance=1, description=f"{table.name}, {size}, {seed}, {unit}")
                        if (size, seed, unit) in done:
                            continue
                        record = judge_unit(unit, size, seed, short)
                        handle.write(json.dumps(record) + "\n")
                        handle.flush()
                        kept.append(record)
            records += kept
        progress.update(bar, completed=progress.tasks[0].total)
    return records


def write_below(path: Path, text: str) -> None:
    """Replace what stands below the mark, or the whole file if there is no mark."""
    above, mark, _ = path.read_text().partition(MARK) if path.exists() else ("", "", "")
    path.write_text(f"{above}{mark}\n\n{text}\n" if mark else f"{text}\n")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("out/judge"))
    parser.add_argument("--evidence", type=Path, default=Path("out/judge/evidence"))
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--quick", action="store_true", help="2 seeds, 5 and all cases per class")
    parser.add_argument("--only", action="append", help="judge this set only")
    parser.add_argument("--again", action="append", default=[], choices=UNITS, help="forget a unit's results")
    parser.add_argument("--unit", action="append", choices=UNITS, help="judge this unit of methods only")
    parser.add_argument("--json", type=Path, help="write every mean and interval here")
    parser.add_argument("--tables", type=Path, help="write the tables here, as Markdown, below the mark")
    parser.add_argument("--figure", type=Path, help="draw the rejection curves here")
    parser.add_argument("--silent", action="store_true", help="no progress bar")
    options = parser.parse_args()
    if options.quick:
        options.seeds = min(options.seeds, 2)
    warnings.filterwarnings("ignore", message=".*least populated class.*")
    chosen = [t for t in tables(options.evidence) if options.only is None or t.name in options.only]
    with threadpool_limits(1):  # times are of one thread
        records = judge(options, chosen)
    text, figures = report(records, chosen)
    print(text)
    if options.tables:
        write_below(options.tables, text)
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1))
    if options.figure:
        draw(records, options.figure)


if __name__ == "__main__":
    sys.exit(main())
