"""2. Conductivity: the chapter's example, classified, with the reason for every prototype.

Evidence from three sides of something: a little for a rectangle, a square and a triangle, most of it open.
Table 1 conducts it best into the triangular class. The explanation shows which branch each prototype took
and how close the other one was, because conductivity jumps there.
"""

from evifuse.belief import Frame, MassFunction
from evifuse.conductivity import classify
from evifuse.knowledge import load_knowledge


def main() -> None:
    frame = Frame(["rectangle", "square", "triangle", "ellipse", "circle", "bracket"])
    evidence = MassFunction.of(frame, {"rectangle": 0.19, "square": 0.10, "triangle": 0.20, frame: 0.51})

    found = classify(evidence, load_knowledge("chapter-shape"))
    print("decision:    ", found.decision)
    print("conductivity:", {k: round(v, 2) for k, v in found.conductivity.items()})
    for e in found.explain():
        print(
            f"  {e.label}/{e.prototype}: {e.branch}, interaction {e.interaction_dimension:.2f}, "
            f"aggregate {e.aggregate_dimension:.2f}, margin {e.margin:.2f} -> {e.conductivity:.2f}"
        )


if __name__ == "__main__":
    main()
