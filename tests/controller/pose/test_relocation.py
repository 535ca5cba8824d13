"""A body that slides without its joints is found again; a source that is wrong is not believed."""

import re
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from snakewalk.config.pose import PoseConfig
from snakewalk.controller.pose.sample import ArrivedPose, PoseSample
from snakewalk.drivers.attitude import rotation_by
from tests.controller.pose.scene import CYCLE_S, Scene, joint_state, moved
from tests.helpers.tiers import slow_after

BEFORE_S = 6.0
SLIDE_M, SLIDE_RAD, SLIDE_S = 1.3, 1.5, 0.7
RELOCATED = "the robot slid or was moved by"


def share(time_s: float) -> float:
    """Return the part of a slide that is over: it begins and ends at once."""
    return min(max(time_s - BEFORE_S, 0.0) / SLIDE_S, 1.0)


@dataclass
class Slide:
    """A change of a scene: the body slides down and turns while its joints go on."""

    sent: list[PoseSample] = field(default_factory=list)

    def __call__(self, time_s: float, sample: PoseSample) -> list[ArrivedPose | PoseSample]:
        way_m = SLIDE_M * share(time_s) * np.array([0.6, -0.8, 0.0])
        turn = rotation_by(np.array([0.0, 0.0, SLIDE_RAD * share(time_s)]))
        begin_m = self.sent[0].position_m if self.sent else sample.position_m
        place_m = begin_m + turn @ (sample.position_m - begin_m) + way_m
        self.sent.append(replace(sample, position_m=place_m, rotation=turn @ sample.rotation))
        return [self.sent[-1]]

    def assert_found(self, scene: Scene) -> None:
        """Check that the estimate is where the body truly is."""
        true, state = self.sent[-1], joint_state((scene.cycles - 1) * CYCLE_S)
        state = joint_state(min(state.time_s, scene.rest_s))._replace(time_s=state.time_s)
        found = scene.pose(state)
        assert found.head_in_world_m == pytest.approx(true.position_m, abs=0.03)
        off = found.rotation @ true.rotation.T
        assert abs(np.arctan2(off[1, 0], off[0, 0])) < 0.1


def walked() -> Scene:
    scene = Scene(noise_m=0.01)
    scene.run(BEFORE_S)
    assert scene.events == []
    return scene


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("rest_s", [np.inf, BEFORE_S, BEFORE_S + SLIDE_S])
def test_a_body_that_slides_down_is_found_again(rest_s: float) -> None:
    scene, slide = walked(), Slide()
    scene.rest_s = rest_s
    scene.run(SLIDE_S + 1.6, slide)
    told = [line for line in scene.events if line.startswith(RELOCATED)]
    assert len(told) == 1
    assert scene.pose.fault() is None
    assert scene.pose.counts["relocations"] == 1
    slide.assert_found(scene)


def test_a_slide_is_reported_to_the_estimate_of_friction() -> None:
    scene = walked()
    assert not scene.pose.take_measured().has_slid
    scene.run(SLIDE_S + 0.3, Slide())
    assert scene.pose.take_measured().has_slid
    assert not scene.pose.take_measured().has_slid


def test_a_step_of_the_source_is_no_slide() -> None:
    """A step of 0.2 m was taken for a slide: the gates widened while poses arrived."""
    scene = walked()
    scene.run(8.0, lambda time_s, sample: [moved(sample, [0.0, 0.2, 0.0])])
    assert scene.pose.counts["relocations"] == 0
    assert "jump by" in str(scene.pose.fault())


@pytest.mark.costs("a simulated run")
def test_a_body_that_slides_on_is_not_placed() -> None:
    slide = Slide()

    def change(time_s: float, sample: PoseSample) -> list[ArrivedPose | PoseSample]:
        slide(time_s, sample)
        return [moved(slide.sent[-1], [0.6 * (time_s - BEFORE_S), 0.0, 0.0])]

    scene = walked()
    scene.rest_s = BEFORE_S + 1.0
    scene.run(8.0, change)
    assert scene.pose.counts["relocations"] == 0
    assert "jump" in str(scene.pose.fault())


@pytest.mark.slow
def test_markers_that_swap_after_a_slide_change_nothing() -> None:
    slide = Slide()

    def change(time_s: float, sample: PoseSample) -> list[ArrivedPose | PoseSample]:
        slide(time_s, sample)
        is_swapped = SLIDE_S + 0.2 < time_s - BEFORE_S < SLIDE_S + 0.6
        return [moved(slide.sent[-1], [0.0, 0.0, 0.5 * is_swapped])]

    scene = walked()
    scene.run(SLIDE_S + 2.4, change)
    assert scene.pose.counts["relocations"] == 1
    slide.assert_found(scene)


@pytest.mark.slow_cases(1, "3 cases of 0.9 s of CPU")
@pytest.mark.slow
@pytest.mark.parametrize("gap_s", slow_after(1, [0.0, 0.3, 2.0]))
def test_markers_that_swap_for_ever_are_never_believed(gap_s: float) -> None:
    """The run holds after a second, so the joints rest."""
    scene = walked()
    scene.rest_s = BEFORE_S + 1.0
    scene.run(gap_s, lambda t, s: [])
    scene.run(10.0, lambda t, s: [moved(s, [0.4, 0.4, 0.0])])
    assert scene.pose.counts["relocations"] == 0
    assert "jump by 0.5" in str(scene.pose.fault())


MIRROR = np.diag([1.0, -1.0, 1.0])


def mirrored_place(time_s: float, sample: PoseSample) -> list[ArrivedPose | PoseSample]:
    """Return a pose whose y axis points the other way, from the start onwards."""
    return [moved(sample, MIRROR @ sample.position_m - sample.position_m)]


@pytest.mark.slow_cases(1, "2 cases of 1.0 s of CPU")
@pytest.mark.slow
@pytest.mark.parametrize("rest_s", [np.inf, 4.5])
def test_a_mirrored_feed_is_never_believed(rest_s: float) -> None:
    scene = Scene(PoseConfig(latency_s=0.06), rest_s=rest_s)
    scene.run(4.5, mirrored_place)
    assert re.search("mirrored axes|wrong frame", str(scene.pose.fault()))
    used = scene.pose.counts["used"]
    scene.run(20.0, mirrored_place)
    assert scene.pose.counts["relocations"] == 0
    assert scene.pose.counts["used"] == used
    assert re.search("mirrored axes|wrong frame", str(scene.pose.fault())), "rest shows nothing new"
