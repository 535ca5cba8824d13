"""``snakewalk animal synthesise``: a motion without a robot."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.animal import FeetPath
from snakewalk.config.errors import InputError
from snakewalk.config.key_types import Seed
from snakewalk.controller.animals.legged.animal_synthesis import read_animal, synthesise_animal
from snakewalk.controller.animals.plots.animal_synthesis import draw_animal
from snakewalk.controller.animals.plots.snake_synthesis import draw_walk
from snakewalk.controller.animals.synthesis.snake_synthesis import SnakeSynthesis
from snakewalk.controller.animals.synthesis.tongue import TongueRecord
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.console.options import (
    DEFAULT_RUN,
    Force,
    Json,
    Marked,
    Robot,
    RunName,
    Set,
    TrackFile,
    World,
    key_values,
    show,
)
from snakewalk.controller.console.result_files import (
    atomic_write,
    check_picture,
    refuse_to_overwrite,
)
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.run.kinds.walk_run import WalkRun
from snakewalk.controller.run.results import ANIMAL

_END = (
    "--frames %s: the motion ends after %s frames, where the head leaves the ground of %s; "
    "ask for fewer frames, or add waypoints"
)
"""Paths of the feet of an animal with legs."""
_MOTIONS = ("walk", "walk-printed", "kp")
_ENDINGS = {"track": ".npz", "picture": ".png", "film": ".mp4", "skin": ".glb"}
"""Endings of the files, by content."""

Output = Annotated[
    Path | None,
    typer.Option("--output", "-o", help="write NAME.npz, NAME.png, ...; default: the run's name"),
]
Motion = Annotated[
    str | None,
    typer.Option(
        help="kind of motion: walk; walk-printed, aimed as [PT] prints it; kp, the state "
        "graph of [KP]"
    ),
]
Animal = Annotated[
    str | None,
    typer.Option(
        help="animal with legs instead of a snake: lizard, goat, or a .toml ([KP])",
        autocompletion=completion.ANIMALS,
    ),
]
Feet = Annotated[
    FeetPath | None,
    typer.Option(
        help="feet of --animal: footfall (ours), or gc-printed, [GC] Eq. 9-10 as printed; "
        "default: of the animal's file"
    ),
]
TongueFile = Annotated[
    Path | None,
    typer.Option(
        "--tongue",
        help="CSV table of a tracked tongue, to learn its chain from: time_s, and length_m or "
        "height (0 to 1); default: random strokes",
    ),
]
Frames = Annotated[
    int | None,
    typer.Option(
        min=2,
        max=100_000,
        help="number of frames, fewer if the head leaves the world; default: until the last "
        "waypoint is reached",
    ),
]
Film = Annotated[
    bool, typer.Option("--film", help="write a film of the skin on the ground to NAME.mp4")
]
Glb = Annotated[bool, typer.Option("--glb", help="write the skin as animated glTF to NAME.glb")]
Look = Annotated[
    str,
    typer.Option(
        help="body in film and glTF: animal, or a BODY that `snakewalk animal body` accepts"
    ),
]


@command(
    "animal synthesise",
    examples=(
        "animal synthesise -o motion",
        "animal synthesise my-run.toml --seed 3 --json",
        "animal synthesise jacksboro-traverse --animal lizard -o lizard --film",
    ),
)
def synthesise(
    run: RunName = DEFAULT_RUN,
    output: Output = None,
    robot: Robot = None,
    world: World = None,
    track: TrackFile = None,
    seed: Seed | None = None,
    motion: Motion = None,
    animal: Animal = None,
    feet: Feet = None,
    tongue: TongueFile = None,
    set_: Set = None,
    frames: Frames = None,
    film: Film = False,
    marks: Marked = False,
    glb: Glb = False,
    look: Look = "animal",
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Make an animal's motion over a world: a snake from states ([PT]), or legs ([KP])."""
    record = None if tongue is None or animal is not None else TongueRecord.read(tongue)
    prepared = prepare_walk(
        run,
        keys=key_values("--set", set_),
        on_paper=True,
        seed=seed,
        motion=motion,
        robot=robot,
        world=world,
        track=track,
    )
    if prepared.run.motion not in _MOTIONS:
        raise InputError(f"--motion {prepared.run.motion}: choose {', '.join(_MOTIONS)}")
    name = Path(prepared.run.name) if output is None else output
    left_out = {"film": not film, "skin": not glb}
    files = {
        what: name.with_name(f"{name.name}{ending}")
        for what, ending in _ENDINGS.items()
        if not left_out.get(what)
    }
    refuse_to_overwrite(list(files.values()), force)
    check_picture(files["picture"])
    if animal is None:
        if feet is not None:
            raise InputError(f"--feet {feet}: is for animals with legs; add --animal")
        facts, complete = _snake(prepared, frames, look, record, files, marks)
    else:
        kept = {"--motion": motion, "--track": track, "--tongue": tongue}
        kept["--look"] = None if look == "animal" else look
        wrong = [option for option, value in kept.items() if value is not None]
        if wrong:
            raise InputError(
                f"{wrong[0]}: is for snakes; --animal {animal} has its own motion and skin"
            )
        facts, complete = _with_legs(prepared, frames, animal, feet, files, marks)
    if frames is not None and facts["frames"] != frames:
        LOGGER.warning(_END, frames, facts["frames"], prepared.world.name)
    show(facts | {what: str(files[what]) if what in files else None for what in _ENDINGS}, as_json)
    if frames is None and not complete:
        raise SystemExit(1)


