"""Many bodies at once are the same as one by one; level of detail; secondary controller."""

from dataclasses import replace

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, load_world
from snakewalk.controller.kinematics.frame import Frame
from snakewalk.controller.repertoire.crowd import Crowd
from snakewalk.controller.repertoire.repertoire import Repertoire
from snakewalk.controller.repertoire.repertoire_recording import ACTIONS, record_action
from snakewalk.controller.repertoire.replay import replay
from snakewalk.controller.repertoire.secondary import SecondaryController
from tests.helpers.replayed import replay_all


def test_a_crowd_replays_as_one_body_does(repertoire: Repertoire) -> None:
    random = np.random.default_rng(0)
    crowd = Crowd(repertoire, 20)
    starts = [Frame.flat(*random.uniform(-3, 3, size=3)) for _ in range(20)]
    scales = random.uniform(0.5, 2.0, size=20)
    which = random.integers(len(repertoire.segments), size=20)
    for body, start in enumerate(starts):
        crowd.place(body, start, segment=int(which[body]), scale=float(scales[body]))
    crowd.step(25)
    for body, start in enumerate(starts):
        one = replay(repertoire.segments[which[body]], start, float(scales[body]))
        np.testing.assert_allclose(crowd.link_m(body), one.link_m[24], atol=5e-6)
        np.testing.assert_allclose(crowd.origin_m[body], one.origin_m[24], atol=1e-9)


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


@pytest.mark.parametrize("lean", [-2.9, -0.4, 0.0, 1.2])
def test_a_leaning_body_rolls_slowly_to_where_its_up_is_highest(
    repertoire: Repertoire, lean: float
) -> None:
    rest = repertoire.index("rest")
    heading, climb = Frame.flat(0.0, 0.0, 0.7).rotation, 0.3
    pitch = np.array(
        [
            [np.cos(climb), 0.0, -np.sin(climb)],
            [0.0, 1.0, 0.0],
            [np.sin(climb), 0.0, np.cos(climb)],
        ]
    )
    c, s = np.cos(lean), np.sin(lean)
    roll = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    start = Frame(rotation=heading @ pitch @ roll, origin_m=np.zeros(3))
    crowd = Crowd(repertoire, 2, balance_rad=0.02)
    still = Crowd(repertoire, 2)
    for each in (crowd, still):
        each.place(0, start, segment=rest)
        each.step(1)
    between = crowd.rotation[0].reshape(3, 3).T @ still.rotation[0].reshape(3, 3)
    turned = np.arccos(min((np.trace(between) - 1.0) / 2.0, 1.0))
    assert turned == pytest.approx(min(abs(lean), 0.02), abs=1e-4)
    crowd.step(200)
    axes = crowd.rotation[0].reshape(3, 3)
    np.testing.assert_allclose(axes[:, 2], (heading @ pitch)[:, 2], atol=0.02)
    assert abs(axes[2, 1]) < 0.01


def test_back_rest_and_brake_are_actions_of_their_own(repertoire: Repertoire) -> None:
    parts = {segment.name: segment for segment in repertoire.segments}
    assert parts["reverse"].speed_m_s == pytest.approx(-parts["forward-medium"].speed_m_s, rel=0.01)
    assert abs(parts["rest"].speed_m_s) < 1e-3
    brake = parts["brake"]
    speed = np.linalg.norm(brake.move_m, axis=1) / brake.frame_s
    assert speed[:10].mean() > 0.5
    assert speed[-10:].mean() < 0.02
    assert brake.speed_m_s == pytest.approx(0.5 * parts["forward-fast"].speed_m_s, rel=0.15)


def test_a_body_that_goes_brakes_before_it_rests(repertoire: Repertoire) -> None:
    names = [segment.name for segment in repertoire.segments]
    control = SecondaryController(repertoire)
    asked = [0.6, 0.0, 0.0, 0.0, -0.5, 0.02, 0.0, 0.6]
    chosen = [names[control.choose(speed)] for speed in asked]
    assert chosen == [
        *("forward-fast", "brake", "rest", "rest", "reverse", "rest", "rest", "forward-fast"),
    ]
    assert names[SecondaryController(repertoire).choose(0.0)] == "rest"


def test_a_body_twice_as_long_goes_twice_as_fast_by_the_same_action(repertoire: Repertoire) -> None:
    names = [segment.name for segment in repertoire.segments]
    control = SecondaryController(repertoire)
    assert names[control.of_size(2.0, 0).choose(0.75)] == "forward-medium"
    assert names[control.choose(0.75)] == "forward-fast"


def test_the_controller_picks_by_speed_and_by_turn(repertoire: Repertoire) -> None:
    names = [segment.name for segment in repertoire.segments]

    def first(*asked: float) -> str:
        return names[SecondaryController(repertoire).choose(*asked)]

    assert first(0.35) == "forward-medium"
    assert first(9.0) == "forward-fast"
    assert first(0.6, 0.4) == "left-gentle"
    assert first(0.6, -2.0) == "right-sharp"


