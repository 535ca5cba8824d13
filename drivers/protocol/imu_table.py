"""The two public register tables of IMUs on a DYNAMIXEL bus.

- ``FFW-G40-IMU``, model number 537: ``param/dxl_model/ffw_g40_imu.model`` and ``dynamixel.model``
  of ROBOTIS' ``dynamixel_hardware_interface``. It returns raw counts. The values of its scale
  registers (32 and 34) are not published, so the user states the ranges.
- ``imu_to_dxl``, version 2, on an LSM6DSV16X: ``duck-control/src/imu.rs`` of Pollen Robotics'
  ``microduck``. ID 200, 12 bytes at 124: rates of 17.5 mdps per count, and the vector of a unit
  quaternion as three IEEE half floats, all zero until the chip's filter runs. Other registers are
  not published.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.config.robot import ImuConfig, ImuModel
from snakewalk.drivers.attitude import rotations
from snakewalk.drivers.protocol.control_table import Register

COUNTS = 32_768
"""Counts of a full range, two's complement of 16 bits."""
GYRO_RAD_S = np.deg2rad(17.5e-3)
"""Rate for a count of an ``imu_to_dxl``: the range of 500 degrees a second of the LSM6DSV16X."""
QUATERNION_NORM_MAX = 1.02
"""Square of the longest quaternion vector that rounding to half floats explains (``imu.rs``)."""


@dataclass(frozen=True, slots=True)
class ImuRegisters:
    """Registers of one device."""

    model_number: int | None
    """Model number of the device; None where it is not published."""
    registers: Mapping[str, Register]
    address: int
    """First byte of the block that is read in every cycle."""


class ImuSample(NamedTuple):
    """One reading in the device's own axes."""

    rate_rad_s: Floats
    """(3,) rates of turning about the axes of the device, rad/s."""
    acceleration_m_s2: Floats | None
    """(3,) specific force: at rest it points up; None where the device shows none."""
    rotation: Floats | None
    """(3, 3) the device's axes in the world, columns; None where it shows none, or not yet."""


def _registers(rows: str) -> Mapping[str, Register]:
    registers = {}
    for row in rows.strip().splitlines():
        address, size, name = row.split(maxsplit=2)
        signed = name.startswith(("Gyro", "IMU")) and name[-1] in "XYZ"
        registers[name] = Register(name, int(address), int(size), signed)
    return MappingProxyType(registers)


_ROWS_OF_IMU_TO_DXL = """
124 2 Gyro X
126 2 Gyro Y
128 2 Gyro Z
130 2 Quaternion X
132 2 Quaternion Y
134 2 Quaternion Z
"""
"""The names are ours: the source has offsets only."""
_ROWS_OF_G40 = """
0 2 Model Number
2 1 ROBOT_Generation
3 1 Board_Number
5 1 Firmware_Version_Major
6 1 Firmware_Version_Minor
7 1 ID
8 1 Baud Rate (Bus)
9 1 HW_REV
10 1 Boot_Version_Major
11 1 Boot_Version_MInor
12 4 Error_Code
20 4 Micros
24 4 Millis
32 2 IMU ACC SCALE
34 2 IMU GYRO SCALE
36 4 IMU TIMESTAMP
40 2 IMU ACC X
42 2 IMU ACC Y
44 2 IMU ACC Z
46 2 IMU GYRO X
48 2 IMU GYRO Y
50 2 IMU GYRO Z
"""
IMU_TABLES: Mapping[ImuModel, ImuRegisters] = MappingProxyType(
    {
        "imu_to_dxl": ImuRegisters(None, _registers(_ROWS_OF_IMU_TO_DXL), 124),
        "FFW-G40-IMU": ImuRegisters(537, _registers(_ROWS_OF_G40), 40),
    }
)
BLOCK_BYTES = 12
"""Six numbers of two bytes, in both tables."""


def imu_model(model_number: int) -> ImuModel | None:
    """Name of the IMU with a published model number, or None."""
    return next((m for m, table in IMU_TABLES.items() if table.model_number == model_number), None)


def decode(imu: ImuConfig, block: bytes) -> ImuSample:
    """Reading in the ``BLOCK_BYTES`` of a device."""
    counts = np.frombuffer(block, "<i2").astype(float)
    if imu.gyro_range_dps is None or imu.acceleration_range_g is None:
        return ImuSample(counts[:3] * GYRO_RAD_S, None, _rotation(block[6:]))
    force = counts[:3] * (imu.acceleration_range_g * GRAVITY_M_S2 / COUNTS)
    return ImuSample(counts[3:] * (np.deg2rad(imu.gyro_range_dps) / COUNTS), force, None)


def _rotation(halves: bytes) -> Floats | None:
    """Axes from a quaternion vector of three half floats; None without one."""
    vector = np.frombuffer(halves, "<f2").astype(float)
    square = float(vector @ vector)
    if not any(halves) or not square <= QUATERNION_NORM_MAX:  # NaN is rejected too
        return None
    quaternion = [*vector, np.sqrt(max(0.0, 1.0 - square))]
    return np.asarray(rotations().from_quat(quaternion).as_matrix())


def encode(imu: ImuConfig, rate_rad_s: Floats, force_m_s2: Floats, rotation: Floats) -> bytes:
    """Inverse of ``decode``; values beyond the range are clipped.

    ``rate_rad_s`` (3,) and ``force_m_s2`` (3,) are in the device's axes; ``rotation`` (3, 3) are
    these axes in the world.
    """
    if imu.gyro_range_dps is None or imu.acceleration_range_g is None:
        vector = rotations().from_matrix(rotation).as_quat(canonical=True)[:3].astype("<f2")
        vector[vector == 0.0] = -0.0  # all bytes 0 mean a missing quaternion
        return _counts(rate_rad_s / GYRO_RAD_S) + bytes(vector.tobytes())
    force = force_m_s2 * (COUNTS / (imu.acceleration_range_g * GRAVITY_M_S2))
    return _counts(force) + _counts(rate_rad_s * (COUNTS / np.deg2rad(imu.gyro_range_dps)))


def _counts(values: Floats) -> bytes:
    return np.clip(np.rint(values), -COUNTS, COUNTS - 1).astype("<i2").tobytes()
