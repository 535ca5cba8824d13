"""A pilot at the start: it thinks while the body stands, a little in each cycle."""

import numpy as np

from snakewalk.controller.kinematics.links import body_in_world, pose_at
from snakewalk.controller.run.factory import prepare_walk

PERIOD_S = 0.02


def test_the_first_decision_is_thought_about_in_cycles_while_the_body_stands() -> None:
    prepared = prepare_walk("flat-square")
    pilot, robot = prepared.pilot(), prepared.robot
    view = body_in_world(robot, pose_at(np.zeros(2), 0.0), np.zeros(robot.joint_count))
    first = pilot.begin(view)
    alone = prepared.pilot()._chooser
    thoughts = 1
    while alone.think(lambda: pilot.path_pose(view)):
        thoughts += 1
    goals = [first, pilot.step(PERIOD_S, view)]
    while pilot.decision is None:
        np.testing.assert_array_equal(goals[-1], first)
        goals.append(pilot.step(PERIOD_S, view))
    assert len(goals) - 1 == thoughts > 10
    goals += [pilot.step(PERIOD_S, view) for _ in range(25)]
    hard = np.abs(np.diff(goals, n=2, axis=0)).max() / PERIOD_S**2
    assert 0.0 < hard <= 1.05 * robot.joint_acceleration_limit_rad_s2
