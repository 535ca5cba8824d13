"""Friction from measured poses of the head: noise is not taken for friction."""

from dataclasses import replace

import numpy as np
import pytest

from snakewalk.config.heightfield import HeightField
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.links import BodyView, body_in_world
from snakewalk.controller.mechanics.friction_filter import FoundFriction
from snakewalk.controller.pose.external_pose import MeasuredHeads, TimedHead
from snakewalk.controller.pose.measured_friction import MeasuredFriction
from snakewalk.controller.pose.tracked_body import HeadMeasurement
from snakewalk.drivers.types import BodyPose
from tests.helpers.sliding_body import CYCLE_S, FILE, ROBOT, joints_rad, sliding

DELAY_S = 0.1
NOISE_M, NOISE_RAD = 0.01, np.radians(3.0)


def seen(time_s: float, view: BodyView, rng: np.random.Generator) -> TimedHead:
    """A noisy measurement of the head."""
    turn = NOISE_RAD * rng.standard_normal()
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ view.rotation[0]
    place = view.link_m[0] + NOISE_M * rng.standard_normal(3)
    covariances = NOISE_M**2 * np.eye(3), NOISE_RAD**2 * np.eye(3)
    return TimedHead(time_s, HeadMeasurement(place, rotation, *covariances))


def estimated(
    views: list[BodyView],
    seed: int,
    lost: tuple[float, float] = (0.0, 0.0),
    ground: HeightField | None = None,
    slid: tuple[float, float] = (0.0, 0.0),
) -> tuple[list[FoundFriction], list[FrictionConfig]]:
    """Return the findings from noisy, late poses, and the frictions to use.

    The views have noise too, as those of a filter have; no pose is measured within ``lost``, and
    the source reports a slide within ``slid``.
    """
    rng, used = np.random.default_rng(seed), list[FrictionConfig]()
    late = round(DELAY_S / CYCLE_S)
    arrived = MeasuredHeads(0.0, [])
    monitor = MeasuredFriction(FILE, lambda: arrived, used.append, ground)
    found = []
    for k, true in enumerate(views):
        now_s, measured_s = k * CYCLE_S, (k - late) * CYCLE_S
        is_kept = k >= late and not lost[0] < measured_s < lost[1]
        news = [seen(measured_s, views[k - late], rng)] if is_kept else []
        arrived = MeasuredHeads(now_s, news, slid[0] < now_s < slid[1])
        noisy = seen(now_s, true, rng).head
        near = BodyPose(now_s, noisy.position_m, noisy.rotation)
        view = body_in_world(ROBOT, near, joints_rad(now_s))
        found.append(monitor.update(view, joints_rad(now_s)))
    return [each for each in found if each is not None], used


@pytest.mark.slow
@pytest.mark.parametrize("along", [0.1, 0.3])
def test_intervals_contain_the_true_friction(along: float) -> None:
    """At 1 cm and 3 degrees the ratio is found, and the file is used while it is right."""
    true = FrictionConfig(along=along, across=0.7)
    views = sliding(true, 17.0)
    for seed in range(2):
        found, used = estimated(views, seed)
        last = found[-1]
        assert len(found) == 4
        assert last.along_95[0] < along < last.along_95[1]
        assert last.across_95[0] < 0.7 < last.across_95[1]
        ratio = last.friction.across / last.friction.along
        assert ratio == pytest.approx(0.7 / along, rel=0.2)
        assert bool(used) == last.differs == (along != 0.1)


def test_the_ratio_of_the_frictions_shows_after_three_windows() -> None:
    found, _ = estimated(sliding(FrictionConfig(along=0.3, across=0.7), 13.0), 0)
    assert len(found) == 3
    assert found[-1].friction.across / found[-1].friction.along == pytest.approx(7 / 3, rel=0.2)


