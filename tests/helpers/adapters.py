"""A chain that swings behind a simulated adapter, which may delay bytes or group them."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from snakewalk.config.faults import FaultPlan
from snakewalk.config.robot import RobotConfig, ServoConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.controller.runtime.loop import ticks
from snakewalk.drivers.bus.feetech_bus import servo_bus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import DriverError
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointCommand
from snakewalk.sim.ax12.line import Ax12Line
from snakewalk.sim.faults.fault_player import FaultPlayer
from snakewalk.sim.feetech.line import FeetechLine
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.line.wire import RxQueue
from snakewalk.sim.serve.bench_line import bench_line
from snakewalk.sim.serve.chain_spec import parse_chain
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

JOINTS = 6
PERIOD_S = 0.02
NETWORK_S = 0.1
"""As ``NetworkPort.latency_s``."""
SERVOS = {
    "XM430-W350": ServoConfig(),
    "STS3215": ServoConfig(
        model="STS3215",
        **{"supply_v": 7.4, "supply_min_v": 6.0, "supply_max_v": 8.0},
        **{"position_p_gain": 64, "pitch_p_gain": 32, "pitch_current_limit_a": 1.5},
    ),
}


class _Blocks(RxQueue):
    """Bytes that reach the host in blocks."""

    grid_s = 0.0

    def _handed_on_s(self, now_s: float) -> float:
        return math.floor(now_s / self.grid_s + 1e-9) * self.grid_s

    def count(self, now_s: float) -> int:
        return super().count(self._handed_on_s(now_s))

    def due_s(self, count: int) -> float | None:
        due_s = super().due_s(count)
        return None if due_s is None else math.ceil(due_s / self.grid_s - 1e-9) * self.grid_s

    def take(self, count: int, now_s: float) -> bytes:
        return super().take(count, self._handed_on_s(now_s))


class AdapterLine(SimLine):
    """A line behind an adapter or a network that delays bytes, or hands them on in blocks."""

    def __init__(
        self,
        *,
        in_grid_s: float = 0.0,
        out_grid_s: float = 0.0,
        out_s: float = 0.0,
        in_s: float = 0.0,
    ) -> None:
        ids = tuple(range(1, JOINTS + 1))
        super().__init__(ServoBank(ids), BenchPlant(JOINTS), usb_latency_s=in_s)
        self._out_s, self._out_grid_s = out_s, out_grid_s
        if in_grid_s:
            blocks = _Blocks()
            blocks.byte_s, blocks.grid_s = self._rx_queue.byte_s, in_grid_s
            self._rx_queue = blocks

    @property
    def paced(self) -> bool:
        """No: bytes come in blocks."""
        return False

    def begin(self, packet: bytes) -> bool:
        """Leave every packet to ``write``."""
        return False

    def setPacketTimeout(self, packet_length: int) -> None:
        """As ``NetworkPort``."""
        self.setPacketTimeoutMillis(packet_length * self._byte_s * 1e3 + 2e3 * NETWORK_S)

    def write(self, data: bytes) -> None:
        """Hand bytes on to the wire, later."""
        if self._script is not None:
            self._resume_host()
        due_s = self.clock.now_s() + self._out_s
        if self._out_grid_s:
            due_s = math.ceil(due_s / self._out_grid_s - 1e-9) * self._out_grid_s
        self._transmit(max(due_s, self._sent_until_s), self._split(data), arrives=True)


@dataclass
class Swing:
    """What a chain reported while it swung."""

    tripped: str | None = None
    reports: list[str] = field(default_factory=list)
    at_start: list[str] = field(default_factory=list)
    """Reports of the start."""

    @property
    def said(self) -> str:
        """All of it."""
        return "; ".join([*self.reports, self.tripped or ""])


def swing(
    make: str,
    *,
    line: SimLine | Ax12Line | FeetechLine | None = None,
    amplitude_rad: float = 0.3,
    speed_rad_s: float = 2.5,
    phase_rad: float = 0.0,
    seconds: float = 5.0,
    faults: Sequence[dict[str, Any]] = (),
    change: Callable[[Any], None] | None = None,
    at_s: float = 1.0,
    load_n_m: float = 0.0,
    latency_s: float = 0.004,
    stale_limit_s: float | None = None,
) -> Swing:
    """Swing, from rest; ``faults`` of a fault file, or a ``change`` of the line, begin ``at_s``."""
    line = line or bench_line(parse_chain(f"1-{JOINTS}:{make}"))
    robot = RobotConfig(name="swing", joint_axes="yp" * (JOINTS // 2), servo=SERVOS[make])
    safety = SafetyConfig() if stale_limit_s is None else SafetyConfig(stale_limit_s=stale_limit_s)
    clock, ran = line.clock, Swing()
    chain = ServoChain(servo_bus(line, robot.models_by_id, latency_s=latency_s), robot)
    limits = SafetyLimits.from_config(robot, safety)
    link = SafeLink(chain, limits, clock, on_event=ran.reports.append)
    try:
        link.enable()
        ran.at_start = [*ran.reports]
        ran.reports.clear()
        chain.on_event = ran.reports.append
        start_s = clock.now_s()
        if faults:
            plan = [{**fault, "at_s": at_s + fault.get("at_s", 0.0)} for fault in faults]
            FaultPlayer(line, FaultPlan.model_validate({"seed": 1, "fault": plan}))
        phases_rad = np.arange(JOINTS) + phase_rad
        for _ in ticks(clock, PERIOD_S, start_s + seconds):
            now_s = clock.now_s() - start_s
            if change is not None and now_s >= at_s:
                change(line)
                change = None
            if load_n_m:
                assert isinstance(line, SimLine)
                assert isinstance(line.firmware.plant, BenchPlant)
                line.firmware.plant.set_load(range(0, JOINTS, 2), min(1.0, now_s) * load_n_m)
            link.read()
            goal_rad = amplitude_rad * np.sin(speed_rad_s * now_s + phases_rad)
            link.write(JointCommand(clock.now_s(), min(1.0, 0.5 * now_s) * goal_rad))
    except DriverError as error:
        ran.tripped = str(error)
    return ran
