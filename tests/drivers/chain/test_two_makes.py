"""A chain of two makes on two ports: a fault on either one stops both."""

import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from snakewalk.config.faults import FaultPlan
from snakewalk.config.loader import checked
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.controller.run.external.simulated_backend import SimulatedBus
from snakewalk.drivers.bus.budget import robot_budget
from snakewalk.drivers.chain.fingerprint_file import FingerprintFile
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import BusError, DriverError, PortError
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.recovery import Recovery
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointCommand, JointState
from snakewalk.sim.faults.fault_player import FaultPlayer
from snakewalk.sim.feetech.line import FeetechLine
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bench import BenchPlant

PERIOD_S = 0.02
IDS = ((1, 2, 5), (3, 4, 6))
"""Of the DYNAMIXEL port and the Feetech port; the joints of a port need not be neighbours."""
START_RAD = np.array([0.3, -0.2, 0.1, 0.0, -0.3, 0.2])
FEETECH = {"model": "STS3215-C018", "position_p_gain": 64}


def robot_file(**changes: object) -> dict[str, object]:
    ports = [{"port": name, "ids": ids} for name, ids in zip("AB", IDS, strict=True)]
    joints = [
        {"axis": "yp"[k % 2], "id": k + 1, **(FEETECH if k + 1 in IDS[1] else {})} for k in range(6)
    ]
    return {
        **{"name": "six"},
        "servo": {"model": "XM430-W350", "supply_v": 12.0, "pitch_current_limit_a": 0.8},
        **{"joints": joints, "ports": ports},
        **changes,
    }


ROBOT = RobotConfig.model_validate(robot_file())


class Body:
    """Six joints on a bench, a line per port."""

    def __init__(self, file: FingerprintFile | None = None) -> None:
        self.plant = BenchPlant(6, start_rad=START_RAD, dry_n_m=0.005)
        self.servos = SimulatedBus.of(ROBOT, self.plant)
        self.lines = self.servos.lines
        self.clock = self.servos.clock
        self.events: list[str] = []
        self.chain = ServoChain(
            self.servos.bus(), self.servos.robot, rate_hz=50.0, fingerprint_file=file
        )
        self.chain.on_event = self.events.append

    def safe(self, recovery: Recovery | None = None) -> SafeLink:
        limits = SafetyLimits.from_config(ROBOT, SafetyConfig())
        return SafeLink(self.chain, limits, self.clock, recovery)

    def cycles(
        self, link: ServoChain | SafeLink, count: int, disturb: Callable[[], None] = lambda: None
    ) -> JointState:
        """Move all joints by up to 0.1 rad at 50 Hz; ``disturb`` before each read."""
        state = link.read()
        start_rad, start_s = state.position_rad, self.clock.now_s()
        for k in range(count):
            moved = 0.1 * np.sin(0.2 * (k + 1))
            link.write(JointCommand(self.clock.now_s(), start_rad + moved))
            disturb()
            state = link.read()
            self.clock.sleep_until_s(start_s + (k + 1) * PERIOD_S)
        return state

    def torque_on(self) -> list[bool]:
        self.servos.settle()
        return [bool(line.firmware.drive.torque_on.any()) for line in self.lines]


@pytest.fixture
def body() -> Body:
    return Body()


def test_the_joints_of_both_ports_follow_their_goals(body: Body) -> None:
    assert [type(line) for line in body.lines] == [SimLine, FeetechLine]
    found = body.chain.enable()
    assert found.position_rad == pytest.approx(START_RAD, abs=0.02)
    state = body.cycles(body.chain, 40)
    assert state.valid.all()
    assert state.position_rad == pytest.approx(body.plant.position_rad, abs=0.02)
    assert state.position_rad == pytest.approx(START_RAD + 0.1 * np.sin(8.0), abs=0.05)
    assert body.lines[0].bank["Bus Watchdog"].all()
    lacking = [line for line in body.events if "has no bus watchdog" in line]
    assert [line.split(":")[0] for line in lacking] == ["STS3215-C018 (yaw_03, pitch_04, pitch_06)"]
    body.chain.disable()
    assert body.torque_on() == [False, False]
    assert not body.lines[0].bank["Bus Watchdog"].any()


@pytest.mark.slow
def test_a_chain_without_faults_is_checked_for_many_rounds(body: Body) -> None:
    with body.safe() as link:
        link.enable()
        state = body.cycles(link, 200)  # 12 rounds, so that each register is compared
        assert state.valid.all()
        assert link.tripped is None
    assert body.chain.counters.timeouts == body.chain.counters.unclean == 0


def player(kind: str, row: int, more: str = "") -> Callable[[Body, int], None]:
    def begin(body: Body, port: int) -> None:
        ids = f"ids = [{IDS[port][row]}]\n" if kind != "exchange" else ""
        text = f'seed = 1\n[[fault]]\nkind = "{kind}"\nat_s = 0.0\n{ids}{more}'
        if kind == "exchange":
            text += f"id = {IDS[port][row]}\ntakes = {IDS[port][row + 1]}\n"
        FaultPlayer(body.lines[port], checked(FaultPlan, tomllib.loads(text), "test"))

    return begin


FAULTS = {
    "silent": (player("mute", 1, "for_s = 0.5\n"), "not read for 0.1"),
    "exchanged": (player("exchange", 0), "exchanged IDs|Goal Position is|not read"),
    "restarted": (player("reboot", 1), "it has rebooted"),
    "alarm": (player("overheating", 1), "overheating"),
    "setting": (
        player("write", 1, 'register = "Position P Gain"\nvalue = 3\n'),
        "Position P Gain is 3, was",
    ),
    "limit": (
        player("write", 1, 'register = "PWM Limit"\nvalue = 300\n'),
        "PWM Limit is 300, was",
    ),
}


