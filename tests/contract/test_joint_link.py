"""One contract for every joint link: whatever answers on the bus, this is what a link promises.

In process on a bench and on MuJoCo, and through a pseudo-terminal, by default; on metal with
``pytest -m metal --port DEVICE`` (``--robot`` says which), where the robot must stand free: joints
move by up to 0.1 rad.
"""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np
import pytest

from snakewalk.config.loader import load_robot
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.run.external.served_robot import simulated_line
from snakewalk.controller.run.external.simulated_backend import SimulatedBus
from snakewalk.drivers.bus.chain_bus import ChainBus
from snakewalk.drivers.bus.feetech_bus import servo_bus
from snakewalk.drivers.bus.segmented_bus import SegmentedBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.clock import Clock
from snakewalk.drivers.errors import ChainError, DriverError
from snakewalk.drivers.link import JointLink
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointCommand, JointState
from snakewalk.sim.feetech.line import FeetechLine
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.plant import Plant
from snakewalk.sim.serve.pty import PtyServer
from snakewalk.sim.servo.bench import BenchPlant
from tests.helpers.pty_port import PtyPort, ServedClock

Line = SimLine | FeetechLine
PERIOD_S = 0.02
TRIO = RobotConfig(name="trio", joint_axes="ypy")
FEETECH = {
    model: RobotConfig.model_validate(
        {
            "name": "trio",
            "joint_axes": "ypy",
            "servo": {
                **{"model": model, "supply_v": volts, "supply_min_v": 5.0, "supply_max_v": 8.0},
                **{"position_p_gain": gain, "pitch_p_gain": gain, "pitch_current_limit_a": 0.8},
                **{"armature_kg_m2": 0.005},
            },
        }
    )
    for model, volts, gain in (("STS3215", 7.4, 64), ("HLS3606", 6.0, 128), ("SCS0009", 6.0, 16))
}
START_RAD = [0.3, 0.0, -0.2]
TWO_MAKES = RobotConfig.model_validate(
    {
        "name": "trio",
        "servo": {"model": "XM430-W350", "supply_v": 12.0, "pitch_current_limit_a": 0.8},
        "joints": [
            {"axis": "y", "id": 1},
            {"axis": "p", "id": 2, "model": "STS3215-C018", "position_p_gain": 64},
            {"axis": "y", "id": 3},
        ],
        "ports": [{"port": "A", "ids": [1, 3]}, {"port": "B", "ids": [2]}],
    }
)
"""DYNAMIXEL servos at both ends, a Feetech servo between them on a port of its own."""


@dataclass
class Bus:
    """Where the host's bytes go, and what answers."""

    chain_bus: ChainBus
    robot: RobotConfig
    lines: tuple[Line, ...]
    """The simulated lines; empty on metal."""

    @property
    def clock(self) -> Clock:
        return self.chain_bus.parts[0].port.clock


@dataclass
class Backend:
    """A link, and what stands behind it."""

    link: JointLink
    bus: Bus

    @property
    def robot(self) -> RobotConfig:
        return self.bus.robot

    @property
    def lines(self) -> tuple[Line, ...]:
        return self.bus.lines

    @property
    def clock(self) -> Clock:
        return self.bus.clock

    def cycles(self, count: int, goal: Callable[[float], np.ndarray] | None = None) -> JointState:
        """Write and read at 50 Hz, hold the pose if no goal is given; the last state."""
        clock = self.clock
        state, start_s = self.link.read(), clock.now_s()
        hold = state.position_rad
        for k in range(count):
            wanted = hold if goal is None else goal(clock.now_s() - start_s)
            self.link.write(JointCommand(clock.now_s(), wanted))
            state = self.link.read()
            clock.sleep_until_s(start_s + (k + 1) * PERIOD_S)
        return state


def bench(robot: RobotConfig) -> Plant:
    return BenchPlant(robot.joint_count, start_rad=START_RAD, dry_n_m=0.005)


def mujoco(robot: RobotConfig) -> Plant:
    from snakewalk.sim.physics.plant import MujocoPlant

    plant = MujocoPlant(robot, WorldConfig(name="flat"))
    plant.reset((0.0, 0.0), 0.0, START_RAD)
    return plant


def bare(bus: Bus) -> JointLink:
    return ServoChain(bus.chain_bus, bus.robot)


def safe(bus: Bus) -> JointLink:
    return SafeLink(bare(bus), SafetyLimits.from_config(bus.robot, SafetyConfig()), bus.clock)


needs_mujoco = pytest.mark.skipif(find_spec("mujoco") is None, reason="MuJoCo is not installed")


def in_process(plant: Callable[[RobotConfig], Plant], robot: RobotConfig) -> Iterator[Bus]:
    servos = SimulatedBus.of(robot, plant(robot))
    yield Bus(servos.bus(), servos.robot, servos.lines)


