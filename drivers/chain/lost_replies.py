"""Lost replies: whether their number shows a fault of the line, not of a servo."""

from collections import deque

from snakewalk.drivers.bus.control_cycle import CycleCounters

LOSS_READS = 100
LOSSES = 4
"""Losses within ``LOSS_READS`` reads that show a bad line (ours). A servo that falls silent, or a
computer that stalls for a while, is one loss."""


LATE_READS = 3
"""Reads with a reply after the time-out that show a slow adapter (ours)."""


class LostReplies:
    """Counts losses; reports a bad line, and a silent one, once per run."""

    def __init__(self) -> None:
        self._began: deque[int] = deque()
        """Numbers of the reads at which a loss began."""
        self._reads = 0
        self._complete = True
        self._any = True
        self._reported = self._silence_reported = False
        self._late: deque[int] = deque()
        """Numbers of the reads before which bytes arrived late."""
        self._late_bytes = self._unclean = self._damaged = 0
        self._stalled_s = 0.0

    def update(self, read: int, joints: int, counters: CycleCounters) -> str | None:
        """Count a read of ``read`` of all ``joints``; return a line for the user at a first fault.

        ``counters`` are the totals so far.
        """
        self._reads += 1
        if counters.late_bytes > self._late_bytes:
            self._late.append(self._reads)
        if not self._late:
            self._stalled_s = counters.stalled_s
        is_complete, is_any = read == joints, read > 0
        if self._complete and not is_complete:
            self._began.append(self._reads)
            self._damaged += counters.unclean > self._unclean
        self._late_bytes, self._unclean = counters.late_bytes, counters.unclean
        is_silent = not (is_any or self._any)
        self._complete = is_complete
        self._any = is_any
        for reads in (self._began, self._late):
            while reads and reads[0] <= self._reads - LOSS_READS:
                reads.popleft()
        is_late = len(self._late) >= LATE_READS
        if is_silent and not self._late and not self._silence_reported:
            self._silence_reported = True
            return "no servo was read in two reads in a row; see snakewalk doctor"
        if self._reported or not (is_late or len(self._began) >= LOSSES):
            return None
        self._reported = True
        if self._late:
            is_busy = counters.stalled_s > self._stalled_s
            cause = "this computer is too busy" if is_busy else "high latency of adapter or network"
            return f"replies arrive after the time-out: {cause}; see snakewalk doctor"
        span = self._reads - self._began[0] + 1
        cause = "no byte is damaged: a loose plug, or another program reads from the port"
        if 2 * self._damaged >= LOSSES:
            cause = "bytes are damaged: noise, or a second master"
        return f"replies got lost {LOSSES} times within {span} reads: {cause}; see snakewalk doctor"
