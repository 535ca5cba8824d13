"""Checks of each servo against the robot's file."""

from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from statistics import median

from snakewalk.config.robot import RobotConfig
from snakewalk.controller.console.finding import Finding, shown_ids, shown_subject
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.bus.probe import Probe
from snakewalk.drivers.chain.start_up import ServoReport
from snakewalk.drivers.errors import NoAnswerError, ServoError
from snakewalk.drivers.protocol.registers import VOLTAGE_UNIT_V, alarm_names

_HOT_C = 60.0
_IMPOSSIBLE_C = 150.0
"""Temperature above which a servo would not reply (ours)."""
_UNSTEADY_V = 0.3
"""Change of a voltage at rest that no sensor shows by itself (ours)."""
_WARMER_C = 20.0
"""A servo at rest that is warmer than the others by more has a reason (ours)."""
_CABLE_DROP_V = 0.5
_TICK = "Realtime Tick"
_TICKS = 32_768
"""Realtime Tick(120) counts milliseconds from 0 to 32,767, and then from 0 again."""
_TICK_S = 1e-3
_DRIFT = 0.03
"""Share by which the clock of a servo may be wrong (ours)."""
_SLACK_S = 0.05
"""Additional difference of a clock that did not restart (ours)."""
PATIENCE_S = 0.5
"""Longest time for which a servo without a reply is asked for its clock (ours); a restart is
shorter."""
_POWER_REMEDY = (
    "a loose plug, a bad cable, or a supply that sags: the servo loses its torque in a run"
)
DUPLICATE_REMEDY = (
    "connect one of them alone and give it another: snakewalk bus set --id ID --new-id NEW"
)


def presence(
    expected: Sequence[int],
    present_ids: Sequence[int],
    elsewhere: Mapping[int, int],
    foreign: Collection[int],
    others: Sequence[int],
    baud: int,
    port: str,
) -> list[Finding]:
    """Findings about the robot's servos: at this baud rate, at another, or silent.

    Args:
        expected: IDs of the robot.
        present_ids: those that answered at ``baud``.
        elsewhere: ID to the other baud rate at which it answered.
        foreign: silent IDs that reply in another protocol.
        others: IDs that answered at ``baud`` and are not the robot's.
        baud: the robot's.
        port: for the remedy.

    """
    findings = []
    rates = sorted(set(elsewhere.values()))
    for rate in rates:
        ids = [i for i in expected if elsewhere.get(i) == rate]
        findings.append(
            Finding(
                "baud rate",
                "fail",
                f"{shown_subject(ids, 'answer')} at {rate} baud, not at {baud}",
                f"snakewalk bus set --port {port} --baud {rate} --id {ids[0]} --new-baud {baud}",
            )
        )
    if not rates:
        findings.append(
            Finding("baud rate", "ok" if present_ids or foreign else "warn", f"{baud} baud")
        )
    missing = [i for i in expected if i not in present_ids and i not in elsewhere]
    refusing = [i for i in missing if i in foreign]
    missing = [i for i in missing if i not in foreign]
    if refusing:
        answer = f"{shown_subject(refusing, 'reply')} in another protocol than the robot's servos"
        remedy = "they have power and a cable: see the check protocol"
        findings.append(Finding("servo IDs", "fail", answer, remedy))
    if missing:
        remedy = _missing_remedy(missing, expected, others, port)
        findings.append(
            Finding("servo IDs", "fail", f"no answer from {shown_ids(missing)}", remedy)
        )
    elif not refusing:
        findings.append(Finding("servo IDs", "ok", f"{len(present_ids)} of {len(expected)} answer"))
    return findings


def _subject(servos: Sequence[ServoReport], verb: str) -> str:
    return shown_subject([servo.servo_id for servo in servos], verb)


