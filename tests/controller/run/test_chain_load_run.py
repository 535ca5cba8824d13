"""A run states its supply over time, and slows down before the fuse of its supply blows."""

from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.robot import PowerConfig, RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.run.servo_setup import _check_fuse
from snakewalk.controller.runtime.derating import LEAST, Derating
from snakewalk.drivers.types import JointState


def test_a_run_logs_and_reports_its_supply(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    finished = run_robot(RunRequest(prepare_gait("lateral-undulation", seconds=3.0), tmp_path))
    battery, summary = finished.record.battery, finished.summary.battery
    assert len(battery.time_s) >= 3
    assert np.diff(battery.time_s) == pytest.approx(np.ones(len(battery.time_s) - 1), abs=0.03)
    standby_a = 16 * 0.04
    assert (battery.current_a >= standby_a).all()
    assert (np.diff(battery.charge_ah) > 0.9 * standby_a / 3600.0).all()
    assert (battery.winding_c >= 25.0).all()
    assert summary is not None
    assert summary.first_v == pytest.approx(12.0, abs=0.2)
    assert summary.winding_max_c == pytest.approx(battery.winding_c.max(), rel=1e-5)


def test_a_run_slows_down_before_the_fuse(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    job = prepare_gait("lateral-undulation", seconds=3.0, keys={"robot.power.fuse_a": 0.9})
    finished = run_robot(RunRequest(job, tmp_path))
    assert finished.outcome.tripped is None
    assert finished.outcome.least_rate < 0.95
    (event,) = [each for each in finished.record.events if each.kind == "derating"][:1]
    assert event.text.startswith("slowing down: the chain at ")
    assert event.text.endswith(" A, fuse 0.9 A")


class Load:
    """A load that is given."""

    charge_ah = 0.0

    def __init__(self, current_a: float, winding_c: float) -> None:
        self.current_a, self._winding_c = current_a, winding_c
        self.hottest_c = max(25.0, winding_c)

    def winding_c(self, state: JointState) -> np.ndarray:
        return np.array([25.0, self._winding_c])


@pytest.mark.parametrize(
    ("current_a", "winding_c", "least", "reason"),
    [
        (7.5, 100.0, 1.0, None),
        (7.6, 100.0, 0.967, None),
        (9.8, 100.0, LEAST, "the chain at 9.8 A, fuse 10 A"),
        (12.0, 119.0, LEAST, "the chain at 12.0 A, fuse 10 A"),
        (1.0, 120.0, LEAST, "winding of joint yaw_02 (ID 2) at 120 C, limit 125 C"),
        (1.0, 110.0, 0.625, "winding of joint yaw_02 (ID 2) at 110 C, limit 125 C"),
        (1.0, float("nan"), 1.0, None),
    ],
)
def test_the_rate_falls_with_the_load(
    current_a: float, winding_c: float, least: float, reason: str | None
) -> None:
    robot = RobotConfig(name="two", joint_axes="yy", power=PowerConfig(fuse_a=10.0))
    events: list[str] = []
    derating = Derating(
        SafetyConfig(), robot, lambda kind, text: events.append(text), Load(current_a, winding_c)
    )
    zero, none = np.zeros(2), np.zeros(2, np.uint8)
    state = JointState(
        *(0.0, zero, zero, zero, np.full(2, 25.0), np.full(2, 12.0)),
        *(none, none, zero, np.ones(2, bool), zero),
    )
    for _ in range(500):
        rate = derating.update(state, zero, 0.02)
    assert rate == pytest.approx(least, abs=0.011)
    assert events[:1] == ([] if reason is None else [f"slowing down: {reason}"])


def test_a_fuse_needs_a_record_of_the_motor() -> None:
    robot = RobotConfig(name="two", joint_axes="yy", power=PowerConfig(fuse_a=5.0))
    _check_fuse(robot)
    record = robot.servo_records[0].model_copy(update={"motor": None})
    without = SimpleNamespace(name="two", power=robot.power, models_by_id={1: record})
    with pytest.raises(InputError, match=r"power.fuse_a = 5: the file of XM430-W350 has no \[mot"):
        _check_fuse(cast(RobotConfig, without))
