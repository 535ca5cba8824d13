"""A run in a ROS graph: told, commanded and stopped by rclpy, and by a DDS of other people."""

import json
import math
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is in the extra ros, for Linux on x86-64")
pytest.importorskip("mujoco")

import rclpy
from builtin_interfaces.msg import Duration, Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path as PathMessage
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Header, String
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, load_run, load_world
from snakewalk.controller.motion.command import HoldStill, Refused, StartGait
from snakewalk.controller.motion.commanded import Commanded
from snakewalk.controller.ros import ros_commands
from snakewalk.controller.ros.clock_offset import ClockOffset
from snakewalk.controller.ros.command_codec import decode_command
from snakewalk.controller.ros.ros_node import (
    RobotNode,
    _make_node,
    _spinning,
    serve,
)
from snakewalk.controller.ros.ros_options import RosOptions
from snakewalk.controller.run.factory import prepare_commanded
from snakewalk.controller.run.observers import Observers
from snakewalk.controller.run.request import RunRequest, RunResult
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.evidence import SIMULATED
from snakewalk.controller.runlog.record import Header as LogHeader
from snakewalk.controller.runlog.record import PlanSummary
from snakewalk.controller.runlog.row_line import ObserverEnd, RunEnd
from snakewalk.controller.runlog.topics import PathTable
from snakewalk.controller.runlog.writer import RunLog
from snakewalk.controller.runtime.drive import Progress
from snakewalk.sim.serve.servo_bus import ServoBus
from tests.helpers.bus import PATIENT
from tests.helpers.ros_client import DOMAIN, Client

COMMAND = "from snakewalk.controller.cli.main import main; main()"
ROBOT = 'name = "quartet"\njoint_axes = "yyyy"\nyaw_limit_rad = 1.4\n'


pytestmark = pytest.mark.usefixtures("alone")


class Graph:
    """The node of a run, in the run's own process; ``script`` goes on once a cycle."""

    def __init__(self) -> None:
        self.options = RosOptions(DOMAIN, commands=True)
        ours, far = socket.socketpair()
        self._end = RunEnd(ours)
        self.on_row = self._end.add
        self.node = _make_node(self.options)
        self.robot = RobotNode(self.node, ObserverEnd(far), self.options)
        self.cycles = 0

    def on_button(self, path: Path) -> None:
        self._end.add("/button", b'{"path": "%s"}' % str(path).encode())

    def on_picture(self, image: object, time_s: float) -> None:
        """It has none."""

    def commands(self) -> list[Any]:
        """Return the commands of the node at any age: a busy machine delays them."""

        def decoded(line: str) -> Any:
            try:
                return decode_command(line, late_s=math.inf)
            except InputError as error:
                return Refused(error.faults[0])

        return [decoded(line) for line in self._end.commands()]

    def run(
        self,
        folder: Path,
        script: Iterator[None],
        robot: str = "yaw16",
        port: str | None = None,
        keys: dict[str, object] | None = None,
    ) -> RunResult:
        def on_progress(progress: Progress) -> None:
            self.cycles += 1
            self.robot.step(0.0)
            next(script, None)

        prepared = prepare_commanded(
            lambda body, on_event: Commanded(body, body.joint_names, self.commands, on_event),
            robot=robot,
            seconds=20.0,
            name="ros",
            keys=keys,
        )
        with _spinning(self.node, self.robot.commands.reject):
            finished = run_robot(
                RunRequest(
                    prepared, folder, port, observers=Observers(self), on_progress=on_progress
                )
            )
            self._end.close(1.0)
            with suppress(EOFError):
                while True:
                    self.robot.step(1.0)
            self.robot.end()
        return finished


@pytest.fixture
def graph() -> Iterator[Graph]:
    made = Graph()
    yield made
    made.node.destroy_node()
    rclpy.shutdown()


@pytest.fixture
def unhurried(monkeypatch: pytest.MonkeyPatch) -> None:
    """Messages have no delay, which a busy machine or messages of megabytes cause."""
    monkeypatch.setattr(ros_commands, "LATE_S", math.inf)


