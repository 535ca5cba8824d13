"""Rollouts: what they predict of bodies whose motion is known in closed form or by the forecast."""

import numpy as np
import pytest
from numba import njit

from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load_robot
from snakewalk.config.robot import LinkConfig
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.retarget import Retarget
from snakewalk.controller.mechanics import rigid_motion, rollout_kernel
from snakewalk.controller.mechanics import rollout as rollout_module
from snakewalk.controller.mechanics.rigid_motion import rigid_velocity
from snakewalk.controller.mechanics.rollout import (
    STEP_SEGMENTS,
    Drift,
    PlanarPose,
    Rolled,
    Rollout,
    TabulatedPath,
)
from snakewalk.controller.mechanics.rollout_kernel import (
    PATH_STEP_M,
    _sine_cosine,
)
from tests.helpers.uneven import spelt_out

SNAKE = FrictionConfig(along=0.1, across=0.7)
ROBOT = load_robot("yaw16")
LINK_KG = ROBOT.mean_link_mass_kg
STRAIGHT = TabulatedPath.of(np.arange(0.0, 6.0, PATH_STEP_M)[:, None] * np.array([1.0, 0.0]))
START = PlanarPose(np.zeros(2), 0.0)


def plane(slope_x: float, slope_y: float) -> HeightField:
    """A plane of 20 m square, raised ``slope`` m per metre."""
    at = np.linspace(-10.0, 10.0, 41)
    return HeightField(slope_x * at[None, :] + slope_y * at[:, None], 0.5, -10.0, -10.0)


def sine(start: int, count: int, amplitude: float = 0.7) -> np.ndarray:
    return amplitude * np.sin(2.0 * np.pi * 1.2 * np.arange(start, start + count) / 100)


def roll(
    rollout: Rollout,
    pieces: np.ndarray,
    samples: np.ndarray | None = None,
    drift: Drift | None = None,
    start: PlanarPose = START,
) -> Rolled:
    known = sine(0, 102) if samples is None else samples
    tree = rollout.begin(known, 101.0, start, STRAIGHT, 0, 25.0, drift or Drift())
    return tree.roll(pieces)


def rollout(ground: HeightField | None = None, friction: FrictionConfig = SNAKE) -> Rollout:
    return Rollout(ROBOT, friction, ground, 100)


def test_a_waypoint_that_is_passed_is_as_far_as_the_body_came_near() -> None:
    """A wave along x passes at the distance of the waypoint from that line; ahead it counts not."""
    line = np.arange(0.0, 6.0, PATH_STEP_M)[:, None] * np.array([1.0, 0.0])
    tree_of = rollout().begin
    for at_m, passed in ((0.2, True), (3.0, False)):
        path = TabulatedPath.of(line, np.array([at_m, 0.5]), at_m / PATH_STEP_M)
        tree = tree_of(sine(0, 102), 101.0, START, path, 0, 25.0, Drift())
        made = tree.roll(sine(102, 60)[None])
        assert float(made.along_m[0]) > 0.25
        if passed:
            np.testing.assert_allclose(made.passed_m, 0.5, atol=0.05)
        else:
            np.testing.assert_array_equal(made.passed_m, 0.0)


def test_sines_and_cosines_have_the_same_bits_many_at_a_time_as_alone() -> None:
    angles = np.random.default_rng(0).uniform(-300.0, 300.0, 4096)
    angles[:6] = 0.0, 0.5 * np.pi, np.pi, -0.5 * np.pi, 0.25 * np.pi, -np.pi

    @njit
    def many(x: np.ndarray, out: np.ndarray) -> None:
        for k in range(len(x)):
            out[k, 0], out[k, 1] = _sine_cosine(x[k])

    together = np.empty((len(angles), 2))
    many(angles, together)
    alone = np.array([_sine_cosine.py_func(float(x)) for x in angles])
    np.testing.assert_array_equal(together, alone)
    np.testing.assert_allclose(together[:, 0], np.sin(angles), atol=2.3e-16)
    np.testing.assert_allclose(together[:, 1], np.cos(angles), atol=2.3e-16)


def test_the_loops_as_they_are_written_give_the_same_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    pieces = np.stack([sine(102, 12), sine(102, 12) + 0.02 * np.arange(12)])
    compiled = roll(rollout(plane(0.2, 0.1)), pieces)
    for module in (rollout_module, rollout_kernel, rigid_motion):
        for name, each in vars(module).items():
            if hasattr(each, "py_func"):
                monkeypatch.setattr(module, name, each.py_func)
    written = roll(rollout(plane(0.2, 0.1)), pieces)
    np.testing.assert_array_equal(compiled.columns, written.columns)


