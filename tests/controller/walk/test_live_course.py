"""What a person sets of a motion's waypoints while it is on its way, and what is refused."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.kinematics.links import body_in_world, pose_at
from snakewalk.controller.motion.path_progress import OpenWaypoints, PathProgress
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.terrain.in_steps import Steps
from snakewalk.controller.terrain.path import SplinePath
from snakewalk.controller.walk.course import Course, OnCourse
from snakewalk.controller.walk.live_course import WAYPOINTS_MAX, LiveCourse


def straight(points_m, heading_rad, *, avoid_m, number=1) -> Steps[SplinePath]:
    yield 1
    return SplinePath(points_m)


class Walker(OnCourse):
    """Walks on by itself along its course, 0.1 m in each step."""

    needs = pulse_m_s = decision = None

    def __init__(self) -> None:
        super().__init__(
            Course(
                straight,
                [(1.0, 0.0)],
                start_m=np.zeros(2),
                radius_m=0.2,
                length_m=1.0,
                travel_per_body=1.0,
            )
        )
        self.at_m = np.zeros(3)

    @property
    def done(self) -> bool:
        return self.course.complete

    def step(self, dt_s: float, view: Any) -> np.ndarray:
        if not self.course.complete:
            step_m = self.course.waypoints_m[self.reached] - self.at_m[:2]
            self.at_m[:2] += step_m * min(1.0, 0.1 / np.hypot(*step_m))
        self.course.follow(self.at_m[:2], self.at_m[:2], lambda: 0.0, 0.0)
        return np.zeros(0)

    goal_rad = velocity_rad_s = pace = begin = None  # type: ignore[assignment]


class Live:
    """A live course, what is commanded of it, and what it says."""

    def __init__(self) -> None:
        self.walker, self.commands, self.said = Walker(), list[str](), list[tuple[str, str]]()
        self.motion = LiveCourse(
            self.walker,  # type: ignore[arg-type]
            self.take,
            self.check,
            lambda kind, text: self.said.append((kind, text)),
        )

    def take(self) -> list[str]:
        taken, self.commands = self.commands, []
        return taken

    def check(self, point_m: np.ndarray) -> None:
        if point_m[0] > 50.0:
            raise InputError("waypoint (99.00, 0.00) is outside the world")

    def steps(self, count: int, *commands: str) -> None:
        self.commands += commands
        for _ in range(count):
            at_m = self.walker.at_m
            view = SimpleNamespace(link_m=at_m[None], heading_rad=0.0)
            self.motion.step(0.02, view)  # type: ignore[arg-type]


def test_it_goes_to_a_waypoint_that_was_added_after_those_it_has() -> None:
    live = Live()
    assert isinstance(live.motion, OpenWaypoints)
    before_m = live.motion.waypoints_m
    live.steps(1)
    assert live.motion.waypoints_m is before_m
    live.steps(1, "waypoint=1,1")
    assert live.motion.replanned == "waypoints were set"
    live.steps(1)
    assert live.motion.replanned is None
    live.steps(60)
    assert live.motion.reached == 2
    assert live.walker.at_m[1] == pytest.approx(1.0, abs=0.2)
    assert live.said == [
        ("operator", "waypoint 2 at (1.00, 1.00)"),
        ("operator", "no waypoint is left: the body holds, and waits for another"),
    ]


def test_at_the_last_waypoint_it_holds_until_it_is_ended() -> None:
    live = Live()
    live.steps(40)
    assert live.walker.done
    assert not live.motion.done
    live.steps(30, "waypoint=-0.5,0")
    assert live.walker.at_m[0] < 0.0
    assert not live.motion.done
    live.steps(1, "end")
    assert live.motion.done
    live.steps(1, "waypoint=3,3")  # too late
    assert live.motion.done
    assert len(live.motion.waypoints_m) == 2


def test_it_goes_to_another_next_and_leaves_out_what_is_left() -> None:
    live = Live()
    live.steps(1, "waypoint=2,0", "next=0,1", "waypoint=0,2")
    np.testing.assert_allclose(live.motion.waypoints_m, [(0.0, 1.0), (0.0, 2.0)])
    assert live.said[1] == ("operator", "waypoint 1 at (0.00, 1.00); waypoints left out: 2")
    live.steps(2, "clear")
    assert live.said[-2] == ("operator", "it stops here; waypoints left out: 2")
    assert len(live.motion.waypoints_m) == 0
    assert not live.motion.done


@pytest.mark.parametrize(
    ("command", "why"),
    [
        ("waypoint=99,0", "waypoint (99.00, 0.00) is outside the world"),
        ("waypoint=nan,0", "waypoint nan,0: expected X,Y in metres"),
        ("next=1e999,0", "waypoint 1e999,0: expected X,Y in metres"),
        ("waypoint=1", "waypoint 1: expected X,Y in metres"),
        ("waypoint=1.02,0", "waypoint (1.02, 0.00): the waypoint before it is there"),
        ("next=0.1,0.01", "waypoint (0.10, 0.01): the head is there"),
    ],
)
def test_what_cannot_be_is_refused_in_a_sentence(command: str, why: str) -> None:
    live = Live()
    before_m = live.motion.waypoints_m
    live.steps(1, command, "frequency_hz=0.4", "q")
    others = ["frequency_hz=0.4: no command for waypoints", "q: no command for waypoints"]
    assert live.said == [("refused", text) for text in (why, *others)]
    assert live.motion.waypoints_m is before_m


def test_a_run_takes_so_many_waypoints_and_no_more() -> None:
    live = Live()
    live.walker.course.waypoints_m = np.ones((WAYPOINTS_MAX, 2))
    live.steps(1, "next=3,3")
    assert live.said == [("refused", "waypoint (3.00, 3.00): a run accepts 1000 at most")]


def test_it_tells_of_its_path_what_the_motion_does() -> None:
    assert isinstance(Live().motion, PathProgress)


@pytest.mark.parametrize("motion", ["serpenoid", "walk-printed"])
def test_a_walk_without_waypoints_rests_and_goes_on_to_another(motion: str) -> None:
    prepared = prepare_walk("flat-slalom", motion=motion)
    pilot, robot = prepared.pilot(level=True), prepared.robot
    view = body_in_world(robot, pose_at(np.zeros(2), 0.0), np.zeros(robot.joint_count))
    pulses_m_s = []
    for left_m in (None, np.zeros((0, 2)), np.array([(2.0, 1.0)])):
        if left_m is not None:
            pilot.course.lead_to(left_m, lambda: 0.0)
            assert np.isfinite(pilot.path_pose(view).aim_rad)
        for _ in range(100):
            pilot.step(0.02, view)
            pulses_m_s.append(pilot.pulse_m_s)
        assert pilot.done == (left_m is not None and not len(left_m))
    assert pulses_m_s[99] == pytest.approx(pulses_m_s[-1], rel=0.1)
    assert pulses_m_s[199] == 0.0
    assert np.abs(np.diff(pulses_m_s)).max() < 0.05 * max(pulses_m_s)


DAMAGED = [
    "waypoint=nan,0",
    "next=1e9,x",
    "next=" + "[" * 100_000,
    "pad=1@soon",
    "x" * 900_000,
    "=",
]


@pytest.mark.parametrize("command", DAMAGED, ids=range(len(DAMAGED)))
def test_a_damaged_command_is_one_short_line(command: str) -> None:
    live = Live()
    before_m = live.motion.waypoints_m
    live.steps(5, command, command)
    ((kind, text),) = live.said
    assert kind == "refused"
    assert len(text) <= 300
    assert live.motion.waypoints_m is before_m


def test_more_commands_than_a_person_clicks_are_not_all_carried_out() -> None:
    live = Live()
    live.steps(1, *(f"waypoint=1,{k}" for k in range(1, 30)))
    assert len(live.motion.waypoints_m) == 11
    assert live.said[-1] == ("refused", "29 commands at once; only the first 10 count")
