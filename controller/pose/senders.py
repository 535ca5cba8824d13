"""Which of the messages that arrive are those of the source: one sender, its order, its restarts.

The first sender counts, or the host that a file names. It may end and begin again: with another
port of the same host after a silence, with a lower sequence, or with a clock that was set back.
"""

from typing import Literal, NamedTuple

from snakewalk.controller.pose.sample import ArrivedPose, PoseSample, UnusablePoseError

RESTART_S = 1.0
"""Silence after which another sender on the same host replaces the first one, and step of the
stamps back that is another clock (ours)."""
MOST_LATE = 1000
"""Poses by which a late one may be behind the newest (ours)."""


Content = PoseSample | UnusablePoseError


Order = Literal["next", "restarted", "late", "other"]
"""Place of a message: after the newest one, first of a sender that begins again, behind the newest
one, or of another sender, which is ignored."""


class Placed(NamedTuple):
    """Order of a message, and words about it."""

    order: Order
    text: str = ""


class Senders:
    """Call ``place`` with each message, in order of arrival."""

    def __init__(self, host: str | None = None) -> None:
        """Begin; ``host`` is the only host whose poses count."""
        self._host = host
        self.newest: ArrivedPose | None = None
        """The newest message of the source."""
        self.lost = 0
        """Poses that are missing in the sequence."""

    def place(self, arrived: ArrivedPose) -> Placed:
        """Return the order of a message; a pose is the newest, unless it is late or ignored."""
        if self._host not in (None, arrived.host):
            return Placed(
                "other", f"{arrived.sender} is ignored: it is not {self._host} (pose.sender)"
            )
        before = self.newest
        placed = Placed("next")
        if before is not None and arrived.sender != before.sender:
            is_silent = arrived.arrival_s - before.arrival_s > RESTART_S
            if arrived.host != before.host or not is_silent:
                return Placed(
                    "other",
                    f"two senders: {arrived.sender} is ignored, {before.sender} was first; stop "
                    "one of them, or name the host in pose.sender",
                )
            placed = Placed("restarted", f"another sender on the same host, {arrived.sender}")
        elif before is not None:
            placed = self._in_sequence(before.sample, arrived.sample)
        if placed.order != "late" and isinstance(arrived.sample, PoseSample):
            self.newest = arrived
        return placed

    def _in_sequence(self, before: Content, sample: Content) -> Placed:
        if not isinstance(before, PoseSample) or not isinstance(sample, PoseSample):
            return Placed("next")
        ahead = sample.sequence - before.sequence
        step_s = sample.time_s - before.time_s
        if -MOST_LATE < ahead <= 0 and abs(step_s) < RESTART_S:
            return Placed("late", "a pose arrived twice or out of order")
        if ahead <= 0:
            return Placed("restarted", f"its sequence begins again at {sample.sequence}")
        self.lost += ahead - 1
        if step_s < -RESTART_S:
            return Placed("restarted", f"its clock was set back by {-step_s:.1f} s")
        return Placed("next")
