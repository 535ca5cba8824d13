"""Measure how near a fish passes random control points: ``python -m tests.helpers.fish_points``."""

import numpy as np

from snakewalk.controller.animals.fish.fish_film import swim
from snakewalk.controller.animals.fish.fish_synthesis import synthesise_motion
from snakewalk.controller.animals.fish.synthesis_options import SynthesisOptions

SETS = 20


def points(dimensions: int, seed: int) -> list[tuple[float, ...]]:
    """Draw four control points, each 2 to 4 body lengths from the one before."""
    rng = np.random.default_rng(seed)
    found, place, heading = [], np.zeros(dimensions), 0.0
    for _ in range(4):
        heading += rng.uniform(-1.2, 1.2)
        far = rng.uniform(2.0, 4.0)
        step = [far * np.cos(heading), far * np.sin(heading), rng.uniform(-0.5, 0.5)]
        place = place + np.array(step[:dimensions])
        found.append(tuple(place.tolist()))
    return found


def main() -> None:
    """Print a row for points in the plane and one for points in space."""
    truth = swim()
    for dimensions in (2, 3):
        rows = []
        for seed in range(SETS):
            options = SynthesisOptions(through=tuple(points(dimensions, seed)), mirror=True)
            motion = synthesise_motion(truth, options).motion
            place = np.column_stack([motion.base, motion.height])[:, :dimensions]
            off = [np.linalg.norm(place - np.array(p), axis=1).min() for p in options.through]
            rows.append(max(off))
        print(f"{dimensions} coordinates: largest distance {max(rows):.3f} body lengths")


if __name__ == "__main__":
    main()
