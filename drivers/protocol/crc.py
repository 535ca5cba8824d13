"""CRC-16/BUYPASS (polynomial 0x8005, zero start, not reflected), of bytes and of whole arrays.

With a zero start the CRC is linear over XOR: the CRC of a row is the XOR of what each byte would
give alone at its position. So a table by (distance from the end, byte) turns many equally long
packets into one gather and one XOR reduction. Source: e-manual, DYNAMIXEL Protocol 2.0, CRC.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

POLYNOMIAL = 0x8005


def _of_byte(byte: int) -> int:
    crc = byte << 8
    for _ in range(8):
        crc = (crc << 1) ^ (POLYNOMIAL if crc & 0x8000 else 0)
        crc &= 0xFFFF
    return crc


_TABLE = tuple(_of_byte(byte) for byte in range(256))
TABLE = np.array(_TABLE, dtype=np.uint16)
"""(256,) CRC of each single byte."""


def crc16(data: bytes | bytearray, start: int = 0) -> int:
    """CRC of ``data``, going on from ``start`` (the CRC of what came before)."""
    crc = start
    for byte in data:
        crc = ((crc << 8) & 0xFFFF) ^ _TABLE[(crc >> 8) ^ byte]
    return crc


def crc16_long(data: bytes | NDArray[np.uint8]) -> int:
    """CRC of ``data`` at once, for packets of the few lengths that come in every cycle."""
    table, offsets = _positions(len(data))
    places = np.frombuffer(data, np.uint8) + offsets
    return int(np.bitwise_xor.reduce(table.take(places)))


def crc16_rows(rows: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """CRC of each row of ``rows`` (n, length): (n,)."""
    table, offsets = _positions(rows.shape[1])
    crcs: NDArray[np.uint16] = np.bitwise_xor.reduce(table[rows + offsets], axis=1)
    return crcs


@cache
def _positions(length: int) -> tuple[NDArray[np.uint16], NDArray[np.intp]]:
    """CRC of a single byte by its place in ``length``, flat (length * 256,), and where rows begin.

    One table a length; a program uses a handful of lengths.
    """
    table = np.zeros((length, 256), dtype=np.uint16)
    column = TABLE
    for place in range(length - 1, -1, -1):
        table[place] = column
        column = (column << 8) ^ TABLE[column >> 8]
    return table.ravel(), np.arange(length, dtype=np.intp) * 256
