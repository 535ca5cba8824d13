"""Live table of a served bus, drawn by a separate process.

A thread would hold the interpreter for 5 ms at a time, longer than the delay of a reply.
"""

import sys
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection

from rich.console import Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from snakewalk.controller.console.child_process import pipe, start
from snakewalk.controller.console.plain_console import PlainConsole
from snakewalk.drivers.priority import give_way
from snakewalk.sim.feetech.decode import AnyDecoder
from snakewalk.sim.serve.live_table import Packet, Rows
from snakewalk.sim.sniff.decode import DecodedPacket

MakeDecoder = Callable[[], AnyDecoder]
_LISTED_PACKETS = 8
"""Packets in words below the table."""
_END_S = 2.0
"""Longest time until the drawing process ends."""


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Content of one drawing."""

    counts: str
    rows: Rows
    packets: tuple[Packet, ...]
    """Latest packets, oldest first."""


class LiveScreen:
    """Draws snapshots on standard error; use it in a ``with``.

    ``make_decoder`` is called in the drawing process and must be picklable.
    """

    def __init__(self, make_decoder: MakeDecoder) -> None:
        self._line, far = pipe()
        self._process = start(_draw, far, make_decoder)
        far.close()

    def __enter__(self) -> "LiveScreen":
        return self

    def __exit__(self, *raised: object) -> None:
        self._line.close()
        self._process.join(_END_S)
        if self._process.is_alive():
            self._process.kill()

    @property
    def ready(self) -> bool:
        """Whether the last snapshot is drawn: only then the next is sent, so nothing ever waits."""
        with suppress(EOFError, OSError):
            if self._line.poll():
                self._line.recv()
                return True
        return False

    def show(self, snapshot: Snapshot) -> None:
        """Send a snapshot once after each time that the screen was ``ready``."""
        with suppress(OSError):  # its process was killed: the servos go on
            self._line.send(snapshot)


def _draw(line: Connection, make_decoder: MakeDecoder) -> None:
    give_way()
    decoder = make_decoder()
    recent = deque[DecodedPacket](maxlen=_LISTED_PACKETS)
    screen = PlainConsole(file=sys.stderr)
    with Live(console=screen, auto_refresh=False) as live, suppress(EOFError, OSError):
        while True:
            line.send(None)
            shown: Snapshot = line.recv()
            for time_s, data in shown.packets:
                recent.extend(decoder.feed(time_s, data))
            live.update(view(shown, recent, screen.width), refresh=True)


def view(shown: Snapshot, recent: deque[DecodedPacket], columns: int) -> Group:
    """Counts, registers and the latest packets, each in one line."""
    # 80 columns hold the headings and the largest registers, a column apart
    table = Table(box=None, header_style="bold", padding=(0, 1, 0, 0), pad_edge=False)
    for heading in shown.rows[0] if shown.rows else ():
        table.add_column(heading, min_width=len(heading), no_wrap=True)
    for row in shown.rows:
        style = "red" if row["error"] or not row["power"] else "" if row["torque"] else "dim"
        table.add_row(*(str(value) for value in row.values()), style=style)
    packets = "\n".join(packet.text()[:columns] for packet in recent)
    return Group(Text(shown.counts, style="bold"), table, Text(packets, style="dim"))
