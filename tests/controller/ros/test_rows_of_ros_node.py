"""Rows of a run become messages of a node; the node notes them instead of sending them."""

import json
import re
import socket
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is in the extra ros, for Linux on x86-64")

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.clock import Clock
from std_srvs.srv import Trigger

from snakewalk.config.loader import load_robot, load_run, load_world
from snakewalk.controller.ros.ros_node import RobotNode
from snakewalk.controller.ros.ros_options import RosOptions
from snakewalk.controller.runlog.evidence import SIMULATED
from snakewalk.controller.runlog.record import Header, PlanSummary
from snakewalk.controller.runlog.row_line import ObserverEnd, RunEnd
from snakewalk.controller.runlog.topics import PoseTable
from snakewalk.controller.runlog.writer import RunLog
from snakewalk.drivers.safety.stop_button import StopButton
from snakewalk.drivers.types import JointState

JOINTS = 16


class Notes:
    """A node, its clock and its logger."""

    def __init__(self) -> None:
        self.sent: defaultdict[str, list[Any]] = defaultdict(list)
        self.lines: list[str] = []
        self.stop: Callable[[Any, Any], Any] = lambda request, response: None
        self._clock = Clock()

    def create_publisher(self, kind: type, name: str, quality: object) -> Any:
        return SimpleNamespace(publish=self.sent[name].append)

    def create_service(self, kind: type, name: str, call: Callable[[Any, Any], Any]) -> None:
        assert name == "~/stop"
        self.stop = call

    def get_clock(self) -> Clock:
        return self._clock

    def now_s(self) -> float:
        return 1e-9 * float(self._clock.now().nanoseconds)

    def get_fully_qualified_name(self) -> str:
        return "/snakewalk"

    def get_logger(self) -> Any:
        def noting(level: str) -> Callable[[str], None]:
            return lambda text: self.lines.append(f"{level} {text}")

        return SimpleNamespace(**{name: noting(name) for name in ("info", "warning", "error")})


class Run:
    """A run's log, whose rows the node reads."""

    def __init__(self, folder: Path) -> None:
        ours, far = socket.socketpair()
        self.end = RunEnd(ours)
        self.node = Notes()
        self.robot = RobotNode(self.node, ObserverEnd(far), RosOptions())  # type: ignore[arg-type]
        self.log = RunLog(folder / "log.mcap", self.end.add)

    def begin(self) -> None:
        parts = load_run("flat-square"), load_robot("yaw16"), load_world("flat")
        waypoints_m = np.array(parts[0].waypoints_m)
        plan = PlanSummary(np.zeros((2, 2)), waypoints_m, 0.3)
        self.log.config(Header(*parts, backend="sim", plan=plan, pose_evidence=SIMULATED))
        self.robot.step(0.0)

    def cycle(self, time_s: float) -> None:
        angles, zeros = np.full(JOINTS, 0.1), np.zeros(JOINTS)
        codes = np.zeros(JOINTS, np.uint8)
        readings = angles, zeros, zeros, zeros + 31.0, zeros + 12.0, codes, codes
        state = JointState(time_s, *readings, age_s=zeros, valid=codes == 0, slow_age_s=zeros)
        self.log.cycle(
            time_s,
            angles,
            angles,
            state,
            deadline_s=time_s,
            lateness_s=0.0023,
            wire_busy_s=0.004,
            verdict="pass",
            reason="",
            joints=(),
        )

    def pose(self, time_s: float) -> None:
        self.log.add(
            PoseTable,
            time_s,
            head_m=[1.0, 2.0, 0.03],
            rotation=np.eye(3),
            links_m=np.zeros((JOINTS + 1, 3)),
            centre_m=[1.0, 2.0, 0.03],
            speed_m_s=0.0,
            predicted_speed_m_s=0.0,
            pulse_m_s=0.0,
            path_s_m=0.0,
            target=0,
        )
        self.robot.step(0.0)

    def diagnostics(self) -> list[DiagnosticArray]:
        return self.node.sent["/diagnostics"]

    def says(self) -> dict[str, DiagnosticStatus]:
        return {status.name: status for status in self.diagnostics()[-1].status}


@pytest.fixture
def run(tmp_path: Path) -> Iterator[Run]:
    made = Run(tmp_path)
    with made.log:
        yield made


