"""Poses that move like the joints, and poses of another unit, frame or handedness."""

import numpy as np
import pytest

from snakewalk.controller.pose.motion_check import LEAST, MotionCheck
from snakewalk.controller.pose.motion_history import Moment
from snakewalk.controller.pose.tracked_body import HeadMeasurement

NONE = np.zeros((3, 3))


def turned(angle_rad: float) -> np.ndarray:
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def checked(
    *,
    scale: float = 1.0,
    source_deg: float = 0.0,
    frame_deg: float = 0.0,
    mirror: float = 1.0,
    turn_rad: float = 0.3,
    sideways: float = 0.0,
    still: bool = False,
    steps: int = LEAST + 2,
) -> MotionCheck:
    """Check of a head that swings left and right and goes on 3 cm along it in each step.

    Args:
        scale: of the source's positions.
        source_deg: angle between the source's and the dead-reckoned frame.
        frame_deg: angle by which the source's positions alone are turned.
        mirror: -1 for a source whose y axis points to the right.
        turn_rad: each step turns by it, to the left and to the right in turn.
        sideways: share of each step by which the source moves to a side, left and right in turn.
        still: the joints report no motion.
        steps: number of measurements after the first.

    """
    check = MotionCheck()
    place = np.array([1.0, 2.0, 0.2])
    frame, positions = turned(np.radians(source_deg)), turned(np.radians(frame_deg))
    aside = np.zeros(2)
    for k in range(steps + 1):
        x, y = place[:2] + aside
        position = scale * positions @ frame @ [x, mirror * y, 0.0]
        heading = np.radians(source_deg) + mirror * place[2]
        measured = HeadMeasurement(position, turned(heading), NONE, NONE)
        known = np.array([1.0, 2.0, 0.2]) if still else place.copy()
        check.add(measured, Moment(0.5 * k, known, np.zeros(1)))
        place[2] += turn_rad * (-1.0) ** k
        step = 0.05 * np.array([np.cos(place[2]), np.sin(place[2])])
        place[:2] += step
        aside += sideways * (-1.0) ** k * np.array([-step[1], step[0]])
    return check


@pytest.mark.parametrize("source_deg", [0.0, 70.0, -170.0])
def test_a_source_in_any_frame_agrees_if_it_turns_and_moves_as_the_joints(
    source_deg: float,
) -> None:
    check = checked(source_deg=source_deg)
    assert check.fault is None
    assert check.has_agreed


def test_a_head_that_does_not_turn_or_move_shows_nothing() -> None:
    for check in (checked(still=True), checked(turn_rad=0.1), checked(steps=LEAST - 1)):
        assert check.fault is None
        assert not check.has_agreed


@pytest.mark.parametrize(("scale", "agrees"), [(0.1, True), (19.0, True), (21.0, False)])
def test_twenty_times_the_way_is_another_unit(scale: float, agrees: bool) -> None:
    check = checked(scale=scale)
    assert check.has_agreed == agrees
    if agrees:
        assert check.fault is None
    else:
        assert check.fault is not None
        assert check.fault.startswith("wrong unit: the head moves 21 times as far")


@pytest.mark.parametrize(("scale", "agrees"), [(1.0, True), (12.0, True), (25.0, False)])
def test_a_source_of_doubtful_directions_agrees_only_in_its_unit(
    scale: float, agrees: bool
) -> None:
    check = checked(scale=scale, sideways=1.0)
    assert check.fault is None
    assert check.has_agreed == agrees


def test_mirrored_axes_turn_the_other_way() -> None:
    fault = checked(mirror=-1.0).fault
    assert fault is not None
    assert fault.startswith("mirrored axes: the head turns the other way")


@pytest.mark.parametrize(("frame_deg", "is_wrong"), [(50.0, False), (-50.0, False), (65.0, True)])
def test_a_frame_that_is_turned_by_more_than_a_radian_is_wrong(
    frame_deg: float, is_wrong: bool
) -> None:
    check = checked(frame_deg=frame_deg)
    assert check.has_agreed != is_wrong
    assert (check.fault is not None) == is_wrong
    if check.fault is not None:
        assert check.fault.startswith("wrong frame: the head moves +65 degrees off")


def test_a_body_that_was_moved_begins_again() -> None:
    check = checked(frame_deg=65.0)
    check.forget()
    assert check.fault is None
    assert not check.has_agreed
