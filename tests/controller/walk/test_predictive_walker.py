"""The predictive walker: junctions, variety, steering by prediction, time, and the fallback."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snakewalk.config.loader import load_robot
from snakewalk.config.run import WalkConfig
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.mechanics.rollout import (
    Drift,
    PlanarPose,
    Rolled,
    Rollout,
    TabulatedPath,
)
from snakewalk.controller.mechanics.rollout_kernel import (
    END_OFF,
    OFF_PATH,
    PATH_STEP_M,
    TIME,
)
from snakewalk.controller.walk.angle_track import AngleTrack
from snakewalk.controller.walk.predictive_walker import PredictiveWalker, _roughness
from snakewalk.controller.walk.serpenoid import SERPENOID
from snakewalk.controller.walk.steering import PathPose, Steering

POINTS = 100
PLACE = np.linspace(0.0, 2.0 * np.pi, POINTS)
ROBOT = load_robot("yaw16")
ROLLOUT = Rollout(ROBOT, FrictionConfig(along=0.1, across=0.7), None, POINTS)
STRAIGHT = TabulatedPath.of(np.arange(0.0, 5.0, PATH_STEP_M)[:, None] * np.array([1.0, 0.0]))


def walker(seed: int, shapes: int = 60, **walk: object) -> PredictiveWalker:
    rng = np.random.default_rng(seed)
    s = np.linspace(0.0, 2.0 * np.pi, POINTS)
    waves = rng.uniform(0.8, 1.8, (shapes, 1))
    made = rng.uniform(0.3, 0.8, (shapes, 1)) * np.sin(
        waves * s + rng.uniform(0, 6.28, (shapes, 1))
    )
    made -= made.mean(axis=1, keepdims=True)
    config = WalkConfig.model_validate({"proposals": 8, "candidates": 2, **walk})
    return PredictiveWalker(made, config, lambda track: Steering(ROLLOUT, track, 25.0), 16)


def pose(
    track: AngleTrack, offset_rad: float = 0.0, aim_rad: float = 0.0, y_m: float = 0.0
) -> PathPose:
    """At the track's end but for 6 segments, beside the straight path along x."""
    head = max(float(track.points), track.end - 6.0)
    return PathPose(head, offset_rad, np.array([0.5, y_m]), aim_rad, STRAIGHT, 50)


def test_a_state_is_walked_whole_and_none_comes_again_within_twenty() -> None:
    chooser = walker(1, heading_tolerance_rad=3.2)
    states = [chooser.decide(pose(chooser.track)).state for _ in range(250)]
    assert all(len(set(states[k : k + 10])) == 1 for k in range(0, 250, 10))
    taken = states[::10]
    assert all(len(set(taken[k : k + 20])) == 20 for k in range(5))
    few = walker(1, shapes=22, heading_tolerance_rad=3.2)
    taken = [few.decide(pose(few.track)).state for _ in range(600)][::10]
    assert all(len(set(taken[k : k + 20])) == 20 for k in range(40))


def test_the_track_never_jumps() -> None:
    chooser = walker(2, heading_tolerance_rad=3.2)
    for _ in range(100):
        chooser.decide(pose(chooser.track))
    angles = chooser.track.at_rad(np.arange(chooser.track.end, dtype=float))
    bend = np.diff(angles)
    # shapes bend by up to 0.8 * 1.8 * 2 pi / 100 a sample; a join adds a state's share at most
    assert np.abs(bend).max() < 0.35
    assert np.abs(np.diff(bend)).max() < 0.2


def test_what_fails_on_a_second_body_is_not_walked(monkeypatch: pytest.MonkeyPatch) -> None:
    chooser = walker(3)
    monkeypatch.setattr(chooser.steering, "is_steep", lambda pose: True)
    tried: list[np.ndarray] = []

    def try_piece(pose: PathPose, piece_rad: np.ndarray) -> Rolled:
        tried.append(piece_rad)
        columns = np.zeros((1, 10))
        columns[0, [OFF_PATH, END_OFF]] = 0.0 if len(tried) == 2 else 2.0
        columns[0, TIME] = 1.0
        return Rolled(columns)

    chooser.try_piece = try_piece
    for _ in range(4):
        tried.clear()
        chooser.decide(pose(chooser.track))
        added = chooser.track.samples(chooser.track.end - 10)
        np.testing.assert_array_equal(added, tried[1][:10])
        assert chooser.outlook == 0.0  # on the second body, which has not moved
        assert 2 < len(tried) <= 8


@pytest.mark.parametrize(("y_m", "turn"), [(0.3, -1.0), (-0.3, 1.0)])
def test_it_bends_towards_its_path(y_m: float, turn: float) -> None:
    chooser = walker(3)
    begin = chooser.track.body_rad(float(chooser.track.end)).mean()
    for _ in range(8):
        chooser.decide(pose(chooser.track, -begin, 0.0, y_m))
    bends = [chooser.decide(pose(chooser.track, -begin, 0.0, y_m)).ramp_rad for _ in range(2)]
    end = chooser.track.body_rad(float(chooser.track.end)).mean()
    assert turn * (end - begin) > 0.2
    assert all(abs(bend) <= 2.4 for bend in bends)


