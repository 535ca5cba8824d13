"""``snakewalk plan``: a run on paper."""

import math
from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.controller.console.options import (
    DEFAULT_RUN,
    Force,
    Json,
    Motion,
    Robot,
    RunName,
    Seed,
    Set,
    TrackFile,
    World,
    console,
    key_values,
    show,
)
from snakewalk.controller.console.result_files import refuse_to_overwrite


def plan(
    run: RunName = DEFAULT_RUN,
    robot: Robot = None,
    world: World = None,
    track: TrackFile = None,
    seed: Seed = None,
    motion: Motion = None,
    set_: Set = None,
    with_: Annotated[
        str | None, typer.Option("--with", help="repertoire: search over recorded actions")
    ] = None,
    repertoire: Annotated[
        Path | None, typer.Option(help="file of actions; default: repertoire-ROBOT-WORLD.npz")
    ] = None,
    beam: Annotated[
        int | None,
        typer.Option(min=1, max=100_000, help="sequences kept a round; default: 400"),
    ] = None,
    physics: Annotated[
        int, typer.Option(min=0, help="candidates to run on the physics, for the ratio")
    ] = 0,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="write the sequence, as JSON")
    ] = None,
    carry: Annotated[bool, typer.Option("--run", help="run it in the simulator")] = False,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Judge a run on paper: library, path and joint limits, with no servo and no simulator."""
    if with_ not in {None, "repertoire"}:
        raise InputError(f"--with {with_}: no such planner; there is: repertoire")
    if with_ is not None:
        if motion is not None or track is not None or seed is not None or set_:
            raise InputError("--with repertoire: takes no --motion, --track, --seed or --set")
        _plan_with_repertoire(
            run, repertoire=repertoire, robot=robot, world=world, beam=beam or 400, physics=physics,
            out=out, carry=carry, force=force, as_json=as_json,
        )  # fmt: skip
        return
    if repertoire is not None or beam is not None or out is not None or carry or physics:
        raise InputError(
            "--repertoire, --beam, --out, --run and --physics belong to --with repertoire"
        )
    from snakewalk.controller.run.factory import prepare_walk  # noqa: PLC0415  heavy; --help stays quick
    from snakewalk.controller.terrain.summary import path_relief, path_warnings  # noqa: PLC0415

    prepared = prepare_walk(
        run, keys=key_values("--set", set_), seed=seed, motion=motion, robot=robot, world=world,
        track=track,
    )  # fmt: skip
    ahead = prepared.forecast()
    found: dict[str, object] = {
        "run": prepared.run.name,
        "robot": prepared.robot.name,
        "world": prepared.world.name,
        "motion": prepared.run.motion,
        "seed": prepared.run.seed,
        "waypoints": len(prepared.run.waypoints_m),
        "waypoints_reached": ahead.reached,
        "passed_by": ahead.missed,
        "path_m": round(prepared.path.length_m, 3),
        "duration_s": round(ahead.duration_s, 2),
        "joint_reach_rad": round(float(abs(ahead.joint_rad).max()), 3),
        "joint_speed_rad_s": round(float(ahead.joint_speed_rad_s.max()), 3),
        "joint_acceleration_rad_s2": round(float(ahead.joint_acceleration_rad_s2.max()), 2),
        "joint_torque_n_m": round(float(ahead.joint_torque_n_m.max()), 3),
        "predicted_gain": round(prepared.gain, 3),
    }
    if ahead.slide is not None:
        found["steeper_than_held"] = (
            f"{math.degrees(ahead.slide.slope_rad):.1f} deg of "
            f"{math.degrees(ahead.slide.held_rad):.1f}, for {ahead.slide.lasted_s:.2f} s"
        )
    if prepared.run.motion != "serpenoid":
        found["states"] = prepared.library.counts
    warnings = prepared.warnings
    if prepared.ground_ahead is not None:
        relief = path_relief(prepared.planner, prepared.path)
        found["slope_median_deg"] = _deg(relief.median_slope_rad)
        found["slope_max_deg"] = _deg(relief.max_slope_rad)
        found["world_slope_median_deg"] = _deg(relief.world_median_slope_rad)
        found["under_body_slope_median_deg"] = _deg(relief.median_footprint_slope_rad)
        found["under_body_slope_max_deg"] = _deg(relief.max_footprint_slope_rad)
        found["up_slope_max_deg"] = _deg(relief.max_up_slope_rad)
        found["side_slope_max_deg"] = _deg(relief.max_side_slope_rad)
        found["climb_m"] = round(relief.climb_m, 3)
        found["safe_nodes"] = f"{relief.safe_node_share:.0%}"
        warnings += path_warnings(prepared.planner, relief, prepared.run.waypoints_m)
    if as_json:
        found["warnings"] = warnings
    show(found, as_json)
    for line in () if as_json else warnings:
        console.print(f"warning: {line}")


def _deg(angle_rad: float) -> float:
    return round(math.degrees(angle_rad), 1)


def _plan_with_repertoire(
    run: str,
    *,
    repertoire: Path | None,
    robot: str | None,
    world: str | None,
    beam: int,
    physics: int,
    out: Path | None,
    carry: bool,
    force: bool,
    as_json: bool,
) -> None:
    """Search, show, and where asked save, time on the physics, and run."""
    from snakewalk.controller.console.progress import ProgressBar  # noqa: PLC0415
    from snakewalk.controller.repertoire.commands.repertoire import carry_out  # noqa: PLC0415
    from snakewalk.controller.repertoire.repertoire_planning import (  # noqa: PLC0415  heavy; --help stays quick
        plan_facts,
        plan_route,
        save_plan,
        search_cost,
    )

    refuse_to_overwrite([out], force)
    if physics or carry:
        require_extra("candidates and runs on the physics need", "mujoco")
    job = plan_route(run, repertoire, robot=robot, world=world, beam=beam)
    found = plan_facts(job)
    if not as_json:
        found["actions"] = ", ".join(job.action_names)
    if physics:
        with ProgressBar("candidates on the physics", physics) as bar:
            cost = search_cost(job, physics, beam=beam, on_progress=bar.update)
        found |= cost.to_dict()
    if out is not None:
        save_plan(job, out)
        found["plan"] = str(out)
    complete = True
    if carry:
        found["ran"], complete = carry_out(job, None, None, False, None, force)
    show(found, as_json)
    if not complete:
        raise SystemExit(1)
