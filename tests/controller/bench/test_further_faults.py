"""Further faults of ``docs/reference/doctor-faults.md``, and sound buses that give no alarm.

The kinds are the rows of the second table of that page.
"""

import json
import random
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial

import numpy as np
import pytest
from typer.testing import CliRunner

from snakewalk.config.loader import load_robot
from snakewalk.config.robot import ImuConfig
from snakewalk.config.run import RunConfig
from snakewalk.controller.bench.doctor import examine
from snakewalk.controller.bench.port_lines import PortLines
from snakewalk.controller.cli.command_line import app
from snakewalk.controller.console.finding import Finding, worst
from snakewalk.sim.ax12.ax12 import Ax12Servos
from snakewalk.sim.ax12.line import Ax12Line
from snakewalk.sim.serve.bench_line import bench_line
from snakewalk.sim.serve.chain_spec import parse_chain
from snakewalk.sim.servo.bench import BenchPlant
from tests.controller.bench.test_broken_buses import (
    PAGE,
    ROBOT,
    Kind,
    TestLine,
    doctor,
    heat,
    set_register,
    supply,
)
from tests.controller.bench.test_restarts import losing_power

Step = Callable[[TestLine], None]


def registers(*values: tuple[str, int, int]) -> Step:
    """Set several registers: name, row, value."""

    def plant(line: TestLine) -> None:
        for name, row, value in values:
            line.bank[name][row] = value

    return plant


def reads_as(name: str, value: int) -> Step:
    """A sensor of servo 3 that shows this value, whatever it measures."""

    def plant(line: TestLine) -> None:
        refresh = line.firmware.refresh

        def then_broken(*given: object, **named: object) -> None:
            refresh(*given, **named)  # type: ignore[arg-type]
            line.bank[name][2] = value

        line.firmware.refresh = then_broken  # type: ignore[method-assign]

    return plant


def turning(line: TestLine) -> None:
    """Somebody turns joint 3 by 0.4 rad a second."""
    advance = line.firmware.advance

    def then_turned(until_s: float) -> None:
        advance(until_s)
        line.firmware.plant.position_rad[2] = 0.4 * until_s

    line.firmware.advance = then_turned  # type: ignore[method-assign]


def later(servo_ids: Sequence[int], late_s: float) -> Step:
    """Servos, or all if none is named, whose replies come late."""

    def plant(line: TestLine) -> None:
        reply = line._reply_with_faults

        def slow(data: bytes, now_s: float) -> Sequence[tuple[float, bytes]]:
            is_slow = not servo_ids or data[4] in servo_ids
            return [(delay + late_s * is_slow, raw) for delay, raw in reply(data, now_s)]

        line._reply_with_faults = slow  # type: ignore[method-assign]

    return plant


def deaf_to(*instructions: int) -> Step:
    """Firmware or adapter that drops these requests."""

    def plant(line: TestLine) -> None:
        write = line.write

        def dropped(data: bytes) -> None:
            if data[7:8] not in [bytes((each,)) for each in instructions]:
                write(data)

        line.write = dropped  # type: ignore[method-assign]

    return plant


def echoing(line: TestLine) -> None:
    """An adapter that receives what it sends."""
    write = line.write

    def echoed(data: bytes) -> None:
        write(data)
        line._rx_queue.add(line.clock.now_s(), bytes(data))

    line.write = echoed  # type: ignore[method-assign]


def loose_plug(line: TestLine) -> None:
    """Every fifth reply of servo 3 is lost, and with it the end of a group read."""
    turn = iter(range(10**9))
    line.tamper = lambda raw: [] if raw[4] in (3, 254) and next(turn) % 5 == 0 else [raw]


def sagging(line: TestLine) -> None:
    """A supply whose voltage falls during the check."""
    protection = line.firmware.protection
    begin_s = line.clock.now_s()
    for k in range(200):
        volts = 13.5 - 0.1 * (k % 25)
        fall = partial(protection.supply, volts, np.arange(4))
        line.firmware.events.schedule(begin_s + 0.02 * k, fall)


def moved_ids(line: TestLine) -> None:
    line.bank["ID"][:4] = [11, 5, 8, 40]