def point(time_s: float, *angles: float, **more: Any) -> JointTrajectoryPoint:
    seconds, part = divmod(time_s, 1.0)
    duration = Duration(sec=int(seconds), nanosec=round(part * 1e9))
    return JointTrajectoryPoint(positions=angles, time_from_start=duration, **more)


@pytest.mark.slow
@pytest.mark.usefixtures("unhurried")
def test_a_run_is_told_commanded_and_stopped(graph: Graph, client: Client, tmp_path: Path) -> None:
    states = client.listen(JointState, "/robot_joint_states")
    sent = client.listen(JointState, "/robot_joint_goals")
    told = client.listen(DiagnosticArray, "/diagnostics")
    poses = client.listen(PoseStamped, "/head_pose")
    goals = client.node.create_publisher(JointState, "/robot_joint_command", 10)
    trajectories = client.node.create_publisher(JointTrajectory, "/robot_joint_trajectory", 10)
    gaits = client.node.create_publisher(String, "/robot_gait", 10)
    stop = client.node.create_client(Trigger, "/snakewalk/stop")
    answers: list[Any] = []
    stopped: list[int] = []

    def arrived() -> None:
        client.until(lambda: graph.robot.commands.pending)

    def says(text: str) -> bool:
        return any(text in status.message for one in told for status in one.status)

    def newest() -> dict[str, float]:
        return dict(zip(states[-1].name, states[-1].position, strict=True))

    def script() -> Iterator[None]:
        client.until(lambda: stop.service_is_ready() and gaits.get_subscription_count())
        client.until(goals.get_subscription_count)
        client.until(trajectories.get_subscription_count)
        topics = ("robot_joint_states", "robot_joint_goals", "head_pose", "diagnostics")
        client.until(lambda: all(client.node.count_publishers(f"/{each}") for each in topics))
        while not (states and sent and poses):
            yield
            client.spin()
        while newest()["yaw_04"] < 0.45:
            if graph.cycles % 20 == 0:
                goals.publish(JointState(name=["joint3"], position=[0.5]))
                arrived()
            yield
            client.spin()
        for message in (
            JointState(name=["joint3"], position=[9.0]),
            JointState(name=["joint3"], effort=[0.1]),
            JointState(header=Header(stamp=Time(sec=12)), name=["joint3"], position=[0.1]),
        ):
            goals.publish(message)
            arrived()
            yield
        many = JointTrajectory(
            joint_names=["joint0"], points=[point(k + 1, 0.0) for k in range(501)]
        )
        uneven = JointTrajectory(joint_names=["joint0"], points=[point(1, 0.1), point(2)])
        blank = JointTrajectory(joint_names=["joint0"], points=[point(1)])
        good = JointTrajectory(
            joint_names=["joint0", "joint1"],
            points=[point(0.5, 0.1, 0.2, velocities=[0.0, 0.0])],
        )
        for message in (many, uneven, blank, good):
            trajectories.publish(message)
            arrived()
            yield
        for _ in range(30):
            yield
        client.until(lambda: newest()["yaw_02"] > 0.15)
        for text in ("rolling", "lateral-undulation frequency_hz", "x.toml", "", "anguilliform"):
            gaits.publish(String(data=text))
            arrived()
            yield
        for _ in range(10):
            yield
        client.until(lambda: says("gait anguilliform"))
        answers.append(stop.call_async(Trigger.Request()))
        client.until(lambda: graph.robot._button._map[0])  # type: ignore[union-attr]
        stopped.append(graph.cycles)

    finished = graph.run(tmp_path / "run", script())
    client.until(answers[0].done)
    assert finished.outcome.tripped == "stop requested by ROS service /snakewalk/stop"
    assert graph.cycles - stopped[0] <= 2
    answer = answers[0].result()
    assert answer.success
    assert answer.message.startswith("stop requested by ROS service /snakewalk/stop; after ")
    client.until(lambda: says("stop requested by ROS service"))
    client.until(lambda: says(finished.verdict.text))
    refused = [event.text for event in finished.record.events if event.kind == "refused"]
    for text, why in zip(
        [
            "joint goals: yaw_04: 9.00 rad; its limit is 1.50",
            "joint goals: no positions; velocities and efforts alone are not accepted",
            r"joint goals: stamped \d+.\d s ago; at most 1 s is taken, and 0 for now",
            "trajectory: 501 points; 1 to 500 are accepted",
            "trajectory: its points have different numbers of values",
            "trajectory: its points have no positions",
            "gait rolling needs pitch joints; robot yaw16 has none.*",
            "gait: frequency_hz: expected PARAM=VALUE",
            "gait: x.toml: no such gait; snakewalk gait list",
        ],
        refused,
        strict=True,
    ):
        assert re.fullmatch(text, why)
    # what was told is what was logged
    cycle = finished.record.cycle
    constant = finished.record.header.torque_constant_n_m_a
    for heard, field, logged in (
        (states, "position", cycle.measured_rad),
        (states, "velocity", cycle.velocity_rad_s),
        (states, "effort", cycle.current_a * constant),
        (sent, "position", cycle.sent_rad),
    ):
        values = np.array([getattr(each, field) for each in heard])
        assert len(values) > 20  # the simulator is faster than real time: not every one comes
        assert np.abs(values[:, None] - logged).max(axis=2).min(axis=1).max() < 1e-9
    heads_m = np.array([(p.pose.position.x, p.pose.position.y, p.pose.position.z) for p in poses])
    assert (
        np.abs(heads_m[:, None] - finished.record.pose.head_m).max(axis=2).min(axis=1).max() < 1e-9
    )
    stamps_ns = np.array([s.header.stamp.sec * 10**9 + s.header.stamp.nanosec for s in states])
    assert (np.diff(stamps_ns) >= 0).all()
    servos = [status for status in told[-1].status if status.name == "yaw_16"]
    assert servos[0].hardware_id == "XM430-W350 ID 16"
    assert {value.key for value in servos[0].values} == {"temperature_c", "voltage_v"}


