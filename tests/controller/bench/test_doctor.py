"""What the doctor finds on simulated buses with one thing wrong each; it writes nothing."""

import numpy as np
import pytest
from pytest_mock import MockerFixture
from scipy.spatial.transform import Rotation

from snakewalk.config.robot import ImuConfig, RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.controller.bench import adapter
from snakewalk.controller.bench.doctor import examine, imu_finding
from snakewalk.controller.bench.scan import ScanResult, pick_port, scan
from snakewalk.controller.console.finding import Finding, worst
from snakewalk.drivers.bus.budget import chain_budget, wire_budget
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.errors import PortError
from snakewalk.drivers.protocol.packet import Instruction
from snakewalk.sim.imu import Imu
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.plant import LinkMotion
from snakewalk.sim.servo.bench import BenchPlant
from tests.drivers.chain.test_servo_chain import Recorder, ServoBank

ROBOT = RobotConfig(name="four", joint_axes="ypyp")


@pytest.fixture
def line() -> Recorder:
    made = Recorder(ServoBank(ROBOT.servo_ids), [0.0] * 4)
    made.bank["Return Delay Time"][:] = 0
    return made


def doctor(line: SimLine, rate_hz: float = 50.0, timer_ms: int | None = None) -> list[Finding]:
    line.setBaudRate(line.getBaudRate())
    line.firmware.apply_registers()
    return examine(
        line,
        ROBOT,
        RunConfig(name="test", motion="source", cycle_hz=rate_hz),
        latency_s=0.004,
        latency_timer_ms=timer_ms,
    )


def of(findings: list[Finding], check: str) -> Finding:
    found = [f for f in findings if f.check == check]
    return max(found, key=lambda f: ("ok", "warn", "fail").index(f.grade))


def test_a_healthy_bus_passes_every_check_and_is_not_written_to(line: Recorder) -> None:
    findings = doctor(line)
    assert {f.check for f in findings if f.grade != "ok"} == set()
    assert {f.check for f in findings} == {
        *("latency timer", "baud rate", "servo IDs", "duplicate IDs", "model", "firmware"),
        *("return delay", "alarms", "torque", "supply", "temperature", "line", "wire budget"),
        *("second master", "response time", "pose", "settings"),
    }
    asked = {p.instruction for p in line.heard}
    assert asked <= {Instruction.PING, Instruction.READ, *(0x82, 0x8A)}


SICK = [
    ("return delay", "warn", "servo 3 waits", {"Return Delay Time": (2, 250)}),
    (
        "alarms",
        "fail",
        "joint pitch_02 (ID 2): overheating, overload",
        {"Hardware Error Status": (1, 0x24)},
    ),
    ("torque", "warn", "on at servo 4", {"Torque Enable": (3, 1)}),
    ("firmware", "warn", "servo 1 has no fast sync read", {"Firmware Version": (0, 44)}),
    ("firmware", "warn", "mixed: 46, 48", {"Firmware Version": (0, 46)}),
    (
        "model",
        "fail",
        "joint pitch_02 (ID 2): is a XM430-W210, not a XM430-W350",
        {"Model Number": (1, 1030)},
    ),
    ("servo IDs", "fail", "no answer from servo 3", {"ID": (2, 3), "Baud Rate": (2, 99)}),
    ("servo IDs", "warn", "servo 77 is on the bus and not", {"ID": (2, 77)}),
    ("baud rate", "fail", "servo 2 answers at 57600 baud, not at 1000000", {"Baud Rate": (1, 1)}),
]


@pytest.mark.parametrize(("check", "grade", "found", "registers"), SICK)
def test_each_fault_is_named_with_its_remedy(
    line: Recorder,
    check: str,
    grade: str,
    found: str,
    registers: dict[str, tuple[int, int]],
) -> None:
    for name, (row, value) in registers.items():
        line.bank[name][row] = value
    finding = next(f for f in doctor(line) if f.check == check and found in f.found)
    assert finding.grade == grade
    assert finding.remedy


def test_the_remedy_for_a_baud_rate_is_the_command(line: Recorder) -> None:
    line.bank["Baud Rate"][1] = 1
    assert of(doctor(line), "baud rate").remedy == (
        "snakewalk bus set --port simulated line --baud 57600 --id 2 --new-baud 1000000"
    )


