"""``snakewalk gait repertoire crowd``: many bodies on a terrain, as a film or on a page."""

from pathlib import Path
from typing import Annotated, TypeVar

import numpy as np
import typer

from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.ground import build_ground, water_surface_m
from snakewalk.config.key_types import SEED, Seed
from snakewalk.config.loader import load_robot, load_world
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import VIEW_AT, Force, Json, ViewAt, show
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.controller.console.result_files import atomic_write
from snakewalk.controller.repertoire.behaviour import Wandering
from snakewalk.controller.repertoire.crowd_film import (
    FPS,
    SIZE_PX,
    CrowdScene,
    film_crowd,
    species_of,
)
from snakewalk.controller.repertoire.habit import SIZE, Habit
from snakewalk.controller.repertoire.repertoire import load_repertoire
from snakewalk.sim.rendering.crowd_film import CrowdView
from snakewalk.sim.rendering.crowd_mesh import COLOURS

T = TypeVar("T")


@command(
    "gait repertoire crowd",
    examples=(
        "gait repertoire crowd",
        "gait repertoire crowd small.npz large.npz --bodies 60 --bodies 3 --habit school "
        "--habit pursue --size 0.25 --size 0.5",
        "gait repertoire crowd --view",
    ),
    results=("out",),
)
def crowd(
    files: Annotated[
        list[Path] | None,
        typer.Argument(help="recorded actions of each species; default: repertoire-yaw16-flat.npz"),
    ] = None,
    world: Annotated[
        str, typer.Option(help="shipped world with hills or a shore, or a TOML file")
    ] = "jacksboro-basin",
    bodies: Annotated[
        list[int] | None,
        typer.Option(
            min=1, max=5000, help="number of animals, once or for each file; default: 100"
        ),
    ] = None,
    habit: Annotated[
        list[Habit] | None,
        typer.Option(help="goal of the animals, once or for each file; default: wander"),
    ] = None,
    size: Annotated[
        list[float] | None,
        typer.Option(
            min=0.05,
            max=5.0,
            help=f"mean size over the recorded robot's, once or for each file; default: {SIZE}",
        ),
    ] = None,
    seconds: Annotated[
        float, typer.Option(min=0.1, max=600.0, help="duration of the film in seconds")
    ] = 20.0,
    out: Annotated[Path, typer.Option("-o", "--out", help="write the film here (.mp4)")] = Path(
        "crowd.mp4"
    ),
    view: Annotated[
        bool, typer.Option("--view", help="show the animals in a browser and steer one of them")
    ] = False,
    view_at: ViewAt = VIEW_AT,
    seed: Seed = SEED,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Make a film of many animals that cross a terrain by recorded actions, without physics.

    Animals flee from those that pursue. Actions that were recorded in water need a world with a
    shore.
    """
    if not view:
        require_extra("films need", "av")
    if out.suffix != ".mp4":
        raise InputError(f"{out}: a film ends in .mp4")
    given = files or [Path("repertoire-yaw16-flat.npz")]
    repertoires = [load_repertoire(file) for file in given]
    place = load_world(world)
    ground = build_ground(place)
    if ground is None:
        raise InputError(f"world {place.name}: has no hills; there are jacksboro-basin and others")
    robots = [load_robot(repertoire.robot) for repertoire in repertoires]
    counts = _for_each("--bodies", bodies or [100], len(given))
    rows = zip(
        repertoires,
        robots,
        counts,
        _for_each("--size", size or [SIZE], len(given)),
        _for_each("--habit", habit or [Habit.WANDER], len(given)),
        strict=True,
    )
    species = [species_of(*row, seed + k) for k, row in enumerate(rows)]
    water = water_surface_m(place, ground)
    surface_m = -np.inf if water is None else float(water[0][2])
    wandering = Wandering(species, ground, seed=seed, surface_m=surface_m)
    if view:
        from snakewalk.controller.repertoire.crowd_page import serve_crowd  # noqa: PLC0415  viser

        serve_crowd(wandering, place, ground, repertoires[0].frame_s, view_at)
        return
    scene = CrowdScene(wandering, ground)
    most = sum(counts) if len(given) == 1 else len(COLOURS) * max(counts)
    with atomic_write(out) as part, ProgressBar("film", seconds * FPS, transient=True) as bar:
        frames = film_crowd(
            scene,
            CrowdView(robots[0], place, ground, most, SIZE_PX),
            part,
            seconds=seconds,
            frame_s=repertoires[0].frame_s,
            on_frame=bar.update,
        )
    costs = scene.costs
    names = ("hidden_mean", "far_mean", "middle_mean", "near_mean")
    means = (costs.levels / costs.frames).round(1).tolist()
    show(
        {
            "film": str(out),
            "world": place.name,
            "bodies": sum(counts),
            "frames": frames,
            "reached": int(wandering.reached.sum()),
            **dict(zip(names, means, strict=True)),
            "motion_ms_a_frame": round(1e3 * costs.motion_s / costs.frames, 3),
            "laying_ms_a_frame": round(1e3 * costs.laying_s / costs.frames, 3),
        },
        as_json,
    )


def _for_each(option: str, values: list[T], files: int) -> list[T]:
    """Return a value for each file.

    Raises:
        InputError: one line.

    """
    if len(values) not in {1, files}:
        raise InputError(f"{option}: {len(values)} values for {files} files; give one, or one each")
    return values * (files // len(values))
