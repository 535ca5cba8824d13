"""``snakewalk animal fish match``: postures of a fish from film."""

from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.controller.animals.commands.fish_options import Picture
from snakewalk.controller.animals.commands.pictures import pictures
from snakewalk.controller.animals.fish.accuracy import compare
from snakewalk.controller.animals.fish.film_options import BUILD, Build
from snakewalk.controller.animals.fish.fish_matching import MIDLINES, match_footage, read_midlines
from snakewalk.controller.animals.fish.postures import load_postures, save_postures
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import FilmRate, Force, Json, show
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.controller.console.result_files import (
    atomic_write,
    check_ending,
    check_picture,
)


@command(
    "animal fish match",
    examples=(
        "animal fish match top.mp4 --side side.mp4 -o postures.npz",
        "animal fish match tank/top --background tank/top-background.png --picture match.png",
    ),
    results=("output", "picture"),
)
def match(
    footage: Annotated[
        Path,
        typer.Argument(help="video or folder of images from above, or a file of tracked midlines"),
    ],
    side: Annotated[
        Path | None,
        typer.Option(
            help="video or folder of the same moments from the side, for height and pitch"
        ),
    ] = None,
    background: Annotated[
        Path | None, typer.Option(help="picture of the empty scene; default: median of the frames")
    ] = None,
    side_background: Annotated[
        Path | None,
        typer.Option(
            help="picture of the empty scene from the side; default: median of the frames"
        ),
    ] = None,
    build: Build = BUILD,
    rate: FilmRate = None,
    length: Annotated[
        float | None,
        typer.Option(help="body length in metres; without it, lengths are in body lengths"),
    ] = None,
    truth: Annotated[
        Path | None, typer.Option(help="known postures to compare with: truth.npz of fish film")
    ] = None,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="write the postures here (.npz)")
    ] = Path("postures.npz"),
    picture: Picture = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Fit a deformable fish to every frame: head, spine angles, and from the side its pitch."""
    check_picture(picture)
    check_ending(output, "the result", ".npz")
    if length is not None and not 0.0 < length < 1e3:
        raise InputError(f"--length: a body length in metres, above 0; not {length:g}")
    true_postures = None if truth is None else load_postures(truth)
    if footage.suffix.lower() in MIDLINES:
        if side or length or background:
            raise InputError(
                f"{footage}: --side, --length and --background need images; leave them out"
            )
        matched = read_midlines(footage, build, rate)
    else:
        with ProgressBar("frames", transient=True) as bar:
            matched = match_footage(
                footage,
                side,
                background,
                side_background,
                build=build,
                rate_hz=rate,
                length_m=length,
                on_progress=bar.update,
            )
    facts = matched.facts
    if true_postures is not None:
        facts |= compare(matched.postures, true_postures).to_dict()
    with atomic_write(output) as part:
        save_postures(part, matched.postures)
    if picture is not None:
        pictures()[0].draw_match(picture, matched.postures, true_postures, matched.film, footage)
    show(facts | {"postures": str(output)}, as_json)
