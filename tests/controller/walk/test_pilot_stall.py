"""When a pilot lays another path, and what it says of it."""

from types import SimpleNamespace

import numpy as np
import pytest

from snakewalk.controller.kinematics.links import body_in_world, pose_at
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.terrain.in_steps import Steps
from snakewalk.controller.terrain.path import SplinePath

STEP_S = 0.04


def test_a_body_that_stands_still_gets_a_path_that_keeps_off_the_place() -> None:
    prepared = prepare_walk("jacksboro-traverse", motion="serpenoid")
    planner, asked = prepared.planner, []

    def plan(points_m, heading_rad=None, *, avoid_m=(), number=1) -> Steps[SplinePath]:
        asked.append(np.array(avoid_m))
        return planner.in_steps(points_m, heading_rad, avoid_m=avoid_m)

    prepared.__dict__["planner"] = SimpleNamespace(in_steps=plan)
    pilot, robot = prepared.pilot(level=True), prepared.robot
    view = body_in_world(
        robot, pose_at(np.array(prepared.run.start_m), 0.0), np.zeros(robot.joint_count)
    )
    bodies_m = 0.0
    while not pilot.missed and bodies_m < 20.0 * robot.length_m:
        pilot.step(STEP_S, view)
        bodies_m += pilot.pulse_m_s * STEP_S
    assert pilot.missed == 1
    assert pilot.replanned == "no advance on the path"
    assert 4.9 < bodies_m / robot.length_m < 8.0
    assert [len(places) for places in asked] == [0, 1]
    np.testing.assert_allclose(asked[-1][0], view.link_m[0, :2])


@pytest.mark.parametrize(
    ("beside_m", "ahead_m", "why"),
    [
        (0.3, 0.0, None),
        (0.8, 0.0, None),
        (1.0, 0.0, "1.00 m off the path"),
        (0.4, 0.5, "waypoint 1 passed by"),
    ],
)
def test_the_reason_for_another_path_is_the_one_that_holds(
    beside_m: float, ahead_m: float, why: str | None
) -> None:
    prepared = prepare_walk("flat-slalom", motion="serpenoid")
    pilot, robot, path = prepared.pilot(), prepared.robot, prepared.path
    at_m = path.first_pass(np.array(prepared.run.waypoints_m[0])) + ahead_m if ahead_m else 0.6
    heading = path.heading_rad(at_m)
    aside = beside_m * np.array([-np.sin(heading), np.cos(heading)])
    view = body_in_world(robot, pose_at(np.zeros(2), heading), np.zeros(robot.joint_count))
    centre_m = path.position(at_m) + aside
    view = body_in_world(
        robot, pose_at(centre_m - view.centre_m[:2], heading), np.zeros(robot.joint_count)
    )
    pilot.course._along_m[:] = at_m
    pilot.step(STEP_S, view)
    assert pilot.replanned is None
    assert pilot.course.is_planning == (why is not None)
    if why is not None:
        for _ in range(100):  # more than the planning needs
            pilot.step(STEP_S, view)
            if not pilot.course.is_planning:
                break
        assert pilot.replanned == why
