"""Reads a bus and puts the checks in order; writes nothing to a servo unless the joints wiggle."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from snakewalk.config.robot import ImuConfig, RobotConfig
from snakewalk.config.run import RunConfig, SafetyConfig
from snakewalk.config.servo_model import ServoModel, wire_format
from snakewalk.controller.bench import adapter, line_checks
from snakewalk.controller.bench import servo_checks as servos
from snakewalk.controller.bench.register_checks import (
    ServoRegisters,
    read_registers,
    register_findings,
)
from snakewalk.controller.bench.scan import scan
from snakewalk.controller.bench.supply_check import supply_under_load
from snakewalk.controller.bench.unlisted_devices import (
    factory_servos,
    foreign_replies,
    transmit_echo,
    unlisted,
)
from snakewalk.controller.console.finding import Finding, shown_subject, worst
from snakewalk.drivers.bus.budget import robot_budget
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.bus.feetech_bus import servo_bus
from snakewalk.drivers.bus.feetech_scan import find_feetech
from snakewalk.drivers.bus.probe import Overheard, Probe, overhear
from snakewalk.drivers.bus.segmented_bus import SegmentedBus
from snakewalk.drivers.chain.imu_reader import ImuReader
from snakewalk.drivers.chain.joint_codec import JointUnits
from snakewalk.drivers.chain.start_up import ServoReport, inspect
from snakewalk.drivers.errors import BusError, ChainError, FaultCause, ServoError
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.port.line_port import LinePort
from snakewalk.drivers.protocol.registers import BAUDS, FACTORY_BAUD, ServoUnits
from snakewalk.drivers.types import ImuState

_READS = 10
_PAUSE_S = 0.02
_LEVEL_LINK_DEG = 20.0
"""A link that lies flat shows less (ours): more is a wrong mounting, or a robot that lies askew."""
_STILL_DPS = 5.0
"""A robot on the bench turns by less (ours): a gyro in other units would show more."""


def imu_finding(bus: DynamixelBus, imu: ImuConfig) -> Finding:
    """Ping the IMU and read it for a fifth of a second.

    Raises:
        PortError: the port vanished.

    """
    reader = ImuReader(bus, imu)
    clock = bus.port.clock
    try:
        reader.find()
    except ChainError as error:
        return Finding("imu", "fail", str(error), "look at its cable; snakewalk bus scan")
    shown: list[ImuState] = []
    for _ in range(_READS):
        state = reader.read(lambda line: None)
        if state is not None and state.valid:
            shown.append(state)
        clock.sleep_until_s(clock.now_s() + _PAUSE_S)
    name = f"{imu.model} (ID {imu.id})"
    if not shown:
        return Finding(
            "imu", "fail", f"{name}: shows no attitude", "its filter does not run: power it again"
        )
    rate_dps = np.rad2deg(max(float(np.linalg.norm(s.rate_rad_s)) for s in shown))
    up = shown[-1].rotation[2]
    tilt_deg = np.rad2deg(np.arccos(np.clip(up[2], -1.0, 1.0)))
    imu_text = (
        f"{name}: link {imu.link} is {tilt_deg:.0f} degrees off upright, turns at up to "
        f"{rate_dps:.1f} degrees a second"
    )
    if rate_dps > _STILL_DPS:
        return Finding(
            "imu", "warn", imu_text, "does the robot lie still? is the range the board's?"
        )
    if tilt_deg > _LEVEL_LINK_DEG:
        return Finding("imu", "warn", imu_text, "if it lies flat: correct mounting_deg of [imu]")
    return Finding("imu", "ok", imu_text)


OnStep = Callable[[str], None]
"""Function that gets the name of each step."""
_MOST_PINGED = 6
"""Largest number of missing servos that are pinged at each baud rate; for more a broadcast is
quicker (ours)."""
_STILL_POSITIONS = 20
"""Positions, 1.8 degrees, by which a joint at rest may differ between two reads (ours)."""
_STILL_JOINT_RAD_S = 0.4
"""Velocity at which a joint turns by more than ``_STILL_POSITIONS`` between the two (ours)."""
_NO_VELOCITY = "its sensor is off, so a run does not notice that it is blocked: exchange the servo"
_STILL_PAUSE_S = 0.1
"""Least time between the two (ours)."""
_TIMED_SERVOS = 2
"""Servos, and pings of each, that show how late replies are (ours)."""
_PING_ROUNDS = 4
"""Rounds of pings that show whose replies get lost (ours)."""
_NOISE_TRIES = 10
"""Number of requests on a noisy line before a servo counts as silent (ours)."""


def examine(
    port: BytePort,
    robot: RobotConfig,
    run: RunConfig,
    *,
    latency_s: float,
    latency_timer_ms: int | None,
    wiggle: bool = False,
    on_it: Sequence[int] | None = None,
    on_progress: OnStep = lambda _: None,
) -> list[Finding]:
    """Findings about the bus, worst causes first.

    With ``wiggle``, where nothing has failed: the chain is set up as in a run, and all joints move
    by 0.15 rad for 2 s, to measure the supply under load. ``run`` has the safety limits and the
    rate of the control cycle. ``on_it`` are the servos, and the IMU,
    that this port is to have; default: all of the robot's.

    Raises:
        PortError: the port vanished.

    """
    findings = [adapter.latency_timer(latency_timer_ms, port.name)]
    expected = robot.servo_ids
    models = robot.models_on(on_it)
    imu = robot.imu
    if on_it is not None:
        expected = tuple(servo_id for servo_id in expected if servo_id in on_it)
        imu = imu if imu is not None and imu.id in on_it else None
    on_progress("other programs")
    port.drain_until_quiet(latency_s)  # replies to an earlier program
    overheard = overhear(port, line_checks.OVERHEAR_S)
    findings.append(line_checks.second_master(overheard))
    echo = transmit_echo(port, expected)
    if echo is not None:  # each request would be read as a reply
        return [*findings, echo]
    on_progress("the robot's servos")
    bus, pinged = _find(port, models, expected, latency_s)
    on_progress("duplicate IDs")
    pings = [bus.probe(i) for i in expected]
    present_ids = sorted({*pinged, *(p.servo_id for p in pings if p.answered or p.damaged)})
    reads = [bus.probe(i, bus.differing) for i in present_ids]
    noise = line_checks.noise(pings, reads, overheard)
    alone = [] if noise is not None else servos.unshared(present_ids, (*pings, *reads))
    clocks = servos.read_clocks(bus, alone, servos.PATIENCE_S)
    if noise is not None:
        patience_s = bus.latency_s
        bus = servo_bus(port, models, latency_s=patience_s, tries=_NOISE_TRIES)
    findings += _presence(bus, expected, present_ids, imu, noise, overheard, on_progress)
    if imu is not None:
        findings.append(imu_finding(bus, imu))
    if not present_ids:
        return findings
    if findings[1].grade != "fail":  # else their replies are taken for a second servo's
        findings.append(servos.duplicates(pings, reads, noisy=noise is not None))
    findings += line_checks.response(pings, reads, latency_s, noisy=noise is not None)
    on_progress("registers")
    readable = _readable(bus, pings, reads, noise, findings)
    reports = _reports(bus, robot, readable, findings, noise) if readable else ()
    if reports:
        findings += _servo_findings(bus, robot, run.safety, reports, noise)
        on_progress("group reads")
        findings.append(_line_quality(bus, models, reports, latency_s))
    last = servos.read_clocks(bus, [*clocks], servos.PATIENCE_S)
    findings += servos.restarts(clocks, last, robot)
    budget = robot_budget(robot, port.getBaudRate(), fast=all(s.fast_reads for s in reports))
    findings.append(adapter.wire(budget, run.cycle_hz))
    if wiggle and worst(findings) != "fail":
        on_progress("supply under load")
        findings += supply_under_load(bus, robot, run.safety)
    return findings


def _find(
    port: BytePort, models: Mapping[int, ServoModel], expected: Sequence[int], latency_s: float
) -> tuple[DynamixelBus, Collection[int]]:
    bus = servo_bus(port, models, latency_s=latency_s)
    pinged = bus.find(expected)
    patient = servo_bus(port, models, latency_s=line_checks.PATIENCE_S)
    for servo_id in [*pinged, *expected][:_TIMED_SERVOS]:
        timed = patient.probe(servo_id)
        late_s = timed.late_s
        if late_s and min(late_s) > latency_s and not timed.damaged:
            return patient, patient.find(expected)
        if late_s:
            break
    return bus, pinged


def _presence(
    bus: DynamixelBus,
    expected: Sequence[int],
    present_ids: Sequence[int],
    imu: ImuConfig | None,
    noise: Finding | None,
    overheard: Overheard,
    on_progress: OnStep,
) -> list[Finding]:
    """Findings about the devices on the line: the robot's, others, and those that are missing."""
    port = bus.port
    noisy = noise is not None or overheard.noise_bytes > 0
    missing = [i for i in expected if i not in present_ids]
    elsewhere = _at_other_bauds(bus, missing, on_progress)
    on_progress("other devices")
    expected_ids = (*expected, *(() if imu is None else (imu.id,)))
    replies = bus.scan()
    others = {i: reply for i, reply in replies.items() if i not in expected_ids}
    baud = port.getBaudRate()
    findings: list[Finding] = []
    silent = [i for i in missing if i not in elsewhere]
    feetech = bus.table.facts.is_feetech
    foreign = foreign_replies(port, silent, bus.latency_s, feetech=feetech)
    findings += foreign.findings(bus.table.facts.model)
    findings += servos.presence(
        expected, present_ids, elsewhere, foreign.ids, list(others), baud, port.name
    )
    silent = [i for i in silent if i not in foreign.ids]
    findings += [] if noise is None else [noise]
    protocol = bus.table.facts.protocol
    findings += unlisted(port, others, bus.latency_s, noisy=noisy, protocol=protocol)
    new = None
    if not feetech:
        new = factory_servos(
            port, {*present_ids, *others}, silent, noisy=noisy, on_progress=on_progress
        )
    at_factory_baud = {i for i, rate in elsewhere.items() if rate == FACTORY_BAUD}
    findings += [] if new is None or at_factory_baud else [new]
    return findings


