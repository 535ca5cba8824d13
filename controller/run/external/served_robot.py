"""A simulated robot on its ground, served like a real one, with a tracker and its truth."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.ground import build_ground
from snakewalk.config.pose import PoseConfig, TrackerConfig
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.kinematics.links import body_in_world, mean_heading_rad
from snakewalk.controller.pose.tracked_body import TrackedBody
from snakewalk.controller.pose.tracker import Sent, SimulatedTracker
from snakewalk.controller.run.deviation import NO_DEVIATION, Deviation
from snakewalk.controller.run.prepared_run import PreparedRun
from snakewalk.controller.runlog.record import MotorEnergy
from snakewalk.controller.runlog.truth import TruthLog
from snakewalk.sim.feetech.line import FeetechLine
from snakewalk.sim.feetech.servos import FeetechServos
from snakewalk.sim.line.clock import SimClock
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.plant import Mounting, Plant
from snakewalk.sim.serve.bench_line import feetech_line
from snakewalk.sim.serve.watched_plant import WatchedPlant
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.motor import motors_of
from snakewalk.sim.servo.protection import SupplyAndAmbient

if TYPE_CHECKING:
    from snakewalk.sim.imu import Imu
    from snakewalk.sim.physics.plant import MujocoPlant


@dataclass(frozen=True, slots=True)
class Place:
    """Initial place and shape of a served robot."""

    start_m: tuple[float, float] = (0.0, 0.0)
    """Centre of the head link."""
    heading_rad: float = 0.0
    """Mean heading of the body."""
    joint_rad: tuple[float, ...] | None = None
    """Angles of the servos; None: straight. A straight round body rolls down a slope."""


@dataclass(frozen=True, slots=True)
class Serving:
    """How a robot is served."""

    tracker: TrackerConfig = TrackerConfig()  # noqa: RUF009  frozen
    deviation: Deviation = NO_DEVIATION
    goal_delay_s: float = 0.0
    seed: int = 0
    physics_step_s: float | None = None
    baud: int | None = None
    """Baud rate of the port; None: that of the robot."""


def place_of(prepared: PreparedRun) -> Place:
    """Return the place and first shape of a run."""
    joint_rad = tuple(float(angle) for angle in prepared.initial_pose().joint_rad)
    return Place(prepared.run.start_m, prepared.start_heading_rad, joint_rad)


def physics_modules() -> tuple[Any, Any]:
    """Return the modules of the MuJoCo body and of the second body.

    Raises:
        InputError: MuJoCo is not installed.

    """
    require_extra("simulated servos need", "mujoco")
    from snakewalk.sim.physics import plant, twin  # noqa: PLC0415  an extra

    return plant, twin


def simulated_views() -> Any:
    """Return the module whose cameras follow a simulated body.

    Raises:
        InputError: MuJoCo is not installed.

    """
    require_extra("a simulated camera needs", "mujoco")
    from snakewalk.sim.rendering import chase_view  # noqa: PLC0415  an extra

    return chase_view


def simulated_line(
    robot: RobotConfig,
    plant: Plant,
    deviation: Deviation = NO_DEVIATION,
    imu: "Imu | None" = None,
    baud: int | None = None,
    *,
    rows: Sequence[int] | None = None,
    clock: SimClock | None = None,
) -> SimLine | FeetechLine:
    """Return servos of a robot on the shafts of a body, behind a simulated line.

    Args:
        robot: its file.
        plant: the body; it has the shafts of ``rows``.
        deviation: differences of the simulated servos from the file.
        imu: on the line.
        baud: None: the robot's.
        rows: joints whose servos are on the line; None: all, with the robot's cables.
        clock: shared with other lines; None: a clock of its own.

    Raises:
        InputError: the servos are of different series.

    """
    rate = baud or robot.servo.baud
    joints = range(robot.joint_count) if rows is None else rows
    if rows is None and robot.is_mixed:
        raise InputError(
            f"robot {robot.name}: its ports have servos of different series, and one simulated "
            "line has one series; serve the servos of each port alone: snakewalk bus serve --servos"
        )
    ids = [robot.servo_ids[row] for row in joints]
    indices = np.array(joints, np.intp)
    records = [robot.servo_records[row] for row in joints]
    motors = motors_of(robot)
    mounting = deviation.mounting(robot)
    mounting = Mounting(mounting.sign[indices], mounting.zero_rad[indices])
    on_it = [motors[row] for row in joints]
    line: SimLine | FeetechLine
    if records[0].is_feetech:
        volts = robot.servo.supply_v
        servos = FeetechServos(ids, plant, records[0], volts, mounting, on_it)
        line = feetech_line(servos, rate, clock)
    else:
        around = SupplyAndAmbient.of(robot) if rows is None else None
        line = SimLine(
            ServoBank(ids, records, rate),
            plant,
            clock,
            mounting=mounting,
            motors=on_it,
            supply_and_ambient=around or SupplyAndAmbient(supply_v=robot.servo.supply_v),
            imu=imu,
        )
    if deviation.torque is not None:
        line.firmware.drive.torque_constant_n_m_a[:] *= deviation.torque[indices]
    return line


def motor_energy(lines: Sequence[SimLine | FeetechLine]) -> MotorEnergy:
    """Return the energy that the motors on lines have consumed, and their work."""
    drives = [line.firmware.drive for line in lines]
    return MotorEnergy(
        sum(float(drive.drawn_j.sum()) for drive in drives),
        sum(float(drive.work_j.sum()) for drive in drives),
    )


class ServedRobot:
    """A simulated robot on its ground; as a context manager it closes the truth."""

    def __init__(
        self,
        robot: RobotConfig,
        world: WorldConfig,
        place: Place,
        serving: Serving,
        truth: Path | None = None,
    ) -> None:
        physics, _ = physics_modules()
        deviation = serving.deviation
        self._robot = robot
        self._deviation = deviation
        ground = build_ground(world)
        self.body: MujocoPlant = physics.MujocoPlant(
            deviation.robot(robot),
            deviation.world(world),
            ground,
            serving.physics_step_s,
            is_placed=False,
        )
        straight = (0.0,) * robot.joint_count
        servo_rad = np.array(straight if place.joint_rad is None else place.joint_rad)
        shaft_rad = deviation.shaft_rad(servo_rad)
        heading_rad = place.heading_rad - mean_heading_rad(robot, shaft_rad)
        self.body.reset(place.start_m, heading_rad, shaft_rad)
        tracked = TrackedBody(robot, robot.pose or PoseConfig())
        self.tracker = SimulatedTracker(serving.tracker, tracked, serving.seed)
        """Tracker that measures the body and encodes its poses as datagrams."""
        plant = WatchedPlant(
            self.body, 1.0 / serving.tracker.rate_hz, self._measure, serving.goal_delay_s
        )
        imu = partial(physics.plant_imu, robot, self.body, serving.baud or robot.servo.baud)
        self.line = simulated_line(robot, plant, deviation, imu(serving.seed), serving.baud)
        """Byte port of the simulated servos."""
        self._truth = None
        if truth is not None:
            self._truth = TruthLog(truth, _header(robot, world, place, serving))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: Any) -> None:
        if self._truth is not None:
            self._truth.__exit__(*raised)

    def due(self, now_s: float) -> Sequence[Sent]:
        """Return the datagrams of the tracker that are to arrive by now."""
        self.line.settle()
        return self.tracker.due(now_s)

    def _measure(self) -> None:
        head = self.body.head_pose()
        shaft_rad: Floats = np.array(self.body.position_rad)
        sequence, sent_s = self.tracker.measure(head, shaft_rad)
        if self._truth is not None:
            centre_m = body_in_world(self._robot, head, shaft_rad).centre_m
            self._truth.add(
                sequence,
                head.time_s,
                sent_s,
                head.head_in_world_m,
                head.rotation,
                centre_m,
                motor_energy([self.line]),
            )


def _header(
    robot: RobotConfig, world: WorldConfig, place: Place, serving: Serving
) -> dict[str, object]:
    deviation = serving.deviation
    return {
        "robot": robot.name,
        "world": world.name,
        "start_m": list(place.start_m),
        "heading_rad": place.heading_rad,
        "joint_rad": _list_of_values(
            None if place.joint_rad is None else np.array(place.joint_rad)
        ),
        "tracker": serving.tracker.model_dump(),
        "seed": serving.seed,
        "goal_delay_s": serving.goal_delay_s,
        "friction_along": deviation.along,
        "friction_across": deviation.across,
        "friction_law": deviation.law or world.friction.law_name,
        "load_kg": _list_of_values(deviation.load_kg),
        "torque": _list_of_values(deviation.torque),
        "slip_rad": _list_of_values(deviation.slip_rad),
    }


def _list_of_values(values: Floats | None) -> list[float] | None:
    return None if values is None else [float(value) for value in values]
