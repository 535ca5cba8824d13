"""Recovery: the reaction to a lost line or servo during a run.

The watchdogs hold the servos meanwhile. The recovery reopens the port, compares the chain with its
earlier state, and continues from the present pose if the policy or an operator permits it. A servo
that an overload has shut down is rebooted first, if the run permits it.
"""

import math
from collections.abc import Callable
from typing import Literal

from snakewalk.config.arrays import Floats
from snakewalk.drivers.chain.recheck import Recheck
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import ChainError, DriverError, FaultCause, PortError
from snakewalk.drivers.types import JointState

Policy = Literal["stop", "confirm", "resume"]
_RETRY_S = 0.1


class Recovery:
    """Recovers an interrupted chain a few times; pass it to ``SafeLink(recovery=...)``."""

    def __init__(
        self,
        chain: ServoChain,
        *,
        policy: Policy = "stop",
        patience_s: float = 10.0,
        limit: int = 3,
        overload_reboots: int = 0,
        confirm: Callable[[str], bool] | None = None,
        on_event: Callable[[str], None] = lambda line: None,
    ) -> None:
        """Prepare.

        Args:
            chain: the chain to recover.
            policy: ``stop``: never continue; ``confirm``: ask; ``resume``: continue if nothing
                changed.
            patience_s: wait for port and servos.
            limit: number of recoveries in a run.
            overload_reboots: number of reboots after overloads, whatever the policy; ``confirm``
                asks an operator as well.
            confirm: asks an operator about a finding. Whatever the policy, it is also asked if no
                servo confirms the same robot. None: the answer is no.
            on_event: gets every step as one line, for the log.

        """
        self._chain = chain
        self._clock = chain.clock
        self._policy = policy
        self._patience_s = patience_s
        self._remaining = limit
        self._confirm = confirm
        self._on_event = on_event
        self.overload_reboots = overload_reboots
        """Number of reboots after an overload that are left."""
        self.refusal: str | None = None
        """Why the last interruption was not recovered from; None if the policy forbids it."""

    def recover(
        self, reason: str, believed_rad: Floats, stopped: Callable[[], str | None]
    ) -> JointState | None:
        """Hold, wait, compare, ask, continue; None if a continuation is forbidden or impossible.

        ``believed_rad`` (J,) are the last credible angles. ``stopped`` is called while waiting; it
        returns a reason to give up, or None.

        Raises:
            ChainError: no servo confirms the same robot, and there is nobody to ask.
            DriverError: another fault during the continuation.

        """
        self.refusal = None
        if self._policy == "stop":
            return None
        if self._remaining <= 0:
            self.refusal = "no more interruptions are recovered from in this run"
            return None
        self._remaining -= 1
        event = f"interrupted: {reason}; the servos hold"
        return self._bring_back(event, believed_rad, stopped)

    def restart(
        self,
        joint: int,
        reason: str,
        believed_rad: Floats,
        stopped: Callable[[], str | None],
    ) -> JointState | None:
        """Hold, reboot a joint's servo, compare, continue; None as in ``recover``.

        An overload must be the only fault of ``joint``.

        Raises:
            DriverError: another fault during the continuation.

        """
        self.refusal = None
        if self.overload_reboots <= 0:
            return None
        self.overload_reboots -= 1
        left = self.overload_reboots or "no"
        text = f"{reason}: its servo is rebooted, the others hold; {left} more after this one"
        return self._bring_back(text, believed_rad, stopped, joint)

    def _bring_back(
        self,
        event: str,
        believed_rad: Floats,
        stopped: Callable[[], str | None],
        joint: int | None = None,
    ) -> JointState | None:
        self._on_event(event)
        checked = self._wait_for_chain(believed_rad, stopped, joint)
        if checked is None:
            return None
        self._on_event(f"verified: {checked}")
        doubt = checked.doubt if joint is None else None  # a rebooted servo is known
        if doubt is not None and self._confirm is None:
            raise ChainError(f"{doubt}; check that it is the same robot, then start again")
        is_asked = self._policy == "confirm" or doubt is not None
        if is_asked and not (self._confirm and self._confirm(str(checked))):
            self._give_up("not confirmed" if self._confirm else "not confirmed: nobody to ask")
            return None
        why = stopped()
        if why is not None:
            self._give_up(f"given up: {why}", why)
            return None
        state = self._chain.resume(checked)
        self._on_event("the run continues from the present position")
        return state

    def _wait_for_chain(
        self, believed_rad: Floats, stopped: Callable[[], str | None], joint: int | None
    ) -> Recheck | None:
        """A chain that may continue; None after ``patience_s``.

        The servo of ``joint`` is rebooted; a later alarm ends the wait.
        """
        give_up_s = self._clock.now_s() + self._patience_s
        is_holding = False
        to_reboot = joint
        while True:
            try:
                if not is_holding:
                    self._chain.hold()
                    is_holding = True
                if to_reboot is not None:
                    self._chain.reboot(to_reboot)
                    to_reboot = None
                checked = self._chain.recheck(believed_rad)
                last = str(checked)
                if not checked.faults:
                    return checked
                if joint is not None and any(f.cause is FaultCause.ALARM for f in checked.faults):
                    give_up_s = -math.inf
            except PortError as error:
                last = self._try_reopen() or str(error)
            except DriverError as error:
                last = str(error)
            why = stopped()
            if why is not None or self._clock.now_s() >= give_up_s:
                self._give_up(f"given up: {why or last}", why or last)
                return None
            self._clock.sleep_until_s(self._clock.now_s() + _RETRY_S)

    def _give_up(self, event: str, refusal: str | None = None) -> None:
        self.refusal = refusal or event
        self._on_event(event)

    def _try_reopen(self) -> str | None:
        """Open lost ports; return the reason of a failure."""
        try:
            self._chain.reopen()
        except PortError as error:
            return str(error)
        return None
