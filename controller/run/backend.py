"""Bus of a run, and the bus of real servos; ``simulated_backend`` has that of simulated ones.

Everything above the byte port is the same object for both.
"""

import os
from collections.abc import Callable, Collection, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Protocol

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.loader import with_keys
from snakewalk.config.robot import SIMULATED, RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.controller.pose.sample import PoseFeed
from snakewalk.controller.pose.udp_feed import SimulatedDatagrams
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
from snakewalk.drivers.port.line_port import LinePort
from snakewalk.drivers.port.network_port import open_port
from snakewalk.drivers.port.port_map import is_port_map, parse_port_map, port_map_text
from snakewalk.drivers.port.served_line import SCHEME, ServedLine
from snakewalk.drivers.types import BodyPose

FILE_PORTS = "robot"
"""Value of ``--port`` for a robot whose file names the ports of its segments."""


@dataclass(frozen=True, slots=True)
class Backend:
    """A chain of servos, its clock, and its other sources of information."""

    name: str
    chain: ServoChain
    clock: Clock
    pose: Callable[[], BodyPose] | None
    """Source of the head link's pose; None without one."""
    qpos: Callable[[], Floats] | None
    """Coordinates of the simulator, for the film."""
    wire_busy_s: Callable[[], float]
    """Time for which bytes have occupied the wire; NaN if unknown."""
    energy: Callable[[], MotorEnergy] = MotorEnergy
    """Energy that the motors have consumed, and their work."""
    twin: Callable[[], Twin] | None = None
    """Makes a second body, on which motion is tried; None in real time."""
    lay_down: Callable[[InitialPose], None] | None = None
    """Moves a simulated body to another place of its level floor; else None."""
    open_supply: Callable[[], None] | None = None
    """Opens the supply of all servos; None if some are real."""
    poses: PoseFeed | None = None
    """Poses of a port in simulated time, instead of datagrams; None in real time."""


class RehearsedPort(Protocol):
    """A port of simulated servos in this process and in simulated time, instead of a real one."""

    @property
    def name(self) -> str:
        """Name of the port, for the log."""
        ...

    def open(self, run: RunConfig, robot: RobotConfig) -> Backend:
        """Open the port; only its bytes and datagrams are visible."""
        ...


def on_ports(robot: RobotConfig, port: str | None) -> RobotConfig:
    """Return the robot with its segments on the ports that ``--port`` means.

    ``port`` is a device or a URL, ``1-8=PORT,9-16=PORT``, or ``robot`` for the ``[[ports]]`` of the
    robot; None is the simulator.

    Raises:
        InputError: the robot's file has no ports, or they do not fit its servos.

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
    port_map = parse_port_map(port) if is_port_map(port) else []
    return with_keys(
        robot, {"ports": [{"port": name, "ids": ids} for name, ids in port_map]}, f"--port {port}"
    )


def metal(run: RunConfig, robot: RobotConfig, port: str) -> Backend:
    """Real servos on ``port``, a device or a URL, or on the robot's ports; nothing measures a pose.

    Raises:
        PortError: a port is missing, held, or not permitted.

    """
    poses = None
    if robot.ports:
        bus: ChainBus = bus_on_ports(robot, WallClock())
    else:
        line = open_port(port, robot.servo.baud)
        bus = _bus_on(robot, line)
        if isinstance(line, ServedLine):
            poses = SimulatedDatagrams(line.due)
    chain = ServoChain(
        bus,
        robot,
        watchdog_s=run.safety.watchdog_s,
        rate_hz=run.cycle_hz,
        fingerprint_file=_fingerprint_file(run),
        can_hold=run.safety.on_trip == "hold",
    )
    name = port_map_text((segment.port, segment.ids) for segment in robot.ports) or port
    return Backend(name, chain, chain.clock, None, None, lambda: float("nan"), poses=poses)


def _fingerprint_file(run: RunConfig) -> FingerprintFile | None:
    path = user_file(run.robot)
    return None if path is None else FingerprintFile(path)


def is_split(robot: RobotConfig) -> bool:
    """Whether some servos are simulated and others real."""
    return any(segment.port == SIMULATED for segment in robot.ports)


def real_ports(robot: RobotConfig) -> list[str]:
    """Ports of the segments with real servos."""
    return [segment.port for segment in robot.ports if segment.port != SIMULATED]


def _bus_on(robot: RobotConfig, line: LinePort, ids: Collection[int] | None = None) -> DynamixelBus:
    return servo_bus(line, robot.models_on(ids), latency_s=line.latency_s)


def bus_on_ports(
    robot: RobotConfig, clock: Clock, simulated_line: BytePort | None = None
) -> SegmentedBus:
    """A bus for each segment; open ports are closed if another port cannot be opened."""
    parts = []
    with ExitStack() as opened:
        for segment in robot.ports:
            if segment.port == SIMULATED and simulated_line is not None:
                bus = servo_bus(simulated_line, robot.models_on(segment.ids))
            else:
                line = open_port(segment.port, robot.servo.baud, clock)
                bus = _bus_on(robot, line, segment.ids)
            opened.callback(bus.port.closePort)
            parts.append((bus, segment.ids))
        opened.pop_all()
    return SegmentedBus(parts)


def is_pseudo_terminal(ports: Sequence[str] | None) -> bool | None:
    """Return whether all ports lead to served simulations; None without a port."""
    if not ports:
        return None
    return all(
        port.startswith(SCHEME) or os.path.realpath(port).startswith("/dev/pts/") for port in ports
    )
