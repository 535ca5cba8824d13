"""The example that records a pendulum: its file is one that ``robot identify`` reads."""

import json
import runpy
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.config.loader import load_robot
from snakewalk.config.servo_catalogue import servo_model
from snakewalk.controller.studies.identification.pendulum_log import read_pendulum_log
from snakewalk.controller.studies.identification.pendulum_swing import robot_swing_rad
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.errors import DriverError
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from snakewalk.sim.servo.motor import gears_of

MASS_KG, ARM_M = 0.2, 0.1
EXAMPLE = Path(__file__).resolve().parents[2] / "examples/record_pendulum.py"


def test_the_recording_of_a_pendulum_is_read(tmp_path: Path) -> None:
    facts, robot = servo_model("XL330-M288", Path()), load_robot("xl330-16")
    plant = BenchPlant(
        1,
        inertia_kg_m2=MASS_KG * ARM_M**2,
        load_n_m=lambda q: -MASS_KG * GRAVITY_M_S2 * ARM_M * np.sin(q),
        gear=gears_of(robot)[0],
    )
    line = SimLine(ServoBank((1,), [facts], 1_000_000), plant)
    record = runpy.run_path(str(EXAMPLE))["record"]
    entries = record(DynamixelBus(line, "XL330-M288"), 1, 400, 8.0)
    about = {"motor": "XL330-M288", "mass": MASS_KG, "length": ARM_M, "kp": 400}
    path = tmp_path / "kp400.json"
    path.write_text(json.dumps(about | {"entries": entries}), encoding="utf-8")
    log = read_pendulum_log(path)
    assert len(log.time_s) == 801
    on = log.torque_on > 0.0
    assert log.time_s[~on][0] == pytest.approx(6.0, abs=0.02)
    assert np.abs(log.goal_rad[on]).max() == pytest.approx(1.2, abs=1e-3)
    # the servo of the same model, computed from its first angle alone, swings alike
    alone = robot_swing_rad(robot, log, {"offset_rad": 0.0, "delay_s": 0.0})  # type: ignore[arg-type]
    assert np.degrees(np.abs(alone - log.position_rad).mean()) < 0.5
    # let go at 1.2 rad, it falls
    assert log.position_rad[~on][0] > 0.9
    assert abs(log.position_rad[-1]) < 0.5
    assert np.ptp(log.supply_v) <= 0.5
    assert line.bank["Torque Enable"][0] == line.bank["Bus Watchdog"][0] == 0


def test_torque_goes_off_after_an_error() -> None:
    line = SimLine(ServoBank((1,), [servo_model("XL330-M288", Path())], 1_000_000), BenchPlant(1))
    line.bank["Max Position Limit"][0] = 2500
    record = runpy.run_path(str(EXAMPLE))["record"]
    with pytest.raises(DriverError, match="Goal Position"):
        record(DynamixelBus(line, "XL330-M288"), 1, 400, 8.0)
    assert line.bank["Torque Enable"][0] == line.bank["Bus Watchdog"][0] == 0
