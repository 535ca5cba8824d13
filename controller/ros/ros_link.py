"""The run's end of its ROS node: rows of the log out, commands in; it never waits for either."""

import json
import os
import socket
import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager

from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.controller.console.command import plugin
from snakewalk.controller.motion.command import Command, GoTo, Refused
from snakewalk.controller.ros.command_codec import decode_command
from snakewalk.controller.ros.ros_options import RosOptions, not_loaded
from snakewalk.controller.run.observer_process import ObserverProcess
from snakewalk.controller.run.observers import GOALS
from snakewalk.controller.walk.live_course import NEXT


class RosLink(ObserverProcess):
    """Serves a run's ROS node from a process of its own; use it in a ``with``.

    Raises:
        InputError: rclpy is not installed, or the node cannot be.

    """

    def __init__(self, options: RosOptions) -> None:
        require_extra("ROS needs", "rclpy")
        super().__init__(_serve, options, what="ROS node", fault="ROS")
        self.name = str(self.said["name"])
        """Name of the node, with its namespace."""
        self.domain = int(self.said["domain"])

    def commands(self) -> list[Command]:
        """Return the commands since the last call; never waits."""
        return [_decoded_command(line) for line in self._end.commands()]

    def waypoint_commands(self) -> list[str | Refused]:
        """Return the goal poses since the last call as commands of a ``LiveCourse``."""
        return [
            f"{NEXT}={command.x_m!r},{command.y_m!r}" if isinstance(command, GoTo) else command
            for command in self.commands()
            if isinstance(command, GoTo | Refused)
        ]


@contextmanager
def open_ros(options: RosOptions) -> Iterator[RosLink]:
    """Serve the ROS node of a run, and print its name."""
    with RosLink(options) as link:
        print(f"ROS: {link.name} in domain {link.domain}", file=sys.stderr, flush=True)
        yield link


@plugin("observer", "ros")
def open_node(argument: str) -> AbstractContextManager[RosLink]:
    """ROS 2 node that publishes a run and offers a stop service."""
    if argument not in ("", GOALS):
        raise InputError(f"--observe ros:{argument}: expected ros or ros:{GOALS}")
    return open_ros(RosOptions(goals=argument == GOALS))


def _decoded_command(line: str) -> Command:
    try:
        return decode_command(line)
    except InputError as error:
        return Refused(error.faults[0])


def _serve(line: socket.socket, options: RosOptions) -> None:
    os.environ.update(options.environ(os.environ))
    try:
        from snakewalk.controller.ros.ros_node import serve  # noqa: PLC0415  rclpy stays here
    except ImportError as error:
        line.sendall(json.dumps({"fault": not_loaded(error)}).encode() + b"\n")
        return
    serve(line, options)
