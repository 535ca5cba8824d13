"""The bus of a chain with one port per segment: one transaction per port and cycle.

Requests begin on all ports before the bus waits for a reply. A fault of one port ends the cycle of
all; its error names the port. Commands to all servos, such as torque off, go to every working port.
Each port may have servos of another make: it has its own packets, addresses and register sizes.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import astuple

import numpy as np

from snakewalk.config.arrays import Int32s
from snakewalk.drivers.bus.control_cycle import ControlCycle, CycleCounters
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus, PingReply
from snakewalk.drivers.bus.group_read import GroupReadReply
from snakewalk.drivers.errors import BusError, ControlTableError, PortError
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.protocol.control_table import ControlTable


class SegmentedBus:
    """Servos of one chain on several ports; implements ``ChainBus``."""

    def __init__(self, parts: Sequence[tuple[DynamixelBus, Sequence[int]]]) -> None:
        """Prepare; nothing is sent. ``parts`` are bus and IDs of each port.

        Raises:
            ValueError: the ports' clocks differ, or an ID is on two ports.

        """
        if len({id(bus.port.clock) for bus, _ in parts}) != 1:
            raise ValueError("the ports of one chain share one clock: ages are counted in it")
        self._bus_of = {servo_id: bus for bus, ids in parts for servo_id in ids}
        if len(self._bus_of) != sum(len(ids) for _, ids in parts):
            raise ValueError("an ID must be on one port only")
        self._parts = tuple(bus for bus, _ in parts)
        self._lost: dict[DynamixelBus, None] = {}  # in order of loss

    @property
    def parts(self) -> Sequence[DynamixelBus]:
        """The bus on each port."""
        return self._parts

    def part_of(self, servo_id: int) -> DynamixelBus:
        """Bus of the port of a servo or another device."""
        return self._bus_of[servo_id]

    def port_of(self, servo_id: int) -> BytePort:
        """Port of a servo or another device."""
        return self._bus_of[servo_id].port

    def reopen(self) -> None:
        """Close and open the lost ports.

        Raises:
            PortError: one is still missing.

        """
        for bus in tuple(self._lost):
            bus.reopen()
            del self._lost[bus]

    def table_of(self, servo_id: int) -> ControlTable:
        """Control table of a servo's model."""
        return self._bus_of[servo_id].table_of(servo_id)

    def ping(self, servo_id: int) -> PingReply:
        """Ping one servo; raises as ``DynamixelBus.ping``."""
        with self._with_port_name(servo_id) as bus:
            return bus.ping(servo_id)

    def find(self, servo_ids: Iterable[int]) -> dict[int, PingReply]:
        """Ping each servo; return those that replied."""
        replies: dict[int, PingReply] = {}
        for servo_id in servo_ids:
            with self._with_port_name(servo_id) as bus:
                replies |= bus.find([servo_id])
        return replies

    def read(self, servo_id: int, name: str) -> int:
        """Value of a register; raises as ``DynamixelBus.read``."""
        with self._with_port_name(servo_id) as bus:
            return bus.read(servo_id, name)

    def read_each(
        self, servo_id: int, names: Iterable[str], optional: Iterable[str] = ()
    ) -> dict[str, int]:
        """Values of many registers, by few requests; raises as ``DynamixelBus.read_each``."""
        with self._with_port_name(servo_id) as bus:
            return bus.read_each(servo_id, names, optional)

    def write(self, servo_id: int, name: str, value: int, tries: int | None = None) -> None:
        """Write a register; raises as ``DynamixelBus.write``."""
        with self._with_port_name(servo_id) as bus:
            bus.write(servo_id, name, value, tries)

    def write_verified(self, servo_id: int, name: str, value: int) -> None:
        """Write a register if it differs, and read it back; raises as ``DynamixelBus``."""
        with self._with_port_name(servo_id) as bus:
            bus.write_verified(servo_id, name, value)

    def reboot(self, servo_id: int) -> None:
        """Restart a servo; raises as ``DynamixelBus.reboot``."""
        with self._with_port_name(servo_id) as bus:
            bus.reboot(servo_id)

    def sync_write(self, servo_ids: Sequence[int], name: str, value: int) -> None:
        """Write one value to all servos, even if a port is gone.

        Raises:
            ControlTableError: no such register, or the value does not fit.
            PortError: a port is gone; the others have the value.

        """
        self.call_each_port(
            lambda bus, places: bus.sync_write([servo_ids[k] for k in places], name, value),
            self._places(servo_ids),
        )

    def cycle(self, servo_ids: Sequence[int], *, fast: bool = True) -> "SegmentedCycle":
        """Control cycle of these servos; raises as ``DynamixelBus.cycle``."""
        return self._cycles(servo_ids, lambda bus, ids: bus.cycle(ids, fast=fast))

    def slow_cycle(self, servo_ids: Sequence[int], *, fast: bool = True) -> "SegmentedCycle":
        """Group read of the slow state block; raises as ``DynamixelBus.slow_cycle``."""
        return self._cycles(servo_ids, lambda bus, ids: bus.slow_cycle(ids, fast=fast))

    def block(
        self, servo_ids: Sequence[int], first: str, last: str, *, fast: bool = True
    ) -> "SegmentedCycle":
        """Group read of the registers from ``first`` to ``last``; raises as ``DynamixelBus``."""
        return self._cycles(servo_ids, lambda bus, ids: bus.block(ids, first, last, fast=fast))

    def device_block(self, device_id: int, address: int, length: int) -> "SegmentedCycle":
        """Group read of a device that is not a servo."""
        return self._cycles(
            [device_id], lambda bus, _: bus.device_block(device_id, address, length)
        )

    def _places(self, servo_ids: Sequence[int]) -> dict[DynamixelBus, list[int]]:
        """Indices in ``servo_ids`` of the servos of each port."""
        places_by_bus: dict[DynamixelBus, list[int]] = {}
        for place, servo_id in enumerate(servo_ids):
            places_by_bus.setdefault(self._bus_of[servo_id], []).append(place)
        return places_by_bus

    def _cycles(
        self,
        servo_ids: Sequence[int],
        make: Callable[[DynamixelBus, Sequence[int]], ControlCycle],
    ) -> "SegmentedCycle":
        places = self._places(servo_ids)
        cycles = {
            bus: make(bus, [servo_ids[k] for k in indices]) for bus, indices in places.items()
        }
        spans = {
            (cycle.read_address, cycle.read_bytes)
            for bus, cycle in cycles.items()
            if not bus.table.facts.is_feetech
        }
        if len(spans) > 1:
            raise ControlTableError(
                "ports: the servo models have their block of a control cycle at different "
                "addresses; use models with the same control table"
            )
        return SegmentedCycle(cycles, places, self)

    def call_each_port(
        self,
        do: Callable[[DynamixelBus, list[int]], None],
        places: Mapping[DynamixelBus, list[int]],
    ) -> None:
        """Call ``do`` for each port, even if one is gone; then raise its error."""
        gone: list[PortError] = []
        for bus, indices in places.items():
            try:
                do(bus, indices)
            except PortError as error:
                self._lost[bus] = None
                gone.append(error)
        if len(gone) > 1:
            raise PortError("; ".join(map(str, gone))) from gone[0]
        if gone:
            raise gone[0]

    @contextmanager
    def _with_port_name(self, servo_id: int) -> Iterator[DynamixelBus]:
        bus = self._bus_of[servo_id]
        try:
            yield bus
        except PortError:
            self._lost[bus] = None
            raise
        except BusError as error:
            error.args = (f"{bus.port.name}: {error}",)
            raise


