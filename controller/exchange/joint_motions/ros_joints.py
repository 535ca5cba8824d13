"""Joint angles of a ROS 2 bag or an MCAP: JointState or JointTrajectory messages. Needs rosbags."""

from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError, first_line
from snakewalk.config.extras import require_extra
from snakewalk.config.playback import JointRequest
from snakewalk.config.reading import Fact
from snakewalk.controller.console.command import plugin
from snakewalk.controller.motion.joint_motion import (
    MOST_CELLS,
    JointMotion,
    joint_motion,
)
from snakewalk.controller.motion.parted_recording import gaps

_STATE = "sensor_msgs/msg/JointState"
_TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
_MAGIC = b"\x89MCAP0\r\n"


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
                return motion_of_rows(path, topic, rows)
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
            + (f"; give --topic NAME: {listed}" if fit else f"; its topics: {listed}")
        )
    return next(iter(fit.items()))


Row = tuple[float, tuple[str, ...], Any]


def _states(messages: Iterator[tuple[int, Any]]) -> Iterator[Row]:
    """Times, names and positions of JointState messages.

    All times are stamps if each set of joints has one: in simulated time the first stamp may be 0.
    """
    rows = []
    stamped: dict[frozenset[str], bool] = {}
    for received, message in messages:
        stamp_s = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
        rows.append((stamp_s, 1e-9 * received, tuple(message.name), message.position))
        joints = frozenset(message.name)
        stamped[joints] = stamped.get(joints, False) or stamp_s > 0.0
    has_stamps = all(stamped.values())
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


def motion_of_rows(path: Path, topic: str, rows: Iterator[Row]) -> JointMotion:
    """Return the angles of all joints at the times of the largest set of joints.

    Angles from other messages, such as those of a second publisher, are interpolated there; in a
    gap of their own they are missing.
    """
    by_joint: dict[str, dict[float, float]] = {}
    times: dict[frozenset[str], list[float]] = {}
    cells = 0
    for time_s, names, positions in rows:
        angles = dict(zip(names, np.asarray(positions, float).tolist(), strict=False))
        cells += len(angles)
        if cells > MOST_CELLS:
            raise InputError(f"{path}: holds more than {MOST_CELLS} angles; give a part of it")
        times.setdefault(frozenset(angles), []).append(time_s)
        for name, angle in angles.items():
            by_joint.setdefault(name, {}).setdefault(time_s, angle)
    if not by_joint:
        raise InputError(f"{path}: {topic}: no message has names and positions of joints")
    main = max(times, key=lambda joints: len(joints) * len(times[joints]))
    time = np.unique(times[main])
    notes = [f"topic {topic}"]
    if len(time) < len(times[main]):
        notes.append(f"{len(times[main]) - len(time)} messages repeat a time and are left out")
    others = [name for name in by_joint if name not in main]
    if others:
        notes.append(f"other messages have {', '.join(others)}: interpolated to these times")
    columns = [_values_at(time, np.array(sorted(angles.items()))) for angles in by_joint.values()]
    message = "the definition of its messages"
    return joint_motion(
        path,
        time,
        list(by_joint),
        np.stack(columns, axis=1),
        notes,
        unit=Fact("rad", "file", message),
        time=Fact("s", "file", message),
    )


def _values_at(time: Floats, rows: Floats) -> Floats:
    """Angles at times (T,) from rows (N, 2) of time and angle; NaN in gaps and beyond the ends."""
    if len(rows) < 2:
        return np.where(time == rows[0, 0], rows[0, 1], np.nan)
    values = np.interp(time, rows[:, 0], rows[:, 1], left=np.nan, right=np.nan)
    after = rows[gaps(rows[:, 0])]
    before = rows[gaps(rows[:, 0]) - 1]
    for (start_s, _), (end_s, _) in zip(before, after, strict=True):
        values[(time > start_s) & (time < end_s)] = np.nan
    return values