FURTHER = [
    Kind("IDs other than the robot's", moved_ids, "servo IDs", "no answer from", "fail"),
    Kind(
        "an alarm of a servo that the robot lacks",
        registers(("ID", 4, 9), ("Hardware Error Status", 4, 0x20)),
        "alarms",
        "servo 9: overload (not in the robot)",
        "fail",
        {"servos": 5},
    ),
    Kind("transmit echo", echoing, "transmit echo", "the host receives each byte that it", "fail"),
    Kind(
        "a servo with slow replies",
        later([3], 0.003),
        "response time",
        "slower than the others: servo 3 by 3.0 ms",
    ),
    Kind(
        "a servo whose replies come 30 ms late",
        later([3], 0.03),
        "response time",
        "slower than the others: servo 3 by 30.0 ms",
    ),
    Kind(
        "an adapter slower than configured",
        later([], 0.012),
        "response time",
        "the driver waits 4 ms: a run loses all of them",
        "fail",
    ),
    Kind(
        "a servo new from the factory",
        registers(("ID", 4, 1), ("Baud Rate", 4, 1)),
        "baud rate",
        "servo 1 answers at 57600 baud, the factory's, not at 1000000: new",
        line={"servos": 5},
    ),
    Kind(
        "a servo new from the factory in place of a joint's",
        registers(("ID", 2, 1), ("Baud Rate", 2, 1)),
        "baud rate",
        "servo 1 answers at 57600 baud, the factory's",
        "fail",
    ),
    Kind(
        "several servos new from the factory",
        registers(
            ("ID", 4, 1),
            ("ID", 5, 1),
            ("Baud Rate", 4, 1),
            ("Baud Rate", 5, 1),
            ("Firmware Version", 5, 46),
        ),
        "baud rate",
        "damaged replies come at 57600 baud",
        "fail",
        {"servos": 6, "start_rad": [0.0] * 6},
    ),
    Kind(
        "a cable that is broken behind a servo",
        lambda line: line.mute(np.array([2, 3]), True),
        "servo IDs",
        "no answer from servos 3, 4",
        "fail",
    ),
    Kind(
        "a model that is not known",
        set_register("Model Number", 9999),
        "model",
        "joint yaw_03 (ID 3): is a number 9999",
        "fail",
    ),
    Kind("a temperature sensor that reads 0", heat(0.0), "temperature", "(ID 2) reports 0 C"),
    Kind("a servo warmer than the others", heat(52.0), "temperature", "the others have about"),
    Kind(
        "position limits of another program",
        registers(("Min Position Limit", 2, 1900), ("Max Position Limit", 2, 2200)),
        "position limits",
        "joint yaw_03 (ID 3) has position limits (48, 52) within",
    ),
    Kind(
        "a velocity limit of another program",
        set_register("Velocity Limit", 30),
        "velocity limit",
        "joint yaw_03 (ID 3): Velocity Limit 30, factory 200",
    ),
    Kind(
        "a temperature limit that was changed",
        set_register("Temperature Limit", 100),
        "temperature limit",
        "Temperature Limit 100, factory 80",
    ),
    Kind(
        "a voltage limit that was changed",
        set_register("Min Voltage Limit", 60),
        "min voltage limit",
        "Min Voltage Limit 60, factory 95",
    ),
    Kind(
        "a joint that is moved meanwhile",
        turning,
        "motion",
        "joint yaw_03 (ID 3) moves during the check",
    ),
    Kind(
        "a current sensor that is off",
        reads_as("Present Current", 120),
        "current sensor",
        "joint yaw_03 (ID 3) has a current without torque",
    ),
    Kind(
        "a registered write that waits",
        set_register("Registered Instruction", 1),
        "registered instruction",
        "joint yaw_03 (ID 3) has a registered write waiting",
    ),
    Kind("a loose plug of one servo", loose_plug, "line", "replies of servo 3 get lost", "fail"),
    Kind(
        "two servos with one ID that the robot lacks",
        registers(("ID", 4, 9), ("ID", 5, 9), ("Return Delay Time", 5, 250)),
        "duplicate IDs",
        "servo 9 answers twice or damaged",
        "fail",
        {"servos": 6, "start_rad": [0.0] * 6},
    ),
    Kind(
        "a device other than a servo",
        registers(("ID", 4, 9), ("Model Number", 4, 9999)),
        "servo IDs",
        "ID 9 is model number 9999, not a known servo model",
        line={"servos": 5},
    ),
    Kind(
        "a dual joint's second servo",
        set_register("Drive Mode", 2),
        "drive mode",
        "joint yaw_03 (ID 3) follows another servo's sync cable",
    ),
    Kind(
        "a servo that restarts",
        losing_power(0.9),
        "power",
        "joint yaw_03 (ID 3) restarts while doctor runs",
        "fail",
    ),
    Kind(
        "a current limit of 0 without a limit in the robot's file",
        set_register("Current Limit", 0),
        "current limit",
        "joint yaw_03 (ID 3) has a Current Limit(38) of 0",
    ),
    Kind("a supply that changes at rest", sagging, "supply", "changes by", "warn"),
    Kind(
        "goal current of another program",
        set_register("Goal Current", 10, 3),
        "goal current",
        "joint pitch_04 (ID 4) has a Goal Current(102) below",
    ),
    Kind(
        "torque of a servo that the robot lacks",
        registers(("ID", 4, 9), ("Torque Enable", 4, 1)),
        "torque",
        "on at servo 9 (not in the robot)",
        line={"servos": 5},
    ),
    Kind(
        "a voltage sensor that reads 0",
        reads_as("Present Input Voltage", 0),
        "supply",
        "0.0 to 12.0 V",
        "fail",
    ),
    Kind(
        "a velocity sensor that is off",
        reads_as("Present Velocity", 60),
        "velocity sensor",
        "joint yaw_03 (ID 3) reports a velocity, but stands",
    ),
    Kind(
        "a temperature that no motor bears",
        reads_as("Present Temperature", 246),
        "temperature",
        "joint yaw_03 (ID 3) reports more than any motor bears",
        "fail",
    ),
    Kind(
        "fast reads without a reply",
        deaf_to(0x8A),
        "line",
        "3 of 200 group reads incomplete: all fast ones, but no plain one",
    ),
    Kind(
        "group reads without a reply",
        deaf_to(0x82, 0x8A),
        "line",
        "group reads incomplete, though each servo replies by itself",
        "fail",
    ),
    Kind(
        "all servos with the factory's ID",
        registers(*(("ID", row, 1) for row in range(4))),
        "duplicate IDs",
        "servo 1 answers with damaged bytes only",
        "fail",
        {"start_rad": [0.0, 0.1, 0.2, -0.3]},
    ),
]
BESIDES = (
    ("a servo of Protocol 1.0", "protocol"),
    ("servos of another make", "protocol"),
    ("an IMU that is missing", "imu"),
)
"""Kinds with a test of their own."""


