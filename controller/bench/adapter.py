"""The host's side of the cable: device, permission to open it, and its latency."""

import os
from pathlib import Path

from snakewalk.controller.console.finding import Finding
from snakewalk.drivers.bus.budget import WireBudget
from snakewalk.drivers.errors import PortError
from snakewalk.drivers.port.byte_port import is_url

WIRE_CHECK = "wire budget"
_GOOD_LATENCY_MS = 2


def permission(device: str) -> Finding:
    """Whether this user may open the device.

    Raises:
        PortError: the device does not exist.

    """
    if is_url(device):
        return Finding("permission", "ok", f"{device} is reached over a network")
    path = Path(device)
    if not path.exists():
        raise PortError(f"{device}: no such port: is it plugged in?")
    if os.access(path, os.R_OK | os.W_OK):
        return Finding("permission", "ok", f"{device} may be read and written")
    group = path.group()
    return Finding(
        "permission",
        "fail",
        f"{device} belongs to group {group}, which you are not in",
        f"sudo usermod -aG {group} $USER, then log in again",
    )


def latency_timer(timer_ms: int | None, device: str) -> Finding:
    """Time for which the USB adapter's driver keeps bytes; None if unknown."""
    check = "latency timer"
    if timer_ms is None:
        return Finding(check, "ok", "not a USB adapter with a latency timer")
    if timer_ms <= _GOOD_LATENCY_MS:
        return Finding(check, "ok", f"{timer_ms} ms")
    tty = Path(device).resolve().name
    return Finding(
        check,
        "fail",
        f"{timer_ms} ms: every answer may come that much later",
        f"echo 1 | sudo tee /sys/bus/usb-serial/devices/{tty}/latency_timer "
        "(and a udev rule, so that it stays: docs/how-to/examine-a-bus.md)",
    )


def wire(budget: WireBudget, rate_hz: float) -> Finding:
    """Whether the cycle fits the wire."""
    kind = "fast sync read" if budget.fast else "sync read"
    load_text = (
        f"{budget.servos} servos, {budget.baud} baud, {kind}: {budget.cycle_s * 1e3:.2f} ms per "
        f"cycle, at most {budget.limit_hz:.0f} Hz; {rate_hz:g} Hz use "
        f"{budget.share(rate_hz):.0%} of the wire"
    )
    if budget.share(rate_hz) > 1.0:
        return Finding(
            WIRE_CHECK,
            "fail",
            load_text,
            "snakewalk bus set --id ID --new-baud 1000000, or a lower rate",
        )
    if budget.share(rate_hz) > 0.7:
        return Finding(WIRE_CHECK, "warn", load_text, "little is left for retries: raise the baud")
    return Finding(WIRE_CHECK, "ok", load_text)
