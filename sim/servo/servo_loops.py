"""Work of the servos in every control cycle, as compiled loops over servos and bytes.

Arguments are arrays and numbers: numba needs five times longer to unpack a tuple.
"""

import numpy as np

from snakewalk.config.arrays import AnyInts, Bools, Bytes, Floats, Indices, Ints
from snakewalk.drivers.compiling import compiled, readonly_array
from snakewalk.drivers.protocol.frames import (
    PARAMS_AT,
    crc_of,
    header_in,
    read_fast,
    read_plain,
)

# numba's spelling; read-only arguments may be read-only, and a register's column has gaps
_READ = readonly_array("uint8", layout="C")
_TABLE = "uint8[:, ::1]"
_PLACES = readonly_array("int64", layout="C")
_READ_TABLE = readonly_array(layout="C")
_FRAME = readonly_array(dimensions=2, layout="C")


@compiled("void(uint8[::1], int64, int64, int64)", makes_arrays=False)
def write_le(data: Bytes, offset: int, value: int, size: int) -> None:
    """Write a signed number, little-endian."""
    for k in range(size):
        data[offset + k] = (value >> (8 * k)) & 0xFF


@compiled(
    f"void({_TABLE}, {_PLACES}, {_READ_TABLE}, {_READ_TABLE}, {_READ_TABLE},"
    f" {_FRAME}, {_FRAME}, {_FRAME})",
    makes_arrays=False,
)
def write_motion(
    table: Bytes,
    places: Ints,
    current_a: Floats,
    velocity_rad_s: Floats,
    position_rad: Floats,
    frame: Floats,
    current_units: Floats,
    units: Floats,
) -> None:
    """Write Present Current (or Load), Velocity and Position of all servos into ``table``.

    Args:
        table: (S, bytes) control tables.
        places: (3,) addresses of the registers.
        current_a: (S,)
        velocity_rad_s: (S,)
        position_rad: (S,)
        frame: (2, S) sign of a servo's direction, and ticks at the shaft's zero.
        current_units: (2, S) ampere per unit of the first register, and its greatest reading.
        units: (2, S) rad/s per unit of velocity; ticks per rad.

    """
    at_current, at_velocity, at_position = places[0], places[1], places[2]
    for row in range(len(table)):
        rad_s = units[0, row]
        ticks_per_rad = units[1, row]
        sign = frame[0, row]
        zero = frame[1, row]
        ampere = current_units[0, row]
        limit = current_units[1, row]
        shown = np.rint(current_a[row] * (sign / ampere))
        write_le(table[row], at_current, int(min(max(shown, -limit), limit)), 2)
        write_le(table[row], at_velocity, int(np.rint(velocity_rad_s[row] * (sign / rad_s))), 4)
        ticks = np.rint(position_rad[row] * (sign * ticks_per_rad)) + zero
        write_le(table[row], at_position, int(ticks), 4)


@compiled(f"void(uint8[::1], {_PLACES}, {_TABLE}, {_PLACES}, {_PLACES})", makes_arrays=False)
def fill_replies(
    packet: Bytes,
    shape: Ints,
    table: Bytes,
    rows: Indices,
    block: Ints,
) -> None:
    """Fill the replies of ``rows`` to one group read into the template ``packet``.

    Args:
        packet: the whole reply; IDs and constants are already there.
        shape: (4,) bytes before the first servo's share; bytes of a share; offsets in it of the
            error byte and the data. A packet with a head is one packet with running CRCs.
        table: (S, bytes) control tables.
        rows: servos, in the order of their shares.
        block: (3,) address and length of the data, and address of Hardware Error Status.

    """
    head = shape[0]
    share = shape[1]
    error_at = shape[2]
    data_at = shape[3]
    address = block[0]
    length = block[1]
    status = block[2]
    crc = crc_of(packet, 0, head, 0)
    for k in range(len(rows)):
        row = rows[k]
        start = head + k * share
        packet[start + error_at] = 0x80 if table[row, status] else 0
        for j in range(length):
            packet[start + data_at + j] = table[row, address + j]
        end = start + share
        crc = crc_of(packet, start, end - 2, crc if head else 0)
        packet[end - 2] = crc & 0xFF
        packet[end - 1] = crc >> 8
        crc = crc_of(packet, end - 2, end, crc)


@compiled(
    f"int64(uint8[::1], {_PLACES}, {_TABLE}, {_PLACES}, {_PLACES}, {_TABLE}, uint8[::1],"
    f" {_TABLE}, uint8[::1])",
    makes_arrays=False,
)
def answer(
    packet: Bytes,
    shape: Ints,
    table: Bytes,
    rows: Indices,
    block: Ints,
    heads: Bytes,
    ids: Bytes,
    data: Bytes,
    error: Bytes,
) -> int:
    """``fill_replies``, then decode the bytes with the host's frame reader.

    The first five arguments are those of ``fill_replies``. ``heads`` are of ``read_plain``, or (1,
    8) of ``read_fast`` for one packet, which also uses ``ids`` (N,). ``data`` (N, length) and
    ``error`` (N,) are filled, unless the reply is irregular.
    """
    fill_replies(packet, shape, table, rows, block)
    if shape[0] > 0:
        return int(read_fast(packet, heads[0], ids, data, error))
    return int(read_plain(packet, heads, data, error))


