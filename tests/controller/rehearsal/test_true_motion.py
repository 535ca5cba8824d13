"""The metrics of a true motion: closed forms of its displacement, speed and slip alarms."""

from dataclasses import replace

import numpy as np
import pytest

from snakewalk.controller.pose.external_pose import START_SD_DEG
from snakewalk.controller.rehearsal.rehearsal import (
    START_SD_M,
    moved,
    slip_alarms,
    with_head_poses,
)
from snakewalk.controller.run.external.served_robot import Place
from snakewalk.controller.runlog.record import RunRecord

PULSE_M_S = 0.5


@pytest.fixture
def steady(record: RunRecord) -> RunRecord:
    """A record whose pulse rests for a second, then travels; the body has 40 % of its speed."""
    pulse = np.where(record.pose.time_s < record.pose.time_s[0] + 1.0, 0.0, PULSE_M_S)
    pose = replace(record.pose, pulse_m_s=pulse, predicted_speed_m_s=0.4 * pulse)
    return replace(record, pose=pose)


def test_a_body_at_its_predicted_speed_slips_never_and_one_at_rest_in_each_window(
    steady: RunRecord,
) -> None:
    travelled_m = steady.pose.pulse_m_s * steady.period_s
    assert slip_alarms(steady, 0.4 * travelled_m) == 0
    windows = int(travelled_m.sum() / steady.header.robot.length_m)
    assert windows - 1 <= slip_alarms(steady, 0.0 * travelled_m) <= windows
    assert windows > 3


def test_a_shape_at_rest_has_no_alarm(steady: RunRecord) -> None:
    none = np.zeros_like(steady.pose.pulse_m_s)
    at_rest = replace(steady, pose=replace(steady.pose, pulse_m_s=none))
    assert slip_alarms(at_rest, none) == 0


def test_a_stiff_body_advances_as_its_head_and_its_speed_settles(record: RunRecord) -> None:
    count = len(record.pose.time_s)
    cycle = replace(record.cycle, measured_rad=np.zeros_like(record.cycle.measured_rad))
    head_m = np.zeros((count, 3))
    head_m[:, 0] = 0.1 / record.header.run.cycle_hz * np.arange(count)
    stiff, displacement_m = with_head_poses(
        replace(record, cycle=cycle), head_m, np.tile(np.eye(3), (count, 1, 1))
    )
    np.testing.assert_allclose(displacement_m, np.diff(head_m[:, 0], prepend=0.0), atol=1e-12)
    assert stiff.pose.speed_m_s[0] == 0.0
    assert (np.diff(stiff.pose.speed_m_s) > -1e-12).all()
    assert stiff.pose.speed_m_s[-1] == pytest.approx(0.1, rel=1e-3)
    length_m = stiff.pose.links_m[:, 0, 0] - stiff.pose.links_m[:, -1, 0]
    np.testing.assert_allclose(length_m, length_m[0], atol=1e-12)


def test_a_robot_is_laid_down_near_its_place() -> None:
    place = Place((1.0, -7.0), 0.3)
    drawn = [moved(place, np.random.default_rng(seed)) for seed in range(200)]
    off_m = np.array([each.start_m for each in drawn]) - place.start_m
    assert np.abs(off_m.mean(axis=0)).max() < 4.0 * START_SD_M / np.sqrt(200)
    assert off_m.std(axis=0) == pytest.approx([START_SD_M] * 2, rel=0.25)
    turned_rad = np.array([each.heading_rad for each in drawn]) - 0.3
    assert turned_rad.std() == pytest.approx(np.radians(START_SD_DEG), rel=0.25)
