"""``snakewalk calibrate``: find out which servo is which joint, and write the robot's file."""

import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.config.joint_names import joint_label
from snakewalk.config.loader import load_robot
from snakewalk.config.robot import RobotConfig
from snakewalk.config.template import robot_toml
from snakewalk.controller.bench import chain_calibration
from snakewalk.controller.bench.chain_calibration import SeenBend
from snakewalk.controller.bench.eeprom_backup import back_up, backup_text
from snakewalk.controller.bench.fingerprints import read_fingerprints, write_fingerprints
from snakewalk.controller.bench.homing_offset import homing_written, plan_homing, without_zeros
from snakewalk.controller.bench.scan import pick_port
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import BUS, command
from snakewalk.controller.console.options import Force, Json, Port, console, show
from snakewalk.controller.console.result_files import atomic_write, refuse_to_overwrite
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.port.network_port import open_port
from snakewalk.drivers.safety.stop_button import StopButton

if TYPE_CHECKING:
    from snakewalk.config.robot import RobotConfig
    from snakewalk.controller.bench.chain_calibration import SeenBend
    from snakewalk.controller.bench.homing_offset import HomingOffset


Sweep = Annotated[
    bool, typer.Option("--sweep/--no-sweep", help="look for the ends of each joint's range")
]
ToEeprom = Annotated[
    bool,
    typer.Option(
        "--homing-offset",
        help="zeros into the servos' EEPROM, Homing Offset(20), after a question, not the file",
    ),
]


@command("calibrate", group=BUS, examples=("calibrate --robot alternating16 -o my-robot.toml",))
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
    sweep: Sweep = True,
    homing_offset: ToEeprom = False,
    yes: Annotated[
        bool, typer.Option("--yes", "-y", help="with --homing-offset: write without asking")
    ] = False,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Wiggle one servo at a time, weakly, ask which joint moved, and write the robot's file.

    Hang the robot up, or hold it: joints should carry no weight. Then lay it straight when asked.
    """
    if out.suffix != ".toml":
        raise InputError(f"{out}: a robot's file ends in .toml")
    if not 0.0 < current <= 2.0:
        raise InputError(f"--current {current:g}: over 0 and at most 2 A")
    if homing_offset and not yes and not sys.stdin.isatty():
        raise InputError("--homing-offset: asks before it writes, and nobody is there: say --yes")
    if yes and not homing_offset:
        raise InputError("--yes: goes with --homing-offset; the robot's file is always written")
    backup = out.with_name(f"{out.stem}-eeprom.json") if homing_offset else None
    refuse_to_overwrite([out, backup], force)
    like = load_robot(robot)
    if like.limbs:
        raise InputError(f"robot {like.name}: has legs; calibrate knows chains without")
    device = pick_port(port)
    heading = f"Found by snakewalk calibrate, like {like.name}."
    facts: dict[str, object] = {"robot": str(out)}
    with (
        open_port(device, baud or like.servo.baud) as line,
        StopButton(out.stem, device) as button,
    ):
        if backup is not None:  # before anything is written: what a chain needs is EEPROM, too
            chain_calibration.find_servos(line, line.latency_s)
            _write(backup, backup_text(back_up(line, line.latency_s)))
        found = chain_calibration.calibrate(
            line,
            like,
            _Person(like),
            name=out.stem,
            latency_s=line.latency_s,
            current_a=current,
            sweep=sweep,
            stop_requested=button.pressed,
            on_progress=lambda step: typer.echo(step, err=True),
        )
        described = found.robot
        if baud is not None:
            servo = described.servo.model_copy(update={"baud": baud})
            described = described.model_copy(update={"servo": servo})
        _write(out, robot_toml(described, heading))
        if backup is not None:
            bus = DynamixelBus(line, described.models_by_id, latency_s=line.latency_s)
            offsets = plan_homing(bus, described)
            written = yes or _confirmed(offsets, backup)
            if written:
                described = without_zeros(described)
                there = "The zeros are in the servos, in Homing Offset(20)."
                with homing_written(bus, offsets):
                    _write(out, robot_toml(described, f"{heading}\n{there}"))
            after = {str(each.servo_id): each.after for each in offsets}
            facts |= {"backup": str(backup), "homing_offsets": after, "homing_written": written}
        bus = DynamixelBus(line, described.models_by_id, latency_s=line.latency_s)
        fingerprints = write_fingerprints(out, read_fingerprints(bus, described.servo_ids))
        facts["fingerprints"] = str(fingerprints)
    _show(described, found.notes, facts, as_json)


def _write(out: Path, text: str) -> None:

    with atomic_write(out) as part:
        part.write_text(text, encoding="utf-8")


def _confirmed(offsets: "Sequence[HomingOffset]", backup: Path) -> bool:
    """Show the servos' registers as they would be, and ask."""
    for each in offsets:
        typer.echo(f"ID {each.servo_id}: Homing Offset {each.before} -> {each.after}", err=True)
    question = f"write this into the servos? what they hold now is in {backup}"
    return typer.confirm(question, default=False, err=True)


class _Person:
    """Asks at the terminal."""

    def __init__(self, robot: RobotConfig) -> None:
        self._axes, self._names = robot.joint_axes, robot.joint_names

    def which(
        self, servo_id: int, wiggle: Callable[[], None], known: Mapping[int, int]
    ) -> "SeenBend":
        """Wiggle until the answers make sense."""
        while True:
            wiggle()
            answer = _ask(f"ID {servo_id}: which joint moved? 1 is next to the head, a = again: ")
            if not answer.isdigit() or not 1 <= int(answer) <= len(self._axes):
                continue
            joint = int(answer) - 1
            if joint in known:
                label = joint_label(self._names[joint], known[joint])
                typer.echo(f"{label}: its servo is known already", err=True)
                continue
            yaw = self._axes[joint] == "y"
            asked = "to the left or right (l, r)" if yaw else "up or down (u, d)"
            label = joint_label(self._names[joint], servo_id)
            side = _ask(f"{label}: the head side went first {asked}, a = again: ").lower()
            if side[:1] in ("l", "r") if yaw else side[:1] in ("u", "d"):
                return SeenBend(joint, 1 if side[0] in "lu" else -1)

    def straighten(self) -> None:
        """Wait until the body is straight."""
        _ask("torque is off: lay the body straight and level, then press Enter: ")


def _ask(question: str) -> str:

    typer.echo(question, nl=False, err=True)
    try:
        return input().strip()
    except EOFError:
        raise InputError("calibrate asks what has moved: answers came to an end") from None


def _show(
    robot: "RobotConfig", notes: "Sequence[str]", facts: dict[str, object], as_json: bool
) -> None:
    if not as_json:
        rows = zip(robot.signs, robot.zeros_rad, robot.limit_rad, strict=True)
        for joint, (sign, zero, limit) in enumerate(rows):
            console.print(
                f"{robot.joint_label(joint)}: sign {sign:+d}, zero {zero:+.3f} rad, "
                f"limit {limit:g} rad"
            )
        for note in notes:
            console.print(f"look at {note}")
    else:
        facts |= {
            "ids": list(robot.servo_ids),
            "signs": list(robot.signs),
            "zeros_rad": list(robot.zeros_rad),
            "limits_rad": list(robot.limit_rad),
            "notes": list(notes),
        }
    show(facts, as_json)
