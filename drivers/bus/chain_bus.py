"""Bus of a chain: one port, or one port per segment."""

from collections.abc import Iterable, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from snakewalk.drivers.bus.control_cycle import CycleCounters
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus, PingReply
from snakewalk.drivers.bus.group_read import GroupReadReply
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.protocol.control_table import ControlTable


class GroupCycle(Protocol):
    """Group read of servos, and write of their goals; see ``ControlCycle``."""

    @property
    def fast(self) -> bool:
        """Whether all reads are fast."""
        ...

    @property
    def given_up_on(self) -> Sequence[str]:
        """Names of the ports on which fast reads were given up."""
        ...

    @property
    def counters(self) -> CycleCounters:
        """Irregular reads so far."""
        ...

    @property
    def since_sent_s(self) -> float:
        """Largest possible age of the values of a read, s."""
        ...

    def write_goals(self, goals: NDArray[np.int32]) -> None:
        """Send raw goals (N,)."""
        ...

    def read(self) -> GroupReadReply:
        """Read the block of all servos."""
        ...


class ChainBus(Protocol):
    """Interface for start-up, cycle and shutdown of a chain; see ``DynamixelBus``."""

    @property
    def parts(self) -> Sequence[DynamixelBus]:
        """The bus on each port; a bus on one port is its only part."""
        ...

    def port_of(self, servo_id: int) -> BytePort:
        """Port of a servo or another device."""
        ...

    def reopen(self) -> None:
        """Close and open lost ports; raises ``PortError`` if one is still missing."""
        ...

    def table_of(self, servo_id: int) -> ControlTable:
        """Control table of a servo's model."""
        ...

    def ping(self, servo_id: int) -> PingReply:
        """Ping one servo."""
        ...

    def find(self, servo_ids: Iterable[int]) -> dict[int, PingReply]:
        """Ping each servo; return those that replied."""
        ...

    def read(self, servo_id: int, name: str) -> int:
        """Value of a register."""
        ...

    def read_each(
        self, servo_id: int, names: Iterable[str], optional: Iterable[str] = ()
    ) -> dict[str, int]:
        """Values of many registers, in few requests."""
        ...

    def write(self, servo_id: int, name: str, value: int, tries: int | None = None) -> None:
        """Write a register."""
        ...

    def write_verified(self, servo_id: int, name: str, value: int) -> None:
        """Write a register if it differs, and read it back."""
        ...

    def reboot(self, servo_id: int) -> None:
        """Restart a servo: it loses alarms, torque and RAM settings."""
        ...

    def sync_write(self, servo_ids: Sequence[int], name: str, value: int) -> None:
        """Write one value to all servos at once."""
        ...

    def cycle(self, servo_ids: Sequence[int], *, fast: bool = True) -> GroupCycle:
        """Control cycle of these servos."""
        ...

    def slow_cycle(self, servo_ids: Sequence[int], *, fast: bool = True) -> GroupCycle:
        """Group read of the slow state block."""
        ...

    def block(
        self, servo_ids: Sequence[int], first: str, last: str, *, fast: bool = True
    ) -> GroupCycle:
        """Group read of the registers from ``first`` to ``last``."""
        ...

    def device_block(self, device_id: int, address: int, length: int) -> GroupCycle:
        """Group read of a device that is not a servo."""
        ...
