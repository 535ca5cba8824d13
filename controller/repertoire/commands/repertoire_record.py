"""``snakewalk gait repertoire record``: actions from the physics."""

from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.constants import DEFAULT_ROBOT, DEFAULT_WORLD
from snakewalk.config.extras import require_extra
from snakewalk.config.loader import load_robot, load_world
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.console.options import Force, GivenRobot, Json
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.controller.console.result_files import (
    atomic_write,
    check_picture,
    refuse_to_overwrite,
)
from snakewalk.controller.repertoire import repertoire_recording as recording
from snakewalk.controller.repertoire.commands.action_table import (
    Picture,
    plots,
    show_actions,
)
from snakewalk.controller.repertoire.repertoire_planning import default_file, flat


@command(
    "gait repertoire record",
    examples=("gait repertoire record", "gait repertoire record -o yaw16.npz --json"),
    results=("out", "picture"),
)
def record(
    robot: GivenRobot = DEFAULT_ROBOT,
    world: Annotated[
        str,
        typer.Option(help="shipped flat world, or a TOML file", autocompletion=completion.WORLDS),
    ] = DEFAULT_WORLD,
    out: Annotated[
        Path | None,
        typer.Option(
            "-o", "--out", help="write the actions here; default: repertoire-ROBOT-WORLD.npz"
        ),
    ] = None,
    picture: Picture = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Simulate forward, left and right actions, and record a settled cycle of each."""
    check_picture(picture)
    body = load_robot(robot)
    ground = load_world(world)
    flat(ground)
    file = out or default_file(robot, world)
    refuse_to_overwrite([file, picture], force)
    require_extra("recording needs", "mujoco")
    with ProgressBar("record", float(len(recording.ACTIONS))) as bar:
        begun: list[str] = []

        def on_progress(name: str, share: float) -> None:
            if name not in begun:
                begun.append(name)
            bar.update(len(begun) - 1 + share, description=name)

        repertoire = recording.record(body, ground, on_progress=on_progress)
        bar.update(float(len(recording.ACTIONS)), description="recorded")
    for line in repertoire.contradictions():
        LOGGER.warning("%s", line)
    with atomic_write(file) as part:
        repertoire.save(part)
    if picture is not None:
        plots().draw_actions(repertoire, picture)
    show_actions(file, repertoire, as_json)
