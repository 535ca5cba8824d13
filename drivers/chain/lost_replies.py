"""Lost replies: whether their number shows a fault of the line, not of a servo."""

from collections import deque

LOSS_READS = 100
LOSSES = 4
"""Losses within ``LOSS_READS`` reads that show a bad line (ours). A servo that falls silent, or a
computer that stalls for a while, is one loss."""


LATE_READS = 3
"""Reads with a reply after the time-out that show a slow adapter (ours)."""


class LostReplies:
    """Counts losses; reports a bad line once per run."""

    def __init__(self) -> None:
        self._began: deque[int] = deque()
        """Numbers of the reads at which a loss began."""
        self._reads = 0
        self._complete = True
        self._any = True
        self._reported = False
        self._late: deque[int] = deque()
        """Numbers of the reads before which bytes arrived late."""
        self._late_bytes = 0

    def update(self, read: int, joints: int, late_bytes: int = 0) -> str | None:
        """Count a read of ``read`` of all ``joints``; return a line for the user at a first fault.

        ``late_bytes`` is the total that arrived after the time-out of their read.
        """
        self._reads += 1
        if late_bytes > self._late_bytes:
            self._late.append(self._reads)
        self._late_bytes = late_bytes
        is_complete, is_any = read == joints, read > 0
        if self._complete and not is_complete:
            self._began.append(self._reads)
        is_silent = not (is_any or self._any)
        self._complete = is_complete
        self._any = is_any
        for reads in (self._began, self._late):
            while reads and reads[0] <= self._reads - LOSS_READS:
                reads.popleft()
        is_late = len(self._late) >= LATE_READS
        if self._reported or not (is_silent or is_late or len(self._began) >= LOSSES):
            return None
        self._reported = True
        if self._late:
            return (
                "replies arrive after the time-out: an adapter with a high latency, a slow "
                "network, or a computer that is too busy; see snakewalk doctor"
            )
        span = self._reads - self._began[0] + 1
        reason = f"replies got lost {LOSSES} times within {span} reads:"
        if is_silent:
            reason = "no servo was read in two reads in a row: no power,"
        return (
            f"{reason} noise, a loose plug, another program on the line, or a computer that is too "
            "busy; see snakewalk doctor"
        )
