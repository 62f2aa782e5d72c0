"""6. A primitive of your own: the pentagon, in thirty lines.

A primitive is a function from what was seen and fitted to proposals, one for each outline. Here it is a
polygon of five seen sides, believed as far as its sides are and its angles are those of a regular pentagon.
The knowledge base gets a class for it; everything else stays.
"""

import cv2
import numpy as np

from evifuse.knowledge import built_in_text, parse_knowledge
from evifuse.vision import PRIMITIVES, sense_shapes
from evifuse.vision.primitives import Fits, Proposals, mean_of_sides, pattern_proposals

REGULAR_RAD = np.deg2rad(108)


def propose(fits: Fits) -> Proposals:
    five = fits.polygon(5)
    regular = np.cos(five.angles - REGULAR_RAD).clip(0).prod(axis=1) ** 4
    return pattern_proposals("pentagon", five, mean_of_sides(five.sides.beliefs, least=5) * regular)


def main() -> None:
    text = built_in_text("shape").replace("  B: bracket\n", "  B: bracket\n  P: pentagon\n")
    knowledge = parse_knowledge(text + "  pentagonal:\n    P_1: {P: 0.8, frame: 0.2}\n", "with pentagons")
    picture = np.full((240, 480), 255, np.uint8)
    turns = np.deg2rad(np.arange(5) * 72 - 90)
    five = np.stack([120 + 80 * np.cos(turns), 120 + 80 * np.sin(turns)], axis=-1)
    cv2.polylines(picture, [five.round().astype(np.int32)], True, 0, 4, cv2.LINE_AA)
    cv2.circle(picture, (360, 120), 80, 0, 4, cv2.LINE_AA)
    for seen in sense_shapes(picture, knowledge, primitives={**PRIMITIVES, "pentagon": propose}):
        print(seen.classification.decision, seen.evidence.as_dict(digits=2))


if __name__ == "__main__":
    main()