def test_a_straight_body_goes_nowhere() -> None:
    made = roll(rollout(), np.zeros((1, 50)), np.zeros(102))
    np.testing.assert_allclose(made.centre_m, 0.0, atol=1e-9)
    np.testing.assert_allclose(made.along_m, 0.0, atol=1e-9)


def test_it_is_the_force_balance_of_single_steps_added_up() -> None:
    piece = sine(102, 60)
    whole = np.concatenate([sine(0, 102), piece])
    retarget = Retarget(ROBOT, 100)

    def laid(head: float) -> tuple[np.ndarray, np.ndarray]:
        at = head - np.arange(1, 101)
        fine = np.interp(at, np.arange(len(whole)), whole)
        heading = retarget.group_headings_rad(fine)[retarget.group_of_link]
        step = np.stack([np.cos(heading), np.sin(heading)], axis=1) * ROBOT.mean_link_length_m
        points = 0.5 * step - np.cumsum(step, axis=0)
        return points - points.mean(axis=0), heading

    centre, phi, velocity = np.zeros(2), 0.0, np.zeros(3)
    for head in range(101, 162):
        (p0, h0), (p1, h1) = laid(head), laid(head + 1)
        c, s = np.cos(phi), np.sin(phi)
        turn = np.array([[c, -s], [s, c]])
        velocity = rigid_velocity(
            0.5 * (p0 + p1) @ turn.T, phi + 0.5 * (h0 + h1), (p1 - p0) @ turn.T * 25.0,
            SNAKE, velocity,
        )  # fmt: skip
        centre, phi = centre + velocity[:2] / 25.0, phi + velocity[2] / 25.0
    made = roll(rollout(), piece[None])
    np.testing.assert_allclose(made.centre_m[0], centre, atol=4e-3)
    assert made.offset_rad[0] == pytest.approx(phi, abs=8e-3)
    assert made.along_m[0] > 0.3


def test_pieces_do_not_influence_each_other_and_rolling_twice_is_the_same() -> None:
    pieces = np.stack([sine(102, 80), sine(102, 80) + 0.01 * np.arange(80), np.zeros(80)])
    together = roll(rollout(plane(0.05, 0.1)), pieces)
    for k in range(3):
        alone = roll(rollout(plane(0.05, 0.1)), pieces[k : k + 1])
        assert alone.centre_m[0].tobytes() == together.centre_m[k].tobytes()
        assert alone.heading_rad[0] == together.heading_rad[k]


@pytest.mark.parametrize("slope", [0.0, 0.1, 0.8])  # on the last a body slides with inertia
def test_pieces_that_begin_alike_are_rolled_out_apart_as_each_alone(slope: float) -> None:
    ground, start = rollout(plane(slope, 0.3 * slope)), (101.0, START, STRAIGHT, 0, 25.0, Drift())
    rng, pieces = np.random.default_rng(1), [sine(102, 80)]
    for _ in range(14):  # a tree of pieces: each leaves an earlier one somewhere
        piece, at = pieces[rng.integers(len(pieces))].copy(), rng.integers(80)
        piece[at:] += rng.uniform(-0.01, 0.01) * np.arange(80 - at)
        pieces.append(piece)
    pieces.append(pieces[3])
    together = ground.begin(sine(0, 102), *start)
    for batch in np.split(np.array(pieces), 4):
        rolled = together.roll(batch)
        for k, piece in enumerate(batch):
            alone = ground.begin(sine(0, 102), *start).roll(piece[None])
            assert alone.columns[0].tobytes() == rolled.columns[k].tobytes()


def test_a_side_slope_carries_the_body_down_and_a_climb_slows_it() -> None:
    piece = sine(102, 100)[None]
    level = roll(rollout(plane(0.0, 0.0)), piece)
    left_is_up = roll(rollout(plane(0.0, 0.15)), piece)
    left_is_down = roll(rollout(plane(0.0, -0.15)), piece)
    uphill, downhill = roll(rollout(plane(0.1, 0.0)), piece), roll(rollout(plane(-0.1, 0.0)), piece)
    assert left_is_up.centre_m[0, 1] < level.centre_m[0, 1] - 0.02
    assert left_is_down.centre_m[0, 1] > level.centre_m[0, 1] + 0.02
    assert uphill.along_m[0] < level.along_m[0] - 0.05 < downhill.along_m[0]
    assert roll(rollout(), piece).centre_m.tobytes() == level.centre_m.tobytes()


