"""Commands of the page on their way to the run: each carries the time at which it began."""

from collections.abc import Callable, Iterable

from snakewalk.controller.motion.command import LATE_S, Refused
from snakewalk.controller.motion.refusals import NAME_MAX
from snakewalk.controller.view.dead_man import HOLD, DeadMan

_MOST_AHEAD_S = 0.1
"""A later time is not believed (ours): both processes read the same clock."""


def timed(command: str, since_s: float) -> str:
    """Return the line of a command that began at ``since_s`` of this machine's clock or later."""
    return f"{since_s:.3f} {command}"


def fresh_commands(
    lines: Iterable[str], dead_man: DeadMan, now_s: Callable[[], float]
) -> list[str | Refused]:
    """Return the commands of lines without those of a gamepad's state, and reasons for dropped."""
    commands = [in_time(line, now_s) for line in lines]
    fresh = dead_man.process([command for command in commands if isinstance(command, str)])
    return [*fresh, *(command for command in commands if isinstance(command, Refused))]


def in_time(line: str, now_s: Callable[[], float]) -> str | Refused:
    """Return the command of a line, or the reason why it is dropped.

    The state of a gamepad passes at any age: it has a time of its own, and may end a motion.
    """
    text, _, command = line.partition(" ")
    try:
        age_s = now_s() - float(text)
    except ValueError:
        return Refused(f"page: {line[:NAME_MAX]}: has no time; restart the program that sends it")
    if command.startswith(HOLD) and "@" in command:
        return command
    if -_MOST_AHEAD_S <= age_s <= LATE_S:
        return command
    return Refused(
        f"page: {command[:NAME_MAX]} came {age_s:.1f} s late and is dropped; at most {LATE_S:g} s "
        "is accepted; set it again"
    )
