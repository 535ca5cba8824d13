"""Twelve tasks on which controllers are compared, and the result of one of them.

A task is a world with its friction, a robot with its servos, and waypoints or a distance. The score
is the share that the simulated body truly reached.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, load_run, load_world, shipped
from snakewalk.config.pose import TrackerConfig
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.console.plugins import find
from snakewalk.controller.console.rounding import significant
from snakewalk.controller.rehearsal.judgement import true_arrivals
from snakewalk.controller.rehearsal.rehearsal import RehearsalCase, rehearse
from snakewalk.controller.run.factory import prepare_job, prepare_policy, prepare_source
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.prepared_run import PreparedRun
from snakewalk.controller.run.request import RunRequest, RunResult
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.record import RunRecord

CONTROLLERS = ("walk", "serpenoid", "gait", "cpg", "wave-cma", "wave-ppo")
"""Controllers of the tasks: the walk; the serpenoid with line of sight; a gait, without steering or
along waypoints where the run says so; the same by the pattern generator; the shipped policies."""
OPEN_LOOP = ("gait", "cpg")
START_SD_M = 0.02
"""Standard deviation of the robot's place before a task with waypoints (ours)."""
TRACKER = TrackerConfig(noise_m=0.01, noise_deg=3.0, delay_s=0.1)
"""Pose noise (1 s.d.) and delay in the rehearsal."""
_LENGTH_S = 0.5
"""Time at each end of a run over which a place is averaged (ours)."""


@dataclass(frozen=True, slots=True)
class ControllerTask:
    """One task: the waypoints of a run, or a distance in a world."""

    name: str
    run: str | None
    """Run with the waypoints."""
    gait: str
    """Gait, or set of its parameters, of controllers that do not steer."""
    seconds: float
    """Longest duration."""
    world: str | None = None
    """World of a task without waypoints."""
    robot: str = "yaw16"
    axis: str = "x"
    """Direction of the distance: x along the start's heading, z up."""
    distance_m: float = 1.0
    is_rehearsed: bool = False
    """Whether the controller meets the served robot with errors, and a noisy pose."""

    def parts(self) -> tuple[RunConfig | None, RobotConfig, WorldConfig]:
        """Run, robot and world of the task."""
        if self.run is None:
            return None, load_robot(self.robot), load_world(str(self.world))
        run = load_run(self.run)
        return run, load_robot(run.robot), load_world(run.world)


TASKS = (
    ControllerTask("slalom", "flat-slalom", "lateral-undulation", 90.0),
    ControllerTask("ramp-along", "ramp-10-along", "lateral-undulation", 90.0),
    ControllerTask("ramp-up", "ramp-15-up", "lateral-undulation", 90.0),
    ControllerTask("steps", "steps-4cm", "lateral-undulation", 90.0),
    ControllerTask("gaps", "gaps-8cm", "lateral-undulation", 90.0),
    ControllerTask("random-ground", "random-20", "lateral-undulation", 90.0),
    ControllerTask("pegs", None, "pegs-undulation", 30.0, world="pegs", distance_m=5.0),
    ControllerTask("pole", None, "helix-pole", 20.0, "pole", "alternating16", "z", 2.0),
    ControllerTask("pipe", None, "helix-pipe", 20.0, "pipe", "alternating16", "z", 2.0),
    ControllerTask("swimming", None, "anguilliform", 20.0, world="pool", distance_m=8.0),
    ControllerTask("water-to-land", "water-to-land", "subcarangiform", 60.0),
    ControllerTask("rehearsal", "flat-slalom", "lateral-undulation", 90.0, is_rehearsed=True),
)


@dataclass(frozen=True, slots=True)
class TaskRun:
    """One run of a controller on a task."""

    task: str
    controller: str
    seed: int


@dataclass(frozen=True, slots=True)
class TaskResult:
    """Result of a run; None: not known. The fields are columns of the table."""

    task: str
    controller: str
    seed: int
    share: float | None = None
    """Waypoints that the body truly came to, or distance over the task's, 0 to 1."""
    duration_s: float | None = None
    cost_of_transport: float | None = None
    """Electrical."""
    verdict: str = ""
    """End of the run according to its own log, or ``not applicable: ...``."""
    is_tripped: bool = False
    """Whether safety stopped the run."""


