"""Side rolls: what is predicted of them, when they are chosen, and how they are joined."""

import re
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest

from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load_robot
from snakewalk.config.robot import LinkConfig, RobotConfig
from snakewalk.controller.kinematics.links import BodyView, body_in_world, pose_at
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.walk.roll_planner import MOST_TURNS, RollPlan, RollPlanner
from snakewalk.controller.walk.side_roll import SideRolls
from snakewalk.controller.walk.twin_rollout import TwinRollout
from snakewalk.drivers.attitude import rotation_by

ROBOT = load_robot("alternating16")
GIRTH_M = 2.0 * np.pi * ROBOT.body_radius_m
SLOPE = np.tan(np.radians(18.0))
HILL = HeightField(np.tile(SLOPE * np.arange(-4.0, 4.01, 0.1), (81, 1)), 0.1, -4.0, -4.0)
"""A plane that rises along x."""
ALONG = np.stack([np.zeros(17), 0.07 * np.arange(8, -9, -1)], axis=1)
"""Links (L, 2) along a contour, heading 90 degrees: uphill is to the right."""
DT_S = 0.02


def test_a_roll_uphill_brings_the_body_nearer_by_its_girth_a_turn() -> None:
    to_go_m = RollPlanner(ROBOT, HILL).to_go_m(np.array([3.5, 0.0]), ALONG, np.pi / 2, -1.0)
    np.testing.assert_allclose(to_go_m, 3.5 - GIRTH_M * np.arange(MOST_TURNS + 1), atol=1e-9)


@pytest.mark.parametrize(
    ("heading_rad", "side"),
    [(np.pi / 2, 1.0), (0.0, 1.0), (0.0, -1.0), (np.pi, 1.0), (-np.pi / 2, -1.0)],
)
def test_no_roll_goes_downhill_or_across(heading_rad: float, side: float) -> None:
    planner, target_m = RollPlanner(ROBOT, HILL), np.array([3.5, 0.0])
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])
    turned = np.linalg.matrix_power(turn, round(heading_rad / (np.pi / 2)) - 1)
    to_go_m = planner.to_go_m(target_m, ALONG @ turned.T, heading_rad, side)
    np.testing.assert_allclose(to_go_m, [3.5], atol=1e-9)


def test_a_roll_ends_before_unsafe_ground_and_on_level_ground() -> None:
    target_m = np.array([3.5, 0.0])
    fenced = RollPlanner(ROBOT, HILL, lambda point_m: bool(point_m[0] < 1.0))
    assert len(fenced.to_go_m(target_m, ALONG, np.pi / 2, -1.0)) == 1 + int(1.0 / GIRTH_M)
    level = HeightField(np.minimum(HILL.z_m, 0.5 * SLOPE), 0.1, -4.0, -4.0)
    reach_m = GIRTH_M * (
        len(RollPlanner(ROBOT, level).to_go_m(target_m, ALONG, np.pi / 2, -1.0)) - 1
    )
    assert 0.5 <= reach_m < 0.5 + GIRTH_M


def test_an_arc_is_as_long_as_the_links_of_the_robot() -> None:
    links = (LinkConfig(length_m=0.12), *(LinkConfig(length_m=0.03),) * 15, LinkConfig())
    robot = RobotConfig(name="uneven", joint_axes="yp" * 8, links=links)
    centre_m = np.array([1.0, 2.0])
    arc_m = RollPlanner(robot, HILL)._arc_m(centre_m, 0.3, 1.5)
    np.testing.assert_allclose(arc_m.mean(axis=0), centre_m, atol=1e-12)
    apart_m = np.hypot(*np.diff(arc_m, axis=0).T)
    lengths_m = np.array(robot.link_lengths_m)
    np.testing.assert_allclose(apart_m, 0.5 * (lengths_m[1:] + lengths_m[:-1]), rtol=0.03)


class Scene:
    """A walk on the steep run whose body stands still, and rolls as its joints say."""

    def __init__(self, plan: RollPlan | None, progress: float = 0.0) -> None:
        self.prepared = prepare_walk("jacksboro-steep", seed=3)
        self.events: list[str] = []
        source = self.prepared.make_source(lambda kind, text: self.events.append(text))
        assert isinstance(source, SideRolls)
        self.rolls, self.progress = source, progress
        self.rolls._planner.best = lambda pose, walker, target_m: plan  # type: ignore[method-assign]
        self.rolls.course._missed_before = 0
        self.roll_rad = 0.0
        self.bends = self.turns = True
        """Whether the joints follow, and whether the body turns when it rolls."""
        self.carried_m_s = np.zeros(3)
        """Velocity of the body while it rolls."""
        self.centre_m = np.array([*self.prepared.run.start_m, 0.0])
        self.rolls.begin(self.view(np.zeros(16)))

    def view(self, joint_rad: np.ndarray) -> BodyView:
        at = pose_at(np.array([*self.prepared.run.start_m, 0.0])[:2], 1.2)
        turned = at.rotation @ rotation_by(np.array([self.roll_rad, 0.0, 0.0]))
        view = body_in_world(self.prepared.robot, at._replace(rotation=turned), joint_rad)
        return view._replace(centre_m=self.centre_m)

    def step(self) -> np.ndarray:
        """One cycle; joints that follow at once, and a body that rolls on its ground."""
        view = self.view(self.rolls.goal_rad() if self.bends else np.zeros(16))
        self.rolls._walker.outlook = self.progress
        under_way = self.rolls._rolling
        if under_way is not None:
            self.centre_m = self.centre_m + self.carried_m_s * DT_S
        if under_way is not None and self.turns:
            self.roll_rad -= under_way._plan.side * 2.0 * np.pi * under_way._hz * DT_S
        return self.rolls.step(DT_S, view)


