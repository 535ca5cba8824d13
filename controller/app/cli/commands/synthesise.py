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
    Set,
    TrackFile,
    World,
    key_values,
    show,
)
from snakewalk.controller.app.result_files import atomic_write, check_picture, refuse_to_overwrite

_SYNTHESISED = ("walk", "walk-printed", "kp")


def synthesise(
    run: RunName = DEFAULT_RUN,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", help="NAME: writes NAME.npz, NAME.png, ...; default: the run"
        ),
    ] = None,
    robot: Robot = None,
    world: World = None,
    track: TrackFile = None,
    seed: Seed = None,
    motion: Annotated[
        str | None,
        typer.Option(
            help="walk; walk-printed: aimed as [PT] prints it; kp: the older state graph of [KP]"
        ),
    ] = None,
    set_: Set = None,
    frames: Annotated[
        int | None, typer.Option(min=2, help="exactly so many; default: to the last waypoint")
    ] = None,
    film: Annotated[bool, typer.Option("--film", help="NAME.mp4: the skin on the ground")] = False,
    glb: Annotated[bool, typer.Option("--glb", help="NAME.glb: the skin as animated glTF")] = False,
    look: Annotated[
        str, typer.Option(help="of both: animal, or a BODY as of `snakewalk body`")
    ] = "animal",
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Make a snake's motion over a world: plan, states, walk, speed, skeleton, ground ([PT])."""
    from snakewalk.controller.app.recordings.snake_synthesis import SnakeSynthesis  # noqa: PLC0415  heavy
    from snakewalk.controller.app.report.plots.snake_synthesis import draw_walk  # noqa: PLC0415
    from snakewalk.controller.app.runs.factory import prepare_walk  # noqa: PLC0415

    prepared = prepare_walk(
        run, keys=key_values("--set", set_), on_paper=True, seed=seed, motion=motion, robot=robot,
        world=world, track=track,
    )  # fmt: skip
    if prepared.run.motion not in _SYNTHESISED:
        raise InputError(f"--motion {prepared.run.motion}: {', '.join(_SYNTHESISED)}")
    name = Path(prepared.run.name) if output is None else output
    recording, picture, moving, solid = (
        name.with_name(f"{name.name}{end}") for end in (".npz", ".png", ".mp4", ".glb")
    )
    more = [file for file, wanted in ((moving, film), (solid, glb)) if wanted]
    refuse_to_overwrite([recording, picture, *more], force)
    check_picture(picture)
    worn = None
    if more:
        from snakewalk.controller.app.recordings.synthesis_skin import SynthesisSkin  # noqa: PLC0415

        worn = SynthesisSkin.of(look, prepared.run.track, prepared.robot)
    elif look != "animal":
        raise InputError(f"--look {look}: is for --film and --glb")
    made = SnakeSynthesis(prepared).synthesise(frames)
    with atomic_write(recording) as part:
        made.save(part, name.name, f"snakewalk synthesise of {prepared.run.track}")
    draw_walk(made, prepared.ground, picture, f"{prepared.run.name}: {prepared.world.name}")
    if worn is not None and glb:
        worn.write(made, solid)
    if worn is not None and film:
        worn.film(made, prepared, moving)
    files = {"film": str(moving) if film else None, "skin": str(solid) if glb else None}
    show(made.facts() | {"track": str(recording), "picture": str(picture)} | files, as_json)
    if frames is None and not made.complete:
        raise SystemExit(1)
