"""7. An edge detector of your own: OpenCV's line segments in place of EdgeDrawing.

A detector takes a grey picture and gives chains of edge points in order, about one pixel apart. OpenCV's line
segment detector (Grompone von Gioi et al., 2010) gives straight segments, all with the dark on the same side:
where one ends near another's start, they are of one chain.
"""

from itertools import pairwise

import cv2
import numpy as np

from evifuse.vision import sense_shapes

REACH_PX = 12.0


def segments_as_chains(grey):
    found = cv2.createLineSegmentDetector().detect(grey)[0]
    left = [] if found is None else list(found.reshape(-1, 2, 2).astype(np.float64))
    chains = []
    while left:
        path = list(left.pop())
        while left:
            apart = [np.linalg.norm(start - path[-1]) for start, _ in left]
            if min(apart) > REACH_PX:
                break
            path += list(left.pop(int(np.argmin(apart))))
        counts = [max(2, round(float(np.linalg.norm(b - a)))) for a, b in pairwise(path)]
        lines = [
            np.linspace(a, b, n, endpoint=False) for (a, b), n in zip(pairwise(path), counts, strict=True)
        ]
        chains.append(np.concatenate([*lines, path[-1:]]))
    return tuple(chains)


def main() -> None:
    picture = np.full((240, 720), 255, np.uint8)
    cv2.rectangle(picture, (50, 60), (210, 180), 60, -1)
    cv2.circle(picture, (360, 120), 80, 60, -1, cv2.LINE_AA)
    cv2.fillPoly(picture, [np.array([[510, 190], [600, 40], [690, 190]])], 60, cv2.LINE_AA)
    for seen in sorted(sense_shapes(picture, detector=segments_as_chains), key=lambda s: s.box):
        print(seen.box, seen.classification.decision, seen.evidence.as_dict(digits=2))


if __name__ == "__main__":
    main()
