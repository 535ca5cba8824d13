"""The bodies of a batch: each begins like the body of a run, and moves without the others."""

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.robot.servo import MotorConfig
from snakewalk.sim.batch.bodies import unsupported
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.servo.motor import make_drive, motors_of
from tests.oracles.compiled_bodies import INPUTS, CompiledBodies

ROBOT, FLAT = load_robot("yaw16"), load_world("flat")
STARTS = [((0.0, 0.0), 0.0, np.zeros(16)), ((1.0, -2.0), 0.7, np.linspace(-0.2, 0.3, 16))]
STEPS = 40


class Still(CompiledBodies):
    """Bodies that show what a backend copies to its worlds."""

    @property
    def copied(self) -> tuple[np.ndarray, ...]:
        return self.qpos, self.qvel, self._load, self._before

    @property
    def placed(self) -> list[bool]:
        return self._placed.tolist()


def alone(row: int, step_s: float | None = None) -> MujocoPlant:
    plant = MujocoPlant(ROBOT, FLAT, None, step_s)
    plant.reset(*STARTS[row])
    return plant


def placed(step_s: float | None = None) -> Still:
    bodies = Still(ROBOT, FLAT, 2, step_s)
    for row, start in enumerate(STARTS):
        bodies.place(row, *start)
    return bodies


def test_a_body_is_placed_like_that_of_a_run_and_leaves_the_others() -> None:
    bodies = placed()
    for row in range(2):
        of_run = alone(row).mechanics
        expected = of_run.data.qpos, of_run.data.qvel, of_run.load_n, of_run.before_m
        for copied, own in zip(bodies.copied, expected, strict=True):
            assert copied.shape == (2, *np.shape(own))
            np.testing.assert_array_equal(copied[row], own)
    assert bodies.placed == [True, True]
    bodies.run(1)
    assert bodies.placed == [False, False]
    bodies.energies_j += 1.0
    bodies.totals += 1.0
    qpos = bodies.qpos.copy()
    bodies.place(1, *STARTS[0])
    assert bodies.placed == [False, True]
    np.testing.assert_array_equal(bodies.qpos[0], qpos[0])
    assert (bodies.energies_j[:, 0] >= 1.0).all()
    assert bodies.totals[0].min() >= 1.0
    assert not bodies.energies_j[:, 1].any()
    assert not bodies.totals[1].any()


@pytest.mark.parametrize("step_s", [None, 5e-4])
def test_each_body_moves_as_it_does_alone(step_s: float | None) -> None:
    bodies = placed(step_s)
    plants = [alone(row, step_s) for row in range(2)]
    drives = [make_drive(motors_of(ROBOT), 11.0 + row) for row in range(2)]
    for row, (plant, drive) in enumerate(zip(plants, drives, strict=True)):
        for name, value in (("torque_on", 1.0), ("goal_rad", 0.3 + row), ("p_gain_per_rad", 8.0)):
            getattr(drive, name)[:] = value
        for name in INPUTS:
            getattr(bodies, name)[row] = getattr(drive, name)
        plant.steps.run(STEPS, drive)
    bodies.run(STEPS)
    for row, (plant, drive) in enumerate(zip(plants, drives, strict=True)):
        for own, of_run in (
            (bodies.qpos, plant.mechanics.data.qpos),
            (bodies.energies_j[0], drive.drawn_j),
            (bodies.totals, plant.mechanics.totals[:2]),
        ):
            np.testing.assert_allclose(own[row], of_run, rtol=1e-9, atol=1e-12)
        assert bodies.step_s == plant.step_s


def test_a_drive_begins_open_and_without_limits() -> None:
    bodies = Still(ROBOT, FLAT, 3)
    drive = make_drive(motors_of(ROBOT), 1.0)
    for name in INPUTS:
        np.testing.assert_array_equal(getattr(bodies, name), [getattr(drive, name)] * 3)
    for name in ("current_a", "pwm"):
        assert getattr(bodies, name).shape == (3, ROBOT.joint_count)
    np.testing.assert_array_equal(bodies.friction, [alone(0).mechanics.mu] * 3)


GEARS = "robot yaw16: its gears have friction or backlash"


@pytest.mark.parametrize(
    ("motor", "drag_n_m_s", "world", "why"),
    [
        ({}, 0.0, "flat", None),
        ({}, 0.0, "random-10", "world random-10: is not a level, open floor"),
        ({}, 0.0, "pegs", "world pegs: is not a level, open floor"),
        ({}, 0.1, "flat", None),
        ({"dry_n_m": 0.05}, 0.0, "flat", GEARS),
        ({"backlash_rad": 0.01}, 0.0, "flat", GEARS),
    ],
)
def test_a_batch_needs_a_level_open_floor_and_ideal_gears(
    motor: dict[str, float], drag_n_m_s: float, world: str, why: str | None
) -> None:
    constants = MotorConfig(
        back_emf_v_s=1.8, resistance_ohm=4.0, torque_constant_n_m_a=1.5, **motor
    )
    servo = ROBOT.servo.model_copy(
        update={"motor": constants if motor else None, "gear_drag_n_m_s": drag_n_m_s}
    )
    robot, ground = ROBOT.model_copy(update={"servo": servo}), load_world(world)
    assert unsupported(robot, ground) == why
    if why is not None:
        with pytest.raises(InputError, match=f"{why}; use the backend processes"):
            CompiledBodies(robot, ground, 1)
