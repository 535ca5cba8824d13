"""Fault files on Feetech servos: every kind on the wire, and a chain under noise."""

import tomllib
from collections.abc import Callable

import numpy as np
import pytest

from snakewalk.config.errors import ConfigError
from snakewalk.config.faults import FaultPlan
from snakewalk.config.loader import checked, load_robot
from snakewalk.drivers.bus.feetech_bus import FeetechBus, servo_bus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import PortError
from snakewalk.drivers.protocol.feetech import FeetechInstruction as Code
from snakewalk.drivers.protocol.protocol1 import frame
from snakewalk.drivers.types import JointCommand
from snakewalk.sim.faults.fault_player import FaultPlayer
from snakewalk.sim.feetech.line import FeetechLine
from snakewalk.sim.serve.bench_line import bench_line
from snakewalk.sim.serve.chain_spec import parse_chain
from tests.helpers.tiers import slow_after
from tests.sim.faults.test_faults import fault

PERIOD_S = 0.02
SYNC_READ = frame(0xFE, Code.SYNC_READ, bytes((62, 1, 1, 2, 3)))


def scripted(text: str, servos: str = "1-3:STS3215") -> FeetechLine:
    line = bench_line(parse_chain(servos))
    assert isinstance(line, FeetechLine)
    FaultPlayer(line, checked(FaultPlan, tomllib.loads(text), "test"))
    line.clock.advance(0.01)
    line.settle()
    return line


def ask(line: FeetechLine, packet: bytes) -> bytes:
    line.write(packet)
    return line.read_until(999, line.clock.now_s() + 0.02)


def answering(line: FeetechLine) -> list[int]:
    return [each for each in (1, 2, 3) if ask(line, frame(each, Code.PING)) == frame(each, 0)]


@pytest.mark.parametrize("kind", ["drop", "corrupt", "truncate"])
def test_noise_spoils_the_replies_of_the_servos_named(kind: str) -> None:
    line = scripted(fault(kind, ids=[2], for_s=0.5))
    assert answering(line) == [1, 3]
    line.clock.advance(0.5)
    assert answering(line) == [1, 2, 3]


def test_a_damaged_instruction_is_not_obeyed() -> None:
    line = scripted(fault("truncate", of="questions"))
    assert ask(line, frame(1, Code.WRITE, bytes((40, 1)))) == b""
    assert not line.servos["Torque Enable"].any()


def test_duplicate_and_delay() -> None:
    assert ask(scripted(fault("duplicate", ids=[2])), frame(2, 1)) == frame(2, 0) * 2
    line = scripted(fault("delay", by_s=0.003, ids=[2]))
    sent_s = line.clock.now_s()
    line.write(frame(2, 1))
    line.read_until(6, 1.0)
    assert line.clock.now_s() - sent_s == pytest.approx(0.003 + 12e-5, abs=1e-6)


def torque(line: FeetechLine) -> object:
    return line.servos["Torque Enable"].tolist()


def load(line: FeetechLine) -> object:
    return abs(int(line.shown("Present Load")[1])) > 900


def driven(line: FeetechLine) -> object:
    return line.servos.drive.pwm_limit.tolist()


def ids(line: FeetechLine) -> object:
    return line.servos["ID"].tolist()


@pytest.mark.parametrize(
    ("text", "shown", "before", "during"),
    [
        (fault("mute", ids=[2], at_s=0.1), answering, [1, 2, 3], [1, 3]),
        (fault("brown_out", ids=[2], at_s=0.1), answering, [1, 2, 3], [1, 3]),
        (fault("unplug", behind=1, at_s=0.1), answering, [1, 2, 3], [1]),
        (fault("reboot", ids=[2], at_s=0.1), torque, [1, 1, 1], [1, 0, 1]),
        (fault("no_output", ids=[2], at_s=0.1), driven, [1.0, 1.0, 1.0], [1.0, 0.0, 1.0]),
        (fault("encoder", ids=[2], at_s=0.1), answering, [1, 2, 3], [1, 3]),
        (fault("overheating", ids=[2], at_s=0.1), torque, [1, 1, 1], [1, 0, 1]),
        (fault("heat", ids=[2], celsius=90.0, at_s=0.1), torque, [1, 1, 1], [1, 0, 1]),
        (fault("exchange", id=1, takes=2, at_s=0.1), ids, [1, 2, 3], [2, 1, 3]),
        (fault("clash", id=1, takes=2, at_s=0.1), ids, [1, 2, 3], [2, 2, 3]),
        (
            fault("write", ids=[2], register="Torque Enable", value=0, at_s=0.1),
            *(torque, [1, 1, 1], [1, 0, 1]),
        ),
    ],
)
def test_a_fault_of_a_servo(
    text: str, shown: Callable[[FeetechLine], object], before: object, during: object
) -> None:
    line = scripted(text)
    line.servos["Torque Enable"][:] = 1
    line.clock.advance(0.01)
    line.settle()
    assert shown(line) == before
    line.clock.advance(0.2)
    line.settle()
    assert shown(line) == during


