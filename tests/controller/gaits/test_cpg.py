"""The pattern generator: it comes into step, takes any gait, and changes gait without a jump."""

import itertools

import numpy as np
import pytest
from numpy.typing import NDArray

from snakewalk.config.loader import load_robot
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.gaits.cpg.oscillators import Cpg
from snakewalk.controller.gaits.cpg.pattern import Pattern
from snakewalk.controller.gaits.gait import Gait, Needs
from snakewalk.controller.gaits.lateral_undulation import LateralUndulation
from snakewalk.controller.gaits.registry import GAITS
from snakewalk.controller.motion.cpg_motion import CpgMotion
from snakewalk.controller.motion.gait_cycle import GaitCycle

Floats = NDArray[np.float64]
ROBOT = load_robot("alternating16")
NAMES = tuple(name for name, gait in GAITS.items() if not gait.needs.legs)
DT_S = 0.02
PHASES = np.linspace(0.0, 2.0 * np.pi, 721)
CHANGES = tuple(itertools.pairwise((*NAMES, NAMES[0], NAMES[5], NAMES[7], NAMES[3], NAMES[0])))


def settled(gait: Gait, rng: np.random.Generator | None = None) -> Cpg:
    cpg = Cpg(np.zeros(16))
    cpg.set_pattern(Pattern.of(gait, ROBOT, 3.0), gain=6.0)
    if rng is not None:
        cpg.phase_error_rad = rng.uniform(-np.pi, np.pi, 16)
    for _ in range(round(20.0 / DT_S)):
        cpg.step(DT_S)
    return cpg


class InPhase(Gait):
    """All yaw joints bend together, so each pose except two occurs twice in a cycle."""

    name = "in-phase"
    title = "all yaw joints bend together"
    source = "(ours)"
    needs = Needs(yaw=True)

    def _shape_rad(self, robot: RobotConfig, phase_rad: Floats) -> Floats:
        joints = np.zeros((len(phase_rad), robot.joint_count))
        joints[:, robot.yaw_joints] = 0.3 * np.sin(phase_rad)[:, None]
        return joints


@pytest.mark.parametrize("kind", [*(GAITS[name] for name in NAMES), InPhase], ids=lambda k: k.name)
def test_it_runs_any_gait_as_that_gait_is(kind: type[Gait]) -> None:
    """After it has settled, the gait has each pose at a phase at which it has the speed, too."""
    gait = kind()
    cpg = settled(gait)
    cycle = gait.joints_rad(ROBOT, PHASES)
    before, after = (gait.joints_rad(ROBOT, PHASES + step) for step in (-1e-3, 1e-3))
    speeds = (after - before) / 2e-3 * 3.0
    for _ in range(5):
        pose = cpg.step(0.31)
        is_there = np.abs(cycle - pose).max(axis=1) < 0.01
        assert is_there.any()
        wrong = np.abs(speeds[is_there] - cpg.velocity_rad_s()).max(axis=1)
        assert wrong.min() < 0.15


def test_it_comes_into_step_from_any_phases() -> None:
    rng = np.random.default_rng(7)
    gait = LateralUndulation()
    cycle = gait.joints_rad(ROBOT, PHASES)
    for _ in range(5):
        cpg = settled(gait, rng)
        differences = np.mod(np.diff(cpg.phase_error_rad) + np.pi, 2.0 * np.pi) - np.pi
        assert np.abs(differences).max() < 1e-3
        assert np.abs(cycle - cpg.angle_rad()).max(axis=1).min() < 0.01


def test_it_comes_into_step_at_the_rate_of_the_chains_slowest_mode() -> None:
    """``2 w (1 - cos(pi / n))``: the smallest eigenvalue of a chain's coupling."""
    cpg = Cpg(np.zeros(16))
    mode = np.cos(np.pi * (np.arange(16) + 0.5) / 16)
    cpg.phase_error_rad = 1e-3 * mode
    for _ in range(100):
        cpg.step(DT_S)
    rate = 2.0 * 20.0 * (1.0 - np.cos(np.pi / 16))
    np.testing.assert_allclose(cpg.phase_error_rad, 1e-3 * mode * np.exp(-2.0 * rate), rtol=1e-4)


def test_angle_and_speed_do_not_jump_where_the_pattern_changes() -> None:
    """C1, whenever and into whatever: speeds before and after agree, and the angles follow."""
    rng = np.random.default_rng(3)
    cpg = Cpg(rng.uniform(-0.5, 0.5, 16))
    for name in rng.permutation(NAMES):
        angle, speed = cpg.angle_rad(), cpg.velocity_rad_s()
        gain = float(rng.uniform(1.0, 10.0))
        cpg.set_pattern(Pattern.of(GAITS[name](), ROBOT, rng.uniform(0.5, 6.0)), gain)
        np.testing.assert_allclose(cpg.angle_rad(), angle, atol=1e-9)
        np.testing.assert_allclose(cpg.velocity_rad_s(), speed, atol=1e-8)
        for _ in range(int(rng.integers(3, 60))):
            before, rate = cpg.angle_rad(), cpg.velocity_rad_s()
            after = cpg.step(1e-4)
            middle = 0.5 * (rate + cpg.velocity_rad_s())
            np.testing.assert_allclose((after - before) / 1e-4, middle, atol=2e-4)
            cpg.step(DT_S)


@pytest.mark.parametrize(("one", "other"), CHANGES)
def test_changes_keep_to_the_robots_limits(one: str, other: str) -> None:
    """Measured on the targets as they are sent, from rest to rest."""
    motion = CpgMotion(ROBOT, np.zeros(16))
    goals = [motion.goal_rad()]
    for name in (one, other):
        taken_s = motion.become(GAITS[name]())
        assert taken_s < 40.0
        goals += [motion.step(DT_S, None) for _ in range(int(taken_s / DT_S) + 10)]  # type: ignore[arg-type]
    taken_s = motion.stop()
    goals += [motion.step(DT_S, None) for _ in range(int(taken_s / DT_S) + 10)]  # type: ignore[arg-type]
    assert motion.done
    speed = np.diff(np.array(goals), axis=0) / DT_S
    hard = np.diff(speed, axis=0) / DT_S
    assert np.abs(speed).max() < 1.03 * ROBOT.joint_speed_limit_rad_s
    assert np.abs(hard).max() < 1.05 * ROBOT.joint_acceleration_limit_rad_s2


def test_a_disturbed_pattern_returns_to_the_gait() -> None:
    motion = CpgMotion(ROBOT, np.zeros(16))
    gait = GAITS["sidewinding"]()
    motion.become(gait)
    for _ in range(400):
        motion.step(DT_S, None)  # type: ignore[arg-type]
    motion.cpg.phase_error_rad = motion.cpg.phase_error_rad + np.linspace(-1.0, 1.0, 16)
    cycle = gait.joints_rad(ROBOT, PHASES)
    away = np.abs(cycle - motion.goal_rad()).max(axis=1).min()
    for _ in range(600):
        motion.step(DT_S, None)  # type: ignore[arg-type]
    back = np.abs(cycle - motion.goal_rad()).max(axis=1).min()
    assert away > 0.1
    assert back < 0.01


def test_a_gait_runs_at_the_frequency_that_its_joints_can_follow() -> None:
    gait = GAITS["anguilliform"]()
    motion = CpgMotion(ROBOT, np.zeros(16))
    motion.become(gait)
    assert motion.cpg.pattern.omega_rad_s == pytest.approx(GaitCycle(gait, ROBOT).rate_rad_s)
    assert motion.needs == gait.needs