def test_before_its_configuration_a_run_has_no_messages(run: Run) -> None:
    run.robot.step(0.0)
    run.cycle(0.0)
    run.pose(0.0)
    assert not any(run.node.sent.values())
    answer = run.node.stop(None, Trigger.Response())
    assert (answer.success, answer.message) == (False, "no run has begun yet")


def test_a_pose_without_a_cycle_is_not_published(run: Run) -> None:
    run.begin()
    run.pose(0.0)
    assert not run.node.sent["head_pose"]
    assert not run.robot.commands.has_begun
    run.cycle(0.02)
    run.pose(0.02)
    assert run.robot.commands.has_begun
    (head,), (state,) = run.node.sent["head_pose"], run.node.sent["robot_joint_states"]
    assert (head.pose.position.x, head.pose.position.y) == (1.0, 2.0)
    assert list(state.position) == [0.1] * JOINTS
    assert "tf" not in run.node.sent["/tf"]


def test_diagnostics_have_the_time_of_the_node_and_come_each_second(run: Run) -> None:
    begun_s = run.node.now_s()
    run.begin()
    (first,) = run.diagnostics()
    stamp = first.header.stamp
    assert begun_s - 1e-3 <= stamp.sec + 1e-9 * stamp.nanosec <= run.node.now_s() + 1e-3
    assert first.status[-1].name == "pose"
    run.log.event(0.1, "start", "torque on")
    run.robot.step(0.0)
    assert len(run.diagnostics()) == 2, "an event is news"
    assert run.says()["snakewalk: run"].message == "torque on"


def test_each_servo_is_in_the_diagnostics_once_it_was_read(run: Run) -> None:
    run.begin()
    run.log.event(0.0, "start", "torque on")
    run.robot.step(0.0)
    assert not any("joint" in name or "yaw" in name for name in run.says())
    for time_s in (0.0, 0.02):
        run.cycle(time_s)
        run.pose(time_s)
    run.log.event(0.1, "waypoint", "waypoint 1 reached")
    run.robot.step(0.0)
    servos = [status for status in run.diagnostics()[-1].status if "ID" in status.hardware_id]
    assert len(servos) == JOINTS
    values = {value.key: float(value.value) for value in servos[0].values}
    assert values == {"temperature_c": 31.0, "voltage_v": 12.0}
    assert run.says()["snakewalk: cycle"].message == "late by 2.3 ms"


def test_events_are_logged_by_their_level_and_the_newest_is_in_the_diagnostics(run: Run) -> None:
    run.begin()
    for level, kind, text in (
        ("info", "start", "torque on"),
        ("info", "command", "joint goals"),
        ("info", "refused", "too far"),
        ("warning", "alarm", "slow"),
        ("error", "trip", "joint 7: hot"),
    ):
        run.log.event(0.0, kind, text, level=level)  # type: ignore[arg-type]
        run.robot.step(0.0)
    assert run.node.lines == [
        "info start: torque on",
        "info command: joint goals",
        "warning refused: too far",
        "warning alarm: slow",
        "error trip: joint 7: hot",
    ]
    heard = {
        (name, status.level, status.message)
        for told in run.diagnostics()
        for status in told.status
        for name in [status.name.removeprefix("snakewalk: ")]
    }
    ok, warning, error = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR
    assert heard >= {
        ("run", ok, "torque on"),
        ("commands", ok, "command: joint goals"),
        ("commands", warning, "refused: too far"),
        ("run", error, "joint 7: hot"),
    }


def test_a_run_that_ends_without_a_message_is_an_error(run: Run) -> None:
    run.begin()
    run.robot.end()
    assert run.says()["snakewalk: run"].message == "it has come to its end"
    with StopButton("test") as button:
        run.end.add("/button", json.dumps({"path": str(button.path)}).encode())
        run.robot.step(0.0)
        run.robot.end()
    said = run.says()["snakewalk: run"]
    assert said.message == "the run ended without a message; check that torque is off"
    assert said.level == DiagnosticStatus.ERROR


@pytest.mark.parametrize(("how", "is_done"), [("torque off", True), ("torque off failed", False)])
def test_the_stop_service_answers_with_the_end_of_the_run(
    run: Run, how: str, is_done: bool
) -> None:
    run.begin()
    with StopButton("test") as button:
        run.end.add("/button", json.dumps({"path": str(button.path)}).encode())
        run.robot.step(0.0)
        button.end(how)
        answer = run.node.stop(None, Trigger.Response())
    assert answer.success == is_done
    assert re.fullmatch(rf"{how}; after \d+ ms", answer.message)
