"""``snakewalk robot import``: a robot file from another program's model."""

from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.reading import texts
from snakewalk.config.template import plain_toml
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force, Json, console, show
from snakewalk.controller.console.result_files import check_ending, write_result
from snakewalk.controller.exchange.robot_import import robot_import
from snakewalk.controller.exchange.robot_import.robot_choice import RobotChoice


@command(
    "robot import",
    examples=(
        "robot import snake.urdf -o snake.toml",
        "robot import swimmer.xml -o swimmer.toml --scale 0.1 --servo XL330-M288",
    ),
    results=("out",),
)
def import_robot(
    file: Annotated[Path, typer.Argument(help="URDF, xacro, SDF or MuJoCo model (.xml)")],
    out: Annotated[Path, typer.Option("--out", "-o", help="write the robot's file here (.toml)")],
    servo: Annotated[
        str, typer.Option(help="model of all servos; such files do not contain it")
    ] = ("XM430-W350"),
    force: Force = False,
    as_json: Json = False,
    *,
    choice: RobotChoice,
) -> None:
    """Make a robot's file from a URDF, SDF or MuJoCo model; report dropped and changed parts."""
    check_ending(out, "a robot's file", ".toml")
    imported = robot_import.import_robot(file, out.stem, servo, choice)
    joints = ", ".join(imported.joint_names)
    comment = [f"From {file.name} by snakewalk robot import. Joints from the head: {joints}."]
    comment += [f"- {note}" for note in imported.notes]
    write_result(out, plain_toml(imported.robot, "\n".join(comment)))
    facts: dict[str, object] = {
        "robot": str(out),
        "joints": imported.robot.joint_count,
        "axes": imported.robot.joint_axes,
        "length_m": round(imported.robot.length_m, 4),
        "mass_kg": round(imported.robot.mass_kg, 4),
        "kinematics_error_m": imported.kinematics_error_m,
        "facts": texts(imported.facts),
    }
    show(facts | ({"notes": list(imported.notes)} if as_json else {}), as_json)
    for note in () if as_json else imported.notes:
        console.print(f"- {note}", markup=False)
