"""The time law: joint speed and acceleration within limits, whatever shapes come."""

import numpy as np
import pytest

from snakewalk.config.loader import load_robot
from snakewalk.config.run import WalkConfig
from snakewalk.controller.kinematics import retarget
from snakewalk.controller.kinematics.retarget import Retarget
from snakewalk.controller.track.readers.generated import embedded
from snakewalk.controller.walk import joint_track, time_law
from snakewalk.controller.walk.angle_track import AngleTrack
from snakewalk.controller.walk.joint_track import JointTrack
from snakewalk.controller.walk.serpenoid import Serpenoid
from snakewalk.controller.walk.time_law import TimeLaw
from snakewalk.controller.walk.walker import Walker

SPEED, ACCELERATION, DT = 2.0, 25.0, 0.02


def straight(joints: int = 3) -> JointTrack:
    track = AngleTrack(np.zeros(100))
    return JointTrack(track, lambda body: body[..., :joints] - body[..., 1 : joints + 1])


def timed(joints: JointTrack, wanted: float = 25.0, ramp_s: float = 1.0) -> TimeLaw:
    return TimeLaw(
        joints,
        wanted,
        speed_limit_rad_s=SPEED,
        acceleration_limit_rad_s2=ACCELERATION,
        ramp_time_s=ramp_s,
    )


def source(name: str, seed: int) -> Walker | Serpenoid:
    if name == "serpenoid":
        return Serpenoid(100)
    shapes = embedded("worm-like").angles_rad
    shapes = shapes - shapes.mean(axis=1, keepdims=True)
    order = np.random.default_rng(seed).permutation(len(shapes))
    return Walker(shapes[order], WalkConfig())


@pytest.mark.parametrize("robot", ["yaw16", "alternating16", "alternating32"])
@pytest.mark.parametrize(("name", "seed"), [("walk", 0), ("walk", 1), ("serpenoid", 0)])
def test_joint_speed_and_acceleration_stay_within_their_limits(
    name: str, seed: int, robot: str
) -> None:
    maker = source(name, seed)
    pulse = timed(JointTrack(maker.track, Retarget(load_robot(robot)).joints_rad), wanted=40.0)
    goals = [pulse.goal_rad()]
    for step in range(1500):
        if pulse.head >= maker.track.end - 6.0:
            maker.decide(0.0, 0.8 * np.sin(step / 200.0))
        pulse.advance(DT)
        goals.append(pulse.goal_rad())
    speed = np.diff(goals, axis=0) / DT
    assert np.abs(speed).max() <= SPEED * 1.001
    assert np.abs(np.diff(speed, axis=0)).max() / DT <= ACCELERATION * 1.05
    assert pulse.head > 300.0


def test_on_a_straight_track_the_head_ramps_up_and_then_keeps_the_wanted_speed() -> None:
    joints = straight()
    joints.track.append(np.zeros(200))
    pulse = timed(joints, wanted=20.0, ramp_s=1.0)
    for _ in range(50):
        pulse.advance(DT)
    assert pulse.speed_segments_s == pytest.approx(20.0)
    assert pulse.head - 100.0 == pytest.approx(0.5 * 20.0 * (1.0 + DT))  # sum of an arithmetic row


def test_it_sets_off_from_rest_however_long_it_waited_for_a_track() -> None:
    joints = straight()
    pulse = timed(joints, wanted=20.0, ramp_s=1.0)
    for _ in range(50):
        pulse.advance(DT)
    assert pulse.speed_segments_s == 0.0
    joints.track.append(np.zeros(200))
    pulse.advance(DT)
    assert pulse.speed_segments_s == pytest.approx(20.0 * DT)


def test_a_bend_ahead_is_braked_for_and_the_end_is_never_overrun() -> None:
    joints = straight()
    joints.track.append(
        np.concatenate([np.zeros(60), np.cumsum(0.5 * np.arange(1, 11)), np.full(30, 27.5)])
    )
    pulse = timed(joints, wanted=50.0, ramp_s=0.1)
    speeds, heads = [], []
    for _ in range(3000):
        heads.append(pulse.advance(DT))
        speeds.append(pulse.speed_segments_s)
    assert max(speeds[:60]) > 30.0
    in_bend = [u for u, h in zip(speeds, heads, strict=True) if 162.0 < h < 168.0]
    assert max(in_bend) <= 4.0 + 1e-9  # 2 rad/s over 0.5 rad a segment
    assert max(heads) == joints.track.end


def test_stopping_comes_to_rest_without_a_jump() -> None:
    joints = straight()
    joints.track.append(np.zeros(400))
    pulse = timed(joints, wanted=20.0)
    for _ in range(100):
        pulse.advance(DT)
    pulse.stop()
    way = pulse.head
    for _ in range(60):
        pulse.advance(DT)
    assert pulse.speed_segments_s == 0.0
    assert pulse.head - way == pytest.approx(10.0, abs=0.5)  # u^2 / 2 b


def test_the_spline_meets_straight_stretches_and_stays_between_the_samples() -> None:
    joints = straight(1)
    joints.track.append(np.cumsum(np.cumsum(np.full(20, 0.01))))  # joint angle grows linearly
    joints.grow()
    inside = [joints.goal_rad(h)[0] for h in np.arange(104.0, 116.0, 0.1)]
    np.testing.assert_allclose(np.diff(inside, 2), 0.0, atol=1e-12)


def test_without_the_acceleration_limit_the_same_walk_breaks_it() -> None:
    """The printed retiming, by speed alone: what the limit is for."""
    maker = source("walk", 0)
    joints = JointTrack(maker.track, Retarget(load_robot("yaw16")).joints_rad)
    pulse = TimeLaw(joints, 40.0, speed_limit_rad_s=SPEED, acceleration_limit_rad_s2=1e6)
    goals = []
    for step in range(800):
        if pulse.head >= maker.track.end - 6.0:
            maker.decide(0.0, 0.8 * np.sin(step / 200.0))
        pulse.advance(DT)
        goals.append(pulse.goal_rad())
    assert np.abs(np.diff(goals, 2, axis=0)).max() / DT**2 > ACCELERATION


def test_the_loops_as_they_are_written_go_the_same_way(monkeypatch: pytest.MonkeyPatch) -> None:
    def heads() -> list[float]:
        joints = JointTrack(AngleTrack(np.zeros(100)), Retarget(load_robot("yaw16")).joints_rad)
        law, rng = timed(joints), np.random.default_rng(5)
        at = []
        for _ in range(60):
            if joints.track.end - law.head < 8.0:
                joints.track.append(np.cumsum(0.05 * rng.standard_normal(10)))
            at.append(law.advance(DT))
        return at

    compiled = heads()
    for module in (time_law, joint_track, retarget):
        for name, each in vars(module).items():
            if hasattr(each, "py_func"):
                monkeypatch.setattr(module, name, each.py_func)
    assert heads() == compiled
