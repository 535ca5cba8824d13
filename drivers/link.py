"""The joint link: the interface between the controller and the joints."""

from types import TracebackType
from typing import Protocol, Self, runtime_checkable

from snakewalk.config.arrays import Bools, Floats
from snakewalk.drivers.types import JointCommand, JointState


@runtime_checkable
class ExplainingLink(Protocol):
    """A link that can look for the reason why a joint does not follow."""

    def explain(self, joint: int) -> str | None:
        """Return what is wrong with the goal that the joint's servo holds; None: nothing."""
        ...


class LoadEstimate(Protocol):
    """Estimates of a chain's current, and of the temperature of its motors."""

    current_a: float
    """Drawn by the chain now."""
    charge_ah: float
    """Drawn since the start."""
    hottest_c: float
    """Temperature of the hottest winding; -inf before one is known."""

    def winding_c(self, state: JointState) -> Floats:
        """(J,) temperatures of the windings."""
        ...


@runtime_checkable
class CheckingLink(Protocol):
    """A link that compares the servos with the values written to them, once a cycle."""

    def check_servos(self) -> None:
        """Make the check of this cycle, once its goals are sent.

        Raises:
            DriverError: a servo is not as it was set.

        """
        ...


@runtime_checkable
class SoftLink(Protocol):
    """A link whose joints can hold with low currents."""

    def hold_softly(self, current_a: Floats) -> None:
        """Hold where the joints are, with currents of at most ``current_a`` (J,)."""
        ...


@runtime_checkable
class LoadedLink(Protocol):
    """A link that estimates the load of its servos."""

    @property
    def load(self) -> LoadEstimate | None:
        """The estimates; None without records of the motors."""
        ...


@runtime_checkable
class HoldingLink(Protocol):
    """A link that may hold for a while after a trip; reads go on until it has ended."""

    @property
    def is_holding(self) -> bool:
        """Whether it holds."""
        ...


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


class CommandOutcome(Protocol):
    """Outcome of one command."""

    @property
    def goal_rad(self) -> Floats:
        """(J,) goals that were sent; on a veto the previous ones."""
        ...

    @property
    def clamped(self) -> Bools:
        """(J,) goals that were changed."""
        ...


class VettedLink(JointLink, Protocol):
    """A joint link that vets every command and switches torque off at the end of its context."""

    @property
    def tripped(self) -> str | None:
        """Why no command passes any more, one line; None while commands pass."""
        ...

    @property
    def last_verdict(self) -> CommandOutcome | None:
        """Outcome of the newest command; None before the first."""
        ...

    def __enter__(self) -> Self:
        """Enter the context; torque is off when it ends, also after an exception."""
        ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
        /,
    ) -> None:
        """Switch torque off."""
        ...
