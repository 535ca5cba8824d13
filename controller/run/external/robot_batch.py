"""Robots whose bodies advance together; safety and motion act on each one.

A robot of a batch has the simulated servos of a run (registers, protections, supply), but no bus:
reads and writes need no time and lose nothing.
"""

import math

import numpy as np

from snakewalk.config.arrays import Bytes, Floats
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import DeviationConfig, RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.pose.sample import rotation_of
from snakewalk.controller.run.external.served_robot import simulated_line
from snakewalk.controller.runlog.record import InitialPose, MotorEnergy
from snakewalk.drivers.bus.feetech_bus import servo_bus
from snakewalk.drivers.chain.joint_codec import GoalEncoder, JointUnits
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.protocol.registers import ServoUnits
from snakewalk.drivers.types import BodyPose, JointCommand, JointState
from snakewalk.sim.batch.bodies import BatchBodies, unsupported
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.plant import ServoDrive
from snakewalk.sim.servo.protection import SLICE_S

_INPUTS = ("torque_on", "goal_rad", "p_gain_per_rad", "pwm_limit", "supply_v", "current_limit_a")
_ENERGIES = ("drawn_j", "returned_j", "heat_j", "work_j")


def batch_fault(run: RunConfig, robot: RobotConfig, world: WorldConfig) -> str | None:
    """Return why a run cannot be one of a batch; None if it can."""
    if robot.is_feetech or robot.is_mixed:
        return f"robot {robot.name}: has servos of Feetech"
    if robot.imu is not None:
        return f"robot {robot.name}: has an IMU"
    if run.compliance is not None or run.deviation != DeviationConfig():
        return f"run {run.name}: has compliance or a deviation of the simulated robot"
    return unsupported(robot, world)