def _missing_remedy(
    missing: Sequence[int], expected: Sequence[int], others: Sequence[int], port: str
) -> str:
    if len(others) == len(missing) == 1:
        return (
            f"if servo {others[0]} is correct: snakewalk bus set --port {port} --id {others[0]} "
            f"--new-id {missing[0]}"
        )
    if len(others) >= len(missing) or (others and len(missing) == len(expected)):
        return (
            f"{shown_subject(others, 'reply')} instead: snakewalk bus inventory --port {port} -o "
            "my-robot.toml writes a robot file with their IDs, and bus calibrate finds the joint "
            "of each"
        )
    if len(missing) == len(expected):
        return "is the servo power on? is the adapter's switch at TTL or RS-485 as the servos need?"
    return (
        f"look at the cable in front of servo {missing[0]}; snakewalk bus scan --port {port}. If "
        "it has power, another servo may have the same ID: turn it by hand and run doctor again"
    )


def unnamed_robot(findings: Sequence[Finding], robot: RobotConfig) -> Finding | None:
    """Finding for a command without ``--robot`` whose servos are not the default robot's."""
    if all(finding.check != "servo IDs" or finding.grade == "ok" for finding in findings):
        return None
    return Finding(
        "robot",
        "warn",
        f"--robot is not given, so {shown_ids(robot.servo_ids)} are expected",
        "name your robot by --robot; snakewalk list has the shipped ones",
    )


def duplicates(pings: Sequence[Probe], reads: Sequence[Probe], *, noisy: bool = False) -> Finding:
    """Two servos with one ID answer twice, or over each other.

    Two identical servos reply to a ping with the same bytes at the same time, which is one good
    reply; their measurements differ. On a ``noisy`` line damage does not indicate them.
    """
    check = "duplicate IDs"
    probes = (*pings, *reads)
    shared = sorted({p.servo_id for p in probes if p.doubled})
    how = "twice"
    requests = sum(p.requests for p in probes)
    if noisy and not shared:
        duplicates_text = (
            f"no servo answers twice in {requests} requests; noise hides further checks"
        )
        return Finding(check, "ok", duplicates_text)
    if not shared:
        shared = sorted({p.servo_id for p in probes if p.damaged == p.requests and not p.answered})
        how = "with damaged bytes only"
    if shared:
        return Finding(
            check,
            "fail",
            f"{shown_subject(shared, 'answer')} {how}: two servos have this ID",
            DUPLICATE_REMEDY,
        )
    damaged = sorted({p.servo_id for p in probes if p.damaged})
    if damaged:
        return Finding(
            check,
            "warn",
            f"answers of {shown_ids(damaged)} come damaged: two servos with this ID, or a bad line",
            "connect it alone: if it is well then, another servo has its ID; if not, the cable",
        )
    return Finding(check, "ok", f"none in {requests} requests")


def silent_to_reads(servo_ids: Sequence[int]) -> Finding | None:
    """Servos that reply to pings, but not to reads: Status Return Level(68) is 0."""
    if not servo_ids:
        return None
    return Finding(
        "status return level",
        "fail",
        f"{shown_subject(servo_ids, 'reply')} to pings and not to reads: Status Return Level(68) "
        "is 0, or the answer is lost",
        "a run sets it to 2 without a reply; else write 2 to address 68",
    )


def models(servos: Sequence[ServoReport], wrong: Sequence[str], model: str) -> Finding:
    """Whether all are of the robot's model; ``wrong`` says which are not."""
    if wrong:
        remedy = (
            f"expected: {model}; name a robot with this model by --robot, or exchange the servo"
        )
        return Finding("model", "fail", "; ".join(wrong), remedy)
    return Finding("model", "ok", f"{len(servos)} times {model}")


def firmware(servos: Sequence[ServoReport]) -> Finding:
    """Old firmwares have no fast sync read; mixed ones behave differently."""
    versions = sorted({s.firmware for s in servos})
    shown = ", ".join(map(str, versions))
    old = [s for s in servos if not s.fast_reads]
    if old:
        return Finding(
            "firmware",
            "warn",
            f"{_subject(old, 'have')} no fast sync read (version {shown}): the driver uses "
            "plain reads, which are slower",
            "update it with DYNAMIXEL Wizard 2.0",
        )
    if len(versions) > 1:
        return Finding("firmware", "warn", f"mixed: {shown}", "update all to the same version")
    return Finding("firmware", "ok", f"version {shown}")


