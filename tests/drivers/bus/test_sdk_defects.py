"""Defects of dynamixel-sdk 4.1 that the drivers guard against: each shown, and us immune.

The first half of each test fails on the day when the SDK is repaired; then the guard may go.
"""

import itertools
import os
from collections.abc import Callable

import dynamixel_sdk as sdk
import numpy as np
import pytest

from snakewalk.drivers.bus.control_cycle import ControlCycle
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.errors import NoAnswerError, PortError, ServoError
from snakewalk.drivers.port.serial_port import SerialPort
from snakewalk.drivers.protocol.packet import (
    InstructionPacket,
    StatusPacket,
    encode_status,
    stuff,
    unstuff,
)
from snakewalk.drivers.protocol.parser import PacketParser
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from tests.drivers.bus.test_cycle_faults import IDS, Servos
from tests.helpers.scripted_port import ScriptedPort

HEADER_LIKE = int.from_bytes(b"\xff\xff\xfd\x00", "little")
PH = sdk.PacketHandler(2.0)


def answering(raw: bytes) -> ScriptedPort:
    return ScriptedPort(lambda _: [(1e-3, raw)])


def group(port: object, ids: tuple[int, ...] = IDS) -> sdk.GroupSyncRead:
    reads = sdk.GroupSyncRead(port, PH, 126, 10)
    for servo_id in ids:
        reads.addParam(servo_id)
    return reads


FAST = ("fastSyncRead",) if hasattr(sdk.GroupSyncRead, "fastSyncRead") else ()
"""The fast reads of this SDK: 3.7 has none."""
reads_fast = pytest.mark.skipif(not FAST, reason="dynamixel-sdk 3.7 has no fast reads")


def test_transmit_stuffing_is_never_applied() -> None:
    line = SimLine(ServoBank([1]), BenchPlant(1))
    sent: list[bytes] = []
    port = ScriptedPort(lambda raw: sent.append(raw) or [])
    PH.write4ByteTxRx(port, 1, 116, HEADER_LIKE)
    assert b"\xff\xff\xfd\xfd" not in sent[0]
    assert PacketParser().feed(sent[0]) == []  # a strict servo takes it for damage
    assert PH.write4ByteTxRx(line, 1, 20, -131073)[0] == sdk.COMM_RX_TIMEOUT

    DynamixelBus(line).write(1, "Homing Offset", -131073)
    assert line.bank["Homing Offset"].tolist() == [-131073]


def sdk_unstuff(payload: bytes) -> bytes:
    """What the SDK makes of the stuffed payload of a valid status packet."""
    raw = bytearray(encode_status(StatusPacket(1, 0, b"\0" * (len(payload) - 1))))
    raw[8:-2] = payload
    packet = PH.removeStuffing(list(raw))
    return bytes(packet[8 : 7 + packet[5] - 2])


def test_remove_stuffing_is_not_the_inverse_of_stuffing() -> None:
    words = [bytes((0, *w)) for n in (4, 7) for w in itertools.product(b"\xff\xfd", repeat=n)]
    assert [w for w in words if sdk_unstuff(stuff(w)) != w]
    for word in words:
        assert unstuff(stuff(word)) == word


def test_group_reads_drop_the_error_byte() -> None:
    line = SimLine(ServoBank([1, 2]), BenchPlant(2))
    line.bank["Hardware Error Status"][1] = 0x20
    for how in ("txRxPacket", *FAST):
        reads = group(line, (1, 2))
        assert getattr(reads, how)() == sdk.COMM_SUCCESS
        assert all(len(data) == 10 for data in reads.data_dict.values())  # and nothing beside it

    for fast in (False, True):
        assert ControlCycle(line, [1, 2], fast=fast).read().error.tolist() == [0, 0x80]


