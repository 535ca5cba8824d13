"""The other side: each servo against the robot that was described."""

from collections.abc import Mapping, Sequence

from snakewalk.controller.app.service.finding import Finding
from snakewalk.drivers.bus.probe import Probe
from snakewalk.drivers.chain.start_up import FAST_READ_FIRMWARE, ServoReport
from snakewalk.drivers.protocol.registers import alarm_names

_HOT_C = 60.0
_CABLE_DROP_V = 0.5


def _ids(servos: Sequence[ServoReport] | Sequence[int]) -> str:
    """``servo 3``, ``servos 1 to 4, 7``."""
    numbers = sorted(servo if isinstance(servo, int) else servo.servo_id for servo in servos)
    spans: list[list[int]] = []
    for number in numbers:
        if spans and number == spans[-1][1] + 1:
            spans[-1][1] = number
        else:
            spans.append([number, number])
    shown = [f"{a}" if a == b else f"{a}, {b}" if b == a + 1 else f"{a} to {b}" for a, b in spans]
    return f"servo{'s' if len(numbers) > 1 else ''} {', '.join(shown)}"


def _do(servos: Sequence[ServoReport] | Sequence[int], verb: str) -> str:
    """``servo 3 answers``, ``servos 1 to 4 answer``; ``verb`` is the plural."""
    one = {"have": "has", "are": "is"}.get(verb, f"{verb}s")
    return f"{_ids(servos)} {verb if len(servos) > 1 else one}"


def presence(
    expected: Sequence[int],
    found: Sequence[int],
    elsewhere: Mapping[int, int],
    baud: int,
    port: str,
) -> list[Finding]:
    """Who answers, who does at another baud rate, who does not at all.

    Args:
        expected: IDs of the robot.
        found: those that answered at ``baud``.
        elsewhere: ID to the other baud rate at which it answered.
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
                f"{_do(ids, 'answer')} at {rate} baud, not at {baud}",
                f"snakewalk bus set --port {port} --baud {rate} --id {ids[0]} --new-baud {baud}",
            )
        )
    if not rates:
        findings.append(Finding("baud rate", "ok" if found else "warn", f"{baud} baud"))
    missing = [i for i in expected if i not in found and i not in elsewhere]
    if missing:
        remedy = (
            "is the servo power on? is the adapter's switch at TTL or RS-485 as the servos need?"
            if len(missing) == len(expected)
            else f"look at the cable in front of {_ids(missing[:1])}; snakewalk scan --port {port}"
        )
        findings.append(Finding("servo IDs", "fail", f"no answer from {_ids(missing)}", remedy))
    else:
        findings.append(Finding("servo IDs", "ok", f"{len(found)} of {len(expected)} answer"))
    return findings


def unexpected_ids(expected: Sequence[int], answering: Sequence[int]) -> Finding | None:
    """Servos on the bus that the robot does not have; None if there are none."""
    extra = [i for i in answering if i not in expected]
    if not extra:
        return None
    return Finding(
        "servo IDs",
        "warn",
        f"{_do(extra, 'are')} on the bus and not in the robot",
        "describe them in the robot's TOML, or take them off",
    )


def duplicates(probes: Sequence[Probe]) -> Finding:
    """Two servos with one ID answer twice, or over each other."""
    doubled = [p.servo_id for p in probes if p.doubled]
    damaged = [p.servo_id for p in probes if p.damaged and not p.doubled]
    if doubled:
        return Finding(
            "duplicate IDs",
            "fail",
            f"{_do(doubled, 'answer')} twice: two servos have this ID",
            "connect one of them alone and give it another: snakewalk bus set --new-id",
        )
    if damaged:
        return Finding(
            "duplicate IDs",
            "warn",
            f"answers of {_ids(damaged)} come damaged: two servos with this ID, or a bad line",
            "connect it alone: if it is well then, another servo has its ID; if not, the cable",
        )
    return Finding("duplicate IDs", "ok", f"none in {sum(p.pings for p in probes)} pings")


def models(servos: Sequence[ServoReport], wrong: Sequence[str], model: str) -> Finding:
    """Whether all are of the robot's model; ``wrong`` says which are not."""
    if wrong:
        remedy = f"the robot's TOML says {model}: correct it, or exchange the servo"
        return Finding("model", "fail", "; ".join(wrong), remedy)
    return Finding("model", "ok", f"{len(servos)} times {model}")


def firmware(servos: Sequence[ServoReport]) -> Finding:
    """Old firmwares have no fast sync read; mixed ones behave differently."""
    versions = sorted({s.firmware for s in servos})
    shown = ", ".join(map(str, versions))
    old = [s for s in servos if s.firmware < FAST_READ_FIRMWARE]
    if old:
        return Finding(
            "firmware",
            "warn",
            f"{_do(old, 'have')} no fast sync read (before {FAST_READ_FIRMWARE}): plain reads are "
            "used, which take longer",
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
        f"{_do(slow, 'wait')} before answering, {total_ms:.1f} ms together",
        "a run sets it to 0; to do it now: snakewalk bus set --id ID --return-delay 0",
    )


def alarms(servos: Sequence[ServoReport]) -> Finding:
    """Hardware Error Status(70)."""
    bad = [s for s in servos if s.hardware_error]
    if not bad:
        return Finding("alarms", "ok", "none")
    found = ", ".join(f"servo {s.servo_id}: {alarm_names(s.hardware_error)}" for s in bad)
    return Finding("alarms", "fail", found, "remove the cause, then switch the servo power off, on")


def torque(servos: Sequence[ServoReport]) -> Finding:
    """Torque that a former program left on."""
    on = [s for s in servos if s.torque_on]
    if not on:
        return Finding("torque", "ok", "off")
    return Finding(
        "torque",
        "warn",
        f"on at {_ids(on)}",
        "another program left it on, or still runs; a run switches it off and on again",
    )


def supply(servos: Sequence[ServoReport], low_v: float, high_v: float) -> Finding:
    """Supply voltage of each servo, and what the cable takes along the chain."""
    volts = [s.voltage_v for s in servos]
    shown = f"{min(volts):.1f} to {max(volts):.1f} V"
    if min(volts) < low_v:
        return Finding(
            "supply", "fail", f"{shown}: below {low_v:g} V", "charge the battery; thicker cable"
        )
    if max(volts) > high_v:
        return Finding("supply", "fail", f"{shown}: above {high_v:g} V", "a lower supply voltage")
    if max(volts) - min(volts) > _CABLE_DROP_V:
        return Finding("supply", "warn", f"{shown} along the chain", "feed the chain at both ends")
    return Finding("supply", "ok", shown)


def heat(servos: Sequence[ServoReport], limit_c: float) -> Finding:
    """Temperatures at rest."""
    hottest = max(servos, key=lambda s: s.temperature_c)
    found = f"servo {hottest.servo_id} is the warmest: {hottest.temperature_c:.0f} C"
    if hottest.temperature_c > limit_c:
        return Finding("temperature", "fail", found, "let it cool down")
    if hottest.temperature_c > _HOT_C:
        return Finding("temperature", "warn", found, "it will not walk for long: let it cool down")
    return Finding("temperature", "ok", found)
