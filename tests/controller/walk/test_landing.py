"""Out of the water: a body that makes no way any more unfolds its legs, C1, and walks."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.errors import ConfigError
from snakewalk.config.loader import checked, load_robot
from snakewalk.config.run import RunConfig
from snakewalk.controller.kinematics.links import body_in_world, pose_at
from snakewalk.controller.run.factory import prepare_job
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.walk.landing import Landing

ROBOT = load_robot("salamander")
LEGS = slice(len(ROBOT.joint_axes), None)
STEP_S = 0.02


def landing(told: list[str]) -> Landing:
    made = prepare_job("water-to-land").make_source(
        lambda kind, text: told.append(f"{kind}: {text}")
    )
    assert isinstance(made, Landing)
    return made


def body_at(x_m: float):
    at = np.array([x_m, 0.0])
    return body_in_world(ROBOT, pose_at(at, 0.0), np.zeros(ROBOT.joint_count))


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(("left", "ashore"), [(0.6, False), (0.4, True)])
def test_it_walks_after_a_cycle_with_less_than_half_of_the_best_way(left, ashore) -> None:
    told: list[str] = []
    motion, x_m = landing(told), -1.6
    for k in range(600):  # nearly ten cycles
        x_m += STEP_S * 0.1 * (1.0 if k < 300 else left)
        motion.step(STEP_S, body_at(x_m))
    assert motion.ashore == ashore
    assert len(told) == int(ashore)
    if ashore:
        assert told[0].startswith("ashore: ")
        assert told[0].endswith("m before: the ground is met")


@pytest.mark.slow
def test_legs_unfold_without_a_step_within_the_limits_of_the_servos() -> None:
    motion, view = landing([]), body_at(-1.0)
    goals = [motion.begin(view)]
    for k in range(900):
        moved = body_at(-1.6 + STEP_S * 0.1 * min(k, 200))
        goals.append(motion.step(STEP_S, moved))
    before, after = np.array(goals[:200])[:, LEGS], np.array(goals[-220:])[:, LEGS]
    np.testing.assert_array_equal(before[:, ::2], -1.1)
    assert after[:, ::2].min() == pytest.approx(-0.5, abs=0.1)  # they swing to both sides
    assert after[:, ::2].max() == pytest.approx(0.5, abs=0.1)
    speed = np.diff(goals, axis=0) / STEP_S
    assert np.abs(speed).max() <= 1.03 * ROBOT.joint_speed_limit_rad_s
    hardest = np.abs(np.diff(speed, axis=0)).max() / STEP_S
    assert hardest <= 1.05 * ROBOT.joint_acceleration_limit_rad_s2


@pytest.mark.slow
def test_a_run_swims_to_the_beach_and_walks_over_it(tmp_path: Path) -> None:
    job = prepare_job("water-to-land", keys={"run.waypoint_radius_m": 0.25})
    job = replace(
        job, run=job.run.model_copy(update={"start_m": (-0.9, 0.0), "waypoints_m": ((0.1, 0.0),)})
    )
    told: list[tuple[str, str]] = []
    finished = run_robot(
        RunRequest(job, tmp_path, on_event=lambda kind, text: told.append((kind, text)))
    )
    assert finished.outcome.complete
    assert finished.outcome.missed == 0
    assert [kind for kind, _ in told].count("ashore") == 1
    legs = finished.record.cycle.sent_rad[:, LEGS]
    np.testing.assert_allclose(legs[:200, ::2], -1.1, atol=1e-3)
    assert legs[-200:, ::2].max() > 0.4
    head_m = finished.record.pose.head_m
    assert head_m[-1, 2] > head_m[:200, 2].max() + 0.03  # it came up the beach


def test_a_gait_ashore_without_waypoints_is_refused() -> None:
    gait = {"name": "anguilliform", "ashore": {"name": "trot"}}
    with pytest.raises(ConfigError, match="ashore"):
        checked(RunConfig, {"name": "made", "motion": "gait", "gait": gait}, "made")
