"""CRC-16/BUYPASS: polynomial 0x8005, zero start, not reflected.

Source: e-manual, DYNAMIXEL Protocol 2.0, CRC.
"""

import numpy as np

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
    """CRC of ``data``, continued from the CRC ``start`` of the bytes before it."""
    crc = start
    for byte in data:
        crc = ((crc << 8) & 0xFFFF) ^ _TABLE[(crc >> 8) ^ byte]
    return crc
