"""Bus contention: several servos reply at once on one wire, where a zero wins."""

from collections.abc import Sequence
from typing import NamedTuple


class Reply(NamedTuple):
    """Bytes on the wire after a silence."""

    delay_s: float
    data: bytes


def bus_contention(replies: Sequence[Reply], byte_s: float) -> tuple[Reply, bool]:
    """Bytes on the wire when ``replies`` to one packet meet, and whether they are garbled.

    Equal simultaneous replies are one reply, as on a real bus. Otherwise overlapping bits are
    ANDed, in whole bytes of ``byte_s``.
    """
    first = min(replies)
    if all(reply == first for reply in replies):
        return first, False
    garbled = bytearray()
    for delay_s, data in replies:
        offset = round((delay_s - first.delay_s) / byte_s)
        garbled += b"\xff" * (offset + len(data) - len(garbled))
        for k, byte in enumerate(data, offset):
            garbled[k] &= byte
    return Reply(first.delay_s, bytes(garbled)), True
