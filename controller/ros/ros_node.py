"""The process that is a run's ROS node: rows of the log in, topics out, and the stop service."""

import array
import json
import signal
import socket
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions

from snakewalk.config.arrays import Floats
from snakewalk.config.ros import RosConfig
from snakewalk.controller.exchange.ros_messages import (
    DIAGNOSTICS,
    ERROR,
    FRAMES,
    HEAD_POSE,
    IMU,
    JOINT_GOALS,
    JOINT_STATES,
    ODOMETRY,
    OK,
    PATH,
    TYPES,
    WARNING,
    RosMessages,
    Row,
    pose_frame,
)
from snakewalk.controller.metrics.verdict import NOT_MEASURED, RunVerdict
from snakewalk.controller.ros.clock_offset import ClockOffset
from snakewalk.controller.ros.command_codec import encode_command
from snakewalk.controller.ros.ros_commands import QUEUE, CommandTopics, in_words, message_type
from snakewalk.controller.ros.ros_options import RosOptions
from snakewalk.controller.runlog.record import Header, RunRecord
from snakewalk.controller.runlog.row_line import BUTTON, VERDICT, ObserverEnd
from snakewalk.controller.runlog.tables import record_of
from snakewalk.controller.runlog.topics import (
    ConfigTable,
    CycleTable,
    EventTable,
    PoseSourceTable,
    PoseTable,
    SlowTable,
)
from snakewalk.drivers.clock import WallClock
from snakewalk.drivers.safety.stop_button import PressedButton

NAME = "snakewalk"
_CYCLE = CycleTable.topic.name
_SLOW_TOPIC = SlowTable.topic.name
_POSE_SOURCE = PoseSourceTable.topic.name
_STEP_S = 0.05
_DIAGNOSTICS_S = 1.0
_OFFSET_SPAN_S = 2.0
_STOP_S = 1.0
"""Longest wait of the stop service for the run to confirm that torque is off."""
_POLL_S = 1e-3
_LAST_MESSAGES_S = 0.2
"""Time for the last messages to leave."""
_RUN = "run"
_LEVELS = {0: OK, NOT_MEASURED: WARNING}
"""Diagnostic level of a run by its exit code."""
_LATCHED_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_TOPICS = {
    JOINT_STATES: ("robot_joint_states", QUEUE),
    JOINT_GOALS: ("robot_joint_goals", QUEUE),
    HEAD_POSE: ("head_pose", QUEUE),
    ODOMETRY: ("odom", QUEUE),
    FRAMES: (FRAMES, QUEUE),
    IMU: ("imu", QUEUE),
    PATH: ("path", _LATCHED_QOS),
    DIAGNOSTICS: (DIAGNOSTICS, QUEUE),
}
"""Topic of a bag to name and quality of service of a node's; all nodes share the absolute names."""


