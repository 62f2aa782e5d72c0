"""Where a finger went, seen along the surface's normal, and how the surface bends at each site."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import TouchRecording
from evifuse.touch import FeltSurface, contact_track
from evifuse.touch.felt import FeltSite
from evifuse.touch.rolling import tangents

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_path", "draw_rolls"]

SITE_COLOURS = ("#2f7ebc", "#d97a27", "#3f9b57", "#a14fa0", "#8c6d31", "#5b5b5b", "#c44e6a", "#17929c")
"""Colour of each site, in all panels."""
UP, DOWN, LEVEL = "#c0392b", "#1f4e9c", "#6b6b6b"
LONGEST = 0.3
"""Length of the longest arrow, as a share of the panel."""


def draw_path(axes: "Axes", recording: TouchRecording, felt: FeltSurface) -> None:
    """Draw the contact's path, the rolls of each site, and the principal curvatures as arrows.

    An arrow points both ways along a principal direction, its length is the curvature, the bar at its tip the
    95 % interval.

    Parameters
    ----------
    axes : Axes
        Where to draw.
    recording : TouchRecording
        What was rolled.
    felt : FeltSurface
        What was felt.
    """
    touched = any(site.contact for site in felt.sites)
    title = "path of the contact, and how each site bends" if touched else "no contact; path of the fingertip"
    axes.set_title(f"Felt: {title}", loc="left")
    normal = np.sum([site.normal for site in felt.sites], axis=0)
    frame = np.stack(tangents(normal / np.linalg.norm(normal)), axis=1)
    where = recording.position_m
    if touched:
        track = contact_track(recording)
        where = track.point_m[track.touching]
    path = (where @ frame) * 1000
    path = path[:: max(1, len(path) // 4000)]
    axes.plot(path[:, 0], path[:, 1], ".", ms=2, color="#c9c9c9", zorder=1)
    places = [site.position_m @ frame * 1000 for site in felt.sites]
    every = np.concatenate([path, *(place[None] for place in places)])
    middle = 0.5 * (every.min(axis=0) + every.max(axis=0))
    half = 0.5 * max(float(np.ptp(every, axis=0).max()), 1.0) * 1.45
    axes.set(
        aspect="equal",
        xlim=(middle[0] - half, middle[0] + half),
        ylim=(middle[1] - half, middle[1] + half),
        xlabel=_axis_name(frame[:, 0]) + " (mm)",
        ylabel=_axis_name(frame[:, 1]) + " (mm)",
    )
    scale = _scale(felt.sites, 2 * half * LONGEST)
    for index, (site, place) in enumerate(zip(felt.sites, places, strict=True)):
        _site(axes, site, place, frame, scale, SITE_COLOURS[index % len(SITE_COLOURS)])
        axes.annotate(
            str(index),
            (float(place[0]), float(place[1])),
            xytext=(13, -13),
            textcoords="offset points",
            ha="center",
            va="center",
            bbox={"boxstyle": "circle,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.85},
            fontsize=9,
            zorder=6,
            fontweight="bold",
            color=SITE_COLOURS[index % len(SITE_COLOURS)],
        )
    if any(_bends(site) for site in felt.sites):
        largest = max(abs(k) for site in felt.sites for k, _, _ in _bends(site))
        _key(axes, f"longest arrow {largest:.3g} 1/m" if largest > 0.1 else "too flat for arrows")


def _scale(sites: tuple[FeltSite, ...], longest_mm: float) -> float:
    """Millimetres of arrow for each 1/m."""
    largest = max(
        (abs(k) for site in sites for k, _, _ in _bends(site)),
        default=0.0,
    )
    return longest_mm / max(largest, 5.0)


def _bends(site: FeltSite) -> list[tuple[float, float, float]]:
    """Curvature, its standard error and direction, along as many directions as are known."""
    s, only = site.shape, site.only
    if s is not None:
        turn = s.k1_direction_rad
        return [(s.k1_per_m, s.k1_error_per_m, turn), (s.k2_per_m, s.k2_error_per_m, turn + np.pi / 2)]
    if only is not None:
        return [(only.curvature_per_m, only.standard_error_per_m, only.direction_rad)]
    return []


def _site(
    axes: "Axes",
    site: FeltSite,
    place: NDArray[np.float64],
    frame: NDArray[np.float64],
    scale: float,
    colour: str,
) -> None:
    marker = "o" if site.contact else "x"
    axes.plot(*place, marker, ms=7 if site.contact else 11, mew=2.5, color=colour, zorder=5)
    own = np.stack(tangents(site.normal), axis=1)
    for k, error, angle in _bends(site):
        way = (own @ np.array([np.cos(angle), np.sin(angle)])) @ frame
        way = way / max(float(np.linalg.norm(way)), 1e-9)
        sure = abs(k) > 1.96 * error
        shade = LEVEL if not sure else UP if k > 0 else DOWN
        for sign in (1, -1):
            tip = place + sign * 0.5 * scale * abs(k) * way
            low = place + sign * 0.5 * scale * max(abs(k) - 1.96 * error, 0.0) * way
            high = place + sign * 0.5 * scale * (abs(k) + 1.96 * error) * way
            axes.plot(
                *np.stack([low, high], axis=1), lw=7, alpha=0.3, color=shade, solid_capstyle="butt", zorder=3
            )
            if 0.5 * scale * abs(k) > 0.03 * np.ptp(
                axes.get_xlim()
            ):  # else it would be a head without a line
                ends = {"arrowstyle": "-|>", "color": shade, "lw": 1.8, "shrinkA": 0, "shrinkB": 0}
                axes.annotate("", (tip[0], tip[1]), (place[0], place[1]), arrowprops=ends)


def _axis_name(direction: NDArray[np.float64]) -> str:
    """``x`` of the world, or along what it goes mostly."""
    largest = int(np.argmax(np.abs(direction)))
    return (
        f"{'xyz'[largest]} of the world"
        if abs(direction[largest]) > 0.98
        else f"along the surface, near {'xyz'[largest]}"
    )


def _key(axes: "Axes", longest: str) -> None:
    """What the colours mean, and how long an arrow is."""
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=UP, lw=2, label="bends up"),
        Line2D([], [], color=DOWN, lw=2, label="bends down"),
        Line2D([], [], color=LEVEL, lw=7, alpha=0.3, label="95 % interval"),
    ]
    axes.legend(handles=handles, loc="upper left", ncols=3, fontsize=8, frameon=False, borderaxespad=0.2)
    axes.text(0.98, 0.02, longest, ha="right", va="bottom", fontsize=8, transform=axes.transAxes)


def draw_rolls(axes: "Axes", felt: FeltSurface) -> None:
    """Draw every roll with its 95 % interval, and the curve that each site's principal curvatures make.

    Parameters
    ----------
    axes : Axes
        Where to draw.
    felt : FeltSurface
        What was felt, with one roll or more.
    """
    around = np.linspace(0, np.pi, 181)
    felt_there = range(len(felt.sites))
    for number, index in enumerate(felt_there):
        own = [c for c in felt.local_curvatures if c.site == index]
        if felt.sites[index].edge is not None or not own:  # it has no curvature that could be drawn
            axes.plot(
                [],
                [],
                "x",
                color=SITE_COLOURS[index % len(SITE_COLOURS)],
                label=_site_line(index, felt.sites[index]),
            )
            continue
        colour = SITE_COLOURS[index % len(SITE_COLOURS)]
        aside = 1.5 * (number - 0.5 * (len(felt_there) - 1))  # sites that agree are not drawn over each other
        axes.errorbar(
            [_degrees(c.direction_rad) + aside for c in own],
            [c.curvature_per_m for c in own],
            yerr=[1.96 * c.standard_error_per_m for c in own],
            fmt="osD^vP*X"[index % 8],
            color=colour,
            ms=5,
            capsize=3,
            label=_site_line(index, felt.sites[index]),
        )
        shape = felt.sites[index].shape
        if shape is not None:
            share = np.cos(around - shape.k1_direction_rad) ** 2
            curve = shape.k1_per_m * share + shape.k2_per_m * (1 - share)
            axes.plot(np.rad2deg(around), curve, color=colour, lw=1, alpha=0.6)
    axes.axhline(0, color="grey", lw=0.8)
    low, high = axes.get_ylim()
    least = 5.0
    low, high = min(low, -least), max(high, least)
    axes.set_ylim(low, high + 0.09 * len(felt_there) * (high - low))  # room for the key
    axes.set(xlim=(-8, 188), xticks=[0, 45, 90, 135, 180], xlabel="direction (degrees)")
    axes.set_ylabel("curvature (1/m), up positive")
    handles, labels = axes.get_legend_handles_labels()
    order = sorted(range(len(labels)), key=lambda i: int(labels[i].split()[1].rstrip(":")))
    ordered = [[entries[i] for i in order] for entries in (handles, labels)]
    axes.legend(*ordered, loc="upper left", fontsize=8, frameon=False)
    axes.set_title("Felt: curvature along each roll, 95 % intervals", loc="left")


def _degrees(direction_rad: float) -> float:
    """0 to 180, where what is all but 180 is 0: a direction has no sense."""
    degrees = float(np.rad2deg(direction_rad))
    return degrees - 180 if degrees > 175 else degrees


def _site_line(index: int, site: FeltSite) -> str:
    """Principal curvatures of a site in a line, or why there are none."""
    if not site.contact:
        return f"site {index}: no contact"
    if site.edge is not None:
        return f"site {index}: {site.edge}"
    if site.only is not None:
        along, across = (round(np.rad2deg(a)) % 180 for a in (site.only.direction_rad, site.only.across_rad))
        k, error = site.only.curvature_per_m, 1.96 * site.only.standard_error_per_m
        return f"site {index}: {k:.1f} ± {error:.1f} along {along} degrees, not known across, at {across}"
    if site.shape is None:
        return f"site {index}: k1 and k2 not known"
    s = site.shape
    return (
        f"site {index}: k1 {s.k1_per_m:.1f} ± {1.96 * s.k1_error_per_m:.1f}, "
        f"k2 {s.k2_per_m:.1f} ± {1.96 * s.k2_error_per_m:.1f}"
    )
