"""A log as a ROS 2 bag: one MCAP file of profile ``ros2`` with messages in CDR. Needs rosbags.

Messages carry the run's clock, which begins near 0 s: play the bag with ``--clock`` and
``use_sim_time``. Frames and joints have the names of the URDF that ``robot export`` writes.
"""

from collections.abc import Iterator
from operator import itemgetter
from pathlib import Path
from typing import Any, Final

import numpy as np
from mcap.writer import Writer
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Floats
from snakewalk.controller.app.exports.body_frames import WORLD, body_frames, joint_names
from snakewalk.controller.app.exports.imu_readings import IMU_TOPIC, imu_readings, recorded_topics
from snakewalk.controller.runlog.record import RunRecord

_TOPICS: Final = {
    "/joint_states": "sensor_msgs/msg/JointState",
    "/joint_goals": "sensor_msgs/msg/JointState",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/head_pose": "geometry_msgs/msg/PoseStamped",
    IMU_TOPIC: "sensor_msgs/msg/Imu",
    "/path": "nav_msgs/msg/Path",
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    "/rosout": "rcl_interfaces/msg/Log",
}
_LEVELS: Final = {"info": 20, "warning": 30, "error": 40}
"""Of ``rcl_interfaces/msg/Log``."""
Row = tuple[float, str, Any]
"""Time in s, topic, message."""


def write_ros_bag(record: RunRecord, path: Path) -> dict[str, int]:
    """Write a bag; returns how many messages each topic has."""
    from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415  an extra

    store: Any = get_typestore(Stores.ROS2_JAZZY)
    topics = recorded_topics(_TOPICS, record)
    counts = dict.fromkeys(topics, 0)
    with path.open("wb") as file:
        writer: Any = Writer(file)
        writer.start(profile="ros2", library=f"snakewalk {record.header.software}")
        schemas = {
            kind: writer.register_schema(
                kind, "ros2msg", store.generate_msgdef(kind, ros_version=2)[0].encode()
            )
            for kind in dict.fromkeys(topics.values())
        }
        channels = {
            topic: writer.register_channel(
                topic, "cdr", schemas[kind], {"offered_qos_profiles": ""}
            )
            for topic, kind in topics.items()
        }
        for time_s, topic, message in sorted(_Messages(store.types).rows(record), key=_BY_TIME):
            stamp_ns = round(time_s * 1e9)
            data = store.serialize_cdr(message, _TOPICS[topic])
            writer.add_message(channels[topic], stamp_ns, bytes(data), publish_time=stamp_ns)
            counts[topic] += 1
        writer.finish()
    return counts


_BY_TIME: Final = itemgetter(0)


