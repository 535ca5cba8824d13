"""Poses, velocities and goal poses between a run and a ROS graph, over DDS."""

import socket
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is in the extra ros, for Linux on x86-64")
pytest.importorskip("mujoco")

import rclpy
from geometry_msgs.msg import Point, Pose, PoseStamped, Twist, Vector3
from nav_msgs.msg import Odometry
from std_msgs.msg import Header

from snakewalk.controller.motion.commanded import Commanded
from snakewalk.controller.ros.command_codec import decode_command
from snakewalk.controller.ros.ros_link import RosLink
from snakewalk.controller.ros.ros_node import RobotNode, _make_node, _spinning
from snakewalk.controller.ros.ros_options import RosOptions
from snakewalk.controller.run.factory import prepare_commanded, prepare_job
from snakewalk.controller.run.observers import Observers
from snakewalk.controller.run.prepared_run import PreparedRun
from snakewalk.controller.run.request import RunRequest, RunResult
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.row_line import ObserverEnd, RunEnd
from tests.helpers.ros_client import DOMAIN, Client

pytestmark = pytest.mark.usefixtures("alone")


class Graph:
    """The node of a run, in the run's own process; ``script`` goes on once a cycle."""

    def __init__(self, **options: bool) -> None:

        ours, far = socket.socketpair()
        self._end = RunEnd(ours)
        self.on_row = self._end.add
        self.node = _make_node(RosOptions(DOMAIN, **options))
        self.robot = RobotNode(self.node, ObserverEnd(far), RosOptions(DOMAIN, **options))
        self.commands_of = RosLink.waypoint_commands

    def on_button(self, path: Path) -> None:
        self._end.add("/button", b'{"path": "%s"}' % str(path).encode())

    def on_picture(self, image: object, time_s: float) -> None:
        """It has none."""

    def commands(self) -> list[Any]:
        """Return the commands; on a busy machine they may wait for longer than on a robot."""
        return [decode_command(line, late_s=60.0) for line in self._end.commands()]

    def stop(self) -> None:
        self.robot._button.press("the test")  # type: ignore[union-attr]

    def run(
        self, folder: Path, prepared: PreparedRun, script: Iterator[None], **more: Any
    ) -> RunResult:
        def on_progress(progress: object) -> None:
            self.robot.step(0.0)
            if next(script, self) is self:
                self.stop()

        with _spinning(self.node, self.robot.commands.reject):
            finished = run_robot(
                RunRequest(
                    prepared, folder, observers=Observers(self), on_progress=on_progress, **more
                )
            )
            self._end.close(1.0)
            with suppress(EOFError):
                while True:
                    self.robot.step(1.0)
        return finished

    def close(self) -> None:
        self.node.destroy_node()
        rclpy.shutdown()


def commanded(graph: Graph, **keys: Any) -> PreparedRun:
    return prepare_commanded(
        lambda body, on_event: Commanded(body, body.joint_names, graph.commands, on_event),
        robot="yaw16",
        world="flat",
        seconds=60.0,
        name="ros",
        keys=keys,
    )


def texts(finished: RunResult, kind: str) -> list[str]:
    return [event.text for event in finished.record.events if event.kind == kind]


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(
    ("pose", "frame", "variance"),
    [("simulator", "world", 1e-6), ("joints", "odom", 1e6)],
)
def test_a_dead_reckoned_pose_is_never_published_as_measured(
    client: Client, tmp_path: Path, pose: str, frame: str, variance: float
) -> None:
    graph = Graph(commands=True)
    odometry = client.listen(Odometry, "/odom")
    poses = client.listen(PoseStamped, "/head_pose")

    def script() -> Iterator[None]:
        client.until(lambda: client.node.count_publishers("/odom"))
        while not (len(odometry) > 3 and poses):
            yield
            client.spin()

    finished = graph.run(tmp_path / "run", commanded(graph, **{"run.pose": pose}), script())
    graph.close()
    assert {each.header.frame_id for each in odometry + poses} == {frame}
    assert odometry[0].child_frame_id == "link0"
    covariance = np.array(odometry[0].pose.covariance).reshape(6, 6)
    assert covariance.diagonal() == pytest.approx(variance)
    assert odometry[0].twist.covariance[0] == pytest.approx(1e6)
    at = [(o.pose.pose.position.x, o.pose.pose.position.y) for o in odometry]
    logged = finished.record.pose.head_m[:, None, :2]
    assert np.abs(np.array(at) - logged).max(axis=2).min(axis=0).max() < 1e-9


