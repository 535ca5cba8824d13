"""Rows of a log as ROS 2 messages of any library: that of a bag, or that of a node.

Frames and joints have the names of the URDF that ``robot export`` writes; effort is in N m.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.ros import RosConfig
from snakewalk.controller.exchange.body_frames import WORLD, body_frames
from snakewalk.controller.exchange.imu_readings import imu_readings
from snakewalk.controller.exchange.remaining_fields import Shown, remaining_fields
from snakewalk.controller.runlog.column import Column
from snakewalk.controller.runlog.encode import encode
from snakewalk.controller.runlog.record import Header, RunRecord
from snakewalk.controller.runlog.topics import (
    ConfigTable,
    CycleTable,
    EventTable,
    ImuTable,
    PathTable,
    PoseTable,
    SlowTable,
)

JOINT_STATES = "/joint_states"
JOINT_GOALS = "/joint_goals"
FRAMES = "/tf"
HEAD_POSE = "/head_pose"
ODOMETRY = "/odom"
IMU = ImuTable.topic.name
PATH = PathTable.topic.name
DIAGNOSTICS = "/diagnostics"
ROSOUT = "/rosout"
_LEVELS = {"info": 20, "warning": 30, "error": 40}
"""Levels of ``rcl_interfaces/msg/Log``."""
OK = 0
WARNING = 1
ERROR = 2
"""Levels of ``diagnostic_msgs/msg/DiagnosticStatus``."""
_PATH = "nav_msgs/msg/Path"
_TEXT = "std_msgs/msg/String"
TYPES = {
    JOINT_STATES: "sensor_msgs/msg/JointState",
    JOINT_GOALS: "sensor_msgs/msg/JointState",
    FRAMES: "tf2_msgs/msg/TFMessage",
    HEAD_POSE: "geometry_msgs/msg/PoseStamped",
    ODOMETRY: "nav_msgs/msg/Odometry",
    IMU: "sensor_msgs/msg/Imu",
    PATH: _PATH,
    DIAGNOSTICS: "diagnostic_msgs/msg/DiagnosticArray",
    ROSOUT: "rcl_interfaces/msg/Log",
}
"""Well-known message of each topic."""
SHOWN: Shown = {
    CycleTable: ("sent_rad", "measured_rad", "velocity_rad_s"),
    SlowTable: tuple(SlowTable.topic.columns),
    ImuTable: tuple(ImuTable.topic.columns),
    PoseTable: ("head_m", "rotation", "links_m"),
    EventTable: tuple(EventTable.topic.columns),
}
"""Fields that the messages of other packages contain; the others have messages of ``std_msgs``."""


UNKNOWN_VARIANCE = 1e6
"""Variance of an unknown value, as `robot_localization` expects it."""
_LEAST_VARIANCE = 1e-6
"""Variance of an exact pose: zeros would mean that the covariance is unknown."""


class Row(NamedTuple):
    """A message of a topic."""

    time_s: float
    topic: str
    type: str
    message: Any


def pose_frame(header: Header) -> str:
    """Return the frame of a run's poses: the world's if they are measured, else that of odometry.

    A frame of odometry drifts, by REP 105; so a dead-reckoned pose never looks measured.
    """
    ros = header.robot.ros or RosConfig()
    return ros.world_frame if header.pose_evidence.is_measured else ros.odom_frame


def _head_frames(record: RunRecord) -> Iterator[tuple[float, str, Any, Any]]:
    """Yield time, name, place and quaternion of the head's frame; none without poses."""
    if len(record.pose.time_s):
        frames = body_frames(record)
        places = frames.translation_m[:, 0].tolist()
        turns = frames.quaternion[:, 0].tolist()
        for time_s, place, turn in zip(frames.time_s.tolist(), places, turns, strict=True):
            yield time_s, frames.names[0], place, turn


def _variance(deviation: float | None) -> float:
    if deviation is None or not np.isfinite(deviation):  # not a number: nothing was measured yet
        return UNKNOWN_VARIANCE
    return max(deviation**2, _LEAST_VARIANCE)


