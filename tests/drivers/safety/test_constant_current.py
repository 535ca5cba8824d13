"""A current that does not change with the error of a joint that stands is noticed."""

import numpy as np
import pytest

from snakewalk.drivers.safety.following_error import IDLE_TIME_S, FollowingError
from tests.drivers.safety.test_following_error import JUDGED, LIMIT_A
from tests.drivers.safety.test_safety_vet import J, one, state


def steady(
    errors_rad: list[float],
    *,
    joint: int = 0,
    amps: float = 0.5,
    change_a: float = 0.0,
    moved_rad: float = 0.0,
    step_s: float = 2.0**-6,
    unread: int | None = None,
) -> str | None:
    """First fault of a joint whose error changes while its current does not.

    ``change_a`` and ``moved_rad`` are added to current and position in the second half.
    """
    following = FollowingError(JUDGED)
    for k, error_rad in enumerate(errors_rad):
        late = k >= len(errors_rad) // 2
        position_rad = moved_rad * late
        found = state(
            time_s=k * step_s,
            position_rad=one(position_rad, joint),
            current_a=one(amps + change_a * late, joint),
            valid=np.arange(J) != (joint if k == unread else -1),
        )
        fault = following.update(found, one(position_rad + error_rad, joint))
        if fault is not None:
            assert following.is_idle
            assert following.joint == joint
            return f"{k}: {fault}"
    return None


def ramp(first_rad: float, last_rad: float, seconds: float = 0.35) -> list[float]:
    """Errors that change evenly, 1/64 s apart."""
    return np.linspace(first_rad, last_rad, 1 + round(64 * seconds)).tolist()


@pytest.mark.parametrize(
    ("joint", "amps", "errors_rad"),
    [
        (0, 0.5, ramp(0.06, 0.19)),
        (2, 1.9, ramp(0.19, 0.06)),
        (1, 0.5, ramp(-0.01, 0.06)),
        (0, -0.01, ramp(0.2, -0.06)),
    ],
)
def test_a_constant_current_of_a_joint_that_stands_is_a_fault_if_its_error_changes(
    joint: int, amps: float, errors_rad: list[float]
) -> None:
    """A sensor that always read 0.5 A hid a dead output stage at an error of 0.19 rad."""
    fault = steady(errors_rad, joint=joint, amps=amps)
    assert fault is not None
    count, _, text = fault.partition(": ")
    assert IDLE_TIME_S <= int(count) / 64 < 0.36
    assert text.startswith(f"{JUDGED.joint_names[joint]}: ")
    assert f"current stays at {amps:.2f} A for 0.3" in text
    assert "its motor does not push" in text


def test_a_constant_error_with_a_constant_current_shows_nothing() -> None:
    """The bound: an obstacle that holds a joint off looks the same to the servo."""
    assert steady([0.15] * 200) is None
    assert steady([-0.15] * 200, amps=-0.5) is None


@pytest.mark.parametrize(
    ("joint", "last_rad", "first_rad"), [(0, 0.1, 0.06), (1, 0.1, 0.004), (2, -0.1, -0.06)]
)
def test_the_expected_current_must_change_enough(
    joint: int, last_rad: float, first_rad: float
) -> None:
    """The bound: 0.2 of full output, or 0.6 of the current limit of joint 2."""
    sign = np.sign(last_rad)
    amps = float(0.5 * sign)
    assert steady(ramp(first_rad - 1e-6 * sign, last_rad), joint=joint, amps=amps) is not None
    assert steady(ramp(first_rad + 1e-6 * sign, last_rad), joint=joint, amps=amps) is None


def test_an_error_that_friction_can_hold_shows_nothing() -> None:
    assert steady(ramp(-0.049, 0.049), amps=0.5) is None
    assert steady(ramp(-0.049, 0.05), amps=0.5) is not None


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_soft_joint_that_pushes_at_its_own_limit_is_held_off_by_the_ground(sign: float) -> None:
    """A pitch joint that pressed against a steep ground ended a sound run."""
    errors = [sign * error for error in ramp(0.004, 0.12)]
    assert steady(errors, joint=1, amps=sign * LIMIT_A) is None
    assert steady(errors, joint=1, amps=0.9 * sign * LIMIT_A) is None
    assert steady(errors, joint=1, amps=0.8 * sign * LIMIT_A) is not None
    assert steady(errors, joint=1, amps=-sign * LIMIT_A) is not None, "away from the goal"


@pytest.mark.parametrize(("joint", "change_a"), [(0, 0.02), (0, -0.02), (1, 0.003)])
def test_a_current_that_changes_shows_that_the_sensor_works(joint: int, change_a: float) -> None:
    errors = ramp(0.0, 0.19, 0.5)
    assert steady(errors, joint=joint, change_a=1.01 * change_a) is None
    assert steady(errors, joint=joint, change_a=0.99 * change_a) is not None


def test_a_joint_that_moves_is_judged_by_its_motion_sensors() -> None:
    errors = ramp(0.06, 0.19, 0.5)
    assert steady(errors, moved_rad=0.0051) is None
    assert steady(errors, moved_rad=-0.0051) is None
    assert steady(errors, moved_rad=0.0049) is not None


def test_a_pause_ends_the_comparison_and_a_lost_reply_does_not() -> None:
    errors = ramp(0.06, 0.19)
    assert steady(errors, step_s=0.101) is None
    assert steady(errors, step_s=0.099) is not None
    assert steady(errors, unread=3) is not None
    following = FollowingError(JUDGED)
    for k in range(40):
        silent = state(time_s=0.02 * k, current_a=one(0.5, 0), valid=np.arange(J) != 0)
        assert following.update(silent, one(0.05 + 0.003 * k, 0)) is None


def test_a_motor_without_current_is_named_before_one_whose_current_is_constant() -> None:
    following = FollowingError(JUDGED)
    amps = np.array([0.5, 0.5, 0.0])
    faults = [
        following.update(state(time_s=k / 64, current_a=amps), np.array([e, 0.0, e]))
        for k, e in enumerate(ramp(0.06, 0.19))
    ]
    first = next(filter(None, faults))
    assert first.startswith(JUDGED.joint_names[2])
    assert "0.00 A, expected about" in first


def test_the_comparison_begins_again_after_a_reset() -> None:
    following = FollowingError(JUDGED)
    for k, error_rad in enumerate(ramp(0.06, 0.19)):
        if k == 10:
            following.reset()
        found = state(time_s=k / 64, current_a=one(0.5, 0))
        assert following.update(found, one(error_rad, 0)) is None
