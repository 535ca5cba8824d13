"""Live bytes of a serial line for ``bus sniff``: listening in, or standing between two ends."""

import os
import select
import sys
import tty
from collections.abc import Iterator

import serial

from snakewalk.config.errors import InputError
from snakewalk.drivers.clock import WallClock
from snakewalk.drivers.port.serial_port import open_fault

CHUNK_BYTES = 4096
WAIT_S = 0.1


def receive(device: str, baud: int, for_s: float | None) -> Iterator[tuple[float, bytes]]:
    """(time in s, bytes) seen on ``device``; nothing is ever sent.

    Raises:
        InputError: the device cannot be opened.

    """
    clock = WallClock()
    with _opened(device, baud) as port:
        while for_s is None or clock.now_s() < for_s:
            data = port.read(max(1, port.in_waiting))
            if data:
                yield clock.now_s(), data


def stand_between(device: str, baud: int, for_s: float | None) -> Iterator[tuple[float, bytes]]:
    """Offer a pseudo-terminal, pass all bytes on to ``device`` and back, and yield them.

    Raises:
        InputError: the device cannot be opened.

    """
    clock = WallClock()
    master, slave = os.openpty()
    tty.setraw(slave)
    try:
        with _opened(device, baud) as port:
            print(f"port {os.ttyname(slave)}", file=sys.stderr, flush=True)
            while for_s is None or clock.now_s() < for_s:
                ready, _, _ = select.select([master, port.fileno()], [], [], WAIT_S)
                if master in ready:
                    data = os.read(master, CHUNK_BYTES)
                    port.write(data)
                    yield clock.now_s(), data
                if port.fileno() in ready:
                    data = port.read(max(1, port.in_waiting))
                    os.write(master, data)
                    yield clock.now_s(), data
    finally:
        os.close(master)
        os.close(slave)


def _opened(device: str, baud: int) -> serial.Serial:
    try:
        return serial.Serial(device, baud, timeout=WAIT_S)
    except (serial.SerialException, ValueError) as error:
        raise InputError(open_fault(device, baud, error)) from None
