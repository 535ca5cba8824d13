"""Torque off on a port that no program holds: to all servos, at every baud rate."""

from collections.abc import Callable, Iterable
from typing import Final

from snakewalk.controller.bench.emergency_stop import StopOutcome
from snakewalk.controller.bench.scan import scan
from snakewalk.drivers.bus.feetech_bus import servo_bus
from snakewalk.drivers.bus.feetech_scan import feetech_bauds
from snakewalk.drivers.errors import BusError, ControlTableError
from snakewalk.drivers.port.network_port import NetworkPort, open_port
from snakewalk.drivers.port.serial_port import SerialPort
from snakewalk.drivers.protocol.feetech import FeetechInstruction
from snakewalk.drivers.protocol.packet import (
    BITS_PER_BYTE,
    BROADCAST_ID,
    Instruction,
    InstructionPacket,
    encode_instruction,
)
from snakewalk.drivers.protocol.protocol1 import BROADCAST_ID as FEETECH_BROADCAST
from snakewalk.drivers.protocol.protocol1 import frame
from snakewalk.drivers.protocol.registers import BAUDS, FACTORY_BAUD

_LIKELY: Final = (1_000_000, FACTORY_BAUD)
_USB_S: Final = 5e-3
"""How long an adapter may keep bytes before it sends them (ours)."""
_COPIES: Final = 3
"""So often torque off is sent: noise may hit one (ours)."""
_TRIES: Final = 8
"""How often a servo is asked whether its torque is off (ours)."""
_FEETECH_TORQUE_ENABLE: Final = 40
_TORQUE_OFF = encode_instruction(
    # Torque Enable(64) of the X and MX(2.0) series
    InstructionPacket(BROADCAST_ID, Instruction.WRITE, bytes([64, 0, 0]))
)
_FEETECH_OFF = frame(
    FEETECH_BROADCAST, FeetechInstruction.WRITE, bytes((_FEETECH_TORQUE_ENABLE, 0))
)


def torque_off(
    device: str,
    bauds: Iterable[int] = (),
    on_progress: Callable[[str], None] = lambda step: None,
) -> StopOutcome:
    """Switch torque off on every servo of a port.

    The bytes go out first. Then each servo that replies reports its torque, and gets the command
    once more by its model's control table.

    Raises:
        PortError: it is not there, or a program that has no stop button holds it.

    """
    known = {*BAUDS, *feetech_bauds()}
    rates = tuple(bauds) or sorted(known, key=lambda rate: (rate not in _LIKELY, -rate))
    sent = 0
    with open_port(device, rates[0]) as port:
        held_s = max(_USB_S, port.latency_s)
        for rate in rates:
            if port.setBaudRate(rate):
                packets = (_TORQUE_OFF + _FEETECH_OFF) * _COPIES
                port.write(packets)
                sent += 1
                wire_s = len(packets) * BITS_PER_BYTE / rate
                port.clock.sleep_until_s(port.clock.now_s() + wire_s + held_s)
        # on a bad line a request gets lost: the likely rates are asked twice
        for rate in (*rates, *(rate for rate in rates if rate in _LIKELY)):
            on_progress(f"torque off is sent; waiting for replies at {rate} baud")
            found = scan(port, [rate], patient=False).servos
            if found:
                port.setBaudRate(rate)
                failed = [
                    fault
                    for servo in found
                    if (fault := _confirm(port, servo.servo_id, servo.model)) is not None
                ]
                text = f"{len(found) - len(failed)} servos confirm it at {rate} baud"
                return StopOutcome(
                    device, "torque off", "; ".join([text, *failed]), not failed, ports=(device,)
                )
    return StopOutcome(
        device,
        "torque off",
        f"sent at {sent} baud rates, but no servo replies; check the power",
        False,
        ports=(device,),
    )


def _confirm(port: SerialPort | NetworkPort, servo_id: int, model: str) -> str | None:
    """Read a servo's torque, switch it off again if it is on; returns the fault, if any."""
    try:
        bus = servo_bus(port, model, latency_s=port.latency_s, tries=_TRIES)
        bus.write_verified(servo_id, "Torque Enable", 0)
    except (BusError, ControlTableError) as fault:
        return f"servo {servo_id}: not confirmed: {fault}"
    return None
