"""Compliance in a run over real bytes: pegs that trip a stiff body, replies that are lost, log."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.faults import FaultPlan
from snakewalk.controller.run.external import simulated_backend
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.request import RunRequest, RunResult
from snakewalk.controller.run.run_keys import with_compliance
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.studies.trials import Case, prepare_case
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.sim.faults.fault_player import FaultPlayer


def ran(folder: Path, *, compliance: bool | None, name: str = "pegs-undulation") -> RunResult:
    prepared = prepare_gait(name, seconds=6.0)
    return run_robot(
        RunRequest(replace(prepared, run=with_compliance(prepared.run, compliance)), folder)
    )


@pytest.mark.slow
def test_joints_yield_and_the_log_tells_by_how_much(tmp_path: Path) -> None:
    stiff, soft = ran(tmp_path / "a", compliance=False), ran(tmp_path / "b", compliance=None)
    assert stiff.summary.yield_max_rad is None
    assert soft.summary.yield_max_rad is not None
    assert 0.01 < soft.summary.yield_max_rad <= 0.5
    cycle = soft.record.cycle
    assert np.isfinite(cycle.yield_rad).all()
    table = soft.record.header.run.compliance
    assert table is not None
    change = np.abs(np.diff(cycle.yield_rad, axis=0)).max()
    assert change <= table.yield_rate_rad_s / soft.record.header.run.cycle_hz + 2e-6
    assert soft.summary.clamps == 0
    # yaw joints alone measure no vertical support
    assert soft.summary.lifted_by_current is None


@pytest.mark.costs("a whole run")
def test_lost_replies_hold_the_yield_and_the_run_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A fifth of the status packets of a second is lost: what was not read does not move."""
    faults = FaultPlan.model_validate(
        {"seed": 1, "fault": [{"kind": "drop", "at_s": 4.0, "for_s": 1.0, "chance": 0.2}]}
    )

    def faulty(line: object, *args: object, **values: object) -> DynamixelBus:
        FaultPlayer(line, faults)  # type: ignore[arg-type]
        return DynamixelBus(line, *args, **values)  # type: ignore[arg-type]

    monkeypatch.setattr(simulated_backend, "servo_bus", faulty)
    found = ran(tmp_path, compliance=None)
    cycle = found.record.cycle
    assert found.outcome.tripped is None
    lost = ~cycle.valid[1:]
    assert lost.sum() > 10
    moved = np.diff(cycle.yield_rad, axis=0)
    assert np.abs(moved[lost]).max() == 0.0
    assert np.abs(moved[~lost]).max() > 0.0


def test_a_gait_is_a_case_of_trials_whose_start_moves() -> None:
    case = Case("sidewinding", "gait", compliance=True, world="random-20")
    changes = {"seconds": 6.0, "track": None}
    one, same = (prepare_case(case, 3, 0.04, changes) for _ in range(2))
    assert one.run == same.run
    assert one.run.start_m != (0.0, 0.0)
    assert one.world.name == "random-20"
    assert one.run.compliance is not None
    assert prepare_case(replace(case, compliance=False), 3, 0.04, changes).run.compliance is None
