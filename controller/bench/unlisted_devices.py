"""Devices on a line that the robot does not list, and echoes of sent packets."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

from snakewalk.config.errors import InputError
from snakewalk.controller.bench.servo_checks import DUPLICATE_REMEDY
from snakewalk.controller.console.finding import Finding, shown_ids, shown_subject
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus, PingReply
from snakewalk.drivers.bus.feetech_bus import servo_bus
from snakewalk.drivers.bus.feetech_scan import identify_at
from snakewalk.drivers.bus.probe import broadcast_ping
from snakewalk.drivers.errors import BusError
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.protocol.control_table import model_numbers
from snakewalk.drivers.protocol.feetech import STATUS_BYTES, FeetechInstruction, FeetechParser
from snakewalk.drivers.protocol.imu_table import imu_model
from snakewalk.drivers.protocol.packet import (
    BITS_PER_BYTE,
    MAX_ID,
    Instruction,
    InstructionPacket,
    encode_instruction,
)
from snakewalk.drivers.protocol.protocol1 import frame
from snakewalk.drivers.protocol.registers import FACTORY_BAUD, alarm_names

FACTORY_ID = 1
_PROTOCOL_1_BAUDS = (1_000_000, FACTORY_BAUD)
"""Factory rates of AX and of older MX servos."""
_PROTOCOL_1_IDS = 20
"""Missing IDs that are asked in Protocol 1.0 (ours)."""
_ECHO_S = 0.02
"""Longest delay of an echo, and of a reply in Protocol 1.0 (ours)."""


def transmit_echo(port: BytePort, listed: Collection[int]) -> Finding | None:
    """Finding if the host receives what it sends.

    Args:
        port: the line.
        listed: IDs of the robot; another ID is pinged.

    """
    servo_id = next((i for i in range(MAX_ID, 0, -1) if i not in listed), 0)
    packet = encode_instruction(InstructionPacket(servo_id, Instruction.PING, b""))
    port.clearPort()
    port.write(packet)
    wire_s = 2 * len(packet) * BITS_PER_BYTE / port.getBaudRate()
    data = port.read_until(len(packet), port.clock.now_s() + wire_s + _ECHO_S)
    if data != packet:
        return None
    return Finding(
        "transmit echo",
        "fail",
        "the host receives each byte that it sends, so replies look like requests",
        "switch the adapter's echo off, or use one that switches its receiver off while it sends",
    )


@dataclass(frozen=True, slots=True)
class ForeignReplies:
    """IDs that are silent in the robot's protocol, and reply in another one."""

    protocol_1: Mapping[int, Sequence[int]]
    """IDs of DYNAMIXEL servos in Protocol 1.0, by baud rate."""
    models: Mapping[int, str]
    """Model of servos of another make, by ID."""

    @property
    def ids(self) -> frozenset[int]:
        """All missing and unlisted IDs."""
        return frozenset((*self.models, *(i for ids in self.protocol_1.values() for i in ids)))

    def findings(self, robot_model: str) -> list[Finding]:
        """Findings about unlisted devices; empty without any."""
        findings = []
        for model in dict.fromkeys(self.models.values()):
            ids = [i for i, name in self.models.items() if name == model]
            findings.append(
                Finding(
                    "protocol",
                    "fail",
                    f"{shown_subject(ids, 'are')} {model}, of another make than {robot_model}",
                    f"name a robot by --robot whose servos have model = {model!r}",
                )
            )
        there = [
            f"{shown_subject(i, 'reply')} at {baud} baud" for baud, i in self.protocol_1.items()
        ]
        if there:
            findings.append(
                Finding(
                    "protocol",
                    "fail",
                    f"in Protocol 1.0 {', '.join(there)}",
                    "a run needs Protocol 2.0: set Protocol Type(13) to 2, or update the firmware "
                    "with DYNAMIXEL Wizard 2.0; AX servos have Protocol 1.0 only and cannot run",
                )
            )
        return findings


def foreign_replies(
    port: BytePort, missing: Sequence[int], latency_s: float, *, feetech: bool
) -> ForeignReplies:
    """Ask silent IDs in the protocols that the robot does not use.

    Args:
        port: the line.
        missing: IDs without a reply; for Protocol 1.0 the factory's ID is asked, too.
        latency_s: how long adapter and driver may hold bytes back.
        feetech: whether the robot has Feetech servos.

    """
    if not missing:
        return ForeignReplies({}, {})
    if feetech:
        numbers = model_numbers(2)
        replies = {reply.servo_id: reply.params for reply in broadcast_ping(port).replies}
        models_by_id = {
            servo_id: numbers.get(int.from_bytes(params[:2], "little"), "DYNAMIXEL")
            for servo_id, params in replies.items()
        }
        return ForeignReplies({}, {i: models_by_id[i] for i in missing if i in replies})
    asked = sorted({*missing[:_PROTOCOL_1_IDS], FACTORY_ID})
    before = port.getBaudRate()
    ids_by_baud: dict[int, list[int]] = {}
    models: dict[int, str] = {}
    try:
        for baud in dict.fromkeys((before, *_PROTOCOL_1_BAUDS)):
            if baud != before and not port.setBaudRate(baud):
                continue
            ids_by_baud[baud] = [i for i in asked if _replies_in_protocol_1(port, i, latency_s)]
            for servo_id in ids_by_baud[baud] if baud == before else ():
                servo = identify_at(port, servo_id, latency_s)
                models |= {} if servo is None else {servo_id: servo.model}
    finally:
        port.setBaudRate(before)
    old = {baud: [i for i in ids if i not in models] for baud, ids in ids_by_baud.items()}
    return ForeignReplies({baud: ids for baud, ids in old.items() if ids}, models)


