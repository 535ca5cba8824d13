"""Bus of a chain: one port, or a port for each segment of the chain."""

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
    """A group read of servos, and the write of their goals: ``ControlCycle`` describes it."""

    @property
    def fast(self) -> bool:
        """Whether all reads are fast ones."""
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
        """How old the values of a read are at most, s."""
        ...

    def write_goals(self, goals: NDArray[np.int32]) -> None:
        """Send raw goals (N,)."""
        ...

    def read(self) -> GroupReadReply:
        """Read the block of all servos."""
        ...


class ChainBus(Protocol):
    """Interface for start-up, cycle and shutdown of a chain; ``DynamixelBus`` describes it."""

    @property
    def parts(self) -> Sequence[DynamixelBus]:
        """The bus on each port; one that is on one port is its own only part."""
        ...

    def port_of(self, servo_id: int) -> BytePort:
        """Port that a servo, or another device, is on."""
        ...

    def reopen(self) -> None:
        """Close and open what is gone; raises ``PortError`` while it is not there."""
        ...

    def table_of(self, servo_id: int) -> ControlTable:
        """Control table of one servo's model."""
        ...

    def ping(self, servo_id: int) -> PingReply:
        """Ping one servo."""
        ...

    def find(self, servo_ids: Iterable[int]) -> dict[int, PingReply]:
        """Ping each servo; returns those that replied."""
        ...

    def read(self, servo_id: int, name: str) -> int:
        """Value of a register by its name."""
        ...

    def read_each(
        self, servo_id: int, names: Iterable[str], optional: Iterable[str] = ()
    ) -> dict[str, int]:
        """Values of many registers, by as few requests as can be."""
        ...

    def write(self, servo_id: int, name: str, value: int, tries: int | None = None) -> None:
        """Write a register by its name."""
        ...

    def write_verified(self, servo_id: int, name: str, value: int) -> None:
        """Write a register if it differs, and read it back."""
        ...

    def reboot(self, servo_id: int) -> None:
        """Restart a servo: its alarms, its torque and its RAM settings are gone."""
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
        """Group read of one device that is not a servo."""
        ...
