"""A chain on two ports: one transaction a port and cycle, and a port that dies stops the body."""

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass

import numpy as np
import pytest

from snakewalk.config.robot import ImuConfig, JointConfig, PortConfig, RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.bus.segmented_bus import SegmentedBus
from snakewalk.drivers.chain.liveness import SLOW_EVERY
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import (
    BudgetError,
    BusError,
    ChainError,
    PortError,
    SafetyTrippedError,
)
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.protocol.packet import BROADCAST_ID, Instruction, InstructionPacket
from snakewalk.drivers.protocol.parser import PacketParser
from snakewalk.drivers.protocol.registers import WATCHDOG_TRIPPED, Alarm
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.recovery import Recovery
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointCommand, JointState
from snakewalk.sim.line.clock import SimClock
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.serve.pty import PtyServer
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from tests.helpers.pty_port import PtyPort, ServedClock

PERIOD_S = 0.02
IDS = ((1, 2, 5), (3, 4, 6))
"""Of the two ports: the joints of a port need not stand together."""
START_RAD = {1: 0.3, 2: -0.2, 3: 0.1, 4: 0.0, 5: -0.3, 6: 0.2}


class Segment(SimLine):
    """Servos of one port, with a name."""

    def __init__(self, name: str, ids: tuple[int, ...], clock: SimClock) -> None:
        start = [START_RAD.get(each, 0.0) for each in ids]
        super().__init__(ServoBank(ids), BenchPlant(len(ids), start_rad=start), clock)
        self._name = name
        self.heard: list[tuple[float, bool, bytes]] = []
        self.taps.append(lambda *packet: self.heard.append(packet))

    @property
    def name(self) -> str:
        return self._name


@dataclass
class Body:
    """A chain on two ports."""

    chain: ServoChain
    ports: tuple[BytePort, ...]
    lines: tuple[SimLine, ...]
    robot: RobotConfig

    def safe(self, recovery: Recovery | None = None) -> SafeLink:
        limits = SafetyLimits.from_config(self.robot, SafetyConfig())
        return SafeLink(self.chain, limits, self.chain.clock, recovery)

    def settle(self) -> None:
        for line in self.lines:
            line.settle()


def a_robot(*names: str, **changes: object) -> RobotConfig:
    ports = tuple(PortConfig(port=n, ids=ids) for n, ids in zip(names, IDS, strict=True))
    return RobotConfig(name="six", joint_axes="ypypyp", ports=ports, **changes)


def a_body(ports: tuple[BytePort, ...], lines: tuple[SimLine, ...]) -> Body:
    robot = a_robot(*(port.name for port in ports))
    parts = [(DynamixelBus(p), ids) for p, ids in zip(ports, IDS, strict=True)]
    return Body(ServoChain(SegmentedBus(parts), robot, rate_hz=50.0), ports, lines, robot)


def in_process() -> Body:
    clock = SimClock()
    lines = tuple(Segment(name, ids, clock) for name, ids in zip("AB", IDS, strict=True))
    return a_body(lines, lines)


@pytest.fixture
def segments() -> Body:
    return in_process()


@pytest.fixture(params=["in process", "two ptys"])
def body(request: pytest.FixtureRequest) -> Iterator[Body]:
    if request.param == "in process":
        yield in_process()
        return
    clock = ServedClock()
    lines = tuple(Segment(name, ids, SimClock()) for name, ids in zip("AB", IDS, strict=True))
    with ExitStack() as opened:
        servers = [opened.enter_context(PtyServer(line, clock)) for line in lines]
        ports = [opened.enter_context(PtyPort(each, 1_000_000, clock)) for each in servers]
        yield a_body(tuple(ports), lines)


def cycles(body: Body, link: ServoChain | SafeLink, count: int, by_rad: float = 0.0) -> JointState:
    """Hold the pose, or move away from it by so much, evenly."""
    clock = body.chain.clock
    state = link.read()
    start_rad, start_s = state.position_rad, clock.now_s()
    for k in range(count):
        link.write(JointCommand(clock.now_s(), start_rad + by_rad * (k + 1) / count))
        state = link.read()
        clock.sleep_until_s(start_s + (k + 1) * PERIOD_S)
    return state


def test_every_joint_is_read_and_moved_where_it_is(body: Body) -> None:
    found = body.chain.enable()
    start_rad = [START_RAD[each] for each in body.robot.servo_ids]
    assert found.position_rad == pytest.approx(start_rad, abs=0.01)
    state = cycles(body, body.chain, 20, by_rad=0.1)
    assert state.valid.all()
    assert state.position_rad == pytest.approx(np.array(start_rad) + 0.1, abs=0.05)
    assert state.age_s.max() < PERIOD_S
    body.chain.disable()
    body.settle()
    for line in body.lines:
        assert not line.firmware.drive.torque_on.any()
        assert not line.bank["Bus Watchdog"].any()