class SegmentedCycle:
    """Group read and goals of servos on several ports; implements ``GroupCycle``."""

    def __init__(
        self,
        cycles: Mapping[DynamixelBus, ControlCycle],
        places: Mapping[DynamixelBus, list[int]],
        bus: SegmentedBus,
    ) -> None:
        """Prepare.

        Args:
            cycles: of each port.
            places: indices of each port's servos in the common arrays.
            bus: bus of the ports.

        """
        self._cycles = cycles
        self._places = places
        self._call_each_port = bus.call_each_port
        self._count = sum(map(len, places.values()))

    @property
    def fast(self) -> bool:
        """Whether all reads are fast."""
        return all(cycle.fast for cycle in self._cycles.values())

    @property
    def given_up_on(self) -> tuple[str, ...]:
        """Names of the ports on which fast reads were given up."""
        return tuple(name for cycle in self._cycles.values() for name in cycle.given_up_on)

    @property
    def counters(self) -> CycleCounters:
        """Irregular reads so far, of all ports."""
        counter_rows = (astuple(cycle.counters) for cycle in self._cycles.values())
        return CycleCounters(*map(sum, zip(*counter_rows, strict=True)))

    @property
    def since_sent_s(self) -> float:
        """Largest possible age of the values of a read, s."""
        return max(cycle.since_sent_s for cycle in self._cycles.values())

    def write_goals(self, goals: Int32s) -> None:
        """Send raw goals (N,).

        Raises:
            PortError: a port is gone; the other servos have their goals.

        """
        self._call_each_port(
            lambda bus, places: self._cycles[bus].write_goals(goals[places]), self._places
        )

    def read(self) -> GroupReadReply:
        """Read the block of all servos: ask on all ports, then receive.

        Raises:
            PortError: a port is gone; the other replies are received.

        """
        asked: dict[DynamixelBus, list[int]] = {}
        replies: dict[DynamixelBus, GroupReadReply] = {}

        def ask(bus: DynamixelBus, places: list[int]) -> None:
            self._cycles[bus].begin_read()
            asked[bus] = places

        def receive(bus: DynamixelBus, places: list[int]) -> None:
            replies[bus] = self._cycles[bus].finish_read()

        try:
            self._call_each_port(ask, self._places)
        finally:  # else a reply would meet the next request
            self._call_each_port(receive, asked)
        return self._joined_reply(replies)

    def _joined_reply(self, replies: Mapping[DynamixelBus, GroupReadReply]) -> GroupReadReply:
        """One reply with the results of all ports; zeros fill the rows of shorter registers."""
        width = max(reply.data.shape[1] for reply in replies.values())
        data = np.zeros((self._count, width), np.uint8)
        valid = np.zeros(self._count, np.bool_)
        answered = np.zeros(self._count, np.bool_)
        error = np.zeros(self._count, np.uint8)
        for bus, reply in replies.items():
            places = self._places[bus]
            data[places, : reply.data.shape[1]] = reply.data
            valid[places], answered[places], error[places] = (
                reply.valid,
                reply.answered,
                reply.error,
            )
        *_, clean, whole, flawless = zip(*replies.values(), strict=True)
        return GroupReadReply(data, valid, error, answered, all(clean), all(whole), all(flawless))
