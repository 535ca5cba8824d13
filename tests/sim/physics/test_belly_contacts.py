"""Contacts of bellies against those that MuJoCo finds itself, and what is left to MuJoCo."""

import mujoco
import numpy as np
import pytest
from packaging.version import Version
from pytest_mock import MockerFixture

from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.robot import BellyConfig, RobotConfig
from snakewalk.sim.physics.belly_contacts import BellyContacts, links_near
from snakewalk.sim.physics.layout import StepLayout, step_layout
from snakewalk.sim.physics.mechanics import Mechanics
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.physics.step_memory import FUNCTIONS, WHOLE
from snakewalk.sim.plant import ServoDrive
from snakewalk.sim.servo.motor import MOTORS, make_drive, p_gain_per_rad
from tests.helpers.physics import FLAT, ROBOT, Floats
from tests.helpers.uneven import UNEVEN

_FOUND = step_layout()
if not isinstance(_FOUND, StepLayout) or not _FOUND.has_parts:
    if Version(mujoco.__version__) >= Version("3.17"):
        raise AssertionError(f"MuJoCo {mujoco.__version__} is not stepped by parts: {_FOUND}")
    pytest.skip("this MuJoCo is not stepped by parts", allow_module_level=True)
LAYOUT: StepLayout = _FOUND
RNG = np.random.default_rng(5)
HILLS = HeightField(0.02 * RNG.normal(size=(81, 81)), 0.05, -2.0, -2.0)
STEPS = HeightField(np.where(np.arange(81) % 8 < 4, 0.0, 0.04) * np.ones((81, 1)), 0.05, -2.0, -2.0)
GROUNDS = {"floor": None, "hills": HILLS, "steps": STEPS}
BODIES = {
    "capsules": ROBOT,
    "balls": ROBOT.model_copy(update={"belly": BellyConfig(shape="ball")}),
    "rails": ROBOT.model_copy(update={"belly": BellyConfig(shape="rails", width_m=0.1)}),
    "alternating": load_robot("alternating12"),
    "uneven": UNEVEN,
}
COMPARED = ("geom", "dist", "pos", "includemargin", "friction", "solref", "solimp", "dim", "mu")


def a_drive(robot: RobotConfig) -> ServoDrive:
    motor = MOTORS["XM430-W350"]
    drive = make_drive([motor] * robot.joint_count, 12.0)
    drive.torque_on[:] = 1.0
    drive.p_gain_per_rad[:] = p_gain_per_rad(400, motor)
    return drive


def wave(robot: RobotConfig, time_s: float) -> Floats:
    """Joint angles that grow within a second; pitch joints move as well."""
    phase = 4.0 * time_s - np.arange(robot.joint_count) / 2.2
    return np.asarray(0.4 * min(1.0, time_s) * np.sin(phase))


def contacts_of(robot: RobotConfig, ground: HeightField | None) -> BellyContacts | None:
    return BellyContacts.of(MujocoPlant(robot, FLAT, ground).mechanics, LAYOUT)


def assert_as_mujoco(m: Mechanics, qpos: Floats) -> None:
    """The contacts in the data are those of MuJoCo at ``qpos``, in its order."""
    data = mujoco.MjData(m.model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(m.model, data)
    mujoco.mj_comPos(m.model, data)
    mujoco.mj_collision(m.model, data)
    found, expected = m.data.contact, data.contact
    for name in (*COMPARED, "exclude"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), name)
    np.testing.assert_array_equal(found.frame[:, :3], expected.frame[:, :3])


@pytest.mark.slow_cases(1, "a moving body each: 1 s of CPU")
@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("ground", GROUNDS.values(), ids=GROUNDS)
@pytest.mark.parametrize("robot", BODIES.values(), ids=BODIES)
def test_a_moving_body_has_the_contacts_that_mujoco_finds(
    robot: RobotConfig, ground: HeightField | None
) -> None:
    plant = MujocoPlant(robot, FLAT, ground)
    drive = a_drive(robot)
    assert contacts_of(robot, ground) is not None
    numbers = set()
    for k in range(300):
        drive.goal_rad[:] = wave(robot, 5.0 * k * plant.step_s)
        before = plant.qpos
        plant.advance(plant.time_s + 1.001 * plant.step_s, drive)
        assert_as_mujoco(plant.mechanics, before)
        numbers.add(plant.mechanics.data.ncon)
    assert max(numbers) > 0


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("ground", GROUNDS.values(), ids=GROUNDS)
def test_a_run_by_parts_is_the_run_by_whole_steps_to_the_bit(
    ground: HeightField | None, mocker: MockerFixture
) -> None:
    ends = []
    for by_parts in (True, False):
        if not by_parts:
            mocker.patch.object(BellyContacts, "of", return_value=None)
        plant = MujocoPlant(ROBOT, FLAT, ground)
        drive = a_drive(ROBOT)
        for k in range(60):
            drive.goal_rad[:] = wave(ROBOT, 0.04 * k)
            plant.advance(0.02 * (k + 1), drive)
        ends.append((plant.qpos, plant.mechanics.load_n.copy(), plant.mechanics.totals.copy()))
    for one, other in zip(*ends, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.slow
def test_links_that_touch_each_other_are_found_by_mujoco() -> None:
    """A body that closes to a ring, and beyond."""
    plant, drive = MujocoPlant(ROBOT, FLAT), a_drive(ROBOT)
    mutual = near = 0
    m = plant.mechanics
    bellies = contacts_of(ROBOT, None)
    assert bellies is not None
    for k in range(600):
        drive.goal_rad[:] = 0.55 * min(1.0, k / 400)
        before = plant.qpos
        plant.advance(plant.time_s + 1.001 * plant.step_s, drive)
        assert_as_mujoco(m, before)
        mutual += bool((m.data.contact.geom[:, 0] > 0).any())
        near += links_near(m.data.xipos, bellies.reach_m2, np.zeros((3, m.model.nbody)))
    assert 0 < mutual < near < 600


def test_feet_and_obstacles_are_left_to_mujoco() -> None:
    assert contacts_of(load_robot("salamander"), None) is None
    assert contacts_of(load_robot("salamander"), HILLS) is None
    for name in ("pegs", "corridor"):
        assert BellyContacts.of(MujocoPlant(ROBOT, load_world(name)).mechanics, LAYOUT) is None


def test_a_mujoco_without_the_parts_is_stepped_as_a_whole(mocker: MockerFixture) -> None:
    whole = {name: LAYOUT.functions[name] for name in FUNCTIONS[:WHOLE]}
    without = StepLayout(LAYOUT.data, LAYOUT.contact, whole)
    mocker.patch("snakewalk.sim.physics.stepper.step_layout", return_value=without)
    plant, usual = MujocoPlant(ROBOT, FLAT), a_drive(ROBOT)
    plant.advance(0.1, usual)
    mocker.stopall()
    other = MujocoPlant(ROBOT, FLAT)
    other.advance(0.1, a_drive(ROBOT))
    np.testing.assert_array_equal(plant.qpos, other.qpos)