def _line_quality(
    bus: DynamixelBus,
    models: Mapping[int, ServoModel],
    reports: Sequence[ServoReport],
    latency_s: float,
) -> Finding:
    port = bus.port
    patience_s = line_checks.PATIENCE_S
    port.drain_until_quiet(patience_s)  # late replies to earlier requests
    ids = [s.servo_id for s in reports]
    fast = all(s.fast_reads for s in reports)
    cycle = servo_bus(port, models, latency_s=patience_s).cycle(ids, fast=fast)
    asked = [servo_id for servo_id in ids for _ in range(_PING_ROUNDS)]
    return line_checks.line_quality(
        port, cycle, latency_s, lambda: [bus.probe(servo_id) for servo_id in asked]
    )


def _servo_findings(
    bus: DynamixelBus,
    robot: RobotConfig,
    safety: SafetyConfig,
    reports: Sequence[ServoReport],
    noise: Finding | None,
) -> list[Finding]:
    return [
        *([] if bus.table.facts.is_feetech else [servos.firmware(reports)]),
        servos.return_delay(reports),
        servos.alarms(reports, robot),
        servos.torque(reports),
        servos.supply(reports, *safety.voltage_limits_v(robot.servo)),
        servos.heat(reports, robot, safety.temperature_limit_c),
        *_settings(bus, robot, reports, noise),
    ]


