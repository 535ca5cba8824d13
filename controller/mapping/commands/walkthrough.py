"""``snakewalk world walkthrough``: a film along several stereo positions, and their ground."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.loader import load
from snakewalk.config.reading import texts
from snakewalk.config.walkthrough import WalkthroughConfig
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force, Json, show
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.controller.console.result_files import atomic_write, refuse_to_overwrite
from snakewalk.controller.mapping.commands.elevation import (
    Fill,
    Picture,
    check_fill,
    check_world_files,
    finish,
    not_positive,
)
from snakewalk.controller.mapping.commands.stereo import Error, SampleSpacing
from snakewalk.controller.mapping.world_file import MapWorld

if TYPE_CHECKING:
    from snakewalk.controller.mapping.mosaic.walk import Step

Positions = Annotated[Path, typer.Argument(help="file of the positions and their pictures (.toml)")]
Out = Annotated[Path, typer.Option("--out", "-o", help="write the film here (.mp4)")]
Seconds = Annotated[
    float, typer.Option(min=0.1, max=600.0, help="duration of the film between two positions")
]
Fps = Annotated[int, typer.Option(min=1, max=120, help="frames per second of the film")]
Size = Annotated[str, typer.Option(help="WIDTHxHEIGHT of the film in pixels, both even")]
World = Annotated[
    Path | None,
    typer.Option(help="write the ground of the route, with colours and holes, as a world (.toml)"),
]
MeshFile = Annotated[
    Path | None, typer.Option("--mesh", help="write the place as a textured mesh (.glb)")
]
Alone = Annotated[
    bool,
    typer.Option(
        "--alone", help="draw the morphing model alone; leave its holes empty, as in the paper"
    ),
]


@command(
    "world walkthrough",
    examples=(
        "world walkthrough positions.toml -o film.mp4",
        "world walkthrough positions.toml -o film.mp4 --world ravine.toml --spacing 0.02",
    ),
)
def walkthrough(
    positions: Positions,
    out: Out,
    seconds: Seconds = 2.0,
    fps: Fps = 25,
    size: Size = "640x480",
    alone: Alone = False,
    world: World = None,
    mesh: MeshFile = None,
    spacing: SampleSpacing = 0.03,
    error: Error = 0.03,
    fill: Fill = 0.0,
    picture: Picture = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Film a walk along several stereo positions: each local model morphs into the next one."""
    require_extra("walk-throughs need", "cv2", "PIL", "av", "trimesh")
    faults = not_positive({"--spacing": spacing, "--error": error})
    check_fill(fill, faults)
    if out.suffix != ".mp4":
        faults.append(f"{out}: a film ends in .mp4; choose another name")
    if mesh and mesh.suffix.lower() != ".glb":
        faults.append(f"{mesh}: a mesh ends in .glb; choose another name")
    if picture and not world:
        faults.append("--picture: draws the world; add --world")
    size_px = _size(size, faults)
    if faults:
        raise InputError(faults)
    refuse_to_overwrite([out, *([mesh] if mesh else [])], force)
    if world:
        check_world_files(world, picture, [positions, out], force)
    config = load(positions, WalkthroughConfig)
    from snakewalk.controller.mapping.mosaic import (  # noqa: PLC0415  an extra
        place_mesh,
        route,
        walk,
        walk_ground,
    )

    with ProgressBar("models", transient=True) as bar:
        walk_steps = walk.read_walk(positions, config, bar.update)
    ground = None
    if world:
        ground = walk_ground.walk_ground(walk_steps, spacing, error, fill)
    if mesh:
        with atomic_write(mesh) as part:
            place_mesh.write_place(part, walk_steps, error)
    per_step = max(1, round(seconds * fps))
    with ProgressBar("frames", transient=True) as bar, atomic_write(out) as part:
        facts = route.film(
            walk_steps, part, size_px, per_step, fps, alone=alone, on_frame=bar.update
        )
    shown = {
        "film": str(out),
        **({"mesh": str(mesh)} if mesh else {}),
        "frames": facts.frames,
        "frame_ms": round(1000.0 * facts.frame_s, 1),
        "hole_share": round(facts.hole_share, 4),
        "valid_share": [round(float(model.valid.mean()), 4) for model in walk_steps.models],
        **(_step_facts(walk_steps.steps) if walk_steps.steps or as_json else {}),
        "facts": texts(walk_steps.calibration.facts),
        "notes": list(walk_steps.calibration.notes),
    }
    if not world or not ground:
        show(shown, as_json)
        return
    written = MapWorld.of(world, ground)
    written.write(
        [
            f"From {positions.name}, {len(walk_steps.models)} positions; "
            f"samples {spacing:g} m apart.",
            "(0, 0) is below the first left camera, x is where it looked.",
            *([f"Holes narrower than {fill:g} m were filled and count as known."] if fill else []),
        ]
    )
    finish(written, shown, picture, as_json=as_json)


def _size(text: str, faults: list[str]) -> tuple[int, int]:
    """Width and height of ``--size``; appends a fault if invalid."""
    match = re.fullmatch(r"([0-9]+)x([0-9]+)", text)
    wide, tall = map(int, match.groups()) if match else (0, 0)
    if not (16 <= wide <= 4096 and 16 <= tall <= 4096) or wide % 2 or tall % 2:
        faults.append(f"--size {text}: must be even numbers from 16 to 4096, such as 640x480")
    return wide, tall


def _step_facts(steps: "Sequence[Step]") -> dict[str, object]:
    """Lists with a value per pair of successive positions."""
    facts: dict[str, object] = {
        "matches": [step.matches for step in steps],
        "inliers": [step.inliers for step in steps],
        "reprojection_px": [round(step.error_px, 2) for step in steps],
        "distance_m": [round(step.distance_m, 4) for step in steps],
        "place_sd_mm": [_milli(step.place_sd_m) for step in steps],
        "angle_sd_mrad": [_milli(step.angle_sd_rad) for step in steps],
        "common_share": [round(step.common_share, 3) for step in steps],
    }
    errors_mm = [_milli(step.place_error_m) for step in steps]
    if any(error is not None for error in errors_mm):
        facts["place_error_mm"] = errors_mm
        facts["angle_error_mrad"] = [_milli(step.angle_error_rad) for step in steps]
    return facts


def _milli(value: float | None) -> float | None:
    """Return a number in thousandths, rounded; None if it is unknown."""
    return None if value is None else round(1000.0 * value, 2)