def test_turning_body_and_slope_together_turns_the_prediction() -> None:
    piece, turn = sine(102, 80)[None], 0.7
    a = roll(rollout(plane(0.12, 0.0)), piece)
    c, s = np.cos(turn), np.sin(turn)
    b = roll(rollout(plane(0.12 * c, 0.12 * s)), piece, start=PlanarPose(np.zeros(2), turn))
    np.testing.assert_allclose(
        b.centre_m[0], np.array([[c, -s], [s, c]]) @ a.centre_m[0], atol=1e-7
    )
    assert b.offset_rad[0] - a.offset_rad[0] == pytest.approx(turn, abs=1e-7)


def test_where_nothing_holds_the_body_slides_with_its_inertia() -> None:
    """Straight down a slope of 0.3 on friction of 0.1: g sin - mu g cos, from rest."""
    still = np.zeros((1, 50))
    made = roll(rollout(plane(-0.3, 0.0)), still, np.zeros(102))
    time = made.time_s[0]
    cos = 1.0 / np.hypot(1.0, 0.3)
    fall = 0.5 * 9.81 * (0.3 * cos - 0.1 * cos) * time**2
    # implicit steps: half a step more than the continuous fall
    step = time / round(time * 25.0 / STEP_SEGMENTS)
    assert made.centre_m[0, 0] == pytest.approx(fall * (1.0 + step / time), rel=0.01)


def test_a_drift_is_added_per_pulse_and_turns_with_the_body() -> None:
    piece = np.zeros((1, 50))
    made = roll(rollout(), piece, np.zeros(102), Drift(ahead_m=0.002, left_m=0.001))
    np.testing.assert_allclose(made.centre_m[0], [51 * 0.002, 51 * 0.001], atol=1e-9)
    assert made.off_path_m[0] > 0.0
    turned = roll(rollout(), piece, np.zeros(102), Drift(turn_rad=0.01))
    assert turned.offset_rad[0] == pytest.approx(0.51)


def test_joints_at_their_speed_limit_take_longer() -> None:
    gentle, sharp = sine(102, 100)[None], sine(102, 100)[None].copy()
    sharp[0, 40:] += 1.5
    slow = roll(rollout(), sharp)
    assert roll(rollout(), gentle).time_s[0] == pytest.approx(101 / 25.0)
    assert slow.time_s[0] > 101 / 25.0


def test_a_path_goes_on_straight_beyond_its_end() -> None:
    bent = np.stack([np.cos(np.linspace(0, 1, 101)), np.sin(np.linspace(0, 1, 101))], axis=1)
    table = TabulatedPath.of(bent).points_m
    assert table.flags.c_contiguous
    steps = np.diff(table[100:], axis=0)
    np.testing.assert_allclose(np.hypot(*steps.T), PATH_STEP_M)
    np.testing.assert_allclose(steps / PATH_STEP_M, np.tile(steps[:1] / PATH_STEP_M, (400, 1)))


def test_links_spelt_out_roll_the_same_to_the_digit() -> None:
    slope = plane(0.1, 0.05)
    one, other = (
        roll(Rollout(robot, SNAKE, slope, 100), sine(102, 40)[None])
        for robot in (ROBOT, spelt_out(ROBOT))
    )
    np.testing.assert_array_equal(one.centre_m, other.centre_m)
    np.testing.assert_array_equal(one.offset_rad, other.offset_rad)


def test_a_link_that_weighs_nothing_does_not_slow_the_others() -> None:
    """A last link of a hundredth of the weight: the body goes as one that has no such link."""
    light = ROBOT.model_copy(
        update={"links": (*(LinkConfig(),) * 16, LinkConfig(mass_kg=0.01 * LINK_KG))}
    )
    heavy = ROBOT.model_copy(
        update={"links": (*(LinkConfig(),) * 16, LinkConfig(mass_kg=30.0 * LINK_KG))}
    )
    gone = [
        float(roll(Rollout(robot, SNAKE, None, 100), sine(102, 60)[None]).along_m[0])
        for robot in (light, ROBOT, heavy)
    ]
    assert gone[0] > gone[1] - 0.02
    assert gone[2] < 0.8 * gone[1]  # an anchor


def test_with_another_friction_it_rolls_out_as_one_that_was_made_with_it() -> None:
    slick = FrictionConfig(along=0.2, across=0.4)
    changed = rollout(plane(0.1, 0.05))
    before = roll(changed, sine(102, 60)[None])
    changed.use_friction(slick)
    after = roll(changed, sine(102, 60)[None])
    made = roll(rollout(plane(0.1, 0.05), slick), sine(102, 60)[None])
    np.testing.assert_array_equal(after.centre_m, made.centre_m)
    assert np.hypot(*(after.centre_m - before.centre_m)[0]) > 0.01
