"""``snakewalk gait repertoire crowd``: many bodies on a terrain, as a film."""

from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.ground import build_ground
from snakewalk.config.key_types import SEED, Seed
from snakewalk.config.loader import load_robot, load_world
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force, Json, show
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.controller.console.result_files import atomic_write
from snakewalk.controller.repertoire.crowd_film import FPS, SIZE_PX, CrowdScene, film_crowd
from snakewalk.controller.repertoire.repertoire import load_repertoire
from snakewalk.sim.rendering.crowd_film import CrowdView


@command(
    "gait repertoire crowd",
    examples=("gait repertoire crowd", "gait repertoire crowd --bodies 300 -o herd.mp4"),
    results=("out",),
)
def crowd(
    file: Annotated[Path, typer.Argument(help="file of recorded actions")] = Path(
        "repertoire-yaw16-flat.npz"
    ),
    world: Annotated[
        str, typer.Option(help="shipped world with hills, or a TOML file")
    ] = "jacksboro-basin",
    bodies: Annotated[int, typer.Option(min=1, max=5000, help="number of animals")] = 100,
    seconds: Annotated[
        float, typer.Option(min=0.1, max=600.0, help="duration of the film in seconds")
    ] = 20.0,
    out: Annotated[Path, typer.Option("-o", "--out", help="write the film here (.mp4)")] = Path(
        "crowd.mp4"
    ),
    detail: Annotated[
        bool,
        typer.Option(
            "--detail/--no-detail", help="reduce detail with distance and skip hidden animals"
        ),
    ] = True,
    separate: Annotated[
        bool,
        typer.Option(
            "--separate/--no-separate", help="let an animal wait instead of entering another one"
        ),
    ] = True,
    seed: Seed = SEED,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Make a film of many animals that cross a terrain by recorded actions, without physics."""
    require_extra("films need", "av")
    if out.suffix != ".mp4":
        raise InputError(f"{out}: a film ends in .mp4")
    repertoire = load_repertoire(file)
    robot = load_robot(repertoire.robot)
    place = load_world(world)
    ground = build_ground(place)
    if ground is None:
        raise InputError(f"world {place.name}: has no hills; there are jacksboro-basin and others")
    scene = CrowdScene(
        repertoire, robot, ground, bodies, seed=seed, detail=detail, separate=separate
    )
    with atomic_write(out) as part, ProgressBar("film", seconds * FPS, transient=True) as bar:
        frames = film_crowd(
            scene,
            CrowdView(robot, place, ground, bodies, SIZE_PX),
            part,
            seconds=seconds,
            frame_s=repertoire.frame_s,
            on_frame=bar.update,
        )
    costs = scene.costs
    hidden, far, middle, near = (round(float(of), 1) for of in costs.levels / costs.frames)
    show(
        {
            "film": str(out),
            "world": place.name,
            "bodies": bodies,
            "frames": frames,
            "hidden_mean": hidden,
            "far_mean": far,
            "middle_mean": middle,
            "near_mean": near,
            "motion_ms_a_frame": round(1e3 * costs.motion_s / costs.frames, 3),
            "laying_ms_a_frame": round(1e3 * costs.laying_s / costs.frames, 3),
        },
        as_json,
    )
