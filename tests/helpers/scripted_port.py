"""A byte port whose answers a test scripts, on a clock that only waiting moves."""

from collections.abc import Callable

from snakewalk.drivers.port.byte_port import DRAIN_LIMIT_S
from snakewalk.sim.line.clock import SimClock

Script = Callable[[bytes], list[tuple[float, bytes]]]
"""What was written -> (delay after now, bytes) to arrive."""


class ScriptedPort:
    def __init__(self, script: Script, baud: int = 1_000_000) -> None:
        self.script = script
        self.clock = SimClock()
        self.name = "script"
        self.is_using = False
        self.written: list[bytes] = []
        self.arriving: list[tuple[float, bytes]] = []
        self.drains = 0
        self._baud = baud
        self._timeout_s = 0.0

    def write(self, data: bytes) -> None:
        self.written.append(data)
        now = self.clock.now_s()
        self.arriving += [(now + delay, answer) for delay, answer in self.script(data)]
        self.arriving.sort(key=lambda item: item[0])

    @property
    def paced(self) -> bool:
        """Bytes arrive when the script says."""
        return False

    def read_until(self, count: int, deadline_s: float) -> bytes:
        got = b""
        while len(got) < count and self.arriving and self.arriving[0][0] <= deadline_s:
            at, data = self.arriving.pop(0)
            self.clock.sleep_until_s(at)
            take = count - len(got)
            got += data[:take]
            if data[take:]:
                self.arriving.insert(0, (at, data[take:]))
        if len(got) < count:
            self.clock.sleep_until_s(deadline_s)
        return got

    def drain_until_quiet(self, quiet_s: float) -> int:
        self.drains += 1
        thrown, limit_s = 0, self.clock.now_s() + quiet_s + DRAIN_LIMIT_S
        while got := self.read_until(1, min(self.clock.now_s() + quiet_s, limit_s)):
            thrown += len(got)
        return thrown

    def clearPort(self) -> None:
        now = self.clock.now_s()
        self.arriving = [item for item in self.arriving if item[0] > now]

    def openPort(self) -> bool:
        return True

    def closePort(self) -> None:
        self.arriving = []

    def setBaudRate(self, baudrate: int) -> bool:
        self._baud = baudrate
        return True

    def getBaudRate(self) -> int:
        return self._baud

    def getBytesAvailable(self) -> int:
        return sum(len(data) for at, data in self.arriving if at <= self.clock.now_s())

    def readPort(self, length: int) -> bytes:
        return self.read_until(1, self._timeout_s) + self.read_until(length - 1, self.clock.now_s())

    def writePort(self, packet: bytes | list[int]) -> int:
        self.write(bytes(packet))
        return len(packet)

    def setPacketTimeout(self, packet_length: int) -> None:
        self.setPacketTimeoutMillis(34.0)

    def setPacketTimeoutMillis(self, msec: float) -> None:
        self._timeout_s = self.clock.now_s() + msec / 1e3

    def isPacketTimeout(self) -> bool:
        return self.clock.now_s() >= self._timeout_s
