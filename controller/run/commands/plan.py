"""``snakewalk plan``: a run on paper."""

import math
from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.config.key_types import Seed
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import (
    DEFAULT_RUN,
    Force,
    Json,
    Motion,
    Robot,
    RunName,
    Set,
    TrackFile,
    World,
    console,
    key_values,
    show,
)
from snakewalk.controller.console.plugins import require
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.run.kinds.walk_run import WalkRun
from snakewalk.controller.terrain.summary import path_relief, path_warnings
from snakewalk.drivers.chain.chain_settings import missing_watchdogs
from snakewalk.drivers.safety.stop_output import StopCommand, parse_stop_output
from snakewalk.drivers.safety.trip_hold import TripHold


@command(
    "plan",
    examples=(
        "plan",
        "plan flat-slalom --motion serpenoid --json",
        "plan flat-slalom --with repertoire -o plan.json --run",
    ),
)
def plan(
    run: RunName = DEFAULT_RUN,
    robot: Robot = None,
    world: World = None,
    track: TrackFile = None,
    seed: Seed | None = None,
    motion: Motion = None,
    set_: Set = None,
    with_: Annotated[
        str | None,
        typer.Option("--with", help="planner to use; repertoire: search over recorded actions"),
    ] = None,
    repertoire: Annotated[
        Path | None,
        typer.Option(help="actions for --with repertoire; default: repertoire-ROBOT-WORLD.npz"),
    ] = None,
    beam: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=100_000,
            help="action sequences that --with repertoire keeps per round; default: 400",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", help="write the plan of --with repertoire here (JSON)"),
    ] = None,
    carry: Annotated[
        bool, typer.Option("--run", help="run the plan of --with repertoire in the simulator")
    ] = False,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Check states, path and joint limits of a run; nothing moves.

    Needs neither servos nor simulator, except for --run.
    """
    if with_ is not None:
        planner = require("planner", with_, "--with")
        if motion is not None or track is not None or seed is not None or set_:
            raise InputError(
                "--with repertoire: does not use --motion, --track, --seed or --set; leave them out"
            )
        planner.load()(
            run,
            repertoire=repertoire,
            robot=robot,
            world=world,
            beam=beam or 400,
            out=out,
            carry=carry,
            force=force,
            as_json=as_json,
        )
        return
    if repertoire is not None or beam is not None or out is not None or carry:
        raise InputError("--repertoire, --beam, --out and --run belong to --with repertoire")

    prepared = prepare_walk(
        run,
        keys=key_values("--set", set_),
        seed=seed,
        motion=motion,
        robot=robot,
        world=world,
        track=track,
    )
    facts, warnings = _facts(prepared)
    if as_json:
        facts["warnings"] = warnings
    show(facts, as_json)
    for line in () if as_json else warnings:
        console.print(f"warning: {line}")
    if facts["waypoints_reached"] != facts["waypoints"]:
        raise SystemExit(1)


def _facts(prepared: WalkRun) -> tuple[dict[str, object], list[str]]:
    path_m = prepared.path.length_m  # first, because its planner advises
    ahead = prepared.forecast()
    plan_facts: dict[str, object] = {
        "run": prepared.run.name,
        "robot": prepared.robot.name,
        "world": prepared.world.name,
        "friction_law": prepared.world.friction.law_text,
        "motion": prepared.run.motion,
        "seed": prepared.run.seed,
        "waypoints": len(prepared.run.waypoints_m),
        "waypoints_reached": ahead.reached,
        "passed_by": ahead.missed,
        "path_m": round(path_m, 3),
        "speed_of_the_wave": f"{prepared.pulse_m_s:.2f} m/s (behaviour.pulse_body_lengths_s)",
        "duration_s": round(ahead.duration_s, 2),
        "joint_reach_rad": round(float(abs(ahead.joint_rad).max()), 3),
        "joint_speed_rad_s": round(float(ahead.joint_speed_rad_s.max()), 3),
        "joint_acceleration_rad_s2": round(float(ahead.joint_acceleration_rad_s2.max()), 2),
        "joint_torque_n_m": round(float(ahead.joint_torque_n_m.max()), 3),
        "predicted_gain": round(prepared.gain, 3),
    }
    safety = prepared.run.safety
    if safety.on_trip == "hold":
        hold = TripHold.from_config(prepared.robot, safety)
        assert hold is not None
        low_a, high_a = hold.current_a.min(), hold.current_a.max()
        amps = f"{low_a:.2f} A" if low_a == high_a else f"{low_a:.2f} to {high_a:.2f} A"
        plan_facts["on_trip"] = f"hold for {safety.hold_s:g} s with at most {amps} a joint"
    if safety.stop_output is not None:
        plan_facts["stop_output"] = safety.stop_output
    if ahead.slide is not None:
        plan_facts["steeper_than_held"] = (
            f"{math.degrees(ahead.slide.slope_rad):.1f} deg of "
            f"{math.degrees(ahead.slide.holding_rad):.1f}, for {ahead.slide.lasted_s:.2f} s"
        )
    if prepared.run.motion != "serpenoid":
        plan_facts["states"] = prepared.library.counts
    missing = missing_watchdogs(prepared.robot)
    warnings = [*prepared.warnings, *prepared.climb_warnings, *missing]
    if ahead.reached < len(prepared.run.waypoints_m):
        warnings.append(
            f"{ahead.reached} of {len(prepared.run.waypoints_m)} waypoints are reached in "
            f"{ahead.duration_s:.0f} s, without rolls; raise run.time_limit_s or joint limits, or "
            "move waypoints"
        )
    if safety.stop_output is not None:
        output = parse_stop_output(safety.stop_output)
        if isinstance(output, StopCommand) and output.fault:
            warnings.append(f"{output.fault}, or plan on the computer of the robot")
    if prepared.keep_off is not None:
        plan_facts["obstacle"] = prepared.keep_off.distance_text(prepared.path)
    if prepared.ground_ahead is not None:
        facts, more = _ground_facts(prepared)
        plan_facts |= facts
        warnings += more
    return plan_facts, warnings


def _ground_facts(prepared: WalkRun) -> tuple[dict[str, object], list[str]]:
    relief = path_relief(prepared.planner, prepared.path)
    facts: dict[str, object] = {
        "slope_median_deg": _deg(relief.median_slope_rad),
        "slope_max_deg": _deg(relief.max_slope_rad),
        "world_slope_median_deg": _deg(relief.world_median_slope_rad),
        "under_body_slope_median_deg": _deg(relief.median_footprint_slope_rad),
        "under_body_slope_max_deg": _deg(relief.max_footprint_slope_rad),
        "up_slope_max_deg": _deg(relief.max_up_slope_rad),
        "side_slope_max_deg": _deg(relief.max_side_slope_rad),
        "climb_m": round(relief.climb_m, 3),
        "too_steep": [
            {
                "begin_m": round(section.begin_m, 2),
                "end_m": round(section.end_m, 2),
                "slope_deg": _deg(section.slope_rad),
            }
            for section in prepared.steep_sections
        ],
        "safe_nodes": f"{relief.safe_node_share:.0%}",
    }
    return facts, list(path_warnings(prepared.planner, relief, prepared.run.waypoints_m))


def _deg(angle_rad: float) -> float:
    return round(math.degrees(angle_rad), 1)
