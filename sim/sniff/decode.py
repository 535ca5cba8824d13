"""Decoder of an exchange on the bus into text, packet by packet.

Pings give the models of the servos; an instruction gives the meaning of its replies.
"""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass

from snakewalk.drivers.protocol.control_table import (
    ControlTable,
    Model,
    load_control_table,
    model_numbers,
)
from snakewalk.drivers.protocol.packet import (
    ALERT,
    BROADCAST_ID,
    Instruction,
    InstructionPacket,
    ResultError,
    StatusPacket,
    encode_instruction,
    encode_status,
)
from snakewalk.drivers.protocol.parser import PacketParser

Span = tuple[int, int]
"""Address and length of a block."""
_GROUP_READS = (
    Instruction.SYNC_READ,
    Instruction.FAST_SYNC_READ,
    Instruction.BULK_READ,
    Instruction.FAST_BULK_READ,
)


@dataclass(frozen=True, slots=True)
class DecodedPacket:
    """One packet, or bytes that are not a packet."""

    time_s: float
    kind: str
    """Kind of the packet: "question", "answer" or "noise"."""
    servo_id: int
    """ID of the servo; 254: all servos; -1: not known."""
    name: str
    """Name of the instruction, or of the result of a reply."""
    values: Mapping[str, object]
    """Registers by servo and name, where they are known."""
    raw: str
    """Bytes of the packet in hexadecimal."""

    def to_dict(self) -> dict[str, object]:
        """Fields for JSON."""
        return asdict(self)

    def __str__(self) -> str:
        """Line without the time, for comparisons in tests."""
        return " ".join(self.text().split()[1:])

    def text(self) -> str:
        """Line for people."""
        arrow = {"question": "->", "answer": "<-", "noise": "??"}[self.kind]
        target = {BROADCAST_ID: "all", -1: "?"}.get(self.servo_id, str(self.servo_id))
        said = ", ".join(self._by_register())
        return f"{self.time_s:12.6f}  {arrow} {target:>3}  {self.name:<16} {said or self.raw}"

    def _by_register(self) -> Iterator[str]:
        """Values as text; a register of several servos once, with its values in order."""
        several: dict[str, dict[int, str]] = {}
        for key, value in self.values.items():
            servo_id, _, register = key.partition(": ")
            if servo_id.isdigit():
                several.setdefault(register, {})[int(servo_id)] = str(value)
            else:
                yield f"{key} {value}"
        for register, values in several.items():
            said = list(dict.fromkeys(values.values()))
            words = said if len(said) == 1 else values.values()
            yield " ".join([*([register] if register else []), *words, "of", _ranges(list(values))])


