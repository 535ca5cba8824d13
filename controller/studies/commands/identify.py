"""``snakewalk robot identify``: a servo's constants from recordings, friction from runs."""

from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.config.key_types import SEED, Seed
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force, Json, Robot, Workers, World
from snakewalk.controller.studies.commands.identify_friction import (
    FrictionFiles,
    identify_friction,
)
from snakewalk.controller.studies.commands.identify_servo import (
    FitOptions,
    identify_servo,
    robot_file,
)


@command(
    "robot identify",
    examples=(
        "robot identify kp200.json kp800.json -o xl330.json",
        "robot identify kp200.json kp800.json --robot xl330-16 --robot-out mine.toml",
        "robot identify kp400.json kp800.json --backlash --robot xl330-16 --robot-out mine.toml",
        "robot identify kp400.json --start xl330.json --no-fit --json",
        "robot identify runs/flat-slalom-walk-seed0/log.mcap -o found.toml",
        "robot identify runs/NAME/log.mcap -o found.toml --robot-out mine.toml",
    ),
)
def identify(
    logs: Annotated[
        list[Path],
        typer.Argument(
            help="recordings of one servo with a pendulum (BAM's raw JSON), or logs of one "
            "robot's runs (.mcap)"
        ),
    ],
    judge: Annotated[
        list[Path] | None, typer.Option(help="recording used only for judging; may be repeated")
    ] = None,
    start: Annotated[
        Path | None, typer.Option(help="constants to begin with, as BAM writes them")
    ] = None,
    fit: Annotated[
        bool, typer.Option("--fit/--no-fit", help="fit, or only judge the constants of --start")
    ] = True,
    seed: Seed = SEED,
    backlash: Annotated[
        bool, typer.Option("--backlash", help="estimate the backlash of the gears, too")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            help="write constants as BAM's JSON, or friction as a world's TOML",
        ),
    ] = None,
    world: World = None,
    robot: Robot = None,
    robot_out: Annotated[
        Path | None,
        typer.Option(
            help="write the robot with the results: --robot with a servo's constants, or the "
            "robot of a run's log with its mass"
        ),
    ] = None,
    workers: Workers = 2,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Find a servo's constants from its pendulum, or friction and mass from logs of runs.

    Recordings of a servo give resistance, torque constant, friction, inertia and P unit. Logs
    of runs give the friction along and across the body, and its law, on the ground --world
    (default: that of the logs). With --robot-out, gaits that lift also give the mass. All results
    have 95 % intervals.
    """
    judge = judge or []
    of_runs = [path for path in (*logs, *judge) if (".mcap" in path.suffixes)]
    if of_runs:
        if len(of_runs) < len(logs) + len(judge):
            raise InputError(
                "logs of runs (.mcap) and recordings of a pendulum cannot be combined; give "
                "one kind"
            )
        if start is not None or not fit or backlash:
            raise InputError(
                "--start, --no-fit and --backlash: are for pendulums; for the log of a run use "
                "--world"
            )
        if robot is not None:
            raise InputError(
                "--robot is whose servo swings a pendulum; the robot of a run is in its log (.mcap)"
            )
        files = FrictionFiles(out, robot_out)
        identify_friction(logs, judge, world, files, force=force, workers=workers, as_json=as_json)
        return
    if world is not None:
        raise InputError("--world is the ground of a run's log (.mcap); a pendulum has none")
    robot_to_write = robot_file(robot, robot_out)
    if backlash and not fit:
        raise InputError("--backlash: needs a fit; remove --no-fit")
    search = FitOptions(start, seed, fit=fit, backlash=backlash)
    identify_servo(logs, judge, search, out, robot_to_write, force=force, as_json=as_json)