def test_supply_reading_stuck_and_port() -> None:
    line = scripted(fault("supply", volts=5.0, ids=[2]))
    assert ask(line, SYNC_READ)[5::7] == bytes((74, 50, 74))
    line = scripted(fault("reading", ids=[2], register="Present Temperature", value=9))
    assert line.shown("Present Temperature").tolist() == [25, 9, 25]
    line = scripted(fault("stuck", ids=[2]))
    bus = FeetechBus(line, "STS3215")
    bus.sync_write([1, 2, 3], "Torque Enable", 1)
    bus.sync_write([1, 2, 3], "Goal Position", 3000)
    line.clock.advance(1.0)
    line.settle()
    assert load(line)
    assert abs(bus.read(2, "Present Position") - 2048) < 20
    line = scripted(fault("port", at_s=0.0, for_s=1.0))
    with pytest.raises(PortError):
        ask(line, SYNC_READ)


def test_a_deaf_servo_ignores_sync_writes_only() -> None:
    line = scripted(fault("deaf", ids=[2]))
    bus = FeetechBus(line, "STS3215")
    bus.sync_write([1, 2, 3], "Acceleration", 9)
    bus.write(2, "Goal Velocity", 77)
    assert line.servos["Acceleration"].tolist() == [9, 0, 9]
    assert line.servos["Goal Velocity"][1] == 77


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (fault("alert", ids=[1]), "have no alert bit"),
        (fault("shock", ids=[1]), "detects overload, overheating, voltage, encoder only"),
    ],
)
def test_a_fault_that_the_servos_do_not_have(text: str, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        scripted(text)


def test_a_chain_is_compared_with_itself_after_an_interruption() -> None:
    line, robot = scripted("", "1-12:STS3215"), load_robot("sts3215-12")
    chain = ServoChain(servo_bus(line, robot.models_by_id), robot, rate_hz=50)
    believed_rad = chain.enable().position_rad
    found = chain.recheck(believed_rad)
    assert found.faults == ()
    assert found.reset == ()
    line.servos["Goal Velocity"][3] = 7
    assert chain.recheck(believed_rad).reset == (3,)


NOISE = {
    "drop": {"chance": 0.05},
    "corrupt": {"chance": 0.05},
    "truncate": {"chance": 0.05},
    "duplicate": {"chance": 0.1},
    "late": {"chance": 0.02, "for_s": 9.0},
    "delay": {"chance": 0.2, "by_s": 0.002},
}


@pytest.mark.slow_cases(2, "5 cases of 0.5 s of CPU")
@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(
    ("kind", "seed"), slow_after(2, [(kind, seed) for seed, kind in enumerate(NOISE)])
)
def test_no_late_or_damaged_reply_is_taken_for_a_new_value(kind: str, seed: int) -> None:
    text = f"seed = {seed}\n" + fault(kind, at_s=2.0, **{"for_s": 9.0, **NOISE[kind]})
    line = scripted(text, "1-12:STS3215")
    robot = load_robot("sts3215-12")
    chain = ServoChain(servo_bus(line, robot.models_by_id), robot, rate_hz=50)
    chain.enable()
    begin_s = line.clock.now_s()
    fresh, worst_rad = 0, 0.0
    for k in range(60):
        now_s = line.clock.now_s()
        goal = 0.4 * np.sin(3.0 * (now_s - begin_s)) * np.ones(12)
        chain.write(JointCommand(now_s, goal))
        state = chain.read()
        line.settle()
        there_rad = line.servos.plant.position_rad
        moved_rad = np.abs(state.position_rad - there_rad)[state.valid]
        worst_rad = max(worst_rad, float(np.max(moved_rad, initial=0.0)))
        fresh += int(state.valid.sum())
        line.clock.sleep_until_s(max(line.clock.now_s(), begin_s + (k + 1) * PERIOD_S))
    assert fresh > 200
    assert worst_rad < 0.06  # 1.2 rad/s for 40 ms, and half a position
    chain.disable()
    assert not line.servos["Torque Enable"].any()
