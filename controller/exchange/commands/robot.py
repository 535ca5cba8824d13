"""``snakewalk robot``: a robot in figures, and as files of other programs."""

from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.table import Table

from snakewalk.config.errors import Assumptions, InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.loader import load_robot
from snakewalk.config.template import robot_toml
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Assume, Force, Json, RobotName, console, show
from snakewalk.controller.console.result_files import atomic_write, refuse_to_overwrite
from snakewalk.controller.exchange.robot_export import mjcf_text, urdf_text


@command("robot show", examples=("robot show alternating16", "robot show my.toml"))
def show_robot(name: RobotName, as_json: Json = False) -> None:
    """Show a robot: its links, and servo, sign, zero and limit of each joint."""
    robot = load_robot(name)
    columns = (robot.servo_ids, robot.servo_models, robot.signs, robot.zeros_rad, robot.limit_rad)
    joints: list[dict[str, object]] = [
        {
            "joint": k,
            "axis": axis,
            "id": i,
            "model": m,
            "sign": s,
            "zero_rad": z,
            "limit_rad": limit,
        }
        for k, (axis, i, m, s, z, limit) in enumerate(
            zip(robot.all_axes, *columns, strict=True), start=1
        )
    ]
    links: list[dict[str, object]] = [
        {"link": k, "length_m": length_m, "mass_kg": mass_kg, "radius_m": radius_m, "shape": shape}
        for k, (length_m, mass_kg, radius_m, shape) in enumerate(
            zip(
                robot.link_lengths_m,
                robot.link_masses_kg,
                robot.link_radii_m,
                robot.link_shapes,
                strict=True,
            )
        )
        if robot.links
    ]
    facts: dict[str, object] = {
        "robot": robot.name,
        "links": robot.link_count,
        "link_length_m": round(robot.mean_link_length_m, 4),
        "body_radius_m": robot.body_radius_m,
        "length_m": round(robot.length_m, 4),
        "mass_kg": round(robot.mass_kg, 4),
        "baud": robot.servo.baud,
        "supply_v": robot.servo.supply_v,
    }
    show(facts | ({"joints": joints, "each_link": links} if as_json else {}), as_json)
    for rows in () if as_json else (joints, links):
        if rows:
            table = Table(*(key.replace("_", " ") for key in rows[0]), box=None)
            for row in rows:
                table.add_row(*map(str, row.values()))
            console.print(table)


@command(
    "robot import",
    examples=(
        "robot import snake.urdf -o snake.toml",
        "robot import swimmer.xml -o swimmer.toml --scale 0.1 --servo XL330-M288",
    ),
)
def import_robot(
    file: Annotated[Path, typer.Argument(help="URDF, xacro or MuJoCo model (.xml)")],
    out: Annotated[Path, typer.Option("--out", "-o", help="the robot's file (.toml)")],
    servo: Annotated[
        str, typer.Option(help="model of all servos, which such files do not know")
    ] = ("XM430-W350"),
    scale: Annotated[float, typer.Option(help="lengths times this, masses times its cube")] = 1.0,
    reverse: Annotated[bool, typer.Option(help="the model's first body is the tail")] = False,
    assume: Assume = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Make a robot's file of another program's model; report what was dropped or changed."""
    require_extra("MuJoCo models and URDF need", "mujoco")
    from snakewalk.controller.exchange.robot_import import robot_import  # noqa: PLC0415

    if out.suffix != ".toml":
        raise InputError(f"{out}: a robot's file ends in .toml")
    if not 1e-3 <= scale <= 1e3:
        raise InputError(f"--scale {scale:g}: 0.001 to 1000")
    refuse_to_overwrite([out], force)
    made = robot_import.import_robot(
        file,
        out.stem,
        servo,
        scale=scale,
        reverse=reverse,
        assumed=Assumptions(assume or ()),
    )
    joints = ", ".join(made.joint_names)
    comment = [f"From {file.name} by snakewalk robot import. Joints from the head: {joints}."]
    comment += [f"- {note}" for note in made.notes]
    with atomic_write(out) as part:
        part.write_text(robot_toml(made.robot, "\n".join(comment)), encoding="utf-8")
    facts: dict[str, object] = {
        "robot": str(out),
        "joints": made.robot.joint_count,
        "axes": made.robot.joint_axes,
        "length_m": round(made.robot.length_m, 4),
        "mass_kg": round(made.robot.mass_kg, 4),
        "kinematics_error_m": made.kinematics_error_m,
    }
    show(facts | ({"notes": list(made.notes)} if as_json else {}), as_json)
    for note in () if as_json else made.notes:
        console.print(f"- {note}", markup=False)


@command("robot export", examples=("robot export yaw16 --urdf yaw16.urdf --mjcf yaw16.xml",))
def export_robot(
    name: RobotName,
    urdf: Annotated[Path | None, typer.Option(help="write a URDF here")] = None,
    mjcf: Annotated[
        Path | None, typer.Option(help="write a MuJoCo model here, on a level floor")
    ] = None,
    ros2_control: Annotated[
        Literal["topic", "dynamixel"] | None,
        typer.Option(
            help="with a tag for ros2_control in the URDF: topic drives snakewalk ros, dynamixel "
            "the servos without it",
            show_default=False,
        ),
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write a robot for other programs: the same masses and kinematics."""
    if urdf is None and mjcf is None:
        raise InputError("say what to write: --urdf FILE, --mjcf FILE, or both")
    if ros2_control is not None and urdf is None:
        raise InputError(f"--ros2-control {ros2_control}: is a part of a URDF: give --urdf FILE")
    refuse_to_overwrite([urdf, mjcf], force)
    robot = load_robot(name)
    texts = {}
    if urdf is not None:
        texts[urdf] = urdf_text(robot, ros2_control)
    if mjcf is not None:
        require_extra("MuJoCo models need", "mujoco")
        texts[mjcf] = mjcf_text(robot)
    for path, text in texts.items():
        with atomic_write(path) as part:
            part.write_text(text, encoding="utf-8")
    show({"robot": robot.name, "urdf": urdf and str(urdf), "mjcf": mjcf and str(mjcf)}, as_json)
