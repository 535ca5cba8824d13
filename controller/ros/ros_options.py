"""Place of a robot in a ROS graph, and the inputs that it accepts from there."""

from collections.abc import Mapping
from dataclasses import dataclass

from snakewalk.controller.motion.command import TIMEOUT_S

READY = b"ready"
"""First message of a process with a node that passes poses on."""
_RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
_SAYS_WHERE = (_RANGE, "ROS_LOCALHOST_ONLY", "ROS_STATIC_PEERS")


@dataclass(frozen=True, slots=True)
class RosOptions:
    """Where in a ROS graph a robot is."""

    domain: int | None = None
    """Domain of ROS; None: that of ``ROS_DOMAIN_ID``, or 0."""
    namespace: str = ""
    network: bool = False
    """Whether other machines see the node; else only this one, or as the environment states."""
    commands: bool = False
    """Whether the node accepts commands; the stop service always exists."""
    goals: bool = False
    """Whether it accepts goal poses, of a run along waypoints."""
    timeout_s: float = TIMEOUT_S
    """Commands with an older stamp are refused."""

    def environ(self, given: Mapping[str, str]) -> dict[str, str]:
        """Return the additional environment variables of the node's process."""
        if self.network:
            return {_RANGE: "SUBNET"}
        return {} if any(given.get(name) for name in _SAYS_WHERE) else {_RANGE: "LOCALHOST"}


def not_loaded(error: ImportError) -> str:
    """Return why rclpy, which is installed, cannot be loaded."""
    reason = next(iter(str(error).splitlines()), type(error).__name__)
    return f"rclpy cannot be loaded: {reason}; check that `import rclpy` works in this environment"
