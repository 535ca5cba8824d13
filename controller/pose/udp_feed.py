"""Poses in UDP datagrams."""

import socket
import threading
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass

from snakewalk.config.errors import InputError
from snakewalk.controller.pose.datagram import MOST_BYTES, decode_pose
from snakewalk.controller.pose.sample import ArrivedPose, UnusablePoseError
from snakewalk.drivers.clock import Clock

LOCAL = "127.0.0.1"
MOST_WAITING = 2000
"""Poses that wait to be read; older ones are dropped (ours)."""
_POLL_S = 0.2
SENDER = "127.0.0.1:40000"
"""Address that a simulated tracker has in messages."""


def parse_address(text: str, option: str = "--pose udp") -> tuple[str, int]:
    """Return host and port of ``PORT`` or ``HOST:PORT``.

    Raises:
        InputError: the port is missing.

    """
    host, _, port = text.rpartition(":")
    if not port.isascii() or not port.isdigit() or not 0 < int(port) < 65536:
        raise InputError(f"{option}:{text}: expected PORT or HOST:PORT; for example 9870")
    return host.strip("[]") or LOCAL, int(port)


def decoded(data: bytes, sender: str, arrival_s: float) -> ArrivedPose:
    """Return the pose of a datagram, or why it contains none."""
    try:
        return ArrivedPose(arrival_s, sender, decode_pose(data))
    except UnusablePoseError as fault:
        return ArrivedPose(arrival_s, sender, fault)


@dataclass(frozen=True, slots=True)
class SimulatedDatagrams:
    """The datagrams of a simulated tracker; a ``PoseFeed``."""

    due: Callable[[float], Sequence[tuple[float, bytes]]]
    """Returns time and bytes of the datagrams that are due."""

    def arrived(self, now_s: float) -> Sequence[ArrivedPose]:
        """Return the poses that have arrived since the last call."""
        return [decoded(data, SENDER, due_s) for due_s, data in self.due(now_s)]


class PoseQueue:
    """Poses that one thread receives and another reads."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._waiting: deque[ArrivedPose] = deque(maxlen=MOST_WAITING)

    def put(self, data: bytes, sender: str) -> None:
        """Keep the pose of a datagram that arrives now, or why it contains none."""
        self._waiting.append(decoded(data, sender, self._clock.now_s()))

    def arrived(self, now_s: float) -> Sequence[ArrivedPose]:
        """Return the poses that have arrived since the last call."""
        arrivals = []
        while self._waiting:
            arrivals.append(self._waiting.popleft())
        return arrivals


class UdpFeed(PoseQueue):
    """Receives datagrams in a thread of its own, which notes when each arrived.

    Raises:
        InputError: the address cannot be bound.

    """

    def __init__(self, host: str, port: int, clock: Clock) -> None:
        super().__init__(clock)
        try:
            family = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0][0]
            self._socket = socket.socket(family, socket.SOCK_DGRAM)
            self._socket.bind((host, port))
        except OSError as error:
            raise InputError(
                f"pose udp:{host}:{port}: cannot be bound ({error.strerror or error}); end the "
                "program that uses the port, or choose another one"
            ) from None
        self._socket.settimeout(_POLL_S)
        self.port: int = self._socket.getsockname()[1]
        """Number of the bound port."""
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._receive, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop receiving."""
        self._ended.set()
        self._thread.join()
        self._socket.close()

    def _receive(self) -> None:
        while not self._ended.is_set():
            with suppress(TimeoutError):
                try:
                    data, address = self._socket.recvfrom(MOST_BYTES)
                except ConnectionError:  # an answer to a datagram that was sent earlier
                    continue
                self.put(data, f"{address[0]}:{address[1]}")


class UdpSender:
    """Sends datagrams to an address; a missing receiver is ignored.

    Raises:
        InputError: the host is unknown.

    """

    def __init__(self, host: str, port: int) -> None:
        try:
            family, *_, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
        except OSError as error:
            raise InputError(f"udp:{host}:{port}: unknown host ({error.strerror})") from None
        self._address = address
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)

    def send(self, data: bytes) -> None:
        """Send a datagram; returns at once."""
        with suppress(OSError):
            self._socket.sendto(data, self._address)

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()