def arc(bend_rad: float, turns: int = 2) -> RollPlan:
    piece = bend_rad * np.linspace(0.0, 1.0, 100)
    return RollPlan(bend_rad, piece, turns, np.zeros(2), 0.1)


def at_once(bend_rad: float) -> RollPlan:
    return RollPlan(bend_rad, np.empty(0), 2, np.zeros(2), 0.1)


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("plan", [arc(2.0), arc(-1.6), at_once(2.0), at_once(-2.6)])
def test_walk_and_roll_are_joined_within_the_joints_limits(plan: RollPlan) -> None:
    scene, bend_rad = Scene(plan), plan.bend_rad
    goals, rolled, walked_on = [scene.rolls.goal_rad()], False, False
    for _ in range(1200):
        goals.append(scene.step())
        if scene.rolls.rolling and not rolled:
            rolled, goals = True, goals[-3:]
        if scene.rolls.rolling:
            assert scene.rolls.pulse_m_s == 0.0
            assert scene.rolls.decision is None
        elif rolled and scene.rolls.decision is not None:
            walked_on = True
            break
    for _ in range(25):  # it sets off from rest
        goals.append(scene.step())
    side = "left" if bend_rad > 0.0 else "right"
    assert walked_on
    assert scene.events[0] == f"rolls uphill to its {side}: 2 turns are planned"
    assert scene.events[1].startswith(("rolled 2.0 turns", "rolled 1.9 turns"))
    speed = np.diff(goals, axis=0) / DT_S
    limit = scene.prepared.robot.joint_speed_limit_rad_s
    assert np.abs(speed).max() <= 1.05 * limit
    hard = np.abs(np.diff(speed, axis=0)).max() / DT_S
    assert hard <= 1.5 * scene.prepared.robot.joint_acceleration_limit_rad_s2


@pytest.mark.parametrize(
    ("nearer_m_s", "sinks_m_s", "turns", "lasts_s"),
    [
        (0.1, 0.0, True, 1.95),  # the join makes a twentieth of the last turn
        (0.0, 0.0, True, 3.0),  # nothing gained
        (-0.2, 0.0, True, 0.75),  # 15 cm are lost
        (0.1, 0.2, True, 0.5),  # 10 cm down
        (0.1, 0.0, False, 4.5),  # the time of the join and of three turns
    ],
)
def test_a_roll_ends_when_it_is_done_or_leads_nowhere(
    nearer_m_s: float, sinks_m_s: float, turns: bool, lasts_s: float
) -> None:
    planned = 2 if nearer_m_s > 0.0 else 16
    scene = Scene(replace(at_once(2.0), turns=planned))
    ahead = -scene.centre_m[:2] / np.hypot(*scene.centre_m[:2])  # the target is at (0, 0)
    scene.carried_m_s = np.array([*(nearer_m_s * ahead), -sinks_m_s])
    scene.turns = turns
    while not scene.rolls.rolling:
        scene.step()
        assert not scene.rolls.done
    steps = 0
    while scene.rolls.rolling:
        scene.step()
        steps += 1
        assert not scene.rolls.done
    assert steps * DT_S == pytest.approx(lasts_s, abs=0.07)
    said = re.fullmatch(r"rolled (.*) turns in (.*) s, (.*) m; walks on", scene.events[1])
    assert said is not None
    rolled, time_s, gone_m = (float(number) for number in said.groups())
    assert rolled == pytest.approx(lasts_s * turns, abs=0.15)
    assert time_s == pytest.approx(lasts_s, abs=0.1)
    assert gone_m == pytest.approx(lasts_s * abs(nearer_m_s), abs=0.02)


def test_between_two_rolls_the_walk_travels_half_a_body() -> None:
    scene = Scene(at_once(2.0))
    travelled_m = 0.0
    while len(scene.events) < 3:
        scene.step()
        if len(scene.events) == 2:
            travelled_m += scene.rolls.pulse_m_s * DT_S
        assert travelled_m < scene.prepared.robot.length_m
    assert scene.events[2].startswith("rolls uphill")
    assert travelled_m > 0.4 * scene.prepared.robot.length_m


