"""A log as a ROS 2 bag: one MCAP file of profile ``ros2`` with messages in CDR. Needs rosbags.

Messages carry the run's clock, which begins near 0 s: play the bag with ``--clock`` and
``use_sim_time``. Frames and joints have the names of the URDF that ``robot export`` writes.
"""

from operator import itemgetter
from pathlib import Path
from typing import Any, Final

import numpy as np
from mcap.writer import Writer

from snakewalk.controller.exchange.imu_readings import IMU_TOPIC, recorded_topics
from snakewalk.controller.exchange.ros_messages import RosMessages
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
_BY_TIME: Final = itemgetter(0)


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
        messages = RosMessages(
            lambda kind, fields: store.types[kind](**fields), np.ascontiguousarray
        )
        for time_s, topic, message in sorted(messages.rows(record), key=_BY_TIME):
            stamp_ns = round(time_s * 1e9)
            data = store.serialize_cdr(message, _TOPICS[topic])
            writer.add_message(channels[topic], stamp_ns, bytes(data), publish_time=stamp_ns)
            counts[topic] += 1
        writer.finish()
    return counts
