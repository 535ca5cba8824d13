"""A bag read back by two readers of other people: every number, in ROS 2's own encoding."""

from collections import defaultdict
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from snakewalk.controller.exchange.body_frames import body_frames
from snakewalk.controller.exchange.ros_bag import write_ros_bag
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.runlog.topics import ImuTable

pytest.importorskip("rosbags")
Messages = dict[str, list[tuple[int, Any]]]


def by_mcap_ros2(path: Path) -> Messages:
    reader = pytest.importorskip("mcap_ros2.reader")
    out: Messages = defaultdict(list)
    for one in reader.read_ros2_messages(path):
        out[one.channel.topic].append((one.log_time_ns, one.ros_msg))
    return out


def by_rosbags(path: Path) -> Messages:
    from rosbags.rosbag2.storage_mcap import McapReader
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)  # another release than the one that wrote
    reader = McapReader(path)
    reader.open()
    out: Messages = defaultdict(list)
    for connection, time_ns, data in reader.messages(reader.connections):
        message = store.deserialize_cdr(data, connection.msgtype)
        out[connection.topic].append((time_ns, message))
    reader.close()
    return out


@pytest.fixture(scope="module", params=[by_mcap_ros2, by_rosbags], ids=["mcap-ros2", "rosbags"])
def bag(
    request: pytest.FixtureRequest, record: RunRecord, tmp_path_factory: pytest.TempPathFactory
) -> Messages:
    path = tmp_path_factory.mktemp("bag") / "bag.mcap"
    counts = write_ros_bag(record, path)
    messages: Messages = request.param(path)
    assert {topic: len(rows) for topic, rows in messages.items()} == counts
    return messages


def stamp_ns(stamp: Any) -> int:
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def test_joints(bag: Messages, record: RunRecord) -> None:
    cycle = record.cycle
    for k, (time_ns, state) in enumerate(bag["/joint_states"]):
        assert time_ns == stamp_ns(state.header.stamp) == round(cycle.time_s[k] * 1e9)
        assert tuple(state.name) == record.header.robot.joint_names
        np.testing.assert_array_equal(state.position, cycle.measured_rad[k])
        np.testing.assert_array_equal(state.velocity, cycle.velocity_rad_s[k])
        np.testing.assert_allclose(state.effort, 1.78 * cycle.current_a[k])
    for k, (_, goal) in enumerate(bag["/joint_goals"]):
        np.testing.assert_array_equal(goal.position, cycle.sent_rad[k])
        assert len(goal.velocity) == len(goal.effort) == 0


def test_frames_and_pose(bag: Messages, record: RunRecord) -> None:
    frames = body_frames(record)
    for k, (_, message) in enumerate(bag["/tf"]):
        assert tuple(t.child_frame_id for t in message.transforms) == frames.names
        assert tuple(t.header.frame_id for t in message.transforms) == frames.parents
        for link, t in enumerate(message.transforms):
            at, turn = t.transform.translation, t.transform.rotation
            np.testing.assert_array_equal([at.x, at.y, at.z], frames.translation_m[k, link])
            np.testing.assert_array_equal(
                [turn.x, turn.y, turn.z, turn.w], frames.quaternion[k, link]
            )
    for k, (_, message) in enumerate(bag["/head_pose"]):
        assert message.header.frame_id == "world"
        turn = message.pose.orientation
        matrix = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_matrix()
        np.testing.assert_allclose(matrix, record.pose.rotation[k], atol=2e-6)


def test_paths_diagnostics_and_events(bag: Messages) -> None:
    first, second = (message for _, message in bag["/path"])
    assert [p.pose.position.x for p in first.poses] == [0.0, 2.0]
    assert [p.pose.position.z for p in second.poses] == [0.5, 0.4]
    assert stamp_ns(second.header.stamp) == 200_000_000
    worst = bag["/diagnostics"][-1][1].status[4]
    level = worst.level if isinstance(worst.level, int) else ord(worst.level)
    assert (level, worst.message) == (2, "hardware error 0x20")
    assert {v.key: v.value for v in worst.values} == {"temperature_c": "31", "voltage_v": "12"}
    assert [(m.level, m.msg) for _, m in bag["/rosout"]] == [
        (20, 'start: torque on; "quoted", ünïcode'),
        (40, "trip: joint 7: current"),
    ]


def test_attitude_is_told_once_a_reading(bag: Messages, record: RunRecord) -> None:
    config = record.header.robot.imu
    assert config is not None
    rows = [3, 4, 5, 6, 7, 8, 9, 10, 13, 14, 15, 16, 17, 18, 19]  # silent at 11 and 12
    assert len(bag["/imu"]) == len(rows)
    for (time_ns, message), row in zip(bag["/imu"], rows, strict=True):
        assert time_ns == stamp_ns(message.header.stamp) == 20_000_000 * row - 2_000_000
        assert message.header.frame_id == f"link{config.link}"
        turn = message.orientation
        matrix = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_matrix()
        np.testing.assert_allclose(matrix, record.imu.rotation[row - 3], atol=2e-6)
        rate = message.angular_velocity
        np.testing.assert_allclose([rate.x, rate.y, rate.z], [0.1, -0.2, 0.01 * row])
        assert message.linear_acceleration_covariance[0] == -1.0  # not in the log


def test_a_log_without_attitude_has_no_such_topic(record: RunRecord, tmp_path: Path) -> None:
    table = record.imu
    none = ImuTable(*(getattr(table, name)[:0] for name in table.__dataclass_fields__))
    counts = write_ros_bag(replace(record, imu=none), tmp_path / "bag.mcap")
    assert "/imu" not in counts
    assert "/imu" not in by_rosbags(tmp_path / "bag.mcap")


def test_rclpy_reads_every_message_whose_package_it_has(record: RunRecord, tmp_path: Path) -> None:
    pytest.importorskip("rclpy", reason="rclpy is in the extra ros, for Linux on x86-64")
    from mcap.reader import make_reader
    from rclpy.serialization import deserialize_message

    write_ros_bag(record, tmp_path / "bag.mcap")
    theirs = by_rosbags(tmp_path / "bag.mcap")
    read: dict[str, int] = defaultdict(int)
    with (tmp_path / "bag.mcap").open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            assert schema is not None
            package, folder, name = schema.name.split("/")
            if package == "tf2_msgs":  # has no wheel
                continue
            kind = getattr(import_module(f"{package}.{folder}"), name)
            ours = deserialize_message(message.data, kind)
            same(ours, theirs[channel.topic][read[channel.topic]][1])
            read[channel.topic] += 1
    assert {topic: len(rows) for topic, rows in theirs.items() if topic != "/tf"} == read


def same(ours: Any, theirs: Any) -> None:
    """Compare a message of rclpy with one of rosbags, field by field."""
    if hasattr(ours, "get_fields_and_field_types"):
        for name in ours.get_fields_and_field_types():
            same(getattr(ours, name), getattr(theirs, name))
    elif isinstance(ours, str):
        assert ours == theirs
    elif isinstance(ours, bytes):  # a byte
        assert ours[0] == theirs
    elif hasattr(ours, "__len__"):
        assert len(ours) == len(theirs)
        for one, other in zip(ours, theirs, strict=True):
            same(one, other)
    else:
        assert ours == theirs or (np.isnan(ours) and np.isnan(theirs))
