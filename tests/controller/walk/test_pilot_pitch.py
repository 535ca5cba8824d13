"""Pitch goals of the pilot: those of the body that will be there when the servos have followed."""

import numpy as np
import pytest

from snakewalk.controller.kinematics.links import body_in_world, pose_at
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.drivers.types import BodyPose

STEP_S = 0.02


def pitch_goals(lead_s: float) -> np.ndarray:
    """Goals (T, P) of a serpenoid that is carried along its track without slip, over hills."""
    prepared = prepare_walk("jacksboro-traverse", motion="serpenoid")
    servo = prepared.robot.servo.model_copy(update={"pitch_lead_s": lead_s})
    object.__setattr__(prepared, "robot", prepared.robot.model_copy(update={"servo": servo}))
    pilot, robot = prepared.pilot(), prepared.robot
    joints = np.where(np.isin(np.arange(robot.joint_count), robot.yaw_joints), pilot.goal_rad(), 0)
    head_m, heading = np.array(prepared.run.start_m, dtype=float), prepared.start_heading_rad
    goals = []
    for _ in range(400):
        pose = pose_at(head_m, heading)
        view = body_in_world(robot, BodyPose(0.0, pose.head_in_world_m, pose.rotation), joints)
        goal = pilot.step(STEP_S, view)
        goals.append(goal[list(robot.pitch_joints)])
        after = np.where(np.isin(np.arange(robot.joint_count), robot.yaw_joints), goal, 0)
        # the head goes along itself at the pulse; behind it the chain follows its track
        turn = pilot._chooser.track
        ahead = pilot.pulse_m_s * STEP_S
        head_m = head_m + ahead * np.array([np.cos(heading), np.sin(heading)])
        at = np.array([pilot.head - 3.0, pilot.head - 3.0 - ahead / (robot.length_m / 100)])
        heading += float(np.subtract(*turn.at_rad(at)))
        joints = after
    return np.array(goals)


@pytest.mark.slow
def test_goals_with_a_lead_are_those_of_later_without() -> None:
    """The lead is found again as the shift at which both agree best."""
    now, early = pitch_goals(0.0), pitch_goals(0.24)
    moving = slice(100, 360)  # the pulse has its speed; behind it no goal is cut off
    errors = [
        float(np.mean((early[moving] - now[100 + shift : 360 + shift]) ** 2)) for shift in range(30)
    ]
    assert int(np.argmin(errors)) * STEP_S == pytest.approx(0.24, abs=0.06)
    assert min(errors) < 0.2 * errors[0]
