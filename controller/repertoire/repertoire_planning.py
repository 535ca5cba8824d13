"""Plans from a run and a repertoire, and their files."""

import json
from pathlib import Path

import numpy as np

from snakewalk.config.archive import MOST_JSON_BYTES, parse_json, read_bytes
from snakewalk.config.errors import InputError
from snakewalk.config.loader import checked, load_robot, load_run, load_world
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.console.result_files import write_result
from snakewalk.controller.repertoire.repertoire import load_repertoire
from snakewalk.controller.repertoire.repertoire_run import (
    RepertoireRun,
    initial_frame,
    pose_of_action,
)
from snakewalk.controller.repertoire.search import (
    AIM_SHARE,
    MotionPrimitives,
    Route,
    plane_pose,
    search,
)

FORMAT = "snakewalk-plan-1"


def default_file(robot: str, world: str) -> Path:
    """Name of a repertoire where none is given."""
    return Path(f"repertoire-{Path(robot).stem}-{Path(world).stem}.npz")


def plan_route(
    name: str,
    repertoire_file: Path | None = None,
    *,
    robot: str | None = None,
    world: str | None = None,
    beam: int = 400,
) -> RepertoireRun:
    """Search the quickest sequence of actions through a run's waypoints.

    ``repertoire_file`` is by default that of the run's robot and world in the working folder.

    Raises:
        InputError: no repertoire, of another robot or ground, or no sequence reaches all waypoints.

    """
    stored_run = load_run(name)
    folder = Path(name).parent if name.endswith(".toml") else None
    changes = {"robot": robot, "world": world, "motion": "repertoire"}
    fields = stored_run.model_dump() | {k: v for k, v in changes.items() if v is not None}
    run = checked(RunConfig, fields, "command line")
    body = load_robot(run.robot, folder)
    ground = load_world(run.world, folder)
    if not run.waypoints_m:
        raise InputError(f"run {run.name}: has no waypoints to plan for")
    file = repertoire_file or default_file(robot or stored_run.robot, world or stored_run.world)
    flat(ground)
    if not file.is_file():
        raise InputError(
            f"{file}: no such file; make one by: snakewalk gait repertoire record "
            f"--robot {run.robot} --world {run.world} -o {file}"
        )
    repertoire = load_repertoire(file)
    repertoire.check(body)
    if repertoire.world != ground.name:
        raise InputError(
            f"{file}: recorded on world {repertoire.world}; run {run.name} is on "
            f"{ground.name}: give --world {repertoire.world}, or record there"
        )
    primitives = MotionPrimitives(repertoire, body.length_m / repertoire.length_m)
    first = int(np.argmax([segment.speed_m_s for segment in repertoire.segments]))
    start = plane_pose(initial_frame(run, body, pose_of_action(run, body, repertoire, first)))
    route = search(primitives, start, run.waypoints_m, AIM_SHARE * run.waypoint_radius_m, beam=beam)
    if route.reached < len(run.waypoints_m):
        route = search(primitives, start, run.waypoints_m, run.waypoint_radius_m, beam=beam)
    if route.reached < len(run.waypoints_m):
        raise InputError(
            f"run {run.name}: no sequence of these actions passes waypoint {route.reached + 1} "
            f"within {run.waypoint_radius_m:g} m; a larger --beam or waypoint_radius_m may help"
        )
    return RepertoireRun(run, body, ground, repertoire, file, route)


def flat(world: WorldConfig) -> None:
    """Refuse a ground on which an action would not repeat.

    Raises:
        InputError: one line.

    """
    if world.ground.kind not in {"flat", "water"}:
        raise InputError(
            f"world {world.name}: its ground is {world.ground.kind}; an action repeats itself "
            "only on a flat one or in water"
        )


def plan_facts(job: RepertoireRun) -> dict[str, object]:
    """Numbers for a command's answer."""
    return {
        "run": job.run.name,
        "robot": job.robot.name,
        "world": job.world.name,
        "repertoire": str(job.repertoire_file),
        "waypoints": len(job.run.waypoints_m),
        "waypoints_reached": job.route.reached,
        "duration_s": round(job.route.duration_s, 2),
        "candidates": job.route.candidates,
        "actions": job.action_names,
    }


def save_plan(job: RepertoireRun, path: Path) -> None:
    """Write the plan as JSON; the repertoire stays in its own file."""
    about = {
        "format": FORMAT,
        "repertoire": str(job.repertoire_file),
        "actions": job.action_names,
        "pose": job.route.pose.round(6).tolist(),
        "reached": job.route.reached,
        "duration_s": job.route.duration_s,
        "candidates": job.route.candidates,
        "run": job.run.model_dump(mode="json"),
        "robot": job.robot.model_dump(mode="json"),
        "world": job.world.model_dump(mode="json"),
    }
    write_result(path, json.dumps(about, indent=1) + "\n")


def load_plan(path: Path, *, replan: bool = True) -> RepertoireRun:
    """Read what ``save_plan`` wrote.

    Raises:
        InputError: no such file, none of ours, or its repertoire is gone.

    """
    if not path.is_file():
        raise InputError(f"{path}: no such plan; snakewalk plan --with repertoire -o makes one")
    try:
        about = parse_json(read_bytes(path, MOST_JSON_BYTES))
        if not isinstance(about, dict):
            raise ValueError("no JSON object")
        if about["format"] != FORMAT:
            raise InputError(f"{path}: format {about['format']}; expected {FORMAT}")
        file = Path(about["repertoire"])
        repertoire = load_repertoire(file)
        actions = tuple(repertoire.index(name) for name in about["actions"])
        pose = np.array(about["pose"], dtype=float).reshape(len(actions) + 1, 3)
        route = Route(
            actions, pose, int(about["reached"]), float(about["duration_s"]), about["candidates"]
        )
        parts = about["run"], about["robot"], about["world"]
    except (KeyError, TypeError, ValueError) as error:
        why = f"{error} is missing" if isinstance(error, KeyError) else str(error)
        raise InputError(
            f"{path}: not a plan ({why}); snakewalk plan --with repertoire -o makes one"
        ) from None
    if not actions:
        raise InputError(f"{path}: a plan without actions")
    run = checked(RunConfig, parts[0], str(path))
    robot = checked(RobotConfig, parts[1], str(path))
    world = checked(WorldConfig, parts[2], str(path))
    repertoire.check(robot)
    return RepertoireRun(run, robot, world, repertoire, file, route, replan)
