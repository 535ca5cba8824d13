"""The walker: junctions without a step, steering, and the order of W."""

import numpy as np
import pytest

from snakewalk.config.run import WalkConfig
from snakewalk.controller.kinematics.rotations import offset_rad, wrap
from snakewalk.controller.walk.angle_track import AngleTrack
from snakewalk.controller.walk.walker import Walker

RNG = np.random.default_rng(5)
S = np.linspace(0.0, 1.0, 100)


def shapes(count: int) -> np.ndarray:
    phase = RNG.uniform(0, 2 * np.pi, (count, 1))
    return RNG.uniform(0.4, 0.9, (count, 1)) * np.sin(2 * np.pi * 1.2 * S + phase)


def test_with_no_sliding_every_point_follows_the_head_exactly() -> None:
    track = AngleTrack(shapes(1)[0])
    track.append(shapes(1)[0, ::-1])
    head = 130.37
    for n in (1, 17, 60):
        np.testing.assert_allclose(track.body_rad(head)[:-n], track.body_rad(head + n)[n:])


def test_the_track_refuses_to_be_read_beyond_its_ends() -> None:
    track = AngleTrack(shapes(1)[0])
    for head in (99.9, 100.1):
        with pytest.raises(ValueError, match="track serves"):
            track.body_rad(head)


def test_a_piece_continues_the_head_without_a_step() -> None:
    library = shapes(50)
    walker = Walker(library, WalkConfig(decision_fraction=0.5))
    for _ in range(40):
        end = walker.track.end
        walker.decide(0.3, RNG.uniform(-3, 3))
        body = walker.track.body_rad(walker.track.end)[::-1]
        assert walker.track.end == end + 50
        assert abs(body[50] - body[49]) < 1e-12


def test_the_ramp_cancels_the_heading_error_within_its_limit() -> None:
    library = shapes(200)
    walker = Walker(library, WalkConfig(decision_fraction=0.5, heading_tolerance_rad=3.2))
    aim = 0.4
    for _ in range(30):
        decision = walker.decide(0.0, aim)
        np.testing.assert_allclose(
            decision.ramp_rad, -np.clip(decision.heading_error_rad, -0.8, 0.8)
        )


def test_unvisited_states_come_first_and_none_is_repeated_before_all_are_seen() -> None:
    walker = Walker(shapes(30), WalkConfig(decision_fraction=0.5, heading_tolerance_rad=10.0))
    states = [walker.decide(0.0, 0.0).state for _ in range(29)]
    assert sorted([0, *states]) == list(range(30))


def test_the_printed_rule_appends_whole_states_without_a_ramp() -> None:
    walker = Walker(shapes(20), WalkConfig(decision_fraction=1.0, ramp_limit_rad=0.0))
    decision = walker.decide(0.0, 0.0)
    assert walker.track.end == 200
    assert decision.ramp_rad == 0.0


def test_steering_holds_the_mean_heading_on_the_aim() -> None:
    walker = Walker(shapes(200), WalkConfig())
    for _ in range(4):
        walker.decide(0.0, 1.0)
    headings = []
    for _ in range(30):
        walker.decide(0.0, 1.0)
        headings.append(walker.track.body_rad(walker.track.end).mean())
    assert abs(wrap(np.mean(headings) - 1.0)) < 0.15


def test_a_shape_that_is_refused_on_the_way_is_not_chosen() -> None:
    library = shapes(40)
    seen = []

    def accept(between: np.ndarray) -> bool:
        seen.append(between)
        return len(seen) % 3 == 0

    walker = Walker(library, WalkConfig(), accept)
    walker.decide(0.0, 0.0)
    assert len(seen) == 3
    np.testing.assert_allclose(seen[-1], walker.track.body_rad(walker.track.end))


def test_offset_is_the_rotation_between_measured_and_believed_headings() -> None:
    believed = RNG.uniform(-1, 1, 17)
    assert offset_rad(believed + 3.0, believed) == pytest.approx(3.0)
    assert offset_rad(believed + 3.5, believed) == pytest.approx(3.5 - 2 * np.pi)
