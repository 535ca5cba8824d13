"""Start-up order, faults at start, held values and the slow round of the chain."""

import re
from itertools import permutations

import numpy as np
import pytest

from snakewalk.config.faults import FaultPlan
from snakewalk.config.robot import RobotConfig, ServoConfig
from snakewalk.drivers.bus.budget import chain_budget
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.bus.group_read import GroupReadReply
from snakewalk.drivers.chain.liveness import SLOW_EVERY
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.chain.start_up import IDENTITY, inspect
from snakewalk.drivers.errors import BudgetError, BusError, ChainError, PortError
from snakewalk.drivers.protocol.control_table import load_control_table
from snakewalk.drivers.protocol.packet import (
    ALERT,
    Instruction,
    InstructionPacket,
    StatusPacket,
    encode_status,
)
from snakewalk.drivers.protocol.parser import PacketParser
from snakewalk.drivers.protocol.registers import Alarm
from snakewalk.drivers.types import JointCommand
from snakewalk.sim.faults.fault_player import FaultPlayer
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

ROBOT = RobotConfig(
    name="four",
    joint_axes="ypyp",
    servo=ServoConfig(position_p_gain=800, pitch_p_gain=640, pitch_current_limit_a=0.6),
)
STEP_RAD = 2 * np.pi / 4096
START = [0.3, -0.2, 0.1, 0.0]


class Recorder(SimLine):
    """A simulated line that keeps the instructions it hears."""

    def __init__(self, bank: ServoBank, start_rad: list[float]) -> None:
        super().__init__(bank, BenchPlant(len(bank), start_rad=start_rad))
        self.heard: list[InstructionPacket] = []

    def write(self, data: bytes) -> None:
        self.heard.extend(PacketParser().feed(data))  # type: ignore[arg-type]
        super().write(data)

    def writes(self) -> list[tuple[int, int, bytes]]:
        """(address, servo, data) of all writes, group ones taken apart, in order."""
        found = []
        for packet in self.heard:
            params = packet.params
            address = int.from_bytes(params[:2], "little")
            if packet.instruction == Instruction.WRITE:
                found.append((address, packet.servo_id, params[2:]))
            elif packet.instruction == Instruction.SYNC_WRITE:
                size = int.from_bytes(params[2:4], "little") + 1
                entries = (params[k : k + size] for k in range(4, len(params), size))
                found += [(address, entry[0], entry[1:]) for entry in entries]
        return found


@pytest.fixture
def line() -> Recorder:
    return Recorder(ServoBank(ROBOT.servo_ids), START)


@pytest.fixture
def chain(line: Recorder) -> ServoChain:
    return ServoChain(DynamixelBus(line), ROBOT)


def at(line: Recorder, address: int, servo_id: int) -> list[int]:
    return [k for k, (a, s, _) in enumerate(line.writes()) if (a, s) == (address, servo_id)]


def test_start_up_keeps_its_order_for_every_servo(line: Recorder, chain: ServoChain) -> None:
    chain.enable()
    writes = line.writes()
    for servo_id in ROBOT.servo_ids:
        torque_on = [k for k in at(line, 64, servo_id) if writes[k][2] == b"\x01"]
        assert len(torque_on) == 1
        (goal,) = at(line, 116, servo_id)
        armed = [k for k in at(line, 98, servo_id) if writes[k][2] != b"\x00"]
        settings = [k for a in (9, 11, 48, 52, 84) for k in at(line, a, servo_id)]
        assert settings
        assert max(settings) < goal < min(armed) < torque_on[0]


def test_goal_is_the_present_pose_when_torque_comes_on(line: Recorder, chain: ServoChain) -> None:
    state = chain.enable()
    assert state.position_rad == pytest.approx(START, abs=STEP_RAD)
    goals = (line.bank["Goal Position"] - 2048) * STEP_RAD
    assert goals == pytest.approx(state.position_rad, abs=STEP_RAD)
    line.clock.advance(0.1)
    assert chain.read().position_rad == pytest.approx(START, abs=3 * STEP_RAD)


