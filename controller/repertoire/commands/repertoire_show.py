"""``snakewalk gait repertoire show``: the actions of a repertoire."""

from pathlib import Path
from typing import Annotated

import typer

from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force, Json
from snakewalk.controller.console.result_files import check_picture
from snakewalk.controller.repertoire.commands.action_table import (
    Picture,
    plots,
    show_actions,
)
from snakewalk.controller.repertoire.repertoire import load_repertoire


@command(
    "gait repertoire show",
    examples=("gait repertoire show repertoire-yaw16-flat.npz",),
    results=("picture",),
)
def show_file(
    file: Annotated[Path, typer.Argument(help="file of recorded actions")] = Path(
        "repertoire-yaw16-flat.npz"
    ),
    picture: Picture = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Show the actions of a repertoire: speed, turn and closure error of a cycle."""
    check_picture(picture)
    repertoire = load_repertoire(file)
    if picture is not None:
        plots().draw_actions(repertoire, picture)
    show_actions(file, repertoire, as_json)
