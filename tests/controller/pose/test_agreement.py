"""Poses that turn and swing like the joints, and poses that do not."""

import re
from collections.abc import Callable

import numpy as np
import pytest

from snakewalk.controller.pose.agreement import DOUBT_S, SCALE_SD, Agreement
from snakewalk.controller.pose.motion_history import Moment
from snakewalk.controller.pose.tracked_body import HeadMeasurement

NONE = np.zeros((3, 3))
MIRROR = np.diag([1.0, -1.0, 1.0])
Seen = tuple[np.ndarray, np.ndarray]
Change = Callable[[float, np.ndarray, np.ndarray], Seen]


def turned(angle_rad: float) -> np.ndarray:
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def checked(
    change: Change = lambda time_s, at_m, axes: (at_m, axes),
    *,
    seconds: float = 12.0,
    slip: float = 1.0,
    swing_rad: float = 0.5,
    is_level: bool = True,
    check: Agreement | None = None,
    step_s: float = 0.02,
    side: float = 0.2,
    timed_s: float = 0.0,
) -> Agreement:
    """Check of a head that swings at 0.4 Hz while its body goes on at 0.2 m/s.

    Args:
        change: makes the source's position and axes of the true ones.
        seconds: duration.
        slip: the body goes on so much of the way that dead reckoning says.
        swing_rad: amplitude of the turns; see ``side``, too.
        is_level: whether the ground is a floor.
        check: goes on after an earlier call.
        step_s: time between two poses.
        side: metres that the head swings to the side, for each radian.
        timed_s: time from which the delay of the source is known.

    """
    check = Agreement(is_level=is_level) if check is None else check
    rng = np.random.default_rng(3)
    for time_s in np.arange(0.0, seconds, step_s):
        phase = 2.0 * np.pi * 0.4 * time_s
        side_m, heading = side * swing_rad * np.cos(phase), 0.3 + swing_rad * np.sin(phase)
        frame = turned(0.3)
        known = frame @ [0.2 * time_s, side_m, 0.0]
        true = frame @ [0.2 * slip * time_s, side_m, 0.0]
        at_m, axes = change(time_s, true + 0.005 * rng.standard_normal(3), turned(heading))
        moment = Moment(time_s, np.array([*known[:2], heading]), np.zeros(1))
        check.add(HeadMeasurement(at_m, axes, NONE, NONE), moment, is_timed=time_s >= timed_s)
    return check


@pytest.mark.parametrize("frame_deg", [0.0, 70.0, -170.0])
@pytest.mark.parametrize("slip", [0.3, 1.0, 1.5])
def test_a_sound_source_is_confirmed_in_any_frame_and_with_any_slip(
    frame_deg: float, slip: float
) -> None:
    frame = turned(np.radians(frame_deg))
    check = checked(lambda t, at_m, axes: (frame @ at_m, frame @ axes), slip=slip)
    assert check.fault is None
    assert check.is_confirmed
    assert not check.is_cautious


def test_a_head_that_does_not_turn_shows_nothing() -> None:
    check = checked(swing_rad=0.05)
    assert check.fault is None
    assert not check.is_confirmed
    assert not check.is_cautious, "such a gait does not stay slow for ever"
    assert checked(swing_rad=0.05, seconds=5.0).is_cautious


def test_turns_that_agree_without_a_swing_are_doubted_for_longer() -> None:
    """A slow start hardly swings, and its turns are those of the joints."""
    assert checked(side=0.03, seconds=7.0).fault is None
    assert "not confirmed" in str(checked(side=0.03, seconds=12.0).fault)


def test_few_poses_a_second_are_enough() -> None:
    assert checked(step_s=0.24).is_confirmed


