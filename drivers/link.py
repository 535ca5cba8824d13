"""The joint link: the one door between whatever decides motion and whatever moves."""

from typing import Protocol

from drivers.types import JointCommand, JointState


class JointLink(Protocol):
    """Enable, read, write, disable; every backend passes the same contract tests."""

    @property
    def joint_count(self) -> int:
        """Number of joints J."""
        ...

    def enable(self) -> JointState:
        """Verify the servos, set goal = present, switch torque on; returns the state found."""
        ...

    def disable(self) -> None:
        """Switch torque off; safe to call at any time, more than once."""
        ...

    def read(self) -> JointState:
        """Read all joints once."""
        ...

    def write(self, command: JointCommand) -> None:
        """Send goal positions."""
        ...