def test_thinking_in_cycles_decides_what_thinking_at_once_decides() -> None:
    at_once, in_cycles = walker(4), walker(4)
    at_once.decide(pose(at_once.track))
    in_cycles.decide(pose(in_cycles.track))
    for _ in range(12):
        here = pose(in_cycles.track)
        cycles = 1
        while in_cycles.think(lambda here=here: here):
            cycles += 1
        assert cycles < 20
        # a later pose is not looked at: the decision is about the one that thinking began with
        late = in_cycles.decide(pose(in_cycles.track, offset_rad=0.4))
        while at_once.think(lambda here=here: here):
            pass
        made = at_once.decide(here)
        assert made.state == late.state
        assert made.ramp_rad == late.ramp_rad
    np.testing.assert_array_equal(in_cycles.track.samples(0), at_once.track.samples(0))


@pytest.mark.parametrize("y_m", [0.0, 0.15, -0.3])
def test_no_bends_of_a_grid_cost_much_less_than_those_that_are_found(y_m: float) -> None:
    chooser = walker(7)
    for _ in range(3):
        chooser.decide(pose(chooser.track, y_m=y_m))
    here = pose(chooser.track, y_m=y_m)
    while chooser.think(lambda: here):
        pass
    found = min(chooser._tried, key=lambda each: each.cost_m2)
    assert len(chooser._tried) <= (15 if found.cost_m2 < 0.08 else 39)
    chooser._tried = []
    grid = np.linspace(-1.0, 1.0, 9)
    for bends in np.array(np.meshgrid(grid, grid)).reshape(2, -1).T:
        chooser._roll(here, [(found.option, bends)])
    assert found.cost_m2 < min(each.cost_m2 for each in chooser._tried) + 0.002


def test_how_rough_joints_are_is_the_mean_square_of_their_second_differences() -> None:
    rng, span = np.random.default_rng(8), 6
    tail, angles = rng.normal(size=2 * span), rng.normal(size=(5, 40))
    rough = np.empty(5)
    _roughness(tail, angles, span, rough)
    for row, value in zip(angles, rough, strict=True):
        line = np.append(tail, row)
        means = np.array([line[k : k + span].mean() for k in range(len(line) - span + 1)])
        joint = means[span:] - means[:-span]
        assert value == pytest.approx(float(np.mean(np.diff(joint, 2) ** 2)))
    arc = 0.3 + 0.02 * np.arange(52.0) + 0.001 * np.arange(52.0) ** 2  # joints move evenly
    _roughness(arc[: 2 * span], arc[None, 2 * span :].copy(), span, rough[:1])
    assert rough[0] == pytest.approx(0.0, abs=1e-20)


def test_a_decision_that_comes_too_early_takes_the_best_so_far() -> None:
    chooser = walker(5)
    chooser.decide(pose(chooser.track))
    end = chooser.track.end
    chooser.think(lambda: pose(chooser.track))
    made = chooser.decide(pose(chooser.track))
    assert chooser.track.end == end + 10
    assert abs(made.ramp_rad) <= 2.4


def test_the_drift_is_what_the_body_does_beside_the_prediction() -> None:
    chooser = walker(6)
    track = chooser.track
    steering = Steering(ROLLOUT, track, 25.0)
    for _ in range(40):
        chooser.decide(pose(track))
    left_m = 0.0005
    for k in range(30):  # a body that slides to its left by half a millimetre a segment
        head = 150.0 + 10.0 * k
        before = ROLLOUT.begin(
            track.samples(0), 150.0, PlanarPose(np.zeros(2), 0.0), STRAIGHT, 0, 25.0,
            Drift(left_m=left_m),
        ).roll(np.empty((1, 0)), head - 150.0) if k else None  # fmt: skip
        centre = np.zeros(2) if before is None else before.centre_m[0]
        offset = 0.0 if before is None else float(before.offset_rad[0])
        steering.observe(PathPose(head, offset, centre, 0.0, STRAIGHT, 0))
    assert steering.drift.left_m == pytest.approx(left_m, rel=0.1)
    assert steering.drift.ahead_m == pytest.approx(0.0, abs=0.1 * left_m)


@settings(max_examples=10)
@given(seed=st.integers(0, 10_000), before=st.integers(1, 25))
def test_the_serpenoid_takes_over_without_a_jump_and_hands_back(seed: int, before: int) -> None:
    chooser = walker(seed)
    for _ in range(before):
        chooser.decide(pose(chooser.track))
    end = chooser.track.end
    largest = float(np.abs(np.diff(chooser.track.at_rad(np.arange(end, dtype=float)))).max())
    chooser.fall_back(True)
    made = chooser.decide(pose(chooser.track))
    assert made.state == SERPENOID
    joined = chooser.track.at_rad(np.arange(end - 1, end + 3, dtype=float))
    # 0.7 rad, 1.2 waves: at most 0.053 rad a sample, and the turn of the mean line
    assert np.abs(np.diff(joined)).max() < max(largest, 0.053) + 0.05
    for _ in range(15):
        assert chooser.decide(pose(chooser.track)).visited == made.visited
    chooser.fall_back(False)
    assert chooser.decide(pose(chooser.track)).state != SERPENOID
