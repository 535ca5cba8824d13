"""Faults of servos and adapters that no fault file has, for ``benchmarks.bus_faults``."""

import math
import random
from collections.abc import Callable
from functools import partial

from snakewalk.drivers.protocol.crc import crc16
from snakewalk.drivers.protocol.packet import HEADER, Instruction
from snakewalk.sim.line.bus_contention import Reply
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank

Action = Callable[[SimLine], None]
_ROW, _ID = 2, 3
_GOALS = bytes((Instruction.SYNC_WRITE, 116, 0, 4, 0))


def late_goals(line: SimLine) -> None:
    """Servo 3 accepts every goal two cycles late."""
    kept: list[bytes] = []

    def delayed(goal: bytes) -> bytes:
        kept.append(goal)
        return kept.pop(0) if len(kept) > 2 else kept[0]

    _change_goals(line, delayed)


def swapped_goals(line: SimLine) -> None:
    """The bytes of the goals of servo 3 arrive in reverse order."""
    _change_goals(line, lambda goal: goal[::-1])


def lost_goals(line: SimLine) -> None:
    """No goal arrives at any servo."""
    _intercept(line, lambda data: None if _is_goals(data) else data)


def echo(chance: float) -> Action:
    """The adapter sends back what it sends, with a chance for each packet."""

    def begin(line: SimLine) -> None:
        source, plain = random.Random(1), line._execute
        _listen(line)

        def execute(data: bytes, end_s: float) -> list[Reply]:
            if source.random() < chance:
                line._rx_queue.add(end_s, data)
            return plain(data, end_s)

        line._execute = execute  # type: ignore[method-assign]

    return begin


def reordered_bytes(line: SimLine) -> None:
    """Two bytes in 3 % of the replies change places."""
    source = random.Random(2)

    def tamper(reply: bytes) -> list[bytes]:
        raw = bytearray(reply)
        if source.random() < 0.03:
            at = source.randrange(len(raw) - 1)
            raw[at], raw[at + 1] = raw[at + 1], raw[at]
        return [bytes(raw)]

    line.tamper = tamper


def reordered_packets(line: SimLine) -> None:
    """Plain replies to a group read arrive in pairs of the wrong order."""
    waiting: list[bytes] = []

    def tamper(reply: bytes) -> list[bytes]:
        if reply[4] == 254:
            return []
        if len(reply) != 21:
            return [reply]
        waiting.append(reply)
        if len(waiting) < 2:
            return []
        pair = waiting[::-1]
        waiting.clear()
        return pair

    line.tamper = tamper


def drifting_baud(line: SimLine) -> None:
    """The share of damaged replies grows to 60 % in 5 s."""
    source, start_s = random.Random(2), line.clock.now_s()

    def tamper(reply: bytes) -> list[bytes]:
        raw = bytearray(reply)
        if source.random() < min(0.6, 0.12 * (line.clock.now_s() - start_s)):
            raw[source.randrange(len(raw))] ^= 1 << source.randrange(8)
        return [bytes(raw)]

    line.tamper = tamper


def growing_latency(line: SimLine) -> None:
    """The adapter holds bytes back, for longer and longer: 1 to 16 ms in 5 s."""
    for k in range(151):

        def grow(latency_s: float = 1e-3 + 1e-4 * k) -> None:
            line.usb_latency_s = latency_s

        line.firmware.events.schedule(line.clock.now_s() + k / 30, grow)


def foreign_data(line: SimLine) -> None:
    """Servos 3 and 5 reply with each other's data."""

    def change(bank: ServoBank) -> None:
        for name in ("Present Position", "Present Velocity", "Present Current"):
            bank[name][[2, 4]] = bank[name][[4, 2]].copy()

    _change_readings(line, change)


def other_block(line: SimLine) -> None:
    """Servo 3 replies with the block of another address: its velocity as its position."""

    def change(bank: ServoBank) -> None:
        bank["Present Position"][_ROW] = bank["Present Velocity"][_ROW]

    _change_readings(line, change)


def jumping_turn(every: int) -> Action:
    """The position of servo 3 jumps by a turn, in one of several reads."""

    def begin(line: SimLine) -> None:
        reads = [0]

        def change(bank: ServoBank) -> None:
            reads[0] += 1
            if reads[0] % every == 0:
                bank["Present Position"][_ROW] += 4096

        _change_readings(line, change)

    return begin


def frozen_in_motion(line: SimLine) -> None:
    """The position of servo 3 stays the same while its joint moves."""
    kept: list[int] = []

    def change(bank: ServoBank) -> None:
        if abs(line.firmware.plant.velocity_rad_s[_ROW]) <= 0.1:
            kept.clear()
            return
        kept.append(int(bank["Present Position"][_ROW]))
        bank["Present Position"][_ROW] = kept[0]

    _change_readings(line, change)


def wrong_sign_of_current(line: SimLine) -> None:
    """Servo 3 measures its current with the wrong sign."""

    def change(bank: ServoBank) -> None:
        bank["Present Current"][_ROW] *= -1

    _change_readings(line, change)


def slipped_zero(rad: float, steps: int = 1, for_s: float = 0.0) -> Action:
    """The encoder of servo 3 slips on its shaft, at once or in steps."""

    def begin(line: SimLine) -> None:
        firmware = line.firmware
        ticks = rad * 4096 / math.tau

        def slip(k: int) -> None:
            firmware._mounted_ticks[_ROW] = round(ticks * (k + 1) / steps)
            firmware.apply_registers()

        for k in range(steps):
            at_s = line.clock.now_s() + for_s * k / steps
            firmware.events.schedule(at_s, partial(slip, k))

    return begin


def weak_motor(share: float) -> Action:
    """The gears of servo 3 slip: a share of its torque reaches the joint."""

    def begin(line: SimLine) -> None:
        line.firmware.drive.torque_constant_n_m_a[_ROW] *= share

    return begin


def _is_goals(data: bytes) -> bool:
    return data.startswith(HEADER) and data[7:12] == _GOALS


def _change_goals(line: SimLine, change: Callable[[bytes], bytes]) -> None:
    """Change the goals that arrive at servo 3."""

    def changed(data: bytes) -> bytes:
        if not _is_goals(data):
            return data
        raw = bytearray(data[:-2])
        for at in range(12, len(raw), 5):
            if raw[at] == _ID:
                raw[at + 1 : at + 5] = change(bytes(raw[at + 1 : at + 5]))
        return bytes(raw) + crc16(bytes(raw)).to_bytes(2, "little")

    _intercept(line, changed)


def _intercept(line: SimLine, change: Callable[[bytes], bytes | None]) -> None:
    """Change the packets that arrive at the servos; None: they get lost."""
    plain = line._execute
    _listen(line)

    def execute(data: bytes, end_s: float) -> list[Reply]:
        changed = change(data)
        return [] if changed is None else plain(changed, end_s)

    line._execute = execute  # type: ignore[method-assign]


def _listen(line: SimLine) -> None:
    """Let all packets pass through the line, one by one."""
    line.taps.append(lambda time_s, from_host, data: None)


def _change_readings(line: SimLine, change: Callable[[ServoBank], None]) -> None:
    """Change registers whenever the motion has been measured."""
    firmware = line.firmware
    measure = firmware.refresh_motion

    def refresh_motion() -> None:
        measure()
        change(firmware.bank)

    firmware.refresh_motion = refresh_motion  # type: ignore[method-assign]
