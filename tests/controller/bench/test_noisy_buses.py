"""The doctor and the scan on lines with noise: it is named, and nothing else is named for it."""

from collections.abc import Sequence
from itertools import count

import pytest

from snakewalk.config.faults import FaultPlan
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.controller.bench.doctor import examine
from snakewalk.controller.bench.scan import ScanResult, scan
from snakewalk.controller.console.finding import Finding, worst
from snakewalk.drivers.protocol.registers import BAUDS
from snakewalk.sim.faults.fault_player import FaultPlayer
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from tests.controller.bench.test_broken_buses import TestLine, burst, every
from tests.helpers.tiers import slow_after

ROBOT = RobotConfig(name="six", joint_axes="ypypyp")
BOUND_S = 17.0
"""What six servos may take, whatever the noise."""


def a_line(*faults: dict[str, object], seed: int = 1) -> SimLine:
    bank = ServoBank(ROBOT.servo_ids)
    bank["Return Delay Time"][:] = 0
    line = SimLine(bank, BenchPlant(6))
    FaultPlayer(line, FaultPlan.model_validate({"seed": seed, "fault": list(faults)}))
    return line


def doctor(line: SimLine) -> list[Finding]:
    return examine(
        line, ROBOT, RunConfig(name="test", motion="source"), latency_s=0.02, latency_timer_ms=None
    )


def strays(line: TestLine) -> None:
    line.others = (0.003, b"\x5a")


def wrong(findings: Sequence[Finding]) -> set[str]:
    return {each.check for each in findings if each.grade != "ok"}


NOISE = [
    {"kind": kind, "chance": chance, "of": of}
    for kind in ("corrupt", "truncate")
    for chance in (0.3, 0.6, 1.0)
    for of in ("answers", "both")
    if (chance, of) != (1.0, "both")  # no request is heard: as quiet as a bus without power
]


@pytest.mark.fast_cases(8)
@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("fault", NOISE, ids=lambda fault: "-".join(map(str, fault.values())))
def test_noise_is_named_within_a_bounded_time_and_nothing_for_it(
    fault: dict[str, object], seed: int
) -> None:
    """It took 35 s, and named duplicate IDs, silent servos and wrong baud rates."""
    line = a_line(fault, seed=seed)
    findings = doctor(line)
    named = {each.check: each for each in findings}
    assert "noise on the line" in named["noise"].found, findings
    assert named["noise"].grade == "fail"
    assert wrong(findings) <= {"noise", "line", "registers"}, findings
    assert line.clock.now_s() < BOUND_S


@pytest.mark.parametrize("gone", [1, 6])
def test_servos_without_power_do_not_take_longer(gone: int) -> None:
    line = a_line({"kind": "mute", "ids": list(range(1, 1 + gone))})
    assert wrong(doctor(line)) >= {"servo IDs"}
    assert line.clock.now_s() < BOUND_S


def test_stray_bytes_hide_no_alarm() -> None:
    """No servo was read, and the exit code was 0: each had an ID twice by the doctor's rule."""
    line = TestLine(6)
    strays(line)
    line.bank["Hardware Error Status"][2] = 0x20
    findings = doctor(line)
    assert wrong(findings) == {"second master", "noise", "alarms"}, findings
    assert worst(findings) == "fail"


def test_a_servo_with_two_ids_is_still_named_where_others_have_no_damage() -> None:
    line = TestLine(6)
    line.bank["ID"][5] = 3
    line.bank["Firmware Version"][5] = 46
    line.setBaudRate(line.getBaudRate())
    findings = doctor(line)
    assert "noise" not in {each.check for each in findings}
    assert {"duplicate IDs", "servo IDs"} <= wrong(findings)


def test_a_few_bytes_of_noise_are_a_warning() -> None:
    line = TestLine(6)
    every(23, lambda raw: [burst(raw)])(line)
    noise = next(each for each in doctor(line) if each.check == "noise")
    assert noise.grade == "warn"
    assert noise.remedy


@pytest.mark.slow_cases(2, "5 cases of 0.4 s of CPU")
@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("of", ["answers", "both"])
@pytest.mark.parametrize("kind", slow_after(2, ["corrupt", "truncate", "drop"]))
def test_a_scan_of_a_bad_line_finds_nearly_all_and_each_at_its_own_rate(kind: str, of: str) -> None:
    """One broadcast ping lost half of six servos at noise in 30 % of the packets."""
    truth = dict.fromkeys((1, 2, 3, 4), 1_000_000) | dict.fromkeys((5, 6), 57_600)
    missed = bad = 0
    for seed in range(20):
        line = a_line({"kind": kind, "chance": 0.3, "of": of}, seed=seed)
        line.bank["Baud Rate"][4:] = 1
        line.setBaudRate(1_000_000)
        report = scan(line)
        assert not report.noise_bytes or kind != "drop"
        bad += report.bad_line is not None
        found = {(each.servo_id, each.baud) for each in report.servos}
        assert found <= set(truth.items())
        missed += len(truth) - len(found)
    assert missed <= 0.1 * 20 * len(truth)
    assert bad >= 18  # where it is not told, every packet that was sent has arrived


class NoBaud(TestLine):
    """A line on which no baud rate counts, as behind some serial servers."""

    def _on_baud_change(self, baud: int) -> None:
        super()._on_baud_change(1_000_000)


def test_a_servo_on_a_bad_line_without_a_baud_rate_is_told_once() -> None:
    """Those that had not answered at each rate were told at all the others."""
    line = NoBaud()
    turn = count()
    line.tamper = lambda raw: [burst(raw)] if next(turn) % 10 in (1, 4, 8) else [raw]
    assert scan(line).servos == tuple(
        ScanResult(servo_id, "XM430-W350", 48, 1_000_000) for servo_id in range(1, 5)
    )


def test_two_servos_with_one_id_at_two_rates_are_told_at_both() -> None:
    line = TestLine(4)
    line.bank["ID"][3] = 3
    line.bank["Baud Rate"][3] = 1
    line.setBaudRate(1_000_000)
    report = scan(line)
    found = [(each.servo_id, each.baud) for each in report.servos]
    assert found == [(1, 1_000_000), (2, 1_000_000), (3, 57_600), (3, 1_000_000)]
    assert report.bad_line is None


def test_noise_where_nobody_answers_is_told() -> None:
    line = TestLine()
    line.tamper = lambda raw: [burst(raw)]
    report = scan(line)
    assert report.servos == ()
    assert report.bad_line is not None
    assert "at 1000000 baud" in report.bad_line
    assert "noise on the line" in report.bad_line


def test_strays_at_every_rate_are_summed() -> None:
    line = TestLine()
    strays(line)
    begin_s = line.clock.now_s()
    report = scan(line)
    assert line.clock.now_s() - begin_s < 20.0  # silent rates are not asked again: all have noise
    assert len(report.servos) == 4
    assert f" at {len(BAUDS)} baud rates" in (report.bad_line or "")