class _Messages:
    """Makes messages of a log's rows."""

    def __init__(self, types: dict[str, Any]) -> None:
        self._types = types

    def rows(self, record: RunRecord) -> Iterator[Row]:
        """All messages, topic by topic."""
        yield from self._joints(record)
        yield from self._frames(record)
        yield from self._imu(record)
        for time_s, points in record.paths:
            yield time_s, "/path", self._path(time_s, points)
        yield from self._diagnostics(record)
        for event in record.events:
            log = self._new(
                "rcl_interfaces/msg/Log",
                stamp=self._stamp(event.time_s),
                level=_LEVELS[event.level],
                name="snakewalk",
                msg=f"{event.kind}: {event.text}",
                file="",
                function="",
                line=0,
            )
            yield event.time_s, "/rosout", log

    def _joints(self, record: RunRecord) -> Iterator[Row]:
        cycle, names = record.cycle, list(joint_names(record.header.robot))
        effort_n_m = cycle.current_a * record.header.torque_constant_n_m_a
        none = np.zeros(0)
        if not np.isfinite(record.header.torque_constant_n_m_a):
            effort_n_m = np.zeros((len(cycle.time_s), 0))
        for k, time_s in enumerate(cycle.time_s.tolist()):
            given = (cycle.measured_rad[k], cycle.velocity_rad_s[k], effort_n_m[k])
            yield time_s, "/joint_states", self._joint_state(time_s, names, *given)
            goals = self._joint_state(time_s, names, cycle.sent_rad[k], none, none)
            yield time_s, "/joint_goals", goals

    def _joint_state(
        self, time_s: float, names: list[str], position: Floats, velocity: Floats, effort: Floats
    ) -> Any:
        return self._new(
            "sensor_msgs/msg/JointState",
            header=self._header(time_s, ""),
            name=names,
            position=np.ascontiguousarray(position),
            velocity=np.ascontiguousarray(velocity),
            effort=np.ascontiguousarray(effort),
        )

    def _frames(self, record: RunRecord) -> Iterator[Row]:
        frames = body_frames(record)
        for k, time_s in enumerate(frames.time_s.tolist()):
            rows = zip(
                frames.parents,
                frames.names,
                frames.translation_m[k].tolist(),
                frames.quaternion[k].tolist(),
                strict=True,
            )
            transforms = [
                self._new(
                    "geometry_msgs/msg/TransformStamped",
                    header=self._header(time_s, parent),
                    child_frame_id=name,
                    transform=self._new(
                        "geometry_msgs/msg/Transform",
                        translation=self._xyz("Vector3", at),
                        rotation=self._quaternion(turn),
                    ),
                )
                for parent, name, at, turn in rows
            ]
            yield time_s, "/tf", self._new("tf2_msgs/msg/TFMessage", transforms=transforms)
            if len(record.pose.time_s):
                at, turn = frames.translation_m[k, 0], frames.quaternion[k, 0]
                yield time_s, "/head_pose", self._pose(time_s, at.tolist(), turn.tolist())

    def _imu(self, record: RunRecord) -> Iterator[Row]:
        readings = imu_readings(record)
        unknown, absent = np.zeros(9), np.array([-1.0, *[0.0] * 8])  # as the message defines them
        rows = zip(
            readings.time_s.tolist(),
            readings.quaternion.tolist(),
            readings.rate_rad_s.tolist(),
            strict=True,
        )
        for time_s, turn, rate in rows:
            message = self._new(
                "sensor_msgs/msg/Imu",
                header=self._header(time_s, readings.frame),
                orientation=self._quaternion(turn),
                orientation_covariance=unknown,
                angular_velocity=self._xyz("Vector3", rate),
                angular_velocity_covariance=unknown,
                linear_acceleration=self._xyz("Vector3", [0.0, 0.0, 0.0]),
                linear_acceleration_covariance=absent,
            )
            yield time_s, IMU_TOPIC, message

    def _path(self, time_s: float, points_m: Floats) -> Any:
        level = np.hstack([points_m, np.zeros((len(points_m), 3 - points_m.shape[1]))])
        poses = [self._pose(time_s, point, [0.0, 0.0, 0.0, 1.0]) for point in level.tolist()]
        return self._new("nav_msgs/msg/Path", header=self._header(time_s, WORLD), poses=poses)

    def _diagnostics(self, record: RunRecord) -> Iterator[Row]:
        slow, robot = record.slow, record.header.robot
        labels = list(zip(robot.servo_ids, robot.servo_models, strict=True))
        for k, time_s in enumerate(slow.time_s.tolist()):
            status = [
                self._new(
                    "diagnostic_msgs/msg/DiagnosticStatus",
                    level=2 if slow.hardware_error[k, joint] else 0,
                    name=f"joint{joint}",
                    message=f"hardware error 0x{slow.hardware_error[k, joint]:02X}"
                    if slow.hardware_error[k, joint]
                    else "",
                    hardware_id=f"{model} ID {number}",
                    values=[
                        self._new("diagnostic_msgs/msg/KeyValue", key=key, value=f"{value:g}")
                        for key, value in (
                            ("temperature_c", slow.temperature_c[k, joint]),
                            ("voltage_v", slow.voltage_v[k, joint]),
                        )
                    ],
                )
                for joint, (number, model) in enumerate(labels)
            ]
            kind = "diagnostic_msgs/msg/DiagnosticArray"
            yield (
                time_s,
                "/diagnostics",
                self._new(kind, header=self._header(time_s, ""), status=status),
            )

    def _pose(self, time_s: float, at: list[float], turn: list[float]) -> Any:
        return self._new(
            "geometry_msgs/msg/PoseStamped",
            header=self._header(time_s, WORLD),
            pose=self._new(
                "geometry_msgs/msg/Pose",
                position=self._xyz("Point", at),
                orientation=self._quaternion(turn),
            ),
        )

    def _header(self, time_s: float, frame: str) -> Any:
        return self._new("std_msgs/msg/Header", stamp=self._stamp(time_s), frame_id=frame)

    def _stamp(self, time_s: float) -> Any:
        seconds, nanoseconds = divmod(round(time_s * 1e9), 1_000_000_000)
        return self._new("builtin_interfaces/msg/Time", sec=seconds, nanosec=nanoseconds)

    def _xyz(self, kind: str, values: list[float]) -> Any:
        return self._new(f"geometry_msgs/msg/{kind}", x=values[0], y=values[1], z=values[2])

    def _quaternion(self, values: list[float]) -> Any:
        x, y, z, w = values
        return self._new("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)

    def _new(self, kind: str, **fields: ArrayLike | Any) -> Any:
        return self._types[kind](**fields)
