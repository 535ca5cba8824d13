"""The cycle against stalls, silence, late replies and stuffing, on a scripted port."""

import numpy as np
import pytest

from snakewalk.drivers.bus.control_cycle import ControlCycle
from snakewalk.drivers.bus.group_write import GroupWrite
from snakewalk.drivers.bus.pending_replies import PendingReplies
from snakewalk.drivers.protocol.packet import (
    Instruction,
    InstructionPacket,
    StatusPacket,
    encode_status,
)
from snakewalk.drivers.protocol.parser import PacketParser
from tests.drivers.bus.test_group_codec import fast
from tests.helpers.scripted_port import ScriptedPort

IDS = (1, 2, 3, 4)


class Servos:
    """Reply in turn, none behind a silent one, with the request's number in every byte."""

    def __init__(self) -> None:
        self.asked = 0
        self.silent: set[int] = set()
        self.late_s: dict[int, float] = {}
        """Request number -> delay of its reply."""
        self.fill: bytes | None = None
        self.lengths: list[int] = []

    def __call__(self, raw: bytes) -> list[tuple[float, bytes]]:
        (packet,) = PacketParser().feed(raw)
        assert isinstance(packet, InstructionPacket)
        if packet.instruction == Instruction.SYNC_WRITE:
            return []
        self.asked += 1
        length = int.from_bytes(packet.params[2:4], "little")
        self.lengths.append(length)
        data = self.fill or bytes([self.asked & 0x7F])
        block = (data * length)[:length]
        ids = tuple(packet.params[4:])
        responding = ids[: next((k for k, i in enumerate(ids) if i in self.silent), len(ids))]
        delay_s = self.late_s.get(self.asked, 1e-3)
        if packet.instruction == Instruction.FAST_SYNC_READ:
            whole = fast([block] * len(ids), ids=ids)
            return [(delay_s, whole[: 8 + len(responding) * (length + 4)])] if responding else []
        return [
            (delay_s + 2e-4 * k, encode_status(StatusPacket(servo_id, 0, block)))
            for k, servo_id in enumerate(responding)
        ]


@pytest.fixture
def servos() -> Servos:
    return Servos()


def test_a_healthy_cycle_is_one_packet_each_way(servos: Servos) -> None:
    port = ScriptedPort(servos)
    cycle = ControlCycle(port, IDS)
    goals = np.array([1, 2, 3, 4], np.int32)
    cycle.write_goals(goals)
    reply = cycle.read()
    assert port.written[0] == GroupWrite(IDS, 116).encode(goals)
    assert len(port.written) == 2
    assert reply.valid.all()
    assert reply.data.tolist() == [[1] * 10] * 4
    assert (port.drains, cycle.counters.timeouts) == (0, 0)


def test_a_transaction_is_one_write_of_both_packets(servos: Servos) -> None:
    goals = np.array([1, 2, 3, 4], np.int32)
    packet = GroupWrite(IDS, 116).encode(goals)
    port = ScriptedPort(lambda raw: servos(raw.removeprefix(packet)))
    reply = ControlCycle(port, IDS).read(goals)
    assert len(port.written) == 1
    assert port.written[0].startswith(packet)
    assert reply.valid.all()
    assert reply.data.tolist() == [[1] * 10] * 4


@pytest.mark.parametrize("is_fast", [False, True])
@pytest.mark.parametrize("late_s", [0.005, 0.012, 0.05, 0.0501, 0.3])
def test_a_late_reply_is_never_taken_for_a_new_one(
    servos: Servos, is_fast: bool, late_s: float
) -> None:
    port = ScriptedPort(servos)
    cycle = ControlCycle(port, IDS, fast=is_fast)
    servos.late_s = {3: late_s, 4: late_s / 2}
    for _ in range(60):
        reply = cycle.read()
        assert set(reply.data[reply.valid].ravel()) <= {servos.asked & 0x7F}
        port.clock.advance(0.003)
    assert reply.valid.all()
    assert cycle.counters.timeouts >= 1


