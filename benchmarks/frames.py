"""Frames of a snake on the ground: walk, angles, points, and the points laid on 10,000 vertices.

The paper's own implementation took 65 s for 250 frames on such a world ([PT] 3). The library of
shapes is made once for a recording and is not part of it; nor are imports.
"""

import numpy as np

from benchmarks.rows import Row, cpu_s
from snakewalk.config.heightfield import HeightField
from snakewalk.controller.app.runs.factory import prepare_walk
from snakewalk.controller.mechanics.ground_step import GroundStep
from snakewalk.controller.mechanics.speed_law import SpeedLaw
from snakewalk.controller.walk.shape_filters import passes_all
from snakewalk.controller.walk.synthesis import synthesise
from snakewalk.controller.walk.walker import Walker

TITLE = "Synthesis of 250 frames, 100 points, a world of 10,000 vertices"

FRAMES = 250
DT_S = 0.04
PAPER_S = 65.0
WANTED_S = 0.1


def world() -> HeightField:
    """100 x 100 vertices, 10 m square, hills of 0.2 m."""
    x = np.linspace(0.0, 10.0, 100)
    z = 0.1 * np.sin(1.3 * x)[None, :] + 0.1 * np.cos(1.1 * x)[:, None]
    return HeightField(z, 10.0 / 99.0, -5.0, -5.0)


def run() -> list[Row]:
    """Measure."""
    prepared = prepare_walk("flat-square")
    shapes = prepared.library.shapes_rad
    segment_m = prepared.robot.length_m / shapes.shape[1]
    law = SpeedLaw.printed(0.1)
    ground = GroundStep(world())

    def synthesis() -> object:
        walker = Walker(shapes, prepared.run.walk, passes_all(prepared.shape_filters))
        plan = synthesise(
            walker.track, law, FRAMES, DT_S, segment_m, grow=lambda _: walker.decide(0.0, 0.0)
        )
        return ground.place(plan.angles_rad, plan.points_m[:, -1], segment_m, 0.03)

    spent_s = cpu_s(synthesis, 3)
    return [
        Row("walk, angles, points, ground", spent_s * 1e3, "ms", "0.1 s", spent_s / WANTED_S, 1.0),
        Row("the same", spent_s * 1e3, "ms", "the paper's 65 s", spent_s / PAPER_S),
    ]
