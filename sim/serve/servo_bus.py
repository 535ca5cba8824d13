"""One simulated bus for a test: in simulated time as a port object, in real time as a device."""

import threading
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.faults import FaultPlan
from snakewalk.config.loader import load
from snakewalk.drivers.clock import WallClock
from snakewalk.sim.faults.fault_player import FaultPlayer
from snakewalk.sim.serve.bench_line import bench_line
from snakewalk.sim.serve.chain_spec import parse_chain, parse_imu
from snakewalk.sim.serve.pty import PtyServer


class ServoBus:
    """One simulated bus; ``path`` starts serving it in real time."""

    def __init__(
        self,
        servos: str = "1-4",
        *,
        baud: int = 1_000_000,
        faults: str | Path | FaultPlan | None = None,
        start_rad: float = 0.0,
        imu: str | None = None,
    ) -> None:
        device = None if imu is None else parse_imu(imu)
        self.line = bench_line(parse_chain(servos), baud, start_rad, device)
        """The bus as a port in simulated time."""
        if faults is not None:
            plan = faults if isinstance(faults, FaultPlan) else load(Path(faults), FaultPlan)
            FaultPlayer(self.line, plan)
        self._server: PtyServer | None = None
        self._thread: threading.Thread | None = None
        self._stop = threading.Event()

    @property
    def path(self) -> str:
        """Serial device to open; from the first look on, time on the bus is real time."""
        if self._server is None:
            self._server = PtyServer(self.line, WallClock())
            self._thread = threading.Thread(
                target=self._server.serve, args=(self._stop.is_set,), daemon=True
            )
            self._thread.start()
        return self._server.path

    def __getitem__(self, register: str) -> NDArray[np.integer]:
        """(S,) values of a register, in the order of the IDs; a copy, as fresh as a read is."""
        if self._server is None:
            self.line.settle()
        return self.line.shown(register)

    def close(self) -> None:
        """Stop serving; safe to call twice."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join(5.0)
        if self._server is not None:
            self._server.close()
        self._thread = None
