"""Bus of a run: simulated servos in this process, or real ones on a serial port."""

import os
from collections.abc import Callable, Collection, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final, Protocol

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import with_keys
from snakewalk.config.robot import SIMULATED, RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.pose.sample import PoseFeed
from snakewalk.controller.run.deviation import Deviation
from snakewalk.controller.run.external.served_robot import physics_modules, simulated_line
from snakewalk.controller.run.external.simulated_bus import SimulatedBus
from snakewalk.controller.runlog.record import InitialPose, MotorEnergy
from snakewalk.controller.walk.twin_rollout import Twin
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
from snakewalk.drivers.types import BodyPose, JointState
from snakewalk.sim.line.clock import RealTimeClock
from snakewalk.sim.physics.split_plant import SplitPlant
from snakewalk.sim.servo.motor import motors_of

if TYPE_CHECKING:
    from snakewalk.sim.physics.plant import MujocoPlant

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
    """Poses of a rehearsal in simulated time, instead of datagrams."""


class RehearsedPort(Protocol):
    """A port of simulated servos in this process and in simulated time, instead of a real one."""

    @property
    def name(self) -> str:
        """Name of the port, for the log."""
        ...

    def open(self, run: RunConfig, robot: RobotConfig) -> Backend:
        """Open the port; only its bytes and datagrams are visible."""
        ...


class _SimulatedBody:
    def __init__(
        self,
        run: RunConfig,
        robot: RobotConfig,
        world: WorldConfig,
        ground: HeightField | None,
        deviation: Deviation,
    ) -> None:
        plant, twin = physics_modules()
        self.plant: MujocoPlant = plant.MujocoPlant(
            *(deviation.robot(robot), deviation.world(world), ground, run.physics_step_s),
            is_placed=False,
        )
        self.imu = partial(plant.plant_imu, robot, self.plant, robot.servo.baud, run.seed)
        """Makes the robot's IMU from the motion of the body; None without an IMU."""
        self.twin = partial(twin.PlantTwin, robot, world, ground)
        """Makes a second body."""


def simulated(
    run: RunConfig,
    robot: RobotConfig,
    world: WorldConfig,
    ground: HeightField | None,
    initial_pose: InitialPose,
    deviation: Deviation | None = None,
) -> Backend:
    """Servos on a simulated line that turn a MuJoCo body with its head at the start.

    Args:
        run: start and physics step.
        robot: the body and its servos.
        world: friction and ground.
        ground: the world's height field, where it has one.
        initial_pose: heading of the head link, and joint angles to begin with, as servos say them.
        deviation: differences of the simulated robot and its ground from ``robot`` and ``world``;
            None is the run's.

    """
    if deviation is None:
        deviation = Deviation.of_run(run.deviation, robot)
    made = _SimulatedBody(run, robot, world, ground, deviation)
    body = made.plant
    joint_rad = deviation.shaft_rad(initial_pose.joint_rad)
    body.reset(run.start_m, initial_pose.heading_rad, joint_rad)
    servos = SimulatedBus.of(robot, body, deviation, made.imu())
    chain = ServoChain(
        servos.bus(),
        servos.robot,
        watchdog_s=run.safety.watchdog_s,
        rate_hz=run.cycle_hz,
        can_hold=run.safety.on_trip == "hold",
    )

    def lay_down(pose: InitialPose) -> None:
        servos.settle()
        shaft_rad = deviation.shaft_rad(pose.joint_rad)
        body.lay_down(run.start_m, pose.heading_rad, shaft_rad)
        servos.hold_position()

    return Backend(
        "sim",
        chain,
        servos.clock,
        body.head_pose,
        lambda: body.qpos,
        lambda: servos.busy_s,
        servos.energy,
        made.twin,
        lay_down,
        servos.cut_power,
    )


def on_ports(robot: RobotConfig, port: str | None) -> RobotConfig:
    """Return the robot with its segments on the ports that ``--port`` means.

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
    found = parse_port_map(port) if is_port_map(port) else []
    return with_keys(
        robot, {"ports": [{"port": name, "ids": ids} for name, ids in found]}, f"--port {port}"
    )


def metal(run: RunConfig, robot: RobotConfig, port: str) -> Backend:
    """Real servos on ``port``, or on the robot's ports; nothing measures a pose.

    Raises:
        PortError: a port is missing, held, or not permitted.

    """
    if robot.ports:
        bus: ChainBus = _bus_on_ports(robot, WallClock())
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
    path = user_file(run.robot)
    return None if path is None else FingerprintFile(path)


def split(
    run: RunConfig,
    robot: RobotConfig,
    world: WorldConfig,
    ground: HeightField | None,
    initial_pose: InitialPose,
) -> Backend:
    """Real servos on the robot's ports, the others on a simulated line, in real time.

    Joints of the simulated body that have real servos follow these, so the others feel their weight
    and friction. The simulator gives the pose.

    Raises:
        PortError: a port is missing, held, or not permitted.

    """
    (here,) = (set(each.ids) for each in robot.ports if each.port == SIMULATED)
    rows = [row for row, servo_id in enumerate(robot.servo_ids) if servo_id in here]
    deviation = Deviation.of_run(run.deviation, robot)
    made = _SimulatedBody(run, robot, world, ground, deviation)
    plant = made.plant
    plant.reset(run.start_m, initial_pose.heading_rad, initial_pose.joint_rad)
    motors = motors_of(robot)
    body = SplitPlant(plant, motors, [j for j in range(robot.joint_count) if j not in rows])
    clock, imu = RealTimeClock(), made.imu()
    line = simulated_line(
        *(robot, body, replace(deviation, slip_rad=None)),
        imu if imu is not None and imu.config.id in here else None,
        rows=rows,
        clock=clock,
    )
    bus = _bus_on_ports(robot, clock, line)
    chain = ServoChain(
        bus,
        robot,
        watchdog_s=run.safety.watchdog_s,
        rate_hz=run.cycle_hz,
        can_hold=run.safety.on_trip == "hold",
    )

    def follow(state: JointState) -> None:
        body.follow(state.time_s - state.age_s, state.position_rad, state.velocity_rad_s)

    chain.on_state = follow
    return Backend(
        port_map_text((each.port, each.ids) for each in robot.ports),
        chain,
        clock,
        plant.head_pose,
        lambda: plant.qpos,
        lambda: float("nan"),
    )


def is_split(robot: RobotConfig) -> bool:
    """Whether some servos are simulated and others real."""
    return any(each.port == SIMULATED for each in robot.ports)


def real_ports(robot: RobotConfig) -> list[str]:
    """Ports of the segments with real servos."""
    return [each.port for each in robot.ports if each.port != SIMULATED]


def _bus_on(
    robot: RobotConfig, line: SerialPort | NetworkPort, ids: Collection[int] | None = None
) -> DynamixelBus:
    return servo_bus(line, robot.models_on(ids), latency_s=line.latency_s)


def _bus_on_ports(
    robot: RobotConfig, clock: Clock, simulated_line: BytePort | None = None
) -> SegmentedBus:
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
    """Return whether all ports are pseudo-terminals of served simulations."""
    if not ports:
        return None
    return all(Path(os.path.realpath(port)).parts[:3] == ("/", "dev", "pts") for port in ports)
