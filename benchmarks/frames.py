"""Frames of an animal on the ground: planning, walk, speed, angles, points, and the ground step.

The paper's own implementation took 65 s for 250 frames in a world of 10,000 vertices, and says that
this includes the path planning and the synthesis ([PT] 3). So does the total here: the fields and
the graph of the world, the path, and the motion. The library of shapes is made once for a recording
and has a row of its own; imports and the reading of the world are left out.

For 300 frames of an animal, in a world of as many vertices, the paper before tells 22 s: motion
synthesis, planning and motion transformation ([KP] 4.5). The same three are counted here.
"""

import numpy as np

from benchmarks.rows import Row, cpu_s
from snakewalk.config.ground import build_ground
from snakewalk.config.loader import load_robot
from snakewalk.config.run import RunConfig
from snakewalk.config.world import PlannerConfig, RandomGround, WorldConfig
from snakewalk.controller.animals.legged.animal_synthesis import (
    read_animal,
    synthesise_animal,
)
from snakewalk.controller.animals.synthesis.snake_synthesis import SnakeSynthesis
from snakewalk.controller.run.kinds.walk_run import WalkRun
from snakewalk.controller.terrain.planner import TerrainPlanner

TITLE = "Synthesis of 250 frames, 100 points, in a world of 10,000 vertices"

FRAMES = 250
PAPER_S = 65.0
ANIMAL_FRAMES = 300
ANIMAL_PAPER_S = 22.0
WANTED_S = 0.1
WORLD = WorldConfig(
    name="frames",
    ground=RandomGround(rms_slope_rad=0.08, correlation_m=1.0, size_m=9.9, spacing_m=0.1),
)
RUN = RunConfig(name="frames", start_m=(-3.5, -3.5), waypoints_m=((0.0, 3.0), (3.5, -1.0)))


def run() -> list[Row]:
    """Measure."""
    prepared = WalkRun(RUN, load_robot("yaw16"), WORLD)
    ground = build_ground(WORLD)
    assert ground is not None
    assert ground.z_m.size == 10_000
    points = np.vstack([RUN.start_m, RUN.waypoints_m])
    synthesis, goat = SnakeSynthesis(prepared), read_animal("goat")
    library_s = cpu_s(lambda: SnakeSynthesis(prepared).library, 1)

    def plan() -> object:
        return TerrainPlanner(ground, PlannerConfig()).plan(points)

    def motion() -> object:
        return synthesis.synthesise(FRAMES)

    def animal() -> object:
        return synthesise_animal(prepared, goat, ANIMAL_FRAMES)

    plan_s, motion_s, animal_s = cpu_s(plan, 2), cpu_s(motion, 2), cpu_s(animal, 2)
    total_s, legs_s = plan_s + motion_s, plan_s + animal_s
    return [
        Row("fields, graph and path", plan_s * 1e3, "ms"),
        Row("walk, speed, angles, points, ground", motion_s * 1e3, "ms"),
        Row("planning and motion", total_s * 1e3, "ms", "0.1 s", total_s / WANTED_S, 1.0),
        Row("the same", total_s * 1e3, "ms", "the paper's 65 s", total_s / PAPER_S),
        Row(
            "300 frames of a goat, planned",
            legs_s * 1e3,
            "ms",
            "the paper's 22 s",
            legs_s / ANIMAL_PAPER_S,
        ),
        Row("library of 630 states, once a recording", library_s * 1e3, "ms"),
    ]
