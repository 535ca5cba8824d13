"""Recheck after an interruption: whether this is the same chain, in the same pose."""

import math
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.start_up import Inspection, inspect
from snakewalk.drivers.errors import ChainFault, FaultCause
from snakewalk.drivers.protocol.registers import ServoUnits

MOVED_RAD = 0.3
"""A joint found farther from its last position was bent, or has lost its turn count (ours)."""


@dataclass(frozen=True, slots=True)
class Recheck:
    """The chain as found, and every fault that forbids going on."""

    faults: tuple[ChainFault, ...]
    torque_off: tuple[int, ...]
    """Joints whose torque is off: their servos have rebooted."""
    moved_rad: Floats
    """(J,) from where each joint was last seen to where it is; NaN where it was not read."""

    def __str__(self) -> str:
        if self.faults:
            return "; ".join(map(str, self.faults))
        off = f", torque off at joint {', '.join(map(str, self.torque_off))}"
        moved = float(np.abs(self.moved_rad).max())
        return f"the same servos, moved by at most {moved:.3f} rad{off if self.torque_off else ''}"


def recheck(
    bus: DynamixelBus,
    robot: RobotConfig,
    units: ServoUnits,
    before: Inspection | None,
    position_rad: Floats,
) -> Recheck:
    """Compare model, firmware, alarm, torque and position with what they were.

    Args:
        bus: where the servos are.
        robot: whose they are.
        units: of their model.
        before: as found at the start; None: nothing to compare with.
        position_rad: (J,) where the joints were last seen.

    Raises:
        BusError: a servo stops answering meanwhile.
        PortError: the port is gone.

    """
    now = inspect(bus, robot)
    moved = np.full(robot.joint_count, np.nan)
    if now.faults:
        return Recheck(now.faults, (), moved)
    faults: list[ChainFault] = []
    known = {s.servo_id: s for s in before.servos} if before is not None else {}
    for joint, servo in enumerate(now.servos):
        old = known.get(servo.servo_id, servo)
        if servo.firmware != old.firmware:
            text = (
                f"servo {servo.servo_id}: firmware {servo.firmware}, was {old.firmware}: another "
                "servo?"
            )
            faults.append(ChainFault(FaultCause.OTHER_FIRMWARE, text))
        raw = np.array([bus.read(servo.servo_id, "Present Position")])
        moved[joint] = units.position_rad(raw)[0] - position_rad[joint]
        name = robot.joint_name(joint)
        turns = round(moved[joint] / math.tau) if np.isfinite(moved[joint]) else 0
        if turns:
            text = f"{name}: off by {turns:+d} turns: its turn count is lost"
            faults.append(ChainFault(FaultCause.TURN_COUNT_LOST, text))
        elif not abs(moved[joint]) <= MOVED_RAD:
            text = f"{name}: moved by {moved[joint]:+.2f} rad since it was last seen"
            faults.append(ChainFault(FaultCause.MOVED, text))
    off = tuple(joint for joint, servo in enumerate(now.servos) if not servo.torque_on)
    return Recheck(tuple(faults), off, moved)
