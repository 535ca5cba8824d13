"""Cause of missing replies: the servos are asked again after torque off."""

import os
from collections.abc import Sequence

from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.bus.chain_bus import ChainBus
from snakewalk.drivers.bus.pending_replies import HORIZON_S
from snakewalk.drivers.bus.probe import Probe
from snakewalk.drivers.port.byte_port import BytePort, is_url
from snakewalk.drivers.port.port_holders import holders_of

_ASKED = 8
"""Largest number of silent servos, and of others, that are asked (ours)."""


def silence_cause(bus: ChainBus, robot: RobotConfig, silent: Sequence[int]) -> str:
    """Cause for which joints were not read.

    A servo without connection sends no byte. Two servos with one ID damage only each other's
    replies; noise also damages those of others. A slow adapter delays every reply.

    Raises:
        PortError: the port is gone.

    """
    ids = robot.servo_ids
    others = [joint for joint in range(robot.joint_count) if joint not in silent]

    def probes(joints: Sequence[int]) -> list[Probe]:
        parts = [(bus.part_of(ids[j]), ids[j]) for j in joints[:_ASKED]]
        return [part.probe(servo_id, part.differing) for part, servo_id in parts]

    for part in bus.parts:
        part.port.drain_until_quiet(HORIZON_S)  # late replies to earlier requests
    if any(probe.damaged for probe in probes(others)):
        return "other replies are damaged too: noise on the line"
    asked = probes(silent)
    worst = max(asked, key=lambda probe: probe.damaged)
    name = robot.label_of_servo(worst.servo_id)
    part = bus.part_of(worst.servo_id)
    if worst.damaged:
        return f"only replies of {name} are damaged: two servos with its ID"
    least_s = min((min(p.late_s) for p in asked if p.answered), default=None)
    if least_s is not None:
        if least_s <= part.latency_s:
            return "it replies again: a loose contact" if others else _pause_cause(part.port)
        where = "network" if is_url(part.port.name) else "adapter"
        return f"each reply is at least {1e3 * least_s:.0f} ms late: high latency of the {where}"
    if part.find([worst.servo_id]):
        return f"{name} answers pings, but no reads: its Status Return Level"
    if not others:
        return _dead_line_cause(part.port)
    if len(silent) > 1 and [*silent] == [*range(silent[0], robot.joint_count)]:
        return f"all behind {robot.joint_label(silent[0] - 1)} are silent: the cable there"
    return "it sends no byte: its connection is lost"


def _pause_cause(port: BytePort) -> str:
    """Cause of a pause of the whole line; a served bus has no contacts."""
    if any(holder.has_other_end for holder in holders_of(port.name)):
        return "servos reply again: the program that simulates them paused; close other programs"
    return "servos reply again: supply or first cable failed briefly, or this computer was busy"


def _dead_line_cause(port: BytePort) -> str:
    """Cause of a dead line: another program reads the bytes, or nothing sends any."""
    for holder in holders_of(port.name):
        if holder.process != os.getpid() and not holder.has_other_end:
            return f"{holder} reads from the port too"
    return "no byte comes back: their supply, or the first cable"
