"""What a reading makes of the published examples, of pure cases, and of a knowledge base's own prototypes."""

from dataclasses import replace

import numpy as np

from evifuse.app.reproduce import reproduce
from evifuse.belief import Frame, MassFunction
from evifuse.belief.frame import Subset
from evifuse.conductivity import READINGS, KnowledgeBase, Reading, classify
from evifuse.conductivity.sweep import Example
from evifuse.knowledge import load_knowledge

__all__ = ["named_readings", "own_prototypes", "published_examples", "pure_cases"]

PURE = {
    "rectangle": "rectangular",
    "square": "rectangular",
    "triangle": "triangular",
    "ellipse": "elliptical",
    "circle": "elliptical",
    "bracket": "elliptical",
    "P": "quasiplanar",
    **dict.fromkeys(("C-", "C+", "H", "E-", "E+"), "curved"),
    "N": "occluded",
}
"""The class that each shape and curvature primitive belongs to, by sections 3.3 and 4.3."""

PURE_MASSES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99)
"""Masses with which a primitive is given alone, the balance on the frame."""


def named_readings(own: Reading | None = None) -> dict[str, Reading]:
    """The readings that are compared without a sweep.

    Parameters
    ----------
    own : Reading, optional
        That of a knowledge base; listed as ``own`` if it is none of the others.

    Returns
    -------
    dict of str to Reading
        The named ones, and the sound one with single changes of ours.
    """
    sound = READINGS["sound"]
    found = {
        **READINGS,
        "smooth 0.05": replace(sound, smoothing=0.05),
        "smooth 0.2": replace(sound, smoothing=0.2),
        "unprojected": replace(sound, projection=False),
        "unprojected max": replace(sound, projection=False, pooling="max"),
    }
    return found if own is None or own in found.values() else {**found, "own": own}


def published_examples() -> list[Example]:
    """The two printed examples whose six conductivities were published (sections 3.4 and 4.4).

    Returns
    -------
    list of Example
        Evidence with the printed masses, and the printed tables.
    """
    printed = {f.name: f.published for f in reproduce()}

    def under(heading: str) -> dict[str, float]:
        return {k.removeprefix(f"{heading}: "): v for k, v in printed.items() if k.startswith(f"{heading}: ")}

    found: list[Example] = []
    for name, masses, conductivity in (
        ("chapter-shape", "3.4 belief of shape primitives", "3.4 conductivity of shape features"),
        (
            "chapter-curvature",
            "Table 5 belief of curvature primitives",
            "4.4 conductivity of curvature features",
        ),
    ):
        base = load_knowledge(name)
        beliefs: dict[Subset, float] = {
            base.frame if k == "frame" else k: v for k, v in under(masses).items()
        }
        evidence = MassFunction.of(base.frame, beliefs)
        found.append(Example(conductivity, evidence, base, under(conductivity)))
    return found


def pure_cases(knowledge: KnowledgeBase, reading: Reading) -> tuple[int, int]:
    """How many primitives given alone are recognised, at masses from 0.1 to 0.99.

    Parameters
    ----------
    knowledge : KnowledgeBase
        With the chapter's classes of shape or curvature features.
    reading : Reading
        How the formulas are read.

    Returns
    -------
    int
        Cases decided for the class that the primitive belongs to.
    int
        All cases; 0 if no primitive of the frame belongs to a class of the knowledge base.
    """
    masses = np.array(PURE_MASSES)
    expected = {h: PURE[h] for h in knowledge.frame.hypotheses if PURE.get(h) in knowledge.classes}
    right = 0
    for name, label in expected.items():
        frame = Frame(expected)
        pure = MassFunction(frame, [name, frame], np.stack([masses, 1.0 - masses], axis=-1))
        with np.errstate(all="ignore"):
            decisions = classify(pure, knowledge, reading).decisions
        right += int(np.sum(decisions == knowledge.classes.index(label)))
    return right, len(expected) * len(masses)


def own_prototypes(knowledge: KnowledgeBase, reading: Reading) -> tuple[int, int]:
    """How many prototypes, given as evidence, are decided for their own class.

    Parameters
    ----------
    knowledge : KnowledgeBase
        Any.
    reading : Reading
        How the formulas are read.

    Returns
    -------
    int
        Prototypes that are.
    int
        All prototypes.
    """
    pairs = [(a.label, x) for a in knowledge.aggregates for x in a.prototypes.values()]
    with np.errstate(all="ignore"):
        right = sum(classify(x, knowledge, reading).decision == label for label, x in pairs)
    return right, len(pairs)
