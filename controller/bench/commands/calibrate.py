"""``snakewalk bus calibrate``: find the joint of each servo, and write the robot's file."""

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from snakewalk.config.errors import InputError
from snakewalk.config.joint_names import joint_label
from snakewalk.config.loader import load_robot
from snakewalk.config.robot import RobotConfig
from snakewalk.config.template import plain_toml
from snakewalk.controller.bench.calibration import chain_calibration
from snakewalk.controller.bench.calibration.progress import ProgressFile, SeenBend
from snakewalk.controller.bench.eeprom_backup import back_up, backup_text
from snakewalk.controller.bench.fingerprints import read_fingerprints, write_fingerprints
from snakewalk.controller.bench.homing_offset import homing_written, plan_homing, without_zeros
from snakewalk.controller.bench.scan import pick_port
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force, Json, Port, console, show
from snakewalk.controller.console.result_files import (
    check_ending,
    refuse_to_overwrite,
    write_result,
)
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.bus.feetech_bus import servo_bus
from snakewalk.drivers.port.network_port import open_port
from snakewalk.drivers.safety.stop_button import StopButton

if TYPE_CHECKING:
    from snakewalk.controller.bench.homing_offset import HomingOffset

Sweep = Annotated[
    bool, typer.Option("--sweep/--no-sweep", help="search for the ends of each joint's range")
]
ToEeprom = Annotated[
    bool,
    typer.Option(
        "--homing-offset",
        help="write the zeros into Homing Offset of the servos instead of the file; asks first",
    ),
]


