"""``snakewalk terrain from``: a world from a file of real ground."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force, Json, show
from snakewalk.controller.console.result_files import (
    atomic_write,
    check_picture,
    refuse_to_overwrite,
)
from snakewalk.controller.mapping.elevation_file import MapOptions, read_elevation
from snakewalk.controller.mapping.raster_file import DEGREE, UNITS_M, RasterUnits
from snakewalk.controller.mapping.world_file import MapWorld, map_beside
from snakewalk.controller.terrain.elevation_map import CELL_HEIGHTS

if TYPE_CHECKING:
    from snakewalk.controller.mapping.world_file import MapWorld

WorldOut = Annotated[Path, typer.Option("--out", "-o", help="the world's file (.toml)")]
Spacing = Annotated[
    float | None, typer.Option(help="m between samples in the robot's world", show_default=False)
]
Fill = Annotated[
    float, typer.Option(help="m: holes narrower than this are filled and count as known")
]
Picture = Annotated[
    Path | None, typer.Option(help="picture of the map: heights, holes, safe ground")
]
_LEAST, _MOST = 1e-6, 1e6
"""Of lengths, m, and of factors: what is beyond is in another unit (ours)."""


@command(
    "terrain from",
    examples=(
        "terrain from dem.tif --scale 0.002 -o hill.toml --picture hill.png",
        "terrain from scan.pcd --crop 20,50,80,150 --scale 0.05 --fill 0.3 -o slope.toml",
        "terrain from heights.png --cell 0.05 --height-step 0.001 -o garden.toml",
    ),
)
def elevation(
    file: Annotated[
        Path,
        typer.Argument(help="GeoTIFF, ASCII grid, PCD, PLY, XYZ, OBJ, STL, GLB, PNG, CSV or NPZ"),
    ],
    out: WorldOut,
    scale: Annotated[float, typer.Option(help="metres in the robot's world per metre")] = 1.0,
    vertical_scale: Annotated[
        float | None, typer.Option(help="the same of heights; default: as --scale")
    ] = None,
    spacing: Spacing = None,
    crop: Annotated[
        str | None,
        typer.Option(help="X0,Y0,X1,Y1: metres of the file from its south-west corner"),
    ] = None,
    unit: Annotated[
        str | None,
        typer.Option(
            help="of the file's lengths: m, cm, mm, km, ft, deg; default: as it says, or m"
        ),
    ] = None,
    cell: Annotated[
        float | None, typer.Option(help="between samples of a PNG, CSV or NPZ, in the unit")
    ] = None,
    height_step: Annotated[
        float | None, typer.Option(help="height of one step of the file's values, in the unit")
    ] = None,
    no_data: Annotated[float | None, typer.Option(help="value of cells that hold nothing")] = None,
    point: Annotated[
        str, typer.Option(help="which point of a cell counts: lowest, median, highest")
    ] = "median",
    up: Annotated[str, typer.Option(help="axis of a mesh or cloud that points up: z or y")] = "z",
    fill: Fill = 0.0,
    picture: Picture = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Make a world that `plan` and `run` take of a file of real ground; its holes stay known."""
    positive = {
        "--scale": scale, "--vertical-scale": vertical_scale, "--spacing": spacing,
        "--cell": cell, "--height-step": height_step,
    }  # fmt: skip
    faults = not_positive(positive)
    check_fill(fill, faults)
    known = {"--unit": (unit, (*UNITS_M, DEGREE)), "--point": (point, CELL_HEIGHTS)}
    known["--up"] = (up, ("z", "y"))
    faults += [
        f"{option} {value}: is none of {', '.join(choices)}"
        for option, (value, choices) in known.items()
        if value is not None and value not in choices
    ]
    corners = None if crop is None else _corners(crop, faults)
    if faults:
        raise InputError(faults)
    check_world_files(out, picture, [file], force)
    units = RasterUnits(unit, cell, height_step, no_data)
    options = MapOptions(
        units, corners, scale, vertical_scale, spacing,
        next(name for name in CELL_HEIGHTS if name == point), up,
    )  # fmt: skip
    read = read_elevation(file, options)
    world = MapWorld.of(out, read.elevation.height_field(fill))
    wide, deep = read.size_m
    rise = scale if vertical_scale is None else vertical_scale
    world.write(
        [
            f"From {file.name}, {read.kind}: {wide:.5g} m by {deep:.5g} m,",
            f"{read.relief_m:.4g} m of relief, at a scale of {scale:g}, heights at {rise:g};",
            f"samples {world.ground.spacing_m:g} m apart.",
            *([f"Of the file from its south-west corner: {crop} m."] if crop else []),
            *([f"Holes narrower than {fill:g} m were filled and count as known."] if fill else []),
        ]
    )
    finish(
        world,
        {
            "kind": read.kind,
            "file_size_m": [round(wide, 3), round(deep, 3)],
            "file_relief_m": round(read.relief_m, 3),
            "scale": scale,
            "vertical_scale": rise,
        },
        picture,
        as_json=as_json,
    )


def check_world_files(
    out: Path, picture: Path | None, sources: Sequence[Path], force: bool
) -> None:
    """Refuse files that exist, endings that are none, and to write over what is read.

    Raises:
        InputError: one line each.

    """
    if out.suffix != ".toml":
        raise InputError(f"{out}: a world's file ends in .toml")

    check_picture(picture)
    results = [out, map_beside(out), picture]
    refuse_to_overwrite(results, force)
    same = {path.resolve() for path in sources} & {path.resolve() for path in results if path}
    if same:
        raise InputError([f"{path}: is read, and would be overwritten" for path in same])


def not_positive(options: Mapping[str, float | None]) -> list[str]:
    """Say which options have a value that is not above 0, or beyond all lengths and factors."""
    faults = []
    for option, value in options.items():
        if value is not None and not 0.0 < value < math.inf:
            faults.append(f"{option} {value:g}: must be above 0")
        elif value is not None and not _LEAST <= value <= _MOST:
            faults.append(f"{option} {value:g}: must be from {_LEAST:g} to {_MOST:g}")
    return faults


def check_fill(fill_m: float, faults: list[str]) -> None:
    """Add what is wrong with ``--fill``."""
    if not 0.0 <= fill_m < math.inf:
        faults.append(f"--fill {fill_m:g}: must be 0 or more")


def finish(
    world: "MapWorld", facts: dict[str, object], picture: Path | None, *, as_json: bool
) -> None:
    """Draw the map if asked for, and show what was made."""
    if picture is not None:
        from snakewalk.controller.mapping.terrain_map import draw_terrain_map  # noqa: PLC0415

        with atomic_write(picture) as part:
            draw_terrain_map(world.relief, part, world.config.name)
        facts = facts | {"picture": str(picture)}
    show(world.facts() | facts, as_json)


def _corners(crop: str, faults: list[str]) -> tuple[float, float, float, float] | None:
    try:
        x0, y0, x1, y1 = (float(part) for part in crop.split(","))
    except ValueError:
        faults.append(f"--crop {crop}: expected X0,Y0,X1,Y1 in metres")
        return None
    if not (-math.inf < x0 < x1 < math.inf and -math.inf < y0 < y1 < math.inf):
        faults.append(f"--crop {crop}: X1 must be over X0, and Y1 over Y0")
    return x0, y0, x1, y1
