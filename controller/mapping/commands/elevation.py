"""``snakewalk world from``: a world from a file of real ground."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.config.reading import texts
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force, Json, console, show
from snakewalk.controller.console.result_files import (
    atomic_write,
    check_picture,
    refuse_to_overwrite,
)
from snakewalk.controller.mapping.elevation_choice import LARGEST, SMALLEST, ElevationChoice
from snakewalk.controller.mapping.elevation_file import MapOptions, read_elevation
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
    fill: Fill = 0.0,
    picture: Picture = None,
    force: Force = False,
    as_json: Json = False,
    *,
    choice: ElevationChoice,
) -> None:
    """Make a world for `plan` and `run` from a file of real ground; unknown cells stay unknown."""
    faults = not_positive(
        {
            "--scale": scale,
            "--vertical-scale": vertical_scale,
            "--spacing": spacing,
        }
    )
    check_fill(fill, faults)
    corners = None if crop is None else _corners(crop, faults)
    if faults:
        raise InputError(faults)
    check_world_files(out, picture, [file], force)
    options = MapOptions(choice, corners, scale, vertical_scale, spacing)
    read = read_elevation(file, options)
    world = MapWorld.of(out, read.elevation.height_field(fill))
    world.write(_head(file, read, options, crop, world.ground.spacing_m, fill))
    finish(world, _facts(read, options), picture, as_json=as_json)


def _head(
    file: Path,
    read: "FileMap",
    options: "MapOptions",
    crop: str | None,
    spacing_m: float,
    fill: float,
) -> list[str]:
    wide, deep = read.size_m
    return [
        f"From {file.name}, {read.kind}: {wide:.5g} m by {deep:.5g} m,",
        f"{read.relief_m:.4g} m of relief, at a scale of {options.scale:g}, heights at "
        f"{options.rise:g};",
        f"samples {spacing_m:g} m apart.",
        *([f"Part of the file, from its south-west corner: {crop} m."] if crop else []),
        *([f"Holes narrower than {fill:g} m were filled and count as known."] if fill else []),
        *(f"- {line}" for line in (*map(str, read.facts.values()), *read.notes)),
    ]


def _facts(read: "FileMap", options: "MapOptions") -> dict[str, object]:
    wide, deep = read.size_m
    return {
        "kind": read.kind,
        "file_size_m": [round(wide, 3), round(deep, 3)],
        "file_relief_m": round(read.relief_m, 3),
        "scale": options.scale,
        "vertical_scale": options.rise,
        "facts": texts(read.facts),
        "notes": list(read.notes),
    }


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
        f"{option} {value:g}: must be from {SMALLEST:g} to {LARGEST:g}"
        for option, value in options.items()
        if value is not None and not SMALLEST <= value <= LARGEST
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
    notes = [] if as_json else facts.pop("notes", [])
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