def test_what_the_servos_are_set_to(line: Recorder, chain: ServoChain) -> None:
    chain.enable()
    bank = line.bank
    assert bank["Operating Mode"].tolist() == [3, 5, 3, 5]
    assert bank["Return Delay Time"].tolist() == [0] * 4
    assert bank["Position P Gain"].tolist() == [800, 640, 800, 640]
    assert bank["Goal Current"][[1, 3]].tolist() == [round(0.6 / 2.69e-3)] * 2
    half = np.floor(np.array(ROBOT.limit_rad) / STEP_RAD)
    assert (2048 - bank["Min Position Limit"]).tolist() == half.tolist()
    assert (bank["Max Position Limit"] - 2048).tolist() == half.tolist()
    assert bank["Bus Watchdog"].tolist() == [10] * 4
    assert bank["Torque Enable"].tolist() == [1] * 4


def test_a_start_takes_three_packets_a_servo_and_thirteen_for_all(line: Recorder) -> None:
    """A ping and two reads; each took up to 36 ms on an adapter that holds replies back."""
    for_all = 13
    chain = ServoChain(DynamixelBus(line), ROBOT)
    chain.enable()
    settings = [address for address, _, _ in line.writes() if address not in (64, 68, 98, 116)]
    joints, modes = ROBOT.joint_count, 2
    # each setting that differs is a packet, and after them, and after a new mode, all are read
    assert len(line.heard) <= for_all + 4 * joints + modes + len(settings)
    chain.disable()
    line.heard.clear()
    chain.enable()
    assert len(line.heard) <= for_all + 3 * joints
    here_rad = chain.read().position_rad
    line.heard.clear()
    assert not chain.recheck(here_rad).faults
    assert len(line.heard) == 2 * joints


