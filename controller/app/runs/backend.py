"""What answers on the bus: simulated servos in the same process, or metal on a serial port.

Everything above the byte port is the same object for both.
"""

from collections.abc import Callable
from dataclasses import dataclass

from snakewalk.config.arrays import Floats
from snakewalk.config.extras import require_extra
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.app.shadow.deviation import NO_DEVIATION, Deviation
from snakewalk.controller.runlog.record import InitialPose, MotorEnergy
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.clock import Clock
from snakewalk.drivers.port.network_port import open_port
from snakewalk.drivers.types import BodyPose


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
    """What the motors have taken in and done so far."""


def simulated(
    run: RunConfig,
    robot: RobotConfig,
    world: WorldConfig,
    ground: HeightField | None,
    initial_pose: InitialPose,
    deviation: Deviation = NO_DEVIATION,
) -> Backend:
    """Servos on a simulated line that turn a MuJoCo body with its head at the start.

    Args:
        run: start and physics step.
        robot: the body and its servos.
        world: friction and ground.
        ground: the world's height field, where it has one.
        initial_pose: heading of the head link, and joint angles to begin with, as servos say them.
        deviation: in what the simulated robot and its ground differ from ``robot`` and ``world``.

    """
    require_extra("simulated runs need", "mujoco")
    from snakewalk.sim.line.sim_line import SimLine  # noqa: PLC0415
    from snakewalk.sim.physics.plant import MujocoPlant, plant_imu  # noqa: PLC0415
    from snakewalk.sim.servo.bank import ServoBank  # noqa: PLC0415
    from snakewalk.sim.servo.protection import SupplyAndAmbient  # noqa: PLC0415

    plant = MujocoPlant(deviation.robot(robot), deviation.world(world), ground, run.physics_step_s)
    joint_rad = deviation.shaft_rad(initial_pose.joint_rad)
    plant.reset(run.start_m, initial_pose.heading_rad, joint_rad)
    servo = robot.servo
    line = SimLine(
        ServoBank(robot.servo_ids, robot.servo_models, servo.baud),
        plant,
        baud=servo.baud,
        mounting=deviation.mounting(robot),
        supply_and_ambient=SupplyAndAmbient(supply_v=servo.supply_v),
        imu=plant_imu(robot, plant, servo.baud, run.seed),
    )
    chain = ServoChain(
        DynamixelBus(line, robot.models_by_id),
        robot,
        watchdog_s=run.safety.watchdog_s,
        rate_hz=run.cycle_hz,
    )
    drive = line.firmware.drive
    if deviation.torque is not None:
        drive.torque_constant_n_m_a[:] *= deviation.torque
    return Backend(
        "sim",
        chain,
        line.clock,
        plant.head_pose,
        lambda: plant.qpos,
        lambda: line.busy_s,
        lambda: MotorEnergy(float(drive.drawn_j.sum()), float(drive.work_j.sum())),
    )


def metal(run: RunConfig, robot: RobotConfig, port: str) -> Backend:
    """Real servos on ``port``, a device or a URL; nothing measures the pose.

    Raises:
        PortError: the port is not there, is taken, or may not be opened.

    """
    serial = open_port(port, robot.servo.baud)
    chain = ServoChain(
        DynamixelBus(serial, robot.models_by_id, latency_s=serial.latency_s),
        robot,
        watchdog_s=run.safety.watchdog_s,
        rate_hz=run.cycle_hz,
    )
    return Backend(port, chain, serial.clock, None, None, lambda: float("nan"))
