"""Segments, merging, joining and synthesis, each with the printed reading that fails."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.controller.animals.fish.fish_film import Stroke, swim
from snakewalk.controller.animals.fish.piece_graph import Piece, PieceGraph, piece_graph, placed
from snakewalk.controller.animals.fish.postures import Postures, postures_of_track
from snakewalk.controller.animals.fish.segments import (
    MotionSegment,
    Segmentation,
    basic_frames,
    commonest_posture,
    merge,
    segment_motion,
    speeds,
    turned,
)
from snakewalk.controller.animals.fish.synthesis import (
    compose,
    fading,
    join,
    joint_motion,
    joint_pieces,
    junctions,
    random_sequence,
    sequence_through,
)
from snakewalk.controller.kinematics.retarget import Retarget
from snakewalk.controller.track.readers.load import load_track

TRUTH = swim()
LIMIT = np.radians(20.0)


def beat(turn_deg: float, start: int, stop: int) -> MotionSegment:
    turn = float(np.radians(turn_deg))
    kind = "forward" if abs(turn) < LIMIT else ("left" if turn > 0 else "right")
    return MotionSegment(kind, start, stop, turn, 1.0, 1.0)


def printed_merge(a: MotionSegment, b: MotionSegment) -> bool:
    """[TH] 4.1.3: only the first and the last direction are compared."""
    return abs(a.turn_rad + b.turn_rad) < LIMIT


def test_a_climb_counts_in_the_speed_where_it_was_seen() -> None:
    """3 m/s along, 4 m/s up: 5 m/s; from above alone it looked like 3."""
    time_s = np.arange(30) / 25.0
    level = Postures(
        base=np.stack([3.0 * time_s, np.zeros(30)], axis=1),
        head_rad=np.zeros(30),
        angles_rad=np.zeros((30, 2)),
        joints_at=(0.3, 0.6),
        rate_hz=25.0,
    )
    np.testing.assert_allclose(speeds(level), 3.0)
    np.testing.assert_allclose(speeds(replace(level, height=4.0 * time_s)), 5.0)
    lost = np.where(np.arange(30) == 10, np.nan, 4.0 * time_s)
    np.testing.assert_allclose(speeds(replace(level, height=lost)), 5.0)


def test_a_script_is_cut_into_its_strokes() -> None:
    kinds = [s.kind for s in segment_motion(TRUTH)]
    assert kinds.count("left") == 2
    assert kinds.count("right") == 2
    assert kinds.count("forward") == 5
    assert kinds[0] == kinds[-1] == "glide"
    for s in segment_motion(TRUTH):
        ends = np.degrees(np.abs(TRUTH.angles_rad[[s.start, s.stop]]))
        assert ends.max() <= 4.0


def test_a_left_and_a_right_turn_are_not_one_forward_beat() -> None:
    left, right = beat(60.0, 0, 10), beat(-55.0, 10, 20)
    assert printed_merge(left, right)  # as printed they are one
    assert merge([left, right], LIMIT) == [left, right]


def test_small_beats_are_merged_until_together_they_turn() -> None:
    beats = [beat(8.0, 10 * k, 10 * k + 10) for k in range(4)]
    merged = merge(beats, LIMIT)
    assert [s.parts for s in merged] == [2, 2]  # 8 and 8 are under 20; three are not
    apart = [beat(3.0, 0, 10), beat(3.0, 14, 24)]
    assert merge(apart, LIMIT) == apart  # a glide lies between


def test_directions_are_compared_wrapped() -> None:
    """A fish that swims towards -x: its direction crosses the cut at pi."""
    head = np.radians([178.0, 179.5, -179.0, -178.0])
    assert abs(head[-1] - head[0]) > np.radians(300.0)  # the printed difference: a turn
    assert np.degrees(turned(head)) == pytest.approx(4.0)
    away = replace(TRUTH, head_rad=np.angle(np.exp(1j * (TRUTH.head_rad + np.pi))))
    assert [s.kind for s in segment_motion(away)] == [s.kind for s in segment_motion(TRUTH)]


def test_missing_frames_end_a_segment() -> None:
    holed = TRUTH.angles_rad.copy()
    holed[52] = np.nan
    lost = replace(
        TRUTH, angles_rad=holed, head_rad=np.where(np.isnan(holed[:, 0]), np.nan, TRUTH.head_rad)
    )
    spans = [(s.start, s.stop) for s in segment_motion(lost)]
    assert not any(start <= 52 <= stop for start, stop in spans)
    assert len(spans) < len(segment_motion(TRUTH))


def test_an_animal_that_is_never_straight_is_refused_with_what_helps() -> None:
    bent = replace(TRUTH, angles_rad=TRUTH.angles_rad + 0.9)
    with pytest.raises(InputError, match="--reference commonest"):
        segment_motion(bent)
    posture = commonest_posture(bent.angles_rad, np.radians(4.0))
    assert [s.kind for s in segment_motion(bent, None, posture)]


def piece(begin: float, end: float, way: float = 1.0, turn: float = 0.0) -> Piece:
    s = np.linspace(0.0, 1.0, 11)
    head = turn * s
    step = np.column_stack([np.cos(head), np.sin(head)])[:-1] * way / 10
    base = np.vstack([np.zeros(2), np.cumsum(step, axis=0)])
    return Piece("forward", base, head, np.zeros((11, 4)), begin, end, "made")


def pieces(*made: Piece) -> PieceGraph:
    return PieceGraph(made, TRUTH.joints_at, 10.0, None)


def test_where_nothing_is_permitted_drawing_never_ends_and_ours_does() -> None:
    """[TH] 4.2.2 draws from all segments until a permitted one comes up."""
    stuck = pieces(piece(0.1, 2.9))  # ends in the fast class, and only the slow one begins
    rng = np.random.default_rng(0)
    draws = [int(rng.integers(1)) in stuck.permitted(0) for _ in range(10_000)]
    assert not any(draws)
    made = random_sequence(stuck, 5.0, rng)
    assert len(made.order) == 5
    assert made.forced == 4


def test_dead_ends_are_avoided_while_there_is_another_way() -> None:
    lively = pieces(piece(0.1, 0.1), piece(0.1, 2.9))  # the second leads nowhere
    assert lively.permitted(0) == [0, 1]
    assert lively.lasting == {0}
    made = random_sequence(lively, 20.0, np.random.default_rng(1))
    assert set(made.order) == {0}
    assert made.forced == 0


@settings(max_examples=20)
@given(st.integers(0, 10_000))
def test_every_join_is_within_one_class_and_seeds_repeat(seed: int) -> None:
    stock = piece_graph(TRUTH, segment_motion(TRUTH))
    made = random_sequence(stock, 10.0, np.random.default_rng(seed))
    assert made == random_sequence(stock, 10.0, np.random.default_rng(seed))
    top = max(max(p.begin_speed, p.end_speed) for p in stock.pieces)
    for a, b in pairwise(made.order):
        ends = [stock.pieces[a].end_speed, stock.pieces[b].begin_speed]
        assert int(min(ends[0] / top * 3, 2.999)) == int(min(ends[1] / top * 3, 2.999))
    assert made.forced == 0


POINTS = np.array([[3.0, 0.0], [5.0, 3.0], [2.0, 5.0], [-2.0, 2.0]])


@pytest.mark.slow
def test_control_points_are_passed_in_order() -> None:
    stock = piece_graph(TRUTH, segment_motion(TRUTH), mirror=True)
    made = sequence_through(stock, POINTS, radius=0.5)
    way = compose(stock, made).base
    at = [round(t * TRUTH.rate_hz) for t in made.reached_s]
    assert at == sorted(at)
    for k, point in zip(at, POINTS, strict=True):
        assert np.hypot(*(way[k] - point)) < 0.7  # the blend moves the way a little


def test_height_goes_on_from_piece_to_piece_and_pitch_is_blended() -> None:
    stock = piece_graph(TRUTH, segment_motion(TRUTH), mirror=True)
    made = random_sequence(stock, 30.0, np.random.default_rng(3))
    motion = compose(stock, made)
    assert TRUTH.height is not None
    assert TRUTH.pitch_rad is not None
    assert motion.height is not None
    assert motion.pitch_rad is not None
    first = segment_motion(TRUTH)[made.order[0] % (len(stock.pieces) // 2)]
    part = slice(first.start, first.stop + 1)
    np.testing.assert_allclose(
        motion.height[: first.stop - first.start + 1],
        TRUTH.height[part] - TRUTH.height[first.start],
        atol=1e-12,
    )
    fastest = np.abs(np.diff(TRUTH.height)).max()
    assert np.abs(np.diff(motion.height)).max() < 2.0 * fastest
    assert np.abs(np.diff(motion.pitch_rad)).max() < 0.1
    assert np.ptp(motion.pitch_rad) > 0.5 * np.ptp(TRUTH.pitch_rad)


def test_moments_lost_by_the_side_view_are_bridged_and_without_one_there_is_no_height() -> None:
    assert TRUTH.height is not None
    gaps = TRUTH.height.copy()
    gaps[::7] = np.nan
    stock = piece_graph(replace(TRUTH, height=gaps), segment_motion(TRUTH))
    assert all(np.isfinite(piece.rise).all() for piece in stock.pieces if piece.rise is not None)
    assert stock.pieces[0].rise is not None
    flat = piece_graph(replace(TRUTH, height=None, pitch_rad=None), segment_motion(TRUTH))
    made = random_sequence(flat, 5.0, np.random.default_rng(0))
    assert compose(flat, made).height is None
    with pytest.raises(InputError, match="with --side"):
        sequence_through(flat, np.array([[3.0, 0.0, 0.2]]), radius=0.5)


@pytest.mark.costs("searches a path")
def test_control_points_in_space_are_passed_at_their_height() -> None:
    stock = piece_graph(TRUTH, segment_motion(TRUTH), mirror=True)
    for height in (0.4, -0.4):
        points = np.array([[3.0, 1.0, height], [5.0, 3.0, 0.0]])
        made = sequence_through(stock, points, radius=0.4)
        motion = compose(stock, made)
        assert motion.height is not None
        at = round(made.reached_s[0] * TRUTH.rate_hz)
        there = np.array([*motion.base[at], motion.height[at]])
        assert np.linalg.norm(there - points[0]) < 0.6  # the blend moves the way a little
        assert motion.height[at] * height > 0.0


def test_the_printed_choice_circles_a_point_that_looking_ahead_reaches() -> None:
    """[TH] 5 takes the segment that ends nearest, one at a time."""
    stock = pieces(piece(1, 1, 1.0, 1.0), piece(1, 1, 1.0, -1.0), piece(1, 1, 1.7, 0.0))
    missed = 0
    for angle in np.linspace(0.5, 2.9, 9):
        point = 2.2 * np.array([[np.cos(angle), np.sin(angle)]])
        sequence_through(stock, point, radius=0.3, limit_s=60.0)
        try:
            sequence_through(stock, point, radius=0.3, limit_s=60.0, depth=1)
        except InputError:
            missed += 1
    assert missed >= 1


def test_a_point_out_of_reach_is_said_to_be() -> None:
    ahead_only = pieces(piece(1, 1))
    with pytest.raises(InputError, match=r"control point 1 at -3,0 .* turn from 0 to 0 degrees"):
        sequence_through(ahead_only, np.array([[-3.0, 0.0]]), radius=0.3, limit_s=20.0)


def test_straight_ends_still_step_eight_degrees_and_the_blend_takes_it_away() -> None:
    robot = Retarget(load_robot("yaw16"))
    four = np.radians(4.0)
    one = replace(piece(1, 1), angles_rad=np.tile([four, -four, four, -four], (11, 1)))
    other = replace(piece(1, 1), angles_rad=-one.angles_rad)
    stock = pieces(one, other)
    order = random_sequence(stock, 8.0, np.random.default_rng(3))
    spine = np.concatenate([stock.pieces[k].angles_rad for k in order.order])
    assert np.degrees(np.abs(np.diff(spine, axis=0)).max()) == pytest.approx(8.0)  # as printed
    fine = replace(stock, rate_hz=100.0)
    joined = joint_motion(fine, order, robot, 0.5)
    parts = joint_pieces(fine, order, robot)
    printed = max(np.abs(b[0] - a[-1]).max() for a, b in pairwise(parts))
    assert np.abs(np.diff(joined, axis=0)).max() < 0.06 * printed


def test_a_blend_is_continuous_in_value_and_slope_and_gone_at_its_end() -> None:
    step, slope = np.array([0.3, -0.1]), np.array([2.0, 0.5])
    t = np.array([0.0, 1e-6, 0.5 - 1e-6, 0.5, 0.9])
    d = fading(step, slope, 0.5, t)
    np.testing.assert_allclose(d[0], step)
    np.testing.assert_allclose((d[1] - d[0]) / 1e-6, slope, rtol=1e-4)
    np.testing.assert_allclose(d[2:], 0.0, atol=1e-9)


def test_joining_what_fits_changes_nothing_and_blending_commutes_with_the_joints() -> None:
    wave = np.sin(np.linspace(0.0, 3.0, 31))[:, None] * [1.0, -0.5]
    line = np.arange(31.0)[:, None] * [0.1, 0.2]
    np.testing.assert_array_equal(join([line[:11], line[10:]], 5), line)
    assert join([wave[:11], wave[10:]], 5) == pytest.approx(wave, abs=0.02)
    stock = piece_graph(TRUTH, segment_motion(TRUTH))
    order = random_sequence(stock, 6.0, np.random.default_rng(2))
    robot = Retarget(load_robot("yaw16"))
    motion = compose(stock, order)
    np.testing.assert_allclose(
        joint_motion(stock, order, robot), robot.joints_rad(motion.tangents_rad()), atol=1e-9
    )
    assert len(junctions(stock, order)) == len(order.order) - 1
    with pytest.raises(ValueError, match="two or more samples"):
        join([wave[:1]], 3)


def test_a_placed_piece_is_turned_to_the_left_by_its_angle() -> None:
    np.testing.assert_allclose(
        placed(np.array([[1.0, 0.0]]), np.array([2.0, 3.0]), np.pi / 2), [[2.0, 4.0]], atol=1e-12
    )


def test_a_filmed_turn_to_one_side_serves_both_when_mirrored() -> None:
    left = swim((Stroke("glide", 0.3), Stroke("turn", 0.6, 1.0), Stroke("glide", 0.3)))
    stock = piece_graph(left, segment_motion(left), mirror=True)
    turns = [float(p.head_rad[-1]) for p in stock.pieces]
    assert min(turns) == pytest.approx(-max(turns))
    assert max(turns) > 0.8


@pytest.mark.parametrize(
    "name", ["lamprey/lampreydata.csv", "prickleback/XMUC02_Trial1_sleap-1.csv"]
)
def test_real_eels_are_never_straight_and_are_cut_at_their_commonest_posture(
    shared_data, name: str
) -> None:  # type: ignore[no-untyped-def]
    from snakewalk.controller.animals.fish.model import fish_model

    track = load_track(str(shared_data / name))
    found: Postures = postures_of_track(track, fish_model("eel").joints_at)
    within = np.radians(12.0)
    assert not basic_frames(found.angles_rad, np.zeros(8), within).any()
    posture = commonest_posture(found.angles_rad, within)
    stock = piece_graph(found, segment_motion(found, Segmentation(within_rad=within), posture))
    made = random_sequence(stock, 20.0, np.random.default_rng(0))
    motion = compose(stock, made)
    assert motion.frames / motion.rate_hz >= 20.0
    assert np.isfinite(motion.points()).all()