@pytest.mark.slow
def test_velocities_move_the_body_and_stop_it_when_they_are_stale(
    client: Client, tmp_path: Path
) -> None:
    graph = Graph(commands=True)
    velocities = client.node.create_publisher(Twist, "/cmd_vel", 10)

    def send(x: float, turn: float = 0.0, y: float = 0.0) -> None:
        velocities.publish(Twist(linear=Vector3(x=x, y=y), angular=Vector3(z=turn)))
        client.until(lambda: graph.robot.commands.pending)

    def script() -> Iterator[None]:
        client.until(velocities.get_subscription_count)
        while not graph.robot.commands.has_begun:
            yield
        for args in ((np.nan,), (1e3,), (0.05, 0.0, 0.1)):
            send(*args)
            for _ in range(5):
                yield
        for k in range(250):
            if k % 20 == 0:
                send(0.1)
            yield
        for _ in range(140):
            yield

    finished = graph.run(tmp_path / "run", commanded(graph), script())
    graph.close()
    assert [text.split(";")[0] for text in texts(finished, "refused")] == [
        "velocity: not a number",
        "velocity: 1e+03 m/s",
        "velocity: linear.y is not 0",
    ]
    assert texts(finished, "stale") == ["no velocity for 1 s: the body comes to rest"]
    sent = finished.record.cycle.sent_rad
    assert np.ptp(sent[-50:], axis=0).max() < 1e-3
    moved_m = finished.record.pose.head_m[-1] - finished.record.pose.head_m[0]
    assert moved_m[0] > 0.1


@pytest.mark.slow
def test_a_goal_pose_leads_a_live_run_elsewhere(client: Client, tmp_path: Path) -> None:
    graph = Graph(goals=True)
    goals = client.node.create_publisher(PoseStamped, "/goal_pose", 10)

    def send(frame: str, x: float, y: float) -> None:
        pose = Pose(position=Point(x=x, y=y))
        goals.publish(PoseStamped(header=Header(frame_id=frame), pose=pose))
        client.until(lambda: graph.robot.commands.pending)

    def script() -> Iterator[None]:
        client.until(goals.get_subscription_count)
        while not graph.robot.commands.has_begun:
            yield
        for _ in range(60):  # it goes to its first shape
            yield
        for args in (("map", 1.0, 0.0), ("world", np.nan, 0.0), ("world", 1e9, 0.0)):
            send(*args)
            for _ in range(5):
                yield
        send("world", 1.5, -0.5)
        for _ in range(10):
            yield

    prepared = prepare_job("flat-slalom", motion="serpenoid")
    finished = graph.run(
        tmp_path / "run",
        prepared,
        script(),
        waypoint_commands=lambda: graph.commands_of(graph),  # type: ignore[arg-type]
    )
    graph.close()
    refused = texts(finished, "refused")
    assert refused[0].startswith("goal pose: frame 'map'; this run's poses have the frame 'world'")
    assert refused[1] == "goal pose: x or y is not a number"
    assert "is outside the world" in refused[2]
    (said,) = texts(finished, "operator")
    assert said.startswith("waypoint 1 at (1.50, -0.50); waypoints left out: ")
    assert finished.record.paths[-1][1][-1][:2] == pytest.approx([1.5, -0.5], abs=0.05)
