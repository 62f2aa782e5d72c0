"""1. Belief functions: two doubtful witnesses, combined and discounted.

A camera thinks that the outline is a rectangle, a second one that it has four sides. Neither is sure, and
what they leave open stays open: it goes to the frame, not to the other hypotheses.
"""

from evifuse.belief import Frame, MassFunction, belief, dempster, discount, pignistic, plausibility


def main() -> None:
    frame = Frame(["rectangle", "square", "triangle"])
    first = MassFunction.of(frame, {"rectangle": 0.6, frame: 0.4})
    second = MassFunction.of(frame, {("rectangle", "square"): 0.7, frame: 0.3})

    both, conflict = dempster(first, second)
    print("combined: ", both, f"conflict {float(conflict):.2f}")
    print(
        "rectangle:",
        f"bel {float(belief(both, 'rectangle')):.2f}, pl {float(plausibility(both, 'rectangle')):.2f}",
    )
    print("bet:      ", dict(zip(frame.hypotheses, pignistic(both).round(3).tolist(), strict=True)))

    # A camera in fog: trust it half, and try again.
    print("in fog:   ", dempster(discount(first, reliability=0.5), second).mass)


if __name__ == "__main__":
    main()