def test_two_servos_of_one_id(line: Recorder) -> None:
    line.tamper = lambda raw: (raw, raw) if raw[4] == 2 and len(raw) == 14 else (raw,)
    finding = of(doctor(line), "duplicate IDs")
    assert (finding.grade, finding.found[:21]) == ("fail", "servo 2 answers twice")


def test_alike_servos_of_one_id_at_one_angle_are_found_after_one_is_turned(line: Recorder) -> None:
    """Only "no answer from servo 4" was reported: nothing on the wire shows the second servo."""
    line.bank["ID"][3] = 3
    line.refresh_ids()
    line.firmware.plant.position_rad[:] = 0.0
    finding = of(doctor(line), "servo IDs")
    assert finding.found == "no answer from servo 4"
    assert "turn it by hand and run doctor again" in finding.remedy
    line.firmware.plant.position_rad[3] = 0.5
    finding = of(doctor(line), "duplicate IDs")
    assert (finding.grade, finding.found[:25]) == ("fail", "servo 3 answers with dama")


def test_two_servos_of_one_id_that_talk_over_each_other(line: Recorder) -> None:
    turn = iter(range(10**9))

    def over(raw: bytes) -> list[bytes]:
        hurt = raw[4] == 3 and len(raw) == 14 and next(turn) % 2
        return [raw[:9] + bytes((raw[9] & 0x0F,)) + raw[10:]] if hurt else [raw]

    line.tamper = over
    finding = of(doctor(line), "duplicate IDs")
    assert finding.grade == "warn"
    assert "servo 3 come damaged" in finding.found


def test_a_bad_line_shows_in_the_group_reads(line: Recorder) -> None:
    turn = iter(range(10**9))
    line.tamper = lambda raw: [] if len(raw) > 50 and next(turn) % 10 == 0 else [raw]
    assert of(doctor(line), "line").grade == "fail"
    turn = iter(range(1, 10**9))
    line.tamper = lambda raw: [] if len(raw) > 50 and next(turn) % 100 == 0 else [raw]
    finding = of(doctor(line), "line")
    assert finding.grade == "warn"
    assert "of 200 group reads incomplete" in finding.found


@pytest.mark.parametrize(("volts", "grade"), [(8.9, "fail"), (12.0, "ok"), (15.4, "fail")])
def test_supply(volts: float, grade: str) -> None:
    from snakewalk.sim.servo.bench import BenchPlant
    from snakewalk.sim.servo.protection import SupplyAndAmbient

    line = SimLine(
        ServoBank(ROBOT.servo_ids),
        BenchPlant(4),
        supply_and_ambient=SupplyAndAmbient(supply_v=volts),
    )
    assert of(doctor(line), "supply").grade == grade


def test_nobody_answers(line: Recorder) -> None:
    line.tamper = lambda _: []
    findings = doctor(line)
    assert worst(findings) == "fail"
    assert "is the servo power on" in of(findings, "servo IDs").remedy


def test_a_rate_that_the_wire_does_not_carry(line: Recorder) -> None:
    assert of(doctor(line, rate_hz=1000.0), "wire budget").grade == "fail"
    longest = chain_budget(4, 1_000_000, fast=True)  # 10 bytes of state, 4 of a check
    assert f"{longest.cycle_s * 1e3:.2f} ms per cycle" in of(doctor(line), "wire budget").found
    budget = wire_budget(16, 1_000_000, fast=True)
    assert adapter.wire(budget, 250.0).grade == "warn"
    assert "at most 281 Hz" in adapter.wire(budget, 50.0).found


@pytest.mark.parametrize(("timer_ms", "grade"), [(None, "ok"), (1, "ok"), (2, "ok"), (16, "fail")])
def test_latency_timer(timer_ms: int | None, grade: str) -> None:
    finding = adapter.latency_timer(timer_ms, "/dev/ttyUSB0")
    assert finding.grade == grade
    if grade == "fail":
        assert "/usb-serial/devices/ttyUSB0/latency_timer" in finding.remedy


def test_permission(tmp_path: object, mocker: MockerFixture) -> None:
    assert adapter.permission("/dev/null").grade == "ok"
    mocker.patch("os.access", return_value=False)
    denied = adapter.permission("/dev/null")
    assert denied.grade == "fail"
    assert denied.remedy.startswith("sudo usermod -aG ")
    with pytest.raises(PortError, match="no such port"):
        adapter.permission(f"{tmp_path}/none")