def _ranges(numbers: list[int]) -> str:
    """Numbers in order, consecutive ones as ``1-16``."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return ",".join(str(run[0]) if len(run) == 1 else f"{run[0]}-{run[-1]}" for run in runs)


class Decoder:
    """Converts bytes of a bus to decoded packets; ``model`` is that of unidentified servos.

    ``models`` are those known beforehand, by ID.
    """

    def __init__(
        self, model: Model = "XM430-W350", models: Mapping[int, Model] | None = None
    ) -> None:
        self._usual = load_control_table(model)
        self._tables: dict[int, ControlTable] = {
            servo_id: load_control_table(head_places)
            for servo_id, head_places in (models or {}).items()
        }
        self._reader = PacketParser()
        self._asked: dict[int, Span] = {}
        self._fast: list[tuple[int, Span]] = []
        self._crc = self._dropped = 0
        self._last: int = Instruction.PING

    def feed(self, time_s: float, data: bytes) -> Iterator[DecodedPacket]:
        """Packets that ``data`` completes."""
        packets = self._reader.feed(data)
        damaged = self._reader.crc_errors - self._crc
        lost = self._reader.dropped_bytes - self._dropped
        self._crc = self._reader.crc_errors
        self._dropped = self._reader.dropped_bytes
        if damaged or lost:
            name = "wrong CRC" if damaged else "no packet"
            yield DecodedPacket(time_s, "noise", -1, name, {"bytes": lost}, data.hex(" "))
        for packet in packets:
            if isinstance(packet, InstructionPacket):
                yield self._question(time_s, packet)
            else:
                yield self._answer(time_s, packet)

    def _question(self, time_s: float, packet: InstructionPacket) -> DecodedPacket:
        code = packet.instruction
        params = packet.params
        servo_id = packet.servo_id
        is_known = code in Instruction.__members__.values()
        name = Instruction(code).name.lower().replace("_", " ") if is_known else f"0x{code:02X}"
        self._last = code
        self._asked.clear()
        self._fast.clear()
        values: dict[str, object] = {}
        if code == Instruction.READ and len(params) == 4:
            self._asked[servo_id] = (_word_at(params, 0), _word_at(params, 2))
            values = self._names(servo_id, self._asked[servo_id])
        elif code in (Instruction.WRITE, Instruction.REG_WRITE) and len(params) > 2:
            values = self._values(servo_id, _word_at(params, 0), params[2:])
        elif code in _GROUP_READS:
            values = self._group_read(code, params)
        elif code == Instruction.SYNC_WRITE and len(params) >= 4:
            address = _word_at(params, 0)
            size = _word_at(params, 2)
            for start in range(4, len(params) - size, size + 1):
                part = self._values(params[start], address, params[start + 1 : start + 1 + size])
                values |= {f"{params[start]}: {key}": value for key, value in part.items()}
        elif code == Instruction.BULK_WRITE:
            values = self._bulk_write(params)
        raw = encode_instruction(packet).hex(" ")
        return DecodedPacket(time_s, "question", servo_id, name, values, raw)

    def _group_read(self, code: int, params: bytes) -> dict[str, object]:
        if code in (Instruction.SYNC_READ, Instruction.FAST_SYNC_READ):
            span = (_word_at(params, 0), _word_at(params, 2))
            asked = [(param, span) for param in params[4:]]
        else:
            asked = [
                (params[start], (_word_at(params, start + 1), _word_at(params, start + 3)))
                for start in range(0, len(params) - 4, 5)
            ]
        self._asked = dict(asked)
        if code in (Instruction.FAST_SYNC_READ, Instruction.FAST_BULK_READ):
            self._fast = asked
        return {
            f"{servo_id}": ", ".join(self._names(servo_id, span)) or f"{span[0]}+{span[1]}"
            for servo_id, span in asked
        }

    def _bulk_write(self, params: bytes) -> dict[str, object]:
        values: dict[str, object] = {}
        start = 0
        while start + 5 <= len(params):
            size = _word_at(params, start + 3)
            data = params[start + 5 : start + 5 + size]
            part = self._values(params[start], _word_at(params, start + 1), data)
            values |= {f"{params[start]}: {key}": value for key, value in part.items()}
            start += 5 + size
        return values

    def _answer(self, time_s: float, packet: StatusPacket) -> DecodedPacket:
        raw = encode_status(packet).hex(" ")
        if packet.servo_id == BROADCAST_ID:
            return DecodedPacket(
                time_s, "answer", BROADCAST_ID, "ok", self._fast_parts(packet), raw
            )
        values: dict[str, object] = {}
        if self._last == Instruction.PING and len(packet.params) == 3:
            number = _word_at(packet.params, 0)
            model = model_numbers().get(number, f"model {number}")
            table = self._tables.get(packet.servo_id, self._usual)
            if table.model_number == number:
                model = table.model
            elif number in model_numbers():
                self._tables[packet.servo_id] = load_control_table(model)
            values = {"model": model, "firmware": packet.params[2]}
        elif packet.servo_id in self._asked and packet.params:
            values = self._values(packet.servo_id, self._asked[packet.servo_id][0], packet.params)
        return DecodedPacket(time_s, "answer", packet.servo_id, _outcome(packet.error), values, raw)

    def _fast_parts(self, packet: StatusPacket) -> dict[str, object]:
        said = bytes((packet.error,)) + packet.params
        values: dict[str, object] = {}
        position = 0
        for _, (address, size) in self._fast:
            error = said[position]
            servo_id = said[position + 1] if position + 1 < len(said) else -1
            data = said[position + 2 : position + 2 + size]
            if len(data) < size:
                break
            part = self._values(servo_id, address, data)
            values |= {f"{servo_id}: {key}": value for key, value in part.items()}
            if error:
                values[f"{servo_id}: error"] = _outcome(error)
            position += size + 4
            if position >= len(said):
                break
        return values

    def _names(self, servo_id: int, span: Span) -> dict[str, object]:
        inside = self._registers(servo_id, *span)
        return dict.fromkeys(inside, "?")

    def _values(self, servo_id: int, address: int, data: bytes) -> dict[str, object]:
        table = self._tables.get(servo_id, self._usual)
        texts: dict[str, object] = {}
        for name in self._registers(servo_id, address, len(data)):
            register = table[name]
            texts[name] = register.decode(data[register.address - address :])
        return texts or {f"{address}+{len(data)}": data.hex(" ")}

    def _registers(self, servo_id: int, address: int, length: int) -> list[str]:
        table = self._tables.get(servo_id, self._usual)
        return [
            name
            for name in table
            if address <= table[name].address
            and table[name].address + table[name].size <= address + length
        ]


def _outcome(error: int) -> str:
    code = error & ~ALERT
    is_known = code in ResultError.__members__.values()
    name = ResultError(code).name.lower().replace("_", " ") if is_known else f"error {code}"
    name = "ok" if code == 0 else name
    return f"{name}, alert" if error & ALERT else name


def _word_at(params: bytes, offset: int) -> int:
    return int.from_bytes(params[offset : offset + 2], "little")
