"""A reply that comes twice: its second copy must not pass for the reply to the next request."""

import numpy as np
import pytest

from snakewalk.drivers.bus.control_cycle import ControlCycle
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.bus.group_read import GroupReadRequest
from snakewalk.drivers.bus.line_reservation import LineReservation
from snakewalk.drivers.protocol.packet import StatusPacket, encode_status
from snakewalk.sim.line.clock import SimClock
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from tests.helpers.scripted_port import ScriptedPort

IDS = (1, 2, 3, 4)
BYTE_S = 1e-5


def twice_on_the_line(latency_s: float) -> tuple[SimLine, DynamixelBus]:
    """Servos whose every packet is followed by a copy of it."""

    line = SimLine(ServoBank(IDS, baud=1_000_000), BenchPlant(len(IDS)), usb_latency_s=latency_s)
    line.tamper = lambda reply: (reply, reply)
    return line, DynamixelBus(line, latency_s=latency_s + 0.001)


@pytest.mark.parametrize("fast", [True, False])
@pytest.mark.parametrize("latency_s", [0.0, 0.001])
def test_no_read_takes_the_copy_of_the_one_before(fast: bool, latency_s: float) -> None:
    line, bus = twice_on_the_line(latency_s)
    cycle = bus.cycle(IDS, fast=fast)
    read = 0
    for k in range(40):
        line.firmware.plant.position_rad[:] = 0.01 * k
        line.settle()
        reply = cycle.read()
        values = reply.data[:, 6:].copy().view("<i4")[:, 0]
        new = line.bank["Present Position"]
        np.testing.assert_array_equal(values[reply.valid], new[reply.valid])
        read += int(reply.valid.sum())
    assert read > 60  # half of them: what is behind a copy is often lost


def test_a_fast_read_finds_its_reply_behind_a_longer_copy() -> None:
    """A check of a register was lost in every cycle in which the state came twice."""
    line, bus = twice_on_the_line(0.001)
    state, check = bus.cycle(IDS), bus.block(IDS, "Profile Velocity", "Profile Velocity")
    line.bank["Profile Velocity"][:] = (5, 6, 7, 8)
    for _ in range(5):
        state.read()
        reply = check.read()
        assert reply.valid.all()
        assert reply.data[:, 0].tolist() == [5, 6, 7, 8]
        line.clock.advance(0.02)


def test_no_register_is_taken_for_another() -> None:
    _, bus = twice_on_the_line(0.001)
    for value in (5, 77, 1023):
        bus.write(1, "Position P Gain", value)
        bus.write(1, "Position I Gain", value + 1)
        assert bus.read(1, "Position P Gain") == value
        assert bus.read(1, "Position I Gain") == value + 1


def test_a_packet_out_of_turn_is_an_old_one() -> None:
    """Servos reply in the order of the request."""

    def status(servo_id: int, fill: bytes) -> bytes:
        return encode_status(StatusPacket(servo_id, 0, fill * 10))

    new = b"".join(status(servo_id, b"n") for servo_id in (1, 2, 3))
    request = GroupReadRequest([1, 2, 3], 126, 10, fast=False)
    reply = request.parse(status(3, b"o") + new)
    assert reply.valid.all()
    assert reply.data.tobytes() == b"n" * 30
    # of two that stand behind each other nobody knows
    assert request.parse(status(2, b"o") + status(1, b"n")).valid.tolist() == [False] * 3


def test_the_second_of_two_fast_replies_is_the_new_one() -> None:
    """Where nothing has its time, as on a pseudo-terminal, there are more bytes than expected."""
    found = []
    for fill in (b"o", b"n"):
        line = SimLine(ServoBank(IDS, baud=1_000_000), BenchPlant(len(IDS)))
        line.firmware.plant.position_rad[:] = 0.5 if fill == b"n" else 0.0
        line.settle()
        request = GroupReadRequest(IDS, 126, 10, fast=True)
        line.write(request.packet)
        found.append(line.read_until(request.reply_bytes, 1.0))
    old, new = found
    assert old != new
    port = ScriptedPort(lambda raw: [(1e-4, old + new)])
    reply = ControlCycle(port, IDS).read()
    assert reply.valid.all()
    assert (
        reply.data.tobytes() == GroupReadRequest(IDS, 126, 10, fast=True).parse(new).data.tobytes()
    )
    noisy = ScriptedPort(lambda raw: [(1e-4, new + b"\x00")])
    cycle = ControlCycle(noisy, IDS)
    assert cycle.read().clean
    assert noisy.drains == 0


def test_a_line_that_is_faster_than_its_baud_rate_is_believed_in_the_end() -> None:
    clock = SimClock()
    line = LineReservation(clock, paced=True)
    request_s, reply_s = 14 * BYTE_S, 92 * BYTE_S
    for _ in range(2):
        free_s = line.reserve(request_s)
        clock.advance(0.5 * (request_s + reply_s))
        assert line.has_second_reply(free_s, request_s, reply_s)
        line.note_copies(answered=False)
        clock.advance(0.01)
    free_s = line.reserve(request_s)
    assert not line.has_second_reply(free_s, request_s, reply_s)
    assert not LineReservation(clock).has_second_reply(free_s, request_s, reply_s)