@reads_fast
def test_a_fast_bulk_read_takes_a_length_for_an_id() -> None:
    """It looks IDs up among all bytes of the request: ID 4 is found where the first length is."""
    ids, velocity = (1, 4, 7), (128, 4)
    line = SimLine(ServoBank(ids), BenchPlant(3))
    reads = sdk.GroupBulkRead(line, PH)
    for servo_id in ids:
        reads.addParam(servo_id, *velocity)
    assert [reads.fastBulkRead() for _ in range(3)] == [sdk.COMM_SUCCESS] * 3
    assert [len(reads.data_dict[k][0]) for k in ids] == [4, 4, 0]  # for ever, and a success
    with pytest.raises(IndexError):
        reads.getData(7, *velocity)
    assert reads.txRxPacket() == sdk.COMM_SUCCESS
    line.firmware.plant.velocity_rad_s[:] = 1.0
    assert reads.fastBulkRead() == sdk.COMM_SUCCESS
    assert [bool(reads.getData(k, *velocity)) for k in ids] == [True, True, False]  # the old value

    mixed = sdk.GroupBulkRead(line, PH)
    for request in ((7, 132, 4), (4, 2, 10), (1, 144, 2)):
        mixed.addParam(*request)
    assert [mixed.fastBulkRead() for _ in range(3)] == [sdk.COMM_RX_CORRUPT] * 3

    assert ControlCycle(line, ids, fast=True).read().valid.all()


def test_an_error_in_a_group_read_counts_as_its_value() -> None:
    def script(_: bytes) -> list[tuple[float, bytes]]:
        refused = StatusPacket(2, 7, b"\x11" * 10)
        return [
            (1e-3, encode_status(StatusPacket(1, 0, b"\x01" * 10))),
            (2e-3, encode_status(refused)),
        ]

    reads = group(ScriptedPort(script), (1, 2))
    assert reads.txRxPacket() == sdk.COMM_SUCCESS
    assert reads.getData(2, 132, 4) == 0x11111111

    reply = ControlCycle(ScriptedPort(script), (1, 2), fast=False).read()
    assert reply.answered.all()
    assert reply.valid.tolist() == [True, False]


@pytest.mark.parametrize("how", ["txRxPacket", *FAST])
def test_one_missing_servo_loses_the_whole_group(how: str) -> None:
    line = SimLine(ServoBank([1, 2, 4]), BenchPlant(3))
    reads = group(line)
    assert getattr(reads, how)() != sdk.COMM_SUCCESS
    assert [reads.getData(i, 132, 4) for i in (1, 2, 4)] == [0, 0, 0]  # zeros, not "unknown"

    cycle = ControlCycle(line, IDS, fast=how == "fastSyncRead")
    for _ in range(4):
        reply = cycle.read()
    assert reply.valid.tolist() == [True, True, False, True]
    assert reply.data[reply.valid][:, 6:10].copy().view("<i4").ravel().tolist() == [2048] * 3


def test_an_error_without_data_is_success_and_then_an_index_error() -> None:
    refused = encode_status(StatusPacket(1, 0x02))
    data, result, _ = PH.readTxRx(answering(refused), 1, 132, 4)
    assert result == sdk.COMM_SUCCESS
    assert len(data) != 4
    with pytest.raises(IndexError):
        PH.read4ByteTxRx(answering(refused), 1, 132)

    with pytest.raises(ServoError, match="refused: instruction"):
        DynamixelBus(answering(refused)).read(1, "Present Position")


def test_the_crc_of_a_short_answer_counts_as_data() -> None:
    short = encode_status(StatusPacket(1, 0, b"\x34\x12"))
    value, result, error = PH.read4ByteTxRx(answering(short), 1, 132)
    assert (result, error) == (sdk.COMM_SUCCESS, 0)
    assert value == int.from_bytes(short[9:13], "little")

    with pytest.raises(Exception, match="2 bytes came, not 4"):
        DynamixelBus(answering(short)).read(1, "Present Position")


def test_an_exception_in_the_port_leaves_it_busy() -> None:
    failing = [True]

    def script(raw: bytes) -> list[tuple[float, bytes]]:
        if failing:
            failing.pop()
            raise PortError("pulled out")
        return [(1e-3, encode_status(StatusPacket(1, 0, b"\xfc\x03\x30")))]

    port = ScriptedPort(script)
    with pytest.raises(PortError):
        PH.ping(port, 1)
    assert [PH.ping(port, 1)[1] for _ in range(3)] == [sdk.COMM_PORT_BUSY] * 3

    port.is_using = False
    failing.append(True)
    bus = DynamixelBus(port)
    with pytest.raises(PortError):
        bus.ping(1)
    assert bus.ping(1).model_number == 1020


