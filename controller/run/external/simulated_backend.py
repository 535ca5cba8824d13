"""Bus of a run with simulated servos: in the same process, or next to real ones."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from snakewalk.config.robot import RobotConfig
from snakewalk.controller.run.deviation import NO_DEVIATION, Deviation
from snakewalk.controller.run.external.served_robot import motor_energy, simulated_line
from snakewalk.controller.runlog.record import MotorEnergy
from snakewalk.drivers.bus.chain_bus import ChainBus
from snakewalk.drivers.bus.feetech_bus import servo_bus
from snakewalk.drivers.bus.segmented_bus import SegmentedBus
from snakewalk.sim.feetech.line import FeetechLine
from snakewalk.sim.line.clock import SimClock
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.line.wire import LineGroup
from snakewalk.sim.physics.shared_plant import SharedPlant
from snakewalk.sim.plant import Plant
from snakewalk.sim.servo.motor import motors_of

if TYPE_CHECKING:
    from snakewalk.sim.imu import Imu
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import SIMULATED
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.run.backend import Backend, bus_on_ports
from snakewalk.controller.run.external.served_robot import physics_modules
from snakewalk.controller.runlog.record import InitialPose
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.port.port_map import port_map_text
from snakewalk.drivers.types import JointState
from snakewalk.sim.line.clock import RealTimeClock
from snakewalk.sim.physics.split_plant import SplitPlant

if TYPE_CHECKING:
    from snakewalk.sim.physics.plant import MujocoPlant


@dataclass(frozen=True, slots=True)
class SimulatedBus:
    """Simulated servos on the shafts of one body."""

    robot: RobotConfig
    """Robot of the chain; it has no ports if all servos are on one line."""
    lines: tuple[SimLine | FeetechLine, ...]
    """Lines in the order of ``robot.ports``, or the only one."""

    @classmethod
    def of(
        cls,
        robot: RobotConfig,
        plant: Plant,
        deviation: Deviation = NO_DEVIATION,
        imu: "Imu | None" = None,
    ) -> "SimulatedBus":
        """Make the servos of a robot."""
        if not robot.is_mixed:
            line = simulated_line(robot, plant, deviation, imu)
            return cls(robot.model_copy(update={"ports": ()}), (line,))
        shared = SharedPlant(plant, motors_of(robot))
        clock = SimClock(plant.time_s)
        lines: list[SimLine | FeetechLine] = []
        for port in robot.ports:
            rows = [row for row, servo_id in enumerate(robot.servo_ids) if servo_id in port.ids]
            imu_on_port = imu if imu is not None and imu.config.id in port.ids else None
            line = simulated_line(
                robot, shared.share(rows), deviation, imu_on_port, rows=rows, clock=clock
            )
            line.label = f"{port.port} (simulated)"
            lines.append(line)
        # a servo of Protocol 2.0 may act within a slice: last, so that the body follows its stops
        LineGroup(sorted(lines, key=lambda line: isinstance(line, SimLine)))
        return cls(robot, tuple(lines))

    @property
    def clock(self) -> SimClock:
        """Clock of all lines."""
        return self.lines[0].clock

    @property
    def busy_s(self) -> float:
        """Time for which bytes have occupied the wire; of several lines, the busiest."""
        return max(line.busy_s for line in self.lines)

    def bus(self) -> ChainBus:
        """Bus of a chain on these lines."""
        ids: Sequence[Sequence[int]] = [port.ids for port in self.robot.ports]
        if not ids:
            return servo_bus(self.lines[0], self.robot.models_by_id)
        return SegmentedBus(
            [
                (servo_bus(line, self.robot.models_on(on_it)), on_it)
                for line, on_it in zip(self.lines, ids, strict=True)
            ]
        )

    def settle(self) -> None:
        """Advance servos and body to the clock's time."""
        for line in self.lines:
            line.settle()

    def hold_position(self) -> None:
        """Set every goal to the present position after the body was moved."""
        for line in self.lines:
            line.firmware.hold_position()

    def cut_power(self) -> None:
        """Switch the supply of all servos off."""
        for line in self.lines:
            line.firmware.cut_power(np.arange(len(line.ids())))

    def energy(self) -> MotorEnergy:
        """Energy that the motors have consumed, and their work."""
        return motor_energy(self.lines)


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
        deviation = Deviation.of_run(run, robot)
    simulated_body = _SimulatedBody(run, robot, world, ground, deviation)
    body = simulated_body.plant
    joint_rad = deviation.shaft_rad(initial_pose.joint_rad)
    body.reset(run.start_m, initial_pose.heading_rad, joint_rad)
    servos = SimulatedBus.of(robot, body, deviation, simulated_body.imu())
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
        simulated_body.twin,
        lay_down,
        servos.cut_power,
    )


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
            deviation.robot(robot),
            deviation.world(world),
            ground,
            run.physics_step_s,
            is_placed=False,
        )
        self.imu = partial(plant.plant_imu, robot, self.plant, robot.servo.baud, run.seed)
        """Makes the robot's IMU from the motion of the body; None without an IMU."""
        self.twin = partial(twin.PlantTwin, robot, world, ground)
        """Makes a second body."""


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
    (simulated_ids,) = (set(segment.ids) for segment in robot.ports if segment.port == SIMULATED)
    rows = [row for row, servo_id in enumerate(robot.servo_ids) if servo_id in simulated_ids]
    deviation = Deviation.of_run(run, robot)
    simulated_body = _SimulatedBody(run, robot, world, ground, deviation)
    plant = simulated_body.plant
    plant.reset(run.start_m, initial_pose.heading_rad, initial_pose.joint_rad)
    motors = motors_of(robot)
    body = SplitPlant(plant, motors, [j for j in range(robot.joint_count) if j not in rows])
    clock = RealTimeClock()
    imu = simulated_body.imu()
    line = simulated_line(
        robot,
        body,
        replace(deviation, slip_rad=None),
        imu if imu is not None and imu.config.id in simulated_ids else None,
        rows=rows,
        clock=clock,
    )
    bus = bus_on_ports(robot, clock, line)
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
        port_map_text((segment.port, segment.ids) for segment in robot.ports),
        chain,
        clock,
        plant.head_pose,
        lambda: plant.qpos,
        lambda: float("nan"),
    )
