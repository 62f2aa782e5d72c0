"""Tables for people: what was seen, felt and decided, and why."""

from collections.abc import Iterable, Mapping

from rich.console import Console
from rich.table import Table

from evifuse.app.reproduce import Figure
from evifuse.conductivity import Classification
from evifuse.fusion import Fusion
from evifuse.touch import FeltSite, FeltSurface
from evifuse.vision import SeenObject

__all__ = ["report_fusion", "report_reproduction", "report_shapes", "report_touch"]


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold", pad_edge=False, box=None)
    for i, column in enumerate(columns):
        table.add_column(column, justify="left" if i == 0 else "right")
    return table


def _shares(title: str, rows: Mapping[str, float], unit: str = "belief") -> Table:
    table = _table(title, "", unit, "")
    for label, value in rows.items():
        table.add_row(label, f"{value:.3f}", "█" * round(20 * min(value, 1.0)))
    table.columns[2].justify = "left"
    return table


def _reasons(title: str, found: Classification) -> Table:
    table = _table(
        title, "class", "prototype", "branch", "interaction", "aggregate", "margin", "conductivity"
    )
    for e in found.explain():
        table.add_row(
            e.label,
            e.prototype,
            e.branch,
            f"{e.interaction_dimension:.3f}",
            f"{e.aggregate_dimension:.3f}",
            f"{e.margin:.3f}",
            f"{e.conductivity:.3f}",
        )
    return table


def report_shapes(objects: Iterable[SeenObject], console: Console, *, why: bool = False) -> None:
    """Print what was seen.

    Parameters
    ----------
    objects : iterable of SeenObject
        Most prominent first.
    console : Console
        Where to print.
    why : bool
        Also print how each prototype conducted.
    """
    table = _table("Seen", "object", "box x, y, w, h (px)", "edges", "best primitive", "belief", "frame")
    seen = list(objects)
    if not seen:
        console.print("Seen: no object.")
        return
    for o in seen:
        best = o.primitives[0] if o.primitives else None
        table.add_row(
            o.classification.decision or "unknown",
            ", ".join(str(v) for v in o.box),
            str(len(o.fitted_edges)),
            best.kind if best else "-",
            f"{best.belief:.2f}" if best else "-",
            f"{o.evidence.as_dict().get('frame', 0.0):.2f}",
        )
    console.print(table)
    if why:
        console.print(
            _shares("Belief over shape primitives, most prominent object", seen[0].evidence.as_dict())
        )
        console.print(_reasons("Conductivity of shape features", seen[0].classification))


def report_touch(felt: FeltSurface, console: Console, *, why: bool = False) -> None:
    """Print what was felt.

    Parameters
    ----------
    felt : FeltSurface
        Local curvatures, sites and belief.
    console : Console
        Where to print.
    why : bool
        Also print how each prototype conducted.
    """
    rolls = _table(
        "Felt along each roll (concave up positive)", "site", "direction (rad)", "curvature (1/m)", "belief"
    )
    for c in felt.local_curvatures:
        rolls.add_row(
            str(c.site),
            f"{c.direction_rad:.2f}",
            f"{c.curvature_per_m:.2f} ± {c.standard_error_per_m:.2f}",
            f"{c.belief:.2f}",
        )
    if felt.local_curvatures:
        console.print(rolls)
    sites = _table("Felt at each site", "site", "contact", "k1 (1/m)", "k2 (1/m)", "k1 along (rad)")
    for i, site in enumerate(felt.sites):
        sites.add_row(str(i), "yes" if site.contact else "no", *_bends(site))
    console.print(sites)
    console.print(_shares("Belief over curvature primitives", felt.evidence.as_dict()))
    if why:
        console.print(_reasons("Conductivity of curvature features", felt.classification))
    console.print(f"Touch says: {felt.decision or 'nothing'}.")
    for warning in felt.warnings:
        console.print(f"Note: {warning}", style="yellow")