@compiled(f"boolean({_READ})", makes_arrays=False)
def is_intact(raw: Bytes) -> bool:
    """Whether an instruction packet is complete and unstuffed."""
    end = len(raw) - 2
    return bool(
        int(raw[5]) | int(raw[6]) << 8 == end - 5
        and not header_in(raw, PARAMS_AT, end)
        and crc_of(raw, 0, end, 0) == int(raw[end]) | int(raw[end + 1]) << 8
    )


@compiled(
    f"void({_READ}, {_PLACES}, {_TABLE}, int64, int64, {readonly_array('int64', 2, 'C')},"
    f" {_FRAME}, {_READ_TABLE}, float64[::1], boolean[::1])",
    makes_arrays=False,
)
def accept_goals(
    raw: Bytes,
    rows: Indices,
    table: Bytes,
    offset: int,
    address: int,
    limits: Ints,
    frame: Floats,
    ticks_per_rad: Floats,
    goal_rad: Floats,
    taken: Bools,
) -> None:
    """Write Goal Position of a sync write into the tables; values out of limits are rejected.

    Args:
        raw: the packet.
        rows: servos, in the order of the entries.
        table: (S, bytes) control tables.
        offset: place of the first entry in ``raw``.
        address: of the register.
        limits: (2, S) least and greatest goal, ticks.
        frame: as in ``write_motion``.
        ticks_per_rad: (S,)
        goal_rad: (S,) set to the accepted goals in the shafts' frame.
        taken: (S,) set to whether a servo has accepted one.

    """
    taken[:] = False
    for k in range(len(rows)):
        row = rows[k]
        entry = offset + 5 * k + 1
        ticks = 0
        for j in range(4):
            ticks |= int(raw[entry + j]) << (8 * j)
        if ticks >= 1 << 31:
            ticks -= 1 << 32
        if limits[0, row] <= ticks <= limits[1, row]:
            write_le(table[row], address, ticks, 4)
            goal_rad[row] = (ticks - frame[1, row]) * (frame[0, row] / ticks_per_rad[row])
            taken[row] = True


@compiled(f"void(float64[::1], float64[::1], float64, float64, {_FRAME})", makes_arrays=False)
def warm_up(
    temperature_c: Floats, heat_j: Floats, slice_s: float, ambient_c: float, thermal: Floats
) -> None:
    """Move each sensor towards the final temperature of its heat.

    ``heat_j`` (S,) is that of a slice of ``slice_s``. ``thermal`` (2, S): kelvin per watt; share of
    the difference per slice.
    """
    for row in range(len(heat_j)):
        target_c = ambient_c + thermal[0, row] * (heat_j[row] / slice_s)
        temperature_c[row] += (target_c - temperature_c[row]) * thermal[1, row]


@compiled(
    f"boolean({_READ_TABLE}, {readonly_array('uint8')}, {_READ_TABLE}, {readonly_array('uint16')},"
    f" {readonly_array('uint16')})",
    makes_arrays=False,
)
def out_of_range(
    temperature_c: Floats,
    temperature_max_c: AnyInts,
    supply_v: Floats,
    min_tenths: AnyInts,
    max_tenths: AnyInts,
) -> bool:
    """Whether a sensor is too hot, or a supply outside its limits (tenths of a volt)."""
    for row in range(len(temperature_c)):
        tenths = np.rint(supply_v[row] * 10.0)
        if tenths < min_tenths[row] or tenths > max_tenths[row]:
            return True
        if np.rint(temperature_c[row]) > temperature_max_c[row]:
            return True
    return False


@compiled(f"float64({_READ_TABLE}, {_READ_TABLE})", makes_arrays=False)
def supply_current_a(pwm: Floats, current_a: Floats) -> float:
    """Supply current of the bridges, A."""
    sum_a = 0.0
    for row in range(len(pwm)):
        sum_a += abs(pwm[row] * current_a[row])
    return sum_a


@compiled(
    f"float64(float64[::1], float64, {_READ_TABLE}, {_READ_TABLE}, {_READ_TABLE},"
    f" {_READ_TABLE}, {_READ_TABLE})",
    makes_arrays=False,
)
def count_blocked(
    blocked_s: Floats,
    slice_s: float,
    pwm: Floats,
    pwm_limit: Floats,
    torque_on: Floats,
    velocity_rad_s: Floats,
    slow_rad_s: Floats,
) -> float:
    """Add a slice to the time of each motor that pushes at its limit and does not turn.

    Returns:
        The longest such time, s.

    """
    longest_s = 0.0
    for row in range(len(blocked_s)):
        full = abs(pwm[row]) >= 0.98 * min(pwm_limit[row], 1.0)
        along_rad_s = np.sign(pwm[row]) * velocity_rad_s[row]
        is_blocked = full and along_rad_s < slow_rad_s[row] and torque_on[row] > 0.0
        blocked_s[row] = blocked_s[row] + slice_s if is_blocked else 0.0
        longest_s = max(longest_s, blocked_s[row])
    return longest_s
