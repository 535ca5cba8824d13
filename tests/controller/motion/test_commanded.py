"""Joints that another program commands: what passes, what is refused, and that nothing jumps."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BPoly, PPoly

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.controller.gaits.registry import make_gait
from snakewalk.controller.kinematics.links import BodyView, body_in_world
from snakewalk.controller.motion.command import (
    Command,
    HoldStill,
    JointGoals,
    JointTrajectory,
    Refused,
    StartGait,
    Velocity,
)
from snakewalk.controller.motion.commanded import Commanded
from snakewalk.controller.motion.source import MotionSource, StartsAnywhere
from snakewalk.controller.motion.trajectory import JointLimits, _quintics
from snakewalk.drivers.types import BodyPose

ROBOT = load_robot("alternating16")
COUNT = ROBOT.joint_count
NAMES = tuple(f"joint{k}" for k in range(COUNT))
VIEW: BodyView = body_in_world(ROBOT, BodyPose(0.0, np.zeros(3), np.eye(3)), np.zeros(COUNT))
DT_S = 0.02
LIMITS = np.array(ROBOT.limit_rad)
LIMIT = float(LIMITS.min())


class Bench:
    """A commanded robot, its events and its goals."""

    def __init__(self, **options: object) -> None:
        self.waiting: list[Command] = []
        self.events: list[tuple[str, str]] = []
        self.source = Commanded(
            *(ROBOT, NAMES, self._take, lambda kind, text: self.events.append((kind, text))),
            **options,  # type: ignore[arg-type]
        )
        self.goals = [self.source.goal_rad()]

    def _take(self) -> list[Command]:
        taken, self.waiting = self.waiting, []
        return taken

    def run(self, seconds: float, *commands: Command) -> np.ndarray:
        self.waiting += commands
        for _ in range(round(seconds / DT_S)):
            self.goals.append(self.source.step(DT_S, VIEW).copy())
        return self.goals[-1]

    @property
    def told(self) -> str:
        return "; ".join(f"{kind}: {text}" for kind, text in self.events)


def points(*rows: tuple[float, float], joint: str = "joint3", **more: object) -> JointTrajectory:
    times, angles = np.array(rows).T
    return JointTrajectory([joint], times, angles[:, None], **more)  # type: ignore[arg-type]


def test_it_is_a_motion_source_that_holds_the_pose_it_finds() -> None:
    bench = Bench()
    source: MotionSource = bench.source
    assert isinstance(source, StartsAnywhere)
    found = np.linspace(-0.4, 0.6, COUNT)
    found[5] = 1.2 * LIMITS[5]  # bent by force, beyond its range
    source.start_at(found)
    held = bench.run(1.0)
    assert held[5] == LIMITS[5]
    assert held.tolist() == np.clip(found, -LIMITS, LIMITS).tolist()
    assert bench.told == ""


def test_goals_are_reached_without_overshoot_and_other_joints_keep_theirs() -> None:
    bench = Bench()
    bench.run(2.0, JointGoals(["joint3", "joint0"], [0.8, -0.3]))
    bench.run(2.0, JointGoals(["joint3"], [-0.2]))
    assert bench.goals[-1][[3, 0, 1]] == pytest.approx([-0.2, -0.3, 0.0], abs=2e-3)
    way = np.array(bench.goals)[:, 3]
    assert way.max() < 0.8 + 1e-3
    assert way.min() > -0.2 - 1e-3
    assert bench.told == ""


@pytest.mark.parametrize(
    ("command", "why"),
    [
        (JointGoals(["joint3", "elbow"], [0.1, 0.1]), "robot alternating16 has no joint elbow"),
        (JointGoals(["joint3", "joint3"], [0.1, 0.2]), "names a joint twice"),
        (JointGoals([], []), "names no joint"),
        (JointGoals(["joint3", "joint4"], [0.1]), "2 names and 1 positions"),
        (JointGoals(["joint0", "joint3"], [0.1, math.nan]), "joint3: nan is not a number"),
        (JointGoals(["joint0", "joint3"], [0.1, math.inf]), "joint3: inf is not a number"),
        (JointGoals(["joint3"], [1.01 * LIMITS[3]]), "rad; its limit is"),
        (Refused("stamped 3 s ago"), "stamped 3 s ago"),
        (points((1.0, 9.0)), "joint3: 9.00 rad; its limit is"),
        (points((1.0, math.nan)), "joint3: nan is not a number"),
        (points((1.0, 0.1), (1.0, 0.2)), "must grow"),
        (points((-1.0, 0.1), (1.0, 0.2)), "must grow"),
        (points((math.nan, 0.1)), "must grow"),
        (points((0.0, 0.1)), "its only point is at 0 s"),
        (points((0.0, 0.5), (1.0, 0.2)), "begins at 0 s 0.50 rad from where joint3 is"),
        (points((0.01, 0.5)), "joint3 moves at"),
        (
            points((1.0, 0.5), velocity_rad_s=np.array([[1.0]])),
            "velocities of its last point must be 0",
        ),
        (points((1.0, 0.5), velocity_rad_s=np.array([[math.nan]])), "is not a number"),
        (points((1.0, 0.5), velocity_rad_s=np.zeros((2, 1))), "needs 1 positions"),
        (
            points((1.0, 0.5), acceleration_rad_s2=np.zeros((1, 1))),
            "has accelerations but no velocities",
        ),
        (points((1.0, 0.5), joint="elbow"), "has no joint elbow"),
        (JointTrajectory(["joint3"], np.arange(1.0, 502.0), np.zeros((501, 1))), "1 to 500"),
        (JointTrajectory(["joint3"], np.zeros(0), np.zeros((0, 1))), "1 to 500"),
        (StartGait(make_gait("helix-pole")), "needs soft servos"),
        (StartGait(make_gait("trot")), "two pairs of legs"),
    ],
)
def test_what_is_wrong_is_refused_whole_in_a_sentence(command: Command, why: str) -> None:
    bench = Bench()
    bench.run(1.0, command)
    kinds = [kind for kind, _ in bench.events]
    assert kinds == ["refused"]
    assert why in bench.told
    assert not np.any(bench.goals)


def test_the_same_refusal_is_told_once_a_second() -> None:
    bench = Bench()
    for _ in range(100):
        bench.run(DT_S, JointGoals(["elbow"], [0.0]))
    assert len(bench.events) == 2


def test_joints_hold_where_they_are_when_goals_stop_coming() -> None:
    bench = Bench(timeout_s=0.1)
    stopped = bench.run(2.0, JointGoals(["joint3"], [1.2]))[3]
    assert 0.01 < stopped < 1.0
    assert bench.told == "stale: no joint goals for 0.1 s: the joints hold where they are"
    assert np.array(bench.goals)[-20:, 3] == pytest.approx(stopped, abs=1e-3)


def test_goals_that_are_reached_are_not_out_of_date_and_infinite_ones_never() -> None:
    for options in ({}, {"timeout_s": math.inf}):
        bench = Bench(**options)
        assert bench.run(5.0, JointGoals(["joint3"], [0.3]))[3] == pytest.approx(0.3, abs=2e-3)
        assert bench.told == ""


def test_a_trajectory_is_at_its_points_at_their_times() -> None:
    rows = [(0.5, 0.2), (1.0, -0.1), (2.0, 0.4)]
    speeds, bends = np.array([[0.3], [0.2], [0.0]]), np.array([[0.5], [0.0], [0.0]])
    for more in (
        {},
        {"velocity_rad_s": speeds},
        {"velocity_rad_s": speeds, "acceleration_rad_s2": bends},
    ):
        bench = Bench()
        bench.run(2.5, points(*rows, **more))
        way = np.array(bench.goals)
        for time_s, angle in rows:
            assert way[round(time_s / DT_S), 3] == pytest.approx(angle, abs=1e-9)
        if more:
            speed = (way[26, 3] - way[24, 3]) / (2 * DT_S)
            assert speed == pytest.approx(0.3, abs=0.05)
        assert not np.any(np.delete(way, 3, axis=1))
        assert bench.told == (
            "command: a trajectory of 3 points, 2.00 s; command: the trajectory is done"
        )


def test_quintics_are_those_of_scipy() -> None:
    rng = np.random.default_rng(3)
    knots_s = np.cumsum(rng.uniform(0.1, 1.0, 6))
    q, v, a = rng.normal(size=(3, 6, 4))
    theirs = BPoly.from_derivatives(knots_s, np.stack([q, v, a], axis=1))
    ours = PPoly(_quintics(np.diff(knots_s)[:, None], q, v, a), knots_s)
    fine_s = np.linspace(knots_s[0], knots_s[-1], 200)
    for order in range(3):
        assert np.abs(ours(fine_s, order) - theirs(fine_s, order)).max() < 1e-9


def test_a_trajectory_may_begin_with_where_the_joint_is() -> None:
    bench = Bench()
    assert bench.run(1.5, points((0.0, 0.01), (1.0, 0.3)))[3] == pytest.approx(0.3)


def test_a_trajectory_too_fast_is_taken_with_the_time_that_the_refusal_names() -> None:
    rows = np.array([(0.1, 0.6), (0.3, -0.6)])
    for _ in range(4):  # speed first, then what accelerates most
        bench = Bench()
        bench.run(DT_S, points(*map(tuple, rows)))
        if "refused" not in bench.told:
            break
        rows[:, 0] *= float(bench.told.split("give it ")[1].split()[0])
    assert "command: a trajectory" in bench.told


def test_hold_stops_a_gait_and_a_trajectory_and_a_gait_may_be_first() -> None:
    bench = Bench(gait=make_gait("lateral-undulation"))
    bench.run(2.0)
    assert bench.told == "command: gait lateral-undulation"
    assert np.ptp(np.array(bench.goals), axis=0).max() > 0.3
    stopped = bench.run(2.0, HoldStill())
    assert np.array(bench.goals)[-20:] == pytest.approx(np.tile(stopped, (20, 1)), abs=1e-3)


def test_a_gait_that_begins_while_a_joint_nears_its_limit_keeps_it_there() -> None:
    """A join brakes more gently than goals do: begun at once, joint1 went 1.4 % beyond."""
    bench = Bench()
    bench.run(0.62, JointGoals(["joint1"], [0.9375 * LIMITS[1]]))
    bench.run(3.0, StartGait(make_gait("rolling")))
    way = np.array(bench.goals)
    assert (np.abs(way) <= LIMITS + 1e-3).all()
    assert np.ptp(way[-50:], axis=0).max() > 0.3
    assert bench.told == "command: gait rolling"


ANGLES = st.floats(-LIMIT, LIMIT)
COMMANDS = st.one_of(
    st.builds(
        lambda chosen: JointGoals([NAMES[k] for k in chosen], list(chosen.values())),
        st.dictionaries(st.integers(0, COUNT - 1), ANGLES, min_size=1),
    ),
    st.builds(
        lambda rows, gap: points(*((gap * (k + 1), a) for k, a in enumerate(rows))),
        st.lists(ANGLES, min_size=1, max_size=5),
        st.floats(0.05, 2.0),
    ),
    st.sampled_from(
        [
            HoldStill(),
            *(Velocity(*pair) for pair in ((0.02, 0.0), (0.1, 0.08), (-0.1, 0.05), (0.0, 0.0))),
            *(StartGait(make_gait(name)) for name in ("rolling", "sidewinding")),
        ]
    ),
)


def test_a_trajectory_that_turns_round_between_its_points_keeps_the_limit() -> None:
    """Four samples a piece missed the turn: joint1 went 0.3 % beyond."""
    bench = Bench()
    for angle, seconds in ((1.125, 1.0), (0.0, 0.5), (1.0, 0.375)):
        bench.run(seconds, JointGoals(["joint0", "joint1"], [0.0, angle]))
    bench.run(1.0, points((1.625, 0.0), (3.25, 0.0)))
    assert (np.abs(bench.goals) <= LIMITS).all()


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(COMMANDS, st.floats(0.02, 1.0)), min_size=1, max_size=6))
def test_whatever_is_commanded_the_goals_keep_the_limits(
    script: list[tuple[Command, float]],
) -> None:
    bench = Bench()
    for command, seconds in script:
        bench.run(max(seconds, DT_S), command)
    way = np.array(bench.goals)
    assert (np.abs(way) <= LIMITS * (1 + 1e-3)).all()
    speed = np.abs(np.diff(way, axis=0)).max(initial=0.0) / DT_S
    assert speed <= 1.03 * ROBOT.joint_speed_limit_rad_s
    bend = np.abs(np.diff(way, 2, axis=0)).max(initial=0.0) / DT_S**2
    # mean speeds of two cycles, between which one motion may end and another begin: half a cycle of
    # the one's acceleration, and a whole one of the other's
    assert bend <= 1.5 * 1.03 * ROBOT.joint_acceleration_limit_rad_s2


def test_a_flood_of_different_faults_is_a_few_lines() -> None:
    bench = Bench()
    bench.run(0.5, *(JointGoals([f"arm{k}"], [0.1]) for k in range(500)))
    assert len(bench.events) == 10
    bench.run(1.0)
    assert bench.events[-1] == ("refused", "490 more commands were rejected")


@pytest.mark.parametrize(
    "command",
    [
        JointGoals([f"joint{k}" for k in range(75_000)], [0.0] * 75_000),
        JointGoals(["x" * 1_000_000], [0.0]),
        JointGoals(["joint0", "joint0"], [0.1, -0.1]),
        JointGoals(["joint0"], [math.nan]),
        JointTrajectory(["joint0", "joint0"], np.ones(1), np.array([[0.1, -0.1]])),
        JointTrajectory(["joint0"], np.array([math.nan]), np.zeros((1, 1))),
        Refused("x" * 1_000_000),
    ],
    ids=["75000 names", "long name", "conflict", "nan", "conflict in points", "nan time", "long"],
)
def test_an_impossible_command_is_one_short_line_and_moves_nothing(command: Command) -> None:
    bench = Bench()
    goal = bench.run(0.5, command)
    assert not goal.any()
    ((kind, text),) = bench.events
    assert kind == "refused"
    assert len(text) <= 300


def test_joints_have_the_robots_names_and_those_of_older_versions() -> None:
    robot = load_robot("alternating16")
    limits = JointLimits.of(robot, robot.joint_names)
    assert limits.numbers(["pitch_02", "joint0"], "joint goals").tolist() == [1, 0]
    with pytest.raises(InputError, match="names a joint twice"):
        limits.numbers(["yaw_01", "joint0"], "joint goals")
    swapped = JointLimits.of(robot, ("joint1", "joint0", *robot.joint_names[2:]))
    assert swapped.numbers(["joint1"], "joint goals").tolist() == [0]  # its own name comes first