def task_named(name: str) -> ControllerTask:
    """Return a task.

    Raises:
        InputError: it does not exist.

    """
    for task in TASKS:
        if task.name == name:
            return task
    names = ", ".join(task.name for task in TASKS)
    raise InputError(f"{name}: no such task; use one of {names}")


def run_task(item: TaskRun) -> TaskResult:
    """Run a controller on a task; a controller that does not fit is a result as well."""
    task = task_named(item.task)
    about = (item.task, item.controller, item.seed)
    try:
        if task.is_rehearsed:
            return _rehearsed_task(task, item)
        prepared = _prepare(task, item.controller, item.seed)
        result = run_robot(RunRequest(prepared, stoppable=False))
    except InputError as error:
        return TaskResult(*about, verdict=f"not applicable: {error.faults[0]}")
    numbers = result.summary
    outcome = result.outcome
    return TaskResult(
        *about,
        share=significant(share(task, result), 4),
        duration_s=significant(outcome.duration_s, 4),
        cost_of_transport=significant(numbers.electrical_cost_of_transport, 4),
        verdict=result.verdict.with_cause,
        is_tripped=outcome.tripped is not None,
    )


def share(task: ControllerTask, result: RunResult) -> float:
    """Share of a task that a body truly did."""
    record = result.record
    if task.run is None:
        return min(max(_moved_distance_m(record, task.axis) / task.distance_m, 0.0), 1.0)
    run = load_run(task.run)
    way_m = record.pose.head_m[:, :2]
    reached, _ = true_arrivals(way_m, np.array(run.waypoints_m), run.waypoint_radius_m)
    return reached / len(run.waypoints_m)


def _moved_distance_m(record: RunRecord, axis: str) -> float:
    centre_m = record.pose.centre_m
    time_s = record.pose.time_s
    ends: list[Floats] = [
        centre_m[time_s <= time_s[0] + _LENGTH_S].mean(axis=0),
        centre_m[time_s >= time_s[-1] - _LENGTH_S].mean(axis=0),
    ]
    return float((ends[1] - ends[0])["xyz".index(axis)])


def _prepare(task: ControllerTask, controller: str, seed: int) -> PreparedRun:
    """Prepare a run of a built-in controller, a policy, or a plug-in's motion.

    Raises:
        InputError: the controller does not fit the task.

    """
    keys: dict[str, object] = {}
    run = None if task.run is None else load_run(task.run)
    if run is not None:
        moved = np.array(run.start_m) + START_SD_M * np.random.default_rng(seed).normal(size=2)
        keys["run.start_m"] = [float(value) for value in moved]
    place: dict[str, Any] = {"robot": task.robot, "world": task.world}
    if run is not None:
        place = {"robot": run.robot, "world": run.world}
    if controller in OPEN_LOOP and not (run is not None and run.motion == controller):
        return prepare_gait(
            task.gait,
            **place,
            seconds=task.seconds,
            seed=seed,
            keys=keys | {"run.gait.by": "cpg" if controller == "cpg" else "blend"},
        )
    if _is_policy(controller):
        return prepare_policy(controller, **place, seconds=task.seconds, seed=seed, keys=keys)
    if task.run is None:
        source_plugin = find("motion", controller)
        if source_plugin is None:
            raise InputError(f"{controller} goes to waypoints, and the task {task.name} has none")
        return prepare_source(
            source_plugin.load(), **place, seconds=task.seconds, seed=seed, keys=keys
        )
    keys["run.time_limit_s"] = task.seconds
    return prepare_job(task.run, motion=controller, seed=seed, keys=keys)


def _is_policy(controller: str) -> bool:
    return controller in shipped("policies") or controller.endswith(".toml")


def _rehearsed_task(task: ControllerTask, item: TaskRun) -> TaskResult:
    if item.controller in OPEN_LOOP or _is_policy(item.controller):
        raise InputError(f"{item.controller} does not use a pose, and the rehearsal is about it")
    case = RehearsalCase(str(task.run), item.seed, has_errors=True, tracker=TRACKER)
    changes = {"motion": item.controller, "time_limit_s": task.seconds}
    facts = rehearse(case, changes)
    if "error" in facts:
        raise InputError(str(facts["error"]))
    count = len(load_run(str(task.run)).waypoints_m)
    return TaskResult(
        item.task,
        item.controller,
        item.seed,
        share=significant(facts["truly_reached"] / count, 4),
        duration_s=significant(facts["duration_s"], 4),
        verdict=facts["verdict"],
        is_tripped=facts["tripped"] is not None,
    )
