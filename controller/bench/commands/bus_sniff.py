"""``snakewalk bus sniff``: an exchange on a bus, packet by packet."""

import json
import os
import select
import sys
import tty
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import serial
import typer

from snakewalk.config.constants import DEFAULT_BAUD, DEFAULT_SERVO_MODEL
from snakewalk.config.errors import InputError
from snakewalk.config.servo_catalogue import servo_model
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Json
from snakewalk.drivers.clock import WallClock
from snakewalk.drivers.port.serial_port import open_fault
from snakewalk.sim.feetech.decode import decoder_for
from snakewalk.sim.sniff.trace import read_trace

CHUNK_BYTES = 4096
WAIT_S = 0.1


def receive(device: str, baud: int, for_s: float | None) -> Iterator[tuple[float, bytes]]:
    """(time in s, bytes) seen on ``device``; nothing is ever sent.

    Raises:
        InputError: the device cannot be opened.

    """
    clock = WallClock()
    with _open_device(device, baud) as port:
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
        with _open_device(device, baud) as port:
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


def _open_device(device: str, baud: int) -> serial.Serial:
    try:
        return serial.Serial(device, baud, timeout=WAIT_S)
    except (serial.SerialException, ValueError) as error:
        raise InputError(open_fault(device, baud, error)) from None


@command("bus sniff", examples=("bus sniff exchange.jsonl --json", "bus sniff /dev/ttyUSB1"))
def sniff(
    source: Annotated[
        Path, typer.Argument(help="recording (JSON lines, hex text, raw bytes), or serial device")
    ],
    baud: Annotated[int, typer.Option(help="baud rate of the device in bit/s")] = DEFAULT_BAUD,
    model: Annotated[
        str,
        typer.Option(help="model, or file of a model, of servos that the exchange does not ping"),
    ] = DEFAULT_SERVO_MODEL,
    through: Annotated[
        bool, typer.Option("--through", help="forward the bytes between a client and the device")
    ] = False,
    for_s: Annotated[
        float | None,
        typer.Option("--for", help="stop after this many seconds; default: sniff until Ctrl-C"),
    ] = None,
    as_json: Json = False,
) -> None:
    """Decode a live or recorded exchange packet by packet."""
    if not source.exists():
        raise InputError(f"{source}: no such file or device")
    facts = servo_model(model, Path())
    decoder = decoder_for(facts)
    live = source.is_char_device()
    if through and not live:
        raise InputError(f"{source}: --through needs a serial device")
    if not live:
        pieces = read_trace(source)
    elif through:
        pieces = stand_between(str(source), baud, for_s)
    else:
        pieces = receive(str(source), baud, for_s)
    size = 0
    packets = 0
    waiting: list[str] = []  # a recording without any packet is rejected before it is shown
    try:
        for time_s, data in pieces:
            size += len(data)
            for line in decoder.feed(time_s, data):
                packets += line.kind != "noise"
                waiting.append(json.dumps(line.to_dict()) if as_json else line.text())
                if live or packets:
                    print("\n".join(waiting), flush=live)
                    waiting.clear()
    except KeyboardInterrupt:
        print(file=sys.stderr)
    if not live and packets == 0:
        what = f"no packet in {size} bytes" if size else "no exchange"
        raise InputError(
            f"{source}: holds {what}; --model AX-12A decodes Protocol 1.0, --model STS3215 "
            "Feetech's protocol"
        )
