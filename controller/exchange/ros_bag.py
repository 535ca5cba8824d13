"""A log as a ROS 2 bag: one MCAP file of profile ``ros2`` with CDR messages. Needs rosbags.

Messages have the run's clock, which begins near 0 s: play the bag with ``--clock`` and
``use_sim_time``.
"""

from collections import Counter
from functools import cache
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import Writer

from snakewalk.controller.exchange.ros_messages import RosMessages
from snakewalk.controller.runlog.record import RunRecord


def write_ros_bag(record: RunRecord, path: Path) -> dict[str, int]:
    """Write a bag; returns the number of messages of each topic."""
    from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415  an extra

    store: Any = get_typestore(Stores.ROS2_JAZZY)
    messages = RosMessages(lambda kind, fields: store.types[kind](**fields), np.ascontiguousarray)
    counts: Counter[str] = Counter()
    with path.open("wb") as file:
        writer: Any = Writer(file)
        writer.start(profile="ros2", library=f"snakewalk {record.header.software}")

        @cache
        def schema(kind: str) -> int:
            text = store.generate_msgdef(kind, ros_version=2)[0]
            return int(writer.register_schema(kind, "ros2msg", text.encode()))

        @cache
        def channel(topic: str, kind: str) -> int:
            quality = {"offered_qos_profiles": ""}
            return int(writer.register_channel(topic, "cdr", schema(kind), quality))

        for time_s, topic, kind, message in sorted(messages.rows(record), key=itemgetter(0)):
            stamp_ns = round(time_s * 1e9)
            data = bytes(store.serialize_cdr(message, kind))
            writer.add_message(channel(topic, kind), stamp_ns, data, publish_time=stamp_ns)
            counts[topic] += 1
        writer.add_metadata("pose", record.header.pose_evidence.texts)
        writer.finish()
    return dict(counts)
