"""``snakewalk gait run``: a gait on servos or in the simulator."""

from pathlib import Path
from typing import Annotated

import typer

from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import (
    Compliant,
    Robot,
    Set,
    Shadow,
    World,
)
from snakewalk.controller.console.run_options import RunOptions
from snakewalk.controller.run.commands.gait_options import Name, Param
from snakewalk.controller.run.gait_job import GaitJob

Then = Annotated[
    list[str] | None,
    typer.Option(help="NAME@S[,PARAM=V]: change to gait NAME after S seconds; may be repeated"),
]
By = Annotated[
    str,
    typer.Option(
        help="method for changes of the gait: blend, or cpg (coupled oscillators)",
        autocompletion=completion.words("blend", "cpg"),
    ),
]
LookHeading = Annotated[
    float | None, typer.Option(help="world heading that the head keeps, in rad")
]
LookAt = Annotated[str | None, typer.Option(help="X,Y in metres: point that the head looks at")]
Live = Annotated[
    bool,
    typer.Option("--live", help="change the motion by keys, or in the page with --view"),
]
OnGamepad = Annotated[
    Path | None, typer.Option(help="change the motion with a gamepad, e.g. /dev/input/js0")
]


@command(
    "gait run",
    examples=(
        "gait run sidewinding --param lift_rad=0.15 --seconds 10",
        "gait run lateral-undulation --robot yaw16 --live",
        "gait run rolling --port /dev/ttyUSB0",
    ),
)
def run_gait(
    name: Name,
    robot: Robot = None,
    world: World = None,
    param: Param = None,
    set_: Set = None,
    then: Then = None,
    by: By = "blend",
    seconds: Annotated[float, typer.Option(help="duration of the motion in seconds")] = 20.0,
    look_heading_rad: LookHeading = None,
    look_at: LookAt = None,
    live: Live = False,
    gamepad: OnGamepad = None,
    compliance: Compliant = None,
    shadow: Shadow = False,
    seed: Annotated[int, typer.Option(help="seed of every random choice")] = 0,
    *,
    options: RunOptions,
) -> None:
    """Run a gait on servos or in the simulator; leaves a log, a report and a film."""
    GaitJob(
        name=name, robot=robot, world=world, param=param, keys=set_, then=then, by=by,
        seconds=seconds, look_heading_rad=look_heading_rad, look_at=look_at, live=live,
        gamepad=gamepad, compliance=compliance, shadow=shadow, seed=seed, options=options,
    ).carry_out()  # fmt: skip
