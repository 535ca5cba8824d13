"""The process that subscribes to a topic with poses, and passes each one on."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
import rclpy
from geometry_msgs.msg import Point, Pose, PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile, qos_profile_sensor_data

from snakewalk.controller.pose.datagram import encode_pose
from snakewalk.controller.pose.sample import PoseSample, UnusablePoseError, rotation_of
from snakewalk.controller.ros.ros_options import READY

KINDS: dict[str, tuple[Any, bool]] = {
    "geometry_msgs/msg/PoseStamped": (PoseStamped, False),
    "geometry_msgs/msg/PoseWithCovarianceStamped": (PoseWithCovarianceStamped, True),
    "nav_msgs/msg/Odometry": (Odometry, True),
}
"""Message types, and whether they have a covariance."""
SPIN_S = 0.05


TRANSFORMS = "tf2_msgs/msg/TFMessage"


def serve(line: Connection, argument: str) -> None:
    """Pass the poses of a topic on until the run sends something, or ends."""
    topic, _, child = argument.partition(":")
    if child and find_spec("tf2_msgs") is None:
        line.send_bytes(b"tf2_msgs is not installed; install ros-jazzy-tf2-msgs of ROS 2")
        return
    rclpy.init()
    node = rclpy.create_node("snakewalk_pose")
    line.send_bytes(READY)
    send = _Sender(line)
    is_subscribed = False
    with suppress(BrokenPipeError, EOFError, ConnectionError):
        while not line.poll(0.0):
            is_subscribed = is_subscribed or _subscribe(node, topic, child, send)
            rclpy.spin_once(node, timeout_sec=SPIN_S)
    node.destroy_node()
    rclpy.shutdown()


def pose_of(message: Any, sequence: int, *, has_covariance: bool) -> bytes:
    """Return a message as a datagram; a message without a pose becomes a text that says why."""
    pose = message.pose.pose if has_covariance else message.pose
    place = pose.position
    turn = pose.orientation
    stamp = message.header.stamp
    covariance = None
    if has_covariance:
        covariance = np.array(message.pose.covariance, dtype=float).reshape(6, 6)
    try:
        rotation = rotation_of((turn.w, turn.x, turn.y, turn.z))
    except UnusablePoseError as fault:
        return str(fault).encode()
    is_known = covariance is not None and bool(covariance.any())
    return encode_pose(
        PoseSample(
            sequence,
            stamp.sec + 1e-9 * stamp.nanosec,
            np.array([place.x, place.y, place.z]),
            rotation,
            message.header.frame_id,
            covariance if is_known else None,
        )
    )


def poses_of(message: Any, child: str) -> Iterator[PoseStamped]:
    """Return the transforms of a ``TFMessage`` to one frame as poses."""
    for transform in message.transforms:
        if transform.child_frame_id == child:
            place = transform.transform.translation
            turn = transform.transform.rotation
            pose = Pose(position=Point(x=place.x, y=place.y, z=place.z), orientation=turn)
            yield PoseStamped(header=transform.header, pose=pose)


class _Sender:
    """Counts the messages, and passes them on."""

    def __init__(self, line: Connection) -> None:
        self._line = line
        self._count = 0

    def __call__(self, message: Any, *, has_covariance: bool) -> None:
        self._line.send_bytes(pose_of(message, self._count, has_covariance=has_covariance))
        self._count += 1

    def transforms(self, message: Any, child: str) -> None:
        for pose in poses_of(message, child):
            self(pose, has_covariance=False)


def _subscribe(node: Any, topic: str, child: str, send: "_Sender") -> bool:
    on_message: Callable[[Any], None]
    for kind in dict(node.get_topic_names_and_types()).get(topic, []):
        if kind == TRANSFORMS and child:
            type_ = import_module("tf2_msgs.msg").TFMessage
            on_message = partial(send.transforms, child=child)
            # not best effort: on /tf a lost message may be the only one of a frame
            node.create_subscription(type_, topic, on_message, QoSProfile(depth=100))
            return True
        if kind in KINDS and not child:
            type_, has_covariance = KINDS[kind]
            on_message = partial(send, has_covariance=has_covariance)
            node.create_subscription(type_, topic, on_message, qos_profile_sensor_data)
            return True
    return False
