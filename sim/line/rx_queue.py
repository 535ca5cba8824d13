"""Bytes on the way to the host, each with the time at which it will have arrived."""

from collections import deque

EARLY = 1e-6
"""Share of a byte time by which rounding may make a byte late."""


class RxQueue:
    """Packets in the order in which they begin on the wire, taken out byte by byte."""

    def __init__(self) -> None:
        self.byte_s = 1e-5
        """Time of one byte on the wire."""
        self.packets: deque[tuple[float, bytes]] = deque()
        """Packets under way or not yet read, each with the time at which it begins."""

    def add(self, start_s: float, data: bytes) -> float:
        """Put a packet on the wire at ``start_s``; returns when its last byte will have arrived."""
        packets = self.packets
        if not packets or packets[-1][0] <= start_s:
            packets.append((start_s, data))
        else:  # there are some that are late
            place = sum(packet[0] <= start_s for packet in packets)
            packets.insert(place, (start_s, data))
        return start_s + len(data) * self.byte_s

    def count(self, now_s: float) -> int:
        """Bytes that have arrived and were not taken."""
        return sum(self._arrived(packet, now_s) for packet in self.packets)

    def due_s(self, count: int) -> float | None:
        """Time at which ``count`` bytes will have arrived; None if fewer are under way."""
        due_s = 0.0
        for start_s, data in self.packets:
            # bytes behind a slow packet cannot be read before it
            due_s = max(due_s, start_s + min(count, len(data)) * self.byte_s)
            if len(data) >= count:
                return due_s
            count -= len(data)
        return None

    def take(self, count: int, now_s: float) -> bytes:
        """Up to ``count`` bytes of those that have arrived."""
        packets, taken = self.packets, bytearray()
        if packets and len(packets[0][1]) == count == self._arrived(packets[0], now_s):
            return packets.popleft()[1]  # one packet, all of it, as nearly always
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
        """Lose everything."""
        self.packets.clear()

    def cut(self, at_s: float) -> None:
        """Lose what has not arrived by ``at_s``."""
        kept = [(packet[0], packet[1][: self._arrived(packet, at_s)]) for packet in self.packets]
        self.packets = deque(packet for packet in kept if packet[1])

    def _arrived(self, packet: tuple[float, bytes], now_s: float) -> int:
        start_s, data = packet
        return min(len(data), max(0, int((now_s - start_s) / self.byte_s + EARLY)))
