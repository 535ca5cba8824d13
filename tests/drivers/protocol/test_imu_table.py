"""Blocks of the two public IMU tables, against what their sources print."""

import struct

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from snakewalk.config.errors import ConfigError
from snakewalk.config.loader import checked
from snakewalk.config.robot import ImuConfig, RobotConfig
from snakewalk.drivers.protocol.imu_table import IMU_TABLES, decode, encode, imu_model

DUCK = ImuConfig()
G40 = ImuConfig(model="FFW-G40-IMU", gyro_range_dps=500.0, acceleration_range_g=4.0)
HALF = struct.pack("<e", np.sqrt(0.5))


def test_the_published_places() -> None:
    g40 = IMU_TABLES["FFW-G40-IMU"].registers
    assert {name: g40[name].address for name in ("ID", "IMU ACC X", "IMU GYRO Z")} == {
        "ID": 7,
        "IMU ACC X": 40,
        "IMU GYRO Z": 50,
    }
    assert imu_model(537) == "FFW-G40-IMU"
    assert imu_model(1020) is None
    assert IMU_TABLES["imu_to_dxl"].address == 124


def test_bytes_by_hand() -> None:
    block = struct.pack("<hhh", 1000, -1000, 0) + HALF + b"\0\0" * 2
    sample = decode(DUCK, block)  # a half turn less a half: 90 degrees about x
    np.testing.assert_allclose(np.rad2deg(sample.rate_rad_s), [17.5, -17.5, 0.0])
    assert sample.rotation is not None
    np.testing.assert_allclose(sample.rotation @ [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], atol=1e-3)
    raw = decode(G40, struct.pack("<hhhhhh", 0, 0, 8192, 32767, 0, -16384))
    assert raw.acceleration_m_s2 is not None
    np.testing.assert_allclose(raw.acceleration_m_s2, [0.0, 0.0, 9.81])
    np.testing.assert_allclose(np.rad2deg(raw.rate_rad_s), [500.0, 0.0, -250.0], atol=0.02)


@pytest.mark.parametrize(
    "halves", [b"\0" * 6, b"\x00\x3c" * 2 + b"\0\0", b"\xff\x7f" + b"\0" * 4], ids=str
)
def test_what_is_no_unit_quaternion_is_no_attitude(halves: bytes) -> None:
    """All zero: the filter of the chip does not run yet; level would be a lie."""
    assert decode(DUCK, bytes(6) + halves).rotation is None


@pytest.mark.parametrize("seed", range(5))
def test_what_the_device_writes_the_host_reads(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rate, force = rng.uniform(-3.0, 3.0, 3), rng.uniform(-12.0, 12.0, 3)
    turn = np.eye(3) if seed == 0 else Rotation.random(random_state=seed).as_matrix()
    duck = decode(DUCK, encode(DUCK, rate, force, turn))
    assert duck.rotation is not None
    # an ulp of a half below 1 is 2^-11, and twice the vector's error is the angle's; near a half
    # turn the rebuilt scalar makes more of it
    np.testing.assert_allclose(duck.rotation, turn, atol=0.05)
    np.testing.assert_allclose(duck.rate_rad_s, rate, atol=np.deg2rad(17.5e-3))
    raw = decode(G40, encode(G40, rate, force, turn))
    assert raw.acceleration_m_s2 is not None
    np.testing.assert_allclose(raw.acceleration_m_s2, force, atol=9.81 * 4.0 / 32768)
    np.testing.assert_allclose(raw.rate_rad_s, rate, atol=np.deg2rad(500.0) / 32768)


def test_a_rate_beyond_the_range_is_cut_off() -> None:
    sample = decode(DUCK, encode(DUCK, np.array([20.0, -20.0, 0.0]), np.zeros(3), np.eye(3)))
    np.testing.assert_allclose(np.rad2deg(sample.rate_rad_s[:2]), [573.4, -573.4], atol=0.1)


@pytest.mark.parametrize(
    ("imu", "fault"),
    [
        ({"model": "FFW-G40-IMU"}, "gyro_range_dps: required for a FFW-G40-IMU"),
        ({"gyro_range_dps": 500.0}, "gyro_range_dps: an imu_to_dxl has 500 dps"),
        ({"link": 3}, "imu: link 3 of 3: 0 is the head"),
        ({"id": 2}, "imu: id 2 is a joint's"),
    ],
)
def test_faults_of_a_robots_file(imu: dict[str, object], fault: str) -> None:
    with pytest.raises(ConfigError, match=fault):
        checked(RobotConfig, {"name": "two", "joint_axes": "yp", "imu": imu}, "two.toml")
