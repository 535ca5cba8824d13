"""``snakewalk synthesise``: a motion without a robot."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.controller.app.cli import completion
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

if TYPE_CHECKING:
    from snakewalk.controller.app.runs.walk_run import WalkRun

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
    animal: Annotated[
        str | None,
        typer.Option(
            help="with legs, in place of a snake: lizard, goat, or a .toml ([KP])",
            autocompletion=completion.ANIMALS,
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
    """Make an animal's motion over a world: a snake's by states ([PT]), or that of legs ([KP])."""
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
    files = {"film": str(moving) if film else None, "skin": str(solid) if glb else None}
    if animal is not None:
        kept = {"--motion": motion, "--track": track, "--look": None if look == "animal" else look}
        _with_legs(animal, prepared, frames, (recording, picture), more, kept, files, as_json)
        return
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
    show(made.facts() | {"track": str(recording), "picture": str(picture)} | files, as_json)
    if frames is None and not made.complete:
        raise SystemExit(1)


def _with_legs(
    name: str,
    prepared: "WalkRun",
    frames: int | None,
    written: tuple[Path, Path],
    more: list[Path],
    kept: dict[str, str | None],
    files: dict[str, str | None],
    as_json: bool,
) -> None:
    """Synthesise an animal with legs."""
    from snakewalk.controller.app.recordings.animal_synthesis import (  # noqa: PLC0415  heavy
        read_animal,
        synthesise_animal,
    )
    from snakewalk.controller.app.report.plots.animal_synthesis import draw_animal  # noqa: PLC0415

    wrong = [option for option, value in kept.items() if value is not None]
    if wrong:
        raise InputError(f"{wrong[0]}: is for snakes; --animal {name} has its own motion and skin")
    recording, picture = written
    config = read_animal(name)
    body = None
    if more:
        from snakewalk.controller.app.recordings.animal_film import AnimalBody  # noqa: PLC0415

        body = AnimalBody.of(config)
    made = synthesise_animal(prepared, config, frames)
    with atomic_write(recording) as part:
        made.save(part, recording.stem)
    draw_animal(made, picture, f"{config.name} on {prepared.world.name}")
    if body is not None and files["skin"] is not None:
        body.write(made, Path(files["skin"]))
    if body is not None and files["film"] is not None:
        body.film(made, prepared, Path(files["film"]))
    show(made.facts() | {"track": str(recording), "picture": str(picture)} | files, as_json)
    if frames is None and not made.complete:
        raise SystemExit(1)
