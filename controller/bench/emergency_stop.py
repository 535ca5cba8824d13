"""Emergency stop: ``snakewalk stop`` without the command line; imports little, to be quick.

The stop button of a run latches it within a cycle. A run that does not reply is terminated, so that
its safe link switches torque off; then it is killed, and the bus watchdogs stop the servos. A run
is stopped before anything slow is imported, and torque off is on the wire before the servos are
asked for a confirmation.
"""

import json
import os
import select
import signal
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, suppress
from dataclasses import asdict, dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Literal

from snakewalk.config.errors import InputError
from snakewalk.config.plain_text import plain
from snakewalk.drivers.clock import WallClock
from snakewalk.drivers.errors import PortError
from snakewalk.drivers.port.port_holders import PortHolder, holders_of
from snakewalk.drivers.safety.stop_button import (
    BUTTON_SUFFIX,
    PressedButton,
    resolved,
    stoppable_runs,
)

How = Literal["latched", "terminated", "killed", "torque off", "not stopped", "port in use"]
LATCH_S = 1.0
"""Longest time of a run until it latches (ours): a cycle lasts some 10 ms, the set-up longer."""
END_S = 3.0
"""Longest time of a terminated run until torque is off: it asks for 2 s (ours)."""
_TORQUE_OFF = "snakewalk.controller.bench.torque_off"
_POLL_S = 1e-3


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
    """Time from the request until the run had switched torque off; None where no run held the
    port."""
    process: int | None = None
    ports: tuple[str, ...] = ()
    folder: str | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Ports of the run; its name if it has none."""
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
        asked = set(map(resolved, named_ports(port)))
        meant = [button for button in every if asked & set(button.run.ports)]
    elif run is not None:
        meant = [button for button in every if _is_button_of_run(button, run)]
    else:
        meant = [button for button in every if button.run.ports] or every[:1]
    for button in every:
        if button not in meant:
            button.close()
    return meant


def named_ports(port: str) -> list[str]:
    """Return the ports that ``--port`` names.

    Raises:
        InputError: unreadable text.

    """
    if "=" not in port:
        return [port]
    from snakewalk.drivers.port.port_map import ports_in  # noqa: PLC0415  slow to import

    return ports_in(port)


def _is_button_of_run(button: PressedButton, run: str) -> bool:
    meant_run = button.run
    path = os.path.realpath(run)
    where = None if meant_run.folder is None else os.path.realpath(meant_run.folder)
    return run in (meant_run.name, str(meant_run.process)) or where in (path, os.path.dirname(path))


def stop_runs(buttons: Iterable[PressedButton], sender: str) -> list[StopOutcome]:
    """Press all buttons, then wait for each run; escalate where one does not answer."""
    clock = WallClock()
    with ExitStack() as stack:
        opened = [stack.enter_context(button) for button in buttons]
        for button in opened:
            button.press(sender)
        return [_wait_for_end(button, clock) for button in opened]


def stop_holders(ports: Iterable[str], sender: str) -> list[StopOutcome]:
    """Stop programs of ours that have a port open, for which no folder of this login has a button.

    A run of another login is found by the device. A program without a button is terminated.
    """
    outcomes = []
    for port in ports:
        for holder in holders_of(port):
            if holder.has_other_end:
                continue
            button = _button_of(holder)
            if button is not None:
                outcomes += stop_runs([button], sender)
            elif holder.is_snakewalk:
                outcomes.append(_terminate_program(holder, port))
    return outcomes


def _button_of(holder: PortHolder) -> PressedButton | None:
    for file in holder.files:
        if file.endswith(BUTTON_SUFFIX):
            with suppress(OSError, ValueError, TypeError, KeyError):  # not a button, or unreachable
                button = PressedButton(Path(file))
                if button.process == holder.process:
                    return button
                button.close()
    return None


def _terminate_program(holder: PortHolder, port: str) -> StopOutcome:
    """End a program without a button; nothing is known of the torque after that."""
    clock = WallClock()
    how: How = "terminated"
    try:
        ended = os.pidfd_open(holder.process)
        try:
            waiting = select.poll()
            waiting.register(ended, select.POLLIN)
            os.kill(holder.process, signal.SIGTERM)
            if not waiting.poll(END_S * 1e3):
                how = "killed"
                os.kill(holder.process, signal.SIGKILL)
                waiting.poll(END_S * 1e3)
        finally:
            os.close(ended)
    except ProcessLookupError:  # it has ended meanwhile
        pass
    except PermissionError:
        return StopOutcome(
            holder.program,
            "not stopped",
            f"process {holder.process} belongs to user {holder.user}; end it by: sudo kill "
            f"{holder.process}",
            safe=False,
            ports=(resolved(port),),
        )
    text = f"process {holder.process} had {port} open"
    return StopOutcome(
        holder.program, how, text, False, round(clock.now_s(), 4), holder.process, (resolved(port),)
    )


def _wait_for_end(button: PressedButton, clock: WallClock) -> StopOutcome:
    how: How = "latched"
    signals: tuple[tuple[signal.Signals | None, How, float], ...] = (
        (None, "latched", LATCH_S),
        (signal.SIGTERM, "terminated", END_S),
        (signal.SIGKILL, "killed", END_S),
    )
    for number, name, patience_s in signals:
        process = button.process
        if number is not None and process is not None:
            how = name
            with suppress(ProcessLookupError):  # it has ended meanwhile
                os.kill(process, number)
        until_s = clock.now_s() + patience_s
        while button.end is None and button.is_held and clock.now_s() < until_s:
            clock.sleep_until_s(clock.now_s() + _POLL_S)
        if button.end is not None or not button.is_held:
            break
    after_s = clock.now_s()
    run = button.run
    said = button.end
    safe = said is not None and "torque off failed" not in said and "torque may be on" not in said
    if said is None:
        said = (
            "the program ended without a message"
            if not button.is_held
            else "the program does not end"
        )
        safe = not run.ports and not button.is_held
    return StopOutcome(
        run.name, how, said, safe, round(after_s, 4), run.process, run.ports, run.folder
    )


@dataclass(slots=True)
class Stop:
    """Values of the options of ``snakewalk stop``."""

    run: str | None = None
    port: str | None = None
    bauds: list[int] = field(default_factory=list)
    as_json: bool = False

    def carry_out(self) -> int:
        """Stop the runs meant, or the servos of a port; return the exit code.

        Raises:
            InputError: the run is unknown, or no port can be chosen.

        """
        run = self.run
        port = self.port
        if run is not None and port is not None:
            raise InputError("stop: a run and --port exclude each other; leave one out")
        sender = f"snakewalk stop (process {os.getpid()})"
        outcomes = stop_runs(runs_of(port, run), sender)
        if run is not None and not outcomes:
            raise InputError(f"{run}: no such run is active")
        devices = [] if outcomes else _free_ports(port)
        outcomes_of_holders = stop_holders(devices, sender)
        if outcomes_of_holders:
            outcomes = outcomes_of_holders
            devices = []
        # a run that was killed, or may not be ended, leaves its servos with torque on
        devices += [port for outcome in outcomes if not outcome.safe for port in outcome.ports]
        is_only = not outcomes and len(devices) == 1
        outcomes += _torque_off(dict.fromkeys(devices), self.bauds, is_only=is_only)
        return self._report(outcomes)

    def _report(self, outcomes: Sequence[StopOutcome]) -> int:
        stopped = {name for outcome in outcomes if outcome.safe for name in outcome.names}
        safe = all(name in stopped for outcome in outcomes for name in outcome.names)
        if self.as_json:
            print(
                json.dumps({"safe": safe, "stopped": [outcome.to_dict() for outcome in outcomes]})
            )
        else:
            for outcome in outcomes:
                after = "" if outcome.after_s is None else f" after {outcome.after_s * 1e3:.0f} ms"
                print(plain(f"{outcome.what}: {outcome.how}{after}: {outcome.text}"))
        return 0 if safe else 1


def stop_now(words: Sequence[str]) -> int | None:
    """Carry out ``snakewalk stop WORDS``; return the exit code, or None for other words.

    Raises:
        InputError: as ``Stop.carry_out``.

    """
    stop = stop_of_words(iter(words))
    return None if stop is None else stop.carry_out()


def stop_of_words(words: Iterator[str]) -> Stop | None:
    """Return the options; None for words that only the complete command line understands."""
    stop = Stop()
    for word in words:
        name, is_joined, value = word.partition("=")
        if word == "--json":
            stop.as_json = True
        elif name in {"--port", "--baud"}:
            value = value if is_joined else next(words, "")
            if name == "--port" and value and stop.port is None:
                stop.port = value
            elif name == "--baud" and value.isascii() and value.isdecimal():
                stop.bauds.append(int(value))
            else:
                return None
        elif word and not word.startswith("-") and stop.run is None:
            stop.run = word
        else:
            return None
    return stop


def _free_ports(port: str | None) -> list[str]:
    if port is not None:
        return named_ports(port)
    try:
        return [import_module(_TORQUE_OFF).only_port()]
    except PortError as fault:
        raise PortError(f"nothing to stop: this user has no run here; {fault}") from None


def _torque_off(
    devices: Iterable[str], bauds: Sequence[int], *, is_only: bool
) -> list[StopOutcome]:
    """Switch torque off on ports; the module is imported only if there are any.

    Raises:
        PortError: the only port cannot be opened, and no run was ended.

    """
    outcomes = []
    for device in devices:
        try:
            outcomes.append(import_module(_TORQUE_OFF).torque_off(device, bauds))
        except PortError as fault:  # the other ports still get torque off
            if is_only:
                raise
            outcomes.append(StopOutcome(device, "not stopped", str(fault), safe=False))
    return outcomes
