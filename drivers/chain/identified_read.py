"""Positions that are certainly a joint's: read in one reply with the joint's number.

Servos with one ID reply in turn, and IDs may be exchanged; such a reading is another joint's.
"""

from collections.abc import Mapping

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.bus.chain_bus import ChainBus
from snakewalk.drivers.chain.joint_codec import JointUnits
from snakewalk.drivers.chain.start_up import IDENTITY, identity
from snakewalk.drivers.errors import ChainError

_GOAL = "Goal Position"


class IdentifiedRead:
    """Group read from the register that identifies a joint to its position and goal.

    Servos without such a register (SCS) are identified by their ID alone.
    """

    def __init__(self, bus: ChainBus, robot: RobotConfig, units: JointUnits) -> None:
        self._bus, self._robot, self._units = bus, robot, units
        ids = robot.servo_ids
        table = bus.table_of(ids[0])
        self._position = table.state_names[-1]
        names: tuple[str, ...] = (_GOAL, self._position)
        if all(IDENTITY in bus.table_of(each) for each in ids):
            names = (IDENTITY, *names)
        self._registers = {name: table.register(name) for name in names}
        self._cycle = bus.block(ids, names[0], names[-1], fast=False)

    def positions_rad(self, reads: int, *, ask_again: bool = False) -> Floats:
        """(J,) angles; arguments and errors as ``positions_and_goals``."""
        return self.positions_and_goals(reads, ask_again=ask_again)[0]

    def positions_and_goals(self, reads: int, *, ask_again: bool = False) -> tuple[Floats, Floats]:
        """(J,) angles, rad, and (J,) raw goals; NaN for joints that are not identified.

        ``ask_again`` asks the remaining servos one by one.

        Raises:
            BusError: a servo asked alone does not reply.
            PortError: the port is gone.

        """
        here_rad, goals = np.full((2, self._robot.joint_count), np.nan)
        registers = self._registers
        start = next(iter(registers.values())).address

        def store(joint: int, values: Mapping[str, int]) -> None:
            if values.get(IDENTITY, identity(joint)) == identity(joint):
                here_rad[joint] = self._units.position_rad(joint, values[self._position])
                goals[joint] = values[_GOAL]

        for _ in range(reads):
            reply = self._cycle.read()
            for joint in np.flatnonzero(reply.valid & np.isnan(here_rad)).tolist():
                row = reply.data[joint].tobytes()
                store(joint, {n: r.decode(row[r.address - start :]) for n, r in registers.items()})
            if not np.isnan(here_rad).any():
                break
        for joint in np.flatnonzero(np.isnan(here_rad)).tolist() if ask_again else ():
            store(joint, self._bus.read_each(self._robot.servo_ids[joint], registers))
        return here_rad, goals


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
            f"{name}: read {position_rad[joint] - found_rad[joint]:+.2f} rad from where it was "
            "found just before: two servos with one ID, or moved by hand"
        )
    raise ChainError([text])
