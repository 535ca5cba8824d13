"""``snakewalk init``: files of a run, a robot and a world to edit."""

import json
from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.document import json_schema
from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, load_run, load_world, shipped
from snakewalk.config.template import template
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force, Json, Robot, show
from snakewalk.controller.console.result_files import refuse_to_overwrite, write_result

_PREFERRED_RUNS = ("flat-square", "jacksboro-traverse")
"""Runs that come first among several possible starts."""

_RUN = """A run: what is to be done, by which robot, where.
  snakewalk plan run.toml     judges it on paper
  snakewalk run run.toml      runs it in the simulator: film, page and log; on servos with --port
A line behind # shows a key with its default; take the # away to change it."""
_ROBOT = """The robot: links, joints and servos, from the head to the tail.
  snakewalk robot show robot.toml
A line behind # shows a key with its default. IDs, signs and zeros are found out by
snakewalk bus calibrate."""
_WORLD = """The world: what the robot moves on.
A line behind # shows a key with its default. Another ground: replace the table [ground]."""


@command(
    "init",
    examples=("init mine", "init mine --robot xl330-16", "init mine --from ramp-10-up"),
)
def init(
    folder: Annotated[
        Path,
        typer.Argument(
            file_okay=False, help="folder of the files; it is created if it does not exist"
        ),
    ] = Path(),
    robot: Robot = None,
    from_: Annotated[
        str | None,
        typer.Option(
            "--from",
            help="run to copy, shipped or a TOML file",
            autocompletion=completion.RUNS,
        ),
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write run, robot and world files to edit, with schemas for editors."""
    if from_ is None:
        robot = robot or "printed12"
        names = {name: load_run(name).robot for name in (*_PREFERRED_RUNS, *shipped("runs"))}
        fitting = (name for name, body in names.items() if body == robot)
        from_ = next(fitting, _PREFERRED_RUNS[0])
    run = load_run(from_)
    run_folder = Path(from_).parent if from_.endswith(".toml") else None
    body = load_robot(run.robot if robot is None else robot, run_folder if robot is None else None)
    if body.limbs:
        raise InputError(
            f"robot {body.name}: has legs, which walk by gaits: snakewalk gait run trot --robot "
            f"{robot or run.robot}"
        )
    if run.motion in {"gait", "playback", "source", "repertoire"}:
        raise InputError(
            f"run {run.name}: a {run.motion} is not a walk; choose the run of a walk for --from"
        )
    track = Path(run.track) if run_folder is None else run_folder / run.track
    texts = {
        "run.toml": template(
            run.model_copy(
                update={
                    "name": "my-run",
                    "robot": "robot.toml",
                    "world": "world.toml",
                    "track": str(track.resolve()) if track.is_file() else run.track,
                }
            ),
            _RUN,
            without={"gait", "playback", "repertoire"},
        ),
        "robot.toml": template(body.model_copy(update={"name": "my-robot"}), _ROBOT),
        "world.toml": template(
            load_world(run.world, run_folder).model_copy(update={"name": "my-world"}), _WORLD
        ),
    }
    schemas = {f"schema/{kind}.json": json_schema(kind) for kind in ("run", "robot", "world")}
    try:
        (folder / "schema").mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made: {error.strerror}") from None
    refuse_to_overwrite([folder / name for name in (*texts, *schemas)], force)
    for name, text in texts.items():
        write_result(folder / name, f"#:schema schema/{name[:-5]}.json\n{text}")
    for name, described in schemas.items():
        write_result(folder / name, json.dumps(described, indent=1) + "\n")
    show(
        {
            "files": [str(folder / name) for name in (*texts, *schemas)],
            "like": f"{run.name}: {body.name} on {run.world}",
            "next": f"snakewalk plan {folder / 'run.toml'}",
        },
        as_json,
    )
