"""Runs of a robot with DYNAMIXEL and Feetech servos: the robot file of the page about Feetech."""

import re
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.faults import FaultPlan
from snakewalk.config.loader import checked, load_robot
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.run import backend
from snakewalk.controller.run.external.served_robot import simulated_line
from snakewalk.controller.run.external.simulated_backend import SimulatedBus
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.reader import read_log
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import DriverError
from snakewalk.drivers.types import JointCommand
from snakewalk.sim.faults.fault_player import FaultPlayer
from snakewalk.sim.serve.pty import PtyServer
from snakewalk.sim.servo.bench import BenchPlant
from tests.helpers.command import snakewalk
from tests.helpers.pty_port import PtyPort, ServedClock
from tests.helpers.tiers import slow_except

PAGE = Path(__file__).resolve().parents[3] / "docs" / "how-to" / "feetech.md"


@pytest.fixture
def robot_file(tmp_path: Path) -> Path:
    (text,) = re.findall(r"```toml\n(name = .*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    file = tmp_path / "two-makes.toml"
    file.write_text(text, encoding="utf-8")
    return file


@pytest.mark.nightly("a further run on two ports: 2 s of CPU")
def test_a_gait_moves_the_whole_simulated_body(robot_file: Path, tmp_path: Path) -> None:
    gait = prepare_gait("lateral-undulation", robot=str(robot_file), seconds=3.0)
    finished = run_robot(RunRequest(gait, tmp_path / "run", stoppable=False))
    assert finished.outcome.tripped is None
    record = finished.record
    assert [each.port for each in record.header.robot.ports] == ["/dev/ttyUSB0", "/dev/ttyUSB1"]
    yaw_rad = record.cycle.measured_rad[:, ::2]
    assert np.ptp(yaw_rad, axis=0).min() > 0.2  # of both makes
    assert np.abs(yaw_rad - record.cycle.sent_rad[:, ::2]).max() < 0.15
    way_m = np.linalg.norm(np.diff(record.pose.head_m[[0, -1], :2], axis=0))
    assert way_m > 0.05
    texts = [each.text for each in record.events]
    lacking = [each for each in texts if "has no bus watchdog" in each]
    assert len(lacking) == 1
    assert "STS3215-C018 (yaw_05, pitch_06, yaw_07, pitch_08)" in lacking[0]


@pytest.mark.slow
def test_plan_names_the_joints_without_a_watchdog(robot_file: Path) -> None:
    done = snakewalk("plan", "flat-slalom", "--motion", "serpenoid", "--robot", str(robot_file))
    assert done.returncode == 0, done.stderr
    assert "yaw_05, pitch_06, yaw_07, pitch_08" in " ".join(done.stdout.split())


def test_the_lines_of_one_body_keep_one_time(robot_file: Path) -> None:
    """Goals that leave together act together, whatever the length of the replies."""
    robot = load_robot(str(robot_file))
    plant = BenchPlant(robot.joint_count)
    servos = SimulatedBus.of(robot, plant)
    chain = ServoChain(servos.bus(), servos.robot)
    chain.enable()
    moved_s = np.full(robot.joint_count, np.nan)
    clock = chain.clock
    chain.write(JointCommand(clock.now_s(), np.full(robot.joint_count, 0.3)))
    begin_s = clock.now_s()
    for _ in range(60):
        clock.sleep_until_s(clock.now_s() + 5e-4)
        servos.settle()
        moved = np.isnan(moved_s) & (np.abs(plant.velocity_rad_s) > 0.02)
        moved_s[moved] = clock.now_s() - begin_s
        assert plant.time_s == pytest.approx(clock.now_s(), abs=2e-3)
    yaw = moved_s[::2]
    assert np.nanmax(yaw) < 0.01
    chain.disable()


class Ports:
    """The robot's servos on two pseudo-terminals."""

    def __init__(
        self, robot: RobotConfig, opened: ExitStack, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        clock = ServedClock()
        self.lines = []
        by_name = {}
        for port in robot.ports:
            rows = [row for row, each in enumerate(robot.servo_ids) if each in port.ids]
            line = simulated_line(robot, BenchPlant(len(rows)), rows=rows)
            self.lines.append(line)
            by_name[port.port] = opened.enter_context(PtyServer(line, clock))

        def open_port(device: str, baud: int, _clock: object = None) -> PtyPort:
            return opened.enter_context(PtyPort(by_name[device], baud, clock))

        monkeypatch.setattr(backend, "open_port", open_port)


@pytest.fixture
def ports(robot_file: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Ports]:
    with ExitStack() as opened:
        yield Ports(load_robot(str(robot_file)), opened, monkeypatch)


@pytest.mark.costs("a run on two ports")
def test_a_gait_runs_on_both_ports(ports: Ports, robot_file: Path, tmp_path: Path) -> None:
    gait = prepare_gait("lateral-undulation", robot=str(robot_file), seconds=1.0)
    finished = run_robot(RunRequest(gait, tmp_path / "run", "robot", stoppable=False))
    assert finished.outcome.tripped is None
    for line in ports.lines:
        line.settle()
        assert not line.firmware.drive.torque_on.any()


@pytest.mark.slow_cases(1, "2 cases of 5.0 s of CPU")
@pytest.mark.slow
@pytest.mark.parametrize("silent", slow_except([7], [2, 7]))
def test_a_servo_that_dies_stops_the_run_on_both_ports(
    ports: Ports, robot_file: Path, tmp_path: Path, silent: int
) -> None:
    dies = {"seed": 1, "fault": [{"kind": "mute", "ids": [silent], "at_s": 1.5, "for_s": 60.0}]}
    FaultPlayer(ports.lines[silent > 4], checked(FaultPlan, dies, "faults"))
    gait = prepare_gait("lateral-undulation", robot=str(robot_file), seconds=3.0)
    with pytest.raises(DriverError, match="torque off is not confirmed"):
        run_robot(RunRequest(gait, tmp_path / "run", "robot", stoppable=False))
    log = read_log(tmp_path / "run" / "log.mcap")
    (trip,) = [each.text for each in log.events if each.kind == "trip"]
    assert f"(ID {silent} on /dev/ttyUSB{int(silent > 4)}): not read for" in trip
    for line in ports.lines:
        line.settle()
        assert not line.firmware.drive.torque_on.any()
