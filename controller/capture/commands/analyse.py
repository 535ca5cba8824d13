"""``snakewalk animal analyse``: the motion of a recorded animal."""

import json
from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import (
    Force,
    Json,
    show,
)
from snakewalk.controller.console.progress import show_progress
from snakewalk.controller.console.result_files import check_picture, refuse_to_overwrite
from snakewalk.controller.track.analysis import analyse as measure
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.readers.load import choice_among, load_track


@command(
    "animal analyse",
    examples=("animal analyse worm-like", "animal analyse MIDLINES.csv --picture ."),
)
def analyse(
    recordings: Annotated[
        list[str],
        typer.Argument(
            help="shipped names, or files of tracked bodies",
            metavar="TRACK",
            autocompletion=completion.RECORDINGS,
        ),
    ],
    picture: Annotated[
        Path | None,
        typer.Option(
            help="draw tracks and maps into a file (.png, .svg, .pdf), or a folder for PNGs"
        ),
    ] = None,
    force: Force = False,
    as_json: Json = False,
    *,
    choice: Choice,
) -> None:
    """Analyse the animal's motion: pulse speed, sliding, wave, frequency, amplitudes, energy."""
    files = _pictures(recordings, picture, force)
    analyses = []
    pairs = list(zip(recordings, files, strict=True))
    for name, file in show_progress(pairs, "recordings", len(pairs)):
        analysis = measure(load_track(name, choice=choice_among(name, recordings, choice)))
        if file is not None:
            from snakewalk.controller.capture.plots.analysis import draw_analysis  # noqa: PLC0415  --picture: an extra

            draw_analysis(analysis, file)
        analyses.append(analysis.facts() | {"picture": None if file is None else str(file)})
    if as_json:
        print(json.dumps(analyses))
        return
    for facts in analyses:
        show(facts, as_json)


def _pictures(recordings: list[str], picture: Path | None, force: bool) -> list[Path | None]:
    """File of each recording's picture; rejected before anything is measured."""
    if picture is None:
        return [None] * len(recordings)
    if picture.suffix and not picture.is_dir():
        check_picture(picture)
        if len(recordings) > 1:
            raise InputError(f"{picture}: one file for {len(recordings)} recordings; give a folder")
        files = [picture]
    else:
        files = [picture / f"{Path(name).stem}.png" for name in recordings]
    if len(set(files)) < len(files):
        raise InputError(f"{picture}: two recordings have the same name; draw them one by one")
    refuse_to_overwrite(files, force)
    return list(files)
