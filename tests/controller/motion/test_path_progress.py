"""Everything that moves joints is one interface; progress along a path is asked for beside it."""

import numpy as np
import pytest

from snakewalk.config.loader import load_robot
from snakewalk.controller.gaits.registry import make_gait
from snakewalk.controller.kinematics.links import body_in_world, pose_at
from snakewalk.controller.motion.gait_motion import GaitMotion
from snakewalk.controller.motion.path_progress import NoPath, PathProgress, path_progress
from snakewalk.controller.motion.source import MotionSource
from snakewalk.controller.run.factory import prepare_walk

ROBOT = load_robot("yaw16")


def test_a_pilot_is_a_motion_source_that_reports_its_path() -> None:
    pilot = prepare_walk("flat-slalom", motion="serpenoid").pilot()
    source: MotionSource = pilot
    assert isinstance(source, PathProgress)
    progress = path_progress(source)
    assert progress is pilot
    assert (progress.reached, progress.missed, source.done) == (0, 0, False)
    points = progress.path_m(60)
    np.testing.assert_allclose(points[0], (0.0, 0.0), atol=1e-9)
    first = source.goal_rad()
    view = body_in_world(ROBOT, pose_at(np.zeros(2), 0.0), first)
    np.testing.assert_array_equal(progress.begin(view), first)
    after = source.step(0.02, view)
    np.testing.assert_array_equal(source.goal_rad(), after)
    assert np.abs(source.velocity_rad_s()).max() < source.pace().speed_rad_s.max()
    assert progress.decision is not None


def test_a_step_too_short_to_measure_a_speed_is_saved_up() -> None:
    pilot = prepare_walk("flat-slalom", motion="serpenoid").pilot()
    view = body_in_world(ROBOT, pose_at(np.zeros(2), 0.0), pilot.goal_rad())
    pilot.step(1e-7, view)
    assert pilot.head == 100.0
    assert not pilot.velocity_rad_s().any()
    pilot.step(0.02, view)
    assert pilot.head > 100.0


def test_a_gait_follows_no_path() -> None:
    gait = GaitMotion(make_gait("lateral-undulation"), ROBOT)
    assert not isinstance(gait, PathProgress)
    progress = path_progress(gait)
    assert isinstance(progress, NoPath)
    assert (progress.reached, progress.missed, progress.pulse_m_s) == (0, 0, 0.0)
    assert np.isnan(progress.along_m)
    assert progress.decision is None
    view = body_in_world(ROBOT, pose_at(np.zeros(2), 0.0), gait.goal_rad())
    assert progress.begin(view) == pytest.approx(gait.goal_rad())
