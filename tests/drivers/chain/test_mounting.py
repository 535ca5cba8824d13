"""Any chain: IDs, signs, zeros and models of each joint, which nobody above the chain notices."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import JointConfig, RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.config.world import WorldConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import ChainError, ControlTableError
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointCommand
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.plant import Mounting, Plant
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

JOINTS, AXES = 6, "ypypyp"
PLAIN = RobotConfig(name="plain", joint_axes=AXES)
SPARE_RAD = math.pi - math.tau / 4096 - max(PLAIN.limit_rad)


@st.composite
def scrambled(draw: st.DrawFn) -> RobotConfig:
    """The plain robot, with the servos somebody happened to have, mounted as they happened to."""
    ids = draw(st.permutations(range(253)))[:JOINTS]
    joints = tuple(
        JointConfig(
            id=servo_id,
            sign=draw(st.sampled_from([1, -1])),
            zero_rad=draw(st.floats(-SPARE_RAD + 0.01, SPARE_RAD - 0.01)),
        )
        for servo_id in ids
    )
    return PLAIN.model_copy(update={"joints": joints})


def line_of(robot: RobotConfig, plant: Plant) -> SimLine:
    bank = ServoBank(robot.servo_ids, robot.servo_models)
    return SimLine(bank, plant, mounting=Mounting.of(robot))


def driven(robot: RobotConfig, plant: Plant, cycles: int) -> tuple[list[Floats], list[Floats]]:
    """Shafts and states of some cycles under the same goals, through the safe link."""
    line = line_of(robot, plant)
    chain = ServoChain(DynamixelBus(line, robot.models_by_id), robot)
    shafts, states = [], []
    with SafeLink(chain, SafetyLimits.from_config(robot, SafetyConfig()), line.clock) as link:
        start_s = link.enable().time_s
        phase = np.arange(JOINTS) * 0.7
        for cycle in range(1, cycles + 1):
            line.clock.sleep_until_s(start_s + 0.02 * cycle)
            wave = 0.15 * np.sin(0.12 * cycle + phase) * min(1.0, cycle / 20)
            link.write(JointCommand(line.clock.now_s(), wave))
            state = link.read()
            shafts.append(np.concatenate([plant.position_rad, plant.velocity_rad_s]))
            states.append(
                np.stack([state.position_rad, state.velocity_rad_s, state.current_a, state.age_s])
            )
    return shafts, states


@pytest.mark.slow
@settings(max_examples=12)
@given(robot=scrambled())
def test_a_scrambled_chain_moves_the_shafts_to_the_bit_as_the_plain_one(robot: RobotConfig) -> None:
    mine, plain = (driven(each, BenchPlant(JOINTS), 40) for each in (robot, PLAIN))
    for ours, theirs in zip(mine, plain, strict=True):
        assert np.array(ours).tobytes() == np.array(theirs).tobytes()


@pytest.mark.slow
@settings(max_examples=3)
@given(robot=scrambled())
def test_a_scrambled_chain_moves_a_body_to_the_bit_as_the_plain_one(robot: RobotConfig) -> None:
    world = WorldConfig(name="floor")
    plants = [MujocoPlant(each, world) for each in (robot, PLAIN)]
    mine, plain = (driven(each, p, 60) for each, p in zip((robot, PLAIN), plants, strict=True))
    for ours, theirs in zip(mine, plain, strict=True):
        assert np.array(ours).tobytes() == np.array(theirs).tobytes()
    assert plants[0].qpos.tobytes() == plants[1].qpos.tobytes()
    assert np.abs(np.array(plain[1])[:, 0]).max() > 0.1  # and it did move


def test_the_servo_itself_shows_where_it_stands() -> None:
    robot = PLAIN.model_copy(
        update={"joints": tuple(JointConfig(sign=-1, zero_rad=0.5) for _ in AXES)}
    )
    line = line_of(robot, BenchPlant(JOINTS, start_rad=0.2))
    line.settle()
    expected = 2048 + (0.5 - 0.2) * 4096 / math.tau
    assert line.shown("Present Position") == pytest.approx(expected, abs=1.0)
    chain = ServoChain(DynamixelBus(line), robot)
    assert chain.enable().position_rad == pytest.approx(0.2, abs=2e-3)
    half = math.floor(1.5 * 4096 / math.tau)
    zero = 2048 + round(0.5 * 4096 / math.tau)
    assert line.bank["Min Position Limit"][0] == zero - half
    assert line.bank["Max Position Limit"][0] == zero + half


MIXED = PLAIN.model_copy(
    update={
        "joints": tuple(
            JointConfig(id=10 + k, model=model)
            for k, model in enumerate(["XM430-W350", "XL330-M288", "XH430-V210"] * 2)
        )
    }
)


def test_servos_of_several_models_share_a_chain() -> None:
    line = line_of(MIXED, BenchPlant(JOINTS))
    chain = ServoChain(DynamixelBus(line, MIXED.models_by_id), MIXED)
    chain.enable()
    assert chain.inspection is not None
    assert [each.model for each in chain.inspection.servos] == list(MIXED.servo_models)
    goal_a = line.bank["Goal Current"][[1, 3, 5]]  # pitch joints: 0.1 A, in units of each model
    assert goal_a.tolist() == [100, round(0.1 / 2.69e-3), round(0.1 / 1.34e-3)]
    chain.write(JointCommand(line.clock.now_s(), np.full(JOINTS, 0.3)))
    line.clock.advance(0.01)
    state = chain.read()
    unit_a = np.array([2.69e-3, 1e-3, 1.34e-3] * 2)
    raw = line.bank["Present Current"]
    assert (raw > 20).all()
    assert state.current_a.tolist() == (raw * unit_a).tolist()


def test_a_servo_of_another_model_than_the_joint_says_is_told() -> None:
    line = line_of(MIXED, BenchPlant(JOINTS))
    other = MIXED.joints[1].model_copy(update={"model": "XM430-W350"})
    robot = MIXED.model_copy(update={"joints": (MIXED.joints[0], other, *MIXED.joints[2:])})
    chain = ServoChain(DynamixelBus(line, robot.models_by_id), robot)
    with pytest.raises(
        ChainError, match=r"joint pitch_02 \(ID 11\): is a XL330-M288, not a XM430-W350"
    ):
        chain.enable()


def test_models_that_cannot_share_a_group_packet_are_refused_before_anything_is_sent() -> None:
    line = line_of(PLAIN, BenchPlant(JOINTS))
    bus = DynamixelBus(line, {1: "XM430-W350", 2: "PH42-020-S300"})
    with pytest.raises(ControlTableError, match=r"lies apart \(XM430-W350 at 116, PH42-020-S300"):
        bus.sync_write([1, 2], "Goal Position", 0)
    with pytest.raises(ControlTableError, match="lies apart"):
        bus.cycle([1, 2])


def test_a_silent_servo_of_scrambled_ids_is_named_among_them() -> None:
    robot = PLAIN.model_copy(
        update={"joints": tuple(JointConfig(id=each) for each in (9, 4, 30, 2, 17, 5))}
    )
    line = line_of(PLAIN, BenchPlant(JOINTS))
    with pytest.raises(ChainError, match="servo 9, 30, 17 of 9, 4, 30, 2, 17, 5 at"):
        ServoChain(DynamixelBus(line, robot.models_by_id), robot).enable()