def test_scan_goes_through_the_baud_rates_and_leaves_the_port_as_it_was(line: Recorder) -> None:
    line.bank["Baud Rate"][:] = [1, 3, 6, 3]
    steps: list[str] = []
    assert scan(line, on_progress=steps.append).servos == (
        ScanResult(1, "XM430-W350", 48, 57_600),
        ScanResult(2, "XM430-W350", 48, 1_000_000),
        ScanResult(3, "XM430-W350", 48, 4_000_000),
        ScanResult(4, "XM430-W350", 48, 1_000_000),
    )
    assert steps[:2] == ["57600 baud", "1000000 baud"]
    assert len(steps) == 8
    assert line.getBaudRate() == 1_000_000


def test_the_only_adapter_is_taken_and_else_one_is_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    class Port:
        def __init__(self, device: str) -> None:
            self.device, self.vid = device, 0x0403

    there = [Port("/dev/ttyUSB0")]
    monkeypatch.setattr("snakewalk.controller.bench.scan.list_ports.comports", lambda: there)
    assert pick_port(None) == "/dev/ttyUSB0"
    assert pick_port("/dev/x") == "/dev/x"
    there.append(Port("/dev/ttyACM0"))
    with pytest.raises(PortError, match="which one\\? there are /dev/ttyACM0, /dev/ttyUSB0"):
        pick_port(None)
    there.clear()
    with pytest.raises(PortError, match="no USB serial adapter"):
        pick_port(None)


def an_imu(imu: ImuConfig, rotation: np.ndarray, rate_dps: float = 0.0) -> SimLine:
    plant = BenchPlant(4)

    def motion() -> LinkMotion:
        turn = Rotation.from_euler("z", rate_dps * plant.time_s, degrees=True).as_matrix()
        return LinkMotion(plant.time_s, np.zeros(3), turn @ rotation)

    return SimLine(ServoBank(ROBOT.servo_ids), plant, imu=Imu(imu, motion))


DUCK = ImuConfig()
ON_ITS_SIDE = Rotation.from_euler("x", 90.0, degrees=True).as_matrix()


@pytest.mark.parametrize(
    ("rotation", "rate_dps", "grade", "found"),
    [
        (np.eye(3), 0.0, "ok", "imu_to_dxl (ID 200): link 0 is 0 degrees off upright"),
        (ON_ITS_SIDE, 0.0, "warn", "link 0 is 90 degrees off upright"),
        (np.eye(3), 30.0, "warn", "turns at up to 30"),
    ],
)
def test_the_imu_is_named_and_what_it_shows_is_judged(
    rotation: np.ndarray, rate_dps: float, grade: str, found: str
) -> None:
    line = an_imu(DUCK, rotation, rate_dps)
    finding = imu_finding(DynamixelBus(line), DUCK)
    assert finding.grade == grade
    assert found in finding.found
    assert bool(finding.remedy) == (grade != "ok")


def test_the_doctor_expects_the_imu_of_the_robot_and_no_other() -> None:
    line = an_imu(DUCK, np.eye(3))
    line.bank["Return Delay Time"][:] = 0
    robot = ROBOT.model_copy(update={"imu": DUCK})
    told = examine(
        line, robot, RunConfig(name="test", motion="source"), latency_s=0.004, latency_timer_ms=None
    )
    assert worst(told) == "ok"
    assert of(told, "imu").grade == "ok"
    unknown = of(doctor(line), "servo IDs")
    assert unknown.grade == "warn"
    assert unknown.found == "servo 200 is on the bus and not in the robot"
    line = an_imu(DUCK.model_copy(update={"id": 77}), np.eye(3))
    assert imu_finding(DynamixelBus(line), DUCK).grade == "fail"


def test_scan_names_both_imus() -> None:
    """One by its published number, the other by what only it shows, with a question mark."""
    g40 = ImuConfig(model="FFW-G40-IMU", id=9, gyro_range_dps=500.0, acceleration_range_g=4.0)
    for imu, name in ((g40, "FFW-G40-IMU"), (DUCK, "imu_to_dxl?, number 0")):
        found = {s.servo_id: s.model for s in scan(an_imu(imu, np.eye(3)), (1_000_000,)).servos}
        assert found == {**dict.fromkeys(ROBOT.servo_ids, "XM430-W350"), imu.id: name}
