"""How many pure cases each knowledge base and reading recognises.

This is why the sensors have prototypes of their own. Every shape and curvature primitive is given alone with
masses of 0.1 to 0.99, the balance on the frame, and the decision is compared with the class that the
primitive belongs to by sections 3.3 and 4.3.
"""

import argparse
import json

import numpy as np

from evifuse.belief import Frame, MassFunction
from evifuse.conductivity import READINGS, classify
from evifuse.knowledge import load_knowledge

SHAPES = {
    "rectangle": "rectangular",
    "square": "rectangular",
    "triangle": "triangular",
    "ellipse": "elliptical",
    "circle": "elliptical",
    "bracket": "elliptical",
}
CURVATURES = {
    "P": "quasiplanar",
    **dict.fromkeys(("C-", "C+", "H", "E-", "E+"), "curved"),
    "N": "occluded",
}
MASSES = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99])


def recognised(knowledge: str, reading: str, expected: dict[str, str]) -> tuple[int, int]:
    base = load_knowledge(knowledge)
    frame = Frame(expected)
    right = 0
    for name, label in expected.items():
        evidence = MassFunction(frame, [name, frame], np.stack([MASSES, 1 - MASSES], axis=-1))
        found = classify(evidence, base, READINGS[reading])
        right += int(np.sum(found.decisions == base.classes.index(label)))
    return right, len(expected) * len(MASSES)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    rows = []
    for sense, expected in (("shape", SHAPES), ("curvature", CURVATURES)):
        for knowledge in (f"chapter-{sense}", sense):
            for reading in ("sound", "working"):
                right, total = recognised(knowledge, reading, expected)
                rows.append({"knowledge": knowledge, "reading": reading, "right": right, "of": total})
    if arguments.json:
        print(json.dumps(rows))
        return
    print(f"{'knowledge':<20} {'reading':<10} pure cases recognised")
    for row in rows:
        print(f"{row['knowledge']:<20} {row['reading']:<10} {row['right']} of {row['of']}")


if __name__ == "__main__":
    main()
