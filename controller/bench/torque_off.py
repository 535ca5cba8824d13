"""Torque off to all servos of a port: at every baud rate, or past a program that has it open."""

import os
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from typing import Any

from snakewalk.controller.bench.emergency_stop import StopOutcome
from snakewalk.drivers.clock import WallClock
from snakewalk.drivers.errors import BusError, ControlTableError, PortBusyError
from snakewalk.drivers.port.line_port import LinePort
from snakewalk.drivers.port.network_port import open_port
from snakewalk.drivers.port.port_holders import holders_of

_LIKELY = (1_000_000, 57_600)
"""Sent before anything slow is imported: the usual rate, and that of new servos."""
_USB_S = 5e-3
"""Longest time for which an adapter keeps bytes before it sends them (ours)."""
_COPIES = 3
"""Number of times that torque off is sent: noise may hit one (ours)."""
_TRIES = 8
"""Number of times that a servo is asked whether its torque is off (ours)."""
_BITS_PER_BYTE = 10
_REPETITIONS = 20
"""Number of times that torque off is sent past another program (ours): its packets hit some."""
_PAST_EVERY_S = 7e-3
"""Time between these; no divisor of a usual period of control (ours)."""
DYNAMIXEL_OFF = bytes.fromhex("fffffd00fe0600034000002e16")
"""Write 0 to Torque Enable(64) of all X and MX(2.0) servos; ``encode_instruction`` is slow to
import."""
FEETECH_OFF = bytes.fromhex("fffffe04032800d2")
"""Write 0 to Torque Enable(40) of all Feetech servos."""
_PACKETS = (DYNAMIXEL_OFF + FEETECH_OFF) * _COPIES


def torque_off(
    device: str,
    bauds: Sequence[int] = (),
    on_progress: Callable[[str], None] = lambda step: None,
) -> StopOutcome:
    """Switch torque off on every servo of a port.

    The bytes go out first. Then each servo that replies reports its torque, and gets the command
    once more by its model's control table.

    Raises:
        PortError: it is not there, or may not be opened.
        ControlTableError: servos do not have a baud rate.

    """
    if bauds:
        _scan_module().check_bauds(bauds)
    first = tuple(bauds) or _LIKELY
    try:
        opened = open_port(device, first[0])
    except PortBusyError:
        return StopOutcome(device, "port in use", _send_past(device), safe=False, ports=(device,))
    with opened as port:
        sent = _send(port, first)
        scan = _scan_module()
        all_bauds = sorted(scan.known_bauds(), reverse=True)
        others = () if bauds else tuple(rate for rate in all_bauds if rate not in _LIKELY)
        sent += _send(port, others)
        rates = first + others
        # on a bad line a request gets lost: the likely rates are asked twice
        for rate in (*rates, *(rate for rate in rates if rate in _LIKELY)):
            on_progress(f"torque off is sent; waiting for replies at {rate} baud")
            servos = scan.scan(port, [rate], patient=False).servos
            if servos:
                port.setBaudRate(rate)
                failed = [
                    fault
                    for servo in servos
                    if (fault := _confirm(port, servo.servo_id, servo.model)) is not None
                ]
                text = f"{len(servos) - len(failed)} servos confirm it at {rate} baud"
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


def only_port() -> str:
    """Return the only serial adapter there is.

    Raises:
        PortError: no adapter is connected, or several are.

    """
    port: str = _scan_module().pick_port(None)
    return port


def _scan_module() -> Any:
    """Import the bus on use: the import is slow."""
    from snakewalk.controller.bench import scan  # noqa: PLC0415  slow to import

    return scan


def _send(port: LinePort, rates: Iterable[int]) -> int:
    """Send torque off at baud rates; return the number of rates that the port accepts."""
    sent = 0
    for rate in rates:
        if port.setBaudRate(rate):
            port.write(_PACKETS)
            sent += 1
            wire_s = len(_PACKETS) * _BITS_PER_BYTE / rate
            port.clock.sleep_until_s(port.clock.now_s() + wire_s + max(_USB_S, port.latency_s))
    return sent


def _send_past(device: str) -> str:
    """Send torque off on a device that another program has open, at its rate; return the result."""
    sent = 0
    clock = WallClock()
    with suppress(OSError):  # an exclusive device; or a full one
        line = os.open(device, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            while sent < _REPETITIONS:
                os.write(line, _PACKETS)
                sent += 1
                clock.sleep_until_s(clock.now_s() + _PAST_EVERY_S)
        finally:
            os.close(line)
    holders = ", ".join(map(str, holders_of(device)))
    holder = holders or "a program that is hidden from here"
    if sent == 0:
        text = f"torque off was not sent: {holder} has the port open, and lets no other write"
    else:
        text = (
            f"torque off was sent {sent} times, but no servo was asked; {holder} has the port open "
            "and may switch torque on again"
        )
    return f"{text}; end that program, on the host by: sudo snakewalk stop --port {device}"


def _confirm(port: LinePort, servo_id: int, model: str) -> str | None:
    """Read a servo's torque, switch it off again if it is on; returns the fault, if any."""
    from snakewalk.drivers.bus.feetech_bus import servo_bus  # noqa: PLC0415  slow to import

    try:
        bus = servo_bus(port, model, latency_s=port.latency_s, tries=_TRIES)
        bus.write_verified(servo_id, "Torque Enable", 0)
    except (BusError, ControlTableError) as fault:
        return f"servo {servo_id}: not confirmed: {fault}"
    return None
