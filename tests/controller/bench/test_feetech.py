"""Scan, doctor, stop and calibration tools on a bus of Feetech servos."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from pydantic import ValidationError

from snakewalk.config.loader import checked, load_robot
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.controller.bench import torque_off as stopping
from snakewalk.controller.bench.doctor import examine
from snakewalk.controller.bench.eeprom_backup import back_up, plan_restore
from snakewalk.controller.bench.scan import scan
from snakewalk.controller.bench.servo_settings import SettingsRequest, apply, open_servo, plan
from snakewalk.controller.console.finding import Finding
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.bus.feetech_bus import servo_bus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import ChainError
from snakewalk.sim.ax12.ax12 import Ax12Servos
from snakewalk.sim.ax12.line import Ax12Line
from snakewalk.sim.feetech.line import FeetechLine
from snakewalk.sim.serve.bench_line import bench_line
from snakewalk.sim.serve.chain_spec import parse_chain
from snakewalk.sim.servo.bench import BenchPlant
from tests.helpers.tiers import slow_after

ROBOT = load_robot("sts3215-12")


def a_line(servos: str = "1-12:STS3215", baud: int = 1_000_000) -> FeetechLine:
    line = bench_line(parse_chain(servos), baud)
    assert isinstance(line, FeetechLine)
    return line


def doctor(line: FeetechLine) -> Sequence[Finding]:
    return examine(
        line, ROBOT, RunConfig(name="test", motion="source"), latency_s=0.004, latency_timer_ms=None
    )


SLOW = pytest.mark.slow  # a scan of all rates needs 5 s


@pytest.mark.slow_cases(1, "3 cases of 3.6 s of CPU")
@pytest.mark.slow
@pytest.mark.parametrize(
    "model", ["STS3215", pytest.param("SCS0009", marks=SLOW), pytest.param("HLS3606", marks=SLOW)]
)
def test_a_scan_finds_feetech_servos_at_their_rate(model: str) -> None:
    found = scan(a_line(f"1,2,250:{model}", 500_000)).servos
    assert [(each.servo_id, each.model, each.baud) for each in found] == [
        (servo_id, model, 500_000) for servo_id in (1, 2, 250)
    ]


@pytest.mark.slow
def test_a_scan_does_not_take_an_ax12_for_a_feetech_servo() -> None:
    assert scan(Ax12Line(Ax12Servos((1, 2), BenchPlant(2)))).servos == ()


@pytest.mark.parametrize(
    ("bus", "robot"), [("STS3215", "SCS0009"), ("SCS0009", "STS3215"), ("HLS3606", "STS3215")]
)
def test_servos_of_another_series_are_named(bus: str, robot: str) -> None:
    """SCS servos have the other order of bytes: their number was shown as 2307."""
    keys = ROBOT.model_dump(exclude={"joints"})
    keys["servo"] |= {"model": robot, "supply_v": 6.0}
    keys["described_models"] = ()
    chain = ServoChain(servo_bus(a_line(f"1-12:{bus}"), robot), checked(RobotConfig, keys, "r"))
    with pytest.raises(ChainError) as info:
        chain.enable()
    assert info.value.faults == (f"servos 1 to 12: are {bus}, not {robot}",)


def test_a_bus_of_another_make_is_named_as_a_cause() -> None:
    """A run without --robot on a Feetech bus listed 16 IDs and did not name this cause."""
    robot = load_robot("yaw16")
    line = a_line()
    with pytest.raises(ChainError) as info:
        ServoChain(DynamixelBus(line, robot.servo.model), robot).enable()
    assert info.value.faults == (
        f"{line.name}: no answer from any of the servos 1 to 16 at 1000000 baud: power, cable, "
        f"baud rate or another make; snakewalk bus scan --port {line.name} lists the servos that "
        "reply",
    )


@pytest.mark.slow
def test_the_doctor_finds_nothing_on_a_new_chain_and_names_no_dynamixel() -> None:
    findings = doctor(a_line())
    assert {each.grade for each in findings} == {"ok"}
    texts = " ".join(f"{each.found} {each.remedy}" for each in findings)
    assert "DYNAMIXEL" not in texts
    assert "12 servos, 1000000 baud, sync read: 4.56 ms per cycle" in texts


def detect(kind: str) -> Callable[[FeetechLine], None]:
    def plant(line: FeetechLine) -> None:
        protection = line.servos.protection
        protection.detect(np.array([2]), protection.alarms(2)[kind])

    return plant


def register(name: str, value: int) -> Callable[[FeetechLine], None]:
    def plant(line: FeetechLine) -> None:
        line.servos[name][2] = value

    return plant


@pytest.mark.slow_cases(1, "a complete examination each: 1.4 s of CPU")
@pytest.mark.parametrize(
    ("plant", "check", "found"),
    slow_after(
        2,
        [
            (register("ID", 99), "servo IDs", "3"),
            (detect("overload"), "alarms", "overload"),
            (detect("encoder"), "alarms", "motor encoder"),
            (register("Torque Enable", 1), "torque", "on"),
            (register("PWM Limit", 500), "PWM limit", "a PWM Limit(16) below 1000"),
            (register("Shutdown", 4), "shutdown", "Shutdown(19) is masked"),
            (register("Min Position Limit", 2000), "position limits", "position limits (11, 9)"),
            (register("Homing Offset", 100), "homing offset", "the zero is moved: joint yaw_03"),
            (register("Status Return Level", 0), "status return level", "does not reply to writes"),
            (register("Operating Mode", 1), "operating mode", "Operating Mode 1"),
            (register("Baud Rate", 1), "baud rate", "500000"),
        ],
    ),
)
def test_the_doctor_names_a_fault(
    plant: Callable[[FeetechLine], None], check: str, found: str
) -> None:
    line = a_line()
    plant(line)
    findings = doctor(line)
    bad = [each for each in findings if each.check == check and each.grade != "ok"]
    assert any(found in each.found for each in bad), findings


def test_stop_switches_torque_off(monkeypatch: pytest.MonkeyPatch) -> None:
    line = a_line("1-3:STS3215")
    line.servos["Torque Enable"][:] = 1

    class Held:
        def __enter__(self) -> FeetechLine:
            line.latency_s = 0.001  # type: ignore[attr-defined]
            return line

        def __exit__(self, *_: object) -> None: ...

    monkeypatch.setattr(stopping, "open_port", lambda *_: Held())
    outcome = stopping.torque_off("a line", [1_000_000])
    assert not line.servos["Torque Enable"].any()
    assert "3 servos confirm it" in str(outcome)


@pytest.mark.slow
def test_settings_of_a_feetech_servo_outlast_power_off() -> None:
    line = a_line("1-2:STS3215")
    bus = open_servo(line, 1, 0.004)
    request = SettingsRequest(new_id=7, new_baud=500_000)
    apply(bus, 1, plan(bus, 1, request))
    assert line.servos["ID"].tolist() == [7, 2]
    assert line.getBaudRate() == 500_000
    line.servos.reboot(0)
    assert scan(line, [500_000]).servos[0].servo_id == 7
    assert line.servos["Lock"].tolist() == [1, 1]


@pytest.mark.slow
def test_a_backup_of_feetech_servos_is_restored() -> None:
    line = a_line("1-2:STS3215")
    before = back_up(line, 0.004)
    assert [(each.id, each.model) for each in before.servos] == [(1, "STS3215"), (2, "STS3215")]
    bus = open_servo(line, 1, 0.004)
    apply(bus, 1, plan(bus, 1, SettingsRequest(temperature_limit_c=60.0)))
    changes = plan_restore(bus, before.servos[0])
    assert [each.register for each in changes] == ["Temperature Limit"]
    apply(bus, 1, changes)
    assert back_up(line, 0.004) == before


def test_a_run_reports_that_there_is_no_watchdog() -> None:
    line, lines = a_line(), []
    chain = ServoChain(servo_bus(line, ROBOT.models_by_id), ROBOT, rate_hz=50)
    chain.on_event = lines.append
    chain.enable()
    chain.disable()
    assert sum("STS3215: has no bus watchdog" in each for each in lines) == 1


def test_one_port_has_one_make() -> None:
    joints = [{"axis": "y", "id": 1}, {"axis": "y", "id": 2, "model": "XL330-M288"}]
    servo = {"model": "STS3215", "supply_v": 6.0, "over_current_a": 1.0}
    with pytest.raises(ValidationError, match="one port has servos of one series"):
        RobotConfig.model_validate({"name": "two", "joints": joints, "servo": servo})


@pytest.mark.nightly("a complete examination: 2 s of CPU")
def test_the_doctor_measures_the_supply_under_load() -> None:
    line = a_line()
    findings = examine(
        line,
        ROBOT,
        RunConfig(name="test", motion="source"),
        latency_s=0.004,
        latency_timer_ms=None,
        wiggle=True,
    )
    supply = [each for each in findings if each.check == "supply under load"]
    assert [each.grade for each in supply] == ["ok"]
    assert "7.4 V at rest" in supply[0].found
