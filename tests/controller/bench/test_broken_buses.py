"""Simulated buses, each broken in one way, and what the doctor says of it; healthy ones besides.

The kinds are the rows of the table in `docs/reference/doctor-faults.md`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.robot import RobotConfig, ServoConfig
from snakewalk.config.run import RunConfig
from snakewalk.controller.bench.doctor import examine
from snakewalk.controller.bench.scan import ScanResult, scan
from snakewalk.controller.console.finding import Finding, worst
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.protocol.packet import (
    Instruction,
    InstructionPacket,
    StatusPacket,
    encode_instruction,
    encode_status,
)
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from snakewalk.sim.servo.protection import SupplyAndAmbient
from snakewalk.sim.servo.supply import Cabling

ROBOT = RobotConfig(name="four", joint_axes="ypyp")
PAGE = Path(__file__).parents[3] / "docs" / "reference" / "doctor-faults.md"
Plant = Callable[["TestLine"], None]


class TestLine(SimLine):
    """A line on which packets of others arrive, and on which replies may come late."""

    __test__ = False

    def __init__(self, servos: int = 4, start_rad: Sequence[float] | float = 0.0, **line: object):
        bank = ServoBank(range(1, servos + 1))
        bank["Return Delay Time"][:] = 0
        super().__init__(bank, BenchPlant(servos, start_rad=start_rad), **line)  # type: ignore[arg-type]
        self.others: tuple[float, bytes] = (np.inf, b"")
        self.late: Callable[[], float] = lambda: 0.0
        self._other_s = 0.0

    def read_until(self, count: int, deadline_s: float) -> bytes:
        period_s, packet = self.others
        while self._other_s + period_s < deadline_s:
            self._other_s += period_s
            if self._other_s > self.clock.now_s():
                self._rx_queue.add(self._other_s, packet)
        return super().read_until(count, deadline_s)

    def _reply_with_faults(self, data: bytes, now_s: float) -> Sequence[tuple[float, bytes]]:
        if self.tamper is not None:
            return super()._reply_with_faults(data, now_s)
        return ((self.late(), data),)


def set_register(name: str, value: int, row: int = 2) -> Plant:
    def plant(line: TestLine) -> None:
        line.bank[name][row] = value

    return plant


def every(count: int, hurt: Callable[[bytes], list[bytes]]) -> Plant:
    """Damage to one in ``count`` replies."""

    def plant(line: TestLine) -> None:
        turn = iter(range(10**9))
        line.tamper = lambda raw: hurt(raw) if next(turn) % count == 0 else [raw]

    return plant


def burst(raw: bytes) -> bytes:
    """Four bytes of noise over a reply."""
    return raw[:6] + b"\x5a\x00\xf3\x81" + raw[10:]


def fifth_has_id(servo_id: int, **differs: int) -> Plant:
    """A fifth servo with the ID of another one."""

    def plant(line: TestLine) -> None:
        line.bank["ID"][4] = servo_id
        for name, value in differs.items():
            line.bank[name.replace("_", " ")][4] = value

    return plant


def others(packet: bytes) -> Plant:
    def plant(line: TestLine) -> None:
        line.others = (0.05, packet)

    return plant


def nobody(line: TestLine) -> None:
    line.tamper = lambda _: []


def supply(volts: float, rows: Sequence[int] = (0, 1, 2, 3)) -> Plant:
    def plant(line: TestLine) -> None:
        line.firmware.protection._supply.change(volts, np.array(rows))

    return plant


def heat(celsius: float) -> Plant:
    def plant(line: TestLine) -> None:
        line.firmware.protection.temperature_c[1] = celsius

    return plant


def cables(*ohm: float) -> SupplyAndAmbient:
    """Power comes in at the first servo of four."""
    leads = Cabling(np.array(ohm), np.array([0.02, np.inf, np.inf, np.inf]))
    return SupplyAndAmbient(12.0, cabling=leads)


@dataclass(frozen=True)
class Kind:
    """One way of being broken, and the finding that names it."""

    name: str
    plant: Plant
    check: str
    found: str
    grade: str = "warn"
    line: dict[str, object] = field(default_factory=dict)
    timer_ms: int | None = None
    rate_hz: float = 50.0
    wiggle: bool = False


READ = encode_instruction(InstructionPacket(1, Instruction.READ, b"\x84\x00\x04\x00"))
REPLY = encode_status(StatusPacket(1, 0, b"\x00\x08\x00\x00"))
KINDS = [
    Kind("no power, or no cable", nobody, "servo IDs", "no answer from servos 1 to 4", "fail"),
    Kind(
        "one servo is silent",
        lambda line: line.mute(np.array([2]), True),
        "servo IDs",
        "no answer from servo 3",
        "fail",
    ),
    Kind("a servo that the robot lacks", set_register("ID", 77), "servo IDs", "servo 77 is on"),
    Kind(
        "one servo at another baud rate",
        set_register("Baud Rate", 1),
        "baud rate",
        "servo 3 answers at 57600 baud, not at 1000000",
        "fail",
    ),
    Kind(
        "all servos at another baud rate",
        lambda line: line.bank["Baud Rate"].fill(4),
        "baud rate",
        "servos 1 to 4 answer at 2000000 baud, not at 1000000",
        "fail",
    ),
    Kind(
        "one ID twice, servos alike",
        fifth_has_id(3),
        "duplicate IDs",
        "servo 3 answers with damaged bytes only: two servos have this ID",
        "fail",
        {"servos": 5, "start_rad": [0.0, 0.0, 0.1, 0.0, -0.2]},
    ),
    Kind(
        "one ID twice, servos that differ",
        fifth_has_id(3, Firmware_Version=46),
        "duplicate IDs",
        "servo 3 answers with damaged bytes only",
        "fail",
        {"servos": 5},
    ),
    Kind(
        "one ID twice, one replies later",
        fifth_has_id(3, Return_Delay_Time=250),
        "duplicate IDs",
        "servo 3 answers twice",
        "fail",
        {"servos": 5},
    ),
    Kind(
        "another model",
        set_register("Model Number", 1030),
        "model",
        "joint yaw_03 (ID 3): is a XM430-W210",
        "fail",
    ),
    Kind(
        "an old firmware", set_register("Firmware Version", 44), "firmware", "servo 3 has no fast"
    ),
    Kind("mixed firmwares", set_register("Firmware Version", 46), "firmware", "mixed: 46, 48"),
    Kind("return delay", set_register("Return Delay Time", 250), "return delay", "servo 3 waits"),
    Kind(
        "an alarm",
        set_register("Hardware Error Status", 0x24),
        "alarms",
        "joint yaw_03 (ID 3): overheating, overload",
        "fail",
    ),
    Kind("torque left on", set_register("Torque Enable", 1), "torque", "on at servo 3"),
    Kind("supply too low", supply(8.9), "supply", "below 10 V", "fail"),
    Kind("supply too high", supply(15.4), "supply", "above 14.8 V", "fail"),
    Kind("a thin cable", supply(11.2, [3]), "supply", "11.2 to 12.0 V along the chain"),
    Kind(
        "supply sags under load",
        lambda line: None,
        "supply under load",
        "it sags by",
        "fail",
        {"supply_and_ambient": SupplyAndAmbient(supply_ohm=4.0)},
        wiggle=True,
    ),
    Kind(
        "a bad plug between two servos",
        lambda line: None,
        "cables",
        "the one between servos 2 and 3 has",
        "fail",
        {"supply_and_ambient": cables(0.05, 5.0, 0.05)},
        wiggle=True,
    ),
    Kind(
        "cables too thin for the chain",
        lambda line: None,
        "cables",
        "voltage falls from",
        line={"supply_and_ambient": cables(2.0, 2.0, 2.0)},
        wiggle=True,
    ),
    Kind(
        "a servo too hot",
        heat(75.0),
        "temperature",
        "joint pitch_02 (ID 2) is the warmest: 7",
        "fail",
    ),
    Kind(
        "a bad line",
        every(9, lambda raw: [raw[:-1] + bytes((raw[-1] ^ 1,))]),
        "line",
        " group reads incomplete",
        "fail",
    ),
    Kind(
        "noise on a floating line",
        others(b"\x00\xff"),
        "second master",
        "bytes came without a request",
    ),
    Kind(
        "noise in every reply",
        every(1, lambda raw: [burst(raw)]),
        "noise",
        "damaged bytes after 40 of 40 requests, of servos 1 to 4: noise on the line",
        "fail",
    ),
    Kind(
        "a second master: its requests",
        others(READ),
        "second master",
        "another program or adapter talks to these servos",
        "fail",
    ),
    Kind(
        "a second program: its replies",
        others(REPLY),
        "second master",
        "another program or adapter talks to these servos",
        "fail",
    ),
    Kind(
        "the adapter's latency timer",
        lambda line: None,
        "latency timer",
        "16 ms: every answer",
        "fail",
        timer_ms=16,
    ),
    Kind(
        "an adapter's latency",
        lambda line: None,
        "response time",
        "replies come 15.0 ms later than the wire needs",
        line={"usb_latency_s": 0.015},
    ),
    Kind(
        "a rate that the wire does not carry",
        lambda line: None,
        "wire budget",
        "at most",
        "fail",
        rate_hz=1000.0,
    ),
    Kind(
        "status return level 0",
        set_register("Status Return Level", 0),
        "status return level",
        "servo 3 replies to pings and not to reads",
        "fail",
    ),
    Kind(
        "status return level 1",
        set_register("Status Return Level", 1),
        "status return level",
        "joint yaw_03 (ID 3) does not reply to writes",
    ),
    Kind(
        "a homing offset",
        set_register("Homing Offset", 100),
        "homing offset",
        "joint yaw_03 (ID 3) by +0.15 rad",
    ),
    Kind(
        "reversed",
        set_register("Drive Mode", 1),
        "drive mode",
        "joint yaw_03 (ID 3) has a reversed direction",
    ),
    Kind(
        "torque by a goal",
        set_register("Drive Mode", 8),
        "drive mode",
        "joint yaw_03 (ID 3) switches torque on at any goal",
    ),
    Kind(
        "time-based profile",
        set_register("Drive Mode", 4),
        "drive mode",
        "joint yaw_03 (ID 3) has time-based profiles",
    ),
    Kind(
        "torque at power-up",
        set_register("Startup Configuration", 1),
        "startup configuration",
        "joint yaw_03 (ID 3) has torque or old RAM values again as soon as there is power",
    ),
    Kind(
        "a secondary ID",
        set_register("Secondary(Shadow) ID", 2),
        "secondary ID",
        "joint yaw_03 (ID 3) obeys ID 2 as well",
        "fail",
    ),
    Kind(
        "IDs exchanged since the last run",
        lambda line: line.bank["Velocity I Gain"].put(range(4), [1, 3, 2, 4]),
        "joint order",
        "in the last run joint pitch_02 (ID 2) was joint yaw_03 (ID 3), "
        "joint yaw_03 (ID 3) was joint pitch_02 (ID 2)",
    ),
    Kind(
        "alarms that do not shut down",
        set_register("Shutdown", 0),
        "shutdown",
        "joint yaw_03 (ID 3) stays on, overloaded or overheated",
    ),
    Kind(
        "PWM limit of 0",
        set_register("PWM Limit", 0),
        "PWM limit",
        "joint yaw_03 (ID 3) cannot move",
        "fail",
    ),
    Kind(
        "PWM limit below full",
        set_register("PWM Limit", 300),
        "PWM limit",
        "joint yaw_03 (ID 3) has a PWM Limit(36) below 885",
    ),
    Kind(
        "goal PWM of another program",
        set_register("Goal PWM", 0),
        "goal PWM",
        "joint yaw_03 (ID 3) has a",
    ),
    Kind(
        "gains of another program",
        set_register("Position D Gain", 4000),
        "gains",
        "joint yaw_03 (ID 3): Position D Gain 4000",
    ),
    Kind(
        "a profile of another program",
        set_register("Profile Velocity", 30),
        "profile",
        "joint yaw_03 (ID 3): Profile Velocity 30",
    ),
    Kind(
        "another operating mode",
        set_register("Operating Mode", 1),
        "operating mode",
        "joint yaw_03 (ID 3): Operating Mode 1",
    ),
    Kind(
        "a current limit below the robot's",
        set_register("Current Limit", 10, 3),
        "current limit",
        "joint pitch_04 (ID 4) has a Current Limit(38) below",
        "fail",
    ),
    Kind(
        "a watchdog that has stopped a servo",
        set_register("Bus Watchdog", 255),
        "watchdog",
        "joint yaw_03 (ID 3) has been stopped by the bus watchdog",
    ),
    Kind(
        "a joint outside its limits",
        lambda line: None,
        "pose",
        "joint yaw_03 (ID 3): stands at 2.50 rad, beyond its limit",
        "fail",
        {"start_rad": [0.0, 0.0, 2.5, 0.0]},
    ),
]


def doctor(line: TestLine, kind: Kind | None = None, robot: RobotConfig = ROBOT) -> list[Finding]:
    line.setBaudRate(line.getBaudRate())
    line.firmware.apply_registers()
    return examine(
        line,
        robot,
        RunConfig(name="test", motion="source", cycle_hz=50.0 if kind is None else kind.rate_hz),
        latency_s=0.02 if kind is not None and "usb_latency_s" in kind.line else 0.004,
        latency_timer_ms=None if kind is None else kind.timer_ms,
        wiggle=kind is not None and kind.wiggle,
    )


@pytest.mark.slow_cases(10, "40 cases of 0.0 s of CPU")
@pytest.mark.fast_cases(8)
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_the_doctor_names_what_is_broken(kind: Kind) -> None:
    line = TestLine(**kind.line)  # type: ignore[arg-type]
    kind.plant(line)
    findings = doctor(line, kind)
    named = [f for f in findings if f.check == kind.check and kind.found in f.found]
    assert [f.grade for f in named] == [kind.grade], findings
    assert named[0].remedy


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize("into_s", [0.0, 0.011, 0.024, 0.04])
def test_a_supply_that_sags_is_named_whenever_the_wiggle_begins(into_s: float) -> None:
    """Simulated servos measured their voltage every 50 ms: half of all wiggles missed the sag."""
    line = TestLine(supply_and_ambient=SupplyAndAmbient(supply_ohm=4.0))
    line.clock.advance(0.3 + into_s)
    findings = doctor(line, Kind("", lambda line: None, "", "", wiggle=True))
    assert "it sags by" in {f.check: f.found for f in findings}["supply under load"]


def test_replies_to_another_program_are_no_second_servo() -> None:
    line = TestLine()
    others(REPLY)(line)
    assert "duplicate IDs" not in {f.check for f in doctor(line)}


def test_the_page_lists_every_kind() -> None:
    page = PAGE.read_text(encoding="utf-8")
    missing = [kind.name for kind in KINDS if f"| {kind.name} | `{kind.check}`" not in page]
    assert missing == []


@pytest.mark.parametrize("wiggle", [False, True])
def test_a_healthy_bus_gives_no_alarm(wiggle: bool) -> None:
    findings = doctor(TestLine(), Kind("", lambda line: None, "", "", wiggle=wiggle))
    assert worst(findings) == "ok", findings
    assert ("supply under load" in {f.check for f in findings}) == wiggle


def test_a_bus_that_a_run_has_left_gives_no_alarm() -> None:
    line = TestLine()
    chain = ServoChain(DynamixelBus(line), ROBOT)
    chain.enable()
    chain.disable()
    findings = doctor(line)
    assert worst(findings) == "ok", findings


@pytest.mark.parametrize("model", ["XL330-M288", "XC330-T288", "XM540-W270", "XH430-V350"])
def test_servos_as_the_factory_leaves_them_give_no_alarm_but_their_delay(model: str) -> None:
    bank = ServoBank(range(1, 5), model)
    line = SimLine(bank, BenchPlant(4))
    nominal_v = {"XL330-M288": 5.0, "XH430-V350": 24.0}.get(model, 12.0)
    servo = ServoConfig(model=model, supply_v=nominal_v)
    findings = doctor(line, robot=RobotConfig(name="four", joint_axes="ypyp", servo=servo))  # type: ignore[arg-type]
    assert {f.check for f in findings if f.grade != "ok"} == {"return delay"}, findings


@pytest.mark.parametrize("late_s", [0.012, 0.06])
def test_a_busy_computer_is_no_broken_bus(late_s: float) -> None:
    """One reply in eight is late: within every time-out, and beyond all but the longest."""
    line = TestLine()
    turn = iter(range(10**9))
    line.late = lambda: late_s if next(turn) % 8 == 7 else 0.0
    findings = doctor(line)
    assert worst(findings) == "ok", findings


def test_scan_tells_a_secondary_id() -> None:
    line = TestLine()
    line.bank["Secondary(Shadow) ID"][2] = 2
    line.setBaudRate(1_000_000)
    found = {servo.servo_id: servo.secondary_id for servo in scan(line, (1_000_000,)).servos}
    assert found == {1: None, 2: None, 3: 2, 4: None}


def test_a_line_without_a_baud_rate_is_told_once() -> None:
    class NoBaud(TestLine):
        def _on_baud_change(self, baud: int) -> None:
            super()._on_baud_change(1_000_000)

    results = scan(NoBaud()).servos
    assert list(results) == [ScanResult(k, "XM430-W350", 48, 1_000_000) for k in range(1, 5)]
