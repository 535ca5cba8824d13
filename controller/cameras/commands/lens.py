"""``snakewalk pose calibrate``: the lens of a camera from pictures of a board."""

import math
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from snakewalk.config.arrays import Image
from snakewalk.config.camera import CameraConfig
from snakewalk.config.errors import InputError
from snakewalk.controller.cameras.calibration_board import (
    BoardView,
    CalibrationBoard,
    read_pattern,
)
from snakewalk.controller.cameras.commands.board import (
    Pattern,
    SquareMm,
    Squares,
    read_squares,
)
from snakewalk.controller.cameras.device_camera import open_device
from snakewalk.controller.cameras.lens_calibration import calibrate_lens
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force, Json, show
from snakewalk.controller.console.result_files import atomic_write
from snakewalk.controller.images.video import open_footage
from snakewalk.drivers.clock import WallClock

_ENDINGS = (".yml", ".yaml", ".xml", ".json")
_PAUSE_S = 0.7
"""Between pictures of a device: time to move the board."""


@command(
    "pose calibrate",
    examples=(
        "pose calibrate pictures -o lens.yml",
        "pose calibrate 0 -o lens.yml --size 1280x720",
    ),
    results=("out",),
)
def calibrate_camera(
    source: Annotated[str, typer.Argument(help="folder of pictures, a film, or a device's number")],
    out: Annotated[
        Path, typer.Option("--out", "-o", help="write the lens file here (.yml, .json)")
    ],
    pattern: Pattern = "charuco",
    squares: Squares = "7x5",
    square: SquareMm = 36.0,
    views: Annotated[
        int, typer.Option(min=5, max=200, help="largest number of pictures to use")
    ] = 40,
    size: Annotated[
        str, typer.Option(help="picture size of a device in pixels", metavar="WxH")
    ] = "640x480",
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Calibrate a camera's lens with OpenCV from pictures of the board of `pose board`.

    Hold the board at 15 places or more, also in the corners of the picture, tilted by up to 45
    degrees.
    """
    if out.suffix.lower() not in _ENDINGS:
        raise InputError(f"{out}: the file of a lens ends in {', '.join(_ENDINGS)}")
    board = CalibrationBoard(read_pattern(pattern), read_squares(squares), 0.001 * square)
    if source.isdigit():
        seen, size_px = _from_device(source, size, board, views)
    else:
        seen, size_px = _from_files(Path(source), board, views)
    found = calibrate_lens(seen, size_px)
    used = sum(math.isfinite(one) for one in found.view_rms_px)
    with atomic_write(out) as part:
        found.lens.write(part, found.rms_px, used)
    focal = found.lens.matrix[[0, 1], [0, 1]]
    matrix = found.lens.matrix
    show(
        {
            "lens": str(out),
            "size_px": list(size_px),
            "pictures": len(seen),
            "with_the_board": sum(one is not None for one in seen),
            "used": used,
            "residual_rms_px": round(found.rms_px, 3),
            "residual_of_views_px": [
                None if math.isnan(one) else round(one, 3) for one in found.view_rms_px.tolist()
            ],
            "focal_px": [round(one, 2) for one in focal.tolist()],
            "focal_standard_error_px": round(found.focal_error_px, 2),
            "centre_px": [round(one, 2) for one in matrix[:2, 2].tolist()],
            "centre_standard_error_px": round(found.centre_error_px, 2),
            "distortion": [round(one, 5) for one in found.lens.distortion.tolist()],
            "coverage": round(found.coverage, 2),
            "largest_tilt_deg": round(found.tilt_deg, 1),
            "remarks": list(found.remarks),
        },
        as_json,
    )


def _from_files(
    path: Path, board: CalibrationBoard, most: int
) -> tuple[list[BoardView | None], tuple[int, int]]:
    # OpenCV finds boards in 8 bit pictures
    pictures = [np.clip(one, 0, 255).astype(np.uint8) for one in open_footage(path).spread(most)]
    sizes = sorted({picture.shape[1::-1] for picture in pictures})
    if len(sizes) > 1:
        shown = " and ".join(f"{width} x {height}" for width, height in sizes)
        raise InputError(f"{path}: pictures of one size are needed, these are {shown} pixels")
    return [board.find(one) for one in pictures], (sizes[0][0], sizes[0][1])


def _from_device(
    name: str, size: str, board: CalibrationBoard, count: int
) -> tuple[list[BoardView | None], tuple[int, int]]:
    """Record pictures and report for each whether the board was found."""
    width, _, height = size.partition("x")
    if not (width.isdigit() and height.isdigit() and 64 <= int(width) <= 4096):
        raise InputError(f"--size {size}: expected width x height in pixels, e.g. 640x480")
    wanted = CameraConfig(device=name, width_px=int(width), height_px=int(height))
    device = open_device(wanted)
    clock = WallClock()
    seen: list[BoardView | None] = []
    picture: Image | None = None
    try:
        while len(seen) < count:
            until_s = clock.now_s() + _PAUSE_S
            while picture is None or clock.now_s() < until_s:
                whole, frame = device.read()
                if not whole:
                    raise InputError(f"camera {name}: hands over no more frames")
                picture = np.asarray(frame, dtype=np.uint8)
            seen.append(board.find(picture))
            corners = "no board" if seen[-1] is None else f"{len(seen[-1].corners_px)} corners"
            typer.echo(f"picture {len(seen)} of {count}: {corners}", err=True)
    finally:
        device.release()
    if picture is None:
        raise InputError(f"camera {name}: no picture was taken")
    return seen, (picture.shape[1], picture.shape[0])
