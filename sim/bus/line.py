"""Servos of Protocol 2.0 on the wire: ``sim.bus.wire`` with a bank of servos behind it."""

from collections.abc import Callable, Sequence
from typing import Protocol

from drivers.protocol.packet import HEADER, InstructionPacket
from drivers.protocol.parser import PacketReader
from sim.bus.bank import ServoBank
from sim.bus.clock import SimClock
from sim.bus.firmware import Firmware
from sim.bus.group import GroupPath
from sim.bus.noise import Noise
from sim.bus.protection import Surroundings
from sim.bus.roll import Roll
from sim.bus.service import Answer, Service
from sim.bus.wire import Wire
from sim.plant import Plant

Tamper = Callable[[bytes], Sequence[bytes]]
"""What becomes of one answer on the wire: itself, nothing, or other packets, in order."""


class Script(Protocol):
    """What a fault file does to packets and to the host."""

    noise: Noise

    def host_wakes_s(self, now_s: float) -> float:
        """When a host that wants to go on at ``now_s`` does."""
        ...


class SimLine(Wire):
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
        usb_latency_s: float = 0.0,
    ) -> None:
        super().__init__(clock if clock is not None else SimClock(plant.time_s), usb_latency_s)
        self.firmware = self._firmware(bank, plant, surroundings)
        self.bank = bank
        self.tamper = tamper
        self._script: Script | None = None
        self._service = Service(self.firmware, baud)
        self._group = GroupPath(self._service)
        self._reader = PacketReader()
        self.setBaudRate(baud)

    def attach(self, script: Script) -> None:
        """Let a fault file act on this line."""
        self._script = script

    @property
    def roll(self) -> Roll:
        """Who hears which ID."""
        return self._service.roll

    def look_again(self) -> None:
        """Take note that IDs, power or voices have changed by other means than a packet."""
        self._service.retune()

    def _firmware(
        self, bank: ServoBank, plant: Plant, surroundings: Surroundings | None
    ) -> Firmware:
        return Firmware(bank, plant, surroundings)

    def _advance(self, until_s: float) -> None:
        self.firmware.advance(until_s)

    def _forget(self) -> None:
        self._reader.reset()

    def _retune(self, baud: int) -> None:
        self._service.baud = baud
        self._service.retune()

    def _wake_host(self) -> None:
        if self._script is not None or not self.is_open:
            super()._wake_host()

    def _host_wakes_s(self, now_s: float) -> float:
        return now_s if self._script is None else self._script.host_wakes_s(now_s)

    def _must_be_open(self) -> None:
        if self._script is not None:
            self.settle()
        if not self.is_open:
            super()._must_be_open()

    def _obey(self, data: bytes, end_s: float) -> list[Answer]:
        """Let the servos hear what the host has sent."""
        if self._script is None:
            apart = self.tamper is not None or bool(self.taps)
            quick = self._group.execute(data, end_s, whole=not apart)
            return self._one_by_one(data, end_s) if quick is None else quick
        noise = self._script.noise
        heard = noise.question(data, end_s) if noise.any else [data]
        answers: list[Answer] = []
        for piece in heard:
            quick = self._group.execute(piece, end_s, whole=False)
            answers += self._one_by_one(piece, end_s) if quick is None else quick
        return answers

    def _one_by_one(self, data: bytes, end_s: float) -> list[Answer]:
        return [
            answer
            for packet in self._reader.feed(data)
            if isinstance(packet, InstructionPacket)
            for answer in self._service.execute(packet, end_s)
        ]

    def _fate(self, data: bytes, now_s: float) -> list[tuple[float, bytes]]:
        """What becomes of one answer, and by how much it is slow."""
        if self.tamper is not None:
            return [(0.0, packet) for packet in self.tamper(data)]
        if self._script is not None and self._script.noise.any:
            return self._script.noise.answer(data, now_s)
        return [(0.0, data)]

    def _frames(self, data: bytes) -> Sequence[bytes]:
        if len(data) >= 7 and data[5] | data[6] << 8 == len(data) - 7:
            return (data,)
        frames, at = [], 0
        while data.startswith(HEADER, at) and at + 7 <= len(data):
            end = at + 7 + int.from_bytes(data[at + 5 : at + 7], "little")
            if end >= len(data):
                break
            frames.append(data[at:end])
            at = end
        frames.append(data[at:])
        return frames
