"""One simulated bus for a test: a port object in simulated time, a device in real time."""

import queue
import threading
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path

from snakewalk.config.arrays import AnyInts
from snakewalk.config.errors import InputError
from snakewalk.config.faults import FaultPlan
from snakewalk.config.loader import checked, load
from snakewalk.drivers.clock import WallClock
from snakewalk.sim.faults.fault_player import FaultPlayer
from snakewalk.sim.feetech.decode import decoder_for
from snakewalk.sim.serve.bench_line import bench_line
from snakewalk.sim.serve.chain_spec import parse_chain, parse_imu
from snakewalk.sim.serve.protocol_snakewalk import LINES
from snakewalk.sim.serve.pty import PtyServer
from snakewalk.sim.serve.register_access import (
    register_name,
    rows_of,
    set_load,
    set_register,
)
from snakewalk.sim.sniff.decode import DecodedPacket

_BUSY_MS = 10.0
"""Lateness that a client with short time-outs notices (ours)."""


class ServoBus:
    """One simulated bus; reading ``path`` starts serving it in real time."""

    def __init__(
        self,
        servos: str | Sequence[int] = "1-4",
        *,
        baud: int = 1_000_000,
        faults: str | Path | FaultPlan | None = None,
        start_rad: float = 0.0,
        imu: str | None = None,
    ) -> None:
        device = None if imu is None else parse_imu(imu)
        chain = parse_chain(servos if isinstance(servos, str) else ",".join(map(str, servos)))
        self.line = bench_line(chain, baud, start_rad, device)
        """Port of the simulated bus, in simulated time."""
        plan = load(Path(faults), FaultPlan) if isinstance(faults, str | Path) else faults
        self._faults = None if plan is None else FaultPlayer(self.line, plan)
        self._packets: list[DecodedPacket] = []
        self._raw_packets: deque[tuple[float, bytes]] = deque()  # decoded when a test asks
        records = dict(zip(chain.ids, chain.records(), strict=True))
        self._decoder = decoder_for(records[chain.ids[0]], records)
        self.line.taps.append(lambda at_s, _, data: self._raw_packets.append((at_s, bytes(data))))
        self._baud = baud
        self.url = f"snakewalk://{id(self)}"
        """URL for ``serial.serial_for_url``, in simulated time."""
        LINES[self.url] = self.line
        self._server: PtyServer | None = None
        self._thread: threading.Thread | None = None
        self._stop = threading.Event()
        self._orders: queue.SimpleQueue[_Order] = queue.SimpleQueue()

    @property
    def path(self) -> str:
        """Serial device to open; the first access starts real time on the bus."""
        if self._server is None:
            self._server = PtyServer(self.line, WallClock())
            self._thread = threading.Thread(
                target=self._server.serve, args=(self._is_stopped,), daemon=True
            )
            self._thread.start()
        return self._server.path

    def __getitem__(self, register: str) -> AnyInts:
        """(S,) current values of a register, in the order of the IDs; a copy.

        Raises:
            KeyError: the register does not exist; lists the closest names.

        """
        if self._server is None:
            self.line.settle()
        try:
            return self.line.shown(register_name(self.line, register, []))
        except InputError as error:
            raise KeyError(str(error)) from None

    def set(self, register: str, value: int, ids: Sequence[int] | None = None) -> None:
        """Set a register of some servos, or of all (``ids`` None), like another program.

        ``register`` is the SDK's name; ``value`` the raw number.

        Raises:
            InputError: the register or an ID is unknown, or the servo measures the register.
            ControlTableError: the value does not fit.

        """

        def change() -> None:
            set_register(self.line, self._rows(ids), register, value)

        self._apply_change(change)

    def load(self, load_n_m: float, ids: Sequence[int] | None = None) -> None:
        """Put a constant torque on the shafts of some servos, or of all.

        Raises:
            InputError: an ID is unknown.

        """
        self._apply_change(lambda: set_load(self.line, self._rows(ids), load_n_m))

    def fault(self, kind: str, **keys: object) -> None:
        """Begin a fault of a fault file now: ``fault("mute", ids=[3], for_s=2.0)``.

        Raises:
            ConfigError: the kind or a key is unknown, or the bus lacks a servo.

        """
        plan = checked(FaultPlan, {"fault": [{"kind": kind, **keys}]}, "fault")

        def begin() -> None:
            if self._faults is None:
                self._faults = FaultPlayer(self.line, FaultPlan())
            self._faults.add(plan, "fault")

        self._apply_change(begin)

    @property
    def packets(self) -> list[DecodedPacket]:
        """Requests and replies so far, decoded."""
        while self._raw_packets:
            self._packets += self._decoder.feed(*self._raw_packets.popleft())
        return self._packets

    @property
    def lateness(self) -> str | None:
        """Delay of the bus as one line; None before ``path`` was read."""
        server = self._server
        if server is None:
            return None
        rate = self.line.getBaudRate()
        if rate != self._baud:
            return (
                f"bus.path: the client uses {rate} baud, the servos {self._baud}; open the port at "
                f"{self._baud}, or make the bus by servo_bus(..., baud={rate})"
            )
        late_ms = server.latest_s * 1e3
        text = f"bus.path: served up to {late_ms:.0f} ms late; {server.missed_s:.2f} s left out"
        if late_ms < _BUSY_MS:
            return text
        return (
            f"{text}: the machine was busy, and replies may have missed their time-outs; run with "
            "fewer workers (-n), or use bus.line, which has simulated time"
        )

    def _rows(self, ids: Sequence[int] | None) -> list[int]:
        return rows_of(self.line, ids)

    def _apply_change(self, change: Callable[[], None]) -> None:
        if self._thread is None:
            self.line.settle()
            change()
            return
        order = _Order(change)
        self._orders.put(order)
        order.is_done.wait()
        if order.error is not None:
            raise order.error

    def _is_stopped(self) -> bool:
        while not self._orders.empty():
            order = self._orders.get()
            try:
                order.change()
            except Exception as error:
                order.error = error
            order.is_done.set()
        return self._stop.is_set()

    def close(self) -> None:
        """Stop serving; safe to call twice."""
        LINES.pop(self.url, None)
        self._stop.set()
        if self._thread is not None:
            self._thread.join(5.0)
        if self._server is not None:
            self._server.close()
        self._thread = None


class _Order:
    """A change for the serving thread."""

    def __init__(self, change: Callable[[], None]) -> None:
        self.change = change
        self.is_done = threading.Event()
        self.error: Exception | None = None