def test_a_port_carries_bytes_of_its_own_servos_only(segments: Body) -> None:
    segments.chain.enable()
    cycles(segments, segments.chain, 40)
    segments.chain.disable()
    group = (Instruction.SYNC_READ, Instruction.FAST_SYNC_READ, Instruction.SYNC_WRITE)
    for line, ids in zip(segments.lines, IDS, strict=True):
        named = set()
        for _, sent, data in line.heard:
            for packet in PacketParser().feed(data) if sent else ():
                assert isinstance(packet, InstructionPacket)
                if packet.servo_id != BROADCAST_ID:
                    named.add(packet.servo_id)
                    continue
                assert packet.instruction in group
                size = int.from_bytes(packet.params[2:4], "little")
                writes = packet.instruction == Instruction.SYNC_WRITE
                named |= set(packet.params[4 :: size + 1 if writes else 1])
        assert named == set(ids)


def test_requests_are_on_all_wires_before_a_reply_is_awaited(segments: Body) -> None:
    """A cycle then takes as long as the longest segment's, not as long as all together."""
    segments.chain.enable()
    while segments.chain._reads % SLOW_EVERY != 4:  # a cycle in which nothing else is read
        cycles(segments, segments.chain, 0)
    for line in segments.lines:
        line.heard.clear()
    before_s = segments.chain.clock.now_s()
    segments.chain.read()
    asked, answered = (
        [next(t for t, sent, _ in line.heard if sent is way) for line in segments.lines]
        for way in (True, False)
    )
    assert max(asked) < min(answered)
    wire_s = max(answered) - before_s
    assert segments.chain.clock.now_s() - before_s == pytest.approx(wire_s, abs=1e-6)


def test_a_port_that_dies_stops_the_whole_body(body: Body) -> None:
    lost, there = body.lines[1], body.lines[0]
    name = body.ports[1].name
    with body.safe() as link:
        link.enable()
        cycles(body, link, 5)
        lost.disconnect()
        if body.ports[1] is not lost:
            body.chain.clock.sleep_until_s(body.chain.clock.now_s() + PERIOD_S)
        with pytest.raises(SafetyTrippedError, match=f"^{name}: the port"):
            cycles(body, link, 5)
        assert "on the other ports torque is off" in str(link.tripped)
        there.settle()
        assert not there.firmware.drive.torque_on.any()
        assert not there.bank["Bus Watchdog"].any()
        lost.settle()
        assert (lost.bank["Bus Watchdog"] == WATCHDOG_TRIPPED).all()
        with pytest.raises(SafetyTrippedError):
            link.write(JointCommand(body.chain.clock.now_s(), np.zeros(6)))
        if body.ports[1] is lost:
            lost.reconnect()  # so that torque off gets through at the end
        else:
            link.disable = lambda: None  # type: ignore[method-assign]  its pty has another name


def test_the_living_port_is_off_before_the_dead_one_is_waited_for(segments: Body) -> None:
    segments.chain.enable()
    segments.lines[0].disconnect()
    begun_s = segments.chain.clock.now_s()
    with pytest.raises(PortError, match=r"^A: .*on the other ports torque is off"):
        segments.chain.disable()
    (off_s,) = (
        t
        for t, sent, data in segments.lines[1].heard
        if sent and t > begun_s and data[7] == Instruction.SYNC_WRITE and data[8] == 64
    )
    assert off_s - begun_s < 1e-3
    assert segments.chain.clock.now_s() - begun_s > 1.0


def test_the_replies_of_the_living_port_do_not_meet_the_next_request(segments: Body) -> None:
    segments.chain.enable()
    cycles(segments, segments.chain, 3)
    cycle = SegmentedBus(
        [(DynamixelBus(line), ids) for line, ids in zip(segments.lines, IDS, strict=True)]
    ).cycle(segments.robot.servo_ids)
    cycle.read()
    segments.lines[1].disconnect()
    with pytest.raises(PortError, match=r"^B: "):
        cycle.read()
    segments.lines[1].reconnect()
    segments.ports[1].openPort()
    assert cycle.read().whole
    assert cycle.counters.unclean == cycle.counters.timeouts == 0


def test_a_silent_servo_is_told_with_its_port(segments: Body) -> None:
    with segments.safe() as link:
        link.enable()
        cycles(segments, link, 3)
        segments.lines[1].directory.mute[1] = True
        segments.lines[1].refresh_ids()
        with pytest.raises(
            SafetyTrippedError, match=r"^joint pitch_04 \(ID 4 on B\): not read for 0\.1"
        ):
            cycles(segments, link, 20)
        segments.settle()
        assert not any(line.firmware.drive.torque_on.any() for line in segments.lines)
        segments.lines[1].directory.mute[:] = False
        segments.lines[1].refresh_ids()


def test_a_servo_that_is_missing_at_the_start_is_told_with_its_port(segments: Body) -> None:
    segments.lines[0].rename(1, 77)
    segments.lines[0].refresh_ids()
    with pytest.raises(ChainError, match=r"^A: no answer from servo 2 of 1, 2, 5 at 1000000"):
        segments.chain.enable()


