"""The body on its floor: rest, friction's sign, and equal answers of both step kernels."""

import mujoco
import numpy as np
import pytest

from snakewalk.config.ground import build_ground
from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import FrictionConfig
from snakewalk.sim.physics.body import mjcf
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.plant import ServoDrive
from snakewalk.sim.servo.motor import MOTORS, make_drive, p_gain_per_rad
from tests.oracles.numpy_steps import drive_shafts, numpy_plant

ROBOT = load_robot("yaw16")
FLAT = load_world("flat")


def plant(friction: FrictionConfig | None = None, **options) -> MujocoPlant:
    world = FLAT if friction is None else FLAT.model_copy(update={"friction": friction})
    return MujocoPlant(ROBOT, world, None, 0.002, **options)


def drive():
    servo = make_drive([MOTORS["XM430-W350"]] * 16, 12.0)
    servo.torque_on[:] = 1.0
    servo.p_gain_per_rad[:] = p_gain_per_rad(800, MOTORS["XM430-W350"])
    return servo


def wave(time_s: float) -> np.ndarray:
    return 0.4 * np.sin(2 * np.pi * (0.3 * time_s - np.arange(16) / 13.0))


def crawl(body: MujocoPlant, seconds: float, servo: ServoDrive | None = None) -> np.ndarray:
    servo = drive() if servo is None else servo
    body.reset((0.0, 0.0), 0.0, wave(0.0))
    start = body.link_positions_m.mean(axis=0)
    for k in range(int(seconds * 50)):
        servo.goal_rad[:] = wave(0.02 * k)
        body.advance(0.02 * (k + 1), servo)
    return body.link_positions_m.mean(axis=0) - start


def test_a_body_at_rest_stays_at_rest() -> None:
    body = plant()
    before = body.link_positions_m
    body.advance(1.0, drive())
    np.testing.assert_allclose(body.link_positions_m, before, atol=1e-4)
    assert body.energy_j[1] < 1e-8


def test_the_wave_drives_forward_with_grip_across_and_backwards_without() -> None:
    seconds = 10.0 / 3.0 * 2
    forward = crawl(plant(), seconds)
    back = crawl(plant(FrictionConfig(along=0.4, across=0.4)), seconds)
    assert np.hypot(*forward[:2]) > 0.5
    assert forward[0] > 0.4
    assert back[0] < 0.0


def test_compiled_and_numpy_steps_agree() -> None:
    one, two = plant(), numpy_plant(ROBOT, FLAT, None, 0.002)
    servos = drive(), drive()
    np.testing.assert_allclose(crawl(one, 0.5, servos[0]), crawl(two, 0.5, servos[1]), atol=1e-9)
    np.testing.assert_allclose(one.position_rad, two.position_rad, atol=1e-9)
    np.testing.assert_allclose(one.mechanics.totals, two.mechanics.totals, atol=1e-9)
    for name in ("drawn_j", "returned_j", "heat_j", "work_j"):
        energies = getattr(servos[0], name), getattr(servos[1], name)
        assert np.abs(energies[0]).max() > 0.0
        np.testing.assert_allclose(*energies, atol=1e-9)


def test_the_same_run_twice_is_the_same_bit_for_bit() -> None:
    one, two = plant(), plant()
    crawl(one, 1.0)
    crawl(two, 1.0)
    assert one.qpos.tobytes() == two.qpos.tobytes()


def test_steps_that_a_signal_ended_can_be_gone_on_with(monkeypatch: pytest.MonkeyPatch) -> None:
    body, servo, calls = numpy_plant(ROBOT, FLAT, None, 0.002), drive(), []

    def interrupted(*given):
        calls.append(given)
        if len(calls) == 4:
            raise KeyboardInterrupt
        return drive_shafts(*given)

    monkeypatch.setattr("tests.oracles.numpy_steps.drive_shafts", interrupted)
    with pytest.raises(KeyboardInterrupt):
        body.advance(0.02, servo)
    assert body.time_s == pytest.approx(0.006)
    body.advance(0.02, servo)
    assert body.time_s == pytest.approx(0.02)
    assert len(calls) == 11


@pytest.mark.parametrize("name", ['15" snake', "a & b", "<robot>", "it's", "ü 蛇", "]]>", "--"])
def test_every_name_of_a_robot_makes_a_model(name: str) -> None:
    robot = RobotConfig(name=name, joint_axes="yy")
    made = mujoco.MjModel.from_xml_string(mjcf(robot, FLAT, None, 0.002))
    assert made.names[: len(name.encode())] == name.encode()


@pytest.mark.slow
def test_a_body_that_is_placed_once_lies_as_one_that_is_placed_again() -> None:
    robot, world = load_robot("alternating16"), load_world("random-10")
    ground, at = build_ground(world), ((0.3, -0.2), 0.4, np.zeros(robot.joint_count))
    states = []
    for is_placed in (True, False):
        body = MujocoPlant(robot, world, ground, is_placed=is_placed)
        body.reset(*at)
        loads = body.mechanics.load_n.copy()
        for k in range(5):
            body.advance(0.02 * (k + 1), drive())
        states.append((loads, body.qpos.copy()))
    (loads_again, qpos_again), (loads_once, qpos_once) = states
    np.testing.assert_array_equal(loads_once, loads_again)
    np.testing.assert_array_equal(qpos_once, qpos_again)
