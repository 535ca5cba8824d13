"""A run that holds before torque off: rejected, planned, held, logged."""

import signal
from pathlib import Path

import pytest
from pytest_mock import MockerFixture

from snakewalk.config.errors import InputError
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.runtime.drive import Progress
from snakewalk.drivers.errors import BusError
from snakewalk.drivers.safety.trip_hold import INTERRUPTED
from snakewalk.sim.servo.firmware import Firmware
from tests.helpers.command import snakewalk

HOLD_S = 0.4
KEYS = {"run.safety.on_trip": "hold", "run.safety.hold_s": HOLD_S}


def test_an_interrupted_run_holds_and_then_ends(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    count = [0]

    def interrupt_once(progress: Progress) -> None:
        count[0] += 1
        if count[0] == 20:
            signal.raise_signal(signal.SIGINT)

    job = prepare_gait("lateral-undulation", seconds=2.0, keys=KEYS)
    finished = run_robot(RunRequest(job, tmp_path, on_progress=interrupt_once))
    assert finished.outcome.tripped == INTERRUPTED
    record = read_log(tmp_path / "log.mcap")
    (trip,) = [each for each in record.events if each.kind == "trip"]
    (hold,) = [each for each in record.events if "holds with low currents" in each.text]
    assert abs(hold.time_s - trip.time_s) < 0.05
    assert record.events[-1].time_s - trip.time_s == pytest.approx(HOLD_S, abs=0.1)
    held_s = record.cycle.time_s[-1] - trip.time_s
    assert held_s == pytest.approx(HOLD_S, abs=0.1)


def test_a_robot_whose_current_cannot_be_limited_is_rejected(tmp_path: Path) -> None:
    keys = {"run.safety.on_trip": "hold", "robot.servo.model": "XL430-W250"}
    with pytest.raises(InputError, match="on_trip = hold: XL430-W250 has no current-based"):
        prepare_walk("flat-square", keys=keys)
    prepare_walk("flat-square", keys={"run.safety.on_trip": "hold"})


def test_the_plan_states_the_hold() -> None:
    done = snakewalk(
        "plan", "flat-square", "--motion", "serpenoid", "--set", "run.safety.on_trip=hold"
    )
    assert done.returncode == 0, done.stderr
    assert "hold for 5 s with at most 0.46 A a joint" in " ".join(done.stdout.split())


def test_the_stop_output_of_a_simulated_run_opens_its_supply(
    tmp_path: Path, mocker: MockerFixture
) -> None:
    pytest.importorskip("mujoco")
    cut = mocker.spy(Firmware, "cut_power")
    mocker.patch(
        "snakewalk.drivers.chain.torque_off.TorqueOff.send", side_effect=BusError("not confirmed")
    )
    keys = {"run.safety.stop_output": "rts:/dev/nowhere"}
    job = prepare_gait("lateral-undulation", seconds=0.5, keys=keys)
    with pytest.raises(BusError) as raised:
        run_robot(RunRequest(job, tmp_path))
    assert cut.call_count == 1
    assert any("stop output simulated supply: activated" in x for x in raised.value.__notes__)
    log = read_log(tmp_path / "log.mcap")
    assert any("stop output simulated supply: activated" in each.text for each in log.events)
