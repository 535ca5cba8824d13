"""Random and mutated bytes into every parser: a short run always, a million with ``slow``."""

import random

import numpy as np
import pytest

from snakewalk.drivers.bus.group_read import GroupReadRequest
from snakewalk.drivers.errors import DriverError
from snakewalk.drivers.protocol.packet import (
    BROADCAST_ID,
    Instruction,
    InstructionPacket,
    StatusPacket,
    encode_instruction,
    encode_status,
)
from snakewalk.drivers.protocol.parser import PacketParser
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from tests.drivers.bus.test_group_codec import fast as fast_answer

GOOD = StatusPacket(7, 0, b"\x01\x02\x03")
GOOD_RAW = encode_status(GOOD)
MAX_LENGTH = 64
"""Of the reader under test, so that a false header is settled soon."""
COPIES = 1 + (MAX_LENGTH + 7) // len(GOOD_RAW)
IDS = (1, 2, 3, 4)
NASTY = (0xFF, 0xFD, 0x00, 0x55, 0xFE, 0x01, 0x03)


def noise(rng: random.Random, longest: int) -> bytes:
    """Bytes, half of them from those that headers are made of."""
    count = rng.randrange(longest)
    if rng.random() < 0.5:
        return rng.randbytes(count)
    return bytes(rng.choices(NASTY, k=count))


def mutated(rng: random.Random, raw: bytes) -> bytes:
    """``raw`` with one to four things done to it."""
    data = bytearray(raw)
    for _ in range(rng.randrange(1, 5)):
        at = rng.randrange(len(data) + 1)
        kind = rng.randrange(6)
        if kind == 0 and at < len(data):
            data[at] ^= 1 << rng.randrange(8)
        elif kind == 1 and at < len(data):
            data[at] = rng.choice(NASTY)
        elif kind == 2:
            del data[at : at + rng.randrange(6)]
        elif kind == 3:
            data[at:at] = noise(rng, 8)
        elif kind == 4:
            data[at:at] = data[at : at + rng.randrange(20)]
        else:
            del data[at:]
    return bytes(data)


def packet(rng: random.Random) -> bytes:
    """Some valid packet."""
    servo_id = rng.choice((*range(10), 252, BROADCAST_ID))
    params = noise(rng, 24)
    if rng.random() < 0.5:
        return encode_status(StatusPacket(servo_id, rng.randrange(256), params))
    return encode_instruction(InstructionPacket(servo_id, rng.choice(list(Instruction)), params))


def stream(rng: random.Random) -> bytes:
    """One of three kinds: noise, damaged packets, both."""
    kind = rng.randrange(3)
    if kind == 0:
        return noise(rng, 60)
    hurt = b"".join(mutated(rng, packet(rng)) for _ in range(rng.randrange(1, 3)))
    return hurt if kind == 1 else noise(rng, 20) + hurt + noise(rng, 20)


def fuzz_reader(streams: int, seed: int) -> None:
    rng = random.Random(seed)
    chance_hits = 0
    for _ in range(streams):
        reader = PacketParser(MAX_LENGTH)
        data = stream(rng)
        cut = rng.randrange(len(data) + 1)
        reader.feed(data[:cut])
        assert reader.pending <= MAX_LENGTH + 7
        reader.feed(data[cut:])
        assert reader.pending <= MAX_LENGTH + 7
        packets = reader.feed(GOOD_RAW * COPIES)
        # All copies are found, unless a damaged header met a right CRC by chance and ate some
        chance_hits += packets[-COPIES:] != [GOOD] * COPIES
        assert packets[-1] == GOOD
        assert reader.pending == 0
    assert chance_hits <= 2 + streams / 2_000


def fuzz_group_answer(streams: int, seed: int) -> None:
    rng = random.Random(seed)
    requests = {kind: GroupReadRequest(IDS, 126, 10, fast=kind) for kind in (False, True)}
    wrong = 0
    for _ in range(streams):
        kind = rng.random() < 0.5
        blocks = [rng.randbytes(10) for _ in IDS]
        true = np.array([list(block) for block in blocks], np.uint8)
        raw = (
            fast_answer(blocks, ids=IDS)
            if kind
            else b"".join(
                encode_status(StatusPacket(i, 0, b)) for i, b in zip(IDS, blocks, strict=True)
            )
        )
        reply = requests[kind].parse(stream(rng) if rng.random() < 0.2 else mutated(rng, raw))
        assert reply.data.shape == (4, 10)
        assert not (reply.valid & ~reply.answered).any()
        wrong += bool((reply.data[reply.valid] != true[reply.valid]).any())
    assert wrong <= 2 + streams / 20_000  # a CRC of 16 bits


def fuzz_servos(streams: int, seed: int) -> None:
    """The simulated servos' side: any bytes, and any well-formed packet with any content."""
    rng = random.Random(seed)
    ping = encode_instruction(InstructionPacket(1, Instruction.PING))
    hello = encode_status(StatusPacket(1, 0, b"\xfc\x03\x30"))
    for k in range(streams):
        if k % 200 == 0:  # what was written may have renamed or muted the servos
            line = SimLine(ServoBank([1, 2]), BenchPlant(2))
        data = packet(rng) if rng.random() < 0.5 else stream(rng)
        try:
            line.write(data)
            while line.drain_until_quiet(0.02):  # a call ends in time, the replies may not
                pass
        except DriverError:
            continue
        line.bank["ID"][:] = [1, 2]
        line.bank["Baud Rate"][:] = 3
        line.bank["Hardware Error Status"][:] = 0
        line.setBaudRate(1_000_000)
        line.write(ping)
        assert hello in line.read_until(200, line.clock.now_s() + 0.002), data.hex(" ")


def test_the_reader_is_in_step_again_at_the_next_good_packet() -> None:
    fuzz_reader(20_000, seed=1)


def test_group_answers_are_right_or_missing() -> None:
    fuzz_group_answer(10_000, seed=2)


def test_servos_answer_after_anything() -> None:
    fuzz_servos(1_500, seed=3)


@pytest.mark.nightly("a soak: 1,050,000 byte streams")
@pytest.mark.parametrize("seed", range(10))
def test_a_million_streams(seed: int) -> None:
    fuzz_reader(60_000, seed=100 + seed)
    fuzz_group_answer(40_000, seed=200 + seed)
    fuzz_servos(5_000, seed=300 + seed)
