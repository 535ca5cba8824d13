"""A shadow beside a robot whose computer is busy: goals and replies come late."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from snakewalk.controller.run.backend import Backend
from snakewalk.controller.run.deviation import NO_DEVIATION, Deviation
from snakewalk.controller.run.external import simulated_backend
from snakewalk.controller.run.external.simulated_backend import simulated
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.studies.shadow.run_shadow import ALARM_A, RunShadow, ShadowAlarm
from snakewalk.drivers.types import JointCommand, JointState
from tests.controller.studies.shadow.test_run_shadow import short_run
from tests.helpers.tiers import slow_except


class BusyChain:
    """A chain whose computer, and whose adapter, hold requests and goals up at random.

    Args:
        made: the chain.
        seed: of the delays, which are exponential.
        host_s: mean delay before a read, and between a reply and the goals; the clock shows it.
        line_s: mean delay of a request and of goals between computer and servo; the run measures
            that of the request only.

    """

    def __init__(self, made: Backend, seed: int, host_s: float, line_s: float) -> None:
        self._chain, self._clock = made.chain, made.clock
        self._rng = np.random.default_rng(seed)
        self._host_s, self._line_s = host_s, line_s

    def __getattr__(self, name: str) -> Any:
        return getattr(self._chain, name)

    def read(self) -> JointState:
        self._wait(self._host_s)
        line_s = self._wait(self._line_s)
        state = self._chain.read()
        self._wait(self._host_s)
        return state._replace(age_s=state.age_s + line_s)

    def write(self, command: JointCommand) -> None:
        self._wait(self._line_s)
        self._chain.write(command)

    def _wait(self, mean_s: float) -> float:
        wait_s = min(float(self._rng.exponential(1.0)), 6.0) * mean_s
        self._clock.sleep_until_s(self._clock.now_s() + wait_s)
        return wait_s


Alarms = Callable[..., list[str]]


@pytest.fixture
def alarms(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Alarms:
    """Run for 8 s beside a shadow; returns the alarms."""
    monkeypatch.setattr(RunShadow, "end", lambda shadow, time_s: None)

    def run(
        seed: int, host_s: float, line_s: float, deviation: Deviation = NO_DEVIATION
    ) -> list[str]:
        def busy(*given: Any) -> Backend:
            made = simulated(*given, deviation=deviation)
            return replace(made, chain=BusyChain(made, seed, host_s, line_s))  # type: ignore[arg-type]

        monkeypatch.setattr(simulated_backend, "simulated", busy)
        finished = run_robot(
            RunRequest(short_run(8.0), tmp_path / "run", shadow=True, stoppable=False)
        )
        assert finished.outcome.tripped is None
        return [event.text for event in finished.record.events if event.kind == "shadow"]

    return run


@pytest.mark.fast_cases(1)
@pytest.mark.slow_cases(1, "a run with its shadow each: 5 s of CPU")
@pytest.mark.costs("a run with its shadow")
@pytest.mark.parametrize("seed", slow_except([0], range(3)))
@pytest.mark.parametrize(("host_s", "line_s"), [(5e-3, 0.0), (0.0, 2e-3), (2e-3, 4e-3)])
def test_a_busy_computer_gives_no_alarm(
    alarms: Alarms, seed: int, host_s: float, line_s: float
) -> None:
    """Joints differed by 0.03 to 0.09 A, as the shadow was read and got its goals in time."""
    assert alarms(seed, host_s, line_s) == []


@pytest.mark.slow_cases(1, "a run with its shadow each: 5 s of CPU")
@pytest.mark.costs("a run with its shadow")
@pytest.mark.parametrize(
    ("host_s", "line_s"), slow_except([(5e-3, 0.0)], [(0.0, 0.0), (5e-3, 0.0), (3e-3, 3e-3)])
)
def test_a_weak_servo_gives_an_alarm_on_a_busy_computer(
    alarms: Alarms, host_s: float, line_s: float
) -> None:
    weak = Deviation(torque=np.array([1.0, 0.4, 1.0]))
    (text,) = alarms(5, host_s, line_s, weak)
    assert text.startswith("joint yaw_02 (ID 2) differs from its shadow")


@pytest.mark.slow
def test_a_smaller_fault_gives_an_alarm_if_only_the_host_is_late(alarms: Alarms) -> None:
    """The host measures its own delays, so they cost no sensitivity."""
    weak = Deviation(torque=np.array([1.0, 0.6, 1.0]))
    assert [text[:20] for text in alarms(5, 5e-3, 0.0, weak)] == ["joint yaw_02 (ID 2) "]


def test_the_limit_grows_by_the_effect_of_late_replies() -> None:
    """An XM430 at P gain 800 draws 10.7 A for each rad; at 1 rad/s 4 ms make 0.043 A."""
    robot = short_run(1.0).robot
    limits_a = []
    for late_s in (0.0, 4e-3):
        alarm = ShadowAlarm(robot, 50.0)
        joints = np.zeros(3)
        for cycle in range(1000):
            is_late = cycle > 0
            state = JointState(
                *(0.02 * cycle, joints, joints + 1.0, joints, joints, joints),
                *(joints.astype(np.uint8), joints.astype(np.uint8)),
                *(joints + 1e-3 + late_s * is_late, joints == 0.0, joints),
            )
            assert alarm.update(state, state) == ()
        limits_a.append(float(alarm.limits()[0, 0]))
    facts = robot.servo_records[0]
    assert facts.stall_current_a is not None
    slope_a = facts.stall_current_a * robot.position_p_gains[0] / facts.full_output_rad
    assert limits_a[0] == ALARM_A
    assert limits_a[1] == pytest.approx(ALARM_A + slope_a * 4e-3, rel=1e-3)
    assert limits_a[1] - ALARM_A == pytest.approx(0.043, abs=0.001)
