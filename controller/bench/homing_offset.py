"""Moves the zeros of a robot's file into the servos' Homing Offset.

A DYNAMIXEL servo adds register 20 to its position, with the same sign in reverse mode. A Feetech
servo subtracts register 31. After each write the position of a resting shaft must change by as
much.
"""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.config.servo_model import ServoModel
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.errors import BusError, DriverError

_REST_POSITIONS = 16
"""Largest change of a limp shaft between two readings, in positions: 1.4 degrees (ours)."""


@dataclass(frozen=True, slots=True)
class HomingOffset:
    """One servo's register."""

    servo_id: int
    before: int
    after: int
    """New homing offset, with which the straight joint is at the servo's own zero."""


def plan_homing(bus: DynamixelBus, robot: RobotConfig) -> tuple[HomingOffset, ...]:
    """Homing Offset for each joint's servo that replaces its ``zero_rad``, head first; reads only.

    Raises:
        InputError: offsets that a servo would ignore in position mode, or that move the joint's
            range out of its turn, all of them at once.
        BusError: a servo does not answer.

    """
    faults = []
    planned = []
    for joint, servo_id in enumerate(robot.servo_ids):
        table = bus.table_of(servo_id)
        row = table.facts.registers.get("Homing Offset")
        if row is None:
            faults.append(
                f"{robot.joint_label(joint)}: {table.model} has no Homing Offset; leave the zeros "
                "in the robot's file"
            )
            continue
        before = bus.read(servo_id, "Homing Offset")
        shift = round(robot.zeros_rad[joint] / table.rad_per_position)
        after = before - _sign(table.facts) * shift
        planned.append(HomingOffset(servo_id, before, after))
        reach_rad = abs(after) * table.rad_per_position + robot.limit_rad[joint]
        most = table.facts.units.homing_limit
        if most is None and row.sign_bit is not None and row.range is not None:
            most = row.range[1]  # a Feetech servo has no other values
        if (most is not None and abs(after) > most) or reach_rad > math.pi:
            why = (
                f"beyond {most} the servo ignores it in position mode"
                if most is not None and abs(after) > most
                else f"with its limit of {robot.limit_rad[joint]:g} rad it leaves the servo's turn"
            )
            faults.append(
                f"{robot.joint_label(joint)}: needs Homing Offset {after}: {why}; mount its horn "
                "nearer to the servo's centre, or leave the zeros in the robot's file"
            )
    if faults:
        raise InputError(faults)
    return tuple(planned)


@contextmanager
def homing_written(bus: DynamixelBus, offsets: Sequence[HomingOffset]) -> Iterator[None]:
    """Torque off, write, read back, and check that the position has moved with it.

    If that or the context's body fails, all servos get their old offsets again.

    Raises:
        BusError: a servo does not obey; names those that may have their new offset.

    """
    tried: list[HomingOffset] = []
    try:
        for offset in offsets:
            tried.append(offset)
            _write(bus, offset)
        yield
    except DriverError as error:
        raise BusError(f"{error}; {_restore_offsets(bus, tried)}") from error
    except BaseException:
        _restore_offsets(bus, tried)
        raise


def without_zeros(robot: RobotConfig) -> RobotConfig:
    """The robot whose servos store the straight pose as zero."""
    joints = tuple(joint.model_copy(update={"zero_rad": 0.0}) for joint in robot.joints)
    return robot.model_copy(update={"joints": joints})


def _sign(facts: ServoModel) -> int:
    """Change of the position for a change of the register by 1."""
    return -1 if facts.is_feetech else 1


def _write(bus: DynamixelBus, offset: HomingOffset) -> None:
    servo_id = offset.servo_id
    bus.write_verified(servo_id, "Torque Enable", 0)  # the EEPROM is locked while it is on
    was = bus.read(servo_id, "Present Position")
    bus.write_verified(servo_id, "Homing Offset", offset.after, kept=True)
    moved = bus.read(servo_id, "Present Position") - was
    expected = _sign(bus.table_of(servo_id).facts) * (offset.after - offset.before)
    if abs(moved - expected) > _REST_POSITIONS:
        raise BusError(
            f"servo {servo_id}: Homing Offset went from {offset.before} to {offset.after}, Present "
            f"Position by {moved:+d}: its shaft was turned meanwhile, or it counts otherwise"
        )


def _restore_offsets(bus: DynamixelBus, offsets: Sequence[HomingOffset]) -> str:
    """Write the old offsets again, and report the result."""
    faults = []
    for offset in offsets:
        try:
            bus.write_verified(offset.servo_id, "Homing Offset", offset.before, kept=True)
        except DriverError:
            faults.append(f"servo {offset.servo_id} ({offset.after}, was {offset.before})")
    if faults:
        return f"a new Homing Offset may be left in {', '.join(faults)}: restore the backup"
    return "all Homing Offsets are as they were"
