"""The serial fast path on a pseudo-terminal; the test is the other end."""

import os
import threading
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snakewalk.drivers.bus.control_cycle import SPIN_FROM_BAUD, SPIN_S, ControlCycle
from snakewalk.drivers.bus.group_read import GroupReadReply, GroupReadRequest
from snakewalk.drivers.bus.group_write import GroupWrite
from snakewalk.drivers.bus.line_reservation import LineReservation
from snakewalk.drivers.bus.serial_fast_path import REPLY_NS, SPIN_NS, WRITE_NS, SerialFastPath
from snakewalk.drivers.errors import PortError
from snakewalk.drivers.port.serial_port import SerialPort
from snakewalk.drivers.port.serial_wait import LATE, update
from snakewalk.drivers.protocol.packet import Instruction, InstructionPacket
from snakewalk.drivers.protocol.parser import PacketParser
from tests.drivers.bus.test_group_codec import HEADER_LIKE, fast, plain

IDS = (1, 2, 3, 4)
FAR_S = 5.0
"""No reply here takes so long, however busy the machine."""
Reply = Callable[[InstructionPacket, int], bytes]
"""A request, and the first goal that was sent before it -> the servos' reply."""

both_kinds = pytest.mark.parametrize("is_fast", [False, True], ids=["plain", "fast"])
both_calls = pytest.mark.parametrize("with_goals", [False, True], ids=["read", "both"])


class Servos:
    """Read all that is written to a pseudo terminal, and reply to requests."""

    def __init__(self) -> None:
        self.master, self._slave = os.openpty()
        self.port = SerialPort(os.ttyname(self._slave), 4_000_000)
        self.received: list[InstructionPacket] = []
        self._thread: threading.Thread | None = None

    def serve(self, reply: Reply, requests: int = 1) -> None:
        """Reply to so many, in a thread."""

        def run() -> None:
            reader, goal, left = PacketParser(), 0, requests
            while left:
                for packet in reader.feed(os.read(self.master, 4096)):
                    assert isinstance(packet, InstructionPacket)
                    self.received.append(packet)
                    if packet.instruction == Instruction.SYNC_WRITE:
                        goal = int.from_bytes(packet.params[5:9], "little", signed=True)
                    else:
                        left -= 1
                        os.write(self.master, reply(packet, goal))

        self._thread = threading.Thread(target=run)
        self._thread.start()

    def close(self) -> None:
        if self._thread is not None:
            self._thread.join()
        self.port.closePort()
        os.close(self.master)
        os.close(self._slave)


@pytest.fixture
def servos() -> Iterator[Servos]:
    made = Servos()
    yield made
    made.close()


def blocks(packet: InstructionPacket, first: int) -> list[bytes]:
    """Of each servo asked, full of numbers that count from ``first``."""
    length = int.from_bytes(packet.params[2:4], "little")
    return [bytes([(first + k) & 0x7F]) * length for k in range(len(packet.params) - 4)]


def echo(packet: InstructionPacket, goal: int) -> bytes:
    data = blocks(packet, goal)
    return fast(data) if packet.instruction == Instruction.FAST_SYNC_READ else plain(data)


def fast_path(
    servos: Servos, *, is_fast: bool, latency_s: float = FAR_S, spin_s: float = 4e-5
) -> SerialFastPath:
    request, line = GroupReadRequest(IDS, 126, 10, fast=is_fast), LineReservation(servos.port.clock)
    return SerialFastPath(
        servos.port, GroupWrite(IDS, 116), request, line, latency_s=latency_s, spin_s=spin_s
    )


def transact(path: SerialFastPath, goals: np.ndarray | None) -> GroupReadReply | bytes | None:
    return path.finish() if path.begin(goals) else None


@both_kinds
@both_calls
@pytest.mark.parametrize("spin_s", [0.0, 4e-5])
def test_request_and_reply(servos: Servos, is_fast: bool, with_goals: bool, spin_s: float) -> None:
    servos.serve(echo, requests=30)
    cycle = fast_path(servos, is_fast=is_fast, spin_s=spin_s)
    for k in range(30):
        goals = np.arange(k, k + 4, dtype=np.int32)
        reply = transact(cycle, goals if with_goals else None)
        assert isinstance(reply, GroupReadReply)
        assert reply.valid.all()
        assert reply.data.tolist() == [[n if with_goals else n - k] * 10 for n in goals.tolist()]
    request = GroupReadRequest(IDS, 126, 10, fast=is_fast).packet
    written = GroupWrite(IDS, 116).encode(np.arange(29, 33)) if with_goals else b""
    assert servos.received[-1 - with_goals :] == PacketParser().feed(written + request)