@pytest.mark.parametrize(
    ("asked", "name", "others"),
    [
        ((-0.4, 0.3), "reverse", "with 0.3 rad/s: 0.42 to 0.59 m/s; with -0.4 m/s: 0.00 rad/s"),
        ((-0.4, 0.03), "reverse", ""),
        ((0.0, 0.9), "rest", "with 0.9 rad/s: 0.54 to 0.55 m/s; with 0 m/s: 0.00 rad/s"),
        ((0.4, 0.3), "forward-medium", ""),
        ((0.4, 0.1), "forward-medium", ""),
    ],
)
def test_no_turn_changes_the_direction_of_travel(
    repertoire: Repertoire, asked: tuple[float, float], name: str, others: str
) -> None:
    control = SecondaryController(repertoire)
    assert repertoire.segments[control.choose(*asked)].name == name
    assert control.unreachable(*asked) == others


@pytest.mark.slow
def test_slow_turns_and_turns_of_a_body_that_goes_backward(repertoire: Repertoire) -> None:
    slow = tuple(one for one in ACTIONS if one.frequency_hz == 0.4)
    robot, world = load_robot("yaw16"), load_world("flat")
    more = tuple(record_action(robot, world, one) for one in slow)
    both = replace(repertoire, segments=repertoire.segments + more)
    assert not both.contradictions()
    control = SecondaryController(both)
    asked = [(0.3, 0.3), (0.3, -0.3), (-0.3, 0.3), (-0.3, -0.3), (-0.4, 0.0), (0.6, 0.4)]
    chosen = [both.segments[SecondaryController(both).choose(*one)].name for one in asked]
    assert chosen == [
        *("left-slow", "right-slow", "reverse-left", "reverse-right", "reverse", "left-gentle"),
    ]
    assert [control.unreachable(*one) for one in asked] == [""] * 6
    assert all(0.15 < abs(segment.turn_rad_s) < 0.5 for segment in more)


def test_a_repertoire_without_a_direction_never_goes_the_other_way(repertoire: Repertoire) -> None:
    kept = [s for s in repertoire.segments if s.kind != "reverse"]
    control = SecondaryController(replace(repertoire, segments=tuple(kept)))
    assert kept[control.choose(-0.5, 0.4)].name == "rest"
    assert control.unreachable(-0.5, 0.0) == "with 0 rad/s: 0.38 to 0.60 or 0.00 m/s"
    straight = [s for s in kept if s.kind in {"forward", "rest", "brake"}]
    control = SecondaryController(replace(repertoire, segments=tuple(straight)))
    assert control.unreachable(0.5, 0.05) == "with 0.5 m/s: 0.00 rad/s"
    assert control.unreachable(0.5, 0.0) == ""


def test_an_action_that_went_the_other_way_when_recorded_is_reported(
    repertoire: Repertoire,
) -> None:
    assert not repertoire.contradictions()
    wrong = {"reverse": "forward", "left-gentle": "right"}
    segments = tuple(replace(s, kind=wrong.get(s.name, s.kind)) for s in repertoire.segments)
    lines = replace(repertoire, segments=segments).contradictions()
    assert [line.split(":")[0] for line in lines] == ["action left-gentle", "action reverse"]
    back = tuple(s for s in repertoire.segments if s.kind in {"reverse", "rest"})
    with pytest.raises(InputError, match="no action goes forward"):
        SecondaryController(replace(repertoire, segments=back))


def test_actions_alternate_until_their_mean_is_the_request(repertoire: Repertoire) -> None:
    random = np.random.default_rng(5)
    segments = repertoire.segments
    met = 0
    for asked in random.uniform((0.3, -1.0), (0.62, 1.0), (40, 2)):
        control = SecondaryController(repertoire, patience=None)
        if control.unreachable(*asked):
            continue
        met += 1
        played = [segments[control.choose(*asked)] for _ in range(20)]
        for first in (0, 5, 10):
            ten = played[first : first + 10]
            rates = [(one.speed_m_s, one.turn_rad_s) for one in ten]
            mean = np.average(rates, axis=0, weights=[one.duration_s for one in ten])
            least = np.maximum(np.abs(asked), [0.377, 0.4])
            assert (np.abs(mean - asked) <= 0.101 * least).all()
    assert met > 20
    assert len({one.name for one in played}) > 1


def test_a_segment_repeated_too_long_is_changed_for_one_alike(repertoire: Repertoire) -> None:
    control = SecondaryController(repertoire, patience=3, seed=1)
    names = [repertoire.segments[control.choose(0.6)].name for _ in range(12)]
    assert names[:3] == ["forward-fast"] * 3
    assert names[3] == "forward-medium"
    assert set(names) == {"forward-fast", "forward-medium"}
    turns = [repertoire.segments[control.choose(0.6, 0.9)].name for _ in range(8)]
    assert set(turns) == {"left-sharp", "left-gentle"}
