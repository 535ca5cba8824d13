"""``snakewalk animal fish synthesise``: new motion from segments of a film."""

from pathlib import Path
from typing import Annotated

import typer

from snakewalk.controller.animals.commands.fish_options import Picture
from snakewalk.controller.animals.commands.pictures import pictures
from snakewalk.controller.animals.fish.fish_synthesis import SynthesisFacts, synthesise_motion
from snakewalk.controller.animals.fish.postures import load_postures
from snakewalk.controller.animals.fish.synthesis_options import SynthesisOptions
from snakewalk.controller.console.command import command
from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.console.options import Force, Json, show
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.controller.console.result_files import (
    atomic_write,
    check_ending,
    check_picture,
)


@command(
    "animal fish synthesise",
    examples=(
        "animal fish synthesise postures.npz --seconds 30 --seed 1 -o track.npz",
        "animal fish synthesise postures.npz --through 3,0 --through 5,3 --mirror",
    ),
    results=("output", "picture"),
)
def synthesise(
    postures: Annotated[Path, typer.Argument(help="postures.npz of snakewalk animal fish match")],
    *,
    options: SynthesisOptions,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="write the track here (.npz)")
    ] = Path("track.npz"),
    picture: Picture = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Join segments of a film in a new order, at random or through control points."""
    check_picture(picture)
    check_ending(output, "the result", ".npz")
    with ProgressBar("search", transient=True) as bar:
        motion = synthesise_motion(load_postures(postures), options, bar.update)
    with atomic_write(output) as part:
        motion.save(part)
    if picture is not None:
        pictures()[1].draw_synthesis(picture, motion, options)
    _warn(motion.facts)
    show(motion.facts.to_dict() | {"track": str(output)}, as_json)


def _warn(facts: SynthesisFacts) -> None:
    """Warn of a fish that leaves its tank, or comes nearer to walls and fish than requested."""
    advice = "film more turns, add --mirror, or give a larger --tank"
    if facts.wall_distance is not None and facts.wall_distance < 0.0:
        LOGGER.warning(
            "--tank: the fish leaves the tank by %.3g; its segments turn too little; %s",
            -facts.wall_distance,
            advice,
        )
    elif facts.pieces_too_close:
        LOGGER.warning(
            "%s of %s segments come nearer than --apart to walls or fish; %s",
            facts.pieces_too_close,
            facts.pieces_used,
            advice,
        )
