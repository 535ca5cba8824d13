"""A recorded exchange as a device: a line that repeats recorded replies."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from snakewalk.config.errors import InputError
from snakewalk.drivers.protocol.packet import BITS_PER_BYTE, BROADCAST_ID, HEADER, Instruction
from snakewalk.sim.line.bus_contention import Reply
from snakewalk.sim.line.clock import SimClock
from snakewalk.sim.line.wire import Wire
from snakewalk.sim.sniff.trace import read_exchange

_ID_AT = 4
_CODE_AT = 7
_ADDRESS = slice(8, 10)
_WRITES = (Instruction.WRITE, Instruction.REG_WRITE)


@dataclass(slots=True)
class Exchange:
    """A packet of the host, and its replies."""

    question: bytes
    replies: list[Reply] = field(default_factory=list)


class RecordedLine(Wire):
    """A line without servos: it answers a packet as in the recording.

    It searches a packet from the last match to the end, then from the beginning. For a write it
    compares servo and address only. Unknown packets get no reply.
    """

    def __init__(self, exchanges: Sequence[Exchange], baud: int = 1_000_000) -> None:
        super().__init__(SimClock())
        self._exchanges = tuple(exchanges)
        self._at = 0
        self.unknown = 0
        """Packets that the recording does not have."""
        self.setBaudRate(baud)

    @staticmethod
    def of(path: Path, baud: int = 1_000_000) -> "RecordedLine":
        """Line of a recording of ``bus serve --record`` at ``baud``.

        Raises:
            InputError: it is not such a recording, or no host sends in it.

        """
        byte_s = BITS_PER_BYTE / baud
        exchanges: list[Exchange] = []
        quiet_s = 0.0
        for time_s, from_host, data in read_exchange(path):
            if from_host:
                exchanges.append(Exchange(data))
            elif exchanges:  # the first bytes are not a reply
                begin_s = time_s - len(data) * byte_s
                exchanges[-1].replies.append(Reply(max(begin_s - quiet_s, 0.0), data))
            quiet_s = time_s
        if not exchanges:
            raise InputError(f"{path}: contains no packet of a host")
        return RecordedLine(exchanges, baud)

    @property
    def ids(self) -> list[int]:
        """Servos that reply in the recording."""
        servo_ids = {
            reply.data[_ID_AT] for exchange in self._exchanges for reply in exchange.replies
        }
        return sorted(servo_ids - {BROADCAST_ID})  # of a fast read: all requested servos

    # the wire

    def _advance(self, until_s: float) -> None: ...

    def _reset_parser(self) -> None: ...

    def _on_baud_change(self, baud: int) -> None: ...

    def _execute(self, data: bytes, end_s: float) -> list[Reply]:
        for alike in (_is_same_request, _same_write):
            for k in range(len(self._exchanges)):
                index = (self._at + k) % len(self._exchanges)
                if alike(self._exchanges[index].question, data):
                    self._at = index + 1
                    return list(self._exchanges[index].replies)
        self.unknown += 1
        return []

    def _split(self, data: bytes) -> Sequence[bytes]:
        starts = [start for start in range(len(data)) if data.startswith(HEADER, start)] or [0]
        ends = [*starts[1:], len(data)]
        return [data[start:end] for start, end in zip(starts, ends, strict=True)]


def _is_same_request(recorded: bytes, data: bytes) -> bool:
    return recorded == data


def _same_write(recorded: bytes, data: bytes) -> bool:
    return _place(recorded) == _place(data) is not None


def _place(data: bytes) -> bytes | None:
    """ID, instruction and address of a write, else None."""
    if len(data) < _ADDRESS.stop or data[_CODE_AT] not in _WRITES:
        return None
    return bytes([data[_ID_AT], data[_CODE_AT]]) + data[_ADDRESS]
