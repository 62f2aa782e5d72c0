"""Tables and a figure of what `judge.py` measured."""

from pathlib import Path
from typing import Any

import numpy as np
from judge_data import CONDITIONS, OWN, Table
from judge_measures import COVERAGES, mean_and_half, mean_ranks, verdict
from judge_results import MEASURES, ORDER, Cell, Record, Results

OURS = ORDER[0]


def report(records: list[Record], sets: list[Table]) -> tuple[str, list[dict[str, Any]]]:
    """All tables as Markdown, and every mean and interval as plain values."""
    results = Results(records)
    parts = [data(sets)]
    own = [t for t in results.sets if t in OWN]
    public = [t for t in results.sets if t not in OWN]
    for title, among in (("public sets", public), ("own evidence", own)):
        if among:
            said = f"Means over {', '.join(among)} and over training sizes {', '.join(results.sizes)}."
            parts.append(f"## All {title} together\n\n{said}")
            parts += [overview(results, among, measure) for measure in MEASURES]
            parts += [by_size(results, among), duels(results, among)]
    parts.append(times(results))
    parts.append("## Set by set")
    parts += [one_set(results, name) for name in results.sets]
    return "\n\n".join(parts), values(results)


def data(sets: list[Table]) -> str:
    """What was judged on."""
    rows = []
    for t in sets:
        sources = ", ".join(f"{name} ({len(columns)})" for name, columns in t.sources.items())
        rows.append([t.name, t.origin, str(len(t.labels)), str(len(np.unique(t.labels))), sources])
    return "## Data\n\n" + table(["", "origin", "cases", "classes", "sources (features)"], rows, " --- |")


