"""Rows of a log as ROS 2 messages, of whatever library makes these: a bag's, or a node's.

Frames and joints have the names of the URDF that ``robot export`` writes; effort is in N m.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.exchange.body_frames import WORLD, body_frames, joint_names
from snakewalk.controller.exchange.imu_readings import IMU_TOPIC, imu_readings
from snakewalk.controller.runlog.record import RunRecord

_LEVELS: Final = {"info": 20, "warning": 30, "error": 40}
"""Of ``rcl_interfaces/msg/Log``."""
OK: Final = 0
WARNING: Final = 1
ERROR: Final = 2
"""Of ``diagnostic_msgs/msg/DiagnosticStatus``."""
Row = tuple[float, str, Any]
"""Time in s, topic, message."""


class RosMessages:
    """Makes messages of a log's rows."""

    def __init__(
        self,
        new: Callable[[str, Mapping[str, Any]], Any],
        floats: Callable[[Floats], Any],
        byte: Callable[[int], Any] = int,
        ros_time_s: Callable[[float], float] = lambda time_s: time_s,
    ) -> None:
        """Take what makes a message.

        Args:
            new: makes a message of a type, such as ``sensor_msgs/msg/JointState``, and its fields.
            floats: what the library takes for a sequence of ``float64``.
            byte: what it takes for a ``byte``.
            ros_time_s: stamp of a time of the run's clock.

        """
        self._make, self._floats, self._byte, self._ros_time_s = new, floats, byte, ros_time_s

    def rows(self, record: RunRecord) -> Iterator[Row]:
        """All messages, topic by topic."""
        yield from self.joints(record)
        yield from self._frames(record)
        yield from self.head_poses(record)
        yield from self.imu(record)
        yield from self.paths(record)
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

    def joints(self, record: RunRecord) -> Iterator[Row]:
        """What was measured, and what was sent, in every cycle."""
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
            position=self._floats(position),
            velocity=self._floats(velocity),
            effort=self._floats(effort),
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

    def head_poses(self, record: RunRecord) -> Iterator[Row]:
        """Where the head was."""
        if not len(record.pose.time_s):
            return
        frames = body_frames(record)
        for k, time_s in enumerate(frames.time_s.tolist()):
            at, turn = frames.translation_m[k, 0], frames.quaternion[k, 0]
            yield time_s, "/head_pose", self._pose(time_s, at.tolist(), turn.tolist())

    def imu(self, record: RunRecord) -> Iterator[Row]:
        """Attitude and rate of a robot's IMU."""
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

    def paths(self, record: RunRecord) -> Iterator[Row]:
        """The plan's path, and those that took its place."""
        for time_s, points in record.paths:
            yield time_s, "/path", self._path(time_s, points)

    def _path(self, time_s: float, points_m: Floats) -> Any:
        level = np.hstack([points_m, np.zeros((len(points_m), 3 - points_m.shape[1]))])
        poses = [self._pose(time_s, point, [0.0, 0.0, 0.0, 1.0]) for point in level.tolist()]
        return self._new("nav_msgs/msg/Path", header=self._header(time_s, WORLD), poses=poses)

    def _diagnostics(self, record: RunRecord) -> Iterator[Row]:
        for k, time_s in enumerate(record.slow.time_s.tolist()):
            yield time_s, "/diagnostics", self.diagnostics(time_s, self.servos(record, k))

    def servos(self, record: RunRecord, k: int) -> list[Any]:
        """Return the status of every servo in a row of ``/slow``."""
        slow, robot = record.slow, record.header.robot
        return [
            self.status(
                f"joint{joint}",
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
        return self._new(
            "diagnostic_msgs/msg/DiagnosticStatus",
            level=self._byte(level),
            name=name,
            message=text,
            hardware_id=hardware,
            values=[
                self._new("diagnostic_msgs/msg/KeyValue", key=key, value=value)
                for key, value in values.items()
            ],
        )

    def diagnostics(self, time_s: float, status: list[Any]) -> Any:
        """Return a ``DiagnosticArray``."""
        kind = "diagnostic_msgs/msg/DiagnosticArray"
        return self._new(kind, header=self._header(time_s, ""), status=status)

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
        seconds, nanoseconds = divmod(round(self._ros_time_s(time_s) * 1e9), 1_000_000_000)
        return self._new("builtin_interfaces/msg/Time", sec=seconds, nanosec=nanoseconds)

    def _xyz(self, kind: str, values: list[float]) -> Any:
        return self._new(f"geometry_msgs/msg/{kind}", x=values[0], y=values[1], z=values[2])

    def _quaternion(self, values: list[float]) -> Any:
        x, y, z, w = values
        return self._new("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)

    def _new(self, kind: str, **fields: Any) -> Any:
        return self._make(kind, fields)