def _bends(site: FeltSite) -> tuple[str, str, str]:
    """Principal curvatures of a site with their standard errors, and the direction of the first."""
    shape = site.shape
    if shape is None:
        known = "unknown" if site.edge is None else "edge"
        return known, known, ""
    return (
        f"{shape.k1_per_m:.2f} ± {shape.k1_error_per_m:.2f}",
        f"{shape.k2_per_m:.2f} ± {shape.k2_error_per_m:.2f}",
        f"{shape.k1_direction_rad:.2f}",
    )


def report_fusion(fusion: Fusion, console: Console) -> None:
    """Print both senses, their sum, and the decision with its reasons.

    Parameters
    ----------
    fusion : Fusion
        The fused belief.
    console : Console
        Where to print.
    """
    if fusion.objects:
        report_shapes(fusion.objects, console)
    if fusion.touch is not None:
        report_touch(fusion.touch, console)
    table = _table("Fused", "class", "from touch", "from shape", "total", "belief", "pignistic")
    beliefs = fusion.belief.as_dict()
    for label in fusion.total:
        table.add_row(
            label,
            f"{fusion.from_touch[label]:.3f}",
            f"{fusion.from_shape[label]:.3f}",
            f"{fusion.total[label]:.3f}",
            f"{beliefs.get(label, 0.0):.3f}",
            f"{fusion.pignistic[label]:.3f}",
        )
    table.add_row("frame (ignorance)", "", "", "", f"{beliefs.get('frame', 0.0):.3f}", "")
    console.print(table)
    if fusion.decision is None:
        console.print("Decision: none; nothing that was seen or felt conducts.")
    else:
        console.print(
            f"Decision: [bold]{fusion.decision}[/bold] ({fusion.pignistic[fusion.decision]:.0%})", end=""
        )
        console.print(f" because {why(fusion)}.")
    said = fusion.touch.warnings if fusion.touch is not None else ()
    for warning in fusion.warnings:
        if warning not in said:
            console.print(f"Note: {warning}", style="yellow")


def why(fusion: Fusion) -> str:
    """The reason for a decision, in a line: what each sense met in the knowledge base.

    Parameters
    ----------
    fusion : Fusion
        With a decision.

    Returns
    -------
    str
        For example ``touch conducts best into curved/K_1 (0.93)``.
    """
    parts: list[str] = []
    if fusion.touch is not None:
        best = max(fusion.touch.classification.explain(), key=lambda e: e.conductivity)
        masses = fusion.touch.evidence.as_dict(2)
        felt = next(iter(masses))
        parts.append(
            f"touch believes {felt} ({masses[felt]:.2f}), nearest to {best.label}/{best.prototype} "
            f"({best.conductivity:.2f})"
        )
    if fusion.shape is not None:
        best = max(fusion.shape.classification.explain(), key=lambda e: e.conductivity)
        masses = fusion.shape.evidence.as_dict(2)
        seen = next(iter(masses))
        parts.append(
            f"vision believes {seen} ({masses[seen]:.2f}), nearest to {best.label}/{best.prototype} "
            f"({best.conductivity:.2f})"
        )
    return "; ".join(parts)


def report_reproduction(figures: Iterable[Figure], console: Console) -> None:
    """Print published beside computed figures.

    Parameters
    ----------
    figures : iterable of Figure
        What `reproduce` returns.
    console : Console
        Where to print.
    """
    table = _table("The chapter's figures", "figure", "published", "computed", "status", "why")
    for column in table.columns[3:]:
        column.justify = "left"
    styles = {"reproduces": "green", "ranking reproduces": "yellow", "does not follow from the print": "red"}
    counts = dict.fromkeys(styles, 0)
    for f in figures:
        counts[f.status] += 1
        table.add_row(
            f.name, f"{f.published:.2f}", f"{f.computed:.2f}", f"[{styles[f.status]}]{f.status}[/]", f.why
        )
    console.print(table)
    console.print(", ".join(f"{count} {status}" for status, count in counts.items()) + ".")