class RosMessages:
    """Makes messages of a log's rows."""

    def __init__(
        self,
        new: Callable[[str, Mapping[str, Any]], Any],
        floats: Callable[[Floats], Any],
        byte: Callable[[int], Any] = int,
        ros_time_s: Callable[[float], float] = lambda time_s: time_s,
    ) -> None:
        """Use the functions of a library.

        Args:
            new: makes a message of a type, such as ``sensor_msgs/msg/JointState``, and its fields.
            floats: returns the library's sequence of ``float64``.
            byte: returns the library's ``byte``.
            ros_time_s: returns the stamp of a time of the run's clock.

        """
        self._make = new
        self._floats = floats
        self._byte = byte
        self._ros_time_s = ros_time_s

    def rows(self, record: RunRecord) -> Iterator[Row]:
        """All messages, topic by topic."""
        yield from self.joints(record)
        yield from self.transforms(record)
        yield from self.head_poses(record)
        evidence = record.header.pose_evidence
        yield from self.odometry(record, evidence.position_m, evidence.heading_rad)
        yield from self.imu(record)
        yield from self._diagnostics(record)
        yield from self._events(record)
        yield from self._other_fields(record)

    def _events(self, record: RunRecord) -> Iterator[Row]:
        for event in record.events:
            yield self._row(
                event.time_s,
                ROSOUT,
                TYPES[ROSOUT],
                stamp=self._stamp(event.time_s),
                level=_LEVELS[event.level],
                name="snakewalk",
                msg=f"{event.kind}: {event.text}",
                file="",
                function="",
                line=0,
            )

    def joints(self, record: RunRecord) -> Iterator[Row]:
        """Measured and sent values of every cycle."""
        cycle = record.cycle
        names = list(record.header.robot.joint_names)
        effort_n_m = cycle.current_a * record.header.torque_constant_n_m_a
        none = np.zeros(0)
        if not np.isfinite(record.header.torque_constant_n_m_a):
            effort_n_m = np.zeros((len(cycle.time_s), 0))
        for k, time_s in enumerate(cycle.time_s.tolist()):
            given = (cycle.measured_rad[k], cycle.velocity_rad_s[k], effort_n_m[k])
            yield self._joint_state(time_s, JOINT_STATES, names, *given)
            yield self._joint_state(time_s, JOINT_GOALS, names, cycle.sent_rad[k], none, none)

    def _joint_state(
        self,
        time_s: float,
        topic: str,
        names: list[str],
        position: Floats,
        velocity: Floats,
        effort: Floats,
    ) -> Row:
        return self._row(
            time_s,
            topic,
            TYPES[topic],
            header=self._header(time_s, ""),
            name=names,
            position=self._floats(position),
            velocity=self._floats(velocity),
            effort=self._floats(effort),
        )

    def transforms(self, record: RunRecord, *, links: bool = True) -> Iterator[Row]:
        """Return the transforms of the head alone, or of every link."""
        frames = body_frames(record)
        world = pose_frame(record.header)
        for k, time_s in enumerate(frames.time_s.tolist()):
            rows = zip(
                frames.parents,
                frames.names,
                frames.translation_m[k].tolist(),
                frames.quaternion[k].tolist(),
                strict=True,
            )
            transforms = [
                self._new_message(
                    "geometry_msgs/msg/TransformStamped",
                    header=self._header(time_s, world if parent == WORLD else parent),
                    child_frame_id=name,
                    transform=self._new_message(
                        "geometry_msgs/msg/Transform",
                        translation=self._xyz("Vector3", place),
                        rotation=self._quaternion(turn),
                    ),
                )
                for parent, name, place, turn in rows
                if links or parent == WORLD
            ]
            yield self._row(time_s, FRAMES, TYPES[FRAMES], transforms=transforms)

    def head_poses(self, record: RunRecord) -> Iterator[Row]:
        """Where the head was."""
        world = pose_frame(record.header)
        for time_s, _, place, turn in _head_frames(record):
            pose = self._pose(time_s, world, place, turn)
            yield Row(time_s, HEAD_POSE, TYPES[HEAD_POSE], pose)

    def odometry(
        self, record: RunRecord, position_sd_m: float | None, heading_sd_rad: float | None
    ) -> Iterator[Row]:
        """Return the head's poses with their covariance; no speed is measured.

        Args:
            record: with poses.
            position_sd_m: standard deviation of x, y and z; None: unknown.
            heading_sd_rad: standard deviation of the rotations; None: unknown.

        """
        world = pose_frame(record.header)
        unknown = self._floats(np.diag([UNKNOWN_VARIANCE] * 6).ravel())
        variance = [_variance(position_sd_m)] * 3 + [_variance(heading_sd_rad)] * 3
        zero_vector = self._xyz("Vector3", [0.0, 0.0, 0.0])
        for time_s, name, place, turn in _head_frames(record):
            pose = self._new_message(
                "geometry_msgs/msg/PoseWithCovariance",
                pose=self._bare_pose(place, turn),
                covariance=self._floats(np.diag(variance).ravel()),
            )
            twist = self._new_message(
                "geometry_msgs/msg/TwistWithCovariance",
                twist=self._new_message(
                    "geometry_msgs/msg/Twist", linear=zero_vector, angular=zero_vector
                ),
                covariance=unknown,
            )
            yield self._row(
                time_s,
                ODOMETRY,
                TYPES[ODOMETRY],
                header=self._header(time_s, world),
                child_frame_id=name,
                pose=pose,
                twist=twist,
            )

    def imu(self, record: RunRecord) -> Iterator[Row]:
        """Attitude and rate of a robot's IMU."""
        readings = imu_readings(record)
        unknown = np.zeros(9)
        absent = np.array([-1.0, *[0.0] * 8])  # as the message defines them
        rows = zip(
            readings.time_s.tolist(),
            readings.quaternion.tolist(),
            readings.rate_rad_s.tolist(),
            strict=True,
        )
        for time_s, turn, rate in rows:
            yield self._row(
                time_s,
                IMU,
                TYPES[IMU],
                header=self._header(time_s, readings.frame),
                orientation=self._quaternion(turn),
                orientation_covariance=unknown,
                angular_velocity=self._xyz("Vector3", rate),
                angular_velocity_covariance=unknown,
                linear_acceleration=self._xyz("Vector3", [0.0, 0.0, 0.0]),
                linear_acceleration_covariance=absent,
            )

    def paths(self, record: RunRecord) -> Iterator[Row]:
        """The plan's path, and those that replaced it."""
        for time_s, points_m in record.paths:
            yield self._points(time_s, PATH, pose_frame(record.header), points_m)

    def _points(self, time_s: float, topic: str, frame: str, points_m: Floats) -> Row:
        level = np.hstack([points_m, np.zeros((len(points_m), 3 - points_m.shape[1]))])
        poses = [self._pose(time_s, frame, point, [0.0, 0.0, 0.0, 1.0]) for point in level.tolist()]
        header = self._header(time_s, frame)
        return self._row(time_s, topic, _PATH, header=header, poses=poses)

    def _other_fields(self, record: RunRecord) -> Iterator[Row]:
        """Fields that no message above contains: each has a topic of its own."""
        name = ConfigTable.topic.name
        frame = pose_frame(record.header)
        yield self._row(0.0, name, _TEXT, data=encode(record.header.row()))
        for table, columns in remaining_fields(record, SHOWN):
            for name, column in columns.items():
                topic = table.topic.name
                times_s = table.time_s.tolist()
                values = getattr(table, name)
                for time_s, value in zip(times_s, values, strict=True):
                    yield self._value(time_s, f"{topic}/{name}", frame, column, value)

    def _value(self, time_s: float, topic: str, frame: str, column: Column, value: Any) -> Row:
        if column.kind == "points":
            return self._points(time_s, topic.rpartition("/")[0], frame, value)
        if column.kind == "text":
            return self._row(time_s, topic, _TEXT, data=value)
        if not column.shape:
            return self._row(time_s, topic, "std_msgs/msg/Float64", data=float(value))
        numbers = np.asarray(value, dtype=float).ravel()
        label = topic.rpartition("/")[2]
        size = len(numbers)
        dimension = self._new_message(
            "std_msgs/msg/MultiArrayDimension", label=label, size=size, stride=size
        )
        layout = self._new_message("std_msgs/msg/MultiArrayLayout", dim=[dimension], data_offset=0)
        kind = "std_msgs/msg/Float64MultiArray"
        data = self._floats(numbers)
        return self._row(time_s, topic, kind, layout=layout, data=data)

    def _diagnostics(self, record: RunRecord) -> Iterator[Row]:
        for k, time_s in enumerate(record.slow.time_s.tolist()):
            status = [self.pose_status(record.header), *self.servos(record, k)]
            yield self.diagnostics(time_s, status)

    def pose_status(self, header: Header) -> Any:
        """Return the status of the pose: how it is known, from which source, how accurately."""
        evidence = header.pose_evidence
        level = OK if evidence.is_measured else WARNING
        return self.status("pose", level, evidence.text, header.robot.name, evidence.texts)

    def servos(self, record: RunRecord, k: int) -> list[Any]:
        """Return the status of every servo in a row of ``/slow``."""
        slow = record.slow
        robot = record.header.robot
        return [
            self.status(
                robot.joint_names[joint],
                ERROR if slow.hardware_error[k, joint] else OK,
                f"hardware error 0x{slow.hardware_error[k, joint]:02X}"
                if slow.hardware_error[k, joint]
                else "",
                f"{model} ID {number}",
                {
                    "temperature_c": f"{slow.temperature_c[k, joint]:g}",
                    "voltage_v": f"{slow.voltage_v[k, joint]:g}",
                },
            )
            for joint, (number, model) in enumerate(
                zip(robot.servo_ids, robot.servo_models, strict=True)
            )
        ]

    def status(
        self, name: str, level: int, text: str, hardware: str, values: Mapping[str, str]
    ) -> Any:
        """Return a ``DiagnosticStatus``."""
        return self._new_message(
            "diagnostic_msgs/msg/DiagnosticStatus",
            level=self._byte(level),
            name=name,
            message=text,
            hardware_id=hardware,
            values=[
                self._new_message("diagnostic_msgs/msg/KeyValue", key=key, value=value)
                for key, value in values.items()
            ],
        )

    def diagnostics(self, time_s: float, status: list[Any]) -> Row:
        """Return a ``DiagnosticArray``."""
        header = self._header(time_s, "")
        return self._row(time_s, DIAGNOSTICS, TYPES[DIAGNOSTICS], header=header, status=status)

    def _pose(self, time_s: float, frame: str, place: list[float], turn: list[float]) -> Any:
        return self._new_message(
            TYPES[HEAD_POSE],
            header=self._header(time_s, frame),
            pose=self._bare_pose(place, turn),
        )

    def _bare_pose(self, place: list[float], turn: list[float]) -> Any:
        return self._new_message(
            "geometry_msgs/msg/Pose",
            position=self._xyz("Point", place),
            orientation=self._quaternion(turn),
        )

    def _header(self, time_s: float, frame: str) -> Any:
        return self._new_message("std_msgs/msg/Header", stamp=self._stamp(time_s), frame_id=frame)

    def _stamp(self, time_s: float) -> Any:
        seconds, nanoseconds = divmod(round(self._ros_time_s(time_s) * 1e9), 1_000_000_000)
        return self._new_message("builtin_interfaces/msg/Time", sec=seconds, nanosec=nanoseconds)

    def _xyz(self, kind: str, values: list[float]) -> Any:
        return self._new_message(f"geometry_msgs/msg/{kind}", x=values[0], y=values[1], z=values[2])

    def _quaternion(self, values: list[float]) -> Any:
        x, y, z, w = values
        return self._new_message("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)

    def _row(self, time_s: float, topic: str, kind: str, **fields: Any) -> Row:
        return Row(time_s, topic, kind, self._make(kind, fields))

    def _new_message(self, kind: str, **fields: Any) -> Any:
        return self._make(kind, fields)