def table(head: list[str], rows: list[list[str]], align: str = " ---: |") -> str:
    lines = ["| " + " | ".join(head) + " |", "|" + " --- |" + align * (len(head) - 1)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def columns(results: Results, methods: tuple[str, ...], cells: list[Cell], measure: str) -> list[str]:
    """One column: mean and half interval, bold for the best and what can't be told from it."""
    _, factor, higher, digits = MEASURES[measure]
    over = {m: results.mean(m, cells, measure) for m in methods}
    judged = {m: v for m, v in over.items() if v is not None}
    if not judged:
        return ["" for _ in methods]
    best = (max if higher else min)(judged.values(), key=lambda v: v.mean())
    out = []
    for value in over.values():
        if value is None:
            out.append("")
            continue
        mean, half = mean_and_half(factor * value)
        text = f"{mean:.{digits}f} ± {half:.{digits}f}"
        tied = value is best or verdict(value, best, higher) == "="
        out.append(f"**{text}**" if tied else text)
    return out


def overview(results: Results, sets: list[str], measure: str) -> str:
    """A row for each method, a column for each condition, and the mean rank over sets, sizes, conditions."""
    methods = results.methods_of(sets)
    title, _, higher, _ = MEASURES[measure]
    cells = {c: results.cells(sets, results.sizes, c) for c in CONDITIONS}
    held = {c: columns(results, methods, found, measure) for c, found in cells.items() if found}
    every = [cell for found in cells.values() for cell in found]
    means = [[results.at(m, cell, measure) for m in methods] for cell in every]
    full = np.array(
        [[v.mean() for v in row if v is not None] for row in means if all(v is not None for v in row)]
    )
    ranks = mean_ranks(full if higher else -full)
    rows = [[m, *[held[c][i] for c in held], f"{ranks[i]:.1f}"] for i, m in enumerate(methods)]
    return f"{title}\n\n" + table(["", *held, "mean rank"], rows)


def by_size(results: Results, sets: list[str]) -> str:
    """Accuracy and Brier score of complete test cases by training cases per class."""
    methods = results.methods_of(sets)
    wanted = [(measure, size) for measure in ("accuracy", "brier") for size in results.sizes]
    held = [columns(results, methods, results.cells(sets, [s], CONDITIONS[0]), m) for m, s in wanted]
    head = ["", *[f"{'accuracy, %' if m == 'accuracy' else 'Brier'}: {s}" for m, s in wanted]]
    rows = [[m, *[column[i] for column in held]] for i, m in enumerate(methods)]
    return "By training cases per class, complete test cases\n\n" + table(head, rows)


def duels(results: Results, sets: list[str]) -> str:
    """By how much trained conductivity differs from each other method, and how often for certain."""
    others = [m for m in results.methods_of(sets) if m != OURS]
    parts = []
    for measure in ("accuracy", "brier"):
        held = {c: found for c in CONDITIONS if (found := results.cells(sets, results.sizes, c))}
        rows = [[m, *[duel(results, m, found, measure) for found in held.values()]] for m in others]
        said = {"accuracy": "accuracy, points (higher is better)", "brier": "Brier score (lower is better)"}
        parts.append(f"{OURS.capitalize()} minus the other: {said[measure]}\n\n" + table(["", *held], rows))
    return "\n\n".join(parts)


def duel(results: Results, other: str, cells: list[Cell], measure: str) -> str:
    """Mean difference over the same seeds with its interval; in how many cells better, equal, worse."""
    _, factor, higher, digits = MEASURES[measure]
    pairs = [(results.at(OURS, cell, measure), results.at(other, cell, measure)) for cell in cells]
    found = [(mine, theirs) for mine, theirs in pairs if mine is not None and theirs is not None]
    if not found:
        return ""
    mean, half = mean_and_half(factor * np.mean([mine - theirs for mine, theirs in found], axis=0))
    signs = [verdict(mine, theirs, higher) for mine, theirs in found]
    return f"{mean:+.{digits}f} ± {half:.{digits}f} ({' / '.join(str(signs.count(s)) for s in '+=-')})"


def times(results: Results) -> str:
    """Median and largest time to fit, and median time to predict one case."""
    rows = []
    for method in results.methods:
        fit, predict = (np.array(v) for v in zip(*results.times[method], strict=True))
        figures = (1e3 * np.median(fit), 1e3 * fit.max(), np.median(predict))
        rows.append([method, *[f"{v:.4g}" for v in figures]])
    head = ["", "fit, ms, median", "fit, ms, most", "predict one case, us, median"]
    return "## Processor time, one thread\n\n" + table(head, rows)


def one_set(results: Results, name: str) -> str:
    """Accuracy by size, and under every other condition with all training cases; Brier, calibration."""
    methods = results.methods_of([name])
    largest = results.sizes[-1]
    wanted = [("accuracy", s, CONDITIONS[0]) for s in results.sizes]
    wanted += [("accuracy", largest, c) for c in CONDITIONS[1:]]
    wanted += [("brier", largest, CONDITIONS[0]), ("calibration", largest, CONDITIONS[0])]
    head, held = [""], []
    for measure, size, condition in wanted:
        cells = results.cells([name], [size], condition)
        if cells:
            held.append(columns(results, methods, cells, measure))
            short = {"accuracy": "", "brier": "Brier, ", "calibration": "ECE %, "}[measure]
            head.append(short + (size if condition == CONDITIONS[0] else f"{size}, {condition}"))
    rows = [[m, *[column[i] for column in held]] for i, m in enumerate(methods)]
    return f"### {name}\n\n" + table(head, rows)


def values(results: Results) -> list[dict[str, Any]]:
    """Mean and half width of the 95 % interval of every method, cell and measure."""
    out = []
    for method, cell in results.by_seed:
        for measure in MEASURES:
            found = results.at(method, cell, measure)
            if found is not None:
                mean, half = mean_and_half(found)
                place = dict(zip(("set", "size", "condition"), cell, strict=True))
                out.append({"method": method, **place, "measure": measure, "mean": mean, "half": half})
    return out


def draw(records: list[Record], path: Path) -> None:
    """Accuracy over coverage, the least confident cases rejected first; means over sets, sizes and seeds."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    results = Results(records)
    kinds = {
        "public sets": [t for t in results.sets if t not in OWN],
        "own evidence": [t for t in results.sets if t in OWN],
    }
    kinds = {k: v for k, v in kinds.items() if v}
    shown = [CONDITIONS[0], *CONDITIONS[2:]]
    figure, axes = plt.subplots(
        len(kinds), 3, figsize=(12, 3.8 * len(kinds)), squeeze=False, layout="constrained"
    )
    colours = [*plt.get_cmap("tab10").colors, (0.0, 0.0, 0.0)]
    for row, (kind, sets) in zip(axes, kinds.items(), strict=True):
        for ax, condition in zip(row, shown, strict=True):
            cells = results.cells(sets, results.sizes, condition)
            for method in results.methods:
                curve = results.mean(method, cells, "curve")
                if curve is not None:
                    ours = method.startswith("conductivity")
                    style = {"lw": 2.2 if ours else 1.2, "ls": "-" if ours else "--"}
                    ax.plot(
                        100 * COVERAGES,
                        100 * curve.mean(axis=0),
                        color=colours[ORDER.index(method)],
                        label=method,
                        **style,
                    )
            ax.set(title=f"{kind}, {condition}", xlabel="cases decided, %", ylabel="of these right, %")
            ax.grid(alpha=0.3)
    lines: dict[str, Any] = {}
    for ax in axes.flat:
        lines.update({label: line for line, label in zip(*ax.get_legend_handles_labels(), strict=True)})
    names = [m for m in results.methods if m in lines]
    figure.legend([lines[m] for m in names], names, loc="outside lower center", ncols=4, frameon=False)
    figure.savefig(path, dpi=110)
    plt.close(figure)