def test_time_without_poses_shows_nothing() -> None:
    """A window without poses leaves the file in force, and widens no claim."""
    views = sliding(FrictionConfig(along=0.3, across=0.7), 9.0)
    found, used = estimated(views, 1, lost=(-1.0, 20.0))
    assert used == []
    assert found[-1].friction == FILE
    assert found[-1].along_95 == pytest.approx((0.1 / 3.0, 0.1 * 3.0), rel=0.01)
    assert not any(each.is_estimated for each in found)


def test_a_gap_in_the_poses_does_not_move_the_estimate() -> None:
    found, used = estimated(sliding(FILE, 9.0), 2, lost=(1.0, 2.5))
    assert used == []
    assert found[-1].friction.along == pytest.approx(0.1, rel=0.15)
    assert found[-1].is_estimated


def test_a_window_with_a_slide_shows_nothing() -> None:
    """A body that slid by 0.5 m within a second is not taken for one on slippery ground."""
    still = sliding(FILE, 13.0)
    views = [
        view._replace(link_m=view.link_m + way_m, centre_m=view.centre_m + way_m)
        for k, view in enumerate(still)
        for way_m in [np.array([0.0, 0.5, 0.0]) * np.clip(k * CYCLE_S - 1.0, 0.0, 1.0)]
    ]
    blind, _ = estimated(views, 5)
    found, used = estimated(views, 5, slid=(1.0, 2.0))
    assert used == []
    assert len(blind) == 3
    assert len(found) == 2, "the first window begins after the slide"
    assert found[-1].friction.along == pytest.approx(0.1, rel=0.15)


def slope(degrees: float) -> HeightField:
    """A plane that rises along x."""
    x_m = np.linspace(-4.0, 4.0, 81)
    return HeightField(np.tile(np.tan(np.radians(degrees)) * x_m, (81, 1)), 0.1, -4.0, -4.0)


@pytest.mark.slow_cases(1, "2 cases of 1.0 s of CPU")
@pytest.mark.slow
@pytest.mark.parametrize(("along", "across"), [(0.1, 0.7), (0.06, 0.3)])
def test_a_slope_shows_both_frictions(along: float, across: float) -> None:
    """Gravity sets the scale: both are found, and used when they contradict the file."""
    ground = slope(5.0)
    views = sliding(FrictionConfig(along=along, across=across), 25.0, ground=ground)
    found, used = estimated(views, 3, ground=ground)
    last = found[-1]
    assert last.along_95[0] < along < last.along_95[1]
    assert last.across_95[0] < across < last.across_95[1]
    assert last.friction.across == pytest.approx(across, rel=0.25)
    assert bool(used) == (across != 0.7)


def test_motion_on_rough_ground_shows_nothing() -> None:
    """Few links bear a body there, so its motion is not that of the balance."""
    plane = slope(5.0)
    rough = HeightField(
        plane.z_m + 0.01 * np.random.default_rng(1).standard_normal(plane.z_m.shape),
        *(plane.spacing_m, plane.x0_m, plane.y0_m),
    )
    views = sliding(FrictionConfig(along=0.3, across=0.3), 9.0, ground=plane)
    found, used = estimated(views, 4, ground=rough)
    assert used == []
    assert found[-1].friction == FILE
    assert not found[-1].is_estimated


def test_use_begins_with_narrow_intervals() -> None:
    """A contradiction counts on a slope when both intervals are narrow, and then until it ends."""
    used = list[FrictionConfig]()
    monitor = MeasuredFriction(FILE, lambda: MeasuredHeads(0.0, []), used.append, slope(5.0))
    other = FrictionConfig(along=0.05, across=0.35)
    wide = FoundFriction(other, (0.02, 0.09), (0.2, 0.5), differs=True)
    monitor.accept(wide)
    assert used == []
    monitor.accept(replace(wide, along_95=(0.04, 0.06)))
    assert used == [other]
    monitor.accept(wide)
    assert used == [other]
    monitor.accept(replace(wide, differs=False))
    assert used == [other, FILE]
