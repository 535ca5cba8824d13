"""The joint link: the interface between the controller and the joints."""

from collections.abc import Sequence
from typing import Any, Protocol, Self, runtime_checkable

from snakewalk.config.arrays import Bools, Floats
from snakewalk.drivers.types import JointCommand, JointState


@runtime_checkable
class ExplainingLink(Protocol):
    """A link that can find the reason why a joint does not follow, or was not read."""

    def explain(self, joint: int) -> str | None:
        """Return the fault of the goal in the joint's servo, or None."""
        ...

    def explain_silence(self, joints: Sequence[int]) -> str | None:
        """Return the reason why joints were not read, or None; torque is off."""
        ...


class LoadEstimate(Protocol):
    """Estimates of a chain's current and of its motors' temperatures."""

    current_a: float
    """Current that the chain draws now, A."""
    charge_ah: float
    """Charge that the chain has drawn since the start, A h."""
    hottest_c: float
    """Temperature of the hottest winding; -inf before one is known."""

    def winding_c(self, state: JointState) -> Floats:
        """(J,) winding temperatures."""
        ...


@runtime_checkable
class CheckingLink(Protocol):
    """A link that compares the servos with the values written to them, once per cycle."""

    def check_servos(self) -> None:
        """Make the check of this cycle, after its goals.

        Raises:
            DriverError: a servo differs from its settings.

        """
        ...


@runtime_checkable
class SoftLink(Protocol):
    """A link whose joints can hold with low currents."""

    def hold_softly(self, current_a: Floats) -> None:
        """Hold the present positions, with currents of at most ``current_a`` (J,)."""
        ...


@runtime_checkable
class LoadedLink(Protocol):
    """A link that estimates the load of its servos."""

    @property
    def load(self) -> LoadEstimate | None:
        """The estimates; None without motor records."""
        ...


@runtime_checkable
class HoldingLink(Protocol):
    """A link that may hold for a while after a trip; reads continue until then."""

    @property
    def is_holding(self) -> bool:
        """Whether the link holds."""
        ...


class JointLink(Protocol):
    """Enable, read, write, disable; every backend passes the same contract tests."""

    @property
    def joint_count(self) -> int:
        """Number of joints J."""
        ...

    def enable(self) -> JointState:
        """Verify the servos, set goal = present, switch torque on; return the state found."""
        ...

    def disable(self) -> None:
        """Switch torque off; safe to call at any time, repeatedly."""
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
        """(J,) goals that were sent; after a veto the previous ones."""
        ...

    @property
    def clamped(self) -> Bools:
        """(J,) goals that were changed."""
        ...


class VettedLink(JointLink, Protocol):
    """A joint link that vets every command and switches torque off at the end of its context."""

    @property
    def tripped(self) -> str | None:
        """Reason why no command passes, one line; None while commands pass."""
        ...

    @property
    def last_verdict(self) -> CommandOutcome | None:
        """Outcome of the newest command; None before the first."""
        ...

    def __enter__(self) -> Self:
        """Enter the context; torque is off when it ends, even after an exception."""
        ...

    def __exit__(self, kind: Any, error: Any, trace: Any, /) -> None:
        """Switch torque off."""
        ...
