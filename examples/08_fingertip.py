"""8. A fingertip of your own, with taxels that are dead: laid out, made sick, examined and used all the same.

The layout is an ellipsoid, of which only the places of the taxels are known; the recording is that of a
spherical fingertip that rolls over a cylinder of 20 mm.
"""

import json
import tempfile
from pathlib import Path

import numpy as np

from evifuse.simulation import simulate
from evifuse.simulation.defects import Defects, with_defects
from evifuse.touch import health, load_fingertip, sense_curvature, surface_of


def own_layout():
    directions = load_fingertip("sphere:1.0:0.15").normals
    places = directions * [8.0, 12.0, 10.0]
    file = Path(tempfile.mkdtemp()) / "tip.json"
    file.write_text(json.dumps({"positions_mm": places.tolist()}))
    return load_fingertip(file)


def main() -> None:
    tip = own_layout()
    surface = surface_of(tip)
    pole, normal = surface.project(np.array([[0.0, 0.0, -0.010]]))
    curvatures = np.linalg.eigvalsh(surface.shape_operators(pole)[0][0])
    print(f"{len(tip.positions_m)} taxels, normal at the pole {normal[0].round(2) + 0.0}")
    print(f"radii there {1e3 / curvatures[1]:.1f} and {1e3 / curvatures[0]:.1f} mm")

    touch = simulate("cylinder", radius_m=0.020, picture=False).scene.touch
    sick = with_defects(touch, Defects(dead=0.1, drifting=0.3, drift_pa_per_s=2000.0, seed=1))
    for line in health(sick).lines():
        print(line)
    shape = sense_curvature(sick).sites[0].shape
    print(f"felt all the same: k2 = {shape.k2_per_m:.0f} +- {shape.k2_error_per_m:.1f} 1/m, true is -50")


if __name__ == "__main__":
    main()
