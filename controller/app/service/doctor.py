"""Reads a bus and puts the checks in order; writes nothing to a servo."""

from collections.abc import Callable, Sequence

from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.controller.app.service import adapter
from snakewalk.controller.app.service import servo_checks as servos
from snakewalk.controller.app.service.finding import Finding
from snakewalk.controller.app.service.scan import has_baud, scan
from snakewalk.drivers.bus.budget import chain_budget
from snakewalk.drivers.bus.control_cycle import ControlCycle
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.start_up import FAST_READ_FIRMWARE, ServoReport, inspect
from snakewalk.drivers.errors import BusError, FaultCause
from snakewalk.drivers.port.byte_port import BytePort

_TEST_READS = 200


def examine(
    port: BytePort,
    robot: RobotConfig,
    safety: SafetyConfig,
    rate_hz: float,
    *,
    latency_s: float,
    latency_timer_ms: int | None,
    on_progress: Callable[[str], None] = lambda step: None,
) -> list[Finding]:
    """Findings about the bus, worst causes first.

    Raises:
        PortError: the port vanished.

    """
    bus = DynamixelBus(port, robot.models_by_id, latency_s=latency_s)
    findings = [adapter.latency_timer(latency_timer_ms, port.name)]
    on_progress("who answers")
    expected, baud = robot.servo_ids, port.getBaudRate()
    found = bus.find(expected)
    missing = [i for i in expected if i not in found]
    elsewhere = (
        _at_other_bauds(port, missing, on_progress) if missing and has_baud(port.name) else {}
    )
    findings += servos.presence(expected, list(found), elsewhere, baud, port.name)
    on_progress("who else is there")
    findings += [f for f in [servos.unexpected_ids(expected, list(bus.scan()))] if f is not None]
    if not found:
        return findings
    on_progress("duplicate IDs")
    findings.append(servos.duplicates([bus.probe(i) for i in found]))
    on_progress("registers")
    reports = _reports(bus, robot, findings)
    if reports:
        findings += [
            servos.firmware(reports),
            servos.return_delay(reports),
            servos.alarms(reports),
            servos.torque(reports),
            servos.supply(reports, *safety.voltage_limits_v(robot.servo)),
            servos.heat(reports, safety.temperature_limit_c),
        ]
        on_progress("group reads")
        fast = all(s.firmware >= FAST_READ_FIRMWARE for s in reports)
        findings.append(line_quality(bus.cycle([s.servo_id for s in reports], fast=fast)))
    fast = all(s.firmware >= FAST_READ_FIRMWARE for s in reports)
    findings.append(adapter.wire(chain_budget(robot.joint_count, baud, fast=fast), rate_hz))
    return findings


def line_quality(cycle: ControlCycle) -> Finding:
    """Damaged or missing answers in many group reads, as a run does them."""
    lost = sum(not cycle.read().valid.all() for _ in range(_TEST_READS))
    found = f"{lost} of {_TEST_READS} group reads incomplete"
    remedy = "cables, plugs, termination, a common ground; a lower baud rate"
    if lost > 0.05 * _TEST_READS:
        return Finding("line", "fail", found, remedy)
    if lost:
        return Finding("line", "warn", found, remedy)
    return Finding("line", "ok", found)


def _reports(
    bus: DynamixelBus, robot: RobotConfig, findings: list[Finding]
) -> Sequence[ServoReport]:
    try:
        inspection = inspect(bus, robot)
    except BusError as error:
        findings.append(Finding("registers", "fail", str(error), "run it again; then the cables"))
        return ()
    wrong = [str(f) for f in inspection.faults if f.cause is FaultCause.OTHER_MODEL]
    findings.append(
        servos.models(inspection.servos, wrong, ", ".join(dict.fromkeys(robot.servo_models)))
    )
    return inspection.servos


def _at_other_bauds(
    port: BytePort, missing: Sequence[int], on_progress: Callable[[str], None]
) -> dict[int, int]:
    answering = scan(port, on_progress=on_progress)
    return {s.servo_id: s.baud for s in answering if s.servo_id in missing}
