"""Byte stuffing: a header inside a payload must not look like the start of a packet.

Wherever ``FF FF FD`` occurs between the instruction byte and the CRC, one ``FD`` is added behind
it; the length field and the CRC count the added bytes. Instructions (and 0x55 of a status packet)
are never ``FF``, so the pattern can only begin behind that byte: in the parameters, or at the error
byte of a status packet. Source: e-manual, DYNAMIXEL Protocol 2.0, Packet Process.
"""

from drivers.errors import StuffingError

_HEADER = b"\xff\xff\xfd"
_STUFFED = b"\xff\xff\xfd\xfd"


def stuff(params: bytes) -> bytes:
    """Add ``FD`` behind every ``FF FF FD``; ``params`` is all between instruction and CRC."""
    return params.replace(_HEADER, _STUFFED)


def unstuff(params: bytes) -> bytes:
    """Exact inverse of ``stuff``.

    Raises:
        StuffingError: ``params`` holds a bare ``FF FF FD``, so no sender stuffed it.

    """
    plain = params.replace(_STUFFED, _HEADER)
    if stuff(plain) != params:
        raise StuffingError("FF FF FD without its stuffed FD in a payload")
    return plain
