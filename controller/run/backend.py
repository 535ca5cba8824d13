"""Bus of a run, and the bus of real servos; ``simulated_backend`` has that of simulated ones.

Everything above the byte port is the same object for both.
"""

import os
from collections.abc import Callable, Collection, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Protocol

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.loader import with_keys
from snakewalk.config.robot import SIMULATED, RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.controller.pose.sample import PoseFeed
from snakewalk.controller.runlog.record import InitialPose, MotorEnergy
from snakewalk.controller.walk.twin import Twin
from snakewalk.drivers.bus.chain_bus import ChainBus
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.bus.feetech_bus import servo_bus
from snakewalk.drivers.bus.segmented_bus import SegmentedBus
from snakewalk.drivers.chain.fingerprint_file import FingerprintFile, user_file
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.clock import Clock, WallClock
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.port.network_port import NetworkPort, open_port
from snakewalk.drivers.port.port_map import is_port_map, parse_port_map, port_map_text
from snakewalk.drivers.port.serial_port import SerialPort
from snakewalk.drivers.types import BodyPose

FILE_PORTS: Final = "robot"
"""``--port`` of a robot whose file names the ports of its segments."""


@dataclass(frozen=True, slots=True)
class Backend:
    """A chain of servos, its clock, and what else can be known about it."""

    name: str
    chain: ServoChain
    clock: Clock
    pose: Callable[[], BodyPose] | None
    """Measures the head link; None where nothing does."""
    qpos: Callable[[], Floats] | None
    """The simulator's coordinates, for the film."""
    wire_busy_s: Callable[[], float]
    """Time that bytes have spent on the wire so far; NaN where nobody counts."""
    energy: Callable[[], MotorEnergy] = MotorEnergy
    """Energy that the motors have consumed, and work that they have done so far."""
    twin: Callable[[], Twin] | None = None
    """Makes a second body, on which motion is tried; None where time does not wait for it."""
    lay_down: Callable[[InitialPose], None] | None = None
    """Puts a simulated body elsewhere on its level floor, where its servos hold it; else None."""
    open_supply: Callable[[], None] | None = None
    """Opens the supply of all servos; None if some of them are real."""
    poses: PoseFeed | None = None
    """Poses that arrive at a rehearsal in simulated time, in place of real datagrams."""


class RehearsedPort(Protocol):
    """A port of simulated servos in this process and in simulated time, in place of a real one."""

    @property
    def name(self) -> str:
        """Name of the port, for the log."""
        ...

    def open(self, run: RunConfig, robot: RobotConfig) -> Backend:
        """Open the port; nothing of the simulation but its bytes and datagrams is known."""
        ...


def on_ports(robot: RobotConfig, port: str | None) -> RobotConfig:
    """Return the robot with its segments on the ports that ``--port`` means.

    Args:
        robot: whose ``[[ports]]`` are meant by ``robot``.
        port: a device or a URL, ``1-8=PORT,9-16=PORT``, ``robot``; None: the simulator.

    Raises:
        InputError: the robot's file names no ports, or what is named does not fit its servos.

    """
    if port is None:
        return robot
    if port == FILE_PORTS:
        if not robot.ports:
            raise InputError(
                f"--port {FILE_PORTS}: the file of {robot.name} has no [[ports]]; name them by "
                "--port 1-8=PORT,9-16=PORT"
            )
        return robot
    found = parse_port_map(port) if is_port_map(port) else []
    return with_keys(
        robot, {"ports": [{"port": name, "ids": ids} for name, ids in found]}, f"--port {port}"
    )


def metal(run: RunConfig, robot: RobotConfig, port: str) -> Backend:
    """Real servos on ``port``, a device or a URL, or on the robot's ports; nothing measures a pose.

    Raises:
        PortError: a port is not there, is taken, or may not be opened.

    """
    if robot.ports:
        bus: ChainBus = bus_on_ports(robot, WallClock())
    else:
        bus = _bus_on(robot, open_port(port, robot.servo.baud))
    chain = ServoChain(
        bus,
        robot,
        watchdog_s=run.safety.watchdog_s,
        rate_hz=run.cycle_hz,
        fingerprint_file=_fingerprint_file(run),
        can_hold=run.safety.on_trip == "hold",
    )
    name = port_map_text((each.port, each.ids) for each in robot.ports) or port
    return Backend(name, chain, chain.clock, None, None, lambda: float("nan"))


def _fingerprint_file(run: RunConfig) -> FingerprintFile | None:
    """Fingerprints of the servos, next to the robot's file; None for a shipped robot."""
    path = user_file(run.robot)
    return None if path is None else FingerprintFile(path)


def is_split(robot: RobotConfig) -> bool:
    """Whether some of the robot's servos are simulated, and others real."""
    return any(each.port == SIMULATED for each in robot.ports)


def real_ports(robot: RobotConfig) -> list[str]:
    """Ports of the robot's segments, without that of simulated servos."""
    return [each.port for each in robot.ports if each.port != SIMULATED]


def _bus_on(
    robot: RobotConfig, line: SerialPort | NetworkPort, ids: Collection[int] | None = None
) -> DynamixelBus:
    return servo_bus(line, robot.models_on(ids), latency_s=line.latency_s)


def bus_on_ports(
    robot: RobotConfig, clock: Clock, simulated_line: BytePort | None = None
) -> SegmentedBus:
    """A bus for each segment; open ports are closed if another port cannot be opened."""
    parts = []
    with ExitStack() as opened:
        for each in robot.ports:
            if each.port == SIMULATED and simulated_line is not None:
                bus = servo_bus(simulated_line, robot.models_on(each.ids))
            else:
                line = open_port(each.port, robot.servo.baud, clock)
                bus = _bus_on(robot, line, each.ids)
            opened.callback(bus.port.closePort)
            parts.append((bus, each.ids))
        opened.pop_all()
    return SegmentedBus(parts)


def is_pseudo_terminal(ports: Sequence[str] | None) -> bool | None:
    """Return whether all ports are pseudo-terminals, as those of served simulations are.

    Returns:
        None without a port.

    """
    if not ports:
        return None
    return all(Path(os.path.realpath(port)).parts[:3] == ("/", "dev", "pts") for port in ports)
