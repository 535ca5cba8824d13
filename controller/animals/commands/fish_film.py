"""``snakewalk animal fish film``: films of a fish whose every angle is known."""

from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.controller.animals.fish.film_options import FishFilmOptions
from snakewalk.controller.animals.fish.fish_film import render
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
    *,
    options: FishFilmOptions,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Render a film of a fish with known angles, marks, shadow, blur and noise."""
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: is a file; give a folder")
    if folder.is_dir() and any(folder.iterdir()) and not force:
        raise InputError(f"{folder}: is not empty; --force writes into it")
    with ProgressBar("frames", transient=True) as bar:
        truth = render(folder, options, on_progress=bar.update)
    show(
        {
            "folder": str(folder),
            "frames": truth.frames,
            "rate_hz": round(truth.rate_hz, 3),
            "length_px": options.length_px,
        },
        as_json,
    )
