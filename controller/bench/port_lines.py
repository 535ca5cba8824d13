"""The lines that a service command has opened: one port, or one for each segment of the chain."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

from snakewalk.config.errors import InputError
from snakewalk.config.robot import SIMULATED
from snakewalk.controller.bench.scan import pick_port
from snakewalk.controller.bench.servo_settings import open_servo
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.clock import WallClock
from snakewalk.drivers.port import network_port
from snakewalk.drivers.port.line_port import LinePort
from snakewalk.drivers.port.port_map import is_port_map, parse_port_map

Line = LinePort


@dataclass(frozen=True, slots=True)
class PortLines:
    """Opened lines, and which servo is on which."""

    port: str
    """Name of the port as the user gave it."""
    lines: tuple[tuple[Line, tuple[int, ...] | None], ...]
    """Ports with the IDs of their servos; None: any servo."""

    @property
    def several(self) -> bool:
        """Whether messages name a servo with its port."""
        return len(self.lines) > 1

    def open_servo(self, servo_id: int) -> DynamixelBus:
        """Bus with the control table of the servo that answers to ``servo_id``.

        Raises:
            InputError: the port map does not have it.
            ControlTableError: its model is not known.
            BusError: it does not answer.

        """
        for line, ids in self.lines:
            if ids is None or servo_id in ids:
                return open_servo(line, servo_id, line.latency_s)
        raise InputError(f"--port {self.port}: has no ID {servo_id}; give its port")

    def misplaced(self, servos_of_lines: Iterable[tuple[str, int]]) -> list[str]:
        """Servos that answer where ``--port`` does not have them, in words.

        Args:
            servos_of_lines: port and ID of each servo that answered.

        """
        there = {line.name: ids for line, ids in self.lines}
        return [
            f"{name}: servo {servo_id} answers here; --port does not say so"
            for name, servo_id in servos_of_lines
            if (ids := there[name]) is not None and servo_id not in ids
        ]


@contextmanager
def open_lines(port: str | None, baud: int) -> Iterator[PortLines]:
    """Open the port of ``--port``, or all of ``1-8=PORT,9-16=PORT``; they close at the end.

    Raises:
        PortError: one is not there, or cannot be opened; none was named, and there is not just one.
        InputError: an entry that cannot be read, or a port or an ID that is named twice.

    """
    if port is None or not is_port_map(port):
        name = pick_port(port)
        with network_port.open_port(name, baud) as line:
            yield PortLines(name, ((line, None),))
        return
    segments = parse_port_map(port)
    _check_segments(port, segments)
    clock = WallClock()
    lines = []
    with ExitStack() as opened:
        for name, ids in segments:
            line = network_port.open_port(name, baud, clock)
            opened.callback(line.closePort)
            lines.append((line, ids))
        yield PortLines(port, tuple(lines))


def _check_segments(port: str, segments: Sequence[tuple[str, tuple[int, ...]]]) -> None:
    names = [name for name, _ in segments]
    ids = [servo_id for _, some in segments for servo_id in some]
    faults = [
        f"--port {port}: {name} is named twice" for name in {n for n in names if names.count(n) > 1}
    ]
    faults += [
        f"--port {port}: ID {servo_id} is on more than one port"
        for servo_id in sorted({i for i in ids if ids.count(i) > 1})
    ]
    if SIMULATED in names:
        faults.append(f"--port {port}: {SIMULATED} works in runs only")
    if faults:
        raise InputError(faults)
