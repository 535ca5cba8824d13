"""``snakewalk robot export``: a robot as files of other programs."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.loader import load_robot
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force, Json, RobotName, show
from snakewalk.controller.console.result_files import write_result
from snakewalk.controller.exchange.robot_export import CONTACT_NOTES, mjcf_text, urdf_text


@command(
    "robot export",
    examples=(
        "robot export yaw16 --urdf yaw16.urdf --mjcf yaw16.xml",
        "robot export yaw16 --mjcf yaw16.xml --actuators dcmotor",
    ),
    results=("urdf", "mjcf"),
)
def export_robot(
    name: RobotName,
    urdf: Annotated[Path | None, typer.Option(help="write a URDF here")] = None,
    mjcf: Annotated[
        Path | None, typer.Option(help="write a MuJoCo model here, on a level floor")
    ] = None,
    actuators: Annotated[
        Literal["dcmotor"] | None,
        typer.Option(
            help="add the servos to the MuJoCo model, as its DC motors with position control",
            show_default=False,
        ),
    ] = None,
    contact: Annotated[
        Literal["rollers", "isotropic", "none"] | None,
        typer.Option(
            help="friction of the MuJoCo model: a passive roller under each link, equal in all "
            "directions, or none; default: rollers (1.06 to 1.22 of the speed in snakewalk)",
            show_default=False,
        ),
    ] = None,
    ros2_control: Annotated[
        Literal["topic", "dynamixel"] | None,
        typer.Option(
            help="add a ros2_control tag to the URDF: topic drives snakewalk ros, dynamixel the "
            "servos directly",
            show_default=False,
        ),
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write a robot as URDF or MuJoCo model with the same masses and kinematics."""
    if urdf is None and mjcf is None:
        raise InputError("choose what to write: --urdf FILE, --mjcf FILE, or both")
    if ros2_control is not None and urdf is None:
        raise InputError(f"--ros2-control {ros2_control}: is a part of a URDF: give --urdf FILE")
    if actuators is not None and mjcf is None:
        raise InputError(f"--actuators {actuators}: is a part of a MuJoCo model: give --mjcf FILE")
    if contact is not None and mjcf is None:
        raise InputError(f"--contact {contact}: is a part of a MuJoCo model: give --mjcf FILE")
    robot = load_robot(name)
    texts = {}
    if urdf is not None:
        texts[urdf] = urdf_text(robot, ros2_control)
    if mjcf is not None:
        require_extra("MuJoCo models need", "mujoco")
        texts[mjcf] = mjcf_text(robot, actuators, contact or "rollers")
    for path, text in texts.items():
        write_result(path, text)
    result = {"robot": robot.name, "urdf": urdf and str(urdf), "mjcf": mjcf and str(mjcf)}
    if mjcf is not None:
        result["contact"] = CONTACT_NOTES[contact or "rollers"]
    show(result, as_json)
