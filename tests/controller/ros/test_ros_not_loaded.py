"""An rclpy that is installed and cannot be loaded is reported in one line."""

import json
import os
import socket
import sys
from multiprocessing import Pipe

import pytest

from snakewalk.controller.ros import ros_link, ros_pose
from snakewalk.controller.ros.ros_options import RosOptions

PACKAGE = "snakewalk.controller.ros"


@pytest.fixture(autouse=True)
def broken(monkeypatch: pytest.MonkeyPatch) -> None:
    """Modules whose import fails, and an environment that is restored."""
    monkeypatch.setattr(os, "environ", dict(os.environ))
    for name in ("ros_node", "ros_pose_node"):
        monkeypatch.setitem(sys.modules, f"{PACKAGE}.{name}", None)


def test_a_node_that_cannot_load_rclpy_says_so() -> None:
    ours, far = socket.socketpair()
    with ours, far:
        ros_link._serve(far, RosOptions())
        fault = json.loads(ours.recv(4096))["fault"]
    assert fault.startswith(f"rclpy cannot be loaded: import of {PACKAGE}.ros_node halted")
    assert fault.endswith("; check that `import rclpy` works in this environment")


def test_a_pose_that_cannot_load_rclpy_says_so() -> None:
    ours, far = Pipe()
    with ours, far:
        ros_pose._serve(far, "/pose")
        assert ours.recv_bytes().startswith(b"rclpy cannot be loaded: ")
