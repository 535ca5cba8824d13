"""``snakewalk synthesise``: a motion without a robot."""

from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.controller.app.cli.options import (
    DEFAULT_RUN,
    Force,
    Json,
    Robot,
    RunName,
    Seed,
    TrackFile,
    World,
    show,
)
from snakewalk.controller.app.result_files import atomic_write, check_picture, refuse_to_overwrite


def synthesise(
    run: RunName = DEFAULT_RUN,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="NAME: writes NAME.npz and NAME.png; default: the run"),
    ] = None,
    robot: Robot = None,
    world: World = None,
    track: TrackFile = None,
    seed: Seed = None,
    motion: Annotated[
        str | None, typer.Option(help="walk, or walk-printed: aimed as the paper prints it")
    ] = None,
    frames: Annotated[
        int | None, typer.Option(min=2, help="exactly so many; default: to the last waypoint")
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Make a snake's motion over a world: plan, states, walk, speed, skeleton, ground ([PT])."""
    from snakewalk.controller.app.recordings.snake_synthesis import SnakeSynthesis  # noqa: PLC0415  heavy
    from snakewalk.controller.app.report.plots.snake_synthesis import draw_walk  # noqa: PLC0415
    from snakewalk.controller.app.runs.factory import prepare_walk  # noqa: PLC0415

    if motion not in {None, "walk", "walk-printed"}:
        raise InputError(f"--motion {motion}: walk or walk-printed")
    prepared = prepare_walk(run, seed=seed, motion=motion, robot=robot, world=world, track=track)
    name = Path(prepared.run.name) if output is None else output
    recording, picture = (name.with_name(f"{name.name}{end}") for end in (".npz", ".png"))
    refuse_to_overwrite([recording, picture], force)
    check_picture(picture)
    made = SnakeSynthesis(prepared).synthesise(frames)
    with atomic_write(recording) as part:
        made.save(part, name.name, f"snakewalk synthesise of {prepared.run.track}")
    draw_walk(made, prepared.ground, picture, f"{prepared.run.name}: {prepared.world.name}")
    show(made.facts() | {"track": str(recording), "picture": str(picture)}, as_json)
    if frames is None and not made.complete:
        raise SystemExit(1)
