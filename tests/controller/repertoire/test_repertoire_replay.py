"""Frames, segments, replay, bridges, scale: [YT] 3 and 4, and where the printed equations fail."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from snakewalk.config.errors import InputError
from snakewalk.controller.kinematics.frame import Frame, body_frame
from snakewalk.controller.repertoire.repertoire import Repertoire, load_repertoire
from snakewalk.controller.repertoire.replay import (
    bridge,
    bridge_frames,
    replay,
    tip_travel_m,
)
from snakewalk.controller.repertoire.segment import Segment, cut
from tests.helpers.replayed import replay_all

Floats = NDArray[np.float64]


def turned(axis: Floats, angle: float) -> Floats:
    """Rodrigues."""
    x, y, z = axis / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k)


def posed(rotation: Floats, origin_m: Floats) -> Frame:
    return Frame(rotation=rotation, origin_m=origin_m)


def swimmer(seed: int, frames: int = 12, links: int = 5) -> tuple[list[Frame], Floats]:
    """A body that goes any way in space, and its links in the world."""
    random = np.random.default_rng(seed)
    at = [posed(turned(random.normal(size=3), 1.0), random.normal(size=3))]
    for _ in range(frames):
        step = turned(random.normal(size=3), 0.3)
        at.append(posed(at[-1].rotation @ step, at[-1].origin_m + random.normal(size=3)))
    shapes = random.normal(size=(frames + 1, links, 3))
    return at, np.array([frame.to_world_m(shape) for frame, shape in zip(at, shapes, strict=True)])


def recorded(seed: int) -> tuple[Segment, list[Frame], Floats]:
    frames, links = swimmer(seed)
    n = len(links)
    axes = np.tile(np.eye(3), (*links.shape[:2], 1, 1))
    joints = np.zeros((n, links.shape[1] - 1))
    segment = cut("any", "forward", 0.1, frames, links, axes, joints[:-1], joints)
    return segment, frames, links


@given(seed=st.integers(0, 1000), scale=st.floats(0.2, 5.0))
@settings(max_examples=40)
def test_replay_from_any_pose_is_the_recording_moved_there(seed: int, scale: float) -> None:
    segment, frames, links = recorded(seed)
    random = np.random.default_rng(seed + 1)
    start = posed(turned(random.normal(size=3), random.uniform(-3, 3)), random.normal(size=3))
    found = replay(segment, start, scale)
    for k in range(segment.frames):
        inside = scale * frames[0].to_local_m(links[k + 1])
        np.testing.assert_allclose(found.link_m[k], start.to_world_m(inside), atol=1e-9)
        turn = frames[0].rotation.T @ frames[k + 1].rotation
        np.testing.assert_allclose(found.rotation[k], start.rotation @ turn, atol=1e-9)


def printed(segment: Segment, frames: list[Frame], start: Frame) -> Floats:
    """Eq. 6, 10, 11 as printed: M = R' R^T, R <- M R."""
    rotation, origin = start.rotation, start.origin_m
    for before, after, move in zip(frames[:-1], frames[1:], segment.move_m, strict=True):
        origin = origin + rotation @ move
        rotation = after.rotation @ before.rotation.T @ rotation
    return np.column_stack([rotation, origin])


def test_the_printed_world_rotation_holds_for_the_recorded_pose_and_goes_astray_from_another() -> (
    None
):
    segment, frames, _ = recorded(3)
    same = printed(segment, frames, frames[0])
    np.testing.assert_allclose(same[:, :3], frames[-1].rotation, atol=1e-9)
    start = posed(turned(np.array([0.3, 0.5, 1.0]), 2.0), np.zeros(3))
    ours = replay(segment, start).end
    astray = printed(segment, frames, start)
    assert np.abs(astray[:, :3] - ours.rotation).max() > 0.3
    assert np.linalg.norm(astray[:, 3] - ours.origin_m) > 0.5


def test_a_body_that_heads_another_way_on_a_slope_leaves_the_ground_with_the_printed_rotation() -> (
    None
):
    # a turn on the spot on a plane that leans: recorded uphill, replayed across
    lean = turned(np.array([0.0, 1.0, 0.0]), -0.4)
    frames = [posed(lean @ Frame.flat(0, 0, a).rotation, np.zeros(3)) for a in (0.0, 0.5, 1.0)]
    links = np.array([frame.to_world_m(np.eye(3)) for frame in frames])
    axes, joints = np.tile(np.eye(3), (3, 3, 1, 1)), np.zeros((3, 2))
    segment = cut("turn", "left", 0.1, frames, links, axes, joints[:-1], joints)
    other = turned(np.array([1.0, 0.0, 0.0]), 0.4)  # a plane that leans to the side
    normal = other[:, 2]
    assert replay(segment, posed(other, np.zeros(3))).end.rotation[:, 0] @ normal == pytest.approx(
        0
    )
    assert abs(printed(segment, frames, posed(other, np.zeros(3)))[:, 0] @ normal) > 0.1


def test_printed_y_is_shorter_than_one_where_up_leans_and_ours_is_not() -> None:
    link = np.array([[1.0, 0.0, 0.5], [0.0, 0.1, 0.0], [-1.0, -0.1, -0.5]])
    frame = body_frame(link)
    np.testing.assert_allclose(frame.rotation.T @ frame.rotation, np.eye(3), atol=1e-12)
    assert np.linalg.det(frame.rotation) == pytest.approx(1.0)
    bare = np.cross([0.0, 0.0, 1.0], frame.rotation[:, 0])
    assert np.linalg.norm(bare) < 0.95