FAULTS: dict[str, tuple[Change, str]] = {
    "another unit": (
        lambda t, at_m, axes: (1e3 * at_m, axes),
        r"^wrong scale: .* (9|10)\d\d\.\d\d times",
    ),
    "twice": (lambda t, at_m, axes: (2.0 * at_m, axes), r"^wrong scale: .* (1\.9|2\.0)\d times"),
    "half": (lambda t, at_m, axes: (0.5 * at_m, axes), r"^wrong scale: .* 0\.(4|5)\d times"),
    "mirrored": (
        lambda t, at_m, axes: (MIRROR @ at_m, MIRROR @ axes @ MIRROR),
        "^mirrored axes: the head turns the other way",
    ),
    "mirrored places": (
        lambda t, at_m, axes: (MIRROR @ at_m, axes),
        "^mirrored axes: the head moves to the other side|^wrong frame",
    ),
    "turned axes": (
        lambda t, at_m, axes: (at_m, turned(np.pi / 2.0) @ axes),
        r"^wrong frame: the head moves -(8|9)\d degrees off",
    ),
    "identity": (lambda t, at_m, axes: (at_m, np.eye(3)), "^unconfirmed pose: not confirmed"),
    "another body": (lambda t, at_m, axes: (NONE[0], np.eye(3)), "^unconfirmed pose: not confirm"),
}


@pytest.mark.parametrize("kind", FAULTS)
def test_a_contradiction_is_named_within_two_waves(kind: str) -> None:
    change, said = FAULTS[kind]
    check = checked(change, seconds=6.0)
    assert check.fault is not None
    assert re.search(said, check.fault), check.fault
    assert not check.is_confirmed


def test_a_marker_that_falls_off_is_noticed() -> None:
    fallen: list[Seen] = []

    def change(time_s: float, at_m: np.ndarray, axes: np.ndarray) -> Seen:
        if time_s < 12.0:
            return at_m, axes
        fallen.append((at_m, axes))
        return fallen[0]

    check = checked(change, seconds=12.0)
    assert check.is_confirmed
    check = checked(change, seconds=18.0)
    assert check.fault is not None
    assert "it agreed with the joints before, but not for" in check.fault
    assert not check.is_confirmed


def test_hills_allow_more_than_a_floor() -> None:
    larger: Change = lambda time_s, at_m, axes: (1.6 * at_m, axes)  # noqa: E731
    assert checked(larger, seconds=30.0).fault is not None
    assert checked(larger, seconds=30.0, is_level=False).fault is None
    twice: Change = lambda time_s, at_m, axes: (2.0 * at_m, axes)  # noqa: E731
    assert "wrong scale" in str(checked(twice, seconds=30.0, is_level=False).fault)


def test_a_small_error_of_scale_is_stated_as_accuracy() -> None:
    sound = checked(seconds=40.0)
    assert sound.scale_sd == pytest.approx(SCALE_SD, abs=0.005)
    long = checked(lambda t, at_m, axes: (1.15 * at_m, axes), seconds=40.0)
    assert long.fault is None
    assert long.scale_sd == pytest.approx(0.1, abs=0.02), "0.15, of which a floor allows 0.05"
    assert checked(seconds=3.0).scale_sd == 0.05, "before anything was compared"


def test_a_delay_is_no_step_of_the_heading_and_a_step_is_one() -> None:
    """The heading that is seen is that of 0.2 s before, until the delay is known at 3 s."""

    def seen(time_s: float, step_rad: float) -> np.ndarray:
        phase = 2.0 * np.pi * 0.4 * (time_s - 0.2 * (time_s < 3.0))
        return turned(0.3 + 0.5 * np.sin(phase) + step_rad * (time_s > 8.0))

    late = checked(lambda t, at_m, axes: (at_m, seen(t, 0.0)), timed_s=3.0)
    assert late.step_rad == 0.0
    assert checked(lambda t, at_m, axes: (at_m, seen(t, 0.0))).step_rad > 0.1
    stepped = checked(lambda t, at_m, axes: (at_m, seen(t, 0.25)), timed_s=3.0)
    assert stepped.step_rad == pytest.approx(0.25, abs=0.08)


def test_a_body_that_was_moved_begins_again() -> None:
    check = checked(FAULTS["identity"][0], seconds=DOUBT_S + 3.0)
    assert check.fault is not None
    check.forget()
    assert check.fault is None


def test_a_head_on_its_side_shows_nothing() -> None:
    on_its_side = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    check = checked(lambda t, at_m, axes: (at_m, on_its_side))
    assert check.fault is None
    assert not check.has_agreed
