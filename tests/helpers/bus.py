"""Short ways to a simulated bus, for the tests of this folder."""

import math
import os
import select
from collections.abc import Iterator

from snakewalk.drivers.protocol.packet import (
    Instruction,
    InstructionPacket,
    StatusPacket,
    encode_instruction,
)
from snakewalk.drivers.protocol.parser import PacketParser
from snakewalk.sim.line.clock import SimClock
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.serve.pty import IDLE_S, PtyServer
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

ALL = 0xFE
CARRIED_S = 10.0
"""Bytes of a pty that a worker of the kernel has not carried by then are lost."""
PATIENT = {
    "run.safety.stale_limit_s": 5.0,
    "run.safety.slow_stale_limit_s": 20.0,
    "run.safety.watchdog_s": 2.5,
    "run.safety.following_time_s": 20.0,
}
"""Of a run at a pty: servos and run share the processors with other tests, or with a browser."""


def a_line(
    joints: int = 2, *, delay: int = 0, model: str = "XM430-W350", **bench: object
) -> SimLine:
    line = SimLine(ServoBank(range(1, joints + 1), model), BenchPlant(joints, **bench))
    for servo in range(1, joints + 1):
        write(line, servo, 9, delay, 1)
    return line


def serve_for(server: PtyServer, clock: SimClock, seconds: float) -> None:
    """Let time pass as a server in its loop sees it."""
    for _ in range(round(seconds / IDLE_S)):
        clock.advance(IDLE_S)
        server.step(0.0)


def send_to(server: PtyServer, client: int, data: bytes) -> None:
    """Write to a pty, and wait until a worker of the kernel has carried the bytes across."""
    os.write(client, data)
    assert select.select([server._master], [], [], CARRIED_S)[0]


def take(client: int, count: int) -> bytes:
    """Read ``count`` bytes that a server has written, however the kernel cuts them."""
    got = b""
    while len(got) < count:
        assert select.select([client], [], [], CARRIED_S)[0], got
        got += os.read(client, count - len(got))
    return got


def ask(line: SimLine, servo_id: int, code: int, params: bytes = b"") -> list[StatusPacket]:
    """Send one instruction and wait 20 ms for answers."""
    return send(line, encode_instruction(InstructionPacket(servo_id, code, params)))


def send(line: SimLine, raw: bytes) -> list[StatusPacket]:
    packets = PacketParser().feed(exchange(line, raw))
    assert all(isinstance(packet, StatusPacket) for packet in packets)
    return packets


def exchange(line: SimLine, raw: bytes) -> bytes:
    line.write(raw)
    return line.read_until(10_000, line.clock.now_s() + 0.02)


def write(line: SimLine, servo_id: int, address: int, value: int, size: int) -> int:
    """Error byte of the answer."""
    data = value.to_bytes(size, "little", signed=value < 0)
    (status,) = ask(line, servo_id, Instruction.WRITE, address.to_bytes(2, "little") + data)
    return status.error


def read(line: SimLine, servo_id: int, address: int, size: int, *, signed: bool = True) -> int:
    params = address.to_bytes(2, "little") + size.to_bytes(2, "little")
    (status,) = ask(line, servo_id, Instruction.READ, params)
    return int.from_bytes(status.params, "little", signed=signed)


def rad(ticks: int) -> float:
    return (ticks - 2048) * math.tau / 4096


def group_params(address: int, length: int, ids: Iterator[int] | range) -> bytes:
    return address.to_bytes(2, "little") + length.to_bytes(2, "little") + bytes(ids)


def goals(ticks: dict[int, int]) -> bytes:
    """A sync write of goal positions."""
    entries = b"".join(
        bytes((servo,)) + tick.to_bytes(4, "little", signed=True) for servo, tick in ticks.items()
    )
    return encode_instruction(
        InstructionPacket(ALL, Instruction.SYNC_WRITE, b"\x74\0\4\0" + entries)
    )
