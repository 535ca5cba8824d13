"""Gaits that follow each other at set times: planned ahead, remade from a log, without a jump."""

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.controller.gaits.registry import make_gait
from snakewalk.controller.motion.cpg_motion import CpgMotion
from snakewalk.controller.run.factory import prepare_run
from snakewalk.controller.run.kinds.gait_factory import prepare_gait

ROBOT = load_robot("alternating16")
THEN = [(3.0, "turn-in-place", {}), (8.0, "rolling", {"frequency_hz": 0.3})]


@pytest.mark.parametrize("by", ["blend", "cpg"])
def test_a_job_made_again_moves_alike_within_the_limits(by: str) -> None:
    first = prepare_gait("lateral-undulation", then=THEN, seconds=12.0, keys={"run.gait.by": by})
    again = prepare_run(first.run, first.robot, first.world)
    runs = []
    for job in (first, again):
        source = job.make_source(lambda kind, text: None)
        goals = [source.goal_rad()]
        while not source.done and len(goals) < 2500:
            goals.append(source.step(0.02, None))  # type: ignore[arg-type]
        assert source.done
        runs.append(np.array(goals))
    np.testing.assert_array_equal(runs[0], runs[1])
    speed = np.diff(runs[0], axis=0) / 0.02
    assert np.abs(speed).max() < 1.06 * ROBOT.joint_speed_limit_rad_s
    hard = np.abs(np.diff(speed, axis=0) / 0.02).max()
    assert hard < 1.06 * ROBOT.joint_acceleration_limit_rad_s2


def test_a_schedule_does_not_depend_on_how_time_is_cut_up_and_plans_nothing_later(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def made() -> CpgMotion:
        motion = CpgMotion(ROBOT, np.zeros(16))
        motion.schedule([(0.0, make_gait("sidewinding")), (2.5, make_gait("rolling")), (9.0, None)])
        return motion

    even, uneven = made(), made()
    chooses = "snakewalk.controller.motion.cpg_motion.quickest_change"
    monkeypatch.setattr(chooses, lambda *_: pytest.fail("planned while it runs"))
    rng = np.random.default_rng(1)
    for _ in range(120):
        cut = rng.dirichlet(np.ones(5)) * 0.1
        for part in cut:
            uneven.step(part, None)  # type: ignore[arg-type]
        even.step(0.1, None)  # type: ignore[arg-type]
        np.testing.assert_allclose(even.goal_rad(), uneven.goal_rad(), atol=1e-9)


def test_changes_out_of_order_or_after_the_end_are_refused() -> None:
    with pytest.raises(InputError, match="times rise"):
        prepare_gait("rolling", then=THEN[::-1], seconds=20.0)
    with pytest.raises(InputError, match="times rise"):
        prepare_gait("rolling", then=THEN, seconds=5.0)
    with pytest.raises(InputError, match="no such gait"):
        prepare_gait("rolling", then=[(1.0, "hop", {})])
