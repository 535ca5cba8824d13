"""A run on a pseudo-terminal with a shadow: the served simulated bus, in simulated time."""

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from snakewalk.config.faults import FaultPlan
from snakewalk.config.loader import checked, load_world
from snakewalk.controller.run import backend
from snakewalk.controller.run.backend import Backend
from snakewalk.controller.run.external.simulated_backend import simulated
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.studies.shadow import shadow
from snakewalk.controller.studies.shadow.run_shadow import ALARM_A, ALARM_RAD
from snakewalk.drivers.errors import PortError
from snakewalk.sim.faults.fault_player import FaultPlayer
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.plant import Mounting
from snakewalk.sim.serve.pty import PtyServer
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.motor import motors_of
from tests.controller.studies.shadow.test_run_shadow import short_run
from tests.helpers.pty_port import PtyPort, ServedClock

BENT_RAD = np.array([0.3, -0.2, 0.25])
"""Where the joints of the served robot are before it has torque."""


class Bench:
    """The robot of ``short_run`` on level ground, served at a pseudo-terminal."""

    def __init__(self, opened: ExitStack, monkeypatch: pytest.MonkeyPatch) -> None:
        robot = short_run(1.0).robot
        plant = MujocoPlant(robot, load_world("flat"), None, 0.005)
        plant.reset((0.0, 0.0), 0.0, BENT_RAD)
        baud = robot.servo.baud
        bank = ServoBank(robot.servo_ids, robot.servo_models, baud)
        mounting, motors = Mounting.of(robot), motors_of(robot)
        self.line = SimLine(bank, plant, mounting=mounting, motors=motors)
        self.clock = ServedClock()
        self.server = opened.enter_context(PtyServer(self.line, self.clock))

        def open_port(device: str, baud: int, clock: object = None) -> PtyPort:
            if device != self.server.path:
                raise PortError(f"{device}: no such port")
            return opened.enter_context(PtyPort(self.server, baud, self.clock))

        monkeypatch.setattr(backend, "open_port", open_port)

    def run(self, folder: Path, seconds: float, **safety: Any) -> Any:
        prepared = short_run(seconds)
        limits = prepared.run.safety.model_copy(update=safety)
        prepared = replace(prepared, run=prepared.run.model_copy(update={"safety": limits}))
        return run_robot(
            RunRequest(prepared, folder, self.server.path, shadow=True, stoppable=False)
        )


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    with ExitStack() as opened:
        yield Bench(opened, monkeypatch)


@pytest.mark.costs("builds a simulator beside a run")
def test_the_simulator_is_built_before_torque_is_on(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A simulator that needs a second is five times as slow as the servos' bus watchdogs."""
    torque: list[bool] = []

    def slow(*args: Any) -> Backend:
        bench.clock.sleep_until_s(bench.clock.now_s() + 1.0)
        bench.line.settle()
        torque.append(bool(bench.line.firmware.drive.torque_on.any()))
        return simulated(*args)

    monkeypatch.setattr(shadow, "simulated", slow)
    finished = bench.run(tmp_path, 3.0)
    assert torque[0] is False
    assert finished.outcome.tripped is None
    record = finished.record
    assert len(record.shadow.time_s) == len(record.cycle.time_s)
    # the shadow starts where the joints were found, and stays beside them
    np.testing.assert_allclose(record.cycle.measured_rad[0], BENT_RAD, atol=0.02)
    apart_rad = np.abs(record.shadow.position_rad - record.cycle.measured_rad)
    assert apart_rad[0].max() < 2e-3
    assert apart_rad.max() < ALARM_RAD
    apart_a = np.abs(record.shadow.current_a - record.cycle.current_a)[50:]
    assert apart_a.max() < 0.1 * ALARM_A  # one unit of the register
    events = [event.text for event in record.events if event.kind == "shadow"]
    assert len(events) == 1
    assert events[0].startswith("nothing differs from the shadow")


@pytest.mark.slow
def test_a_shadow_starts_again_after_an_interruption(bench: Bench, tmp_path: Path) -> None:
    """The joints hold meanwhile; the shadow neither catches up nor loses its own watchdogs."""
    plan = checked(FaultPlan, {"fault": [{"kind": "drop", "at_s": 4.0, "for_s": 1.5}]}, "test")
    FaultPlayer(bench.line, plan)
    finished = bench.run(tmp_path, 7.0, recovery="resume")
    assert finished.outcome.tripped is None
    record = finished.record
    pauses_s = np.diff(record.cycle.time_s)
    gap = int(pauses_s.argmax()) + 1
    assert pauses_s[gap - 1] > 1.0
    apart_rad = np.abs(record.shadow.position_rad - record.cycle.measured_rad)
    assert apart_rad[gap:].max() < ALARM_RAD
