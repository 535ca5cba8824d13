"""``snakewalk bus pendulum``: records a servo that swings a weight, for ``robot identify``."""

import json
from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.loader import load_robot
from snakewalk.controller.bench.calibration.pendulum import record
from snakewalk.controller.bench.port_lines import open_lines
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import ChainPort, Force, GivenRobot, Json, show
from snakewalk.controller.console.result_files import refuse_to_overwrite, write_result


@command(
    "bus pendulum",
    examples=("bus pendulum --robot xl330-16 --mass 0.49 --length 0.1 --gain 400 -o kp400.json",),
)
def pendulum(
    robot: GivenRobot,
    mass: Annotated[float, typer.Option(min=1e-3, help="mass of the weight in kg")],
    length: Annotated[float, typer.Option(min=1e-3, help="distance from shaft to weight in m")],
    out: Annotated[Path, typer.Option("--out", "-o", help="JSON file for robot identify")],
    servo_id: Annotated[int, typer.Option("--id", help="ID of the servo")] = 1,
    gain: Annotated[int, typer.Option(min=1, help="Position P Gain of the servo")] = 400,
    port: ChainPort = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Swing a weight by 1.2 rad for 6 s, let it fall for 2 s, and record the servo.

    The weight hangs still on its arm, and may turn freely. The servo's gain stays as set.
    """
    refuse_to_overwrite([out], force)
    like = load_robot(robot)
    with open_lines(port, like.servo.baud) as lines:
        entries = record(lines.open_servo(servo_id), like, servo_id, gain)
    about = {"motor": like.servo.model, "mass": mass, "length": length, "kp": gain}
    write_result(out, json.dumps(about | {"entries": entries}))
    show({"out": str(out), "entries": len(entries)}, as_json)
