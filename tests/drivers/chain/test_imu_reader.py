"""The IMU beside the joints: attitude in the joint state, faults of the device, wire budget."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from snakewalk.config.robot import ImuConfig, RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.drivers.bus.budget import chain_budget, robot_budget
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.liveness import SLOW_EVERY
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import ChainError
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointState
from snakewalk.sim.imu import Imu
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.plant import LinkMotion
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

DUCK = ImuConfig(gyro_bias_dps=0.0)
G40 = ImuConfig(model="FFW-G40-IMU", id=100, gyro_range_dps=500.0, acceleration_range_g=4.0)
LYING = Rotation.from_euler("xyz", [170.0, -10.0, 35.0], degrees=True).as_matrix()


class Bench:
    """Two servos, and an IMU that can be taken away, in a link that lies as told."""

    def __init__(self, imu: ImuConfig, there: bool = True) -> None:
        self.robot = RobotConfig(name="two", joint_axes="yp", imu=imu)
        plant = BenchPlant(2)
        self.rotation = LYING
        self.device = Imu(imu, lambda: LinkMotion(plant.time_s, np.zeros(3), self.rotation))
        self.line = SimLine(ServoBank((1, 2)), plant, imu=self.device if there else None)
        self.events: list[str] = []
        self.chain = ServoChain(DynamixelBus(self.line), self.robot)
        self.chain.on_event = self.events.append
        limits = SafetyLimits.from_config(self.robot, SafetyConfig())
        self.link = SafeLink(self.chain, limits, self.line.clock)

    def cycles(self, count: int) -> JointState:
        for _ in range(count):
            self.line.clock.advance(0.02)
            state = self.link.read()
        return state


def tilt_deg(state: JointState, truth: np.ndarray) -> float:
    assert state.imu is not None
    return float(np.rad2deg(np.arccos(np.clip(state.imu.rotation[2] @ truth[2], -1.0, 1.0))))


@pytest.mark.parametrize("imu", [DUCK, G40], ids=lambda imu: imu.model)
@pytest.mark.parametrize("mounting_deg", [(0.0, 0.0, 0.0), (180.0, 30.0, -90.0)])
def test_the_links_attitude_stands_beside_the_joints(
    imu: ImuConfig, mounting_deg: tuple[float, float, float]
) -> None:
    bench = Bench(imu.model_copy(update={"mounting_deg": mounting_deg}))
    with bench.link as link:
        link.enable()
        state = bench.cycles(5)
        assert tilt_deg(state, LYING) < 1.0
        before = state.imu
        bench.rotation = LYING @ Rotation.from_euler("z", 5.0, degrees=True).as_matrix()
        after = bench.cycles(1).imu
    assert before is not None
    assert after is not None
    turn = Rotation.from_matrix(before.rotation.T @ after.rotation).as_rotvec(degrees=True)
    np.testing.assert_allclose(turn, [0.0, 0.0, 5.0], atol=0.3)
    assert np.argmax(np.abs(after.rate_rad_s)) == 2
    assert after.valid
    assert after.age_s < 0.01
    assert not after.rotation.flags.writeable


def test_a_robot_without_one_has_none() -> None:
    bench = Bench(DUCK)
    chain = ServoChain(DynamixelBus(bench.line), bench.robot.model_copy(update={"imu": None}))
    assert chain.enable().imu is None
    chain.disable()


def test_one_that_does_not_answer_forbids_the_start() -> None:
    bench = Bench(DUCK, there=False)
    with pytest.raises(ChainError, match=r"imu \(ID 200\): no reply at 1000000 baud"):
        bench.link.enable()
    assert not bench.line.bank["Torque Enable"].any()


def test_another_device_in_its_place_forbids_the_start() -> None:
    bench = Bench(DUCK)
    other = G40.model_copy(update={"id": 200})
    chain = ServoChain(DynamixelBus(bench.line), bench.robot.model_copy(update={"imu": other}))
    with pytest.raises(ChainError, match="is of model number 0, a FFW-G40-IMU has 537"):
        chain.enable()


def test_a_silent_one_is_told_keeps_its_last_value_and_stops_nothing() -> None:
    bench = Bench(DUCK)
    with bench.link as link:
        link.enable()
        bench.cycles(3)
        bench.device.baud = 57_600  # as good as unplugged
        state = bench.cycles(70)
        assert state.imu is not None
        assert not state.imu.valid
        assert state.imu.age_s > 1.0
        assert tilt_deg(state, LYING) < 1.0
        assert state.valid.all()
        assert link.tripped is None
        bench.device.baud = 1_000_000
        state = bench.cycles(3)
    assert state.imu is not None
    assert state.imu.valid
    assert [e.partition("silent")[0] for e in bench.events if "imu" in e] == [
        "imu (ID 200): ",
        "imu (ID 200): answers again",
    ]


def test_its_bytes_are_in_the_budget() -> None:
    """A sync read of one: 15 bytes out, 11 and 12 back."""
    robot = RobotConfig(name="two", joint_axes="yp", imu=DUCK)
    bare, whole = chain_budget(2, 1_000_000, fast=True), robot_budget(robot, 1_000_000, fast=True)
    assert whole.total_bytes - bare.total_bytes == 38
    bench = Bench(DUCK)
    bench.chain.enable()
    while bench.chain._reads % SLOW_EVERY != 4:  # a cycle in which nothing else is read
        bench.cycles(1)
    before_s = bench.line.busy_s
    bench.cycles(1)
    both_s = bench.line.busy_s - before_s
    assert both_s == pytest.approx((15 + 2 + 23 + 14 + 8 + 2 * 14) * 1e-5)
    bench.chain.disable()
