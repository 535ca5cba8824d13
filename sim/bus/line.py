"""The wire: a half-duplex bus as a byte port that owns simulated time.

Bytes take ten bit times each; an instruction counts when its last byte has arrived; answers come
after the servos' return delays. Nothing happens by itself: what was written is carried out when
the host reads, waits, or writes again, and only reads and time-outs move the clock, as far as
needed. So a run needs no thread and no sleep, and repeats bit for bit.

The names of the public methods are those of the SDK's ``PortHandler``, on which the SDK is
duck-typed, widened to ``drivers.port.BytePort``.
"""
# ruff: noqa: N802, D102 - the SDK chose the names; `drivers.port` describes them

from collections import deque
from collections.abc import Callable, Iterable, Sequence

from drivers.errors import PortError
from drivers.protocol.packet import HEADER, InstructionPacket
from drivers.protocol.parser import PacketReader
from sim.bus.arrivals import Arrivals
from sim.bus.bank import ServoBank
from sim.bus.clock import SimClock
from sim.bus.firmware import Firmware
from sim.bus.group import GroupPath
from sim.bus.protection import Surroundings
from sim.bus.service import Answer, Service
from sim.plant import Plant

BITS_PER_BYTE = 10
"""Start bit, eight data bits, stop bit."""
LATENCY_S = 0.016
"""The SDK's allowance for the adapter's latency timer; a packet may take two of them and 2 ms."""

GAP_S = 5e-3
"""After such a silence the servos take what follows for a new packet (ours)."""
INSTANT_S = 1e-9
"""Times closer than this are the same."""

Tamper = Callable[[bytes], Sequence[bytes]]
"""What becomes of one answer on the wire: itself, nothing, or other packets, in order."""