def _snake(
    prepared: WalkRun,
    frames: int | None,
    look: str,
    tongue: TongueRecord | None,
    files: Mapping[str, Path],
    marks: bool,
) -> tuple[dict[str, object], bool]:
    """Synthesise a snake by states; facts of it, and whether it reached its last waypoint."""
    worn = None
    if "skin" in files or "film" in files:
        from snakewalk.controller.animals.synthesis.synthesis_skin import SynthesisSkin  # noqa: PLC0415  --film and --glb: an extra

        worn = SynthesisSkin.of(look, prepared.run.track, prepared.robot)
    elif look != ANIMAL:
        raise InputError(f"--look {look}: needs --film or --glb")
    walk = SnakeSynthesis(prepared, tongue).synthesise(frames)
    with atomic_write(files["track"]) as part:
        walk.save(part, files["track"].stem, f"snakewalk animal synthesise of {prepared.run.track}")
    draw_walk(
        walk, prepared.ground, files["picture"], f"{prepared.run.name}: {prepared.world.name}"
    )
    if worn is not None and "skin" in files:
        worn.write(walk, files["skin"])
    if worn is not None and "film" in files:
        worn.film(walk, prepared, files["film"], marks)
    return walk.facts(), walk.complete


def _with_legs(
    prepared: WalkRun,
    frames: int | None,
    name: str,
    feet: FeetPath | None,
    files: Mapping[str, Path],
    marks: bool,
) -> tuple[dict[str, object], bool]:
    """Synthesise an animal with legs; facts of it, and whether it reached its last waypoint."""
    config = read_animal(name)
    if feet is not None:
        config = config.model_copy(update={"feet": feet})
    body = None
    if "skin" in files or "film" in files:
        from snakewalk.controller.animals.legged.animal_film import AnimalBody  # noqa: PLC0415  --film and --glb: an extra

        body = AnimalBody.of(config)
    animal_motion = synthesise_animal(prepared, config, frames)
    with atomic_write(files["track"]) as part:
        animal_motion.save(part, files["track"].stem)
    draw_animal(animal_motion, files["picture"], f"{config.name} on {prepared.world.name}")
    if body is not None and "skin" in files:
        body.write(animal_motion, files["skin"])
    if body is not None and "film" in files:
        body.film(animal_motion, prepared, files["film"], marks)
    return animal_motion.facts(), animal_motion.complete
