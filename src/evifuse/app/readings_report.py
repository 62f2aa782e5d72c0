"""Tables of readings for people."""

from collections.abc import Mapping
from typing import Any

from rich.console import Console
from rich.table import Table

__all__ = ["report_readings"]


def report_readings(found: Mapping[str, Any], console: Console) -> None:
    """Print what was found out about readings.

    Parameters
    ----------
    found : mapping
        What ``evifuse readings --json`` prints.
    console : Console
        Where to print.
    """
    if "judged" in found:
        _judged(found, console)
        _diagnosis(found["diagnosis"], found["chosen"], console)
        return
    _figures(found, console)
    _recognised(found, console)
    for swept in found.get("sweep", []):
        _sweep(swept, console)


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold", pad_edge=False, box=None)
    for i, column in enumerate(columns):
        table.add_column(column, justify="left" if i == 0 else "right")
    return table


def _number(value: float | None, digits: int = 2) -> str:
    return "undefined" if value is None else f"{value:.{digits}f}"


def _figures(found: Mapping[str, Any], console: Console) -> None:
    figures = [f["name"].split(": ")[-1] for f in found["figures"]]
    table = _table(
        "Conductivities published in sections 3.4 and 4.4", "reading", *figures, "largest gap", "ranking"
    )
    table.add_row("published", *(f"{f['published']:.2f}" for f in found["figures"]), "", "")
    for name, one in found["readings"].items():
        computed = (_number(v) for v in one["computed"])
        table.add_row(name, *computed, _number(one["largest_gap"]), "yes" if one["ranking"] else "no")
    console.print(table)
    for name, one in found["readings"].items():
        if one["differs"] != "sound":
            console.print(f"  {name}: sound with {one['differs']}")


def _recognised(found: Mapping[str, Any], console: Console) -> None:
    rows: dict[str, dict[str, Any]] = {}
    for one in found["recognised"]:
        rows.setdefault(one["knowledge"], {})[one["reading"]] = one
    for key, title in (
        ("pure", "Pure cases recognised: each primitive alone, masses 0.1 to 0.99"),
        ("prototypes", "Prototypes that, given as evidence, are decided for their own class"),
    ):
        totals = {name: next(iter(by_reading.values()))[key][1] for name, by_reading in rows.items()}
        names = [name for name, total in totals.items() if total]
        if not names:
            continue
        table = _table(title, "reading", *(f"{name} ({totals[name]})" for name in names))
        for reading in found["readings"]:
            table.add_row(reading, *(str(rows[name][reading][key][0]) for name in names))
        console.print(table)


def _sweep(swept: Mapping[str, Any], console: Console) -> None:
    console.print(
        f"[bold]Sweep of {swept['choices']}[/bold]: {swept['tried']} readings, "
        f"{swept['undefined']} undefined; {swept['ranking']} give the published ranking, "
        f"{swept['within_0.01']} all six figures within 0.01."
    )
    table = _table("Nearest to the published figures", "reading", "largest gap", "ranking", "computed")
    table.columns[0].overflow = "fold"
    ranked = [one for one in swept["nearest_ranked"] if one not in swept["nearest"]]
    for one in [*swept["nearest"], *ranked]:
        figures = ", ".join(_number(v) for v in one["computed"])
        table.add_row(
            one["differs"], _number(one["largest_gap"], 3), "yes" if one["ranking"] else "no", figures
        )
    console.print(table)


def _judged(found: Mapping[str, Any], console: Console) -> None:
    swept = f", after a sweep of {found['swept']}" if found["swept"] else ""
    whole = f", {found['groups']} whole groups" if found["groups"] else ""
    table = _table(
        f"Readings of {found['knowledge']} on {found['evidence']}: chosen on {found['choosing']} cases, "
        f"judged on the other {found['held_out']} (seed {found['seed']}{whole}{swept})",
        "reading",
        "choosing",
        "held out",
        "95 %",
        "Brier",
        "undecided",
        "differs from sound",
    )
    table.columns[-1].justify = "left"
    for one in found["judged"]:
        low, high = one["interval"]
        table.add_row(
            "(sweep)" if one["swept"] else one["name"],
            f"{one['chosen_on']:.3f}",
            f"{one['accuracy']:.3f}",
            f"{low:.3f} to {high:.3f}",
            f"{one['brier']:.3f}",
            f"{one['undecided']:.1%}",
            one["differs"],
            style="bold" if one["name"] == found["chosen"] else None,
        )
    console.print(table)
    best = next(one for one in found["judged"] if one["name"] == found["chosen"])
    console.print(
        f"Take [bold]{found['chosen']}[/bold]: {best['accuracy']:.3f} held out; always the commonest class "
        f"gives {found['commonest']:.3f}."
    )


def _diagnosis(found: Mapping[str, Any], reading: str, console: Console) -> None:
    names = ("conducts", "best_of_class", "best_of_all", "fires", "decisive", "crossings")
    table = _table(
        f"Prototypes under {reading}, {found['cases']} inputs",
        "prototype",
        "conducts",
        "best of class",
        "best of all",
        "fires",
        "decisive",
        "near a jump",
    )
    for one in found["prototypes"]:
        style = "yellow" if not one["fires"] else None
        table.add_row(f"{one['class']}/{one['prototype']}", *(str(one[n]) for n in names), style=style)
    console.print(table)
    decided = ", ".join(f"{label} {count}" for label, count in found["decided"].items())
    console.print(f"Decided: {decided}; nothing {found['nothing']}.")
    for what, key in (("Never fire", "never_fire"), ("Never decided", "never_decided")):
        if found[key]:
            console.print(f"{what}: {', '.join(found[key])}.", style="yellow")
    console.print(
        f"Near a jump (within {found['near']:.0%} of the branch point): {found['near_branch']} inputs; "
        f"{found['flips']} decisions would turn."
    )
    for one in found["worst"][:3]:
        turn = ", and the decision would turn" if one["flips"] else ""
        console.print(
            f"  input {one['case']}: {one['change']:.2f} of belief moves by {one['prototype']}{turn}"
        )
