"""Any motion joined to any other, at any time: no step, and within the robot's limits."""

from copy import deepcopy
from functools import cache
from itertools import cycle, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.animals.fish.fish_film import swim
from snakewalk.controller.animals.fish.piece_graph import piece_graph
from snakewalk.controller.animals.fish.segments import segment_motion
from snakewalk.controller.animals.fish.synthesis import joint_motion, random_sequence
from snakewalk.controller.gaits.gait import ranges
from snakewalk.controller.gaits.registry import GAITS, make_gait
from snakewalk.controller.kinematics.links import BodyView, body_in_world
from snakewalk.controller.kinematics.retarget import Retarget
from snakewalk.controller.motion.cpg_motion import CpgMotion
from snakewalk.controller.motion.gait_cycle import GaitCycle
from snakewalk.controller.motion.gait_motion import GaitMotion, GaitSequence
from snakewalk.controller.motion.head_steering import HeadSteering, HeadTarget
from snakewalk.controller.motion.operator import KEYS, Operator
from snakewalk.controller.motion.recorded import Recorded
from snakewalk.controller.motion.source import Hold, MotionSource, Pace
from snakewalk.controller.motion.source_switch import SourceSwitch
from snakewalk.controller.repertoire.motion import RepertoireMotion
from snakewalk.controller.repertoire.repertoire import Repertoire
from snakewalk.controller.repertoire.segment import Segment
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.run.kinds.walk_run import WalkRun
from snakewalk.drivers.types import BodyPose

DT_S = 0.02
ROBOTS = {name: load_robot(name) for name in ("yaw16", "alternating16")}
STEP_TOLERANCE = 1.06
"""The margin that plans have (5 %), and the differences of a sampled motion."""


@cache
def prepared(robot: str, motion: str) -> WalkRun:
    made = prepare_walk("flat-slalom", robot=robot, motion=motion)
    made.pilot()
    return made


def wave(robot: RobotConfig) -> tuple[np.ndarray, np.ndarray]:
    time_s = np.arange(0.0, 6.0, 0.1)
    lag = np.arange(robot.joint_count)
    return time_s, 0.4 * np.sin(2.0 * time_s[:, None] - 0.5 * lag) * (np.array(lag) % 2 == 0)


