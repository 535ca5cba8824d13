"""Joint angles of a ROS 2 bag or an MCAP: JointState or JointTrajectory messages. Needs rosbags."""

from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import numpy as np

from snakewalk.config.archive import check_expansion
from snakewalk.config.errors import InputError, first_line
from snakewalk.config.extras import require_extra
from snakewalk.controller.console.command import plugin
from snakewalk.controller.motion.joint_motion import (
    MOST_CELLS,
    JointMotion,
    JointRequest,
    joint_motion,
)

_STATE: Final = "sensor_msgs/msg/JointState"
_TRAJECTORY: Final = "trajectory_msgs/msg/JointTrajectory"
_MAGIC: Final = b"\x89MCAP0\r\n"


@plugin("joints", "ros2")
class RosJoints:
    """JointState or JointTrajectory messages of a ROS 2 bag or an MCAP."""

    def accepts(self, path: Path, head: bytes) -> bool:
        """Whether it is the folder of a bag, or an MCAP."""
        return (path / "metadata.yaml").is_file() or head.startswith(_MAGIC)

    def read(self, path: Path, request: JointRequest) -> JointMotion:
        """Read the messages of one topic; see ``JointReader.read``."""
        require_extra(f"{path}: ROS 2 bags need", "rosbags")
        bags, types = (import_module(f"rosbags.{part}") for part in ("highlevel", "typesys"))
        store = types.get_typestore(types.Stores.ROS2_JAZZY)
        try:
            with bags.AnyReader([path], default_typestore=store) as bag:
                topic, kind = _topic(path, bag, request)
                using = [connection for connection in bag.connections if connection.topic == topic]
                messages = (
                    (stamp, bag.deserialize(data, connection.msgtype))
                    for connection, stamp, data in bag.messages(connections=using)
                )
                rows = _states(messages) if kind == _STATE else _points(path, messages)
                return _motion(path, topic, rows)
        except InputError:
            raise
        except Exception as error:
            raise InputError(
                f"{path}: cannot be read as a ROS 2 bag: {first_line(error)}"
            ) from None


def _topic(path: Path, bag: Any, request: JointRequest) -> tuple[str, str]:
    kinds = {connection.topic: connection.msgtype for connection in bag.connections}
    fit = {topic: kind for topic, kind in kinds.items() if kind in (_STATE, _TRAJECTORY)}
    if request.topic is not None:
        if request.topic not in fit:
            raise InputError(
                f"--topic {request.topic}: no joint messages there; {path} has "
                f"{', '.join(fit) or 'none'}"
            )
        return request.topic, fit[request.topic]
    if len(fit) != 1:
        listed = ", ".join(f"{topic} ({kind})" for topic, kind in (fit or kinds).items()) or "none"
        raise InputError(
            f"{path}: {len(fit)} topics of JointState or JointTrajectory"
            + (f"; say --topic NAME: {listed}" if fit else f"; its topics: {listed}")
        )
    return next(iter(fit.items()))


Row = tuple[float, tuple[str, ...], Any]


def _states(messages: Iterator[tuple[int, Any]]) -> Iterator[Row]:
    """Times, names and positions of JointState messages.

    All times are stamps if any message has one: in simulated time the first stamp may be 0.
    """
    rows = []
    for received, message in messages:
        stamp_s = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
        rows.append((stamp_s, 1e-9 * received, tuple(message.name), message.position))
    has_stamps = any(stamp_s for stamp_s, *_ in rows)
    for stamp_s, received_s, names, positions in rows:
        yield stamp_s if has_stamps else received_s, names, positions


def _points(path: Path, messages: Iterator[tuple[int, Any]]) -> Iterator[Row]:
    """Times, names and positions of the one JointTrajectory, or of the first points of several."""
    messages_list = list(messages)
    if len(messages_list) == 1:
        ((_, message),) = messages_list
        for point in message.points:
            start = point.time_from_start
            yield start.sec + 1e-9 * start.nanosec, tuple(message.joint_names), point.positions
        return
    for received, message in messages_list:
        if len(message.points) != 1:
            raise InputError(
                f"{path}: {len(messages_list)} trajectories of several points; give a bag with one"
            )
        yield 1e-9 * received, tuple(message.joint_names), message.points[0].positions


def _motion(path: Path, topic: str, rows: Iterator[Row]) -> JointMotion:
    names: tuple[str, ...] = ()
    times = []
    angles = []
    others = 0
    unlike = set[str]()
    cells = 0
    for time_s, row_names, positions in rows:
        names = names or row_names
        angle_by_name = dict(zip(row_names, np.asarray(positions, float).tolist(), strict=False))
        if not {*names} & {*angle_by_name}:
            others += 1  # of another publisher, or without positions
            unlike |= {*row_names} - {*names}
            continue
        unlike |= {*angle_by_name} - {*names}
        cells += len(names)
        check_expansion(path, cells, 8 * cells)
        if cells > MOST_CELLS:
            raise InputError(f"{path}: holds more than {MOST_CELLS} angles; give a part of it")
        times.append(time_s)
        angles.append([angle_by_name.get(name, np.nan) for name in names])
    if not names or not angles:
        raise InputError(f"{path}: {topic}: no message has names and positions of joints")
    notes = [f"topic {topic}"]
    if others or unlike:
        listed = ", ".join(sorted(unlike)) or "none"
        notes.append(f"{others} messages are left out; further joints in some messages: {listed}")
    order = np.argsort(times, kind="stable")
    time = np.array(times)[order]
    first = np.concatenate([[True], np.diff(time) > 0.0])
    if not first.all():
        notes.append(f"{int((~first).sum())} messages repeat a time and are left out")
    return joint_motion(path, time[first], names, np.array(angles)[order][first], notes)