def test_replies_are_kept_apart(servos: Servos) -> None:
    """What one cycle has given stays as it is in the next."""
    codes = iter([[0, 0x80, 3, 0], [7, 0, 0, 0]])
    servos.serve(lambda packet, goal: plain(blocks(packet, goal), next(codes)), requests=2)
    cycle = fast_path(servos, is_fast=False)
    first, second = (transact(cycle, np.full(4, k, np.int32)) for k in (1, 60))
    assert isinstance(first, GroupReadReply)
    assert isinstance(second, GroupReadReply)
    assert first.error.tolist() == [0, 0x80, 3, 0]
    assert first.valid.tolist() == [True, True, False, True]
    assert first.data[:, 0].tolist() == [1, 2, 3, 4]
    assert second.error.tolist() == [7, 0, 0, 0]


@both_kinds
@both_calls
@settings(max_examples=30)  # waits for another thread
@given(st.data())
def test_what_is_not_as_expected_is_handed_back(
    is_fast: bool, with_goals: bool, draw: st.DataObject
) -> None:
    whole = bytearray(fast([b"a" * 10] * 4) if is_fast else plain([b"a" * 10] * 4))
    whole[draw.draw(st.integers(0, len(whole) - 1))] ^= draw.draw(st.integers(1, 255))
    servos = Servos()
    try:
        servos.serve(lambda *_: bytes(whole))
        cycle = fast_path(servos, is_fast=is_fast)
        assert transact(cycle, np.zeros(4, np.int32) if with_goals else None) == bytes(whole)
        assert cycle.remaining_s < FAR_S + 1.0
    finally:
        servos.close()


@both_kinds
def test_a_reply_cut_short_is_handed_back_at_the_deadline(servos: Servos, is_fast: bool) -> None:
    said = fast([b"a" * 10] * 4)[:30] if is_fast else plain([b"a" * 10] * 4)[:21]
    servos.serve(lambda *_: said)
    cycle = fast_path(servos, is_fast=is_fast, latency_s=0.2)
    found = transact(cycle, None)
    assert isinstance(found, bytes)
    assert said.startswith(found)
    assert cycle.remaining_s <= 0.0


def test_goals_that_must_be_stuffed_go_another_way(servos: Servos) -> None:
    goals = np.array([5, HEADER_LIKE, 5, 5], np.int32)
    alone = fast_path(servos, is_fast=False)
    assert alone.write(goals) == 0
    assert transact(alone, goals) is None
    assert servos.received == []
    servos.serve(echo)
    cycle = ControlCycle(servos.port, IDS, fast=False, latency_s=FAR_S)
    cycle.write_goals(goals)
    reply = cycle.read(goals)
    assert reply.data[:, 0].tolist() == [5, 6, 7, 8]
    written = PacketParser().feed(GroupWrite(IDS, 116).encode(goals))
    assert servos.received[:2] == written * 2


@pytest.mark.parametrize("call", ["write_goals", "both"])
def test_a_full_device_is_waited_for(servos: Servos, call: str) -> None:
    """What it takes of a packet is not sent twice."""
    goals = np.arange(4, dtype=np.int32)
    fd = servos.port.descriptor
    assert fd is not None
    filling = GroupWrite(IDS, 116).encode(goals + 9)
    try:
        while os.write(fd, filling) == len(filling):
            pass
        cut = True  # in mid-packet: what follows it is noise up to the next
    except BlockingIOError:
        cut = False
    servos.serve(echo)
    cycle = ControlCycle(servos.port, IDS, fast=False, latency_s=FAR_S)
    if call == "both":
        reply = cycle.read(goals)
    else:
        cycle.write_goals(goals)
        reply = cycle.read()
    assert reply.valid.all()
    expected = PacketParser().feed(GroupWrite(IDS, 116).encode(goals))
    if not cut:
        assert servos.received[-2:-1] == expected


@pytest.mark.parametrize("call", ["write_goals", "both", "read"])
@pytest.mark.parametrize("how", ["closed", "vanished"])
def test_a_port_that_is_gone_is_a_port_error(call: str, how: str) -> None:
    servos = Servos()
    cycle = ControlCycle(servos.port, IDS, latency_s=FAR_S)
    if how == "closed":
        servos.port.closePort()
    else:
        os.close(servos._slave)
        os.close(servos.master)
    goals = np.zeros(4, np.int32)
    calls = {
        "write_goals": lambda: cycle.write_goals(goals),
        "both": lambda: cycle.read(goals),
        "read": cycle.read,
    }
    with pytest.raises(PortError, match="is closed" if how == "closed" else "the port is gone"):
        calls[call]()
    if how == "closed":
        os.close(servos._slave)
        os.close(servos.master)
    servos.port.closePort()