def _replies_in_protocol_1(port: BytePort, servo_id: int, latency_s: float) -> bool:
    packet = frame(servo_id, FeetechInstruction.PING)
    port.clearPort()
    port.write(packet)
    byte_s = BITS_PER_BYTE / port.getBaudRate()
    wire_s = (len(packet) + STATUS_BYTES) * byte_s
    data = port.read_until(STATUS_BYTES, port.clock.now_s() + wire_s + latency_s + 2e-3)
    replies = FeetechParser().feed(data)  # a status packet of Protocol 1.0 is the same
    return data != packet and any(reply.servo_id == servo_id for reply in replies)


def unlisted(
    port: BytePort,
    others: Mapping[int, PingReply],
    latency_s: float,
    *,
    noisy: bool,
    protocol: int | str,
) -> list[Finding]:
    """Findings about devices that replied and are not the robot's: presence, IDs, alarms, torque.

    Args:
        port: the line.
        others: their replies to a broadcast ping, by ID.
        latency_s: how long adapter and driver may hold bytes back.
        noisy: damage on this line shows nothing about IDs.
        protocol: of the servos on the line.

    """
    if not others:
        return []
    findings = [
        Finding(
            "servo IDs",
            "warn",
            f"{shown_subject(list(others), 'are')} on the bus and not in the robot",
            "name a robot that has them with --robot, or remove them from the bus",
        )
    ]
    numbers = model_numbers(protocol)
    alarms = []
    torque = []
    shared = []
    for servo_id, reply in others.items():
        model = numbers.get(reply.model_number)
        if model is None:
            name = imu_model(reply.model_number) or f"model number {reply.model_number}"
            findings.append(
                Finding(
                    "servo IDs",
                    "warn",
                    f"ID {servo_id} is {name}, not a known servo model",
                    "another device on this bus: it uses time on the wire only if it is asked",
                )
            )
            continue
        bus = servo_bus(port, model, latency_s=latency_s)
        ping = bus.probe(servo_id)
        if ping.doubled or (not noisy and ping.damaged == ping.requests):
            shared.append(servo_id)
            continue
        alarm, is_on = _state(bus, servo_id, reply)
        alarms += [] if alarm is None else [f"servo {servo_id}: {alarm}"]
        torque += [servo_id] if is_on else []
    if shared:
        unlisted_text = (
            f"{shown_subject(shared, 'answer')} twice or damaged: two servos have this ID"
        )
        findings.append(Finding("duplicate IDs", "fail", unlisted_text, DUPLICATE_REMEDY))
    if alarms:
        unlisted_text = f"{', '.join(alarms)} (not in the robot)"
        remedy = "remove the cause, then switch the servo power off, on"
        findings.append(Finding("alarms", "fail", unlisted_text, remedy))
    if torque:
        unlisted_text = f"on at {shown_ids(torque)} (not in the robot)"
        remedy = (
            "a run does not switch it off: switch the power off and on, or remove them from the bus"
        )
        findings.append(Finding("torque", "warn", unlisted_text, remedy))
    return findings


def _state(bus: DynamixelBus, servo_id: int, reply: PingReply) -> tuple[str | None, bool]:
    try:
        registers = bus.read_each(servo_id, ("Torque Enable", "Hardware Error Status"))
    except (BusError, InputError):
        return ("the alert bit is set" if reply.alert else None), False
    error = registers["Hardware Error Status"]
    return (alarm_names(error) if error else None), bool(registers["Torque Enable"])


def factory_servos(
    port: BytePort,
    present_ids: Collection[int],
    missing: Sequence[int],
    *,
    noisy: bool,
    on_progress: Callable[[str], None],
) -> Finding | None:
    """Finding about servos at the factory's baud rate that the robot does not list there.

    Args:
        port: the line.
        present_ids: IDs that answer at the robot's rate; if all of them answer at the factory's as
            well, the line has no baud rates.
        missing: IDs of the robot that answer at no rate.
        noisy: damage on this line shows nothing.
        on_progress: gets the step.

    """
    before = port.getBaudRate()
    if before == FACTORY_BAUD or not port.setBaudRate(FACTORY_BAUD):
        return None
    on_progress(f"{FACTORY_BAUD} baud")
    try:
        answer = broadcast_ping(port)
    finally:
        port.setBaudRate(before)
    new = [reply.servo_id for reply in answer.replies]
    if present_ids and set(present_ids) <= set(new):
        return None
    if not new and (noisy or not answer.noise_bytes):
        return None
    where = f"at {FACTORY_BAUD} baud, the factory's"
    if not new or (answer.noise_bytes and not noisy):
        return Finding(
            "baud rate",
            "fail",
            f"damaged replies come {where}: several new servos with ID {FACTORY_ID}",
            "connect them one by one: snakewalk bus set "
            f"--port {port.name} --baud {FACTORY_BAUD} --id {FACTORY_ID} --new-id ID --new-baud "
            f"{before}",
        )
    new_id = missing[0] if len(missing) == 1 else "ID"
    return Finding(
        "baud rate",
        "fail" if missing else "warn",
        f"{shown_subject(new, 'answer')} {where}, not at {before}: new from the factory?",
        f"snakewalk bus set --port {port.name} --baud {FACTORY_BAUD} --id {new[0]} --new-id "
        f"{new_id} --new-baud {before}",
    )