def stalled(read: Callable[[ScriptedPort], Callable[[], set[int]]]) -> list[tuple[set[int], int]]:
    """Values that counted as new in each cycle, and the value that would have been: one stall."""
    servos = Servos()
    servos.late_s = {3: 0.040}  # longer than the SDK waits: 34 ms and the wire
    port = ScriptedPort(servos)
    once = read(port)
    return [(once(), servos.asked) for _ in range(40)]


@reads_fast
def test_after_a_stall_a_fast_read_returns_the_cycle_before() -> None:
    def by_sdk(port: ScriptedPort) -> Callable[[], set[int]]:
        reads = group(port)

        def once() -> set[int]:
            if reads.fastSyncRead() != sdk.COMM_SUCCESS:
                return set()
            return {reads.getData(i, 132, 1) for i in IDS}

        return once

    def by_us(port: ScriptedPort) -> Callable[[], set[int]]:
        cycle = ControlCycle(port, IDS, fast=True)

        def once() -> set[int]:
            reply = cycle.read()
            return set(reply.data[reply.valid].ravel().tolist())

        return once

    old = [k for k, (values, asked) in enumerate(stalled(by_sdk)) if values and values != {asked}]
    assert len(old) > 30  # it stays one cycle behind
    assert all(values <= {asked} for values, asked in stalled(by_us))


def test_a_broadcast_ping_takes_most_of_a_second() -> None:
    line = SimLine(ServoBank([1, 2]), BenchPlant(2))
    found, _ = PH.broadcastPing(line)
    assert sorted(found) == [1, 2]
    assert line.clock.now_s() > 0.75

    before_s = line.clock.now_s()
    assert sorted(DynamixelBus(line).find([1, 2])) == [1, 2]
    assert line.clock.now_s() - before_s < 0.005


def test_two_servos_of_one_id_look_like_one_in_a_broadcast_ping() -> None:
    line = SimLine(ServoBank([1, 2]), BenchPlant(2))
    line.tamper = lambda raw: (raw, raw) if raw[4] == 2 else (raw,)
    assert sorted(PH.broadcastPing(line)[0]) == [1, 2]

    assert DynamixelBus(line).probe(2).doubled
    assert not DynamixelBus(line).probe(1).doubled


def test_waiting_for_an_answer_spins() -> None:
    master, slave = os.openpty()
    calls = {"sdk": 0, "ours": 0}
    theirs = sdk.PortHandler(os.ttyname(slave))
    try:
        assert theirs.openPort()

        def counted(name: str, port: object) -> None:
            read = port.readPort  # type: ignore[attr-defined]

            def one(length: int) -> bytes:
                calls[name] += 1
                return read(length)  # type: ignore[no-any-return]

            port.readPort = one  # type: ignore[attr-defined]
            assert PH.ping(port, 1)[1] == sdk.COMM_RX_TIMEOUT

        counted("sdk", theirs)
        theirs.closePort()
        with SerialPort(os.ttyname(slave)) as ours:
            counted("ours", ours)
    finally:
        theirs.closePort()
        os.close(master)
        os.close(slave)
    assert calls["ours"] <= 8
    assert calls["sdk"] > 5 * calls["ours"]


def test_a_servo_that_is_silent_is_named_with_the_baud_rate() -> None:
    assert (
        PH.getTxRxResult(PH.ping(answering(b""), 9)[1]) == "[TxRxResult] There is no status packet!"
    )

    with pytest.raises(NoAnswerError, match=r"servo 9: .*1000000 baud"):
        DynamixelBus(answering(b"")).ping(9)


def test_their_packets_are_ours_where_nothing_needs_stuffing() -> None:
    """Differential: both clients put the same bytes on the wire."""
    rng = np.random.default_rng(5)
    for _ in range(300):
        servo_id, address = int(rng.integers(0, 253)), int(rng.integers(0, 1024))
        data = rng.integers(0, 256, int(rng.integers(1, 40)), np.uint8).tobytes()
        sent: list[bytes] = []
        port = ScriptedPort(lambda raw, sent=sent: sent.append(raw) or [])
        PH.writeTxOnly(port, servo_id, address, len(data), list(data))
        (packet,) = PacketParser().feed(sent[0]) if b"\xff\xff\xfd" not in data else (None,)
        if packet is not None:
            assert packet == InstructionPacket(servo_id, 3, address.to_bytes(2, "little") + data)
