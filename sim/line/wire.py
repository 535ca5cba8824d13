"""The wire: a half-duplex bus as a byte port that owns simulated time.

A byte lasts ten bit times. An instruction is executed when its last byte has arrived; replies
follow after the servos' return delays. Written bytes are executed when the host reads, waits, or
writes again. Only reads and time-outs move the clock. Implements the SDK's ``PortHandler`` and
``drivers.port.byte_port.BytePort``.
"""

# ruff: noqa: N802, D102 - the SDK chose the names; `drivers.port.byte_port` describes them
import math
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterable, Sequence

from snakewalk.drivers.errors import PortError
from snakewalk.drivers.port.byte_port import DRAIN_LIMIT_S
from snakewalk.drivers.protocol.packet import BITS_PER_BYTE
from snakewalk.sim.line.bus_contention import Reply
from snakewalk.sim.line.clock import SimClock
from snakewalk.sim.line.noise import FaultScript

EARLY = 1e-6
"""Share of a byte time by which rounding may make a byte late."""


class RxQueue:
    """Packets in the order of their start on the wire, read byte by byte."""

    def __init__(self) -> None:
        self.byte_s = 1e-5
        """Time of one byte on the wire."""
        self.packets: deque[tuple[float, bytes]] = deque()
        """Packets under way or not yet read, each with the time at which it begins."""

    def add(self, start_s: float, data: bytes) -> float:
        """Put a packet on the wire at ``start_s``; return the arrival time of its last byte."""
        packets = self.packets
        if not packets or packets[-1][0] <= start_s:
            packets.append((start_s, data))
        else:  # some are late
            place = sum(packet[0] <= start_s for packet in packets)
            packets.insert(place, (start_s, data))
        return start_s + len(data) * self.byte_s

    def count(self, now_s: float) -> int:
        """Number of arrived, unread bytes."""
        return sum(self._arrived_bytes(packet, now_s) for packet in self.packets)

    def due_s(self, count: int) -> float | None:
        """Arrival time of ``count`` bytes; None if fewer are under way."""
        due_s = 0.0
        for start_s, data in self.packets:
            # bytes after a slow packet cannot be read before it
            due_s = max(due_s, start_s + min(count, len(data)) * self.byte_s)
            if len(data) >= count:
                return due_s
            count -= len(data)
        return None

    def take(self, count: int, now_s: float) -> bytes:
        """Up to ``count`` arrived bytes."""
        packets = self.packets
        taken = bytearray()
        if packets and len(packets[0][1]) == count == self._arrived_bytes(packets[0], now_s):
            return packets.popleft()[1]  # the usual case: one packet, complete
        while packets and len(taken) < count:
            start_s, data = packets[0]
            ready = min(self._arrived_bytes(packets[0], now_s), count - len(taken))
            taken += data[:ready]
            if ready < len(data):
                packets[0] = (start_s + ready * self.byte_s, data[ready:])
                break
            packets.popleft()
        return bytes(taken)

    def clear(self) -> None:
        """Drop all bytes."""
        self.packets.clear()

    def cut(self, at_s: float) -> None:
        """Drop bytes that arrive after ``at_s``."""
        kept = [
            (packet[0], packet[1][: self._arrived_bytes(packet, at_s)]) for packet in self.packets
        ]
        self.packets = deque(packet for packet in kept if packet[1])

    def _arrived_bytes(self, packet: tuple[float, bytes], now_s: float) -> int:
        start_s, data = packet
        return min(len(data), max(0, int((now_s - start_s) / self.byte_s + EARLY)))


LATENCY_S = 0.016
"""The SDK's allowance for the adapter's latency timer; a packet may need two of them and 2 ms."""
GAP_S = 5e-3
"""Silence after which the servos treat the next byte as the start of a packet (ours)."""
INSTANT_S = 1e-9
"""Largest difference between two times that count as the same."""
HOLD_UP_MAX_S = 0.01
"""A reply that is later than this does not hold up the servos behind it (ours)."""
SLICE_S = 2e-3
"""Longest step in which the servos of several lines advance one after the other (ours)."""
PacketTap = Callable[[float, bool, bytes], None]
"""Function that gets every packet on the wire: time of its end, whether the host sent it, its
bytes."""


