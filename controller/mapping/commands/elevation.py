"""``snakewalk world from``: a world from a file of real ground."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from snakewalk.config.errors import Assumptions, InputError
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Assume, Force, Json, console, show
from snakewalk.controller.console.result_files import (
    atomic_write,
    check_picture,
    refuse_to_overwrite,
)
from snakewalk.controller.mapping.elevation_file import MapOptions, read_elevation
from snakewalk.controller.mapping.raster_file import RasterUnits
from snakewalk.controller.mapping.world_file import MapWorld, map_beside

if TYPE_CHECKING:
    from snakewalk.controller.mapping.elevation_file import FileMap

WorldOut = Annotated[Path, typer.Option("--out", "-o", help="write the world's file here (.toml)")]
Spacing = Annotated[
    float | None,
    typer.Option(help="distance of samples in the robot's world in metres", show_default=False),
]
Fill = Annotated[
    float, typer.Option(help="fill holes narrower than this many metres, and treat them as known")
]
Picture = Annotated[
    Path | None, typer.Option(help="draw the map with heights, holes and safe ground here")
]
_SMALLEST, _LARGEST = 1e-6, 1e6
"""Limits of lengths, m, and of factors: a value beyond them is in another unit (ours)."""
ElevationFile = Annotated[
    Path,
    typer.Argument(
        help="GeoTIFF, ASCII grid, LAS, LAZ, PCD, PLY, XYZ, OBJ, STL, GLB, PNG, CSV or NPZ"
    ),
]
Scale = Annotated[float, typer.Option(help="metres in the robot's world per metre")]
VerticalScale = Annotated[float | None, typer.Option(help="scale of heights; default: as --scale")]
CropText = Annotated[
    str | None, typer.Option(help="X0,Y0,X1,Y1: metres of the file from its south-west corner")
]
_Length = Literal["m", "cm", "mm", "km", "ft", "us-ft"]
Unit = Annotated[
    Literal[_Length, "deg"] | None,
    typer.Option(help="unit of the file; default: as it states"),
]
HeightUnit = Annotated[
    _Length | None,
    typer.Option(
        help="unit of the file's heights; default: as it states, else as its lengths if metric"
    ),
]
Cell = Annotated[
    float | None,
    typer.Option(help="distance between samples of a PNG, CSV or NPZ, in the file's unit"),
]
HeightStep = Annotated[
    float | None, typer.Option(help="height per step of the file's values, in the file's unit")
]
NoData = Annotated[float | None, typer.Option(help="value of empty cells, such as -9999 or nan")]
PointOf = Annotated[
    Literal["lowest", "median", "highest"] | None,
    typer.Option(help="point of a cell that counts; default: median"),
]
Up = Annotated[
    Literal["z", "y", "x", "-z", "-y", "-x"] | None,
    typer.Option(help="axis of a mesh or cloud that points up; default: z"),
]
Classes = Annotated[
    str | None,
    typer.Option(help="classes of LAS points, such as 2,9; default: ground, else all but noise"),
]


@command(
    "world from",
    examples=(
        "world from dem.tif --scale 0.002 -o hill.toml --picture hill.png",
        "world from scan.pcd --crop 20,50,80,150 --scale 0.05 --fill 0.3 -o slope.toml",
        "world from heights.png --cell 0.05 --height-step 0.001 -o garden.toml",
    ),
)
def elevation(
    file: ElevationFile,
    out: WorldOut,
    scale: Scale = 1.0,
    vertical_scale: VerticalScale = None,
    spacing: Spacing = None,
    crop: CropText = None,
    unit: Unit = None,
    height_unit: HeightUnit = None,
    cell: Cell = None,
    height_step: HeightStep = None,
    no_data: NoData = None,
    point: PointOf = None,
    up: Up = None,
    classes: Classes = None,
    assume: Assume = None,
    fill: Fill = 0.0,
    picture: Picture = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Make a world for `plan` and `run` from a file of real ground; unknown cells stay unknown."""
    faults = not_positive(
        {
            "--scale": scale,
            "--vertical-scale": vertical_scale,
            "--spacing": spacing,
            "--cell": cell,
            "--height-step": height_step,
        }
    )
    check_fill(fill, faults)
    corners = None if crop is None else _corners(crop, faults)
    kinds = None if classes is None else _numbers_of(classes, faults)
    if faults:
        raise InputError(faults)
    assumed = Assumptions(assume or ())
    check_world_files(out, picture, [file], force)
    units = RasterUnits(unit, cell, height_step, no_data, height_unit)
    options = MapOptions(units, corners, scale, vertical_scale, spacing, point, up, kinds, assumed)
    read = read_elevation(file, options)
    assumed.check_used("keys: lowest_m, highest_m")
    world = MapWorld.of(out, read.elevation.height_field(fill))
    notes = [*read.notes, *assumed.lines]
    world.write(_head(file, read, options, crop, world.ground.spacing_m, fill, notes))
    finish(world, _facts(read, options, notes), picture, as_json=as_json)