def test_a_port_that_was_opened_again_is_used_again(servos: Servos) -> None:
    cycle = ControlCycle(servos.port, IDS, latency_s=FAR_S)
    servos.port.closePort()
    assert servos.port.openPort()
    servos.serve(echo)
    assert cycle.read(np.zeros(4, np.int32)).valid.all()


@both_kinds
def test_a_late_reply_is_never_taken_for_a_new_one(servos: Servos, is_fast: bool) -> None:
    """The reply to the third request comes right in front of that to the fourth."""
    held: list[bytes] = []
    asked = 0

    def reply(packet: InstructionPacket, goal: int) -> bytes:
        nonlocal asked
        asked += 1
        said = echo(packet, goal)
        if asked == 3:
            held.append(said)
            return b""
        return b"".join([*held, said]) if asked == 4 else said

    servos.serve(reply, requests=12)
    cycle = ControlCycle(servos.port, IDS, fast=is_fast, latency_s=0.1)
    seen = []
    for k in range(12):
        found = cycle.read(np.full(4, 10 * k, np.int32))
        now = np.arange(10 * k, 10 * k + 4)[:, None] & 0x7F
        assert (found.data == now)[found.valid].all()
        seen.append(bool(found.valid.all()))
    assert not seen[2]


def test_times_follow_the_baud_rate(servos: Servos) -> None:
    cycle = fast_path(servos, is_fast=False)
    for baud in (57_600, 1_000_000):
        servos.port.setBaudRate(baud)
        assert cycle.write(np.zeros(4, np.int32)) == 34
        assert cycle._baud == baud
        assert cycle._plan[WRITE_NS : REPLY_NS + 1].tolist() == [
            n * 10**10 // baud for n in (34, 18, 4 * 21)
        ]


late_ns = st.integers(-50_000, 2_000_000)


@given(late_ns)
def test_a_steady_lateness_is_estimated(lateness_ns: int) -> None:
    latency_estimate = np.zeros(2, np.int64)
    for _ in range(1000):
        update(latency_estimate, lateness_ns, 1_000_000, 40_000)
    assert abs(latency_estimate[LATE] - lateness_ns) <= 8


@given(st.integers(1, 10**8))
def test_replies_that_are_early_soon_end_all_sleeps(least_ns: int) -> None:
    latency_estimate = np.zeros(2, np.int64)
    for _ in range(13):
        update(latency_estimate, -least_ns, least_ns, 40_000)
    assert latency_estimate[LATE] == -least_ns


@given(st.lists(late_ns, min_size=1, max_size=50), st.integers(-(10**9), 10**9))
def test_one_odd_reply_hardly_changes_the_estimate(before: list[int], odd_ns: int) -> None:
    latency_estimate = np.zeros(2, np.int64)
    for lateness_ns in before:
        update(latency_estimate, lateness_ns, 2_000_000_000, 40_000)
    was_ns = latency_estimate[LATE]
    update(latency_estimate, odd_ns, 2_000_000_000, 40_000)
    assert abs(latency_estimate[LATE] - was_ns) <= 5_000


@pytest.mark.parametrize(
    ("baud", "given_s", "expected_s"),
    [
        (57_600, None, 0.0),
        (1_000_000, None, 0.0),
        (2_000_000, None, 0.0),
        (SPIN_FROM_BAUD, None, SPIN_S),
        (4_000_000, None, SPIN_S),
        (1_000_000, SPIN_S, SPIN_S),
        (4_000_000, 0.0, 0.0),
    ],
)
def test_a_slow_wire_is_not_polled(baud: int, given_s: float | None, expected_s: float) -> None:
    """Polling took half of a read's CPU time to save 10 us."""
    master, slave = os.openpty()
    try:
        port = SerialPort(os.ttyname(slave), baud)
        path = ControlCycle(port, IDS, spin_s=given_s)._fast_path
        assert isinstance(path, SerialFastPath)
        assert path._plan[SPIN_NS] == expected_s * 1e9
        port.closePort()
    finally:
        os.close(master)
        os.close(slave)
