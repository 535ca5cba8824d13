"""Replay of recorded actions against the physics that they were recorded from ([YT] Table 1).

A frame is 1/60 s. The physics frame is all that the simulated robot needs for one: a bus cycle
(read and write), its servos, safety, and eight steps of the body. A body-frame of the replay is the
new body frame and all link centres of one body. Both in one run, on one core.
"""

import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.rows import Row, cpu_s
from benchmarks.search_cost import search_cost
from snakewalk.config.ground import build_ground
from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load_robot, load_world
from snakewalk.controller.repertoire.behaviour import Wandering
from snakewalk.controller.repertoire.crowd import Crowd
from snakewalk.controller.repertoire.crowd_film import SIZE_PX, CrowdScene, species_of
from snakewalk.controller.repertoire.habit import SIZE, Habit
from snakewalk.controller.repertoire.repertoire import Repertoire
from snakewalk.controller.repertoire.repertoire_physics import FRAME_S, PhysicsBody
from snakewalk.controller.repertoire.repertoire_planning import plan_route
from snakewalk.controller.repertoire.repertoire_recording import ACTIONS, record
from snakewalk.sim.rendering.crowd_film import CrowdShot, CrowdView

TITLE = "Repertoire: 17 links, 60 frames a second, one core"

PAPER = 4000.0
BODIES = 10_000
FRAMES = 60
TRIES = 5
CANDIDATES = 8
HILLS = "jacksboro-basin"
HERD = 2_000
"""Bodies on the hills, whose share in view is that of the film."""
DRAWN = 100
SHOTS = 20


def run() -> list[Row]:
    """Measure."""
    robot, world = load_robot("yaw16"), load_world("flat")
    repertoire = record(robot, world)
    physics_s = physics_frame_s(repertoire)
    seen_s, hidden_s = (crowd_second_s(repertoire, visible) for visible in (True, False))
    frame_s = seen_s / (BODIES * FRAMES)
    fits = physics_s / frame_s
    herd_s = herd_frame_s(repertoire)
    plain_s, detailed_s, plain_ground_s, ground_s = drawing_s(repertoire)
    with TemporaryDirectory() as folder:
        file = Path(folder) / "repertoire.npz"
        repertoire.save(file)
        cost = search_cost(plan_route("flat-slalom", file), CANDIDATES)
    return [
        Row("one frame of the simulated robot", physics_s * 1e6, "us"),
        Row("one body-frame of the replay", frame_s * 1e9, "ns"),
        Row("4,000 body-frames", PAPER * frame_s * 1e6, "us", "a physics frame", PAPER / fits, 1.0),
        Row("body-frames in a physics frame", fits, ""),
        Row("a second of 10,000 bodies, seen", seen_s * 1e3, "ms", "1 s", seen_s, 1.0),
        Row("the same, none in view", hidden_s * 1e3, "ms", "1 s", hidden_s),
        Row("on hills, behaviour and culling: a body-frame", herd_s * 1e6, "us"),
        Row("bodies at 60 frames a second there", FRAME_S / herd_s, "", "100", 6e3 * herd_s),
        Row("drawing 100 bodies on hills, all in full", plain_s * 1e3, "ms"),
        Row("the same with levels of detail and culling", detailed_s * 1e3, "ms"),
        Row("the ground alone, in full", plain_ground_s * 1e3, "ms"),
        Row("the ground alone, by distance", ground_s * 1e3, "ms"),
        Row("search: a candidate", cost.candidate_s * 1e6, "us"),
        Row("a candidate run on the physics", cost.physics_candidate_s * 1e3, "ms"),
        Row(
            "4,000 candidates of the search", PAPER * cost.candidate_s * 1e3, "ms",
            "one on the physics", PAPER / cost.ratio, 1.0,
        ),
        Row("candidates in one on the physics", cost.ratio, ""),
        Row("the whole search", cost.candidates * cost.candidate_s * 1e3, "ms"),
        Row("the same on the physics, extrapolated", cost.physics_search_s, "s"),
    ]  # fmt: skip


def physics_frame_s(repertoire: Repertoire) -> float:
    """CPU time of a frame of the simulated robot, least mean of ``TRIES`` cycles."""
    segment = repertoire.segments[[action.name for action in ACTIONS].index("forward-fast")]
    robot, world = load_robot(repertoire.robot), load_world(repertoire.world)
    best = float("inf")
    with PhysicsBody(robot, world, segment.goal_rad[0]) as body:
        for _ in range(TRIES):
            begun = time.process_time()
            for goal in segment.goal_rad:
                body.frame(goal)
            best = min(best, (time.process_time() - begun) / segment.frames)
    return best


def herd_frame_s(repertoire: Repertoire) -> float:
    """CPU time of a body-frame of a herd on hills before a camera, bodies laid on the ground."""
    ground = build_ground(load_world(HILLS))
    assert ground is not None, "a world with hills"
    scene = scene_of(repertoire, ground, HERD, separate=False)
    best = float("inf")
    for _ in range(TRIES):
        scene.costs.motion_s = scene.costs.laying_s = 0.0
        for _ in scene.shots(SHOTS, 1):
            pass
        best = min(best, (scene.costs.motion_s + scene.costs.laying_s) / (SHOTS * HERD))
    return best


def scene_of(
    repertoire: Repertoire,
    ground: HeightField,
    bodies: int,
    *,
    detail: bool = True,
    separate: bool = True,
) -> CrowdScene:
    """Return a herd that wanders on a ground."""
    robot = load_robot(repertoire.robot)
    herd = species_of(repertoire, robot, bodies, SIZE, Habit.WANDER, 0)
    return CrowdScene(Wandering([herd], ground, separate=separate), ground, detail=detail)


def drawing_s(repertoire: Repertoire) -> tuple[float, float, float, float]:
    """CPU time of a frame: ``DRAWN`` bodies and ground in full and by distance, ground alone."""
    world, robot = load_world(HILLS), load_robot(repertoire.robot)
    ground = build_ground(world)
    assert ground is not None, "a world with hills"
    views = [
        CrowdView(robot, world, ground, DRAWN, SIZE_PX, tiled=tiled) for tiled in (False, True)
    ]
    shots = [
        list(scene_of(repertoire, ground, DRAWN, detail=detail).shots(SHOTS, 3))
        for detail in (False, True)
    ]
    shots += [[replace(shot, bodies=[]) for shot in shots[1]]] * 2

    def draw(view: CrowdView, shots: list[CrowdShot]) -> None:
        for shot in shots:
            view.draw(shot)

    try:
        one, two, three, four = (
            cpu_s(partial(draw, view, each), 1, TRIES) / SHOTS
            for view, each in zip([*views, *views], shots, strict=True)
        )
        return one, two, three, four
    finally:
        for view in views:
            view.close()


def crowd_second_s(repertoire: Repertoire, visible: bool) -> float:
    """CPU time in which ``BODIES`` bodies go on by a second; they change actions meanwhile."""
    crowd = Crowd(repertoire, BODIES)
    crowd.visible[:] = visible
    crowd.stagger()
    random = np.random.default_rng(0)

    def second() -> None:
        crowd.segment[:] = random.integers(len(repertoire.segments), size=BODIES)
        crowd.step(round(1.0 / FRAME_S))

    return cpu_s(second, 1, TRIES)