@pytest.mark.parametrize("is_straight", [True, False])
def test_a_body_that_does_not_lie_as_the_arc_needs_walks_on(is_straight: bool) -> None:
    """Its joints have not bent, or it lies on its side; later it rolls."""
    scene = Scene(arc(2.0))
    scene.bends = not is_straight
    for _ in range(600):
        scene.step()
        if scene.rolls.decision is not None and not is_straight:
            scene.roll_rad = 1.5
    assert not scene.events
    scene.bends, scene.roll_rad = True, 0.0
    while not scene.events:
        scene.step()
    assert scene.rolls.rolling


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(
    ("plan", "progress", "astray"),
    [(None, 0.0, True), (arc(2.0), 0.7, True), (arc(2.0), 0.0, False)],
)
def test_a_walk_that_gets_on_does_not_roll(
    plan: RollPlan | None, progress: float, astray: bool
) -> None:
    scene = Scene(plan, progress)
    if not astray:
        scene.rolls.course._missed_before = -1
    for _ in range(400):
        scene.step()
    assert not scene.rolls.rolling
    assert not scene.events


_NONE = np.empty(0)


class Carried(TwinRollout):
    """A twin whose body is carried along x: towards 1 m, and from there away."""

    def __init__(self, speed_m_s: float, *, diverges: bool = False) -> None:
        self._speed_m_s, self._diverges, self.tried = speed_m_s, diverges, 0

    @property
    def cycle_s(self) -> float:
        return DT_S

    def bodies(
        self, move: Callable[[float, BodyView], np.ndarray], longest_s: float
    ) -> Iterator[BodyView]:
        self.tried += 1
        if self._diverges:
            raise RuntimeError("diverged")
        view = body_in_world(ROBOT, pose_at(np.zeros(2), 0.0), np.zeros(16))
        for k in range(round(longest_s / DT_S)):
            x_m = self._speed_m_s * (k + 1) * DT_S
            view = view._replace(centre_m=np.array([min(x_m, 2.0 - x_m), 0.0, 0.0]))
            assert np.isfinite(move(DT_S, view)).all()
            yield view


def considered(
    twin: Carried, outlook: float, piece_rad: np.ndarray = _NONE
) -> tuple[RollPlan | None, Scene]:
    scene = Scene(None)
    scene.rolls._pilot._twin = twin
    scene.rolls._walker.outlook = outlook
    target_m = np.array([1.0, 0.0])
    plans = [RollPlan(bend, bend * piece_rad, 16, target_m, 0.1) for bend in (-2.0, 2.0)]
    scene.rolls._planner.tried = lambda *given: plans  # type: ignore[method-assign]
    at = pose_at(np.zeros(2), 0.0)
    view = body_in_world(ROBOT, at, np.zeros(16))._replace(centre_m=np.zeros(3))
    return scene.rolls._best_roll(view, target_m), scene


def test_a_roll_is_as_fast_as_on_the_twin_and_ends_where_that_is_nearest() -> None:
    found, scene = considered(Carried(0.2), 0.0)
    assert found is not None
    # nearest after 5 s; to walk on takes a second and a half more
    assert found.speed_m_s == pytest.approx(1.0 / 6.5, rel=0.02)
    assert found.turns == 5
    # and none is tried again at once
    assert scene.rolls._walks_until > scene.rolls._pilot.head


@pytest.mark.slow
def test_an_arc_is_laid_before_turns_are_counted() -> None:
    found, _ = considered(Carried(0.1), 0.0, np.linspace(0.0, 1.0, 100))
    assert found is not None
    # nearest after 10 s, of which the track takes 4 at a quarter of a body a second, and more
    assert 1 <= found.turns <= 6
    assert found.speed_m_s == pytest.approx(1.0 / 11.5, rel=0.02)


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(
    ("twin", "tried"), [(Carried(-0.2), 2), (Carried(0.2, diverges=True), 2), (Carried(0.2), 0)]
)
def test_what_fails_on_the_twin_is_not_rolled(twin: Carried, tried: int) -> None:
    found, _ = considered(twin, 0.0 if tried else 0.4)
    assert found is None or found.speed_m_s == 0.0
    assert twin.tried == tried


def test_plans_to_try_are_few_the_fastest_first_and_some_begin_at_once() -> None:
    scene = Scene(None)
    planner, walker = RollPlanner(ROBOT, HILL), scene.rolls._walker
    body = body_in_world(ROBOT, pose_at(np.zeros(2), np.pi / 2), np.zeros(16))
    pose = scene.rolls._pilot.path_pose(body)
    plans = planner.tried(pose, walker, np.array([3.5, 0.0]), np.pi / 2)
    assert 1 < len(plans) <= 6
    assert plans == sorted(plans, key=lambda plan: -plan.speed_m_s)
    assert all(plan.side == -1.0 for plan in plans)  # uphill is to the right
    assert any(len(plan.piece_rad) == 0 for plan in plans)


def test_soft_joints_and_rails_do_not_roll() -> None:
    soft = prepare_walk("jacksboro-steep", keys={"run.walk.pitch.current_limit_a": 0.1})
    rails = prepare_walk(
        "jacksboro-steep", keys={"robot.belly.shape": "rails", "robot.belly.width_m": 0.08}
    )
    off = prepare_walk("jacksboro-steep", keys={"run.walk.rolls": False})
    for prepared in (soft, rails, off):
        assert not isinstance(prepared.make_source(lambda kind, text: None), SideRolls)
