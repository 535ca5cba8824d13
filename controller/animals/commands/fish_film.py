"""``snakewalk animal fish film``: films of a fish whose every angle is known."""

from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.controller.animals.commands.fish_options import Build
from snakewalk.controller.animals.fish.fish_film import render
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force, Json, show
from snakewalk.controller.console.progress import ProgressBar


@command(
    "animal fish film",
    examples=(
        "animal fish film tank --side",
        "animal fish film eel --motion MIDLINES.csv --build eel",
    ),
)
def film(
    folder: Annotated[Path, typer.Argument(help="folder for the frames and truth.npz")],
    motion: Annotated[
        str | None,
        typer.Option(
            help="recording to render; default: a scripted fish",
            autocompletion=completion.RECORDINGS,
        ),
    ] = None,
    build: Build = "carp",
    length_px: Annotated[
        float, typer.Option(min=20, max=2000, help="body length in pixels")
    ] = 120.0,
    frames: Annotated[
        int | None, typer.Option(min=2, help="largest number of frames to render")
    ] = None,
    side: Annotated[
        bool, typer.Option("--side", help="render a second film from the side")
    ] = False,
    fins: Annotated[
        float,
        typer.Option(
            min=0.0, max=0.3, help="length of pectoral fins seen from above, in body lengths"
        ),
    ] = 0.0,
    seed: Annotated[int, typer.Option(min=0, help="seed of patterns and noise")] = 0,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Render a film of a fish with known angles, marks, shadow, blur and noise."""
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: is a file; give a folder")
    if folder.is_dir() and any(folder.iterdir()) and not force:
        raise InputError(f"{folder}: is not empty; --force writes into it")
    with ProgressBar("frames", transient=True) as bar:
        truth = render(
            folder, motion=motion, build=build, length_px=length_px, frames=frames, side=side,
            fins=fins, seed=seed, on_progress=bar.update,
        )  # fmt: skip
    found: dict[str, object] = {
        "folder": str(folder),
        "frames": truth.frames,
        "rate_hz": round(truth.rate_hz, 3),
        "length_px": length_px,
    }
    show(found, as_json)