@pytest.mark.fast_cases(11)
@pytest.mark.parametrize("kind", FURTHER, ids=lambda kind: kind.name)
def test_the_doctor_names_further_faults(kind: Kind) -> None:
    line = TestLine(**kind.line)  # type: ignore[arg-type]
    kind.plant(line)
    findings = doctor(line, kind)
    named = [f for f in findings if f.check == kind.check and kind.found in f.found]
    assert [f.grade for f in named] == [kind.grade], findings
    assert named[0].remedy


def check(findings: list[Finding], name: str) -> Finding:
    return next(f for f in findings if f.check == name and f.grade != "ok")


def test_a_chain_with_other_ids_is_sent_to_calibrate() -> None:
    """It was sent to the cable of servo 1."""
    line = TestLine()
    moved_ids(line)
    remedy = check(doctor(line), "servo IDs").remedy
    assert "snakewalk bus inventory --port simulated line -o my-robot.toml" in remedy
    assert "bus calibrate" in remedy
    assert "cable" not in remedy


def test_one_servo_in_place_of_another_is_given_its_id() -> None:
    line = TestLine()
    line.bank["ID"][2] = 77
    remedy = check(doctor(line), "servo IDs").remedy
    assert remedy.endswith("--id 77 --new-id 3")
    line = TestLine()
    registers(("ID", 2, 1), ("Baud Rate", 2, 1))(line)
    remedy = check(doctor(line), "baud rate").remedy
    assert remedy.endswith("--baud 57600 --id 1 --new-id 3 --new-baud 1000000")