def _show_step(on_progress: OnStep, port: str, step: str) -> None:
    on_progress(f"{port}: {step}")


def examine_segments(
    segments: Sequence[tuple[LinePort, Sequence[int]]],
    robot: RobotConfig,
    run: RunConfig,
    *,
    wiggle: bool,
    on_progress: OnStep,
) -> list[Finding]:
    """Findings about the ports of a chain's segments, each with its port's name; as ``examine``.

    Args:
        segments: port and IDs of each; the ports share a clock.
        robot: with a table ``[[ports]]`` of them.
        run: has the safety limits and the rate of the control cycle.
        wiggle: all joints at once.
        on_progress: called with the port and the step.

    """
    findings: list[Finding] = []
    for line, ids in segments:
        name = line.name
        on_this = examine(
            line,
            robot,
            run,
            latency_s=line.latency_s,
            latency_timer_ms=line.latency_timer_ms,
            on_it=ids,
            on_progress=partial(_show_step, on_progress, name),
        )
        findings = [
            finding for finding in findings if finding.check != adapter.WIRE_CHECK
        ]  # of the busiest port
        findings += [
            finding
            if finding.check == adapter.WIRE_CHECK
            else replace(finding, found=f"{name}: {finding.found}")
            for finding in on_this
        ]
    if wiggle and worst(findings) != "fail":
        on_progress("supply under load")
        parts = [
            (servo_bus(line, robot.models_on(ids), latency_s=line.latency_s), ids)
            for line, ids in segments
        ]
        findings += supply_under_load(SegmentedBus(parts), robot, run.safety)
    return findings