@pytest.mark.usefixtures("unhurried")
def test_a_dds_of_other_people_sees_the_run_and_commands_it(graph: Graph, tmp_path: Path) -> None:
    rosless = pytest.importorskip("rosless")
    theirs = rosless.Node(domain=DOMAIN)
    states = theirs.subscribe("/robot_joint_states", "sensor_msgs/msg/JointState")
    imu = theirs.subscribe("/imu", "sensor_msgs/msg/Imu")
    goals = theirs.advertise("/robot_joint_command", "sensor_msgs/msg/JointState")
    seen: list[Any] = []

    def script() -> Iterator[None]:
        for _ in range(400):
            state = states.read(timeout=0.05)
            seen.extend([] if state is None else [state])
            if state is not None and state.position[2] > 0.25:
                return
            goal = rosless.Message("sensor_msgs/msg/JointState", name=["joint2"], position=[0.3])
            goals.send(goal)
            yield

    finished = graph.run(tmp_path / "run", _then_stop(graph, script()), "alternating16-imu")
    assert finished.outcome.tripped == "stop requested by the test"
    assert seen[-1].position[2] > 0.25
    assert list(seen[-1].name) == list(load_robot("alternating16").joint_names)
    assert len(seen[-1].velocity) == len(seen[-1].effort) == 16
    attitude = imu.read(timeout=60.0)
    assert attitude.header.frame_id.startswith("link")


def _then_stop(graph: Graph, script: Iterator[None]) -> Iterator[None]:
    yield from script
    graph.robot._button.press("the test")  # type: ignore[union-attr]


