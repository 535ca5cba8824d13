"""Runs of a batch against runs one by one: the same motion, safety and servos without a bus."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from snakewalk.controller.metrics.summary import summary
from snakewalk.controller.run.external.gait_batch import run_together
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.reader import read_log
from tests.oracles.compiled_bodies import CompiledBodies


@pytest.mark.slow
def test_robots_of_a_batch_move_as_robots_on_a_bus(tmp_path: Path) -> None:
    runs = [
        prepare_gait(gait, robot="alternating16", world="isotropic", seconds=3.0)
        for gait in ("sidewinding", "rolling")
    ]
    logs = [tmp_path / f"{number}.mcap" for number in range(len(runs))]
    outcomes = run_together(runs, logs, CompiledBodies)
    for number, (run, log, outcome) in enumerate(zip(runs, logs, outcomes, strict=True)):
        alone = run_robot(RunRequest(run, tmp_path / f"{number}", stoppable=False))
        assert (outcome.tripped, outcome.least_rate) == (None, alone.outcome.least_rate)
        record = read_log(log)
        numbers = summary(record)
        assert numbers.outcome == "ran to its end"
        for key, within in (
            ("speed_m_s", 0.02),
            ("electrical_cost_of_transport", 0.03),
            ("tracking_max_rad", 0.15),
        ):
            expected = getattr(alone.summary, key)
            assert getattr(numbers, key) == pytest.approx(expected, rel=within), key


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(
    ("key", "value", "why"),
    [("temperature_limit_c", 20.0, "25 C: too hot"), ("current_limit_a", 0.05, " A")],
)
def test_safety_ends_one_run_of_a_batch_and_not_the_others(
    key: str, value: float, why: str, tmp_path: Path
) -> None:
    run = prepare_gait("lateral-undulation", robot="yaw16", seconds=0.5)
    safety = run.run.safety.model_copy(update={key: value})
    limited = replace(run, run=run.run.model_copy(update={"safety": safety}))
    logs = [tmp_path / "a.mcap", tmp_path / "b.mcap"]
    fine, stopped = run_together([run, limited], logs, CompiledBodies)
    assert fine.tripped is None
    assert stopped.tripped is not None
    assert why in stopped.tripped
    assert summary(read_log(logs[1])).trip == stopped.tripped
    assert np.isfinite(read_log(logs[0]).pose.links_m).all()
