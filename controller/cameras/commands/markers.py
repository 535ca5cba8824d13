"""``snakewalk pose markers``: sheets for the floor, one marker a page."""

from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.controller.cameras.commands.board import DOTS, PRINTS, write_print
from snakewalk.controller.cameras.markers.floor_markers import COUNT, marker_sheet
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force, Json, show
from snakewalk.controller.console.result_files import check_ending


@command(
    "pose markers",
    examples=("pose markers -o markers.pdf", "pose markers -o a3.pdf --side 250 --count 4"),
    results=("out",),
)
def markers(
    out: Annotated[
        Path, typer.Option("--out", "-o", help="write a .pdf in its true size, or a .png")
    ],
    count: Annotated[int, typer.Option(min=1, max=50, help="number of markers, one per page")] = 6,
    first: Annotated[int, typer.Option(min=0, max=49, help="number of the first marker")] = 0,
    side: Annotated[
        float, typer.Option(help="side of a marker in mm, without its white margin")
    ] = 150.0,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Draw markers for the floor under the camera; print them without scaling.

    Lay four or more flat on the floor, as far apart as the picture allows. The table
    `camera.markers_m` of a run contains their positions.
    """
    check_ending(out, "a print", *PRINTS)
    if out.suffix.lower() == ".png" and count > 1:
        raise InputError(f"{out}: a .png holds one marker: --count 1, or a .pdf")
    if first + count > COUNT:
        raise InputError(f"--first {first} --count {count}: numbers end at {COUNT - 1}")
    if not 10.0 <= side <= 1000.0:
        raise InputError(f"--side {side:g}: must be 10 to 1000 mm")
    pages = [marker_sheet(number, 1e-3 * side, DOTS) for number in range(first, first + count)]
    write_print(out, pages)
    high, wide = (round(length_px / DOTS * 25.4 + 20.0, 1) for length_px in pages[0].shape)
    show(
        {
            "markers": str(out),
            "numbers": list(range(first, first + count)),
            "side_mm": side,
            "page_width_mm": wide,
            "page_height_mm": high,
        },
        as_json,
    )