class SimLine:
    """Servos of ``bank`` on the shafts of ``plant`` behind a serial line of ``baud``.

    Reading and writing a closed port raise ``PortError``.
    """

    def __init__(
        self,
        bank: ServoBank,
        plant: Plant,
        clock: SimClock | None = None,
        baud: int = 1_000_000,
        *,
        surroundings: Surroundings | None = None,
        tamper: Tamper | None = None,
    ) -> None:
        self.clock = clock if clock is not None else SimClock(plant.time_s)
        self.firmware = Firmware(bank, plant, surroundings)
        self.bank = bank
        self.tamper = tamper
        self.is_using = False
        self.is_open = True
        self.busy_s = 0.0
        """Time during which bytes were on the wire."""
        self.collisions = 0
        """Packets that the host began while servos were still answering."""
        self._service = Service(self.firmware, baud)
        self._group = GroupPath(self._service)
        self._reader = PacketReader()
        self._sent: deque[tuple[float, bytes]] = deque()
        self._arriving = Arrivals()
        self._sent_until_s = self._quiet_s = self.clock.now_s()
        self._deadline_s = self._heard_until_s = self.clock.now_s()
        self.setBaudRate(baud)

    # the byte port

    def openPort(self) -> bool:
        self.is_open = True
        return True

    def closePort(self) -> None:
        self.is_open = False

    def setBaudRate(self, baudrate: int) -> bool:
        """Retune the host's side; servos at another rate no longer hear it."""
        self._baud = baudrate
        self._byte_s = self._arriving.byte_s = BITS_PER_BYTE / baudrate
        self.tx_time_per_byte = self._byte_s * 1e3
        self._service.baud = baudrate
        self._service.retune()
        return True

    def getBaudRate(self) -> int:
        return self._baud

    def clearPort(self) -> None:
        """Drop what has arrived by now; bytes still under way will arrive all the same."""
        self._carry_out(self.clock.now_s())
        self._arriving.take(1 << 30, self.clock.now_s())

    def getBytesAvailable(self) -> int:
        """Bytes that have arrived by now."""
        self._carry_out(self.clock.now_s())
        return self._arriving.count(self.clock.now_s())

    def writePort(self, packet: bytes | list[int]) -> int:
        """As ``write``; the number of bytes taken."""
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
        """Time-out from now, milliseconds."""
        self._deadline_s = self.clock.now_s() + msec * 1e-3

    def isPacketTimeout(self) -> bool:
        """Whether the time-out has passed."""
        return self.clock.now_s() >= self._deadline_s

    # the same, in seconds

    @property
    def name(self) -> str:
        """For messages."""
        return "simulated line"

    def write(self, data: bytes) -> None:
        """Put bytes on the wire behind those already there; returns at once."""
        self._must_be_open()
        start_s = max(self.clock.now_s(), self._sent_until_s)
        self._carry_out(start_s)
        clear = self._quiet_s <= start_s + INSTANT_S
        if not clear:
            self._collide(start_s)
        end_s = start_s
        for frame in _frames(data):
            end_s += len(frame) * self._byte_s
            if clear:
                self._sent.append((end_s, frame))
        self.busy_s += end_s - start_s
        self._sent_until_s = end_s

    def read_until(self, count: int, deadline_s: float) -> bytes:
        """Up to ``count`` bytes; the clock moves to the last of them, or to ``deadline_s``."""
        self._must_be_open()
        clock = self.clock
        limit_s = max(deadline_s, clock.now_s())
        while count > 0:
            due_s = self._arriving.due_s(count)
            if due_s is not None:
                clock.sleep_until_s(min(due_s, limit_s))
                break
            if not self._sent or self._sent[0][0] > limit_s:
                clock.sleep_until_s(limit_s)
                break
            self._carry_out(self._sent[0][0])
        return self._arriving.take(count, clock.now_s())

    def drain_until_quiet(self, quiet_s: float) -> int:
        """Throw bytes away until none has come for ``quiet_s``; the number thrown away."""
        thrown, seen_s = 0, self.clock.now_s()
        while True:
            byte = self.read_until(1, seen_s + quiet_s)
            if not byte:
                return thrown
            seen_s = self.clock.now_s()
            thrown += 1 + len(self._arriving.take(1 << 30, self.clock.now_s()))

    # the wire

    def _must_be_open(self) -> None:
        if not self.is_open:
            raise PortError(f"{self.name}: the port is closed")

    def settle(self) -> None:
        """Bring servos and physics to the clock's present time."""
        now_s = self.clock.now_s()
        self._carry_out(now_s)
        self.firmware.advance(now_s)

    def next_event_s(self) -> float | None:
        """When the next packet ends or the next byte arrives; None while nothing is under way."""
        times = [self._arriving.due_s(1), self._sent[0][0] if self._sent else None]
        return min((time_s for time_s in times if time_s is not None), default=None)

    def _carry_out(self, until_s: float) -> None:
        """Deliver the packets whose last byte has arrived by ``until_s``."""
        while self._sent and self._sent[0][0] <= until_s + INSTANT_S:
            end_s, data = self._sent.popleft()
            self.firmware.advance(end_s)
            if end_s - len(data) * self._byte_s > self._heard_until_s + GAP_S:
                self._reader.reset()
            self._heard_until_s = end_s
            answers = self._group.execute(data, end_s, whole=self.tamper is None)
            if answers is None:
                answers = [
                    answer
                    for packet in self._reader.feed(data)
                    if isinstance(packet, InstructionPacket)
                    for answer in self._service.execute(packet, end_s)
                ]
            if answers and self._sent and end_s + answers[0].delay_s < self._sent_until_s:
                self.collisions += 1  # the host has already begun its next packet
                self._sent.clear()
                continue
            self._answer(end_s, answers)

    def _answer(self, time_s: float, answers: Iterable[Answer]) -> None:
        for answer in answers:
            time_s += answer.delay_s
            packets = (answer.data,) if self.tamper is None else self.tamper(answer.data)
            for data in packets:
                time_s = self._arriving.add(time_s, data)
                self.busy_s += len(data) * self._byte_s
            self._quiet_s = time_s

    def _collide(self, start_s: float) -> None:
        """Two talk at once: what the servos had not said by then is lost, and so is the packet."""
        self.collisions += 1
        self._arriving.cut(start_s)
        self._quiet_s = start_s


def _frames(data: bytes) -> list[bytes]:
    """Cut what is sent in one call into packets, each of which counts when its own end arrives."""
    frames, at = [], 0
    while data.startswith(HEADER, at) and at + 7 <= len(data):
        end = at + 7 + int.from_bytes(data[at + 5 : at + 7], "little")
        if end >= len(data):
            break
        frames.append(data[at:end])
        at = end
    frames.append(data[at:])
    return frames