def test_a_command_without_a_robot_asks_for_one_and_names_no_file(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It said what to write into the robot's file, and sent the user to the cable of servo 5."""
    line = TestLine(servos=5)
    line.bank["ID"][4] = 77
    line.setBaudRate(line.getBaudRate())
    line.latency_s, line.latency_timer_ms = 0.004, None  # type: ignore[attr-defined]

    @contextmanager
    def opened(device: str, baud: int) -> Iterator[PortLines]:
        yield PortLines(device, ((line, None),))  # type: ignore[arg-type]

    monkeypatch.setattr("snakewalk.controller.bench.commands.doctor.open_lines", opened)
    monkeypatch.setattr(
        "snakewalk.controller.bench.commands.doctor.permission",
        lambda device: Finding("permission", "ok", device),
    )
    result = CliRunner().invoke(app, ["doctor", "--port", "/dev/ttyNONE", "--json"])
    told = json.loads(result.stdout)
    texts = " ".join(f"{each['found']} {each['remedy']}" for each in told["findings"])
    assert ".toml" not in texts.replace("-o my-robot.toml", "")
    assert "TOML" not in texts
    assert "alternating16" not in texts
    (robot,) = [each for each in told["findings"] if each["check"] == "robot"]
    assert robot["found"] == "--robot is not given, so servos 1 to 16 are expected"


def test_servos_of_protocol_1_are_named() -> None:
    line = Ax12Line(Ax12Servos([1, 2, 3, 4], BenchPlant(4)))
    findings = examine(
        line, ROBOT, RunConfig(name="test", motion="source"), latency_s=0.004, latency_timer_ms=None
    )
    assert check(findings, "protocol").found == (
        "in Protocol 1.0 servos 1 to 4 reply at 1000000 baud"
    )
    found = check(findings, "servo IDs")
    assert found.found == "servos 1 to 4 reply in another protocol than the robot's servos"
    assert "is the servo power on" not in " ".join(each.remedy for each in findings)
    assert not [each for each in findings if each.check == "baud rate" and each.grade != "ok"]


def test_a_silent_servo_next_to_protocol_1_is_named_by_itself() -> None:
    """Servo 4 is silent; the others of its chain have power, but another protocol."""
    line = Ax12Line(Ax12Servos([1, 2, 3], BenchPlant(3)))
    findings = examine(
        line, ROBOT, RunConfig(name="test", motion="source"), latency_s=0.004, latency_timer_ms=None
    )
    rows = [(each.found, each.remedy) for each in findings if each.check == "servo IDs"]
    assert [found for found, _ in rows] == [
        "servos 1 to 3 reply in another protocol than the robot's servos",
        "no answer from servo 4",
    ]
    assert rows[1][1].startswith("look at the cable in front of servo 4")


@pytest.mark.slow
def test_feetech_servos_of_a_robot_with_dynamixel_servos_are_named() -> None:
    """They were reported as DYNAMIXEL servos of Protocol 1.0."""
    line = bench_line(parse_chain("1-4:STS3215"), 1_000_000)
    findings = examine(
        line, ROBOT, RunConfig(name="test", motion="source"), latency_s=0.004, latency_timer_ms=None
    )
    named = check(findings, "protocol")
    assert named.found == "servos 1 to 4 are STS3215, of another make than XM430-W350"
    assert "'STS3215'" in named.remedy
    assert check(findings, "servo IDs").found.startswith("servos 1 to 4 reply in another protocol")


def test_dynamixel_servos_of_a_robot_with_feetech_servos_are_named() -> None:
    """The doctor asked whether they have power."""
    robot = load_robot("sts3215-12")
    line = bench_line(parse_chain("1-11:XM430-W350"), 1_000_000)
    findings = examine(
        line, robot, RunConfig(name="test", motion="source"), latency_s=0.004, latency_timer_ms=None
    )
    named = check(findings, "protocol")
    assert named.found == "servos 1 to 11 are XM430-W350, of another make than STS3215"
    rows = [each.found for each in findings if each.check == "servo IDs" and each.grade != "ok"]
    assert rows[1:] == ["no answer from servo 12"]


def test_an_imu_that_is_missing_is_named() -> None:
    robot = ROBOT.model_copy(update={"imu": ImuConfig()})
    assert check(doctor(TestLine(), robot=robot), "imu").grade == "fail"


def test_the_page_lists_every_further_kind() -> None:
    page = PAGE.read_text(encoding="utf-8")
    kinds = [(kind.name, kind.check) for kind in FURTHER] + list(BESIDES)
    assert [name for name, of in kinds if f"| {name} | `{of}`" not in page] == []


@pytest.mark.fast_cases(10)
@pytest.mark.parametrize("seed", range(20))
def test_a_sound_bus_gives_no_alarm(seed: int) -> None:
    """Poses, temperatures and voltages as they may be, on a computer that is busy or not.

    A third of the replies come in two parts, the second of which misses the deadline of a request;
    three of 21 such buses were said to have noise.
    """
    rng = random.Random(seed)
    line = TestLine(start_rad=[rng.uniform(-1.0, 1.0) for _ in range(4)])
    line.firmware.protection.temperature_c[:] = [rng.uniform(24.0, 36.0) for _ in range(4)]
    supply(rng.uniform(11.3, 13.5))(line)
    reply = line._reply_with_faults

    def in_parts(data: bytes, now_s: float) -> Sequence[tuple[float, bytes]]:
        if seed % 2 == 0 or rng.random() > 0.3:
            return reply(data, now_s)
        cut = rng.randrange(1, len(data))
        return [(0.0, data[:cut]), (rng.uniform(0.002, 0.03), data[cut:])]

    line._reply_with_faults = in_parts  # type: ignore[method-assign]
    findings = doctor(line)
    assert worst(findings) == "ok", [f for f in findings if f.grade != "ok"]
