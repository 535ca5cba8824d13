"""Noise: packets that do not arrive as sent, by the script of a fault file."""

import random
from collections.abc import Callable, Collection
from typing import Protocol, assert_never

from snakewalk.config import faults as plan

DELAY_S, LATE_S = 1e-3, 0.05
"""Delay of a reply where the file gives none; a late one comes after any time-out."""


class Noise:
    """The noise faults of a plan, with one seeded source.

    ``senders`` returns the IDs of the servos that sent a reply.
    """

    def __init__(
        self, source: random.Random, start_s: float, senders: Callable[[bytes], Collection[int]]
    ) -> None:
        self._random = source
        self._start_s = start_s
        self._senders = senders
        self._faults: list[plan.NoiseFault] = []
        self.counts: dict[str, int] = {}
        """Number of changed packets by kind of fault."""

    def add(self, fault: plan.NoiseFault) -> None:
        """Add a fault; faults act in this order."""
        self._faults.append(fault)

    @property
    def any(self) -> bool:
        """Whether there are faults."""
        return bool(self._faults)

    def reply(self, data: bytes, now_s: float) -> list[tuple[float, bytes]]:
        """Packets that arrive from one reply, each with its delay."""
        return self._change(data, now_s, "answers")

    def instruction(self, data: bytes, now_s: float) -> list[bytes]:
        """Packets that the servos receive from one instruction."""
        return [packet for _, packet in self._change(data, now_s, "questions")]

    def _change(self, data: bytes, now_s: float, of: str) -> list[tuple[float, bytes]]:
        packets = [(0.0, data)]
        for fault in self._faults:
            if not self._applies(fault, data, now_s, of):
                continue
            self.counts[fault.kind] = self.counts.get(fault.kind, 0) + 1
            packets = [new for packet in packets for new in self._apply_fault(fault, *packet)]
        return packets

    def _applies(self, fault: plan.NoiseFault, data: bytes, now_s: float, of: str) -> bool:
        since_s = now_s - self._start_s - fault.at_s
        if fault.of not in (of, "both") or since_s < 0.0:
            return False
        if fault.for_s is not None and since_s >= fault.for_s:
            return False
        if fault.ids and not set(fault.ids).intersection(self._senders(data)):
            return False
        return fault.chance >= 1.0 or self._random.random() < fault.chance

    def _apply_fault(
        self, fault: plan.NoiseFault, slow_s: float, data: bytes
    ) -> list[tuple[float, bytes]]:
        if not data:
            return []
        match fault.kind:
            case "drop":
                return []
            case "corrupt":
                position = self._random.randrange(len(data))
                bit = self._random.randrange(8)
                return [
                    (
                        slow_s,
                        data[:position]
                        + bytes((data[position] ^ 1 << bit,))
                        + data[position + 1 :],
                    )
                ]
            case "truncate":
                return [(slow_s, data[: self._random.randrange(1, max(2, len(data)))])]
            case "duplicate":
                return [(slow_s, data), (slow_s, data)]
            case "delay":
                return [(slow_s + (fault.by_s or DELAY_S), data)]
            case "late":
                return [(slow_s + (fault.by_s or LATE_S), data)]
            case unknown:
                assert_never(unknown)


class FaultScript(Protocol):
    """Effect of a fault file on packets and host."""

    noise: Noise

    def host_resumes_s(self, now_s: float) -> float:
        """Time at which a host that calls at ``now_s`` continues."""
        ...