def return_delay(servos: Sequence[ServoReport]) -> Finding:
    """The factory's 500 us a servo add up; a run sets them to 0 by itself."""
    slow = [s for s in servos if s.return_delay_s > 0.0]
    if not slow:
        return Finding("return delay", "ok", "0")
    total_ms = sum(s.return_delay_s for s in slow) * 1e3
    return Finding(
        "return delay",
        "warn",
        f"{_subject(slow, 'wait')} before answering, {total_ms:.1f} ms together",
        "a run sets it to 0; to do it now: snakewalk bus set --id ID --return-delay 0",
    )


def alarms(servos: Sequence[ServoReport], robot: RobotConfig) -> Finding:
    """Hardware Error Status(70)."""
    bad = [s for s in servos if s.hardware_error]
    if not bad:
        return Finding("alarms", "ok", "none")
    alarm_texts = ", ".join(
        f"{robot.label_of_servo(s.servo_id)}: {alarm_names(s.hardware_error)}" for s in bad
    )
    return Finding(
        "alarms", "fail", alarm_texts, "remove the cause, then switch the servo power off, on"
    )


def torque(servos: Sequence[ServoReport]) -> Finding:
    """Torque that a former program left on."""
    on = [s for s in servos if s.torque_on]
    if not on:
        return Finding("torque", "ok", "off")
    return Finding(
        "torque",
        "warn",
        f"on at {shown_ids([s.servo_id for s in on])}",
        "another program left it on, or still runs; a run switches it off and on again",
    )


def supply(servos: Sequence[ServoReport], low_v: float, high_v: float) -> Finding:
    """Supply voltage of each servo, and the drop of the cable along the chain."""
    volts = [s.voltage_v for s in servos]
    shown = f"{min(volts):.1f} to {max(volts):.1f} V"
    stated = "or correct servo.supply_v in the robot's file"
    if min(volts) < low_v:
        remedy = f"charge the battery; thicker cable; {stated}"
        return Finding("supply", "fail", f"{shown}: below {low_v:g} V", remedy)
    if max(volts) > high_v:
        remedy = f"a lower supply voltage, {stated}"
        return Finding("supply", "fail", f"{shown}: above {high_v:g} V", remedy)
    if max(volts) - min(volts) > _CABLE_DROP_V:
        return Finding("supply", "warn", f"{shown} along the chain", "feed the chain at both ends")
    return Finding("supply", "ok", shown)


def unsteady_supply(bus: DynamixelBus, servos: Sequence[ServoReport]) -> list[Finding]:
    """Finding about a supply whose voltage changes while nothing moves.

    Raises:
        BusError: a servo does not reply.

    """
    changed_v = {
        s.servo_id: bus.read(s.servo_id, "Present Input Voltage") * VOLTAGE_UNIT_V - s.voltage_v
        for s in servos
    }
    servo_id = max(changed_v, key=lambda changed_id: abs(changed_v[changed_id]))
    if abs(changed_v[servo_id]) <= _UNSTEADY_V:
        return []
    supply_text = (
        f"changes by {abs(changed_v[servo_id]):.1f} V at rest, measured by servo {servo_id}"
    )
    return [
        Finding("supply", "warn", supply_text, "a loose supply plug, or a supply that is too weak")
    ]