@command("bus calibrate", examples=("bus calibrate --robot alternating16 -o my-robot.toml",))
def calibrate(
    out: Annotated[Path, typer.Option("--out", "-o", help="write the robot's file here (.toml)")],
    robot: Annotated[
        str,
        typer.Option(
            help="shipped robot, or a TOML file, with the same axes and links",
            autocompletion=completion.ROBOTS,
        ),
    ] = "alternating16",
    port: Port = None,
    baud: Annotated[
        int | None, typer.Option(help="baud rate of the servos; default: the robot file's rate")
    ] = None,
    current: Annotated[float, typer.Option(help="largest current of a servo in A")] = 0.3,
    sweep: Sweep = True,
    homing_offset: ToEeprom = False,
    yes: Annotated[
        bool, typer.Option("--yes", "-y", help="with --homing-offset: write without asking")
    ] = False,
    resume: Annotated[
        bool,
        typer.Option("--resume", help="continue an interrupted calibration from OUT.part"),
    ] = False,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Move one servo at a time weakly, ask which joint moved, and write the robot's file.

    Hang the robot up or hold it, so that joints carry no weight. Later the command asks you to
    lay it straight. Each answer is saved at once in OUT.part; --resume continues from there.
    """
    _check_options(out, current, homing_offset=homing_offset, yes=yes)
    backup = out.with_name(f"{out.stem}-eeprom.json") if homing_offset else None
    # the backup of the first start has the registers as they were
    keeps_backup = resume and backup is not None and backup.exists()
    refuse_to_overwrite([out, None if keeps_backup else backup], force)
    like = load_robot(robot)
    _check_robot(like)
    answers = ProgressFile(out)
    journal = answers.start(like, resume=resume, force=force)
    device = pick_port(port)
    if resume:
        typer.echo(f"{answers.path}: {journal.known.summary}", err=True)
    heading = f"Found by snakewalk bus calibrate, like {like.name}."
    facts: dict[str, object] = {"robot": str(out)}
    with (
        open_port(device, baud or like.servo.baud) as line,
        StopButton(out.stem, device) as button,
        _answers_kept(answers),
    ):
        if (
            backup is not None and not keeps_backup
        ):  # before anything is written: a start writes EEPROM, too
            chain_calibration.find_servos(line, line.latency_s, feetech=like.is_feetech)
            write_result(backup, backup_text(back_up(line, line.latency_s)))
        outcome = chain_calibration.calibrate(
            line,
            like,
            _Person(like),
            name=out.stem,
            settings=chain_calibration.CalibrationSettings(line.latency_s, current, sweep),
            stop_requested=button.pressed,
            on_progress=lambda step: typer.echo(step, err=True),
            journal=journal,
        )
        described = outcome.robot if baud is None else _at_baud(outcome.robot, baud)
        write_result(out, plain_toml(described, heading))
        if backup is not None:
            bus = servo_bus(line, described.models_by_id, latency_s=line.latency_s)
            described, homing = _with_homing(bus, described, out, heading, backup, yes)
            facts |= homing
        bus = servo_bus(line, described.models_by_id, latency_s=line.latency_s)
        fingerprints = write_fingerprints(out, read_fingerprints(bus, described.servo_ids))
        facts["fingerprints"] = str(fingerprints)
    answers.remove()
    _show(described, outcome.notes, facts, as_json)


def _check_robot(like: RobotConfig) -> None:
    if like.limbs:
        raise InputError(
            f"robot {like.name}: has legs; calibrate supports only chains without legs"
        )
    if like.is_mixed:
        raise InputError(
            f"robot {like.name}: has servos of different series on its ports; calibrate knows one "
            "series: calibrate the joints of each port as a robot of its own, and join the files"
        )


def _check_options(out: Path, current: float, *, homing_offset: bool, yes: bool) -> None:
    check_ending(out, "a robot's file", ".toml")
    if not 0.0 < current <= 2.0:
        raise InputError(f"--current {current:g}: over 0 and at most 2 A")
    if homing_offset and not yes and not sys.stdin.isatty():
        raise InputError(
            "calibrate --homing-offset asks first, but a terminal is missing; add --yes"
        )
    if yes and not homing_offset:
        raise InputError("--yes: goes with --homing-offset; the robot's file is always written")


def _at_baud(robot: RobotConfig, baud: int) -> RobotConfig:
    return robot.model_copy(update={"servo": robot.servo.model_copy(update={"baud": baud})})


def _with_homing(
    bus: DynamixelBus, described: RobotConfig, out: Path, heading: str, backup: Path, yes: bool
) -> tuple[RobotConfig, dict[str, object]]:
    """Write the zeros into the servos, after a question; returns the robot, and facts to show."""
    offsets = plan_homing(bus, described)
    written = yes or _confirm_registers(offsets, backup)
    if written:
        described = without_zeros(described)
        there = "The zeros are in the servos, in Homing Offset."
        with homing_written(bus, offsets):
            write_result(out, plain_toml(described, f"{heading}\n{there}"))
    after = {str(offset.servo_id): offset.after for offset in offsets}
    return described, {
        "backup": str(backup),
        "homing_offsets": after,
        "homing_written": written,
    }


@contextmanager
def _answers_kept(answers: ProgressFile) -> Iterator[None]:
    """Report after an interruption where the answers are, and how to continue."""
    try:
        yield
    except BaseException:
        if answers.path.exists():
            typer.echo(
                f"{answers.path}: holds the answers so far; continue with the same command and "
                "--resume",
                err=True,
            )
        raise


def _confirm_registers(offsets: "Sequence[HomingOffset]", backup: Path) -> bool:
    """Show the servos' registers as they would be, and ask."""
    for offset in offsets:
        typer.echo(
            f"ID {offset.servo_id}: Homing Offset {offset.before} -> {offset.after}", err=True
        )
    question = f"write this into the servos? what they hold now is in {backup}"
    return typer.confirm(question, default=False, err=True)


class _Person:
    """Asks at the terminal."""

    def __init__(self, robot: RobotConfig) -> None:
        self._axes = robot.joint_axes
        self._names = robot.joint_names

    def which(
        self, servo_id: int, wiggle: Callable[[], None], id_by_joint: Mapping[int, int]
    ) -> SeenBend:
        """Wiggle until the answers make sense; each repeated question has its reason."""
        while True:
            wiggle()
            joint = self._joint(servo_id, id_by_joint)
            direction = None if joint is None else self._direction(joint, servo_id)
            if joint is not None and direction is not None:
                return SeenBend(joint=joint, direction=direction)

    def straighten(self) -> None:
        _ask("torque is off: lay the body straight and level, then press Enter: ")

    def _joint(self, servo_id: int, id_by_joint: Mapping[int, int]) -> int | None:
        """Ask for the joint; None: the servo has to move again."""
        count = len(self._axes)
        while True:
            answer = _ask(
                f"ID {servo_id}: which joint moved? 1 is next to the head, a = again, q = stop: "
            )
            if answer.lower() == "a":
                return None
            if not answer.isdecimal() or not 1 <= int(answer) <= count:
                typer.echo(
                    f"'{answer}': not a joint; type a number from 1 to {count}, or a to see ID "
                    f"{servo_id} move again",
                    err=True,
                )
                continue
            joint = int(answer) - 1
            if joint not in id_by_joint:
                return joint
            label = joint_label(self._names[joint], id_by_joint[joint])
            free = ", ".join(str(index + 1) for index in range(count) if index not in id_by_joint)
            typer.echo(
                f"{answer} is {label}, assigned by an earlier answer; ID {servo_id} moves again, "
                f"one of the joints {free}. If the earlier answer was wrong, press Ctrl-C and "
                "start again with --force",
                err=True,
            )
            return None

    def _direction(self, joint: int, servo_id: int) -> Literal[1, -1] | None:
        """Ask for the side; None: the servo has to move again."""
        letters = "lr"
        asked = "to the left or right (l, r)"
        if self._axes[joint] != "y":
            letters = "ud"
            asked = "up or down (u, d)"
        label = f"{joint + 1} is {joint_label(self._names[joint], servo_id)}"
        while True:
            side = _ask(f"{label}: the head side went first {asked}, a = again: ").lower()
            if side[:1] == "a":
                return None
            if side and side[0] in letters:
                return 1 if side[0] == letters[0] else -1
            typer.echo(
                f"'{side}': not a direction of this joint; type {letters[0]} or {letters[1]}, or "
                f"a to see ID {servo_id} move again",
                err=True,
            )


def _ask(question: str) -> str:
    typer.echo(question, nl=False, err=True)
    try:
        answer = input().strip()
    except EOFError:
        raise InputError("calibrate: the input ended before the last question") from None
    if answer.lower() == "q":
        raise KeyboardInterrupt
    return answer


def _show(
    robot: RobotConfig, notes: Sequence[str], facts: dict[str, object], as_json: bool
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
