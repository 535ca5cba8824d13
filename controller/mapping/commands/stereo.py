"""``snakewalk world stereo``: a world from a calibrated pair of pictures."""

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.key_types import DISPARITIES, Disparities
from snakewalk.config.reading import texts
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force, Json
from snakewalk.controller.mapping.commands.elevation import (
    Fill,
    Picture,
    Scale,
    WorldOut,
    check_fill,
    check_world_files,
    finish,
    not_positive,
)
from snakewalk.controller.mapping.elevation_choice import CalibrationChoice
from snakewalk.controller.mapping.world_file import MapWorld

if TYPE_CHECKING:
    from snakewalk.controller.mapping.stereo_ground import StereoGround

Left = Annotated[Path, typer.Argument(help="picture of the left camera")]
Right = Annotated[Path, typer.Argument(help="picture of the right camera at the same moment")]
Calibration = Annotated[
    Path,
    typer.Option(
        help="calibration of OpenCV's stereoCalibrate (YAML, XML, JSON, NPZ), or a calib.txt"
    ),
]
Height = Annotated[
    float | None,
    typer.Option(help="height of the left camera above the ground in metres; default: fitted"),
]
Tilt = Annotated[
    float | None, typer.Option(help="downward tilt of the left camera in degrees; default: fitted")
]
Roll = Annotated[
    float, typer.Option(help="roll of the left camera in degrees; positive: right side down")
]
LevelGround = Annotated[
    bool,
    typer.Option(
        "--level-ground", help="accept a fitted ground as level, however the camera is rolled"
    ),
]
SampleSpacing = Annotated[
    float, typer.Option(help="distance of samples in the robot's world in metres")
]
Error = Annotated[
    float, typer.Option(help="leave out points with a larger expected error in metres")
]
Far = Annotated[
    float | None,
    typer.Option(help="largest distance ahead in metres; default: as far as --error allows"),
]


@command(
    "world stereo",
    examples=(
        "world stereo left.png right.png --calibration stereo.yml -o yard.toml",
        "world stereo l.png r.png --calibration c.yml --height 0.5 --tilt 30 -o yard.toml",
    ),
)
def stereo(
    left: Left,
    right: Right,
    calibration: Calibration,
    out: WorldOut,
    height: Height = None,
    tilt: Tilt = None,
    roll: Roll = 0.0,
    level_ground: LevelGround = False,
    disparities: Disparities = DISPARITIES,
    spacing: SampleSpacing = 0.03,
    error: Error = 0.03,
    far: Far = None,
    scale: Scale = 1.0,
    fill: Fill = 0.0,
    picture: Picture = None,
    force: Force = False,
    as_json: Json = False,
    *,
    choice: CalibrationChoice,
) -> None:
    """Make a world of the ground in front of a stereo camera; unseen ground stays unknown.

    The origin of the world is below the left camera; the x axis points where the camera looks.
    """
    require_extra("stereo pictures need", "cv2", "PIL")
    from snakewalk.controller.mapping import (  # noqa: PLC0415  an extra
        stereo_camera,
        stereo_ground,
    )

    faults = not_positive(
        {"--height": height, "--spacing": spacing, "--error": error, "--far": far, "--scale": scale}
    )
    check_fill(fill, faults)
    faults += _stand_faults(height, tilt, roll)
    if level_ground and height is not None:
        faults.append("--level-ground fits the ground; leave out --height, --tilt and --roll")
    if faults:
        raise InputError(faults)
    check_world_files(out, picture, [left, right, calibration], force)
    calibrated = stereo_camera.read_calibration(calibration, choice)
    pair = stereo_camera.read_pair(calibrated, left, right)
    stand = None
    if height is not None and tilt is not None:
        stand = stereo_ground.CameraStand(height, math.radians(tilt), math.radians(roll))
    terrain = stereo_ground.stereo_ground(
        pair,
        disparities,
        spacing / scale,
        error,
        stand,
        math.inf if far is None else far,
        is_level=level_ground,
    )
    elevation = terrain.elevation
    placed = replace(
        elevation,
        z_m=scale * elevation.z_m,
        spacing_m=spacing,
        x0_m=scale * elevation.x0_m,
        y0_m=scale * elevation.y0_m,
    )
    world = MapWorld.of(out, placed.height_field(fill))
    world.write(
        [
            f"From {left.name} and {right.name}, at a scale of {scale:g}; samples {spacing:g} m",
            "apart. (0, 0) is below the left camera, x is where it looked.",
            *_stand_words(terrain),
            *([f"Holes narrower than {fill:g} m were filled and count as known."] if fill else []),
        ]
    )
    about = {"facts": texts(calibrated.facts), "notes": list(calibrated.notes)}
    finish(world, _facts(terrain) | about, picture, as_json=as_json)


def _stand_faults(height: float | None, tilt: float | None, roll: float) -> list[str]:
    faults = [
        f"{option} {angle:g}: must be within 90 degrees"
        for option, angle in (("--tilt", tilt or 0.0), ("--roll", roll))
        if not -90.0 < angle <= 90.0
    ]
    if (height is None) != (tilt is None):
        faults.append("--height and --tilt belong together; without both the ground is fitted")
    elif height is None and roll != 0.0:
        faults.append("--roll belongs to --height and --tilt")
    return faults


def _stand_words(terrain: "StereoGround") -> list[str]:
    stand = terrain.stand
    return [
        f"The camera stood {stand.height_m:.3f} m above the ground, tilted down by",
        f"{math.degrees(stand.tilt_rad):.1f} degrees and rolled by "
        f"{math.degrees(stand.roll_rad):.1f}, {_method_text(terrain)}.",
    ]


def _method_text(terrain: "StereoGround") -> str:
    return (
        "fitted to the points, which are assumed to be level ground" if terrain.fitted else "given"
    )


def _facts(terrain: "StereoGround") -> dict[str, object]:
    stand = terrain.stand
    return {
        "camera": _method_text(terrain),
        "camera_height_m": round(stand.height_m, 4),
        "camera_tilt_deg": round(math.degrees(stand.tilt_rad), 2),
        "camera_roll_deg": round(math.degrees(stand.roll_rad), 2),
        "matched_share": round(terrain.known_share, 4),
        "mapped_share": round(terrain.used_share, 4),
    }
