"""Bytes on the way to the host, with their arrival times."""

from collections import deque

EARLY = 1e-6
"""Share of a byte time by which rounding may make a byte late."""


class RxQueue:
    """Packets in the order of their start on the wire, read byte by byte."""

    def __init__(self) -> None:
        self.byte_s = 1e-5
        """Time of one byte on the wire."""
        self.packets: deque[tuple[float, bytes]] = deque()
        """Packets under way or not yet read, each with the time at which it begins."""

    def add(self, start_s: float, data: bytes) -> float:
        """Put a packet on the wire at ``start_s``; return the arrival time of its last byte."""
        packets = self.packets
        if not packets or packets[-1][0] <= start_s:
            packets.append((start_s, data))
        else:  # some are late
            place = sum(packet[0] <= start_s for packet in packets)
            packets.insert(place, (start_s, data))
        return start_s + len(data) * self.byte_s

    def count(self, now_s: float) -> int:
        """Number of arrived, unread bytes."""
        return sum(self._arrived(packet, now_s) for packet in self.packets)

    def due_s(self, count: int) -> float | None:
        """Arrival time of ``count`` bytes; None if fewer are under way."""
        due_s = 0.0
        for start_s, data in self.packets:
            # bytes after a slow packet cannot be read before it
            due_s = max(due_s, start_s + min(count, len(data)) * self.byte_s)
            if len(data) >= count:
                return due_s
            count -= len(data)
        return None

    def take(self, count: int, now_s: float) -> bytes:
        """Up to ``count`` arrived bytes."""
        packets = self.packets
        taken = bytearray()
        if packets and len(packets[0][1]) == count == self._arrived(packets[0], now_s):
            return packets.popleft()[1]  # the usual case: one packet, complete
        while packets and len(taken) < count:
            start_s, data = packets[0]
            ready = min(self._arrived(packets[0], now_s), count - len(taken))
            taken += data[:ready]
            if ready < len(data):
                packets[0] = (start_s + ready * self.byte_s, data[ready:])
                break
            packets.popleft()
        return bytes(taken)

    def clear(self) -> None:
        """Drop all bytes."""
        self.packets.clear()

    def cut(self, at_s: float) -> None:
        """Drop bytes that arrive after ``at_s``."""
        kept = [(packet[0], packet[1][: self._arrived(packet, at_s)]) for packet in self.packets]
        self.packets = deque(packet for packet in kept if packet[1])

    def _arrived(self, packet: tuple[float, bytes], now_s: float) -> int:
        start_s, data = packet
        return min(len(data), max(0, int((now_s - start_s) / self.byte_s + EARLY)))