@pytest.mark.slow_cases(3, "11 cases of 0.4 s of CPU")
@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("port", [0, 1])
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_on_one_port_stops_both(body: Body, port: int, fault: str) -> None:
    begin, said = FAULTS[fault]
    with body.safe() as link:
        link.enable()
        body.cycles(link, 5)
        begin(body, port)
        with pytest.raises(DriverError, match=said) as stopped:
            body.cycles(link, 100)
        assert f" on {'AB'[port]})" in str(stopped.value)
        assert body.torque_on() == [False, False]
        body.clock.sleep_until_s(body.clock.now_s() + 1.0)


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("port", [0, 1])
def test_a_second_master_on_one_port_stops_both(body: Body, port: int) -> None:
    goals = body.lines[port].bank["Goal Position"]

    def disturb() -> None:
        body.clock.advance(0.002)  # after the goals of the chain
        body.servos.settle()
        goals[1] += 40

    with body.safe() as link:
        link.enable()
        body.cycles(link, 5)
        with pytest.raises(DriverError, match="another program writes goals") as stopped:
            body.cycles(link, 60, disturb)
        assert f"(ID {IDS[port][1]} on {'AB'[port]})" in str(stopped.value)
        assert body.torque_on() == [False, False]


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("port", [0, 1])
def test_torque_off_reaches_both_ports_before_the_next_cycle(body: Body, port: int) -> None:
    off_s: list[float] = []
    for line in body.lines:
        line.taps.append(lambda end_s, sent, data: off_s.append(end_s) if is_off(data) else None)

    def is_off(data: bytes) -> bool:  # torque off to all: Torque Enable(64) or (40)
        group = data[:5] == b"\xff\xff\xfd\x00\xfe" or data[:3] == b"\xff\xff\xfe"
        at = 7 if data[2] == 0xFD else 4
        return group and data[at] == 0x83 and data[at + 1] in (64, 40)

    with body.safe() as link:
        link.enable()
        body.cycles(link, 20)
        off_s.clear()
        body.lines[port].firmware.protection.detect(np.array([1]), 0x04)
        detected_s = body.clock.now_s()
        with pytest.raises(DriverError):
            body.cycles(link, 4)
    assert len(off_s) >= 2
    assert max(off_s[:2]) - detected_s < 2 * PERIOD_S


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("port", [0, 1])
def test_a_port_that_vanishes_stops_the_other(body: Body, port: int) -> None:
    hold = ("hold after the bus watchdog", "hold their last goals")[port]
    with body.safe() as link:
        link.enable()
        body.cycles(link, 5)
        body.lines[port].disconnect()
        with pytest.raises(DriverError, match=rf"^{'AB'[port]} \(simulated\): the port") as stopped:
            body.cycles(link, 5)
        text = f"{stopped.value} {link.tripped}"
        assert hold in text
        assert "on the other ports torque is off" in text
        assert body.torque_on()[1 - port] is False
        body.lines[port].reconnect()


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("port", [0, 1])
def test_a_chain_resumes_after_an_interruption_of_one_port(body: Body, port: int) -> None:
    body.chain.enable()
    believed = body.cycles(body.chain, 5).position_rad
    body.lines[port].disconnect()
    with pytest.raises(PortError):
        body.cycles(body.chain, 2)
    body.lines[port].reconnect()
    body.chain.reopen()
    found = body.chain.recheck(believed)
    assert found.faults == ()
    assert body.chain.resume(found).valid.all()
    assert body.torque_on() == [True, True]


@pytest.mark.parametrize("port", [0, 1])
def test_a_servo_with_another_goal_at_the_start_is_not_switched_on(body: Body, port: int) -> None:
    line = body.lines[port]
    line.deafen(np.array([1]), True)
    line.bank["Goal Position"][1] += 300
    with pytest.raises(BusError, match=rf"\(ID {IDS[port][1]} on "):
        body.chain.enable()
    assert body.torque_on() == [False, False]


def test_the_fingerprint_file_has_both_makes(tmp_path: Path) -> None:
    robot_toml = tmp_path / "six.toml"
    file = FingerprintFile(robot_toml)
    Body(file).chain.enable()
    stored = file.read()
    assert stored is not None
    assert sorted(stored) == [1, 2, 3, 4, 5, 6]
    assert "Protection Current" in stored[3]
    assert "Current Limit" in stored[1]
    moved = Body(file)
    moved.lines[1].bank["Homing Offset"][0] = 100
    with pytest.raises(DriverError, match=r"\(ID 3 on B\): Homing Offset is 100, was 0: .*0\.15"):
        moved.chain.enable()


def test_the_budget_is_that_of_the_slowest_port() -> None:
    both = robot_budget(ROBOT, 1_000_000, fast=False)
    assert both.servos == 3
    alone = {
        model: robot_budget(
            RobotConfig.model_validate(
                {
                    "name": "three",
                    "joint_axes": "yyy",
                    "servo": {"model": model, "supply_v": 12.0},
                }
            ),
            1_000_000,
            fast=False,
        ).cycle_s
        for model in ("XM430-W350", "STS3215-C018")
    }
    assert both.cycle_s == max(alone.values())


def test_two_makes_on_one_port_are_rejected() -> None:
    said = "one port has servos of one series; name a port for each"
    with pytest.raises(ValidationError, match=said):
        RobotConfig.model_validate(robot_file(ports=[]))
    ports = [{"port": "A", "ids": [1, 2, 3]}, {"port": "B", "ids": [4, 5, 6]}]
    with pytest.raises(ValidationError, match=said):
        RobotConfig.model_validate(robot_file(ports=ports))
