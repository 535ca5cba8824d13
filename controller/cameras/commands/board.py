"""``snakewalk pose board``: the board of a calibration, to print."""

from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from PIL import Image as Pictures
from PIL import ImageOps

from snakewalk.config.arrays import Image
from snakewalk.config.errors import InputError
from snakewalk.controller.cameras.calibration_board import CalibrationBoard
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force, Json, show
from snakewalk.controller.console.result_files import atomic_write, check_ending

Pattern = Annotated[
    Literal["charuco", "chessboard"],
    typer.Option(help="pattern: charuco, which may be seen in part, or chessboard"),
]
Squares = Annotated[
    str, typer.Option(help="number of squares across and down, for both patterns", metavar="NxM")
]
SquareMm = Annotated[float, typer.Option(help="side of a square in mm, as measured on the print")]
PRINTS = (".pdf", ".png")
DOTS = 300.0
"""Resolution of the print, dots per inch."""


def read_squares(text: str) -> tuple[int, int]:
    """Read ``7x5``.

    Raises:
        InputError: it is not of that form.

    """
    across, _, down = text.partition("x")
    if not (across.isdigit() and down.isdigit() and len(text) < 10):
        raise InputError(f"--squares {text}: expected across x down, e.g. 7x5")
    return int(across), int(down)


@command(
    "pose board",
    examples=("pose board -o board.pdf", "pose board -o a3.pdf --squares 9x6 --square 42"),
    results=("out",),
)
def board(
    out: Annotated[
        Path, typer.Option("--out", "-o", help="write a .pdf in its true size, or a .png")
    ],
    pattern: Pattern = "charuco",
    squares: Squares = "7x5",
    square: SquareMm = 36.0,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Draw the board for `pose lens`; print it without scaling, and glue it to a plate."""
    calibration_board = CalibrationBoard(pattern, read_squares(squares), 0.001 * square)
    check_ending(out, "a print", *PRINTS)
    write_print(out, [calibration_board.picture(DOTS)])
    width, height = (round(1000.0 * side, 1) for side in calibration_board.size_m)
    show({"board": str(out), "width_mm": width, "height_mm": height, "square_mm": square}, as_json)


def write_print(out: Path, pages: list[Image]) -> None:
    """Write pages (H, W) in their true size with a white margin of 10 mm."""
    margin = round(10.0 / 25.4 * DOTS)
    sheets = [ImageOps.expand(Pictures.fromarray(page), margin, 255) for page in pages]
    with atomic_write(out) as part:
        kind = out.suffix[1:].upper()
        more: dict[str, Any] = (
            {"save_all": True, "append_images": sheets[1:]} if kind == "PDF" else {}
        )
        sheets[0].save(part, format=kind, dpi=(DOTS, DOTS), resolution=DOTS, **more)
