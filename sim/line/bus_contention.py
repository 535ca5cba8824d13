"""What is left when several servos speak at once: the bus is wired, and a zero wins."""

from collections.abc import Sequence


def bus_contention(
    replies: Sequence[tuple[float, bytes]], byte_s: float
) -> tuple[float, bytes, bool]:
    """Start, bytes and whether they were garbled, of ``replies`` (start in s, bytes).

    Voices that say the same at the same time are one reply, as on metal. Otherwise bits are ANDed
    where they overlap, in whole bytes.
    """
    start_s, first = min(replies)
    if all(reply == (start_s, first) for reply in replies):
        return start_s, first, False
    mixed = bytearray()
    for begin_s, data in replies:
        at = round((begin_s - start_s) / byte_s)
        mixed += b"\xff" * (at + len(data) - len(mixed))
        for k, byte in enumerate(data, at):
            mixed[k] &= byte
    return start_s, bytes(mixed), True
