"""What is planned inside a control cycle, as loops: the same as by the definitions."""

import numpy as np
import pytest

from snakewalk.config.loader import load_robot
from snakewalk.controller.gaits.cpg.oscillators import Cpg
from snakewalk.controller.gaits.cpg.pattern import Pattern
from snakewalk.controller.gaits.cpg.trajectory import NEGLIGIBLE
from snakewalk.controller.gaits.registry import GAITS
from snakewalk.controller.gaits.spine import SpineParameters, offset, spine_bends_rad
from snakewalk.controller.motion.blend import DURATIONS_S, plan_join, shortest_join_s
from snakewalk.controller.motion.cpg_motion import TOLERANCE, WIDER, CpgMotion, quickest_change
from snakewalk.controller.motion.gait_cycle import GaitCycle
from snakewalk.controller.motion.source import Pace

ROBOT = load_robot("alternating16")
LIMIT = Pace.limit(ROBOT)


@pytest.mark.parametrize("standing", [False, True])
def test_a_spine_is_divided_into_chords_of_equal_arc(standing: bool) -> None:
    p = SpineParameters(nose=0.2, tail=0.9, waves=1.3, phase_rad=0.4, standing=standing)
    phase = np.linspace(0.0, 7.0, 9)
    u = np.linspace(0.0, 2.0 * np.pi, 257)
    size = 0.2 + 0.7 * u / (2.0 * np.pi)
    column = phase[:, None]
    side = size * np.sin(1.3 * u - column)
    if standing:
        side = size * np.cos(1.3 * u + 0.4) * np.sin(column)
    np.testing.assert_allclose(offset(u, phase, p), side, atol=1e-14)
    for bends, y in zip(spine_bends_rad(phase, 16, p), side, strict=True):
        run = np.concatenate([[0.0], np.hypot(np.diff(u), np.diff(y)).cumsum()])
        at = np.linspace(0.0, run[-1], 18)
        heading = np.arctan2(-np.diff(np.interp(at, run, y)), np.diff(np.interp(at, run, u)))
        np.testing.assert_allclose(bends, heading[:-1] - heading[1:], atol=1e-12)


@pytest.mark.parametrize("error_rad", [0.5, 1.5])
def test_an_error_alone_dies_out_as_fast_as_the_quintic_may(error_rad: float) -> None:
    """Its largest slope is 15/8, its largest bend 10 / sqrt(3), by time and its square."""
    error, none = np.full(16, error_rad), np.zeros(16)
    duration_s, _ = shortest_join_s(1.0, error, none, Pace.still(16), LIMIT)
    by_speed = 1.875 * error_rad / (1.02 * ROBOT.joint_speed_limit_rad_s)
    bend = 10.0 / np.sqrt(3.0) * error_rad / (1.02 * ROBOT.joint_acceleration_limit_rad_s2)
    at_least_s = max(by_speed, float(np.sqrt(bend)))
    assert duration_s == min(time_s for time_s in DURATIONS_S if time_s >= at_least_s)


def test_no_time_is_long_enough_for_a_target_beyond_the_limits() -> None:
    wild = Pace(1.1 * LIMIT.speed_rad_s, LIMIT.acceleration_rad_s2)
    assert all(np.isnan(shortest_join_s(1.0, np.ones(16), np.zeros(16), wild, LIMIT)))


def test_a_joint_beyond_its_limit_is_joined_from_the_limit() -> None:
    """Pitch goals over facets may be faster than the joint: the join begins all the same."""
    rolling = GaitCycle(GAITS["rolling"](), ROBOT)
    speed = np.zeros(16)
    speed[15] = -1.25 * ROBOT.joint_speed_limit_rad_s
    join = plan_join(np.zeros(16), speed, rolling, LIMIT)
    assert np.isfinite(join.duration_s)
    wanted = join.error_rad_s + join.rate * rolling.velocity_rad_s()
    np.testing.assert_allclose(wanted[15], -ROBOT.joint_speed_limit_rad_s)
    np.testing.assert_allclose(wanted[:15], 0.0, atol=1e-15)


@pytest.mark.parametrize("name", ["sidewinding", "concertina", "subcarangiform"])
def test_a_course_is_judged_by_what_it_will_be(name: str) -> None:
    cpg = Cpg(np.linspace(-0.3, 0.3, 16))
    cpg.set_pattern(Pattern.of(GAITS["rolling"](), ROBOT, 2.0), 3.0)
    cpg.advance(0.7)
    cpg.set_pattern(Pattern.of(GAITS[name](), ROBOT, 3.0), 2.0)
    times_s = np.arange(0.0, 7.0, 0.02)
    speed = cpg.predict(times_s)[1]
    hard = np.abs(np.diff(speed, axis=0)).max(axis=0) / 0.02
    limits = LIMIT.speed_rad_s, LIMIT.acceleration_rad_s2
    over, fast, hardest = cpg.peak_share(times_s, *limits, np.inf)
    np.testing.assert_allclose(fast, np.abs(speed).max(axis=0), atol=NEGLIGIBLE * limits[0].min())
    np.testing.assert_allclose(hardest, hard, atol=NEGLIGIBLE * limits[1].min())
    assert over == max((fast / limits[0]).max(), (hardest / limits[1]).max())
    half, least, _ = cpg.peak_share(times_s, *limits, 0.5 * over)
    assert 0.5 * over < half <= over
    assert (least <= fast).all()


def test_where_no_change_stays_within_the_limits_they_are_widened_by_little() -> None:
    """In the midst of taking up a fast gait: joints are at their limits already."""
    motion = CpgMotion(ROBOT, GAITS["anguilliform"]().joints_rad(ROBOT, np.zeros(1))[0])
    motion.become(GAITS["anguilliform"]())
    for _ in range(23):
        motion.step(0.02, None)  # type: ignore[arg-type]
    before = motion.goal_rad()
    pattern = Pattern.of(GAITS["lateral-undulation"](), ROBOT, 2.8)
    _, pace = quickest_change(motion.cpg, pattern, LIMIT)
    widened = (1.0 + TOLERANCE) * (1.0 + WIDER)
    assert (pace.speed_rad_s <= widened * LIMIT.speed_rad_s).all()
    assert (pace.acceleration_rad_s2 <= widened * LIMIT.acceleration_rad_s2).all()
    np.testing.assert_array_equal(motion.goal_rad(), before)
