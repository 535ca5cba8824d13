"""Many bodies at once are the same as one by one; level of detail; secondary controller."""

import numpy as np
import pytest

from snakewalk.controller.kinematics.frame import Frame
from snakewalk.controller.repertoire.crowd import Crowd
from snakewalk.controller.repertoire.repertoire import Repertoire
from snakewalk.controller.repertoire.replay import replay, replay_all
from snakewalk.controller.repertoire.secondary import SecondaryController


def test_a_crowd_replays_as_one_body_does(repertoire: Repertoire) -> None:
    random = np.random.default_rng(0)
    crowd = Crowd(repertoire, 20)
    starts = [Frame.flat(*random.uniform(-3, 3, size=3)) for _ in range(20)]
    scales = random.uniform(0.5, 2.0, size=20)
    which = random.integers(len(repertoire.segments), size=20)
    for body, start in enumerate(starts):
        crowd.place(body, start, segment=int(which[body]), scale=float(scales[body]))
    crowd.step(40)
    for body, start in enumerate(starts):
        one = replay(repertoire.segments[which[body]], start, float(scales[body]))
        np.testing.assert_allclose(crowd.link_m(body), one.link_m[39], atol=5e-6)
        np.testing.assert_allclose(crowd.origin_m[body], one.origin_m[39], atol=1e-9)


def test_a_change_is_bridged_and_an_unseen_body_changes_at_once(repertoire: Repertoire) -> None:
    a, b = (repertoire.index(name) for name in ("left-sharp", "right-sharp"))
    start = Frame.flat(0.5, 0.0, 1.0)
    pair = [repertoire.segments[a], repertoire.segments[b]]
    seen = replay_all(pair, start)
    extra = len(seen.link_m) - sum(segment.frames for segment in pair)
    assert extra > 3
    crowd = Crowd(repertoire, 2)
    crowd.visible[1] = False
    for body in (0, 1):
        crowd.place(body, start, segment=a)
    crowd.segment[:] = b
    for k in range(pair[0].frames + 20):
        crowd.step()
        np.testing.assert_allclose(crowd.link_m(0), seen.link_m[k], atol=5e-6)
    after = replay(pair[1], replay(pair[0], start).end)
    np.testing.assert_allclose(crowd.origin_m[1], after.origin_m[19], atol=1e-9)
    assert not crowd.link_m(1).any()
    assert crowd.playing.tolist() == [b, b]


def test_far_bodies_follow_the_same_way_and_can_be_seen_again(repertoire: Repertoire) -> None:
    crowd = Crowd(repertoire, 2)
    crowd.visible[1] = False
    crowd.step(100)
    np.testing.assert_allclose(crowd.origin_m[0], crowd.origin_m[1], atol=1e-12)
    crowd.visible[1] = True
    crowd.step()
    np.testing.assert_array_equal(crowd.link_m(0), crowd.link_m(1))


def test_axes_stay_square_for_an_hour(repertoire: Repertoire) -> None:
    crowd = Crowd(repertoire, 1)
    crowd.place(0, Frame.flat(0, 0, 0), segment=repertoire.index("left-sharp"))
    crowd.visible[0] = False
    crowd.step(20_000)
    axes = crowd.rotation[0].reshape(3, 3)
    np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-9)


def test_the_controller_picks_by_speed_and_by_turn(repertoire: Repertoire) -> None:
    control = SecondaryController(repertoire)
    names = [segment.name for segment in repertoire.segments]
    assert names[control.nearest(0.35)] == "forward-medium"
    assert names[control.nearest(9.0)] == "forward-fast"
    assert names[control.nearest(0.6, 0.4)] == "left-gentle"
    assert names[control.nearest(0.6, -2.0)] == "right-sharp"


def test_a_segment_repeated_too_long_is_changed_for_one_alike(repertoire: Repertoire) -> None:
    control = SecondaryController(repertoire, patience=3, seed=1)
    names = [repertoire.segments[control.choose(0.6)].name for _ in range(12)]
    assert names[:3] == ["forward-fast"] * 3
    assert names[3] == "forward-medium"
    assert set(names) == {"forward-fast", "forward-medium"}
    turns = [repertoire.segments[control.choose(0.6, 0.9)].name for _ in range(8)]
    assert set(turns) == {"left-sharp", "left-gentle"}
    with pytest.raises(ValueError, match="at least one"):
        SecondaryController(repertoire, patience=0)