def on_a_pty(plant: Callable[[RobotConfig], Plant], robot: RobotConfig) -> Iterator[Bus]:
    line, clock = simulated_line(robot, plant(robot)), ServedClock()
    with PtyServer(line, clock) as server, PtyPort(server, robot.servo.baud, clock) as port:
        yield Bus(servo_bus(port, robot.models_by_id), robot, (line,))


def on_two_ptys(plant: Callable[[RobotConfig], Plant], robot: RobotConfig) -> Iterator[Bus]:
    clock = ServedClock()
    with ExitStack() as opened:
        lines, parts = [], []
        for port in robot.ports:
            rows = [row for row, each in enumerate(robot.servo_ids) if each in port.ids]
            shafts = BenchPlant(len(rows), start_rad=[START_RAD[row] for row in rows])
            lines.append(simulated_line(robot, shafts, rows=rows))
            server = opened.enter_context(PtyServer(lines[-1], clock))
            device = opened.enter_context(PtyPort(server, robot.servo.baud, clock))
            parts.append((servo_bus(device, robot.models_on(port.ids)), port.ids))
        yield Bus(SegmentedBus(parts), robot, tuple(lines))


BACKENDS = [
    pytest.param((in_process, bench, TRIO), id="bench"),
    pytest.param((in_process, mujoco, TRIO), id="mujoco", marks=needs_mujoco),
    pytest.param((on_a_pty, bench, TRIO), id="pty"),
    *(pytest.param((in_process, bench, robot), id=model) for model, robot in FEETECH.items()),
    pytest.param((in_process, mujoco, FEETECH["STS3215"]), id="STS3215-mujoco", marks=needs_mujoco),
    pytest.param((on_a_pty, bench, FEETECH["STS3215"]), id="STS3215-pty"),
    pytest.param((in_process, bench, TWO_MAKES), id="two-makes"),
    pytest.param((in_process, mujoco, TWO_MAKES), id="two-makes-mujoco", marks=needs_mujoco),
    pytest.param((on_two_ptys, bench, TWO_MAKES), id="two-makes-ptys"),
    pytest.param(None, id="metal", marks=pytest.mark.metal),
]


@pytest.fixture(params=BACKENDS)
def bus(request: pytest.FixtureRequest) -> Iterator[Bus]:
    if request.param is not None:
        make, plant, robot = request.param
        yield from make(plant, robot)
        return
    device = request.config.getoption("--port")
    if device is None:
        pytest.skip("give the bus with --port")
    from snakewalk.drivers.port.serial_port import SerialPort

    robot = load_robot(request.config.getoption("--robot"))
    with SerialPort(device, robot.servo.baud) as port:
        yield Bus(servo_bus(port, robot.models_by_id), robot, ())


@pytest.fixture(params=[bare, safe])
def backend(request: pytest.FixtureRequest, bus: Bus) -> Iterator[Backend]:
    made = Backend(request.param(bus), bus)
    yield made
    for line, part in zip(bus.lines, bus.chain_bus.parts, strict=bool(bus.lines)):
        part.port.openPort()
        line.tamper = None
    made.link.disable()


def simulated(backend: Backend) -> tuple[Line, ...]:
    if not backend.lines:
        pytest.skip("needs a line that fails on demand")
    return backend.lines


def tamper(lines: tuple[Line, ...], change: Callable[[bytes], list[bytes]] | None) -> None:
    for line in lines:
        line.tamper = change


@pytest.mark.fast_cases(5)
@pytest.mark.slow_cases(7, "24 links in all")
def test_enable_moves_nothing(backend: Backend) -> None:
    found = backend.link.enable()
    later = backend.cycles(25)
    assert np.abs(later.position_rad - found.position_rad).max() < 0.02
    if backend.lines:
        assert np.abs(found.position_rad - START_RAD).max() < 0.05
    assert all(line.firmware.drive.torque_on.all() for line in backend.lines)


@pytest.mark.fast_cases(5)
@pytest.mark.slow_cases(7, "24 links in all")
def test_goals_are_followed(backend: Backend) -> None:
    start = backend.link.enable().position_rad

    def goal(time_s: float) -> np.ndarray:
        return np.asarray(start - np.sign(start) * 0.1 * min(1.0, time_s / 0.5))

    state = backend.cycles(60, goal)
    assert np.abs(state.position_rad - goal(1.0)).max() < 0.05
    assert np.abs(state.velocity_rad_s).max() < 0.3


@pytest.mark.fast_cases(5)
@pytest.mark.slow_cases(7, "24 links in all")
def test_state_is_whole_and_read_only(backend: Backend) -> None:
    state = backend.link.enable()
    joints = backend.link.joint_count
    assert joints == backend.robot.joint_count
    assert (state.imu is None) == (backend.robot.imu is None)
    for name in JointState._fields[1:-2]:  # time first, IMU and pauses last
        array = getattr(state, name)
        assert array.shape == (joints,), name
        assert not array.flags.writeable, name
        assert np.isfinite(array).all(), name
    assert state.valid.all()
    assert not state.hardware_error.any()
    assert ((state.temperature_c > 0) & (state.temperature_c < 80)).all()
    assert (state.voltage_v > 3.0).all()