def test_the_block_has_its_own_length_again_after_clean_reads(servos: Servos) -> None:
    servos.late_s = {2: 0.1}
    port = ScriptedPort(servos)
    cycle = ControlCycle(port, IDS, fast=False)
    for _ in range(40):
        cycle.read()
        port.clock.advance(0.02)
    assert servos.lengths[:4] == [10, 10, 11, 11]
    assert servos.lengths[-1] == 10


@pytest.mark.slow_cases(2, "7 cases of 0.5 s of CPU")
@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("is_fast", [False, True])
@pytest.mark.parametrize("period_s", [0.0, 0.005, 0.02, 0.03])
def test_an_adapter_that_is_late_for_good_never_gives_an_old_value(
    servos: Servos, is_fast: bool, period_s: float
) -> None:
    for lag_s in np.arange(0.0035, 0.4, 0.0073):
        servos = Servos()
        servos.late_s = dict.fromkeys(range(5, 200), float(lag_s))
        port = ScriptedPort(servos)
        cycle = ControlCycle(port, IDS, fast=is_fast)
        for k in range(40):
            port.clock.sleep_until_s(k * period_s)
            reply = cycle.read()
            assert set(reply.data[reply.valid].ravel()) <= {servos.asked & 0x7F}


def test_a_servo_that_comes_back_is_believed_after_one_cycle(servos: Servos) -> None:
    port = ScriptedPort(servos)
    cycle = ControlCycle(port, IDS, fast=False)
    servos.silent = {3}
    for _ in range(40):
        cycle.read()
        port.clock.advance(0.02)
    assert servos.lengths[-1] == 10  # who is silent for long has no say in the length
    servos.silent = set()
    assert cycle.read().valid.tolist() == [True, True, False, True]  # it may be an old reply
    assert cycle.read().valid.all()


def test_two_blocks_of_one_port_do_not_take_each_others_answers() -> None:
    """A late reply to a one-byte block has the length of the next one-byte block's."""
    asked: list[int] = []

    def script(raw: bytes) -> list[tuple[float, bytes]]:
        (packet,) = PacketParser().feed(raw)
        address, length = packet.params[0], packet.params[2]
        asked.append(address)
        late_s = 0.03 if len(asked) == 1 else 1e-3
        return [(late_s, encode_status(StatusPacket(1, 0, bytes([address]) * length)))]

    port = ScriptedPort(script)
    pending = PendingReplies(port.clock)
    first, second = (
        ControlCycle(port, [1], registers=(116, address, 1), fast=False, pending=pending)
        for address in (64, 98)
    )
    assert not first.read().answered.any()
    while port.clock.now_s() < 0.06:
        reply = second.read()
        assert set(reply.data[reply.valid, 0]) <= {98}


@pytest.mark.parametrize("silent", [{1}, {3}, {4}, {1, 3}])
def test_silent_servos_cost_their_own_values_only(servos: Servos, silent: set[int]) -> None:
    servos.silent = silent
    port = ScriptedPort(servos)
    cycle = ControlCycle(port, IDS, fast=True)
    responding = [servo_id not in silent for servo_id in IDS]
    for _ in range(len(silent)):
        cycle.read()
    for _ in range(10):
        assert cycle.read().valid.tolist() == responding
    assert not cycle.fast
    assert cycle.counters.fast_given_up == 1


def test_each_value_is_its_servos_in_any_order(servos: Servos) -> None:
    by_id = {1: b"a" * 12, 2: b"b" * 12, 3: b"c" * 12, 4: b"d" * 12}

    def script(raw: bytes) -> list[tuple[float, bytes]]:
        (packet,) = PacketParser().feed(raw)
        length, ids = packet.params[2], packet.params[4:]
        return [
            (1e-3, encode_status(StatusPacket(i, 0, by_id[i][:length]))) for i in ids if i != lost
        ]

    lost = 2
    cycle = ControlCycle(ScriptedPort(script), IDS, fast=False)
    assert cycle.read().valid.tolist() == [True, False, True, True]
    lost = 0
    reply = cycle.read()
    assert reply.valid.all()
    assert [row.tobytes() for row in reply.data] == [by_id[i][:10] for i in IDS]