def test_the_path_in_force_waits_for_whoever_comes_late(
    graph: Graph, client: Client, tmp_path: Path
) -> None:
    run, robot, world = load_run("flat-square"), load_robot("yaw16"), load_world("flat")
    plan = PlanSummary(np.array([[0.0, 0.0], [2.0, 1.0]]), np.array([[2.0, 1.0]]), 0.3)
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    with RunLog(tmp_path / "log.mcap", graph.on_row) as log:
        log.config(LogHeader(run, robot, world, backend="sim", plan=plan, pose_evidence=SIMULATED))
        graph.robot.step(1.0)
        heard = client.listen(PathMessage, "/path", latched)
        client.until(lambda: heard)
        assert [pose.pose.position.x for pose in heard[0].poses] == [0.0, 2.0]
        log.add(PathTable, 0.2, points_m=[[0.0, 1.0, 0.5], [2.0, 2.0, 0.4], [3.0, 2.0, 0.4]])
        graph.robot.step(1.0)
        client.until(lambda: len(heard) == 2)
    assert [pose.pose.position.y for pose in heard[1].poses] == [1.0, 2.0, 2.0]
    assert heard[1].header.frame_id == "world"


def test_nothing_is_taken_before_the_run_has_begun(graph: Graph, client: Client) -> None:
    stop = client.node.create_client(Trigger, "/snakewalk/stop")
    goals = client.node.create_publisher(JointState, "/robot_joint_command", 10)
    with _spinning(graph.node, graph.robot.commands.reject):
        client.until(lambda: stop.service_is_ready() and goals.get_subscription_count())
        answer = stop.call_async(Trigger.Request())
        goals.publish(JointState(name=["joint0"], position=[0.1]))
        client.until(lambda: answer.done() and graph.robot.commands.pending)
    assert not answer.result().success
    assert answer.result().message == "no run has begun yet"
    assert graph.robot.commands.pending[0].why == "joint goals: the run has not begun"


def test_of_goals_of_the_same_joints_the_newest_waits_for_the_run(graph: Graph) -> None:
    graph.robot.commands.has_begun = True
    for k in range(100):
        graph.robot.commands.on_goals(JointState(name=["joint0"], position=[0.01 * k]))
    graph.robot.commands.on_gait(String(data=""))
    for k in range(100):
        graph.robot.commands.on_goals(JointState(name=[f"joint{k % 2}"], position=[0.3]))
    waiting = list(graph.robot.commands.pending)
    assert len(waiting) == 16  # joints in turn are not the same
    graph.robot.commands.pending.clear()
    for k in range(100):
        graph.robot.commands.on_goals(JointState(name=["joint0"], position=[0.01 * k]))
    assert [list(each.position_rad) for each in graph.robot.commands.pending] == [[0.99]]