@pytest.mark.fast_cases(5)
@pytest.mark.slow_cases(7, "24 links in all")
def test_time_runs_on_and_fresh_values_have_no_age(backend: Backend) -> None:
    first = backend.link.enable()
    second = backend.cycles(5)
    assert second.time_s > first.time_s
    assert second.time_s <= backend.clock.now_s()
    assert second.valid.all()
    assert (second.age_s >= 0).all()
    assert second.age_s.max() < PERIOD_S


@pytest.mark.fast_cases(5)
@pytest.mark.slow_cases(7, "24 links in all")
def test_a_goal_that_is_no_number_never_leaves(backend: Backend) -> None:
    goal = backend.link.enable().position_rad.copy()
    goal[0] = np.nan
    sent = [line.bank["Goal Position"].tolist() for line in backend.lines]
    with pytest.raises((ValueError, DriverError)):
        backend.link.write(JointCommand(backend.clock.now_s(), goal))
    for line in backend.lines:
        line.settle()
    assert [line.bank["Goal Position"].tolist() for line in backend.lines] == sent


@pytest.mark.fast_cases(5)
@pytest.mark.slow_cases(7, "24 links in all")
def test_disable_may_come_at_any_time(backend: Backend) -> None:
    backend.link.disable()
    backend.link.enable()
    backend.link.disable()
    backend.link.disable()
    assert backend.link.read().valid.all()
    assert not any(line.firmware.drive.torque_on.any() for line in backend.lines)


@pytest.mark.fast_cases(5)
@pytest.mark.slow_cases(7, "24 links in all")
def test_enable_again_after_disable(backend: Backend) -> None:
    backend.link.enable()
    backend.cycles(5)
    backend.link.disable()
    found = backend.link.enable()
    later = backend.cycles(10)
    assert np.abs(later.position_rad - found.position_rad).max() < 0.02


@pytest.mark.fast_cases(5)
@pytest.mark.slow_cases(7, "24 links in all")
def test_failed_reads_hold_values_and_age(backend: Backend) -> None:
    lines = simulated(backend)
    backend.link.enable()
    good = backend.link.read()
    tamper(lines, lambda _: [])
    ages = []
    for _ in range(3):
        state = backend.link.read()
        assert not state.valid.any()
        assert state.position_rad.tolist() == good.position_rad.tolist()
        assert state.current_a.tolist() == good.current_a.tolist()
        ages.append(float(state.age_s.min()))
    assert ages == sorted(set(ages))
    assert ages[0] > 0.0
    tamper(lines, None)
    assert backend.link.read().valid.all()


@pytest.mark.fast_cases(5)
@pytest.mark.slow_cases(7, "24 links in all")
def test_a_bent_answer_is_never_taken_for_a_value(backend: Backend) -> None:
    lines = simulated(backend)
    backend.link.enable()
    good = backend.link.read()
    tamper(lines, lambda answer: [answer[:-6] + bytes((answer[-6] ^ 0x40,)) + answer[-5:]])
    for _ in range(6):
        state = backend.link.read()
        assert np.abs(state.position_rad - good.position_rad).max() < 0.02


def test_a_servo_with_an_alarm_is_not_enabled(backend: Backend) -> None:
    line = simulated(backend)[-1]
    protection, row = line.servos.protection, len(line.ids()) // 2
    protection.detect(np.array([row]), protection.alarms(row)["overheating"])
    with pytest.raises(ChainError, match=rf"\(ID {line.ids()[row]}\b.*overheating"):
        backend.link.enable()
    assert not any(each.firmware.drive.torque_on.any() for each in backend.lines)


@pytest.mark.fast_cases(5)
@pytest.mark.slow_cases(7, "24 links in all")
def test_the_servos_stop_by_themselves_when_the_host_is_gone(backend: Backend) -> None:
    lines = simulated(backend)
    backend.link.enable()
    backend.cycles(5)
    clock = backend.clock
    clock.sleep_until_s(clock.now_s() + 1.0)
    for line in lines:
        line.settle()
        if isinstance(line, FeetechLine):  # no watchdog: a run reports it, and they hold
            assert line.firmware.drive.torque_on.all()
        else:
            assert (line.bank["Bus Watchdog"] == 0xFF).all()


@pytest.mark.fast_cases(5)
@pytest.mark.slow_cases(7, "24 links in all")
def test_a_lost_port_is_an_error_that_says_so(backend: Backend) -> None:
    simulated(backend)
    backend.link.enable()
    backend.bus.chain_bus.parts[-1].port.closePort()
    with pytest.raises(DriverError, match="closed"):
        backend.link.read()