def test_a_fault_of_one_register_is_told_with_its_port(segments: Body) -> None:
    bus = SegmentedBus(
        [(DynamixelBus(line), i) for line, i in zip(segments.lines, IDS, strict=True)]
    )
    segments.lines[1].directory.mute[:] = True
    segments.lines[1].refresh_ids()
    with pytest.raises(BusError, match=r"^B: servo 3: read Goal PWM: no answer"):
        bus.read(3, "Goal PWM")
    with pytest.raises(BusError, match=r"^B: servo 3: read Goal PWM to Goal Current: no answer"):
        bus.read_each(3, ["Goal Current", "Goal PWM"])


def test_fast_reads_are_given_up_on_the_port_that_fails(segments: Body) -> None:
    told: list[str] = []
    segments.chain.on_event = told.append
    segments.chain.enable()
    told.clear()

    def damaged(data: bytes) -> list[bytes]:
        return [data[:-1] + bytes([data[-1] ^ 1])] if data[4] == BROADCAST_ID else [data]

    segments.lines[1].tamper = damaged
    state = cycles(segments, segments.chain, 8)
    assert state.valid.all()
    assert [line.split(":")[0] for line in told] == ["B"]


def test_an_interrupted_port_is_recovered_from(segments: Body) -> None:
    events: list[str] = []
    recovery = Recovery(segments.chain, policy="resume", on_event=events.append)
    lost, clock = segments.lines[1], segments.chain.clock
    with segments.safe(recovery) as link:
        link.enable()
        cycles(segments, link, 5)
        lost.disconnect()
        give_back_s = clock.now_s() + 0.5
        sleep_until_s = clock.sleep_until_s

        def sleep(time_s: float) -> None:
            sleep_until_s(time_s)
            if clock.now_s() >= give_back_s:
                lost.reconnect()

        clock.sleep_until_s = sleep  # type: ignore[method-assign]
        state = cycles(segments, link, 10, by_rad=0.1)
        assert state.valid.all()
        assert link.tripped is None
        assert link.recoveries == 1
    assert any(line.startswith("interrupted: B: ") for line in events)


def test_an_overloaded_servo_is_rebooted_on_its_own_port(segments: Body) -> None:
    recovery = Recovery(segments.chain, overload_reboots=1)
    with segments.safe(recovery) as link:
        link.enable()
        cycles(segments, link, 5)
        firmware = segments.lines[1].firmware
        firmware.protection.detect(np.array([1]), Alarm.OVERLOAD)
        firmware.apply_registers()
        state = cycles(segments, link, 10)
        assert state.valid.all()
        assert link.recoveries == 1
        assert all(line.bank["Torque Enable"].all() for line in segments.lines)


def test_the_wire_counts_port_by_port() -> None:
    robot = a_robot("A", "B", joints=tuple(JointConfig(id=k) for k in range(1, 7)))
    lines = in_process().lines
    parts = [(DynamixelBus(line), ids) for line, ids in zip(lines, IDS, strict=True)]
    # three servos take 1.42 ms with the slow state, six on one wire 2.09 ms
    for rate_hz, fits in ((1 / 1.5e-3, True), (1 / 1.4e-3, False)):
        chain = ServoChain(SegmentedBus(parts), robot, rate_hz=rate_hz)
        if fits:
            chain.enable()
            continue
        with pytest.raises(BudgetError, match="3 servos at 1000000 baud"):
            chain.enable()


def test_an_imu_is_read_on_its_own_port() -> None:
    with_imu = ImuConfig(model="imu_to_dxl", id=200)
    ports = tuple(PortConfig(port=n, ids=ids) for n, ids in (("A", IDS[0]), ("B", (*IDS[1], 200))))
    robot = RobotConfig(name="six", joint_axes="ypypyp", imu=with_imu, ports=ports)
    body = in_process()
    parts = [(DynamixelBus(line), port.ids) for line, port in zip(body.lines, ports, strict=True)]
    with pytest.raises(ChainError, match=r"imu \(ID 200\): no reply"):
        ServoChain(SegmentedBus(parts), robot).enable()
    assert not any(b"\xfd\x00\xc8" in data for _, sent, data in body.lines[0].heard if sent)
    assert any(b"\xfd\x00\xc8" in data for _, sent, data in body.lines[1].heard if sent)


def test_ports_of_one_chain_share_a_clock() -> None:
    body = in_process()
    other = Segment("C", (7,), SimClock())
    with pytest.raises(ValueError, match="share one clock"):
        SegmentedBus([(DynamixelBus(body.lines[0]), IDS[0]), (DynamixelBus(other), (7,))])
    with pytest.raises(ValueError, match="on one port"):
        SegmentedBus([(DynamixelBus(line), IDS[0]) for line in body.lines])