@cache
def fish_motion(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Segments of a fish in a random order, joined at the joint layer, as wide as joints bend."""
    swum = swim()
    pieces = piece_graph(swum, segment_motion(swum), mirror=True)
    order = random_sequence(pieces, 6.0, np.random.default_rng(2))
    joints = joint_motion(pieces, order, Retarget(ROBOTS[name]), 6)
    share = 0.9 / (np.abs(joints) / ROBOTS[name].limit_rad).max()
    return np.arange(len(joints)) / pieces.rate_hz, min(1.0, share) * joints


@cache
def actions(name: str) -> Repertoire:
    """Two gaits as recorded actions; joints alone count here, so the body stays where it is."""
    robot, frames = ROBOTS[name], 24
    phase = np.linspace(0.0, 2.0 * np.pi, frames, endpoint=False)
    links = robot.joint_count + 1
    made = []
    for winding, hertz in ((0.6, 1.2), (0.3, 1.4)):
        gait = make_gait("lateral-undulation", {"winding_rad": winding, "frequency_hz": hertz})
        goal = gait.joints_rad(robot, phase)
        made.append(
            Segment(
                f"{winding}",
                "forward",
                1.0 / (frames * GaitCycle(gait, robot).frequency_hz),
                turn=np.tile(np.eye(3), (frames, 1, 1)),
                move_m=np.zeros((frames, 3)),
                link_m=np.zeros((frames, links, 3)),
                link_rotation=np.tile(np.eye(3), (frames, links, 1, 1)),
                goal_rad=goal,
                joint_rad=goal,
                closure_m=0.0,
                closure_rad=0.0,
            )
        )
    return Repertoire(name, robot.joint_axes, "flat", robot.length_m, tuple(made))


@cache
def oscillators(name: str) -> CpgMotion:
    """Take up a gait from rest; planned once, for it is the plan that takes time."""
    made = CpgMotion(ROBOTS[name], np.full(ROBOTS[name].joint_count, 0.1))
    made.become(make_gait("lateral-undulation"))
    return made


@cache
def gait_motion(kind: str, name: str) -> GaitMotion:
    return GaitMotion(GAITS[kind](), ROBOTS[name])


def make(kind: str, robot: RobotConfig) -> MotionSource:
    """Make a fresh source; a copy of one where making it takes long."""
    if kind in GAITS:
        return deepcopy(gait_motion(kind, robot.name))
    if kind == "hold":
        return Hold(np.linspace(-0.6, 0.6, robot.joint_count))
    if kind == "recording":
        return Recorded(robot, *wave(robot))
    if kind == "operator":
        keys = iter([*KEYS, "n", "right", "right", "down", "right", "up", "m"] * 40)
        pressed = (k for k in keys if k not in {"q", "space"})
        motion = GaitMotion(make_gait("concertina", {"folds": 1.0}), robot)
        beats = iter(range(10**6))
        return Operator(
            motion,
            robot,
            lambda: [next(pressed)] if next(beats) % 9 == 0 else [],
            lambda kind, text: None,
        )
    if kind == "head":
        return HeadSteering(
            GaitMotion(make_gait("lateral-undulation"), robot), robot, HeadTarget(0.4)
        )
    if kind == "fish":
        return Recorded(robot, *fish_motion(robot.name))
    if kind == "actions":
        order = cycle([1, 0])
        return RepertoireMotion(actions(robot.name), robot, 0, lambda view: next(order))
    if kind == "cpg":
        return deepcopy(oscillators(robot.name))
    if kind == "sequence":
        later = [(0.3, make_gait("concertina")), (0.8, make_gait("lateral-undulation"))]
        return GaitSequence(GaitMotion(make_gait("lateral-undulation"), robot), later)
    walked = {"walk": "walk", "pilot": "serpenoid"}[kind]
    return prepared(robot.name, walked).pilot()


def suits(kind: str, robot: RobotConfig) -> bool:
    if kind not in GAITS:
        return True
    needs = GAITS[kind].needs
    return (bool(robot.pitch_joints) or not needs.pitch) and not needs.legs


OTHERS = ["hold", "recording", "operator", "head", "fish", "actions", "cpg", "sequence"]
LOOKING = {"head", "walk", "pilot"}
"""Those that see the body; for others it is computed once a run."""
KINDS = [*GAITS, *OTHERS, "walk", "pilot"]
PAIRS = {
    name: [p for p in product(KINDS, KINDS) if suits(p[0], robot) and suits(p[1], robot)]
    for name, robot in ROBOTS.items()
}


def view_of(robot: RobotConfig, joints: np.ndarray) -> BodyView:
    return body_in_world(robot, BodyPose(0.0, np.zeros(3), np.eye(3)), joints)


def run(
    source: MotionSource,
    robot: RobotConfig,
    steps: int,
    seen: list[np.ndarray],
    *,
    looking: bool = True,
) -> None:
    view = view_of(robot, seen[-1])
    for _ in range(steps):
        if looking:
            view = view_of(robot, seen[-1])
        seen.append(source.step(DT_S, view))


def worst(robot: RobotConfig, seen: list[np.ndarray]) -> tuple[float, float]:
    """Largest speed and acceleration as shares of the limits."""
    speed = np.diff(seen, axis=0) / DT_S
    acceleration = np.diff(speed, axis=0) / DT_S
    limit = Pace.limit(robot)
    return (
        float((np.abs(speed) / limit.speed_rad_s).max()),
        float((np.abs(acceleration) / limit.acceleration_rad_s2).max()),
    )


@pytest.mark.slow_cases(1, "joins every pair of motion sources of a robot: 10 s of CPU")
@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_all_pairs_of_sources_join_within_the_limits(name: str) -> None:
    robot = ROBOTS[name]
    rng = np.random.default_rng(5)
    for first, second in PAIRS[name]:
        relay = SourceSwitch(robot, make(first, robot))
        seen = [relay.goal_rad()] * 2
        looking = not LOOKING.isdisjoint({first, second})
        run(relay, robot, int(rng.integers(1, 30)), seen, looking=looking)
        duration_s = relay.join(make(second, robot))
        run(relay, robot, 28, seen, looking=looking)
        speed, acceleration = worst(robot, seen)
        assert speed < STEP_TOLERANCE, (first, second)
        assert acceleration < STEP_TOLERANCE, (first, second)
        assert duration_s < 5.0, (first, second)


@settings(max_examples=25)
@given(data=st.data())
def test_chains_of_joins_at_any_time_stay_within_the_limits(data: st.DataObject) -> None:
    name = data.draw(st.sampled_from(sorted(ROBOTS)))
    robot = ROBOTS[name]
    first, second = data.draw(st.sampled_from(PAIRS[name]))
    third = data.draw(st.sampled_from([b for a, b in PAIRS[name] if a == second]))
    relay = SourceSwitch(robot, make(first, robot))
    seen = [relay.goal_rad()] * 2
    run(relay, robot, data.draw(st.integers(0, 90)), seen)
    relay.join(make(second, robot))
    run(relay, robot, data.draw(st.integers(0, 40)), seen)  # often before the join is over
    relay.join(make(third, robot))
    run(relay, robot, 80, seen)
    speed, acceleration = worst(robot, seen)
    assert speed < STEP_TOLERANCE
    assert acceleration < STEP_TOLERANCE


@pytest.mark.slow
@settings(max_examples=25)
@given(data=st.data())
def test_jumps_of_a_gaits_parameters_become_smooth(data: st.DataObject) -> None:
    robot = ROBOTS["alternating16"]
    kind = data.draw(st.sampled_from(sorted(kind for kind in GAITS if suits(kind, robot))))
    motion = GaitMotion(GAITS[kind](), robot)
    seen = [motion.goal_rad()] * 2
    for _ in range(3):
        run(motion, robot, data.draw(st.integers(0, 50)), seen)
        spans = ranges(motion.gait.model)
        name = data.draw(st.sampled_from(sorted(spans)))
        span = spans[name]
        if span.kind is float:
            value: float = data.draw(st.floats(span.low, span.high))
        else:
            value = span.kind(data.draw(st.integers(int(span.low), int(span.high))))
        try:
            motion.change(**{name: value})
        except InputError:  # beyond the joints: refused, and nothing changes
            assert getattr(motion.gait.params, name) != value
    run(motion, robot, 60, seen)
    motion.stop()
    run(motion, robot, 60, seen)
    speed, acceleration = worst(robot, seen)
    assert speed < STEP_TOLERANCE
    assert acceleration < STEP_TOLERANCE
    assert motion.done
    np.testing.assert_array_equal(seen[-1], seen[-2])


@pytest.mark.parametrize("kind", ["sidewinding", "recording", "pilot"])
def test_after_a_join_only_the_new_source_is_left(kind: str) -> None:
    robot = ROBOTS["alternating16"]
    relay = SourceSwitch(robot, Hold(np.zeros(robot.joint_count)))
    relay.join(make(kind, robot))
    seen = [relay.goal_rad()]
    while relay.blending:
        run(relay, robot, 1, seen)
        assert len(seen) < 500
    np.testing.assert_array_equal(relay.goal_rad(), relay.source.goal_rad())


def test_a_motion_that_already_fits_is_joined_at_once() -> None:
    robot = ROBOTS["yaw16"]
    start = np.full(robot.joint_count, 0.2)
    assert SourceSwitch(robot, Hold(start)).join(Hold(start)) == 0.0


def test_a_gait_too_fast_for_the_joints_is_slowed_to_what_they_can_follow() -> None:
    robot = ROBOTS["alternating16"]
    cycle = GaitCycle(make_gait("sidewinding", {"frequency_hz": 2.0}), robot)
    assert cycle.frequency_hz < 0.6
    assert cycle.pace().speed_rad_s.max() == pytest.approx(0.9 * robot.joint_speed_limit_rad_s)


def test_a_source_that_asks_for_more_than_the_limits_is_refused() -> None:
    robot = ROBOTS["yaw16"]

    class Wild(Hold):
        def pace(self) -> Pace:
            return Pace(np.full(16, 9.0), np.full(16, 9.0))

    relay = SourceSwitch(robot, Hold(np.zeros(16)))
    with pytest.raises(ValueError, match="more than the robot's limits"):
        relay.join(Wild(np.ones(16)))
    assert isinstance(relay.source, Hold)


def test_a_robot_without_the_joints_refuses_the_join() -> None:
    robot, other = ROBOTS["yaw16"], ROBOTS["alternating16"]
    relay = SourceSwitch(robot, Hold(np.zeros(16)))
    with pytest.raises(InputError, match="needs pitch joints"):
        relay.join(GaitMotion(make_gait("rolling"), other))
