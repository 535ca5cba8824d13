"""Lost replies: whether their number shows a fault of the line, not of a servo."""

from collections import deque

LOSS_READS, LOSSES = 100, 4
"""This many losses within this many reads show a bad line (ours). A servo that falls silent, or a
computer that stalls for a while, is one loss."""


class LostReplies:
    """Counts losses; reports a bad line once in a run."""

    def __init__(self) -> None:
        self._began: deque[int] = deque()
        """Numbers of the reads at which a loss began."""
        self._reads = 0
        self._complete, self._any, self._reported = True, True, False

    def update(self, read: int, joints: int) -> str | None:
        """Count a read; returns a line for the user the first time that there is a reason."""
        self._reads += 1
        is_complete, is_any = read == joints, read > 0
        if self._complete and not is_complete:
            self._began.append(self._reads)
        is_silent = not (is_any or self._any)
        self._complete, self._any = is_complete, is_any
        while self._began and self._began[0] <= self._reads - LOSS_READS:
            self._began.popleft()
        if self._reported or not (is_silent or len(self._began) >= LOSSES):
            return None
        self._reported = True
        span = self._reads - self._began[0] + 1
        reason = f"replies got lost {LOSSES} times within {span} reads:"
        if is_silent:
            reason = "no servo was read in two reads in a row: no power,"
        return (
            f"{reason} noise, a loose plug, another program on the line, or a computer that is too "
            "busy; see snakewalk doctor"
        )