def _readable(
    bus: DynamixelBus,
    pings: Sequence[Probe],
    reads: Sequence[Probe],
    noise: Finding | None,
    findings: list[Finding],
) -> list[int]:
    probes = (*pings, *reads)
    shared = {p.servo_id for p in probes if p.doubled}
    if noise is None:
        shared |= {p.servo_id for p in probes if p.damaged == p.requests}
    alone = [p for p in reads if p.servo_id not in shared]
    silent = [p.servo_id for p in alone if not p.answered and not p.damaged]
    unread = [servo_id for servo_id in silent if not _replies_to_reads(bus, servo_id)]
    if noise is None:  # else the noise is why they are silent
        findings += [f for f in [servos.silent_to_reads(unread)] if f is not None]
    return [p.servo_id for p in alone if p.servo_id not in unread]


def _replies_to_reads(bus: DynamixelBus, servo_id: int) -> bool:
    try:
        bus.read(servo_id, "Firmware Version")
    except ServoError:
        return True  # a refusal is a reply
    except BusError:
        return False
    return True


def _reports(
    bus: DynamixelBus,
    robot: RobotConfig,
    servo_ids: Sequence[int],
    findings: list[Finding],
    noise: Finding | None,
) -> Sequence[ServoReport]:
    try:
        inspection = inspect(bus, robot, servo_ids)
    except BusError as error:
        findings.append(_unreadable(error, noise))
        return ()
    wrong = [str(f) for f in inspection.faults if f.cause is FaultCause.OTHER_MODEL]
    port_format = wire_format(bus.table.facts)
    records = robot.records_by_model.items()
    models = [name for name, facts in records if wire_format(facts) == port_format]
    findings.append(servos.models(inspection.servos, wrong, ", ".join(models)))
    return inspection.servos


def _settings(
    bus: DynamixelBus, robot: RobotConfig, reports: Sequence[ServoReport], noise: Finding | None
) -> list[Finding]:
    bus.port.clock.sleep_until_s(bus.port.clock.now_s() + _STILL_PAUSE_S)
    try:
        registers = [read_registers(bus, robot, report.servo_id) for report in reports]
        supply = servos.unsteady_supply(bus, reports)
    except BusError as error:
        return [_unreadable(error, noise)]
    units = JointUnits.of(robot, [ServoUnits.of(facts) for facts in robot.servo_records])
    moving = _moving(robot, units, reports, registers)
    return [*moving, *supply, *register_findings(registers, robot, units)]


def _moving(
    robot: RobotConfig,
    units: JointUnits,
    reports: Sequence[ServoReport],
    registers: Sequence[ServoRegisters],
) -> list[Finding]:
    """Findings about joints whose position, or only their velocity, shows a motion."""
    before = {report.servo_id: report.registers["Present Position"] for report in reports}
    turned = [
        register.servo_id
        for register in registers
        if abs(register.values["Present Position"] - before[register.servo_id]) > _STILL_POSITIONS
    ]
    if not turned:
        fast = [
            register.servo_id
            for register in registers
            if abs(
                register.values.get("Present Velocity", 0)
                * units.rad_s_per_velocity[register.joint]
            )
            > _STILL_JOINT_RAD_S
        ]
        if not fast:
            return []
        motion_text = (
            f"{shown_subject(fast, 'report', robot.label_of_servo)} a velocity, but stands"
        )
        return [Finding("velocity sensor", "warn", motion_text, _NO_VELOCITY)]
    motion_text = f"{shown_subject(turned, 'move', robot.label_of_servo)} during the check"
    remedy = "does it fall, or does another program move it? run doctor again when it lies still"
    return [Finding("motion", "warn", motion_text, remedy)]


def _unreadable(error: BusError, noise: Finding | None) -> Finding:
    remedy = "run it again; then the cables" if noise is None else "the noise first"
    return Finding("registers", "fail", str(error), remedy)


def _at_other_bauds(
    bus: DynamixelBus, missing: Sequence[int], on_progress: OnStep
) -> dict[int, int]:
    if not missing:
        return {}
    port = bus.port
    before = port.getBaudRate()
    feetech = bus.table.facts.is_feetech
    others = [baud for baud in (bus.table.facts.bauds if feetech else BAUDS) if baud != before]
    if len(missing) > _MOST_PINGED:
        if feetech:
            replying = find_feetech(port, others, on_progress)
            return {s.servo_id: s.baud for s in replying if s.servo_id in missing}
        answering = scan(port, others, on_progress=on_progress)
        return {s.servo_id: s.baud for s in answering.servos if s.servo_id in missing}
    baud_by_id: dict[int, int] = {}
    try:
        for baud in others:
            on_progress(f"{baud} baud")
            if port.setBaudRate(baud):
                baud_by_id |= dict.fromkeys(
                    bus.find(i for i in missing if i not in baud_by_id), baud
                )
    finally:
        port.setBaudRate(before)
    return baud_by_id
