"""Poses of a ROS 2 topic as a pose source: PoseStamped, Odometry, transforms of /tf and others.

A separate process passes each pose on in the format of ``controller/pose/datagram.py``, so the run
imports no ROS.
"""

import os
import re
import threading
from contextlib import suppress
from multiprocessing.connection import Connection

from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.console.child_process import pipe, start
from snakewalk.controller.console.command import plugin
from snakewalk.controller.exchange.ros_messages import FRAMES
from snakewalk.controller.pose.udp_feed import PoseQueue
from snakewalk.controller.ros.ros_options import READY, RosOptions, not_loaded
from snakewalk.controller.run.external.external_source import ExternalSource
from snakewalk.drivers.clock import Clock

_START_S = 60.0
_END_S = 2.0


@plugin("pose", "ros")
class RosPose(ExternalSource):
    """Poses of a ROS 2 topic: ros:/TOPIC, or ros:/tf:FRAME."""

    name = "ros"

    def faults(
        self, run: RunConfig, robot: RobotConfig, world: WorldConfig, *, on_port: bool
    ) -> list[str]:
        """Return why the source cannot work in a run, one line per fault."""
        require_extra("pose: ROS needs", "rclpy")
        return super().faults(run, robot, world, on_port=on_port)

    def check_argument(self, argument: str) -> None:
        """Check the name of the topic."""
        check_topic(argument)

    def open_feed(self, argument: str, clock: Clock) -> "RosPoseFeed":
        """Subscribe to the topic.

        Raises:
            InputError: rclpy is not installed, or the node cannot start.

        """
        require_extra("pose: ROS needs", "rclpy")
        check_topic(argument)
        return RosPoseFeed(argument, clock)


def check_topic(argument: str) -> None:
    """Check the name of a topic, and of the body's frame if the topic has transforms.

    Raises:
        InputError: it is not the name of a topic.

    """
    topic, colon, child = argument.partition(":")
    is_name = re.fullmatch(r"(/[A-Za-z_]\w*)+", topic, re.ASCII)
    if not is_name or (colon and not re.fullmatch(r"[\w/.-]{1,100}", child, re.ASCII)):
        raise InputError(
            f"--pose ros:{argument}: expected ros:/TOPIC or ros:/tf:FRAME; for example "
            "ros:/tracker/pose or ros:/tf:snake_head"
        )
    if topic in (FRAMES, f"{FRAMES}_static") and not child:
        raise InputError(f"--pose ros:{argument}: name the body's frame; ros:{topic}:FRAME")


class RosPoseFeed(PoseQueue):
    """Receives the poses of a topic from the process that subscribes to it.

    Raises:
        InputError: the node cannot start.

    """

    def __init__(self, topic: str, clock: Clock) -> None:
        super().__init__(clock)
        self._topic = topic
        self._end, far = pipe()
        self._process = start(_serve, far, topic, daemon=True)
        far.close()
        said = b"the node did not start; its own messages name the cause"
        with suppress(EOFError, OSError):
            if self._end.poll(_START_S):
                said = self._end.recv_bytes()
        if said != READY:
            self._process.kill()
            raise InputError(f"pose ros:{topic}: {said.decode()}")
        self._thread = threading.Thread(target=self._receive, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the process."""
        with suppress(OSError):
            self._end.send_bytes(b"end")
        self._process.join(_END_S)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        self._thread.join()
        self._end.close()

    def _receive(self) -> None:
        with suppress(EOFError, OSError):
            while True:
                self.put(self._end.recv_bytes(), self._topic)


def _serve(line: Connection, topic: str) -> None:
    os.environ.update(RosOptions().environ(os.environ))
    try:
        from snakewalk.controller.ros.ros_pose_node import serve  # noqa: PLC0415  rclpy stays here
    except ImportError as error:
        line.send_bytes(not_loaded(error).encode())
        return
    serve(line, topic)
