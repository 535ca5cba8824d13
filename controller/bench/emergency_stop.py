"""Emergency stop: latches the runs of other programs; imports little, to be quick.

The stop button of a run latches it within a cycle. A run that does not reply is terminated, so that
its safe link switches torque off; then it is killed, and the bus watchdogs stop the servos.
"""

import os
import signal
from collections.abc import Iterable
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from typing import Final, Literal

from snakewalk.drivers.clock import WallClock
from snakewalk.drivers.port.port_map import ports_in
from snakewalk.drivers.safety.stop_button import PressedButton, resolved, stoppable_runs

How = Literal["latched", "terminated", "killed", "torque off"]
LATCH_S: Final = 1.0
"""Longest time of a run until it latches (ours): a cycle lasts some 10 ms, the set-up longer."""
END_S: Final = 3.0
"""Longest time of a terminated run until torque is off: it asks for 2 s (ours)."""
_LOOK_S: Final = 1e-3


@dataclass(frozen=True, slots=True)
class StopOutcome:
    """A stopped run or port, and the method."""

    what: str
    """Name of a run, or a port."""
    how: How
    text: str
    """State of torque, for people."""
    safe: bool
    """Whether torque is known to be off."""
    after_s: float | None = None
    """From the request until the run had switched torque off; None where no run held the port."""
    process: int | None = None
    ports: tuple[str, ...] = ()
    folder: str | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Its ports; the run's name where it holds none."""
        return self.ports or (self.what,)

    def to_dict(self) -> dict[str, object]:
        """For JSON."""
        return asdict(self) | {"port": ", ".join(self.ports) or None}


def runs_of(port: str | None = None, run: str | None = None) -> list[PressedButton]:
    """Open the buttons of the runs meant, the newest first.

    Args:
        port: the run that holds this device, or URL; of several (``1-8=PORT,9-16=PORT``) any.
        run: name, folder, log or process of a run.

    With neither: all runs that hold a port, else the newest simulated one.

    """
    every = list(stoppable_runs())
    if port is not None:
        asked = set(map(resolved, ports_in(port)))
        meant = [button for button in every if asked & set(button.run.ports)]
    elif run is not None:
        meant = [button for button in every if _is_meant(button, run)]
    else:
        meant = [button for button in every if button.run.ports] or every[:1]
    for button in every:
        if button not in meant:
            button.close()
    return meant


def _is_meant(button: PressedButton, run: str) -> bool:
    known, path = button.run, os.path.realpath(run)
    where = None if known.folder is None else os.path.realpath(known.folder)
    return run in (known.name, str(known.process)) or where in (path, os.path.dirname(path))


def stop_runs(buttons: Iterable[PressedButton], who: str) -> list[StopOutcome]:
    """Press all buttons, then wait for each run; escalate where one does not answer."""
    clock = WallClock()
    with ExitStack() as stack:
        opened = [stack.enter_context(button) for button in buttons]
        for button in opened:
            button.press(who)
        return [_ended(button, clock) for button in opened]


def _ended(button: PressedButton, clock: WallClock) -> StopOutcome:
    how: How = "latched"
    signals: tuple[tuple[signal.Signals | None, How, float], ...] = (
        (None, "latched", LATCH_S),
        (signal.SIGTERM, "terminated", END_S),
        (signal.SIGKILL, "killed", END_S),
    )
    for number, name, patience_s in signals:
        if number is not None and button.is_held:
            how = name
            os.kill(button.run.process, number)
        until_s = clock.now_s() + patience_s
        while button.end is None and button.is_held and clock.now_s() < until_s:
            clock.sleep_until_s(clock.now_s() + _LOOK_S)
        if button.end is not None or not button.is_held:
            break
    after_s, run, said = clock.now_s(), button.run, button.end
    safe = said is not None and "torque off failed" not in said and "torque may be on" not in said
    if said is None:
        said = "it ended without a word" if not button.is_held else "it does not end"
        safe = not run.ports and not button.is_held
    return StopOutcome(
        run.name, how, said, safe, round(after_s, 4), run.process, run.ports, run.folder
    )
