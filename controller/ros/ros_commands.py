"""Commands of a ROS graph: messages that are checked and kept until the run asks for them."""

import math
import threading
import time
from collections import deque
from collections.abc import Callable
from functools import cache
from importlib import import_module
from typing import Any

import numpy as np
from rclpy.node import Node
from rclpy.qos import QoSProfile

from snakewalk.config.archive import parse_json
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.motion.command import (
    JOINTS_MAX,
    LATE_S,
    POINTS_MAX,
    TIMEOUT_S,
    Command,
    GoTo,
    HoldStill,
    JointGoals,
    JointTrajectory,
    Refused,
    StartGait,
    Velocity,
)
from snakewalk.controller.motion.refusals import NAME_MAX, TEXT_MAX
from snakewalk.controller.ros.clock_offset import ClockOffset
from snakewalk.controller.ros.ros_options import RosOptions
from snakewalk.controller.run.kinds.gait_factory import gait_by_name, is_gait

_PENDING_MAX = 16
"""Commands kept from one cycle to the next; older ones are dropped, and so are joint goals that
newer ones of the same joints follow, and velocities and goal poses that newer ones follow."""
QUEUE = QoSProfile(depth=10)
_WINDOW_S = 120.0
"""Time whose fastest message counts as having no delay (ours), so that clocks need not agree."""


class CommandTopics:
    """Subscriptions to the topics with commands."""

    def __init__(self, node: Node, options: RosOptions) -> None:
        self._node = node
        self._options = options
        self.pending: deque[Command] = deque(maxlen=_PENDING_MAX)
        self._lock = threading.Lock()
        self._delay_s = 0.0
        """Delay of the message that is being read."""
        self.has_begun = False
        """Whether the run has begun; commands that come before are rejected."""
        self.frame = ""
        """Frame of the run's poses, in which goal poses are accepted."""
        if options.commands:
            for kind, topic, take in (
                ("sensor_msgs/msg/JointState", "robot_joint_command", self.on_goals),
                (
                    "trajectory_msgs/msg/JointTrajectory",
                    "robot_joint_trajectory",
                    self.on_trajectory,
                ),
                ("std_msgs/msg/String", "robot_gait", self.on_gait),
                ("geometry_msgs/msg/Twist", "cmd_vel", self.on_velocity),
            ):
                self._subscribe(kind, topic, take)
        if options.goals:
            self._subscribe("geometry_msgs/msg/PoseStamped", "goal_pose", self.on_goal_pose)

    def take(self) -> list[Command]:
        """Return the commands since the last call."""
        with self._lock:
            commands = list(self.pending)
            self.pending.clear()
        return commands

    def reject(self, why: str) -> None:
        """Let the run report why a message was rejected."""
        with self._lock:
            self.pending.append(Refused(f"ROS: {why}"))

    def _subscribe(self, kind: str, topic: str, take: Callable[[Any], None]) -> None:
        callback = self._guarded_callback(topic, take)
        self._node.create_subscription(message_type(kind), topic, callback, QUEUE)

    def _guarded_callback(
        self, topic: str, take: Callable[[Any], None]
    ) -> Callable[[Any, Any], None]:
        """Return a callback that rejects a message on which ``take`` fails."""
        clock = ClockOffset(_WINDOW_S)

        def taken(message: Any, info: Any) -> None:
            try:
                source_s = 1e-9 * info["source_timestamp"]
                self._delay_s = clock.delay_s(source_s, time.monotonic()) if source_s else 0.0
                take(message)
            except Exception as fault:  # else the thread ends, and the stop service with it
                self.reject(f"{topic}: {in_words(fault)}")

        return taken

    def on_goals(self, message: Any) -> None:
        """Keep joint goals."""
        self._keep(_joint_goals, message, message.header.stamp, "joint goals")

    def on_trajectory(self, message: Any) -> None:
        """Keep a trajectory."""
        self._keep(_trajectory, message, message.header.stamp, "trajectory")

    def on_gait(self, message: Any) -> None:
        """Keep a gait, or a hold."""
        self._keep(_gait, message, None, "gait")

    def on_velocity(self, message: Any) -> None:
        """Keep a velocity along the body and a rate of turn."""
        self._keep(_velocity, message, None, "velocity")

    def on_goal_pose(self, message: Any) -> None:
        """Keep the place of a goal pose; a walk has no heading at its end."""
        self._keep(self._goal, message, message.header.stamp, "goal pose")

    def _goal(self, message: Any) -> Command:
        frame = message.header.frame_id
        place = message.pose.position
        if frame != self.frame:
            raise InputError(
                f"goal pose: frame {frame[:NAME_MAX]!r}; this run's poses have the frame "
                f"{self.frame!r}: transform the goal"
            )
        if not (math.isfinite(place.x) and math.isfinite(place.y)):
            raise InputError("goal pose: x or y is not a number")
        return GoTo(place.x, place.y)

    def _keep(self, read: Callable[[Any], Command], message: Any, stamp: Any, what: str) -> None:
        """Keep the command that a message states, or why it is rejected."""
        try:
            command = read(message)
        except InputError as error:
            command = Refused(error.faults[0])
        self._command(command, stamp, what)

    def _command(self, command: Command, stamp: Any, what: str) -> None:
        """Keep a command for the run; a stamp of 0 says nothing."""
        if not self.has_begun:
            command = Refused(f"{what}: the run has not begun")
        elif self._delay_s > LATE_S and not _is_halt(command):
            command = Refused(
                f"{what}: came {self._delay_s:.1f} s late and is dropped; at most {LATE_S:g} s is "
                "accepted; send it again"
            )
        elif stamp is not None and (stamp.sec or stamp.nanosec):
            age_s = 1e-9 * self._node.get_clock().now().nanoseconds - (
                stamp.sec + 1e-9 * stamp.nanosec
            )
            timeout_s = self._options.timeout_s
            most_s = timeout_s if age_s > 0.0 else min(timeout_s, TIMEOUT_S)
            if abs(age_s) > most_s:
                when = "ago" if age_s > 0.0 else "ahead"
                command = Refused(
                    f"{what}: stamped {abs(age_s):.1f} s {when}; at most {most_s:g} s is taken, "
                    "and 0 for now"
                )
        with self._lock:
            last = self.pending[-1] if self.pending else None
            if last is not None and _replaces(command, last):
                self.pending.pop()
            self.pending.append(command)


