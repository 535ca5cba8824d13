"""What happens when the line or a servo goes away in the middle of a run.

The servos hold by themselves: their watchdogs stop them where they are, torque on. Here the port is
opened again, the chain is verified against what it was, and it goes on from where it stands; but
only if the run's policy, or an operator, says so.
"""

from collections.abc import Callable
from typing import Literal, Protocol

from snakewalk.drivers.chain.recheck import Recheck
from snakewalk.drivers.clock import Clock
from snakewalk.drivers.errors import DriverError, PortError
from snakewalk.drivers.port.byte_port import BytePort, reopen
from snakewalk.drivers.types import JointState

Policy = Literal["stop", "confirm", "resume"]
_RETRY_S = 0.1


class RecoverableLink(Protocol):
    """What of a chain this needs."""

    def hold(self) -> None:
        """Goal = last seen position."""
        ...

    def recheck(self) -> Recheck:
        """Compare the chain with what it was."""
        ...

    def resume(self, found: Recheck) -> JointState:
        """Go on from where the joints are."""
        ...


class Recovery:
    """Brings an interrupted chain back, a few times; hand it to ``SafeLink(recovery=...)``."""

    def __init__(
        self,
        chain: RecoverableLink,
        port: BytePort,
        *,
        policy: Policy = "stop",
        patience_s: float = 10.0,
        limit: int = 3,
        confirm: Callable[[str], bool] | None = None,
        on_event: Callable[[str], None] = lambda line: None,
    ) -> None:
        """Prepare.

        Args:
            chain: to be brought back.
            port: that it is on.
            policy: ``stop``: never go on; ``confirm``: ask; ``resume``: go on if all is as it was.
            patience_s: how long to wait for port and servos.
            limit: interruptions in one run after which none is mended any more.
            confirm: asks an operator; gets what was found; without one ``confirm`` means no.
            on_event: gets every step as one line, for the log.

        """
        self._chain, self._port, self._clock = chain, port, port.clock
        self._policy, self._patience_s, self._left = policy, patience_s, limit
        self._confirm, self._on_event = confirm, on_event

    def recover(self, reason: str, stopped: Callable[[], str | None]) -> JointState | None:
        """Hold, wait, verify, ask, go on; None if it must not or cannot go on.

        Args:
            reason: of the interruption.
            stopped: asked while waiting; a reason to give up, or None.

        Raises:
            DriverError: it broke again while going on.

        """
        if self._policy == "stop" or self._left <= 0:
            return None
        self._left -= 1
        self._on_event(f"interrupted: {reason}; the servos hold")
        found = self._wait(self._clock, stopped)
        if found is None:
            return None
        self._on_event(f"verified: {found}")
        if self._policy == "confirm" and not (self._confirm and self._confirm(str(found))):
            self._on_event("not confirmed")
            return None
        state = self._chain.resume(found)
        self._on_event("going on from where it stands")
        return state

    def _wait(self, clock: Clock, stopped: Callable[[], str | None]) -> Recheck | None:
        """A chain that may go on; None if it does not come back in time."""
        give_up_s = clock.now_s() + self._patience_s
        held = False
        while True:
            try:
                if not held:
                    self._chain.hold()
                    held = True
                found = self._chain.recheck()
                last = str(found)
                if not found.faults:
                    return found
            except PortError as error:
                last = str(error)
                self._try_reopen()
            except DriverError as error:
                last = str(error)
            why = stopped()
            if why is not None or clock.now_s() >= give_up_s:
                self._on_event(f"given up: {why or last}")
                return None
            clock.sleep_until_s(clock.now_s() + _RETRY_S)

    def _try_reopen(self) -> None:
        try:
            reopen(self._port)
        except PortError:
            return  # not yet back; the caller's patience decides
