"""``snakewalk pose lens``: the lens of a camera from pictures of a board."""

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
)
from snakewalk.controller.cameras.commands.board import (
    Pattern,
    SquareMm,
    Squares,
    read_squares,
)
from snakewalk.controller.cameras.device_camera import open_device
from snakewalk.controller.cameras.lens import ENDINGS
from snakewalk.controller.cameras.lens_calibration import calibrate_lens
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force, Json, show
from snakewalk.controller.console.result_files import atomic_write, check_ending
from snakewalk.controller.images.video import open_footage
from snakewalk.drivers.clock import WallClock

_PAUSE_S = 0.7
"""Time between pictures of a device, in which a user moves the board."""


@command(
    "pose lens",
    examples=(
        "pose lens pictures -o lens.yml",
        "pose lens 0 -o lens.yml --size 1280x720",
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
    check_ending(out, "the file of a lens", *ENDINGS)
    board = CalibrationBoard(pattern, read_squares(squares), 0.001 * square)
    if source.isdigit():
        board_views, size_px = _from_device(source, size, board, views)
    else:
        board_views, size_px = _from_files(Path(source), board, views)
    calibration = calibrate_lens(board_views, size_px)
    used = sum(math.isfinite(rms_px) for rms_px in calibration.view_rms_px)
    with atomic_write(out) as part:
        calibration.lens.write(part, calibration.rms_px, used)
    focal = calibration.lens.matrix[[0, 1], [0, 1]]
    matrix = calibration.lens.matrix
    show(
        {
            "lens": str(out),
            "size_px": list(size_px),
            "pictures": len(board_views),
            "with_the_board": sum(view is not None for view in board_views),
            "used": used,
            "residual_rms_px": round(calibration.rms_px, 3),
            "residual_of_views_px": [
                None if math.isnan(rms_px) else round(rms_px, 3)
                for rms_px in calibration.view_rms_px.tolist()
            ],
            "focal_px": [round(focal_value, 2) for focal_value in focal.tolist()],
            "focal_standard_error_px": round(calibration.focal_error_px, 2),
            "centre_px": [round(centre_value, 2) for centre_value in matrix[:2, 2].tolist()],
            "centre_standard_error_px": round(calibration.centre_error_px, 2),
            "distortion": [
                round(coefficient, 5) for coefficient in calibration.lens.distortion.tolist()
            ],
            "coverage": round(calibration.coverage, 2),
            "largest_tilt_deg": round(calibration.tilt_deg, 1),
            "remarks": list(calibration.remarks),
        },
        as_json,
    )


def _from_files(
    path: Path, board: CalibrationBoard, most: int
) -> tuple[list[BoardView | None], tuple[int, int]]:
    # OpenCV finds boards in 8 bit pictures
    pictures = [
        np.clip(image, 0, 255).astype(np.uint8) for image in open_footage(path).spread(most)
    ]
    sizes = sorted({picture.shape[1::-1] for picture in pictures})
    if len(sizes) > 1:
        shown = " and ".join(f"{width} x {height}" for width, height in sizes)
        raise InputError(f"{path}: pictures of one size are needed, these are {shown} pixels")
    return [board.find(picture) for picture in pictures], (sizes[0][0], sizes[0][1])


def _from_device(
    name: str, size: str, board: CalibrationBoard, count: int
) -> tuple[list[BoardView | None], tuple[int, int]]:
    """Record pictures and report for each whether the board was found."""
    width, _, height = size.partition("x")
    if not (width.isdigit() and height.isdigit() and 64 <= int(width) <= 4096):
        raise InputError(f"--size {size}: expected width x height in pixels, e.g. 640x480")
    camera = CameraConfig(device=name, width_px=int(width), height_px=int(height))
    device = open_device(camera)
    clock = WallClock()
    board_views: list[BoardView | None] = []
    picture: Image | None = None
    try:
        while len(board_views) < count:
            until_s = clock.now_s() + _PAUSE_S
            while picture is None or clock.now_s() < until_s:
                is_read, frame = device.read()
                if not is_read:
                    raise InputError(f"camera {name}: delivers no more frames")
                picture = np.asarray(frame, dtype=np.uint8)
            board_views.append(board.find(picture))
            corners = (
                "no board"
                if board_views[-1] is None
                else f"{len(board_views[-1].corners_px)} corners"
            )
            typer.echo(f"picture {len(board_views)} of {count}: {corners}", err=True)
    finally:
        device.release()
    if picture is None:
        raise InputError(f"camera {name}: no picture was taken")
    return board_views, (picture.shape[1], picture.shape[0])
