"""Positions that are certainly a joint's: read in one reply with the joint's number.

Servos with one ID reply in turn, and IDs may be exchanged; such a reading is another joint's.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.bus.chain_bus import ChainBus, GroupCycle
from snakewalk.drivers.chain.joint_codec import JointUnits
from snakewalk.drivers.chain.start_up import IDENTITY, identity
from snakewalk.drivers.errors import ChainError
from snakewalk.drivers.protocol.control_table import Register

_GOAL = "Goal Position"
_POSITION = "Present Position"


class IdentifiedRead:
    """Group read from the register that identifies a joint to its position and goal.

    Servos without such a register (SCS) are identified by their ID alone.
    """

    def __init__(self, bus: ChainBus, robot: RobotConfig, units: JointUnits) -> None:
        self._bus = bus
        self._robot = robot
        self._units = units
        joints_of: dict[tuple[Register, ...], list[int]] = {}
        for joint, servo_id in enumerate(robot.servo_ids):
            table = bus.table_of(servo_id)
            names = (IDENTITY, _GOAL, _POSITION) if IDENTITY in table else (_GOAL, _POSITION)
            joints_of.setdefault(tuple(table.register(name) for name in names), []).append(joint)
        self._blocks = [_Block.of(bus, robot, *bus_joints) for bus_joints in joints_of.items()]

    def positions_rad(self, reads: int, *, ask_again: bool = False) -> Floats:
        """(J,) angles; arguments and errors as ``positions_and_goals``."""
        return self.positions_and_goals(reads, ask_again=ask_again)[0]

    def positions_and_goals(self, reads: int, *, ask_again: bool) -> tuple[Floats, Floats]:
        """(J,) angles, rad, and (J,) raw goals; NaN for joints that are not identified.

        ``ask_again`` asks the remaining servos one by one.

        Raises:
            BusError: a servo asked alone does not reply.
            PortError: the port is gone.

        """
        here_rad, goals = np.full((2, self._robot.joint_count), np.nan)

        def store(joint: int, values: Mapping[str, int]) -> None:
            if values.get(IDENTITY, identity(joint)) == identity(joint):
                here_rad[joint] = self._units.position_rad(joint, values[_POSITION])
                goals[joint] = values[_GOAL]

        for block in self._blocks:
            for _ in range(reads):
                for joint, values in block.read(np.isnan(here_rad)).items():
                    store(joint, values)
                if not np.isnan(here_rad[block.joints]).any():
                    break
            names = [register.name for register in block.registers]
            for joint in block.joints if ask_again else ():
                if np.isnan(here_rad[joint]):
                    store(joint, self._bus.read_each(self._robot.servo_ids[joint], names))
        return here_rad, goals


@dataclass(frozen=True, slots=True)
class _Block:
    """Group read of servos that have the registers at the same addresses."""

    joints: list[int]
    registers: tuple[Register, ...]
    """Registers of the read, in the order of their addresses."""
    cycle: GroupCycle

    @classmethod
    def of(
        cls, bus: ChainBus, robot: RobotConfig, registers: tuple[Register, ...], joints: list[int]
    ) -> "_Block":
        ids = [robot.servo_ids[joint] for joint in joints]
        cycle = bus.block(ids, registers[0].name, registers[-1].name, fast=False)
        return cls(joints, registers, cycle)

    def read(self, missing: Bools) -> dict[int, dict[str, int]]:
        """Values of the joints that replied and are ``missing`` (J,), by name."""
        reply = self.cycle.read()
        start = self.registers[0].address
        values_by_joint = {}
        for place in np.flatnonzero(reply.valid & missing[self.joints]).tolist():
            row = reply.data[place].tobytes()
            values_by_joint[self.joints[place]] = {
                register.name: register.decode(row[register.address - start :])
                for register in self.registers
            }
        return values_by_joint


def check_stillness(
    robot: RobotConfig, position_rad: Floats, found_rad: Floats, most_rad: float
) -> None:
    """Compare the joints' angles (J,) with earlier ones.

    Raises:
        ChainError: a joint moved by more than ``most_rad``, or is not identified.

    """
    moved_rad = np.abs(position_rad - found_rad)
    if np.nanmax(moved_rad, initial=0.0) <= most_rad and not np.isnan(moved_rad).any():
        return
    joint = int(np.argmax(np.where(np.isnan(moved_rad), np.inf, moved_rad)))
    name = robot.joint_label(joint)
    if np.isnan(moved_rad[joint]):
        text = (
            f"{name}: its servo's reply does not identify it; check whether two servos have this ID"
        )
    else:
        text = (
            f"{name}: read {position_rad[joint] - found_rad[joint]:+.2f} rad from its "
            "position just before: two servos with one ID, or moved by hand"
        )
    raise ChainError([text])
