"""Slower before a servo trips: by heat, current and supply; never standing still, and told once."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snakewalk.config.robot import RobotConfig, ServoConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.controller.runtime.derating import LEAST, Derating, allowed
from snakewalk.drivers.types import JointState

SAFETY = SafetyConfig()
J = 4
ROBOT = RobotConfig(name="four", joint_axes="yyyy")


STILL = np.zeros(J)


def state(celsius: float = 30.0, volts: float = 12.0, amps: float = 0.3) -> JointState:
    cool = np.array([30.0, celsius, 30.0, 30.0])
    return JointState(
        time_s=0.0,
        position_rad=np.zeros(J),
        velocity_rad_s=np.zeros(J),
        current_a=np.array([0.1, -amps, 0.1, 0.1]),
        temperature_c=cool,
        voltage_v=np.full(J, volts),
        hardware_error=np.zeros(J, np.uint8),
        error=np.zeros(J, np.uint8),
        age_s=np.zeros(J),
        valid=np.ones(J, bool),
        slow_age_s=np.zeros(J),
    )


def rate(found: JointState) -> float:
    return allowed(found, np.abs(found.current_a), STILL, SAFETY, ROBOT).rate


def test_a_cool_robot_on_a_good_supply_runs_at_full_rate() -> None:
    assert allowed(state(), np.full(J, 0.3), STILL, SAFETY, ROBOT).reason == ""
    assert rate(state()) == 1.0


def test_what_was_not_read_yet_limits_nothing() -> None:
    unknown = state()._replace(temperature_c=np.full(J, np.nan), voltage_v=np.full(J, np.nan))
    assert rate(unknown) == 1.0


@pytest.mark.parametrize(
    ("found", "reason"),
    [
        (state(celsius=66.0), "joint yaw_02 (ID 2) at 66 C, limit 70 C"),
        (state(amps=1.8), "joint yaw_02 (ID 2) at 1.80 A, limit 2.00 A"),
        (state(volts=10.5), "joint yaw_01 (ID 1) at 10.5 V, limit 10.0 V"),
    ],
)
def test_near_a_limit_it_slows_down_and_names_joint_value_and_limit(
    found: JointState, reason: str
) -> None:
    now = allowed(found, np.abs(found.current_a), STILL, SAFETY, ROBOT)
    assert LEAST < now.rate < 1.0
    assert now.reason == reason


@settings(max_examples=100)
@given(
    a=st.floats(20.0, 90.0), b=st.floats(20.0, 90.0),
    u=st.floats(0.0, 3.0), v=st.floats(0.0, 3.0),
    p=st.floats(8.0, 15.0), q=st.floats(8.0, 15.0),
)  # fmt: skip
def test_worse_is_never_faster(a: float, b: float, u: float, v: float, p: float, q: float) -> None:
    good = state(min(a, b), max(p, q), min(u, v))
    bad = state(max(a, b), min(p, q), max(u, v))
    assert LEAST <= rate(bad) <= rate(good) <= 1.0


def test_before_every_limit_the_least_rate_is_reached() -> None:
    assert rate(state(celsius=68.5)) == LEAST
    assert rate(state(amps=1.97)) == LEAST
    assert rate(state(volts=10.15)) == LEAST


def test_it_says_once_that_it_slows_and_once_that_it_is_back() -> None:
    said: list[str] = []
    derating = Derating(SAFETY, ROBOT, lambda kind, text: said.append(text))
    hot, cool = state(celsius=67.0), state()
    for found, seconds in ((hot, 3.0), (cool, 60.0)):
        before = derating.rate
        for _ in range(int(seconds / 0.02)):
            now = derating.update(found, STILL, 0.02)
            assert abs(now - before) < 0.05, "the rate itself has no step"
            before = now
    assert said == ["slowing down: joint yaw_02 (ID 2) at 67 C, limit 70 C", "at full rate again"]
    assert derating.rate == 1.0
    assert derating.least < 0.5


def test_a_peak_of_current_shorter_than_the_average_is_no_load() -> None:
    derating = Derating(SAFETY, ROBOT)
    for k in range(200):
        derating.update(state(amps=2.2 if k % 50 == 0 else 0.5), STILL, 0.02)
    assert derating.least == 1.0


def test_the_band_above_the_least_supply_is_that_of_the_robots_own_supply() -> None:
    """At 5 V a band of 0.8 V would slow a robot down on a supply that is as it should be."""
    small = RobotConfig(name="small", joint_axes="yyyy", servo=ServoConfig(supply_v=5.0))
    fine, low = state(volts=4.7), state(volts=4.3)
    assert allowed(fine, np.full(J, 0.1), STILL, SAFETY, small).rate == 1.0
    assert allowed(low, np.full(J, 0.1), STILL, SAFETY, small).rate < 1.0


def test_a_joint_that_lags_slows_the_motion_down_before_it_trips() -> None:
    """Past any honest lag, half of the limit at most; not if the ground may hold it off."""
    said: list[str] = []
    derating = Derating(SAFETY, ROBOT, lambda kind, text: said.append(text))
    limit_rad = SAFETY.following_limits_rad(ROBOT)[2]
    goal_rad = np.zeros(J)
    for share, most in ((0.5, 1.0), (0.8, 0.9), (0.99, 0.4)):
        goal_rad[2] = share * limit_rad
        for _ in range(100):
            rate = derating.update(state(), goal_rad, 0.02)
        assert rate <= most
        assert (rate == 1.0) == (share == 0.5)
    assert rate == pytest.approx(LEAST, abs=0.01)
    (line,) = said
    assert line.startswith("slowing down: joint yaw_03 (ID 3) at ")
    assert line.endswith(f" rad from its goal, limit {limit_rad:.2f} rad")
    lifting = Derating(SAFETY, RobotConfig(name="pitch", joint_axes="yypy"))
    for _ in range(100):
        assert lifting.update(state(), goal_rad, 0.02) == 1.0