def heat(servos: Sequence[ServoReport], robot: RobotConfig, limit_c: float) -> Finding:
    """Temperatures at rest, and sensors that cannot be right."""
    broken = [s.servo_id for s in servos if s.temperature_c > _IMPOSSIBLE_C]
    if broken:
        heat_text = (
            f"{shown_subject(broken, 'report', robot.label_of_servo)} more than any motor bears"
        )
        remedy = "its sensor is broken: a run stops at once; exchange the servo"
        return Finding("temperature", "fail", heat_text, remedy)
    hottest = max(servos, key=lambda s: s.temperature_c)
    label = robot.label_of_servo(hottest.servo_id)
    heat_text = f"{label} is the warmest: {hottest.temperature_c:.0f} C"
    if hottest.temperature_c > limit_c:
        return Finding("temperature", "fail", heat_text, "let it cool down")
    if hottest.temperature_c > _HOT_C:
        return Finding(
            "temperature", "warn", heat_text, "it will not walk for long: let it cool down"
        )
    dead = [s.servo_id for s in servos if s.temperature_c <= 0.0]
    if dead:
        heat_text = f"{shown_subject(dead, 'report', robot.label_of_servo)} 0 C or less"
        remedy = "its sensor is broken: it does not protect itself from heat; exchange the servo"
        return Finding("temperature", "warn", heat_text, remedy)
    usual_c = median(s.temperature_c for s in servos)
    if hottest.temperature_c - usual_c > _WARMER_C:
        heat_text += f", the others have about {usual_c:.0f} C"
        remedy = "did it push against something? is its joint tight, or its sensor off?"
        return Finding("temperature", "warn", heat_text, remedy)
    return Finding("temperature", "ok", heat_text)


@dataclass(frozen=True, slots=True)
class ServoClock:
    """Realtime Tick of a servo, read between two times of the computer."""

    ticks: int
    asked_s: float
    received_s: float


def unshared(servo_ids: Sequence[int], probes: Sequence[Probe]) -> list[int]:
    """Servos without a damaged or doubled reply: an ID of two servos has two clocks."""
    shared = {probe.servo_id for probe in probes if probe.doubled or probe.damaged}
    return [servo_id for servo_id in servo_ids if servo_id not in shared]


def read_clocks(
    bus: DynamixelBus, servo_ids: Sequence[int], patience_s: float
) -> dict[int, ServoClock]:
    """Clock of each servo that has one and replies; the others are asked for ``patience_s``.

    Raises:
        PortError: the port is gone.

    """
    clocks: dict[int, ServoClock] = {}
    now_s = bus.port.clock.now_s
    asked = [servo_id for servo_id in servo_ids if _TICK in bus.table_of(servo_id)]
    end_s = now_s() + patience_s
    while asked:
        for servo_id in asked:
            asked_s = now_s()
            with suppress(NoAnswerError, ServoError):
                clocks[servo_id] = ServoClock(bus.read(servo_id, _TICK), asked_s, now_s())
        asked = [servo_id for servo_id in asked if servo_id not in clocks]
        if now_s() > end_s:
            break
    return clocks


def restarts(
    before: Mapping[int, ServoClock], after: Mapping[int, ServoClock], robot: RobotConfig
) -> list[Finding]:
    """Findings on the servos whose clocks began again between two reads, or that fell silent."""
    silent = [servo_id for servo_id in before if servo_id not in after]
    findings = []
    if silent:
        restart_text = (
            f"{shown_subject(silent, 'reply', robot.label_of_servo)} no more since the start"
        )
        findings.append(Finding("power", "fail", restart_text, _POWER_REMEDY))
    restarted = [
        servo_id
        for servo_id, first in before.items()
        if servo_id in after and _has_restarted(first, after[servo_id])
    ]
    if restarted:
        restart_text = (
            f"{shown_subject(restarted, 'restart', robot.label_of_servo)} while doctor runs"
        )
        findings.append(Finding("power", "fail", restart_text, _POWER_REMEDY))
    return findings


def _has_restarted(before: ServoClock, after: ServoClock) -> bool:
    shortest_s = after.asked_s - before.received_s
    longest_s = after.received_s - before.asked_s
    low_s = shortest_s * (1.0 - _DRIFT) - _SLACK_S
    high_s = longest_s * (1.0 + _DRIFT) + _SLACK_S
    counted_s = (after.ticks - before.ticks) * _TICK_S
    beyond_s = (counted_s - low_s) % (_TICKS * _TICK_S)
    return beyond_s > high_s - low_s
