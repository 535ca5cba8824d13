"""Recheck after an interruption: whether chain and pose are the same."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.bus.chain_bus import ChainBus
from snakewalk.drivers.chain.fingerprint import Fingerprint, fingerprint_faults
from snakewalk.drivers.chain.joint_codec import JointUnits
from snakewalk.drivers.chain.start_up import IDENTITY, Inspection, identity_fault, inspect
from snakewalk.drivers.errors import ChainFault, FaultCause

MOVED_RAD = 0.3
"""A joint found farther from its last position was bent, or has lost its turn count (ours)."""

KEPT_RAD = 0.1
"""Largest motion of a joint that lost its torque which still confirms its servo (ours)."""


@dataclass(frozen=True, slots=True)
class Recheck:
    """State of the chain after an interruption, and every fault that forbids a continuation."""

    faults: tuple[ChainFault, ...]
    reset: tuple[int, ...]
    """Joints whose torque is off, or whose registers are not as they were set: their servos have
    rebooted, or another program has written to them."""
    names: tuple[str, ...]
    """Names of the joints whose servos have rebooted or were changed."""
    moved_rad: Floats
    """(J,) from where each joint was believed to be to where it is; NaN where it was not read."""
    position_rad: Floats
    """(J,) where each joint is; NaN where it was not read."""
    unidentified: tuple[str, ...] = ()
    """Ports on which every servo has lost its torque or its settings."""

    unproven: tuple[str, ...] = ()
    """Names of joints of other ports whose servos nothing confirms."""

    @property
    def doubt(self) -> str | None:
        """Reason why only a person can confirm the same robot; None if its servos confirm it."""
        if not self.unidentified:
            joints = ", ".join(self.unproven)
            reason = "lost torque and settings; neither angle nor EEPROM shows whose servo this is"
            return f"{joints}: {reason}" if joints else None
        return (
            f"{', '.join(self.unidentified)}: every servo has lost its torque or its settings: "
            "their supply was off, or this is another robot with the same IDs"
        )

    def __str__(self) -> str:
        if self.faults:
            return "; ".join(map(str, self.faults))
        moved = float(np.abs(self.moved_rad).max())
        if self.doubt is not None:
            return f"{self.doubt}; its joints are at most {moved:.3f} rad from their last angles"
        reset = f", to be set up again: {', '.join(self.names)}" if self.names else ""
        return f"the same servos, moved by at most {moved:.3f} rad{reset}"


def recheck(
    bus: ChainBus,
    robot: RobotConfig,
    units: JointUnits,
    before: Inspection | None,
    configured: Mapping[int, Mapping[str, int]],
    fingerprints: Mapping[int, Fingerprint],
    believed_rad: Floats,
) -> Recheck:
    """Compare model, firmware, alarm, torque, settings and position with their earlier values.

    ``before`` and ``fingerprints`` are from the start; ``configured`` has RAM registers by joint.
    ``believed_rad`` (J,) are the last credible angles.

    Raises:
        BusError: a servo stops replying meanwhile.
        PortError: the port is gone.

    """
    now = inspect(bus, robot)
    here_rad = np.full(robot.joint_count, np.nan)
    if now.faults:
        return Recheck(now.faults, (), (), here_rad, here_rad)
    for joint, servo in enumerate(now.servos):
        here_rad[joint] = units.position_rad(joint, servo.registers["Present Position"])
    moved = here_rad - believed_rad
    faults: list[ChainFault] = []
    reset = []
    forgotten = []
    servo_by_id = {s.servo_id: s for s in before.servos} if before is not None else {}
    for joint, servo in enumerate(now.servos):
        name = robot.joint_label(joint)
        old = servo_by_id.get(servo.servo_id, servo)
        if servo.firmware != old.firmware:
            text = f"{name}: firmware {servo.firmware}, was {old.firmware}: another servo?"
            faults.append(ChainFault(FaultCause.OTHER_FIRMWARE, text))
        turns = round(moved[joint] / math.tau) if np.isfinite(moved[joint]) else 0
        if turns:
            text = f"{name}: off by {turns:+d} turns: its turn count is lost"
            faults.append(ChainFault(FaultCause.TURN_COUNT_LOST, text))
        elif not abs(moved[joint]) <= MOVED_RAD:
            text = f"{name}: moved by {moved[joint]:+.2f} rad since it was last seen"
            faults.append(ChainFault(FaultCause.MOVED, text))
        unit_rad = float(units.rad_per_position[joint])
        previous_fingerprint = fingerprints.get(joint, {})
        faults += [
            ChainFault(FaultCause.OTHER_SETTINGS, line)
            for line in fingerprint_faults(
                robot, joint, previous_fingerprint, servo.registers, unit_rad
            )
        ]
        values = configured.get(joint, {})
        registers = {register: servo.registers[register] for register in values}
        number = registers.get(IDENTITY, 0)
        other = identity_fault(robot, joint, number)
        if other is not None:
            faults.append(ChainFault(FaultCause.EXCHANGED, f"{name}: {other}"))
        if not servo.torque_on or registers != values:
            reset.append(joint)
            if number != values.get(IDENTITY):
                forgotten.append(joint)
    lost = {robot.servo_ids[joint] for joint in reset}
    unidentified = tuple(
        part.port.name
        for part in bus.parts
        if lost.issuperset(i for i in robot.servo_ids if bus.port_of(i) is part.port)
    )
    names = tuple(map(robot.joint_label, reset))
    doubted = _unproven(forgotten, moved, believed_rad, fingerprints)
    unproven = tuple(map(robot.joint_label, doubted))
    return Recheck(tuple(faults), tuple(reset), names, moved, here_rad, unidentified, unproven)


def _unproven(
    joints: Sequence[int],
    moved_rad: Floats,
    believed_rad: Floats,
    fingerprints: Mapping[int, Fingerprint],
) -> list[int]:
    """Joints that moved, or have a twin of the same settings at about the same angle."""

    def are_alike(joint: int, twin: int) -> bool:
        is_near = abs(believed_rad[twin] - believed_rad[joint]) <= 2.0 * KEPT_RAD
        return is_near and fingerprints.get(twin) == fingerprints.get(joint)

    return [
        joint
        for joint in joints
        if not abs(moved_rad[joint]) <= KEPT_RAD or sum(are_alike(joint, j) for j in joints) > 1
    ]
