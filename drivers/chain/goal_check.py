"""Goal check: whether each servo has the goal that was sent to it.

Servos do not reply to a sync write, so Goal Position(116; 30 on Protocol 1.0) is read back. A
difference counts again only after another goal was sent.
"""

from collections import Counter, deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Int32s
from snakewalk.drivers.bus.chain_bus import GroupCycle
from snakewalk.drivers.bus.group_read import GroupReadReply
from snakewalk.drivers.chain.register_rows import RegisterRows
from snakewalk.drivers.errors import BusError

FOREIGN_READS, OWN_READS = 2, 4
"""Reads in a row that differ and end a run: with a goal that was never sent, and with an older goal
of this run (ours). A line that loses 5 % of its packets loses four writes once in 160,000 reads."""
SEEN_READS, WATCHED_READS = 3, 256
"""Reads with a goal that was never sent that end a run though the goals between them are right, and
the reads among which they count (ours). A program that writes rarely is seen in some reads only."""
MOST_LATE = 8
"""Number of goals that a servo or an adapter holds back at most (ours). A goal that was replaced
earlier does not come back by itself."""
_REMEMBERED_GOALS = 256
"""Number of last goals of this run that are compared (ours)."""


@dataclass(slots=True)
class _Difference:
    """A joint whose servo has another goal than the one sent."""

    count: int
    """Number of different reads in a row."""
    write: int
    """Number of the newest write before the last of the different reads."""
    value: int
    is_constant: bool
    """Whether all different reads returned the same value."""
    is_foreign: bool
    """Whether a different read returned a goal that was never sent."""
    lags: Counter[int]
    """Numbers of goals that are newer than the returned one, and how often each was possible."""


class GoalCheck:
    """Reads the goals of all joints back."""

    def __init__(self, labels: Sequence[str], cycle: GroupCycle, rows: RegisterRows) -> None:
        """Prepare the read; ``rows`` are those of Goal Position."""
        self._labels = labels
        self._rows = rows
        self.cycle = cycle
        self._sent: deque[Int32s] = deque(maxlen=_REMEMBERED_GOALS)
        self._writes = 0
        self._differences: dict[int, _Difference] = {}
        self._confirmed_write = np.zeros(len(labels), np.int64)
        """(J,) number of writes at the last right goal."""
        self._is_incomplete = False
        self._seen = 0
        self._seen_at = 0
        self._watched = 0

    def note_write(self, goals: Int32s) -> None:
        """Store raw goals (J,) that were just sent."""
        self._sent.append(goals)
        self._writes += 1

    @property
    def is_due(self) -> bool:
        """Whether the check should be repeated as soon as there is time."""
        if self._is_incomplete or self._watched > 0:
            return True
        return any(difference.write < self._writes for difference in self._differences.values())

    def check(self, explain: Callable[[int], str | None]) -> None:
        """Read the goals back and compare them.

        ``explain`` returns another reason why the servo of a joint rejects goals, or None.

        Raises:
            BusError: a servo has another goal in ``FOREIGN_READS`` or ``OWN_READS`` reads in a row,
                each after another goal was sent; or servos have goals that were never sent in
                ``SEEN_READS`` of ``WATCHED_READS`` reads.
            PortError: the port is gone.

        """
        if not self._sent:
            return
        self._watched = max(self._watched - 1, 0)
        self._read()
        over = [
            joint
            for joint, difference in self._differences.items()
            if self._exceeds_tolerance(difference)
        ]
        if over:
            raise BusError(self._fault(sorted(over), explain))

    def explain(self, joint: int) -> str | None:
        """Read the goals once; return the fault of a joint's goal, or None.

        Raises:
            PortError: the port is gone.

        """
        if not self._sent or not self._read().valid[joint] or joint not in self._differences:
            return None
        return self._text([joint])

    def _read(self) -> GroupReadReply:
        """Read the goals, and note those that differ."""
        reply = self.cycle.read()
        sent = self._sent[-1]
        if reply.flawless and reply.data.tobytes() == self._rows.encode(sent):  # the usual case
            self._is_incomplete = False
            self._differences.clear()
            self._confirmed_write[:] = self._writes
            return reply
        self._is_incomplete = not reply.valid.all()
        values = self._rows.decode(reply.data)
        for joint in np.flatnonzero(reply.valid).tolist():
            if values[joint] == sent[joint]:
                self._differences.pop(joint, None)
                self._confirmed_write[joint] = self._writes
            else:
                self._note(joint, int(values[joint]))
        return reply

    def _note(self, joint: int, value: int) -> None:
        earlier = self._differences.get(joint)
        sent = enumerate(reversed(self._sent))
        lags = Counter(lag for lag, goals in sent if goals[joint] == value)
        last_write = self._writes - min(lags, default=self._writes)
        is_foreign = not lags or last_write < self._confirmed_write[joint] - MOST_LATE
        if earlier is None:
            self._differences[joint] = _Difference(1, self._writes, value, True, is_foreign, lags)
        elif earlier.write < self._writes:
            earlier.count = earlier.count + 1
            earlier.write = self._writes
            earlier.is_constant &= value == earlier.value
            earlier.is_foreign |= is_foreign
            earlier.lags += lags
            earlier.value = value
        if is_foreign and (self._seen_at < self._writes or not self._watched):
            self._seen = self._seen + 1 if self._watched else 1
            self._seen_at = self._writes
            self._watched = WATCHED_READS

    def _exceeds_tolerance(self, difference: _Difference) -> bool:
        if difference.is_foreign:
            return difference.count >= FOREIGN_READS or self._seen >= SEEN_READS
        return difference.count >= OWN_READS

    def _fault(self, joints: list[int], explain: Callable[[int], str | None]) -> str:
        reason = explain(joints[0])
        if reason is not None:
            return f"{self._labels[joints[0]]}: {reason}"
        return f"{', '.join(self._labels[joint] for joint in joints)}: {self._text(joints)}"

    def _text(self, joints: list[int]) -> str:
        """Difference of the first of ``joints``, and its cause."""
        first = self._differences[joints[0]]
        [(lag, times)] = first.lags.most_common(1) or [(0, 0)]
        if first.is_foreign:
            cause = "another program writes goals (a second master)"
        elif first.is_constant and 1 < len(self._differences) == len(self._labels):
            cause = "all servos reply, none has the newest goals: the adapter loses what is written"
        elif first.is_constant and (first.count > 1 or lag > MOST_LATE):
            cause = "it ignores sync writes"
        elif first.count == 1:
            cause = "it accepts goals late, or ignores sync writes"
        elif times >= first.count - 1:  # the fault may begin between two goals
            cause = f"it accepts goals {lag} cycle{'s' * (lag > 1)} late"
        else:
            cause = "writes to it get lost"
        return f"Goal Position is {first.value}, not {self._sent[-1][joints[0]]}: {cause}"