class Wire(ABC):
    """A bus without servos: subclasses add servos and their replies.

    Reading and writing a closed port raise ``PortError``.
    """

    def __init__(self, clock: SimClock, usb_latency_s: float = 0.0) -> None:
        self.clock = clock
        self.label = "simulated line"
        """Name of the port."""
        self.usb_latency_s = usb_latency_s
        """Delay of the host's adapter between the wire and the host."""
        self.taps: list[PacketTap] = []
        """Callbacks for every packet on the wire."""
        self._script: FaultScript | None = None
        self._disconnected = False
        self.is_using = False
        self.is_open = True
        self.busy_s = 0.0
        """Time during which bytes were on the wire."""
        self.collisions = 0
        """Packets that the host began while servos were still replying."""
        self.group: LineGroup | None = None
        """Lines whose servos turn the same body; None: this line is alone."""
        self._sent: deque[tuple[float, bytes]] = deque()
        self._rx_queue = RxQueue()
        self._sent_until_s = self._quiet_s = self.clock.now_s()
        self._deadline_s = self._delivered_s = self.clock.now_s()

    # the servos on it

    @abstractmethod
    def _advance(self, until_s: float) -> None: ...

    @abstractmethod
    def _execute(self, data: bytes, end_s: float) -> list[Reply]:
        """Execute the bytes sent by ``end_s``; return the servos' replies."""

    @abstractmethod
    def _reset_parser(self) -> None: ...

    @abstractmethod
    def _on_baud_change(self, baud: int) -> None:
        """Adapt to a new baud rate of the host."""

    @abstractmethod
    def _split(self, data: bytes) -> Sequence[bytes]:
        """Divide one write into packets; each is executed at its own end."""

    # faults

    def attach(self, script: FaultScript) -> None:
        """Apply a fault file to this line."""
        self._script = script

    def _instruction_with_faults(self, data: bytes, now_s: float) -> Sequence[bytes]:
        """Packets that the servos receive from one instruction ending at ``now_s``."""
        if self._script is None or not self._script.noise.any:
            return (data,)
        return self._script.noise.instruction(data, now_s)

    def _reply_with_faults(self, data: bytes, now_s: float) -> Sequence[tuple[float, bytes]]:
        """Packets that arrive from a reply beginning at ``now_s``, and their delays."""
        if self._script is None or not self._script.noise.any:
            return ((0.0, data),)
        return self._script.noise.reply(data, now_s)

    # the byte port

    def openPort(self) -> bool:
        self.settle()
        self.is_open = not self._disconnected
        return self.is_open

    def closePort(self) -> None:
        self.is_open = False

    def setBaudRate(self, baudrate: int) -> bool:
        """Set the host's baud rate; servos at another rate receive nothing."""
        self._baud = baudrate
        self._byte_s = self._rx_queue.byte_s = BITS_PER_BYTE / baudrate
        self.tx_time_per_byte = self._byte_s * 1e3
        self._on_baud_change(baudrate)
        return True

    def getBaudRate(self) -> int:
        return self._baud

    def clearPort(self) -> None:
        """Drop arrived bytes; bytes under way still arrive."""
        now_s = self.clock.now_s()
        if self._sent:
            self._deliver(now_s)
        if self._rx_queue.packets:
            self._rx_queue.take(1 << 30, now_s)

    def getBytesAvailable(self) -> int:
        if not (self._sent or self._rx_queue.packets):
            return 0
        now_s = self.clock.now_s()
        self._deliver(now_s)
        return self._rx_queue.count(now_s)

    def writePort(self, packet: bytes | list[int]) -> int:
        """As ``write``; return the number of bytes."""
        data = bytes(packet)
        self.write(data)
        return len(data)

    def readPort(self, length: int) -> bytes:
        """Up to ``length`` bytes: waits, in simulated time, for them or the packet time-out."""
        return self.read_until(length, self._deadline_s)

    def setPacketTimeout(self, packet_length: int) -> None:
        """As the SDK: time on the wire, two latency timers, 2 ms."""
        wait_s = packet_length * self._byte_s + 2.0 * LATENCY_S + 2e-3
        self.setPacketTimeoutMillis(wait_s * 1e3)

    def setPacketTimeoutMillis(self, msec: float) -> None:
        self._deadline_s = self.clock.now_s() + msec * 1e-3

    def isPacketTimeout(self) -> bool:
        return self.clock.now_s() >= self._deadline_s

    # the same, in seconds

    @property
    def paced(self) -> bool:
        """Whether bytes need the time of the baud rate: always."""
        return True

    @property
    def name(self) -> str:
        """For messages."""
        return self.label

    def write(self, data: bytes) -> None:
        """Send bytes after those already on the wire; returns at once."""
        if self._script is not None or not self.is_open:
            self._resume_host()
        start_s = max(self.clock.now_s(), self._sent_until_s)
        if self._sent:
            self._deliver(start_s)
        clear = self._quiet_s <= start_s + INSTANT_S
        if not clear:
            self._cut_replies(start_s)
        self._transmit(start_s, self._split(data), arrives=clear)

    @property
    def is_plain(self) -> bool:
        """Whether only the servos change the bytes, without taps."""
        return self.is_open and self._script is None and not self.taps

    def begin(self, packet: bytes) -> bool:
        """As ``clearPort`` and ``write`` of one packet on an idle line.

        Returns False, without sending, if both must be called.
        """
        if not self.is_plain or self._rx_queue.packets:
            return False
        now_s = self.clock.now_s()
        if self._sent:
            self._deliver(now_s)
        start_s = max(now_s, self._sent_until_s)
        if self._sent or self._rx_queue.packets or self._quiet_s > start_s + INSTANT_S:
            return False
        self._transmit(start_s, (packet,), arrives=True)
        return True

    def read_until(self, count: int, deadline_s: float) -> bytes:
        """Up to ``count`` bytes; the clock moves to the last of them, or to ``deadline_s``."""
        clock = self.clock
        rx_queue = self._rx_queue
        sent = self._sent
        if self._script is not None or not self.is_open:
            self._resume_host()
        limit_s = max(deadline_s, clock.now_s())
        while count > 0:
            due_s = rx_queue.due_s(count) if rx_queue.packets else None
            if due_s is not None:
                clock.sleep_until_s(min(due_s, limit_s))
                break
            if not sent or sent[0][0] > limit_s:
                clock.sleep_until_s(limit_s)
                break
            self._deliver(sent[0][0])
        if self._script is not None or not self.is_open:
            self._must_be_open()
        return rx_queue.take(count, clock.now_s())

    def drain_until_quiet(self, quiet_s: float) -> int:
        """Discard bytes until none has come for ``quiet_s``, for a limited time; count them."""
        discarded = 0
        seen_s = self.clock.now_s()
        limit_s = seen_s + quiet_s + DRAIN_LIMIT_S
        while True:
            byte = self.read_until(1, min(seen_s + quiet_s, limit_s))
            if not byte:
                return discarded
            seen_s = self.clock.now_s()
            discarded += 1 + len(self._rx_queue.take(1 << 30, self.clock.now_s()))

    # the wire

    def disconnect(self) -> None:
        """Disconnect the port: reading and writing fail until it is back and reopened."""
        self._disconnected = True
        self.is_open = False
        self._rx_queue.clear()

    def reconnect(self) -> None:
        """Reconnect the port; the host must open it."""
        self._disconnected = False

    @property
    def disconnected(self) -> bool:
        """Whether the port has vanished."""
        return self._disconnected

    def _resume_host(self) -> None:
        """Wait until a paused host continues, and check that the port is open."""
        if self._script is not None:
            self.clock.sleep_until_s(self._script.host_resumes_s(self.clock.now_s()))
        self._must_be_open()

    def _must_be_open(self) -> None:
        if self._script is not None:
            self.settle()
        if self._disconnected:
            raise PortError(f"{self.name}: the port has vanished")
        if not self.is_open:
            raise PortError(f"{self.name}: the port is closed")

    def settle(self) -> None:
        """Advance servos and physics to the clock's time."""
        now_s = self.clock.now_s()
        self._deliver(now_s)
        self._advance_all(now_s)

    def _advance_all(self, until_s: float) -> None:
        """Advance the servos of this line, and of all lines of its group."""
        if self.group is None:
            self._advance(until_s)
        else:
            self.group.advance(until_s)

    def next_event_s(self) -> float | None:
        """Time of the next packet end or byte arrival, or None."""
        times = [self._rx_queue.due_s(1), self._sent[0][0] if self._sent else None]
        return min((time_s for time_s in times if time_s is not None), default=None)

    def _transmit(self, start_s: float, packets: Iterable[bytes], *, arrives: bool) -> None:
        """Put packets on the wire, back to back from ``start_s``."""
        end_s = start_s
        for packet in packets:
            end_s += len(packet) * self._byte_s
            if arrives:
                self._sent.append((end_s, packet))
        self.busy_s += end_s - start_s
        self._sent_until_s = end_s

    def _deliver(self, until_s: float) -> None:
        """Deliver packets that have fully arrived by ``until_s`` to the servos."""
        sent = self._sent
        while sent and sent[0][0] <= until_s + INSTANT_S:
            end_s, data = sent.popleft()
            self._arrive(end_s, len(data))
            for tap in self.taps:
                tap(end_s, True, data)
            replies = self._execute(data, end_s)
            if not replies:
                continue
            if sent and end_s + replies[0].delay_s < self._sent_until_s:
                self.collisions += 1  # the host has already begun its next packet
                sent.clear()
                continue
            self._send_replies(end_s, replies)

    def _arrive(self, end_s: float, count: int) -> None:
        """Advance the servos to the end of a packet of ``count`` bytes."""
        self._advance_all(end_s)
        if end_s - count * self._byte_s > self._delivered_s + GAP_S:
            self._reset_parser()
        self._delivered_s = end_s

    def _send_replies(self, time_s: float, replies: Iterable[Reply]) -> None:
        for reply in replies:
            time_s += reply.delay_s
            for late_s, data in self._reply_with_faults(reply.data, time_s):
                end_s = self._rx_queue.add(time_s + late_s + self.usb_latency_s, data)
                time_s = max(time_s, end_s - self.usb_latency_s - late_s * (late_s > HOLD_UP_MAX_S))
                self.busy_s += len(data) * self._byte_s
                for tap in self.taps:
                    tap(end_s - self.usb_latency_s, False, data)
            self._quiet_s = time_s

    def _cut_replies(self, start_s: float) -> None:
        """Host and servos send at once: the packet and the rest of the replies are lost."""
        self.collisions += 1
        self._rx_queue.cut(start_s)
        self._quiet_s = start_s


class LineGroup:
    """Lines with one clock whose servos turn the shafts of one body.

    Time passes for all of them together: packets of all lines are executed in the order of their
    ends, and all servos advance in slices of ``SLICE_S``.
    """

    def __init__(self, lines: Sequence[Wire]) -> None:
        """Join the lines.

        Raises:
            ValueError: their clocks differ.

        """
        if len({id(line.clock) for line in lines}) != 1:
            raise ValueError("the lines of one body share one clock")
        self._lines = tuple(lines)
        self._time_s = lines[0].clock.now_s()
        for line in lines:
            line.group = self

    def advance(self, until_s: float) -> None:
        """Execute the packets that end by ``until_s``, and advance the servos to that time."""
        while True:
            ends = [line._sent[0][0] if line._sent else math.inf for line in self._lines]
            end_s = min(ends)
            if end_s > until_s:
                break
            self._lines[ends.index(end_s)]._deliver(end_s)
        while self._time_s < until_s:
            self._time_s = min(until_s, self._time_s + SLICE_S)
            for line in self._lines:
                line._advance(self._time_s)
