"""Every published figure of the chapter's examples, computed from what the chapter gives and set beside it.

The inputs are the print's: beliefs and angles of section 3.4, curvatures, beliefs and marks of table 5,
published conductivities of section 5.1. The outputs are computed here, by the same functions that the
sensors use.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from evifuse.belief import MassFunction, mass
from evifuse.conductivity import classify, normalised_belief
from evifuse.conductivity.sweep import same_order
from evifuse.fusion import curvature_from_shape, total_conductivity
from evifuse.knowledge import load_knowledge
from evifuse.touch import CURVATURE_FRAME, primitive_beliefs
from evifuse.vision import rectangle_belief, shape_evidence, square_belief, triangle_belief

__all__ = ["Figure", "reproduce"]

Status = Literal["reproduces", "ranking reproduces", "does not follow from the print"]

OPEN = "the print leaves the reading of appendix A open; no reading tried gives all six figures"

TABLE_5: tuple[tuple[float, float, str], ...] = (
    (0.2, 0.15, "P C+"),
    (0.1, 0.07, "P C+"),
    (0.8, 0.56, "C+"),
    (0.1, 0.08, "P C+"),
    (0.0, 0.00, "P C- C+ H"),
    (1.0, 0.67, "C+ H"),
    (0.2, 0.20, "P C- C+"),
    (-1.0, 0.67, "C- H"),
)
"""Local curvatures of table 5, the belief of each, and the primitives that the table marks for it."""


@dataclass(frozen=True)
class Figure:
    """One published figure beside the computed one.

    Parameters
    ----------
    name : str
        What it is, with the section or table.
    published : float
        As printed.
    computed : float
        As computed here.
    status : {"reproduces", "ranking reproduces", "does not follow from the print"}
        How the two compare: equal when rounded to the printed digits, or at least in the published order.
    why : str
        The reason, in a line; how it is computed where it reproduces.
    """

    name: str
    published: float
    computed: float
    status: Status
    why: str


def reproduce() -> list[Figure]:
    """Compute every published figure of the three example tables and of section 5.

    Returns
    -------
    list of Figure
        In the order of the chapter.
    """
    return [*_shape_example(), *_curvature_example(), *_fusion_example()]


def _figures(
    where: str,
    published: Mapping[str, float],
    computed: Mapping[str, float],
    why: str,
    differs: Mapping[str, str] | str = "",
    *,
    digits: int = 2,
) -> list[Figure]:
    """Figures of one group; a group whose order is the published one has at least its ranking."""
    labels = list(published)
    ordered = len(set(published.values())) > 1 and same_order(
        [published[k] for k in labels], [computed[k] for k in labels]
    )
    out: list[Figure] = []
    for label in labels:
        equal = abs(computed[label] - published[label]) <= 0.5 * 10**-digits + 1e-9
        reason = why
        status: Status = "reproduces"
        if not equal:
            status = "ranking reproduces" if ordered else "does not follow from the print"
            reason = differs if isinstance(differs, str) else differs[label]
        out.append(Figure(f"{where}: {label}", published[label], float(computed[label]), status, reason))
    return out


def _shape_example() -> list[Figure]:
    sides = {"AB": 0.31, "BC": 0.15, "CD": 0.15}
    support = {
        name: mass(MassFunction.of(load_knowledge("shape").frame, {"rectangle": b, 63: 1 - b}), 63)
        for name, b in sides.items()
    }
    figures = _figures(
        "3.4 frame of the simple support function",
        {"AB": 0.69, "BC": 0.85, "CD": 0.85},
        {name: float(value) for name, value in support.items()},
        "1 minus the belief of the fitted edge",
    )
    nan = float("nan")
    beliefs, lengths = [*sides.values(), nan], [1.0, 1.0, 1.0, nan]
    angles = np.deg2rad([80.0, 100.0, nan, nan])
    evidence = shape_evidence(
        {
            "rectangle": rectangle_belief(beliefs, lengths, angles),
            "square": square_belief(beliefs, lengths, angles),
            "triangle": triangle_belief(list(sides.values()), np.deg2rad([80.0, 100.0])),
        }
    )
    published = {"rectangle": 0.19, "square": 0.10, "triangle": 0.20, "frame": 0.51}
    figures += _figures(
        "3.4 belief of shape primitives",
        published,
        evidence.as_dict(),
        "mean over the sides that are present; the missing side is closed virtually",
    )
    printed = MassFunction.of(
        evidence.frame, {"rectangle": 0.19, "square": 0.10, "triangle": 0.20, evidence.frame: 0.51}
    )
    figures += _figures(
        "3.4 conductivity of shape features",
        {"rectangular": 0.48, "triangular": 1.46, "elliptical": 0.0},
        classify(printed, load_knowledge("chapter-shape")).conductivity,
        "sound reading of appendix A",
        OPEN,
    )
    belief = normalised_belief(["rectangular", "triangular"], np.array([0.48, 1.46]))
    figures += _figures(
        "3.4 belief of shape features",
        {"rectangular": 0.25, "triangular": 0.75},
        belief.as_dict(),
        "published conductivities, normalised",
    )
    return figures


def _curvature_example() -> list[Figure]:
    curvatures, beliefs, marks = zip(*TABLE_5, strict=True)
    means = primitive_beliefs(curvatures, beliefs, [row.split() for row in marks])
    exchanged = "mean of the marked beliefs; the published figures of C- and C+ look exchanged"
    figures = _figures(
        "Table 5 belief of curvature primitives",
        {"P": 0.10, "C-": 0.25, "C+": 0.28, "H": 0.37},
        means,
        "mean of the marked beliefs",
        {"C-": exchanged, "C+": exchanged, "H": "mean of the marked beliefs 0.00, 0.67 and 0.67"},
    )
    printed = MassFunction.of(CURVATURE_FRAME, {"P": 0.10, "C-": 0.25, "C+": 0.28, "H": 0.37})
    figures += _figures(
        "4.4 conductivity of curvature features",
        {"quasiplanar": 1.30, "curved": 0.0, "occluded": 0.0},
        classify(printed, load_knowledge("chapter-curvature")).conductivity,
        "sound reading of appendix A",
        OPEN,
    )
    return figures


def _fusion_example() -> list[Figure]:
    table_4 = load_knowledge("chapter-curvature")
    touch = {"quasiplanar": 1.30, "curved": 0.0, "occluded": 0.0}
    from_shape = curvature_from_shape({"rectangular": 0.48, "triangular": 1.46, "elliptical": 0.0}, table_4)
    printed = {"quasiplanar": 0.48, "curved": 0.70, "occluded": 0.0}
    total = total_conductivity(touch, printed)
    figures = _figures(
        "5.2 curvature from shape",
        printed,
        from_shape,
        "maximum over the focal sets of the products of their classes' conductivities",
        "max{0.48, 0.48 x 1.46} is 0.70 by the formula that the text gives, which prints 0.48",
    )
    figures += _figures(
        "5.3 total conductivity",
        {"quasiplanar": 1.78, "curved": 0.70, "occluded": 0.0},
        total,
        "sum of the published conductivities",
    )
    belief = normalised_belief(table_4.classes, np.array([total[c] for c in table_4.classes]))
    shares = {label: float(mass(belief, label)) for label in table_4.classes}
    figures += _figures(
        "5.3 fused belief",
        {"quasiplanar": 0.72, "curved": 0.28, "occluded": 0.0},
        shares,
        "total conductivities, normalised",
    )
    return figures