def test_a_command_that_waited_in_the_network_is_dropped_but_a_halt_is_not(
    graph: Graph, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Clocks of the publisher and of this machine differ by an hour."""
    commands = graph.robot.commands
    commands.has_begun = True
    now_s = [50.0]
    monkeypatch.setattr("time.monotonic", lambda: now_s[0])
    taken = commands._guarded_callback("robot_gait", commands.on_gait)

    def send(text: str, sent_s: float) -> Any:
        taken(String(data=text), {"source_timestamp": int(1e9 * (3600.0 + sent_s))})
        return commands.take()[-1]

    assert isinstance(send("lateral-undulation", 49.9), StartGait)
    now_s[0] = 70.0
    assert send("rolling", 54.0) == Refused(
        "gait: came 15.9 s late and is dropped; at most 1 s is accepted; send it again"
    )
    assert send("", 54.0) == HoldStill()
    assert isinstance(send("rolling", 69.5), StartGait)


def test_rows_that_come_late_by_chance_do_not_shift_the_stamps() -> None:
    offset = ClockOffset(span_s=2.0)
    for k in range(200):
        run_s = 0.02 * k
        offset.delay_s(run_s, 1000.0 + run_s + (0.001 if k % 10 == 0 else 0.03))
    assert offset.local_s(4.0) == pytest.approx(1004.001)
    for k in range(200, 400):  # a simulated run that does not keep its pace
        offset.delay_s(0.02 * k, 1000.5 + 0.02 * k)
    assert offset.local_s(8.0) == pytest.approx(1008.5)


def test_this_machine_alone_unless_somebody_says_otherwise() -> None:
    name = "ROS_AUTOMATIC_DISCOVERY_RANGE"
    assert RosOptions().environ({}) == {name: "LOCALHOST"}
    assert RosOptions().environ({name: "SUBNET"}) == {}
    assert RosOptions().environ({"ROS_STATIC_PEERS": "10.0.0.7"}) == {}
    assert RosOptions(network=True).environ({name: "LOCALHOST"}) == {name: "SUBNET"}


def test_what_the_middleware_says_is_told_in_a_line() -> None:
    ours, far = socket.socketpair()
    handler = signal.getsignal(signal.SIGINT)
    serve(far, RosOptions(DOMAIN, namespace="no good/"))
    signal.signal(signal.SIGINT, handler)
    said = json.loads(ours.makefile("rb").readline())
    assert "namespace" in said["fault"]
    assert "\n" not in said["fault"]


@pytest.mark.nightly("starts the node: 5 s of CPU")
@pytest.mark.usefixtures("unhurried")
def test_no_message_ends_the_run_or_silences_the_stop_service(
    graph: Graph, client: Client, tmp_path: Path
) -> None:
    goals = client.node.create_publisher(JointState, "/robot_joint_command", 10)
    trajectories = client.node.create_publisher(JointTrajectory, "/robot_joint_trajectory", 10)
    gaits = client.node.create_publisher(String, "/robot_gait", 10)
    stop = client.node.create_client(Trigger, "/snakewalk/stop")
    names = [f"joint{k}" for k in range(75_000)]
    soon = client.node.get_clock().now().nanoseconds // 10**9 + 1000
    no_text = b"\0\1\0\0" + (2).to_bytes(4, "little") + b"\xff\0"
    nested = "rolling frequency_hz=" + "[" * 100_000
    hostile = [
        (goals, JointState(name=names, position=[0.0] * len(names)), "names 75000 joints"),
        (goals, JointState(name=[], position=[0.0] * len(names)), "names 0 joints"),
        (goals, JointState(name=["x" * 2_000_000], position=[0.0]), "MB; at most 1.0 MB"),
        (goals, JointState(name=["joint0"], position=[np.nan]), "nan is not a number"),
        (goals, JointState(name=["joint0"] * 2, position=[0.1, -0.1]), "names a joint twice"),
        (goals, JointState(name=["joint0"], position=[0.1, 0.2]), "1 names and 2 positions"),
        (
            goals,
            JointState(header=Header(stamp=Time(sec=soon)), name=["joint0"], position=[0.1]),
            r"s ahead; at most 1 s",
        ),
        (
            trajectories,
            JointTrajectory(joint_names=names, points=[point(1.0, *[0.0] * len(names))]),
            "trajectory: names 75000 joints",
        ),
        (
            trajectories,
            JointTrajectory(joint_names=["joint0"], points=[point(1.0, *[0.0] * 100_000)] * 100),
            "trajectory: .* MB; at most 1.0 MB",
        ),
        (
            trajectories,
            JointTrajectory(joint_names=["joint0"], points=[point(1.0, np.nan)]),
            "nan is not a number",
        ),
        (
            trajectories,
            JointTrajectory(joint_names=["joint0"] * 2, points=[point(1.0, 0.1, 0.2)]),
            "names a joint twice",
        ),
        (gaits, String(data="x" * 2_000_000), "no such gait"),
        (gaits, String(data=nested), "gait|frequency_hz"),
        (gaits, String(data="rolling frequency_hz=nan"), "frequency_hz"),
        (gaits, String(data="rolling frequency_hz=0.2 frequency_hz=0.4"), "is given twice"),
        (gaits, no_text, "no such gait"),
    ]
    answers: list[Any] = []

    def script() -> Iterator[None]:
        client.until(lambda: stop.service_is_ready() and gaits.get_subscription_count())
        client.until(goals.get_subscription_count)
        client.until(trajectories.get_subscription_count)
        while not graph.robot.commands.has_begun:
            yield
        for publisher, message, _ in hostile:
            publisher.publish(message)
            client.until(lambda: graph.robot.commands.pending)
            yield
            for _ in range(10):  # so that no line is left out
                yield
        for _ in range(1000):
            goals.publish(JointState(name=["x" * 10_000] * 200, position=[0.0] * 200))
        answers.append(stop.call_async(Trigger.Request()))
        client.until(lambda: graph.robot._button._map[0])  # type: ignore[union-attr]

    finished = graph.run(tmp_path / "run", script())
    client.until(answers[0].done)
    assert answers[0].result().success
    assert finished.outcome.tripped == "stop requested by ROS service /snakewalk/stop"
    refused = [event.text for event in finished.record.events if event.kind == "refused"]
    for (_, _, why), text in zip(hostile, refused, strict=False):
        assert re.search(why, text), text
        assert len(text) <= 300
        assert text.isprintable()
    assert len(hostile) <= len(refused) <= len(hostile) + 2
    assert np.abs(finished.record.cycle.sent_rad).max() == 0.0


@pytest.mark.usefixtures("unhurried")
def test_servos_on_a_port_are_moved_and_switched_off(
    graph: Graph, client: Client, servo_bus: Callable[..., ServoBus], tmp_path: Path
) -> None:
    bus = servo_bus("1-4")
    (tmp_path / "quartet.toml").write_text(ROBOT)
    states = client.listen(JointState, "/robot_joint_states")
    goals = client.node.create_publisher(JointState, "/robot_joint_command", 10)
    stop = client.node.create_client(Trigger, "/snakewalk/stop")
    answers: list[Any] = []

    def script() -> Iterator[None]:
        while not (states and goals.get_subscription_count() and stop.service_is_ready()):
            yield
            client.spin()
        goals.publish(JointState(name=["joint1"], position=[0.4]))
        while states[-1].position[1] < 0.35:
            yield
            client.spin()
        assert bus["Torque Enable"].tolist() == [1] * 4
        answers.append(stop.call_async(Trigger.Request()))
        while True:
            yield

    robot = str(tmp_path / "quartet.toml")
    finished = graph.run(tmp_path / "run", script(), robot, port=bus.path, keys=PATIENT)
    client.until(answers[0].done)
    assert answers[0].result().success
    assert finished.outcome.tripped == "stop requested by ROS service /snakewalk/stop"
    assert bus["Torque Enable"].tolist() == [0] * 4
    assert bus["Goal Position"][1] - 2048 == pytest.approx(0.4 * 4096 / (2 * np.pi), abs=40)


@pytest.mark.nightly("starts the node and a served bus: 12 s of CPU")
def test_the_command_moves_servos_on_a_port_and_the_service_switches_them_off(
    servo_bus: Callable[..., ServoBus], client: Client, tmp_path: Path
) -> None:
    bus = servo_bus("1-4")
    (tmp_path / "quartet.toml").write_text(ROBOT)
    states = client.listen(JointState, "/snake/robot_joint_states")
    goals = client.node.create_publisher(JointState, "/snake/robot_joint_command", 10)
    stop = client.node.create_client(Trigger, "/snake/snakewalk/stop")
    words = ["ros", "--robot", "quartet.toml", "--port", bus.path, "--out", "run", "--json"]
    words += ["--domain", str(DOMAIN), "--namespace", "snake", "--seconds", "100"]
    words += [word for key, value in PATIENT.items() for word in ("--set", f"{key}={value}")]
    with subprocess.Popen(
        [sys.executable, "-c", COMMAND, *words],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    ) as child:
        try:
            assert child.stderr is not None
            said = child.stderr.readline()
            assert said == f"ROS: /snake/snakewalk in domain {DOMAIN}\n"
            client.until(lambda: states and goals.get_subscription_count())
            client.until(stop.service_is_ready)
            assert bus["Torque Enable"].tolist() == [1] * 4

            def moved() -> bool:
                goals.publish(JointState(name=["joint1"], position=[0.4]))
                return states[-1].position[1] > 0.35

            client.until(moved)
            assert bus["Present Position"][1] - 2048 == pytest.approx(
                0.4 * 4096 / 2 / np.pi, abs=40
            )
            answer = stop.call_async(Trigger.Request())
            client.until(answer.done)
            assert answer.result().success
            assert bus["Torque Enable"].tolist() == [0] * 4
            assert child.wait(600.0) == 1
        finally:
            child.kill()
