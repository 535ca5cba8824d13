"""A ROS graph of this machine alone, in a domain of the test's own."""

import os
from collections.abc import Callable
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor

LOOPBACK = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
DOMAIN = 1 + os.getpid() % 100
"""Tests that run beside this one are in others."""


class Client:
    """Somebody else's node, by rclpy; it waits for what it hears."""

    def __init__(self) -> None:
        context = Context()
        rclpy.init(context=context, domain_id=DOMAIN)
        self.node = rclpy.create_node("client", context=context)
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self.node)

    def listen(self, kind: type, topic: str, quality: object = 1000) -> list[Any]:
        heard: list[Any] = []
        self.node.create_subscription(kind, topic, heard.append, quality)
        return heard

    def spin(self) -> None:
        """Take what has come."""
        self._executor.spin_once(timeout_sec=0.0)

    def until(self, what: Callable[[], object], within_s: float = 300.0) -> None:
        clock = self.node.get_clock()
        end_ns = clock.now().nanoseconds + round(within_s * 1e9)
        while not what():
            assert clock.now().nanoseconds < end_ns, "it has not come"
            self._executor.spin_once(timeout_sec=0.1)

    def close(self) -> None:
        self._executor.shutdown()
        self.node.destroy_node()
        self.node.context.shutdown()
