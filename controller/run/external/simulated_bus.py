"""Simulated bus of a robot: one line, or one per port for ports of different series."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from snakewalk.config.robot import RobotConfig
from snakewalk.controller.run.deviation import NO_DEVIATION, Deviation
from snakewalk.controller.run.external.served_robot import simulated_line
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
        drives = [line.firmware.drive for line in self.lines]
        return MotorEnergy(
            sum(float(drive.drawn_j.sum()) for drive in drives),
            sum(float(drive.work_j.sum()) for drive in drives),
        )
