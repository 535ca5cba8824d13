"""What every control cycle asks of the servos, as loops over servos and bytes.

Compiled where numba is installed, else run as they stand, to the same bytes.
"""

from collections.abc import Callable
from importlib.util import find_spec
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
Rows = NDArray[np.intp]
Floats = NDArray[np.float64]
F = TypeVar("F", bound=Callable[..., object])


def _compiled(function: F) -> F:
    if find_spec("numba") is None:
        return function
    from numba import njit  # noqa: PLC0415  optional and slow

    made: F = njit(cache=True)(function)
    return made


@_compiled
def crc_of(data: Bytes, start: int, stop: int, crc: int, crc_table: NDArray[np.uint16]) -> int:
    """CRC of a part of ``data``, going on from ``crc``; ``crc_table`` (256,) is that of a byte."""
    for k in range(start, stop):
        crc = ((crc << 8) & 0xFFFF) ^ int(crc_table[(crc >> 8) ^ int(data[k])])
    return crc


@_compiled
def put(data: Bytes, at: int, value: int, size: int) -> None:
    """Write a signed number, little-endian."""
    for k in range(size):
        data[at + k] = (value >> (8 * k)) & 0xFF


@_compiled
def show_motion(
    table: Bytes,
    places: tuple[int, int, int],
    shafts: tuple[Floats, Floats, Floats],
    frame: Floats,
    units: tuple[float, float, float, float],
) -> None:
    """Present Current (or Load), Velocity and Position of all servos into their ``table``.

    Args:
        table: (S, bytes) control tables.
        places: addresses of the three registers.
        shafts: (S,) currents, A, velocities, rad/s, and angles, rad.
        frame: (2, S) sign of a servo's direction, and ticks at the shaft's zero.
        units: ampere, and its greatest reading; rad/s; ticks per rad.

    """
    at_current, at_velocity, at_position = places
    current_a, velocity_rad_s, position_rad = shafts
    ampere, limit, rad_s, ticks_per_rad = units
    for row in range(len(table)):
        sign, zero = frame[0, row], frame[1, row]
        shown = np.rint(current_a[row] * (sign / ampere))
        put(table[row], at_current, int(min(max(shown, -limit), limit)), 2)
        put(table[row], at_velocity, int(np.rint(velocity_rad_s[row] * (sign / rad_s))), 4)
        ticks = np.rint(position_rad[row] * (sign * ticks_per_rad) + zero)
        put(table[row], at_position, int(ticks), 4)


@_compiled
def compose(
    packet: Bytes,
    shape: tuple[int, int, int, int],
    table: Bytes,
    rows: Rows,
    block: tuple[int, int, int],
    crc_table: NDArray[np.uint16],
) -> None:
    """Fill the answers of ``rows`` to one group read into the template ``packet``.

    Args:
        packet: the whole answer; IDs and all that is constant are there already.
        shape: bytes before the first servo's share; bytes of a share; where in it the error byte
            stands, and where the data. A packet with a head is one: its CRCs go on and on.
        table: (S, bytes) control tables.
        rows: servos, in the order of their shares.
        block: address and length of the data, and address of Hardware Error Status.
        crc_table: (256,) CRC of a byte.

    """
    head, share, error_at, data_at = shape
    address, length, status = block
    crc = crc_of(packet, 0, head, 0, crc_table)
    for k in range(len(rows)):
        row, start = rows[k], head + k * share
        packet[start + error_at] = 0x80 if table[row, status] else 0
        for j in range(length):
            packet[start + data_at + j] = table[row, address + j]
        end = start + share
        crc = crc_of(packet, start, end - 2, crc if head else 0, crc_table)
        packet[end - 2] = crc & 0xFF
        packet[end - 1] = crc >> 8
        crc = crc_of(packet, end - 2, end, crc, crc_table)


@_compiled
def take_goals(
    raw: Bytes,
    rows: Rows,
    table: Bytes,
    places: tuple[int, int],
    limits: NDArray[np.int64],
    frame: Floats,
    ticks_per_rad: float,
    goal_rad: Floats,
    taken: NDArray[np.bool_],
) -> None:
    """Goal Position of a sync write into the tables; values out of limits are refused.

    Args:
        raw: the packet.
        rows: servos, in the order of the entries.
        table: (S, bytes) control tables.
        places: of the first entry in ``raw``, and address of the register.
        limits: (2, S) least and greatest goal, ticks.
        frame: as in ``show_motion``.
        ticks_per_rad: its unit.
        goal_rad: (S,) set to the goals in the shafts' frame, where taken.
        taken: (S,) set to whether a servo has taken one.

    """
    at, address = places
    taken[:] = False
    for k in range(len(rows)):
        row, entry = rows[k], at + 5 * k + 1
        ticks = 0
        for j in range(4):
            ticks |= int(raw[entry + j]) << (8 * j)
        if ticks >= 1 << 31:
            ticks -= 1 << 32
        if limits[0, row] <= ticks <= limits[1, row]:
            put(table[row], address, ticks, 4)
            goal_rad[row] = (ticks - frame[1, row]) * (frame[0, row] / ticks_per_rad)
            taken[row] = True


@_compiled
def add_loss(heat_j: Floats, current_a: Floats, ohm_s: float) -> None:
    """Add what the windings turned into heat."""
    for row in range(len(heat_j)):
        heat_j[row] += current_a[row] * current_a[row] * ohm_s
