"""A pilot whose body does not go on looks for another way, and keeps off the place."""

import numpy as np

from snakewalk.controller.app.runs.factory import prepare_walk
from snakewalk.controller.kinematics.links import body_in_world, pose_at
from snakewalk.controller.terrain.path import SplinePath

STEP_S = 0.04


def test_a_body_that_stands_still_gets_a_path_that_keeps_off_the_place() -> None:
    prepared = prepare_walk("jacksboro-traverse", motion="serpenoid")
    planner, asked = prepared.planner, []

    def plan(points_m, heading_rad=None, *, avoid_m=()) -> SplinePath:
        asked.append(np.array(avoid_m))
        return planner(points_m, heading_rad, avoid_m=avoid_m)

    prepared.__dict__["planner"] = plan
    pilot, robot = prepared.pilot(level=True), prepared.robot
    view = body_in_world(
        robot, pose_at(np.array(prepared.run.start_m), 0.0), np.zeros(robot.joint_count)
    )
    bodies_m = 0.0
    while not pilot.missed and bodies_m < 20.0 * robot.length_m:
        pilot.step(STEP_S, view)
        bodies_m += pilot.pulse_m_s * STEP_S
    assert pilot.missed == 1
    assert 4.9 < bodies_m / robot.length_m < 8.0
    assert [len(places) for places in asked] == [0, 1]
    np.testing.assert_allclose(asked[-1][0], view.link_m[0, :2])