def _joint_goals(message: Any) -> Command:
    """Return the joint goals of a message.

    Raises:
        InputError: too many joints, or no positions.

    """
    if max(len(message.name), len(message.position)) > JOINTS_MAX:
        raise InputError(
            f"joint goals: names {len(message.name)} joints; at most {JOINTS_MAX} are accepted"
        )
    if message.name and not message.position:
        raise InputError("joint goals: no positions; velocities and efforts alone are not accepted")
    return JointGoals(list(message.name), list(message.position))


def _trajectory(message: Any) -> Command:
    """Return the trajectory of a message; one without points is a hold.

    Raises:
        InputError: too many joints or points, or points with different values or no positions.

    """
    points = message.points
    names = list(message.joint_names)
    if not points:
        return HoldStill()
    if len(names) > JOINTS_MAX:
        raise InputError(
            f"trajectory: names {len(names)} joints; at most {JOINTS_MAX} are accepted"
        )
    if len(points) > POINTS_MAX:
        raise InputError(f"trajectory: {len(points)} points; 1 to {POINTS_MAX} are accepted")
    times = [point.time_from_start for point in points]
    time_s = np.array([duration.sec + 1e-9 * duration.nanosec for duration in times])
    try:
        positions = _rows([point.positions for point in points])
        velocities = _rows([point.velocities for point in points])
        accelerations = _rows([point.accelerations for point in points])
    except ValueError:
        raise InputError("trajectory: its points have different numbers of values") from None
    if positions is None:
        raise InputError("trajectory: its points have no positions")
    return JointTrajectory(names, time_s, positions, velocities, accelerations)


def _gait(message: Any) -> Command:
    """Return the gait of a message, ``NAME PARAM=VALUE ...``; an empty one is a hold.

    Raises:
        InputError: no such gait, or a value is wrong or repeated.

    """
    words = message.data.split()
    if not words:
        return HoldStill()
    if not is_gait(words[0]):
        raise InputError(f"gait: {words[0][:NAME_MAX]}: no such gait; snakewalk gait list")
    values: dict[str, Any] = {}
    for key, value in map(_value, words[1:]):
        if key in values:
            raise InputError(f"gait: {key[:NAME_MAX]} is given twice; give it once")
        values[key] = value
    return StartGait(gait_by_name(words[0], values)[0])


def _velocity(message: Any) -> Command:
    """Return the velocity along the body and the rate of turn of a message.

    Raises:
        InputError: another component is not 0.

    """
    linear = message.linear
    angular = message.angular
    others = {
        "linear.y": linear.y,
        "linear.z": linear.z,
        "angular.x": angular.x,
        "angular.y": angular.y,
    }
    for name, value in others.items():
        if value != 0.0:
            raise InputError(
                f"velocity: {name} is not 0; send linear.x and angular.z, and 0 elsewhere"
            )
    return Velocity(linear.x, angular.z)


def _is_halt(command: Command) -> bool:
    """Whether a command ends a motion or was rejected; such a command is never too late."""
    return isinstance(command, HoldStill | Refused) or command == Velocity(0.0, 0.0)


def _replaces(command: Command, last: Command) -> bool:
    if isinstance(command, JointGoals) and isinstance(last, JointGoals):
        return command.joints == last.joints
    return isinstance(command, Velocity | GoTo) and type(command) is type(last)


def _rows(values: list[Any]) -> Floats | None:
    """(N, K) array of a trajectory's points; None where none has any."""
    return (
        np.array([list(values_of_joint) for values_of_joint in values], dtype=float)
        if any(values)
        else None
    )


def _value(word: str) -> tuple[str, Any]:
    key, equals, text = word.partition("=")
    if not (key and equals and text):
        raise InputError(f"gait: {word[:NAME_MAX]}: expected PARAM=VALUE")
    try:
        return key, parse_json(text)
    except ValueError:
        return key, text


def in_words(fault: Exception) -> str:
    """One line that says what failed."""
    text = " ".join(str(fault).split())
    return f"it cannot be used ({text[:TEXT_MAX] or type(fault).__name__})"


@cache
def message_type(kind: str) -> Any:
    """Return the class of a message."""
    package, folder, name = kind.split("/")
    return getattr(import_module(f"{package}.{folder}"), name)
