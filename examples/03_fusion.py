"""3. Fusion: a simulated saddle, seen and felt.

Vision sees a rectangular outline and leans to a flat surface; the finger feels curvature of both signs. The
sum decides, and the trace says why. Replace the scene with your own picture and recording:
`fuse("photo.jpg", "finger.mcap")`.
"""

from evifuse import fuse, simulate


def main() -> None:
    made = simulate("saddle", seed=1)
    result = fuse(made.scene)
    print("truth:     ", made.truth.category)
    print("from shape:", {k: round(v, 2) for k, v in result.from_shape.items()})
    print("from touch:", {k: round(v, 2) for k, v in result.from_touch.items()})
    print("belief:    ", result.belief.as_dict(2))
    print("decision:  ", result.decision)
    if result.touch is not None:
        for site in result.touch.sites:
            print(f"  k1 {site.k1_per_m:.2f}, k2 {site.k2_per_m:.2f} 1/m")


if __name__ == "__main__":
    main()
