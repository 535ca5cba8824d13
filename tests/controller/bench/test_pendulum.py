"""``bus pendulum``: its file is one that ``robot identify`` reads."""

import json
import threading
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.config.loader import load_robot
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.bench.calibration.pendulum import record
from snakewalk.controller.studies.identification.pendulum_log import read_pendulum_log
from snakewalk.controller.studies.identification.pendulum_swing import robot_swing_rad
from snakewalk.drivers.bus.feetech_bus import servo_bus
from snakewalk.drivers.errors import DriverError
from snakewalk.sim.feetech.line import FeetechLine
from snakewalk.sim.feetech.servos import FeetechServos
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.serve.bench_line import feetech_line
from snakewalk.sim.serve.servo_bus import ServoBus
from snakewalk.sim.serve.virtual_time import VirtualTimeServer
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from snakewalk.sim.servo.motor import gears_of
from tests.helpers.command import snakewalk

MASS_KG, ARM_M = 0.2, 0.1
ROBOTS = [("xl330-16", 400), ("sts3215-12", 32)]


def line_of(robot: RobotConfig) -> SimLine | FeetechLine:
    """Return a servo with ID 3 that swings a weight."""
    facts = robot.servo_records[0]
    plant = BenchPlant(
        1,
        inertia_kg_m2=MASS_KG * ARM_M**2,
        load_n_m=lambda q: -MASS_KG * GRAVITY_M_S2 * ARM_M * np.sin(q),
        gear=gears_of(robot)[0],
    )
    if facts.is_feetech:
        return feetech_line(FeetechServos((3,), plant, facts, robot.servo.supply_v), 1_000_000)
    return SimLine(ServoBank((3,), [facts], 1_000_000), plant)


@pytest.mark.parametrize(("name", "gain"), ROBOTS)
def test_the_recording_of_a_pendulum_is_read(name: str, gain: int, tmp_path: Path) -> None:
    robot = load_robot(name)
    line = line_of(robot)
    entries = record(servo_bus(line, robot.servo.model), robot, 3, gain)
    about = {"motor": robot.servo.model, "mass": MASS_KG, "length": ARM_M, "kp": gain}
    path = tmp_path / "swing.json"
    path.write_text(json.dumps(about | {"entries": entries}), encoding="utf-8")
    log = read_pendulum_log(path)
    assert len(log.time_s) == 801
    on = log.torque_on > 0.0
    assert log.time_s[~on][0] == pytest.approx(6.0, abs=0.02)
    assert np.abs(log.goal_rad[on]).max() == pytest.approx(1.2, abs=1e-3)
    # let go near 1.2 rad, it falls
    assert log.position_rad[~on][0] > 0.9
    assert abs(log.position_rad[-1]) < 0.5
    assert np.ptp(log.supply_v) <= 0.5
    assert line.shown("Torque Enable").tolist() == [0]
    if name == "xl330-16":
        assert line.shown("Bus Watchdog").tolist() == [0]
        # the servo of the same model, computed from its first angle alone, swings alike
        alone = robot_swing_rad(robot, log, {"offset_rad": 0.0, "delay_s": 0.0})  # type: ignore[arg-type]
        assert np.degrees(np.abs(alone - log.position_rad).mean()) < 0.5


def test_torque_goes_off_after_an_error() -> None:
    robot = load_robot("xl330-16")
    line = line_of(robot)
    bus = servo_bus(line, robot.servo.model)
    with pytest.raises(DriverError):
        record(bus, robot, 4, 400)
    assert line.shown("Torque Enable").tolist() == [0]


def test_the_command_writes_the_file(tmp_path: Path) -> None:
    bus = ServoBus("5:XL330-M288")
    ended = threading.Event()
    with VirtualTimeServer(bus.line, None) as server:
        thread = threading.Thread(target=server.serve, args=(ended.is_set,))
        thread.start()
        try:
            out = tmp_path / "kp400.json"
            words = ["--robot", "xl330-16", "--mass", "0.2", "--length", "0.1", "--id", "5"]
            ran = snakewalk(
                "bus", "pendulum", *words, "--port", server.path, "-o", str(out), "--json"
            )
        finally:
            ended.set()
            thread.join()
            bus.close()
    assert (ran.returncode, ran.stderr) == (0, "")
    shown = json.loads(ran.stdout)
    assert shown["out"] == str(out)
    assert shown["entries"] in (800, 801)
    log = read_pendulum_log(out)
    assert (log.actuator, log.mass_kg, log.p_gain) == ("XL330-M288", 0.2, 400.0)
    assert np.ptp(log.position_rad) > 1.0
