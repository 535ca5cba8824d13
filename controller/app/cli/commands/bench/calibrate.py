"""``snakewalk calibrate``: find out which servo is which joint, and write the robot's file."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from snakewalk.controller.app.cli import completion
from snakewalk.controller.app.cli.options import Force, Json, Port, console, show

if TYPE_CHECKING:
    from snakewalk.controller.app.service.chain_calibration import ChainCalibration, SeenBend


def calibrate(
    out: Annotated[Path, typer.Option("--out", "-o", help="the robot's file (.toml)")],
    robot: Annotated[
        str,
        typer.Option(
            help="shipped robot, or a TOML file, with the same axes and links",
            autocompletion=completion.ROBOTS,
        ),
    ] = "alternating16",
    port: Port = None,
    baud: Annotated[int | None, typer.Option(help="default: as the robot says")] = None,
    current: Annotated[float, typer.Option(help="A, the most that a servo may use")] = 0.3,
    sweep: Annotated[
        bool, typer.Option("--sweep/--no-sweep", help="look for the ends of each joint's range")
    ] = True,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Wiggle one servo at a time, weakly, ask which joint moved, and write the robot's file.

    Hang the robot up, or hold it: joints should carry no weight. Then lay it straight when asked.
    """
    from snakewalk.config.errors import InputError  # noqa: PLC0415  --help stays quick
    from snakewalk.config.loader import load_robot  # noqa: PLC0415
    from snakewalk.config.robot_file import robot_toml  # noqa: PLC0415
    from snakewalk.controller.app.result_files import (  # noqa: PLC0415
        atomic_write,
        refuse_to_overwrite,
    )
    from snakewalk.controller.app.service import chain_calibration  # noqa: PLC0415
    from snakewalk.controller.app.service.scan import pick_port  # noqa: PLC0415
    from snakewalk.drivers.port.network_port import open_port  # noqa: PLC0415
    from snakewalk.drivers.safety.stop_button import StopButton  # noqa: PLC0415

    if out.suffix != ".toml":
        raise InputError(f"{out}: a robot's file ends in .toml")
    if not 0.0 < current <= 2.0:
        raise InputError(f"--current {current:g}: over 0 and at most 2 A")
    refuse_to_overwrite([out], force)
    like = load_robot(robot)
    if like.limbs:
        raise InputError(f"robot {like.name}: has legs; calibrate knows chains without")
    device = pick_port(port)
    with (
        open_port(device, baud or like.servo.baud) as line,
        StopButton(out.stem, device) as button,
    ):
        found = chain_calibration.calibrate(
            line,
            like,
            _Person(like.joint_axes),
            name=out.stem,
            latency_s=line.latency_s,
            current_a=current,
            sweep=sweep,
            stop_requested=button.pressed,
            on_progress=lambda step: typer.echo(step, err=True),
        )
    if baud is not None:
        servo = found.robot.servo.model_copy(update={"baud": baud})
        described = found.robot.model_copy(update={"servo": servo})
    else:
        described = found.robot
    with atomic_write(out) as part:
        text = robot_toml(described, f"Found by snakewalk calibrate, like {like.name}.")
        part.write_text(text, encoding="utf-8")
    _show(found, out, as_json)


class _Person:
    """Asks at the terminal."""

    def __init__(self, axes: str) -> None:
        self._axes = axes

    def which(
        self, servo_id: int, wiggle: Callable[[], None], known: Mapping[int, int]
    ) -> "SeenBend":
        """Wiggle until the answers make sense."""
        from snakewalk.controller.app.service.chain_calibration import SeenBend  # noqa: PLC0415

        while True:
            wiggle()
            answer = _ask(f"ID {servo_id}: which joint moved? 1 is next to the head, a = again: ")
            if not answer.isdigit() or not 1 <= int(answer) <= len(self._axes):
                continue
            joint = int(answer) - 1
            if joint in known:
                typer.echo(f"joint {answer} is ID {known[joint]} already", err=True)
                continue
            yaw = self._axes[joint] == "y"
            asked = "to the left or right (l, r)" if yaw else "up or down (u, d)"
            side = _ask(f"joint {answer}: the head side went first {asked}, a = again: ").lower()
            if side[:1] in ("l", "r") if yaw else side[:1] in ("u", "d"):
                return SeenBend(joint, 1 if side[0] in "lu" else -1)

    def straighten(self) -> None:
        """Wait until the body is straight."""
        _ask("torque is off: lay the body straight and level, then press Enter: ")


def _ask(question: str) -> str:
    from snakewalk.config.errors import InputError  # noqa: PLC0415

    typer.echo(question, nl=False, err=True)
    try:
        return input().strip()
    except EOFError:
        raise InputError("calibrate asks what has moved: answers came to an end") from None


def _show(found: "ChainCalibration", out: Path, as_json: bool) -> None:
    robot = found.robot
    if not as_json:
        rows = zip(robot.servo_ids, robot.signs, robot.zeros_rad, robot.limit_rad, strict=True)
        for joint, (servo_id, sign, zero, limit) in enumerate(rows, 1):
            console.print(
                f"joint {joint}: ID {servo_id}, sign {sign:+d}, zero {zero:+.3f} rad, "
                f"limit {limit:g} rad"
            )
        for note in found.notes:
            console.print(f"look at {note}")
    facts = {
        "robot": str(out),
        "ids": list(robot.servo_ids),
        "signs": list(robot.signs),
        "zeros_rad": list(robot.zeros_rad),
        "limits_rad": list(robot.limit_rad),
        "notes": list(found.notes),
    }
    show(facts if as_json else {"robot": str(out)}, as_json)
