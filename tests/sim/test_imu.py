"""A simulated IMU on the line beside servos, over real packet bytes."""

from collections.abc import Callable

import numpy as np
import pytest
from dynamixel_sdk import COMM_SUCCESS, GroupSyncRead, PacketHandler
from scipy.spatial.transform import Rotation

from snakewalk.config.robot import ImuConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.errors import BusError
from snakewalk.drivers.port.byte_port import SdkPort
from snakewalk.drivers.protocol.imu_table import decode
from snakewalk.drivers.protocol.packet import Instruction, InstructionPacket, encode_instruction
from snakewalk.sim.imu import Imu
from snakewalk.sim.line.clock import SimClock
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.plant import LinkMotion
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

QUIET = {"gyro_bias_dps": 0.0, "gyro_noise_dps": 0.0, "acceleration_noise_m_s2": 0.0}
DUCK = ImuConfig(**QUIET)
G40 = ImuConfig(
    model="FFW-G40-IMU", id=100, gyro_range_dps=500.0, acceleration_range_g=4.0, **QUIET
)
At = Callable[[float], tuple[np.ndarray, np.ndarray]]


def still(time_s: float) -> tuple[np.ndarray, np.ndarray]:
    return np.zeros(3), np.eye(3)


def a_line(imu: ImuConfig, at: At = still, seed: int = 0) -> SimLine:
    """Two servos and an IMU whose place and axes are functions of time."""
    plant = BenchPlant(2)
    device = Imu(imu, lambda: LinkMotion(plant.time_s, *at(plant.time_s)), seed=seed)
    return SimLine(ServoBank((1, 2)), plant, imu=device)


def block(line: SimLine, imu: ImuConfig, address: int) -> bytes:
    reply = DynamixelBus(line).device_block(imu.id, address, 12).read()
    assert reply.valid[0]
    return bytes(reply.data[0].tobytes())


def test_it_answers_pings_beside_the_servos() -> None:
    bus = DynamixelBus(a_line(G40))
    assert bus.ping(100).model_number == 537
    assert sorted(bus.scan()) == [1, 2, 100]
    assert bus.find((1, 2, 200)).keys() == {1, 2}


def test_one_sync_read_of_the_sdk_takes_imu_and_servos() -> None:
    """As the host of ``imu_to_dxl`` reads it: 12 bytes at 124, the IMU first."""
    line = a_line(DUCK)
    port: SdkPort = line
    group = GroupSyncRead(port, PacketHandler(2.0), 124, 12)
    for each in (200, 1, 2):
        group.addParam(each)
    assert group.txRxPacket() == COMM_SUCCESS
    assert group.isAvailable(200, 130, 2)
    assert group.getData(1, 132, 4) == 2048


def test_fast_and_bulk_reads_hold_it_too() -> None:
    line = a_line(G40)
    for kind, params in (
        (Instruction.FAST_SYNC_READ, b"\x28\x00\x0c\x00" + bytes([1, 100, 2])),
        (Instruction.BULK_READ, bytes([100, 40, 0, 12, 0]) + bytes([1, 132, 0, 4, 0])),
        (Instruction.FAST_BULK_READ, bytes([100, 40, 0, 12, 0]) + bytes([1, 132, 0, 4, 0])),
    ):
        line.write(encode_instruction(InstructionPacket(254, kind, params)))
        got = line.read_until(200, line.clock.now_s() + 0.01)
        assert len(got) >= 12 + 4, kind
        line.drain_until_quiet(0.001)


def test_nothing_of_it_can_be_written_and_only_registers_read() -> None:
    line = a_line(G40)
    line.write(encode_instruction(InstructionPacket(100, Instruction.WRITE, b"\x07\x00\x05")))
    status = line.read_until(11, line.clock.now_s() + 0.01)
    assert status[8] == 7  # access error
    line.write(encode_instruction(InstructionPacket(100, Instruction.READ, b"\x29\x00\x01\x00")))
    assert line.read_until(11, line.clock.now_s() + 0.01)[8] == 7
    assert DynamixelBus(line).ping(100).servo_id == 100


def test_at_another_baud_rate_it_is_silent() -> None:
    line = a_line(DUCK)
    line.setBaudRate(57_600)
    with pytest.raises(BusError):
        DynamixelBus(line).ping(200)
    line.setBaudRate(1_000_000)
    assert DynamixelBus(line).ping(200)


def test_a_spin_shows_its_rate_and_its_angle() -> None:
    def spinning(time_s: float) -> tuple[np.ndarray, np.ndarray]:
        return np.zeros(3), Rotation.from_rotvec([0.0, 0.0, 2.0 * time_s]).as_matrix()

    line = a_line(DUCK, spinning)
    for k in range(26):
        line.clock.sleep_until_s(0.02 * k)
        sample = decode(DUCK, block(line, DUCK, 124))
        asked_s = line.clock.now_s()
    assert sample.rotation is not None
    np.testing.assert_allclose(sample.rate_rad_s, [0.0, 0.0, 2.0], atol=0.02)
    angle = np.arctan2(sample.rotation[1, 0], sample.rotation[0, 0])
    assert angle == pytest.approx(2.0 * asked_s, abs=0.01)


def test_an_acceleration_and_gravity_are_felt_in_its_own_axes() -> None:
    """Mounted on its side, pushed ahead at 3 m/s^2: its y feels gravity, its x the push."""
    on_its_side = G40.model_copy(update={"mounting_deg": (90.0, 0.0, 0.0)})

    def pushed(time_s: float) -> tuple[np.ndarray, np.ndarray]:
        return np.array([1.5 * time_s**2, 0.0, 0.0]), np.eye(3)

    line = a_line(on_its_side, pushed)
    for k in range(5):
        line.clock.sleep_until_s(0.02 * k)
        sample = decode(on_its_side, block(line, on_its_side, 40))
    assert sample.acceleration_m_s2 is not None
    np.testing.assert_allclose(sample.acceleration_m_s2, [3.0, 9.81, 0.0], atol=0.1)


def test_the_heading_drifts_as_the_bias_says_and_the_seed_repeats_it() -> None:
    biased = ImuConfig(gyro_bias_dps=1.0, gyro_noise_dps=0.0, acceleration_noise_m_s2=0.0)
    bias_dps = np.random.default_rng(3).standard_normal(3)

    def headings_deg(seed: int) -> list[float]:
        line = a_line(biased, seed=seed)
        found = []
        for k in range(0, 101, 2):
            line.clock.sleep_until_s(0.1 * k)
            turn = decode(biased, block(line, biased, 124)).rotation
            found.append(0.0 if turn is None else np.rad2deg(np.arctan2(turn[1, 0], turn[0, 0])))
        return found

    drifted = headings_deg(3)
    assert drifted[-1] - drifted[0] == pytest.approx(10.0 * bias_dps[2], abs=0.2)  # half floats
    assert drifted == headings_deg(3)
    assert drifted != headings_deg(4)


def test_time_runs_in_its_clock_registers() -> None:
    line = a_line(G40)
    assert isinstance(line.clock, SimClock)
    line.clock.advance(1.25)
    bus = DynamixelBus(line)
    data = bus.device_block(100, 24, 4).read().data[0]
    assert int.from_bytes(data.tobytes(), "little") == pytest.approx(1250, abs=3)