def test_a_frame_needs_a_forward_and_a_left_axis() -> None:
    with pytest.raises(ValueError, match="no forward axis"):
        body_frame(np.zeros((3, 3)))
    with pytest.raises(ValueError, match="stands upright"):
        body_frame(np.array([[0, 0, 1.0], [0, 0, 0], [0, 0, -1.0]]))


def test_without_scaling_the_way_a_larger_body_makes_too_few_body_lengths() -> None:
    segment, _, _ = recorded(5)
    start = Frame.flat(0.0, 0.0, 0.4)
    one, two = replay(segment, start), replay(segment, start, 2.0)
    np.testing.assert_allclose(two.origin_m, 2.0 * one.origin_m, atol=1e-9)
    unscaled = start.rotation @ segment.move_m.sum(axis=0)
    assert np.linalg.norm(two.origin_m[-1]) > 1.5 * np.linalg.norm(one.origin_m[-1])
    assert not np.allclose(unscaled, two.origin_m[-1])


@given(way=st.floats(0.0, 3.0), largest=st.floats(0.01, 1.0))
@settings(max_examples=100)
def test_no_step_of_a_bridge_is_over_the_largest_and_one_frame_less_would_be(
    way: float, largest: float
) -> None:
    count = bridge_frames(way, largest)
    assert way / (count + 1) <= largest * (1 + 1e-6)
    assert count == 0 or way / count > largest * (1 - 1e-6)


def test_a_bridge_is_linear_and_leaves_out_its_ends() -> None:
    before, after = np.zeros((3, 3)), np.zeros((3, 3))
    after[-1] = [0.0, 1.0, 0.0]
    shapes = bridge(before, after, 0.3)
    assert len(shapes) == 3
    np.testing.assert_allclose(shapes[:, -1, 1], [0.25, 0.5, 0.75])
    with pytest.raises(ValueError, match="over 0"):
        bridge(before, after, 0.0)


def test_between_recorded_actions_the_tail_never_goes_too_far(repertoire: Repertoire) -> None:
    segments = repertoire.segments
    largest = 0.01
    found = replay_all([segments[1], segments[3], segments[0]], Frame.flat(1, 2, 0.3), 1.0, largest)
    expected = sum(
        bridge_frames(tip_travel_m(a.link_m[-1], b.link_m[0]), largest)
        for a, b in ((segments[1], segments[3]), (segments[3], segments[0]))
    )
    assert expected > 5
    frames = sum(segments[k].frames for k in (1, 3, 0))
    assert len(found.link_m) == frames + expected
    inside = np.einsum("tji,tlj->tli", found.rotation, found.link_m - found.origin_m[:, None])
    at = segments[1].frames
    steps = np.linalg.norm(np.diff(inside[at - 1 : at + 5, -1], axis=0), axis=1)
    assert (steps <= largest + 1e-9).all()


def test_what_was_recorded_is_one_settled_cycle(repertoire: Repertoire) -> None:
    for segment in repertoire.segments:
        if segment.kind != "brake":
            assert segment.closure_m < 1e-3, segment.name
            assert segment.closure_rad < 2e-3, segment.name
        np.testing.assert_allclose(segment.link_m.mean(axis=1), 0.0, atol=1e-9)
        # axes of the links lead from one link to the next
        half = 0.035 * segment.link_rotation[..., 0]
        gap = segment.link_m[:, :-1] - half[:, :-1] - segment.link_m[:, 1:] - half[:, 1:]
        assert np.abs(gap).max() < 1e-9
    turn = {s.name: s.turn_rad_s * s.duration_s for s in repertoire.segments}
    assert abs(turn["forward-fast"]) < 0.01
    assert turn["left-sharp"] > 1.5 * turn["left-gentle"] > 0.3
    for how in ("gentle", "sharp"):
        assert turn[f"right-{how}"] == pytest.approx(-turn[f"left-{how}"], abs=0.01)


def test_a_file_gives_back_what_was_saved(repertoire: Repertoire, tmp_path: Path) -> None:
    repertoire.save(tmp_path / "r.npz")
    back = load_repertoire(tmp_path / "r.npz")
    assert (back.robot, back.world, back.length_m) == ("yaw16", "flat", repertoire.length_m)
    assert back.law == repertoire.law == "ellipse"
    for one, two in zip(back.segments, repertoire.segments, strict=True):
        assert (one.name, one.kind, one.closure_m) == (two.name, two.kind, two.closure_m)
        np.testing.assert_array_equal(one.turn, two.turn)
        np.testing.assert_array_equal(one.goal_rad, two.goal_rad)


def test_an_older_file_states_no_law(repertoire: Repertoire, tmp_path: Path) -> None:
    repertoire.save(tmp_path / "r.npz")
    with np.load(tmp_path / "r.npz") as held:
        arrays = dict(held)
    about = json.loads(str(arrays["about"]))
    del about["law"]
    arrays["about"] = np.array(json.dumps(about))
    np.savez(tmp_path / "old.npz", **arrays)
    assert load_repertoire(tmp_path / "old.npz").law == "not stated"


def test_other_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        load_repertoire(tmp_path / "none.npz")
    (tmp_path / "text.npz").write_text("nothing")
    np.savez(tmp_path / "other.npz", a=np.zeros(3))
    for name in ("text.npz", "other.npz"):
        with pytest.raises(InputError, match="not a repertoire"):
            load_repertoire(tmp_path / name)