class RobotBatch:
    """W robots of one body on a level floor, with W ``bodies`` of their own.

    ``run`` has cycle and limits. Gains of robots and frictions of worlds may differ.
    """

    def __init__(self, run: RunConfig, bodies: BatchBodies) -> None:
        self.bodies = bodies
        self.rows: dict[int, BatchRow] = {}
        """Robots that were started, by row."""
        self._run = run
        self._tables: list[tuple[RobotConfig, Bytes]] = []
        self._steps = 0
        self._slice = max(1, round(SLICE_S / bodies.step_s))

    @property
    def time_s(self) -> float:
        """Time that the bodies have been advanced."""
        return self._steps * self.bodies.step_s

    def start(
        self, row: int, robot: RobotConfig, world: WorldConfig, pose: InitialPose
    ) -> "BatchRow":
        """Put another robot into a row, at rest, with servos as at the start of a run.

        Raises:
            InputError: a batch does not simulate its servos.

        """
        fault = batch_fault(self._run, robot, world)
        if fault is not None:
            raise InputError(f"{fault}; use the backend processes")
        table = self._table(robot, pose)
        self.bodies.friction[row] = world.friction.grip
        self.bodies.place(row, self._run.start_m, pose.heading_rad, pose.joint_rad)
        self.rows[row] = started = BatchRow(self, row, robot)
        started.set_up(table)
        return started

    def advance(self, until_s: float) -> None:
        """Advance all robots to the last whole step at or before ``until_s``.

        Raises:
            PhysicsError: the state of a body has diverged.

        """
        target = math.floor(until_s / self.bodies.step_s + 1e-6)
        while self._steps < target:
            stop = min(target, (self._steps // self._slice + 1) * self._slice)
            for row in self.rows.values():
                row.give_drive()
            self.bodies.run(stop - self._steps)
            self._steps = stop
            for row in self.rows.values():
                row.take_output(is_slice=stop % self._slice == 0)

    def _table(self, robot: RobotConfig, pose: InitialPose) -> Bytes:
        for table_robot, table in self._tables:
            if table_robot == robot:
                return table
        body = self.bodies.template
        body.reset(self._run.start_m, pose.heading_rad, pose.joint_rad)
        line = simulated_line(robot, body)
        run = self._run
        chain = ServoChain(
            servo_bus(line, robot.models_by_id),
            robot,
            watchdog_s=run.safety.watchdog_s,
            rate_hz=run.cycle_hz,
        )
        chain.enable()
        assert isinstance(line, SimLine)
        if line.firmware.control_loops.active:
            raise InputError(
                f"robot {robot.name}: its servos use a profile or gains besides P; "
                "use the backend processes"
            )
        table = line.firmware.bank.table.copy()
        self._tables.append((robot, table))
        return table


class BatchRow:
    """One robot of a batch: a ``JointLink``, its clock, and its shafts for the servos."""

    def __init__(self, batch: RobotBatch, row: int, robot: RobotConfig) -> None:
        self.robot = robot
        self._batch = batch
        self._row = row
        self._zero_s = batch.time_s
        line = simulated_line(robot, self)
        assert isinstance(line, SimLine)
        self._firmware = line.firmware
        bank = self._firmware.bank
        self._units = JointUnits.of(robot, [ServoUnits.of(facts) for facts in bank.facts])
        self._encoder = GoalEncoder(self._units)
        self._entries = np.zeros((robot.joint_count, 5), np.uint8)
        self._servos = np.arange(robot.joint_count)
        zeros = np.zeros(robot.joint_count)
        self._age_s, self._valid = zeros, np.ones(robot.joint_count, bool)
        self._error = np.zeros(robot.joint_count, np.uint8)

    @property
    def drive(self) -> ServoDrive:
        """Output of the servos for the motors."""
        return self._firmware.drive

    # the shafts, as the servos see them

    @property
    def time_s(self) -> float:
        """Time since the robot was put into its row."""
        return self._batch.time_s - self._zero_s

    @property
    def position_rad(self) -> Floats:
        """(J,) live view of the shaft angles."""
        return self._batch.bodies.qpos[self._row, 7:]

    @property
    def velocity_rad_s(self) -> Floats:
        """(J,) live view, rad/s."""
        return self._batch.bodies.qvel[self._row, 6:]

    def advance(self, until_s: float, drive: ServoDrive) -> None:
        """Do nothing, because the batch advances all shafts."""

    # the clock

    def now_s(self) -> float:
        """Time since the robot was put into its row."""
        return self.time_s

    def sleep_until_s(self, time_s: float) -> None:
        """Return at once: the batch advances the time."""

    # the joints

    @property
    def joint_count(self) -> int:
        """Number of joints J."""
        return self.robot.joint_count

    def set_up(self, table: Bytes) -> None:
        """Give the servos their registers (J, bytes) and their positions as goals."""
        self._firmware.bank.table[:] = table
        self._firmware.power_up(self._servos)
        self._firmware.bank.table[:] = table
        self._firmware.apply_registers()
        self._send(self.position_rad)

    def enable(self) -> JointState:
        """Torque is on; return the state."""
        return self.read()

    def disable(self) -> None:
        """Switch torque off."""
        self._firmware.bank["Torque Enable"][:] = 0
        self._firmware.apply_registers()

    def read(self) -> JointState:
        """Return the present state; angles are whole positions."""
        firmware = self._firmware
        drive = self.drive
        unit_rad = np.abs(self._units.rad_per_position)
        return JointState(
            self.time_s,
            np.rint(self.position_rad / unit_rad) * unit_rad,
            self.velocity_rad_s.copy(),
            drive.current_a.copy(),
            np.rint(firmware.protection.temperature_c),
            firmware.protection.supply_v(self.velocity_rad_s),
            firmware.bank["Hardware Error Status"].astype(np.uint8),
            self._error,
            self._age_s,
            self._valid,
            self._age_s,
        )

    def write(self, command: JointCommand) -> None:
        """Give the servos goals."""
        self._send(command.goal_rad)

    def _send(self, goal_rad: Floats) -> None:
        raw = self._encoder.encode(np.ascontiguousarray(goal_rad))
        self._entries[:, 1:] = raw[:, None].view(np.uint8)
        self._firmware.write_goals(self._servos, self._entries.ravel(), 0)

    # the body

    def head_pose(self) -> BodyPose:
        """Return the true pose of the head link."""
        qpos = self._batch.bodies.qpos[self._row]
        rotation = rotation_of(qpos[3:7].tolist())
        return BodyPose(self.time_s, qpos[:3].copy(), rotation)

    def energy(self) -> MotorEnergy:
        """Return energy drawn and work done by all motors since the start."""
        return MotorEnergy(float(self.drive.drawn_j.sum()), float(self.drive.work_j.sum()))

    # the batch

    def give_drive(self) -> None:
        """Copy the drive of the motors to the batch."""
        for name in _INPUTS:
            getattr(self._batch.bodies, name)[self._row] = getattr(self.drive, name)

    def take_output(self, *, is_slice: bool) -> None:
        """Copy the motors' output to the servos, which check themselves after a slice."""
        bodies = self._batch.bodies
        row = self._row
        drive = self.drive
        drive.current_a[:], drive.pwm[:] = bodies.current_a[row], bodies.pwm[row]
        for name, values in zip(_ENERGIES, bodies.energies_j[:, row], strict=True):
            getattr(drive, name)[:] = values
        if is_slice and self._firmware.protection.check(self):
            self._firmware.apply_registers()
