"""Poses of a ROS 2 topic over real DDS."""

from collections.abc import Callable
from importlib.util import find_spec
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is in the extra ros, for Linux on x86-64")

from geometry_msgs.msg import (
    Pose,
    PoseStamped,
    PoseWithCovarianceStamped,
    TransformStamped,
    Vector3,
)
from nav_msgs.msg import Odometry
from std_msgs.msg import Header

from snakewalk.config.errors import InputError
from snakewalk.controller.pose.datagram import decode_pose
from snakewalk.controller.pose.sample import ArrivedPose, PoseSample, UnusablePoseError, turned
from snakewalk.controller.ros.ros_pose import RosPose, check_topic
from snakewalk.controller.ros.ros_pose_node import pose_of, poses_of
from snakewalk.drivers.clock import WallClock
from tests.helpers.ros_client import DOMAIN, LOOPBACK, Client


def a_pose(w: float = 0.5) -> Pose:
    pose = Pose()
    pose.position.x, pose.position.y, pose.position.z = 1.0, 2.0, 0.25
    q = pose.orientation
    q.w, q.x, q.y, q.z = w, 0.5, 0.5, 0.5
    return pose


def header() -> Header:
    made = Header(frame_id="lab")
    made.stamp.sec, made.stamp.nanosec = 12, 500_000_000
    return made


def with_covariance(kind: Any) -> Any:
    message = kind(header=header())
    message.pose.pose = a_pose()
    message.pose.covariance = (4e-4 * np.eye(6)).ravel()
    return message


KINDS: dict[Any, Callable[[], Any]] = {
    PoseStamped: lambda: PoseStamped(header=header(), pose=a_pose()),
    PoseWithCovarianceStamped: lambda: with_covariance(PoseWithCovarianceStamped),
    Odometry: lambda: with_covariance(Odometry),
}


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: str(kind.__name__))
def test_each_message_becomes_a_pose(kind: Any) -> None:
    has_covariance = kind is not PoseStamped
    sample = decode_pose(pose_of(KINDS[kind](), 3, has_covariance=has_covariance))
    assert (sample.sequence, sample.time_s, sample.frame) == (3, 12.5, "lab")
    assert sample.position_m.tolist() == [1.0, 2.0, 0.25]
    assert sample.rotation @ [1.0, 0.0, 0.0] == pytest.approx([0.0, 1.0, 0.0])
    assert (sample.covariance is not None) == has_covariance


def test_an_unknown_covariance_and_a_lost_body() -> None:
    empty = Odometry(header=header())
    empty.pose.pose = a_pose()
    assert decode_pose(pose_of(empty, 0, has_covariance=True)).covariance is None
    for broken in (a_pose(float("nan")), a_pose(90.0)):
        message = PoseStamped(header=header(), pose=broken)
        with pytest.raises(UnusablePoseError):
            decode_pose(pose_of(message, 0, has_covariance=False))


@pytest.mark.slow
def test_poses_arrive_over_dds(monkeypatch: pytest.MonkeyPatch) -> None:
    for key, value in {**LOOPBACK, "ROS_DOMAIN_ID": str(DOMAIN)}.items():
        monkeypatch.setenv(key, value)
    client = Client()
    feed = RosPose().open_feed("/tracker/pose", WallClock())
    arrived: list[ArrivedPose] = []
    try:
        publisher = client.node.create_publisher(PoseStamped, "/tracker/pose", 10)

        def has_arrived() -> bool:
            publisher.publish(PoseStamped(header=header(), pose=a_pose()))
            arrived.extend(feed.arrived(0.0))
            return len(arrived) >= 2

        client.until(has_arrived)
    finally:
        feed.close()
        client.close()
    sample = arrived[0].sample
    assert isinstance(sample, PoseSample)
    assert sample.rotation == pytest.approx(turned((90.0, 0.0, 90.0)))
    assert arrived[0].sender == "/tracker/pose"


def test_topics() -> None:
    check_topic("/tracker/pose")
    check_topic("/tf:lab/snake_head")
    with pytest.raises(InputError, match="name the body's frame"):
        check_topic("/tf")
    for wrong in ("", "pose", "/", "/a b", "/1", "/tf:", "/tf:a b"):
        with pytest.raises(InputError, match="expected ros:/TOPIC"):
            check_topic(wrong)


def test_the_transforms_of_one_frame_become_poses() -> None:
    head = TransformStamped(header=header(), child_frame_id="snake_head")
    at = a_pose().position
    head.transform.translation = Vector3(x=at.x, y=at.y, z=at.z)
    head.transform.rotation = a_pose().orientation
    other = TransformStamped(header=header(), child_frame_id="base")
    message = SimpleNamespace(transforms=[other, head])  # tf2_msgs has no wheel
    (pose,) = poses_of(message, "snake_head")
    assert pose_of(pose, 3, has_covariance=False) == pose_of(
        KINDS[PoseStamped](), 3, has_covariance=False
    )


@pytest.mark.slow
@pytest.mark.skipif(find_spec("tf2_msgs") is not None, reason="tf2_msgs is installed")
def test_transforms_without_their_messages_name_the_package() -> None:
    with pytest.raises(InputError, match="tf2_msgs is not installed; install ros-jazzy-tf2-msgs"):
        RosPose().open_feed("/tf:snake_head", WallClock())
