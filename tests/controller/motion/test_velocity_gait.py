"""Velocities of the body as commands: what follows them, what is rejected, what is stale."""

import math

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.controller.gaits.registry import make_gait
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.motion.command import Command, HoldStill, StartGait, Velocity
from snakewalk.controller.motion.commanded import Commanded
from snakewalk.controller.motion.velocity_gait import VelocityGait
from snakewalk.drivers.types import BodyPose

ROBOT = load_robot("yaw16")
STRAIGHT = np.zeros(ROBOT.joint_count)
VIEW = body_in_world(ROBOT, BodyPose(0.0, np.zeros(3), np.eye(3)), STRAIGHT)
DT_S = 0.02


class Bench:
    """A commanded robot, its events and its goals."""

    def __init__(self, **options: object) -> None:
        self.waiting: list[Command] = []
        self.events: list[tuple[str, str]] = []
        self.goals = [STRAIGHT]
        self.source = Commanded(
            *(ROBOT, ROBOT.joint_names, self._take, lambda *event: self.events.append(event)),
            **options,  # type: ignore[arg-type]
        )

    def _take(self) -> list[Command]:
        taken, self.waiting = self.waiting, []
        return taken

    def run(self, seconds: float, *each_half_second: Command) -> np.ndarray:
        for k in range(round(seconds / DT_S)):
            if k % 25 == 0:
                self.waiting += each_half_second
            self.goals.append(self.source.step(DT_S, VIEW).copy())
        return np.array(self.goals[-round(seconds / DT_S) :])


def lag_of_the_wave_s(goals: np.ndarray) -> float:
    """Time by which a joint follows the one in front of it; positive: the wave runs to the tail."""
    front, behind = goals[50:-50, 7], goals[:, 9]
    wrong = [np.abs(behind[50 + k : len(goals) - 50 + k] - front).sum() for k in range(-50, 51)]
    return DT_S * (int(np.argmin(wrong)) - 50)


@pytest.mark.slow
def test_the_wave_runs_as_fast_and_to_the_side_that_the_velocity_says() -> None:
    full = VelocityGait(make_gait("lateral-undulation"), ROBOT).full_speed_m_s
    fast, slow, back = Bench(), Bench(), Bench()
    fast.run(6.0, Velocity(full, 0.0))
    slow.run(6.0, Velocity(0.5 * full, 0.0))
    back.run(6.0, Velocity(-full, 0.0))
    quick, half = fast.run(8.0, Velocity(full, 0.0)), slow.run(8.0, Velocity(0.5 * full, 0.0))
    lag_s = lag_of_the_wave_s(quick)
    assert lag_s > 0.05
    assert lag_of_the_wave_s(half) == pytest.approx(2.0 * lag_s, abs=0.03)
    assert lag_of_the_wave_s(back.run(8.0, Velocity(-full, 0.0))) == pytest.approx(-lag_s, abs=0.03)
    assert fast.events == [("command", "velocities, by gait lateral-undulation")]


@pytest.mark.slow
@pytest.mark.parametrize("forward", [0.08, -0.08])
def test_the_axis_bends_so_that_the_body_turns_at_the_rate(forward: float) -> None:
    bench, turn_rad_s = Bench(), 0.05
    bench.run(8.0, Velocity(forward, turn_rad_s))
    goals = bench.run(20.0, Velocity(forward, turn_rad_s))
    axis_rad = goals.sum(axis=1).mean()  # bend from tail to head
    assert axis_rad == pytest.approx(turn_rad_s * ROBOT.length_m / forward, rel=0.15)


def test_a_stale_velocity_stops_the_robot_and_the_next_one_moves_it_again() -> None:
    bench = Bench()
    moving = bench.run(6.0, Velocity(0.1, 0.0))
    assert np.ptp(moving[-100:], axis=0).max() > 0.3
    bench.run(4.0)
    resting = bench.run(1.0)
    assert np.ptp(resting, axis=0).max() < 1e-3
    assert bench.events[1:] == [("stale", "no velocity for 1 s: the body comes to rest")]
    again = bench.run(4.0, Velocity(0.1, 0.0))
    assert np.ptp(again[-100:], axis=0).max() > 0.3
    bench.run(3.0, Velocity(0.0, 0.0))
    assert np.ptp(bench.run(1.0, Velocity(0.0, 0.0)), axis=0).max() < 1e-3
    bench.run(3.0)
    assert len(bench.events) == 2  # a body at rest needs no velocity