def test_now_and_then_a_lost_fast_reply_does_not_end_fast_reads(servos: Servos) -> None:
    port = ScriptedPort(servos)
    cycle = ControlCycle(port, IDS, fast=True)
    servos.late_s = dict.fromkeys(range(3, 200, 3), 1.0)
    for _ in range(60):
        cycle.read()
        port.clock.advance(0.02)
    assert cycle.fast
    assert cycle.counters.timeouts > 5


def test_stuffed_replies_are_waited_for_to_their_end(servos: Servos) -> None:
    servos.fill = b"\xff\xff\xfd"
    port = ScriptedPort(servos)
    cycle = ControlCycle(port, IDS, fast=False)
    reply = cycle.read()
    assert reply.valid.all()
    assert [row.tobytes() for row in reply.data] == [(servos.fill * 4)[:10]] * 4
    assert (port.drains, port.arriving) == (0, [])


def test_a_dead_line_costs_a_bounded_time(servos: Servos) -> None:
    servos.silent = set(IDS)
    port = ScriptedPort(servos)
    cycle = ControlCycle(port, IDS, fast=False, latency_s=0.004)
    assert not cycle.read().answered.any()
    wire_s = (14 + 4 + 4 * 21) * 10 / 1e6
    assert port.clock.now_s() == pytest.approx(wire_s + 2 * 0.004)


@pytest.mark.parametrize("is_fast", [True, False])
@pytest.mark.parametrize("silent_reads", [1, 3, 5, 7])
def test_the_first_reply_after_silent_reads_of_all_servos_is_accepted(
    servos: Servos, silent_reads: int, *, is_fast: bool
) -> None:
    """After three silent plain reads the next request had the length of a pending reply."""
    cycle = ControlCycle(ScriptedPort(servos), IDS, fast=is_fast)
    cycle.read()
    servos.silent = set(IDS)
    for _ in range(silent_reads):
        assert not cycle.read().valid.any()
    servos.silent = set()
    reply = cycle.read()
    assert reply.valid.all()
    assert (reply.data == servos.asked).all()


@pytest.mark.parametrize("silent_reads", [8, 30, 70])
def test_a_long_silence_costs_one_reply_at_most(servos: Servos, silent_reads: int) -> None:
    cycle = ControlCycle(ScriptedPort(servos), IDS, fast=False)
    servos.silent = set(IDS)
    for _ in range(silent_reads):
        assert not cycle.read().valid.any()
    servos.silent = set()
    first, second = cycle.read(), cycle.read()
    assert first.valid.all() or not first.valid.any()
    assert second.valid.all()


def test_noise_in_front_of_a_reply_does_not_cost_it(servos: Servos) -> None:
    port = ScriptedPort(servos)
    cycle = ControlCycle(port, IDS, fast=False)
    replies = servos.__call__
    port.script = lambda raw: [(5e-4, b"\x00\xff\xff\xfd\x00\x01"), *replies(raw)]
    reply = cycle.read()
    assert reply.valid.all()
    assert (cycle.counters.unclean, port.drains) == (1, 1)


def test_a_line_that_never_falls_quiet_holds_no_read_for_long() -> None:
    """A stray byte every 3 ms held one read for as long as the bytes came."""

    def babble(_: bytes) -> list[tuple[float, bytes]]:
        return [(0.003 * k, b"\x55") for k in range(1, 4000)]

    port = ScriptedPort(babble)
    cycle = ControlCycle(port, [1, 2, 3])
    assert not cycle.read().valid.any()
    assert port.clock.now_s() < 0.2