def test_a_servo_that_refuses_what_lies_between_registers_starts_all_the_same(
    line: Recorder, chain: ServoChain, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The e-manual has an access error for undefined addresses; firmware 44 has none at 60."""
    usual = Recorder(ServoBank(ROBOT.servo_ids), START)
    ServoChain(DynamixelBus(usual), ROBOT).enable()
    table = load_control_table("XM430-W350")
    state_and_slow = {(126, 10), (144, 3)}
    alone = {(r.address, r.size) for r in map(table.register, table) if r.address != 60}
    monkeypatch.setattr(
        line.bank, "readable", lambda rows, at, size: (at, size) in alone | state_and_slow
    )
    chain.enable()
    assert line.writes() == usual.writes()
    assert not chain.recheck(chain.read().position_rad).faults


def test_torque_that_the_packet_to_all_does_not_switch_off_is_switched_off_alone(
    line: Recorder, chain: ServoChain, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its watchdog is cleared after that: with torque on, an old goal would count."""
    line.bank["Torque Enable"][:] = 1
    line.bank["Bus Watchdog"][:] = 255
    line.bank["Goal PWM"][2] = 100
    sync_write = DynamixelBus.sync_write

    def lame(self: DynamixelBus, ids: tuple[int, ...], name: str, value: int) -> None:
        few = ids[:2] if (name, value) == ("Torque Enable", 0) else ids
        sync_write(self, few, name, value)

    monkeypatch.setattr(DynamixelBus, "sync_write", lame)
    chain.enable()
    off, clear = at(line, 64, 3)[0], at(line, 98, 3)[0]
    assert line.writes()[off][2] == b"\x00"
    assert off < clear < at(line, 100, 3)[0]


def test_a_setting_that_a_servo_takes_and_does_not_keep_is_told(
    line: Recorder, chain: ServoChain, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = DynamixelBus.write

    def forgetful(self: DynamixelBus, servo_id: int, name: str, value: int) -> None:
        write(self, servo_id, name, value + (name == "Profile Velocity"))

    line.bank["Profile Velocity"][0] = 30
    monkeypatch.setattr(DynamixelBus, "write", forgetful)
    what = r"joint yaw_01 \(ID 1\): Profile Velocity: wrote 0, reads back 1"
    with pytest.raises(BusError, match=what):
        chain.enable()
    assert line.bank["Torque Enable"].tolist() == [0] * 4


def test_who_is_missing_in_the_reply_of_all_is_asked_alone(
    line: Recorder, chain: ServoChain
) -> None:
    """Replies to the group reads of the start are cut short behind the first servo's."""

    def cut(data: bytes) -> list[bytes]:
        group = line.heard[-1]
        asked = group.instruction == Instruction.SYNC_READ and data[4] > 1
        return [] if asked and group.params[0] in (64, 76, 98) else [data]

    line.tamper = cut
    chain.enable()
    assert line.bank["Torque Enable"].tolist() == [1] * 4
    assert {p.params[0] for p in line.heard if p.instruction == Instruction.READ} >= {64, 76, 98}


def test_a_slow_line_has_time_to_carry_what_was_written_before_a_read() -> None:
    """The time of a group read began while the goals before it were still on the line."""
    robot = RobotConfig(name="sixteen", joint_axes="y" * 16)
    line = Recorder(ServoBank(robot.servo_ids, baud=57_600), [0.0] * 16)
    line.setBaudRate(57_600)
    chain = ServoChain(DynamixelBus(line), robot)
    chain.enable()
    chain.disable()
    alone = [
        (packet.servo_id, int.from_bytes(packet.params[:2], "little"))
        for packet in line.heard
        if packet.instruction == Instruction.READ
    ]
    assert not [read for read in alone if read[1] in (64, 98, 116)]


def test_all_faults_of_a_chain_at_once(line: Recorder, chain: ServoChain) -> None:
    line.bank["ID"][1] = 77
    line.bank["Model Number"][2] = 1030
    line.bank["Hardware Error Status"][3] = 0b100100
    line.setBaudRate(line.getBaudRate())  # looks the ids up again
    with pytest.raises(ChainError) as info:
        chain.enable()
    text = "\n".join(info.value.faults)
    assert "no answer from servo 2 of 1 to 4 at 1000000 baud" in text
    assert "joint yaw_03 (ID 3): is a XM430-W210, not a XM430-W350" in text
    assert "joint pitch_04 (ID 4): alarm: overheating, overload" in text
    assert line.bank["Torque Enable"].tolist() == [0] * 4


def test_a_pose_beyond_the_limits_is_refused() -> None:
    line = Recorder(ServoBank(ROBOT.servo_ids), [0.0, 0.0, 1.9, 0.0])
    with pytest.raises(ChainError, match=r"joint yaw_03 \(ID 3\): stands at 1\.9"):
        ServoChain(DynamixelBus(line), ROBOT).enable()
    assert line.bank["Torque Enable"].tolist() == [0] * 4


def test_a_current_beyond_the_servos_limit_is_refused() -> None:
    robot = RobotConfig.model_validate(
        {"name": "x", "joint_axes": "yp", "servo": {"pitch_current_limit_a": 3.0}}
    )
    line = Recorder(ServoBank([1, 2]), [0.0, 0.0])
    line.bank["Current Limit"][:] = 743
    with pytest.raises(ChainError, match=r"pitch_current_limit_a = 3: .* 2(\.00)? A"):
        ServoChain(DynamixelBus(line), robot).enable()


def test_old_firmware_gets_plain_reads(line: Recorder, chain: ServoChain) -> None:
    line.bank["Firmware Version"][2] = 44
    chain.enable()
    line.heard.clear()
    assert chain.read().valid.all()
    assert not chain.fast
    assert {p.instruction for p in line.heard} == {Instruction.SYNC_READ}


def test_a_servo_that_stops_answering_keeps_its_value_and_ages(
    line: Recorder, chain: ServoChain
) -> None:
    chain.enable()
    before = chain.read()
    line.bank["ID"][2] = 99
    line.setBaudRate(line.getBaudRate())
    for _ in range(5):
        line.clock.advance(0.02)
        chain.write(JointCommand(line.clock.now_s(), np.full(4, 0.25)))
        state = chain.read()
    assert state.valid.tolist() == [True, True, False, True]
    assert state.position_rad[2] == before.position_rad[2]
    assert state.age_s[2] > 0.1 > state.age_s[[0, 1, 3]].max()
    assert state.position_rad[0] != before.position_rad[0]


def test_an_alarm_is_read_at_once(line: Recorder, chain: ServoChain) -> None:
    chain.enable()
    assert chain.read().hardware_error.tolist() == [0] * 4
    line.bank["Hardware Error Status"][1] = 0x20
    state = chain.read()
    assert state.error[1] & 0x80
    assert state.hardware_error.tolist() == [0, 0x20, 0, 0]


def alert_without_alarm(line: Recorder, packets: int) -> None:
    """Set the alert bit in the next status packets of servo 2, though register 70 is 0."""
    remaining = [None] * packets

    def tamper(data: bytes) -> list[bytes]:
        if data[4] != 2 or len(data) < 20 or not remaining:  # replies to the group read
            return [data]
        remaining.pop()
        status = StatusPacket(2, ALERT, data[9:-2])
        return [encode_status(status)]

    line.tamper = tamper


@pytest.mark.parametrize("packets", [1, 2])
def test_an_alert_without_an_alarm_is_reported_and_read_again(line: Recorder, packets: int) -> None:
    """One such packet ended the run with "alarm" and no name."""
    chain = ServoChain(DynamixelBus(line), ROBOT)
    events: list[str] = []
    chain.on_event = events.append
    chain.enable()
    chain._prepare_reads(fast=False)
    events.clear()
    alert_without_alarm(line, packets)
    for _ in range(packets + 2):
        line.clock.advance(0.01)
        state = chain.read()
        assert state.valid.all()
        assert not state.error.any()
    assert len(events) == 1
    assert "joint pitch_02 (ID 2)" in events[0]
    assert "Hardware Error Status reads 0" in events[0]


def test_an_alert_that_comes_and_goes_is_reported_twice(line: Recorder) -> None:
    """A bit that was set in every second packet gave 50 lines a minute of one joint."""
    chain = ServoChain(DynamixelBus(line), ROBOT)
    events: list[str] = []
    chain.on_event = events.append
    chain.enable()
    chain._prepare_reads(fast=False)
    events.clear()
    for _ in range(30):
        alert_without_alarm(line, 1)
        for _ in range(2):
            line.clock.advance(0.01)
            chain.read()
    assert len(events) == 2
    assert "has come and gone 10 times without an alarm" in events[1]


def test_an_alert_that_stays_counts_though_there_is_no_alarm(line: Recorder) -> None:
    chain = ServoChain(DynamixelBus(line), ROBOT)
    chain.enable()
    chain._prepare_reads(fast=False)
    alert_without_alarm(line, 10)
    errors = []
    for _ in range(4):
        line.clock.advance(0.01)
        errors.append(int(chain.read().error[1]))
    assert errors == [0, 0, ALERT, ALERT]


def test_the_slow_round_comes_every_sixteenth_read(line: Recorder, chain: ServoChain) -> None:
    chain.enable()
    line.heard.clear()
    for _ in range(64):
        state = chain.read()
        line.clock.advance(0.01)
        chain.write(JointCommand(line.clock.now_s(), np.zeros(4)))
    slow = [p for p in line.heard if p.params[:2] == (144).to_bytes(2, "little")]
    assert len(slow) == 4
    assert state.voltage_v == pytest.approx(np.full(4, 12.0), abs=0.11)
    assert np.isfinite(state.temperature_c).all()


@pytest.mark.parametrize("lost", [1, 2])
def test_a_check_whose_reply_is_lost_is_made_again_in_the_next_cycle_with_time(
    chain: ServoChain, line: Recorder, lost: int
) -> None:
    """It was made again in its next turn, 48 cycles later."""
    chain.enable()
    while chain._reads % SLOW_EVERY != 3:  # the turn of the first register that shapes the motion
        chain.read()
    assert chain._liveness is not None
    check = chain._liveness._turns[3][0][0]
    line.bank[check.name][1] = 77
    read, remaining = check.cycle.read, [None] * lost

    def lose() -> GroupReadReply:
        reply = read()
        if not remaining:
            return reply
        remaining.pop()
        return reply._replace(valid=np.zeros(4, np.bool_), flawless=False)

    check.cycle.read = lose  # type: ignore[method-assign]
    for _ in range(lost):
        chain.read()
    if lost == 2:
        chain.read()  # the turns of two other registers
        chain.read()
    with pytest.raises(BusError, match="Position I Gain is 77, was"):
        chain.read()


def test_what_was_read_in_a_cycle_counts_though_a_second_read_in_it_fails(
    chain: ServoChain, line: Recorder
) -> None:
    """An alarm is read for at once; a servo that was silent then had a new value, not valid."""
    chain.enable()
    while chain._reads % SLOW_EVERY != SLOW_EVERY // 3:
        chain.read()
    line.firmware.plant.position_rad[:] += 0.05
    line.clock.advance(0.02)
    read, once = chain._cycle.read, [True]

    def read_then_trouble() -> GroupReadReply:
        reply = read()
        if once:
            once.clear()
            line.firmware.protection.detect(np.array([0]), Alarm.ELECTRICAL_SHOCK)
            line.firmware.apply_registers()
            line.mute(np.array([3]), True)
            line.refresh_ids()
        return reply

    chain._cycle.read = read_then_trouble  # type: ignore[method-assign]
    state = chain.read()
    assert state.hardware_error[0]
    assert state.valid.all()
    assert state.position_rad[3] > START[3] + 0.02
    assert state.age_s[3] > state.age_s[1]


def test_states_are_snapshots(chain: ServoChain, line: Recorder) -> None:
    first = chain.enable()
    kept = first.position_rad.copy()
    for _ in range(10):
        chain.write(JointCommand(line.clock.now_s(), np.full(4, 0.5)))
        line.clock.advance(0.02)
        chain.read()
    assert (first.position_rad == kept).all()
    with pytest.raises(ValueError, match="read-only"):
        first.position_rad[0] = 1.0


def test_goals_are_kept_inside_the_joint_limits(chain: ServoChain, line: Recorder) -> None:
    chain.enable()
    chain.write(JointCommand(line.clock.now_s(), np.array([9.0, -9.0, 9.0, -9.0])))
    chain.read()
    goals = (line.bank["Goal Position"] - 2048) * STEP_RAD
    assert goals == pytest.approx([1.5, -1.2, 1.5, -1.2], abs=STEP_RAD)


def test_a_pause_longer_than_the_watchdog_is_noticed(chain: ServoChain, line: Recorder) -> None:
    chain.enable()
    line.clock.advance(0.3)
    with pytest.raises(BusError, match=r"bus watchdog \(0\.2 s\) has stopped the servos"):
        chain.write(JointCommand(line.clock.now_s(), np.zeros(4)))


def goals_on_the_line(line: Recorder) -> list[int]:
    """Of the newest packet of goals, by servo."""
    (*_, packet) = [
        p
        for p in line.heard
        if p.instruction == Instruction.SYNC_WRITE and p.params[:4] == b"\x74\x00\x04\x00"
    ]
    block = np.frombuffer(packet.params, np.uint8, offset=4).reshape(-1, 5)
    return block[:, 1:].copy().view("<i4")[:, 0].tolist()  # type: ignore[no-any-return]


@pytest.mark.parametrize("stranger", [True, False])
def test_a_hold_gives_no_joint_the_place_of_another_servo_with_its_id(
    chain: ServoChain, line: Recorder, stranger: bool
) -> None:
    """A reading within 0.3 rad of the last one was believed, and a joint sent there at once."""
    chain.enable()
    before = goals_on_the_line(line)
    line.firmware.plant.position_rad[:] += 0.1
    if stranger:
        line.rename(0, 2)
        line.mute(np.array([1]), True)
        line.refresh_ids()
    chain.read()
    chain.hold()
    after = goals_on_the_line(line)
    kept = [0, 1] if stranger else []
    moved = [now != then for now, then in zip(after, before, strict=True)]
    assert moved == [joint not in kept for joint in range(4)]


def test_a_joint_whose_servo_tells_another_joint_is_not_gone_on_with(
    chain: ServoChain, line: Recorder
) -> None:
    state = chain.enable()
    found = chain.recheck(state.position_rad)
    line.bank[IDENTITY][2] = 1  # what a servo tells that had another ID when it was set up
    with pytest.raises(
        ChainError, match=r"joint yaw_03 \(ID 3\): its servo.s reply does not identify it"
    ):
        chain.resume(found)
    assert line.bank["Torque Enable"].tolist() == [0] * 4


@pytest.mark.parametrize("exchange", [True, False])
def test_torque_does_not_come_on_where_ids_were_exchanged_or_joints_moved_behind_the_goals(
    chain: ServoChain, line: Recorder, exchange: bool
) -> None:
    """It came on for 5 ms, in which each began to move to the other's place."""
    send_goals = chain._send_goals

    def send_and_disturb(goal_rad: np.ndarray) -> np.ndarray:
        goals = send_goals(goal_rad)
        line.drain_until_quiet(1e-3)
        if exchange:
            line.rename(0, 2)
            line.rename(1, 1)
            line.refresh_ids()
        else:
            line.firmware.plant.position_rad[0] += 0.3
        return goals

    chain._send_goals = send_and_disturb  # type: ignore[method-assign]
    with pytest.raises(
        ChainError, match=r"joint yaw_01 \(ID 1\): (its servo.s reply does not|read \+0.30)"
    ):
        chain.enable()
    assert (64, b"\x01") not in [(address, data) for address, _, data in line.writes()]
    assert line.bank["Torque Enable"].tolist() == [0] * 4


def test_a_joint_that_is_read_elsewhere_than_it_was_set_to_hold_is_not_gone_on_with(
    chain: ServoChain, line: Recorder
) -> None:
    """The first goals of what comes next would begin there."""
    found = chain.recheck(chain.enable().position_rad)
    read, calls = chain._cycle.read, []

    def read_another() -> GroupReadReply:
        reply = read()
        calls.append(reply)
        if len(calls) < 2:  # the first state; the second is read when all hold
            return reply
        data = reply.data.copy()
        data[1, 6:] = np.frombuffer((2048).to_bytes(4, "little"), np.uint8)
        return reply._replace(data=data)

    chain._cycle.read = read_another  # type: ignore[method-assign]
    with pytest.raises(
        ChainError, match=r"joint pitch_02 \(ID 2\): read \+0.20 rad from its position just before"
    ):
        chain.resume(found)
    assert line.bank["Torque Enable"].tolist() == [0] * 4


def test_disable_any_time_and_twice(chain: ServoChain, line: Recorder) -> None:
    chain.disable()
    chain.enable()
    chain.disable()
    chain.disable()
    assert line.bank["Torque Enable"].tolist() == [0] * 4
    assert line.bank["Bus Watchdog"].tolist() == [0] * 4
    line.clock.advance(1.0)
    assert chain.enable().valid.all()


def test_disable_reaches_the_others_when_one_is_gone(chain: ServoChain, line: Recorder) -> None:
    chain.enable()
    line.bank["ID"][0] = 99
    line.setBaudRate(line.getBaudRate())
    with pytest.raises(BusError, match=r"joint yaw_01 \(ID 1\): torque off is not confirmed"):
        chain.disable()
    assert line.bank["Torque Enable"][1:].tolist() == [0] * 3


def test_torque_goes_off_again_when_the_start_fails_half_way(
    chain: ServoChain, line: Recorder, monkeypatch: pytest.MonkeyPatch
) -> None:
    sync_write = DynamixelBus.sync_write

    def lame(self: DynamixelBus, ids: tuple[int, ...], name: str, value: int) -> None:
        few = ids[:2] if (name, value) == ("Torque Enable", 1) else ids
        sync_write(self, few, name, value)

    monkeypatch.setattr(DynamixelBus, "sync_write", lame)
    with pytest.raises(BusError, match=r"joint yaw_03 \(ID 3\): Torque Enable is 0 after 1"):
        chain.enable()
    assert line.bank["Torque Enable"].tolist() == [0] * 4


def test_inspection_changes_nothing(line: Recorder) -> None:
    report = inspect(DynamixelBus(line), ROBOT)
    assert report.faults == ()
    assert [servo.servo_id for servo in report.servos] == [1, 2, 3, 4]
    assert report.servos[0].return_delay_s == pytest.approx(500e-6)
    assert line.writes() == []


class DamagedFastReads(Recorder):
    """The last byte of every reply to a fast sync read is wrong."""

    damaged = False

    def read_until(self, count: int, deadline_s: float) -> bytes:
        data = super().read_until(count, deadline_s)
        if self.damaged and data and self.heard[-1].instruction == Instruction.FAST_SYNC_READ:
            return data[:-1] + bytes([data[-1] ^ 1])
        return data


def test_old_firmware_at_a_rate_that_plain_reads_cannot_keep_is_refused(line: Recorder) -> None:
    """Before torque: the plan counts on fast reads, which this chain does not have."""
    line.bank["Firmware Version"][2] = 44
    fits = chain_budget(4, line.getBaudRate(), fast=False).limit_hz
    with pytest.raises(BudgetError, match=f"at most {fits:.0f} Hz"):
        ServoChain(DynamixelBus(line), ROBOT, rate_hz=fits + 1.0).enable()
    assert at(line, 64, 1) == []
    ServoChain(DynamixelBus(line), ROBOT, rate_hz=fits - 1.0).enable()


@pytest.mark.parametrize(
    ("beyond", "end"), [(1.1, "cycles will be late"), (0.9, "plain from now on")]
)
def test_fast_reads_given_up_in_a_run_are_told_with_what_the_wire_still_carries(
    beyond: float, end: str
) -> None:
    line = DamagedFastReads(ServoBank(ROBOT.servo_ids), START)
    plain_hz = chain_budget(4, line.getBaudRate(), fast=False).limit_hz
    chain = ServoChain(DynamixelBus(line), ROBOT, rate_hz=beyond * plain_hz)
    events: list[str] = []
    chain.on_event = events.append
    chain.enable()
    line.damaged = True
    for _ in range(8):
        chain.read()
    assert not chain.fast
    (event,) = events
    assert event.startswith("fast sync reads given up after 3 failures")
    assert event.endswith(end)
    assert (f"at most {plain_hz:.0f} Hz of plain reads" in event) == (beyond > 1.0)


@pytest.mark.parametrize("silent", [(0,), (1, 3), (0, 1, 2, 3)])
def test_torque_off_is_sent_to_all_and_silent_servos_are_named_in_bounded_time(
    chain: ServoChain, line: Recorder, silent: tuple[int, ...]
) -> None:
    chain.enable()
    line.mute(np.array(silent), True)
    line.refresh_ids()
    begin_s = line.clock.now_s()
    names = ", ".join(map(chain.robot.joint_label, silent))
    with pytest.raises(BusError, match=re.escape(f"{names}: torque off is not confirmed")):
        chain.disable()
    assert line.clock.now_s() - begin_s < 1.2
    assert line.bank["Torque Enable"].tolist() == [0] * 4
    loud = [k for k in range(4) if k not in silent]
    line.drain_until_quiet(1e-3)
    assert line.bank["Bus Watchdog"][loud].tolist() == [0] * len(loud)


def test_torque_goes_off_on_a_line_that_is_back_within_a_second(
    chain: ServoChain, line: Recorder
) -> None:
    """Each was asked once alone, in 0.15 s: with the watchdogs disarmed, torque stayed on."""
    chain.enable()
    line.bank["Bus Watchdog"][:] = 0
    lost = {"seed": 1, "fault": [{"kind": "drop", "at_s": 0.0, "for_s": 0.7, "of": "both"}]}
    FaultPlayer(line, FaultPlan.model_validate(lost))
    chain.disable()
    assert line.bank["Torque Enable"].tolist() == [0] * 4


def test_sixty_silent_servos_do_not_hold_up_the_way_out() -> None:
    robot = RobotConfig(name="long", joint_axes="y" * 60)
    line = Recorder(ServoBank(robot.servo_ids), [0.0] * 60)
    chain = ServoChain(DynamixelBus(line), robot)
    chain.enable()
    line.mute(np.arange(60), True)
    line.refresh_ids()
    begin_s = line.clock.now_s()
    with pytest.raises(BusError, match="torque off is not confirmed"):
        chain.disable()
    assert line.clock.now_s() - begin_s < 1.2
    assert line.bank["Torque Enable"].tolist() == [0] * 60


def test_a_port_that_stays_away_is_an_error_that_says_what_becomes_of_torque(
    chain: ServoChain, line: Recorder
) -> None:
    chain.enable()
    line.disconnect()
    begin_s = line.clock.now_s()
    with pytest.raises(PortError, match=r"torque is not off: .* switch the servo power off") as end:
        chain.disable()
    assert len(str(end.value)) < 200
    assert 1.9 < line.clock.now_s() - begin_s < 2.5


def test_torque_off_waits_for_a_port_that_comes_back(chain: ServoChain, line: Recorder) -> None:
    chain.enable()
    line.disconnect()
    line.firmware.events.schedule(line.clock.now_s() + 1.0, line.reconnect)
    chain.disable()
    assert line.bank["Torque Enable"].tolist() == [0] * 4


def noisy(chance: float, seed: int) -> tuple[ServoChain, Recorder, list[str]]:
    """A chain that is enabled, and from then on loses packets both ways."""
    line = Recorder(ServoBank(ROBOT.servo_ids), START)
    chain = ServoChain(DynamixelBus(line), ROBOT)
    chain.enable()
    events: list[str] = []
    chain.on_event = events.append
    fault = {"kind": "drop", "chance": chance, "of": "both"}
    FaultPlayer(line, FaultPlan.model_validate({"seed": seed, "fault": [fault]}))
    return chain, line, events


def test_torque_off_is_confirmed_on_a_line_that_loses_a_fifth_of_the_packets() -> None:
    """In a quarter of such exits with 16 servos it was not, and took longer."""
    for seed in range(30):
        chain, line, _ = noisy(0.2, seed)
        chain.disable()
        assert line.bank["Torque Enable"].tolist() == [0] * 4


def test_replies_that_get_lost_again_and_again_are_told_once(
    chain: ServoChain, line: Recorder
) -> None:
    chain.enable()
    events: list[str] = []
    chain.on_event = events.append
    for read in range(120):
        line.tamper = (lambda raw: []) if read % 12 == 5 else None
        chain.read()
        assert len(events) == (read >= 5 + 3 * 12)
    assert events[0].startswith("replies got lost 4 times within 37 reads: no byte is damaged")
    assert "snakewalk doctor" in events[0]


def test_a_line_on_which_nobody_is_read_any_more_is_told(chain: ServoChain, line: Recorder) -> None:
    """Where another program takes the replies, a run stops before four of them are lost."""
    chain.enable()
    events: list[str] = []
    chain.on_event = events.append
    line.tamper = lambda raw: []
    chain.read()
    assert events == []
    chain.read()
    assert [event[:39] for event in events] == ["no servo was read in two reads in a row"]


def test_a_servo_that_falls_silent_is_no_bad_line(chain: ServoChain, line: Recorder) -> None:
    chain.enable()
    events: list[str] = []
    chain.on_event = events.append
    line.mute(np.array([2]), True)
    line.refresh_ids()
    for _ in range(50):
        chain.read()
    assert not [event for event in events if "got lost" in event or "no servo" in event]


def test_ids_that_are_exchanged_between_two_runs_are_told_at_the_start(
    chain: ServoChain, line: Recorder
) -> None:
    chain.enable()
    chain.disable()
    line.bank["ID"][[1, 2]] = line.bank["ID"][[2, 1]]
    line.refresh_ids()
    events: list[str] = []
    chain.on_event = events.append
    chain.enable()
    assert [event for event in events if "exchanged" in event] == [
        f"{a}: its servo was {b} in the run before: have IDs been exchanged since?"
        for a, b in permutations(("joint pitch_02 (ID 2)", "joint yaw_03 (ID 3)"))
    ]
    chain.disable()
    events.clear()
    chain.enable()
    assert not [event for event in events if "exchanged" in event]


@pytest.mark.fast_cases(8)
@pytest.mark.parametrize("place", range(17))
def test_a_cycle_in_which_nobody_is_read_asks_for_nothing_else(place: int) -> None:
    """Three time-outs in one call, of 20 ms and as much draining, made the state stale at once."""
    line = Recorder(ServoBank(ROBOT.servo_ids), START)
    chain = ServoChain(DynamixelBus(line, latency_s=0.02), ROBOT)
    chain.enable()
    for _ in range(place):
        chain.read()
    line.tamper = lambda raw: []
    begin_s = line.clock.now_s()
    asked = len(line.heard)
    assert chain.read().age_s.max() < 0.05
    assert line.clock.now_s() - begin_s < 0.045
    assert len(line.heard) == asked + 1
    line.tamper = None
    assert chain.read().valid.all()


@pytest.mark.parametrize("value", [0, 10])
def test_a_port_that_vanishes_before_the_watchdogs_are_armed_promises_none(
    chain: ServoChain, line: Recorder, value: int
) -> None:
    """Five of six servos held with torque and no watchdog, and the event promised one."""
    compared = chain.recheck(chain.enable().position_rad)

    def vanish(_: float, is_host: bool, packet: bytes) -> None:
        is_write = packet[7:10] == bytes([Instruction.SYNC_WRITE, 98, 0])
        if is_host and is_write and packet[13] == value:
            line.disconnect()

    line.taps.append(vanish)
    with pytest.raises(PortError, match="its servos hold their last goals; switch the"):
        chain.resume(compared)


def test_a_pause_of_the_computer_during_a_read_is_in_the_state(
    chain: ServoChain, line: Recorder
) -> None:
    assert chain.enable().stalled_s == 0.0

    def pause(_: float, is_host: bool, packet: bytes) -> None:
        del packet
        if not is_host and line.taps:
            line.taps.clear()
            line.clock.advance(0.15)

    line.taps.append(pause)
    state = chain.read()
    assert state.stalled_s == pytest.approx(0.15, abs=0.01)
    assert chain.read().stalled_s == state.stalled_s