def _head(
    file: Path,
    read: "FileMap",
    options: "MapOptions",
    crop: str | None,
    spacing_m: float,
    fill: float,
    notes: list[str],
) -> list[str]:
    wide, deep = read.size_m
    return [
        f"From {file.name}, {read.kind}: {wide:.5g} m by {deep:.5g} m,",
        f"{read.relief_m:.4g} m of relief, at a scale of {options.scale:g}, heights at "
        f"{options.rise:g};",
        f"samples {spacing_m:g} m apart.",
        *([f"Part of the file, from its south-west corner: {crop} m."] if crop else []),
        *([f"Holes narrower than {fill:g} m were filled and count as known."] if fill else []),
        *(f"- {note}" for note in notes),
    ]


def _facts(read: "FileMap", options: "MapOptions", notes: list[str]) -> dict[str, object]:
    wide, deep = read.size_m
    return {
        "kind": read.kind,
        "file_size_m": [round(wide, 3), round(deep, 3)],
        "file_relief_m": round(read.relief_m, 3),
        "scale": options.scale,
        "vertical_scale": options.rise,
        "notes": notes,
    }


def _numbers_of(classes: str, faults: list[str]) -> tuple[int, ...]:
    words = classes.split(",")
    if not all(word.strip().isdecimal() and int(word) < 256 for word in words):
        faults.append(f"--classes {classes}: expected numbers from 0 to 255, such as 2,9")
        return ()
    return tuple(int(word) for word in words)


def check_world_files(
    out: Path, picture: Path | None, sources: Sequence[Path], force: bool
) -> None:
    """Reject existing files, unknown endings, and an output that is also an input.

    Raises:
        InputError: one line each.

    """
    if out.suffix != ".toml":
        raise InputError(f"{out}: a world's file ends in .toml")

    check_picture(picture)
    results = [out, map_beside(out), picture]
    refuse_to_overwrite(results, force)
    overwritten = {path.resolve() for path in sources} & {
        path.resolve() for path in results if path
    }
    if overwritten:
        raise InputError([f"{path}: is read, and would be overwritten" for path in overwritten])


def not_positive(options: Mapping[str, float | None]) -> list[str]:
    """Faults of options whose value is not above 0, or beyond all lengths and factors."""
    return [
        f"{option} {value:g}: must be from {_SMALLEST:g} to {_LARGEST:g}"
        for option, value in options.items()
        if value is not None and not _SMALLEST <= value <= _LARGEST
    ]


def check_fill(fill_m: float, faults: list[str]) -> None:
    """Append the fault of ``--fill``, if any."""
    if not 0.0 <= fill_m < math.inf:
        faults.append(f"--fill {fill_m:g}: must be 0 or more")


def finish(
    world: "MapWorld", facts: dict[str, object], picture: Path | None, *, as_json: bool
) -> None:
    """Draw the map if requested, and show the result."""
    if picture is not None:
        from snakewalk.controller.mapping.terrain_map import draw_terrain_map  # noqa: PLC0415  an extra

        with atomic_write(picture) as part:
            draw_terrain_map(world.relief, part, world.config.name)
        facts = facts | {"picture": str(picture)}
    notes = facts.pop("notes", []) if not as_json else []
    show(world.facts() | facts, as_json)
    assert isinstance(notes, list)
    for note in notes:
        console.print(f"- {note}", markup=False)


def _corners(crop: str, faults: list[str]) -> tuple[float, float, float, float] | None:
    try:
        x0, y0, x1, y1 = (float(part) for part in crop.split(","))
    except ValueError:
        faults.append(f"--crop {crop}: expected X0,Y0,X1,Y1 in metres")
        return None
    if not (-math.inf < x0 < x1 < math.inf and -math.inf < y0 < y1 < math.inf):
        faults.append(f"--crop {crop}: X1 must be over X0, and Y1 over Y0")
    return x0, y0, x1, y1
