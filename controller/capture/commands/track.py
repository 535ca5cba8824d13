"""``snakewalk animal track``: properties of recordings, and the share that a robot can do."""

import json
from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.constants import DEFAULT_ROBOT, DEFAULT_WORLD
from snakewalk.config.errors import InputError
from snakewalk.controller.capture.recording import examine
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import (
    Force,
    GivenRobot,
    GivenWorld,
    Json,
    show,
)
from snakewalk.controller.console.progress import show_progress
from snakewalk.controller.console.result_files import (
    atomic_write,
    check_ending,
    check_picture,
)
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.readers.generated import EMBEDDED
from snakewalk.controller.track.readers.load import choice_among
from snakewalk.controller.track.readers.writers import SUFFIXES, write_track


@command(
    "animal track",
    examples=("animal track", "animal track MIDLINES.csv --rate 60 --picture track.png"),
    results=("picture", "output"),
)
def track(
    recordings: Annotated[
        list[str] | None,
        typer.Argument(
            help="shipped names or files; default: the shipped ones",
            metavar="NAME",
            autocompletion=completion.RECORDINGS,
        ),
    ] = None,
    robot: GivenRobot = DEFAULT_ROBOT,
    world: GivenWorld = DEFAULT_WORLD,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", help="write the chosen animal as a track (.npz, .csv or .wcon)"
        ),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="draw midlines and angles here (.png, .svg, .pdf)")
    ] = None,
    force: Force = False,
    as_json: Json = False,
    *,
    choice: Choice,
) -> None:
    """Examine recordings: wave, bends, states this robot can use, slowing for its servos."""
    check_picture(picture)

    names = recordings or list(EMBEDDED)
    check_ending(output, "a track", *SUFFIXES)
    if output and len(names) > 1:
        raise InputError(f"{output}: one recording makes one file; {len(names)} are named")
    tracked = [
        examine(
            name,
            robot,
            world,
            choice=choice_among(name, names, choice),
        )
        for name in show_progress(names, "recordings", len(names))
    ]
    if picture is not None:
        from snakewalk.controller.capture.plots.recording import draw  # noqa: PLC0415  --picture: an extra

        draw(
            [
                (tracked_film.track, Path(tracked_film.facts["recording"]).name)
                for tracked_film in tracked
            ],
            picture,
        )
    if output is not None:
        with atomic_write(output) as part:
            write_track(part, tracked[0].track, output.suffix)
    if as_json:
        print(json.dumps([tracked_film.facts for tracked_film in tracked]))
        return
    for tracked_film in tracked:
        show(tracked_film.facts, as_json)
