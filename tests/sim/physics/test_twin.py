"""A twin goes where the body goes that it was put beside."""

import numpy as np

from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.world import FrictionConfig
from snakewalk.drivers.types import BodyPose
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.physics.twin import PlantTwin
from snakewalk.sim.servo.motor import make_drive, motors_of, p_gain_per_rad

ROBOT, WORLD = load_robot("yaw16"), load_world("flat")
DT_S = 0.016


def wave(time_s: float) -> np.ndarray:
    """Goals of a serpenoid."""
    return 0.4 * np.sin(2.0 * np.pi * (0.5 * time_s + np.arange(ROBOT.joint_count) / 14.0))


def test_it_foretells_a_body_that_moves() -> None:
    """Half a second from any moment of a wave, the head is where it will be, to 5 mm."""
    plant = MujocoPlant(ROBOT, WORLD)
    plant.reset((0.0, 0.0), 0.3, wave(0.0))
    motors = motors_of(ROBOT)
    drive = make_drive(motors, ROBOT.servo.supply_v)
    drive.torque_on[:] = 1.0
    gains = zip(ROBOT.position_p_gains, motors, strict=True)
    drive.p_gain_per_rad[:] = [float(p_gain_per_rad(gain, motor)) for gain, motor in gains]
    twin = PlantTwin(ROBOT, WORLD, None)
    seen: list[tuple[BodyPose, np.ndarray]] = []
    predicted: dict[int, np.ndarray] = {}
    for k in range(160):
        seen = [*seen[-1:], (plant.head_pose(), plant.position_rad.copy())]
        if k in predicted:
            np.testing.assert_allclose(seen[-1][0].head_in_world_m, predicted[k], atol=0.005)
        if k in (40, 77, 110):
            (before, before_rad), (now, now_rad) = seen
            twin.begin(before, now, before_rad, now_rad, DT_S)
            for n in range(k, k + 30):
                pose, _ = twin.step(wave(n * DT_S), DT_S)
            predicted[k + 30] = pose.head_in_world_m
            assert np.hypot(*(pose.head_in_world_m - now.head_in_world_m)[:2]) > 0.02
        drive.goal_rad[:] = wave(k * DT_S)
        plant.advance((k + 1) * DT_S, drive)
    assert len(predicted) == 3


def test_on_another_friction_it_slides_as_one_that_was_made_for_it() -> None:
    slick = FrictionConfig(along=0.15, across=0.3)
    changed = PlantTwin(ROBOT, WORLD, None)
    made = PlantTwin(ROBOT, WORLD.model_copy(update={"friction": slick}), None)
    pose = BodyPose(0.0, np.array([0.0, 0.0, ROBOT.body_radius_m]), np.eye(3))

    def moved(twin: PlantTwin) -> np.ndarray:
        twin.begin(pose, pose, wave(0.0), wave(0.0), DT_S)
        return [twin.step(wave(k * DT_S), DT_S)[0].head_in_world_m for k in range(40)][-1]

    before = moved(changed)
    changed.use_friction(slick)
    np.testing.assert_array_equal(moved(changed), moved(made))
    assert np.hypot(*(moved(changed) - before)[:2]) > 0.005
