"""What gaits do with a body on the ground: the way they go, and the mirror image of it."""

from dataclasses import dataclass

import numpy as np
import pytest

from snakewalk.config.loader import load_gait, load_robot, load_world
from snakewalk.controller.gaits.registry import make_gait
from snakewalk.controller.kinematics.frame import Frame
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.kinematics.virtual_chassis import virtual_chassis
from snakewalk.controller.motion.gait_motion import GaitMotion
from snakewalk.controller.motion.head_steering import HeadSteering, HeadTarget
from snakewalk.controller.motion.source import MotionSource
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.servo.motor import MOTORS, make_drive, p_gain_per_rad

DT_S = 0.02


@dataclass
class Way:
    """A cycle, mean; body lengths and radians."""

    forward: float
    left: float
    turn: float
    upright: bool
    head_rad: np.ndarray
    """Of the head link, every control cycle."""


def go(source: MotionSource, gait: GaitMotion, robot_name: str, world: str, cycles: int) -> Way:
    robot = load_robot(robot_name)
    plant = MujocoPlant(robot, load_world(world), None, 0.002)
    goal = source.goal_rad()
    plant.reset((0.0, 0.0), 0.0, goal)
    motor = MOTORS[robot.servo.model]
    drive = make_drive([motor] * robot.joint_count, robot.servo.supply_v)
    drive.torque_on[:] = 1.0
    drive.p_gain_per_rad[:] = p_gain_per_rad(np.full(robot.joint_count, 800), motor)
    frame: Frame | None = None
    marks, heads, time_s = [], [], 0.0
    while len(marks) < cycles + 1:
        pose = plant.head_pose()
        view = body_in_world(robot, pose, plant.position_rad)
        frame = virtual_chassis(view.link_m, pose.rotation[:, 2], frame)
        if gait.cycles >= 1.0 + len(marks):
            marks.append((*frame.origin_m[:2], frame.heading_rad))
        heads.append(pose.heading_rad)
        drive.goal_rad[:] = source.step(DT_S, view)
        time_s += DT_S
        plant.advance(time_s, drive)
        assert time_s < 60.0
    x, y, heading = np.array(marks).T
    heading = np.unwrap(heading)
    middle = 0.5 * (heading[1:] + heading[:-1])
    dx, dy = np.diff(x), np.diff(y)
    forward = (np.cos(middle) * dx + np.sin(middle) * dy).mean() / robot.length_m
    left = (-np.sin(middle) * dx + np.cos(middle) * dy).mean() / robot.length_m
    turn = (heading[-1] - heading[0]) / cycles
    upright = plant.head_pose().rotation[2, 2] > 0.8
    return Way(forward, left, turn, upright, np.array(heads))


def way(name: str, robot: str, world: str = "isotropic", cycles: int = 2, **values: object) -> Way:
    gait = GaitMotion(make_gait(name, dict(values)), load_robot(robot))
    return go(gait, gait, robot, world, cycles)


def test_lateral_undulation_goes_forward_on_wheels_and_nowhere_without() -> None:
    wheels = way("lateral-undulation", "yaw16", "flat")
    assert wheels.forward > 0.5
    assert abs(wheels.turn) < 0.05
    assert way("lateral-undulation", "yaw16").forward < 0.05


def test_sidewinding_goes_sideways_and_its_mirror_image_to_the_other_side() -> None:
    plain, mirrored = (way("sidewinding", "alternating16", mirror=m) for m in (False, True))
    assert plain.left > 0.25
    assert abs(plain.forward) < 0.1
    assert plain.upright
    assert mirrored.left == pytest.approx(-plain.left, abs=0.02)
    assert mirrored.forward == pytest.approx(plain.forward, abs=0.02)
    assert mirrored.turn == pytest.approx(-plain.turn, abs=0.03)


def test_rolling_goes_sideways_without_turning() -> None:
    rolled = way("rolling", "alternating16", cycles=4)
    assert rolled.left > 0.1
    assert abs(rolled.forward) < 0.02
    assert abs(rolled.turn) < 0.02


def test_turning_in_place_turns_and_stays() -> None:
    turned = way("turn-in-place", "alternating16")
    assert turned.turn > 1.0
    assert np.hypot(turned.forward, turned.left) < 0.1
    assert turned.upright


def test_rectilinear_motion_goes_straight_forward_on_any_ground() -> None:
    crept = way("rectilinear", "alternating16", cycles=4)
    assert crept.forward > 0.015
    assert abs(crept.left) < 0.005
    assert abs(crept.turn) < 0.02
    assert crept.upright


@pytest.mark.slow
def test_concertina_goes_forward_without_wheels_and_with_yaw_joints_alone() -> None:
    known = load_gait("concertina-yaw16")
    drawn = way(known.gait, known.robot, cycles=1, **known.parameters)
    assert drawn.forward > 0.05
    assert abs(drawn.turn) < 0.05


def test_the_head_keeps_its_heading_while_the_body_undulates() -> None:
    robot = load_robot("yaw16")
    free = way("lateral-undulation", "yaw16", "flat", cycles=3)
    gait = GaitMotion(make_gait("lateral-undulation"), robot)
    steered = go(HeadSteering(gait, robot, HeadTarget(heading_rad=0.3)), gait, "yaw16", "flat", 3)
    settled = slice(int(1.5 / DT_S), None)
    swing, kept = free.head_rad[settled], steered.head_rad[settled] - 0.3
    assert np.abs(swing).max() > 0.5
    assert np.sqrt(np.mean(kept**2)) < 0.12
    assert steered.forward > 0.6 * free.forward


def test_the_head_looks_at_a_point_that_it_passes() -> None:
    robot = load_robot("yaw16")
    point = (0.6, 0.5)
    gait = GaitMotion(make_gait("lateral-undulation"), robot)
    steered = go(HeadSteering(gait, robot, HeadTarget(point_m=point)), gait, "yaw16", "flat", 1)
    assert steered.head_rad[-1] > 0.4
