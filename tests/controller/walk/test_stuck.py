"""A body without advance backs out along its track, and rests after the third stall there."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from snakewalk.controller.kinematics.links import BodyView, body_in_world, pose_at
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.run.kinds.walk_run import POINTS
from snakewalk.controller.walk.pilot import Pilot

STEP_S = 0.04


def standing(prepared, roll_rad: float = 0.0) -> BodyView:
    robot = prepared.robot
    pose = pose_at(np.array(prepared.run.start_m), prepared.start_heading_rad)
    turn = Rotation.from_rotvec([roll_rad, 0.0, 0.0]).as_matrix()
    pose = pose._replace(rotation=pose.rotation @ turn)
    return body_in_world(robot, pose, np.zeros(robot.joint_count))


def stepped(pilot: Pilot, view: BodyView, limit_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Heads and goals of each step until the pilot is done."""
    heads, goals = [pilot.head], [pilot.begin(view)]
    while not pilot.done and len(heads) * STEP_S < limit_s:
        goals.append(pilot.step(STEP_S, view))
        heads.append(pilot.head)
    return np.array(heads), np.array(goals)


@pytest.mark.slow
@pytest.mark.parametrize("motion", ["serpenoid", "walk"])
def test_a_body_that_stands_still_backs_out_once_and_then_rests(motion: str) -> None:
    prepared = prepare_walk("flat-slalom", motion=motion)
    pilot, events = prepared.pilot(level=True), list[str]()
    pilot.on_event = lambda kind, text: events.append(f"{kind}: {text}")
    heads, goals = stepped(pilot, standing(prepared), 150.0)
    assert pilot.done
    assert not pilot.course.complete
    assert [text.split(":")[0] for text in events] == ["stuck", "stuck"]
    assert "backs out" in events[0]
    assert "3 attempts" in events[1]
    turn = int(np.argmax(np.diff(heads) < 0.0))
    assert heads[turn] - heads[turn:].min() == pytest.approx(1.5 * POINTS, abs=0.2 * POINTS)
    speed = np.diff(goals, axis=0) / STEP_S
    robot = prepared.robot
    assert np.abs(speed).max() <= 1.001 * robot.joint_speed_limit_rad_s
    assert (
        np.abs(np.diff(speed, axis=0)).max() / STEP_S <= 1.1 * robot.joint_acceleration_limit_rad_s2
    )
    assert pilot.pulse_m_s == 0.0


@pytest.mark.slow
def test_a_body_on_its_side_rests_at_its_first_stall() -> None:
    prepared = prepare_walk("flat-slalom", motion="serpenoid")
    pilot, events = prepared.pilot(level=True), list[str]()
    pilot.on_event = lambda kind, text: events.append(text)
    heads, _ = stepped(pilot, standing(prepared, roll_rad=1.6), 60.0)
    assert pilot.done
    assert len(events) == 1
    assert "92 degrees off upright: the body rests" in events[0]
    assert (np.diff(heads) >= 0.0).all()