def serve(line: socket.socket, options: RosOptions) -> None:
    """Be the node until the run closes the line."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        node = _make_node(options)
    except Exception as fault:  # rclpy's own, or of whatever middleware the environment names
        rclpy.try_shutdown()
        text = " ".join(str(fault).split())
        line.sendall(json.dumps({"fault": text or type(fault).__name__}).encode() + b"\n")
        return
    domain = node.context.get_domain_id()
    hello = {"name": node.get_fully_qualified_name(), "domain": domain}
    line.sendall(json.dumps(hello).encode() + b"\n")
    robot = RobotNode(node, ObserverEnd(line), options)
    with _spinning(node, robot.commands.reject):
        with suppress(EOFError):
            while True:
                try:
                    robot.step(_STEP_S)
                except EOFError:
                    raise
                except Exception as fault:  # the stop service stays
                    robot.commands.reject(f"a row of the run: {in_words(fault)}")
        robot.end()
    node.destroy_node()
    rclpy.shutdown()


def _make_node(options: RosOptions) -> Node:
    # the run prints its own events; here they go to /rosout alone
    quiet = ["--ros-args", "--disable-stdout-logs", "--disable-external-lib-logs"]
    rclpy.init(
        args=quiet,
        domain_id=options.domain,
        signal_handler_options=SignalHandlerOptions.NO,
    )
    return Node(NAME, namespace=options.namespace)


@contextmanager
def _spinning(node: Node, reject: Callable[[str], None]) -> Iterator[None]:
    """Let a thread serve messages and calls; a message that cannot be read does not end it."""
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    is_over = threading.Event()

    def spin() -> None:
        while not is_over.is_set():
            try:
                executor.spin()
            except ExternalShutdownException:
                return
            except Exception as fault:  # rclpy's own, of text that is not UTF-8 for one
                reject(f"a message: {in_words(fault)}")

    thread = threading.Thread(target=spin, daemon=True)
    thread.start()
    try:
        yield
    finally:
        is_over.set()
        executor.shutdown()
        thread.join()


class RobotNode:
    """Topics and services of one run."""

    def __init__(self, node: Node, end: ObserverEnd, options: RosOptions) -> None:
        self._node = node
        self._end = end
        self._options = options
        self._clock = WallClock()
        self._offset = ClockOffset(_OFFSET_SPAN_S)
        self._messages = RosMessages(
            _message, _doubles, lambda value: bytes([value]), self._offset.local_s
        )
        self._publishers: dict[str, Any] = {}
        self._header: Header | None = None
        self._newest: dict[str, Mapping[str, Any]] = {}
        self._tf = "none"
        self._button: PressedButton | None = None
        self._told_s = -_DIAGNOSTICS_S
        self._said: dict[str, tuple[int, str]] = {}
        self._verdict: dict[str, str] = {}
        self.commands = CommandTopics(node, options)
        node.create_service(message_type("std_srvs/srv/Trigger"), "~/stop", self._stop)

    def step(self, wait_s: float) -> None:
        """Read the rows that have come, publish them, and pass the commands to the run."""
        for topic, row in self._end.rows(wait_s):
            self._store_row(topic, row)
            if topic == PoseTable.topic.name:
                self._publish_cycle()
                self._send()
        self._publish_diagnostics()

    def end(self) -> None:
        """Say how the run ended."""
        if self._button is not None and self._button.end is None:
            self._said[_RUN] = ERROR, "the run ended without a message; check that torque is off"
        elif not self._verdict and self._said.get(_RUN, (OK, ""))[0] == OK:
            self._said[_RUN] = OK, "it has come to its end"
        self._told_s = -_DIAGNOSTICS_S
        self._publish_diagnostics()
        self._clock.sleep_until_s(self._clock.now_s() + _LAST_MESSAGES_S)

    def _store_row(self, topic: str, row: Mapping[str, Any]) -> None:
        if topic == BUTTON:
            self._button = PressedButton(Path(row["path"]))
        elif topic == ConfigTable.topic.name:
            self._begin(record_of({topic: [row]}, complete=False, note=""))
        elif topic == PATH:
            self._publish(self._messages.paths(self._record({topic: [row]})), skip=1)
        elif topic == EventTable.topic.name:
            self._log_event(row)
        elif topic == VERDICT:
            verdict = RunVerdict(**row)
            self._said[_RUN] = _LEVELS.get(verdict.exit_code, ERROR), verdict.text
            self._verdict = {key: str(value) for key, value in row.items() if value is not None}
        else:
            self._newest[topic] = row

    def _begin(self, record: RunRecord) -> None:
        self._header = record.header
        self.commands.frame = pose_frame(record.header)
        self._tf = (record.header.robot.ros or RosConfig()).tf
        if self._tf != "none" and find_spec("tf2_msgs") is None:
            self._tf = "none"
            self._said["tf"] = WARNING, "tf2_msgs is not installed: /tf is not published"
        frames = () if self._tf == "none" else (FRAMES,)
        for topic in (JOINT_STATES, JOINT_GOALS, HEAD_POSE, ODOMETRY, *frames, DIAGNOSTICS):
            self._publisher(topic)  # others find them before the first cycle
        self._end.ask()
        if record.header.run.waypoints_m:
            self._publish(self._messages.paths(record))

    def _publish_cycle(self) -> None:
        rows, self._newest = (
            self._newest,
            {k: v for k, v in self._newest.items() if k == _SLOW_TOPIC},
        )
        if self._header is None or _CYCLE not in rows:
            return
        self.commands.has_begun = True
        self._offset.delay_s(rows[_CYCLE]["time_s"], self._ros_now_s())
        record = self._record({topic: [row] for topic, row in rows.items()})
        self._publish(self._messages.joints(record))
        self._publish(self._messages.head_poses(record))
        self._publish(self._messages.odometry(record, *self._deviations(rows.get(_POSE_SOURCE))))
        if self._tf != "none" and len(record.pose.time_s):
            self._publish(self._messages.transforms(record, links=self._tf == "links"))
        self._publish(self._messages.imu(record))
        self._said["cycle"] = OK, f"late by {1e3 * rows[_CYCLE]['lateness_s']:.1f} ms"

    def _deviations(self, source: Mapping[str, Any] | None) -> tuple[float | None, float | None]:
        """Return the standard deviations of position and heading of a cycle; None: unknown."""
        assert self._header is not None
        evidence = self._header.pose_evidence
        if source is None:
            return evidence.position_m, evidence.heading_rad
        if source["fault"]:
            return None, None
        return source["position_sd_m"], source["heading_sd_rad"]

    def _record(self, rows: Mapping[str, list[Mapping[str, Any]]]) -> RunRecord:
        return record_of(rows, complete=False, note="", header=self._header)

    def _publish(self, rows: Iterator[Row], skip: int = 0) -> None:
        for number, row in enumerate(rows):
            if number >= skip:
                self._publisher(row.topic).publish(row.message)

    def _publisher(self, topic: str) -> Any:
        if topic not in self._publishers:
            name, quality = _TOPICS[topic]
            kind = TYPES[topic]
            self._publishers[topic] = self._node.create_publisher(message_type(kind), name, quality)
        return self._publishers[topic]

    def _publish_diagnostics(self) -> None:
        now_s = self._clock.now_s()
        if self._header is None or now_s - self._told_s < _DIAGNOSTICS_S:
            return
        self._told_s = now_s
        ros_s = self._ros_now_s()
        run_s = ros_s - self._offset.local_s(0.0)
        status = [
            self._messages.status(f"{NAME}: {name}", level, text, self._header.robot.name, values)
            for name, (level, text) in self._said.items()
            for values in (self._verdict if name == _RUN else {},)
        ]
        status.append(self._messages.pose_status(self._header))
        if _SLOW_TOPIC in self._newest:
            status += self._messages.servos(
                self._record({_SLOW_TOPIC: [self._newest[_SLOW_TOPIC]]}), 0
            )
        self._publisher(DIAGNOSTICS).publish(self._messages.diagnostics(run_s, status).message)

    def _log_event(self, row: Mapping[str, Any]) -> None:
        kind = row["kind"]
        text = row["text"]
        log = self._node.get_logger()
        if row["level"] == "error":
            log.error(f"{kind}: {text}")
        elif row["level"] == "warning" or kind in ("refused", "stale"):
            log.warning(f"{kind}: {text}")
        else:
            log.info(f"{kind}: {text}")
        if kind in ("command", "refused", "stale"):
            self._said["commands"] = OK if kind == "command" else WARNING, f"{kind}: {text}"
        elif kind in ("trip", "interrupt"):
            self._said[_RUN] = ERROR, text
        elif kind == "start":
            self._said[_RUN] = OK, text
        self._told_s = -_DIAGNOSTICS_S

    def _send(self) -> None:
        """Send the commands since the last cycle, and ask for the next rows."""
        for command in self.commands.take():
            self._end.command(encode_command(command))
        self._end.ask()

    def _ros_now_s(self) -> float:
        return float(self._node.get_clock().now().nanoseconds) * 1e-9

    def _stop(self, request: Any, response: Any) -> Any:
        """Press the run's stop button, and answer when torque is off."""
        button = self._button
        if button is None:
            response.success = False
            response.message = "no run has begun yet"
            return response
        began_s = self._clock.now_s()
        button.press(f"ROS service {self._node.get_fully_qualified_name()}/stop")
        while button.end is None and self._clock.now_s() < began_s + _STOP_S:
            self._clock.sleep_until_s(self._clock.now_s() + _POLL_S)
        after_ms = 1e3 * (self._clock.now_s() - began_s)
        said = button.end
        response.success = said is not None and "torque off failed" not in said
        response.message = (
            f"requested; the run has not answered in {_STOP_S:g} s: switch the supply off"
            if said is None
            else f"{said}; after {after_ms:.0f} ms"
        )
        return response


def _doubles(values: Floats) -> Any:
    return array.array("d", np.ascontiguousarray(values, dtype=float).tobytes())


def _message(kind: str, fields: Mapping[str, Any]) -> Any:
    return message_type(kind)(**fields)
