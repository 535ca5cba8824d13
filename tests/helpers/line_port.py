"""A simulated line where ports are opened: commands on a port, in simulated time and one thread.

A server on the machine's clock answers too late as soon as the machine is busy, and the command
under test then says what it says of a bad bus.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Self
from unittest import mock

from snakewalk.drivers.clock import Clock
from snakewalk.drivers.port import network_port
from snakewalk.sim.feetech.line import FeetechLine
from snakewalk.sim.line.sim_line import SimLine

_OPENERS = (
    "snakewalk.drivers.port.network_port.open_port",
    "snakewalk.controller.bench.torque_off.open_port",
    "snakewalk.controller.run.backend.open_port",
)


class _Opened:
    """What ``open_port`` gives, besides the line."""

    latency_s = 0.0
    latency_timer_ms = None
    device = "simulated line"

    @property
    def name(self) -> str:
        """As it was opened."""
        return self.device

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pass


class OpenedLine(_Opened, SimLine):
    """Servos of Protocol 2.0."""


class OpenedFeetechLine(_Opened, FeetechLine):
    """Feetech servos."""


@contextmanager
def line_port(line: OpenedLine | OpenedFeetechLine) -> Iterator[str]:
    """Yield a device that exists, and opens ``line``; all other devices are opened as ever."""
    master, slave = os.openpty()
    device, really = os.ttyname(slave), network_port.open_port

    def opened(name: str, baud: int = 1_000_000, clock: Clock | None = None) -> Any:
        if name != device:
            return really(name, baud, clock)
        line.device = name
        line.openPort()
        line.setBaudRate(baud)
        return line

    patches = [mock.patch(each, opened) for each in _OPENERS]
    try:
        for each in patches:
            each.start()
        yield device
    finally:
        for each in patches:
            each.stop()
        os.close(master)
        os.close(slave)
