"""Another clock in times of this one, from messages that come late by chance."""

from collections import deque


class ClockOffset:
    """Least offset of this clock over another: the fastest message of a span has no delay."""

    def __init__(self, span_s: float) -> None:
        self._span_s = span_s
        self._seen: deque[tuple[float, float]] = deque()
        """Times of this clock, and rising offsets."""

    def delay_s(self, sent_s: float, now_s: float) -> float:
        """Return the delay of a message that was sent at ``sent_s`` of the other clock."""
        offset_s = now_s - sent_s
        while self._seen and self._seen[-1][1] >= offset_s:
            self._seen.pop()
        self._seen.append((now_s, offset_s))
        while self._seen[0][0] < now_s - self._span_s:
            self._seen.popleft()
        return now_s - self.local_s(sent_s)

    def local_s(self, other_s: float) -> float:
        """Time of this clock at a time of the other one; the same before the first message."""
        return other_s + (self._seen[0][1] if self._seen else 0.0)