def test_zero_moves_no_joint_and_ends_a_gait() -> None:
    bench = Bench()
    assert not bench.run(1.0, Velocity(0.0, 0.0)).any()
    assert bench.events == []
    bench.waiting.append(StartGait(make_gait("lateral-undulation")))
    bench.run(4.0)
    bench.run(2.0, Velocity(0.0, 0.0))
    assert np.ptp(bench.run(1.0), axis=0).max() < 1e-3


@pytest.mark.parametrize(
    ("command", "why"),
    [
        (Velocity(math.nan, 0.0), "velocity: not a number; send finite values"),
        (Velocity(0.0, math.inf), "velocity: not a number; send finite values"),
        (Velocity(1e9, 0.0), "velocity: 1e+09 m/s; at most 0."),
        (Velocity(-5.0, 0.0), "velocity: -5 m/s; at most 0."),
        (Velocity(0.1, 2.0), "velocity: 2 rad/s at 0.1 m/s; at most 0."),
        (Velocity(0.0, 0.2), "velocity: 0.2 rad/s at 0 m/s; at most 0.000 rad/s is accepted"),
    ],
)
def test_an_impossible_velocity_is_one_line_and_moves_nothing(command: Velocity, why: str) -> None:
    bench = Bench()
    assert not bench.run(0.4, command).any()
    ((kind, text),) = bench.events
    assert kind == "refused"
    assert text.startswith(why)


def test_a_rejected_velocity_does_not_renew_the_one_before() -> None:
    bench = Bench()
    bench.run(4.0, Velocity(0.1, 0.0))
    bench.run(3.0, Velocity(math.nan, 0.0))
    assert np.ptp(bench.run(1.0), axis=0).max() < 1e-3
    assert ("stale", "no velocity for 1 s: the body comes to rest") in bench.events


@pytest.mark.slow
def test_the_gait_that_was_started_follows_velocities_with_its_parameters() -> None:
    bench = Bench(gait=make_gait("lateral-undulation", {"winding_rad": 0.3}))
    bench.run(1.0)
    goals = bench.run(12.0, Velocity(0.05, 0.0))
    wide = Bench().run(12.0, Velocity(0.05, 0.0))
    assert np.ptp(goals[-300:], axis=0).max() < 0.6 * np.ptp(wide[-300:], axis=0).max()
    bench.run(1.0, HoldStill())
    assert bench.events[-1] == ("command", "hold")


def test_only_gaits_that_go_along_themselves_follow_velocities() -> None:
    with pytest.raises(InputError, match="gait rolling does not follow velocities"):
        VelocityGait(make_gait("rolling"), load_robot("alternating16"))


def test_the_goals_keep_the_limits_from_full_speed_ahead_to_full_speed_back() -> None:
    full = VelocityGait(make_gait("lateral-undulation"), ROBOT).full_speed_m_s
    bench = Bench()
    for forward, turn in ((1.0, 0.0), (-1.0, 0.9), (1.0, -0.9), (0.0, 0.0), (0.3, 0.3)):
        bench.run(2.5, Velocity(full * forward, turn * full * abs(forward) / ROBOT.length_m))
    way = np.array(bench.goals)
    assert (np.abs(way) <= np.array(ROBOT.limit_rad) * (1 + 1e-3)).all()
    speed = np.abs(np.diff(way, axis=0)).max() / DT_S
    bend = np.abs(np.diff(way, 2, axis=0)).max() / DT_S**2
    assert speed <= 1.03 * ROBOT.joint_speed_limit_rad_s
    assert bend <= 1.03 * ROBOT.joint_acceleration_limit_rad_s2
