"""Present values: registers that show shafts, trajectories, motion and time."""

import math

import numpy as np

from snakewalk.config.arrays import Bools, Floats, Indices
from snakewalk.drivers.protocol.registers import (
    CURRENT_MODE,
    PWM_MODE,
    VELOCITY_MODE,
)
from snakewalk.sim.plant import Plant, ServoDrive
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.control_loops import ControlLoops
from snakewalk.sim.servo.motor import MotorColumns
from snakewalk.sim.servo.motor_output import MotorOutput
from snakewalk.sim.servo.protection import Protection
from snakewalk.sim.servo.servo_loops import write_motion

IN_POSITION_TICKS = 20
FOLLOWING_TICKS = 100
"""Deviations behind the flags of Moving Status(123), "predefined" in the e-manual: ours."""
IN_POSITION = 0x01
PROFILE_ONGOING = 0x02
FOLLOWING_ERROR = 0x08


class PresentValues:
    """The present values of all servos of a bank.

    A ``frame`` (2, S) is the sign of each shaft, and its ticks when straight.
    """

    def __init__(
        self,
        bank: ServoBank,
        plant: Plant,
        drive: ServoDrive,
        motor: MotorColumns,
        motor_output: MotorOutput,
        control_loops: ControlLoops,
        protection: Protection,
    ) -> None:
        self._start_s = np.full(len(bank), plant.time_s)
        self._bank = bank
        self._plant = plant
        self._drive = drive
        self._motor_output = motor_output
        self._control_loops = control_loops
        self._protection = protection
        # Without a sensor the load is "inferred from the internal output", in tenths of a percent
        first = "Present Current" if "Present Current" in bank else "Present Load"  # one place
        names = (first, "Present Velocity", "Present Position")
        self._addresses = np.array([bank.register(name).address for name in names])
        self._measured = measured = bank.measures_current
        self._stall_a, self._any_load = motor.stall_current_a, not bool(np.all(measured))
        ampere = np.where(measured, motor.current_unit_a, motor.stall_current_a / 1e3)
        self._current_units = np.stack([ampere, np.where(measured, math.inf, 1e3)])
        self._scales = scales = bank.scales
        self._units = np.stack([scales.rad_s_per_velocity, scales.positions_per_rad])
        self.motion_at = _span(bank, "Realtime Tick", "Position Trajectory")
        """Addresses of the registers that show time and shafts."""
        self.supply_at = _span(bank, "Present Input Voltage", "Present Temperature")
        """Addresses of voltage and temperature."""

    def restart_clock(self, rows: Indices, time_s: float) -> None:
        """Realtime Tick(120) of these servos counts from 0 again."""
        self._start_s[rows] = time_s

    def motion(self, frame: Floats) -> None:
        """Present Current (else Load), Velocity and Position(126, 128, 132)."""
        plant = self._plant
        current_a = self._motor_output.current_a()
        if self._any_load:  # current of full output at stall, in the unit of such a row
            output_a = self._motor_output.pwm(plant.velocity_rad_s) * self._stall_a
            current_a = np.where(self._measured, current_a, output_a)
        write_motion(
            self._bank.table,
            self._addresses,
            current_a,
            plant.velocity_rad_s,
            plant.position_rad,
            frame,
            self._current_units,
            self._units,
        )

    def path(self, frame: Floats, time_s: float) -> None:
        """Update output, trajectories, motion flags and clock (120 to 143) at ``time_s``."""
        bank, control_loops, (sign, zero) = self._bank, self._control_loops, frame
        path = control_loops.trajectory
        output = self._motor_output.pwm(self._plant.velocity_rad_s) * sign
        bank["Present PWM"][:] = np.rint(output * self._scales.full_pwm)
        bank["Realtime Tick"][:] = ((time_s - self._start_s) * 1e3).astype(np.int64) % 32_768
        goal = bank["Goal Position"].astype(float)
        present = bank["Present Position"]
        places = path.position * sign * self._scales.positions_per_rad + zero
        shown = np.where(control_loops.position, places, goal)
        bank["Position Trajectory"][:] = np.rint(shown)
        run = control_loops.position | control_loops.velocity
        bank["Velocity Trajectory"][:] = np.rint(
            np.where(run, path.velocity * sign / self._scales.rad_s_per_velocity, 0.0)
        )
        ongoing = control_loops.position & path.ongoing
        bank["Moving"][:] = self.turning() | ongoing
        mode = bank["Operating Mode"]
        placed = (mode != CURRENT_MODE) & (mode != VELOCITY_MODE) & (mode != PWM_MODE)
        status = IN_POSITION * (np.abs(goal - present) <= IN_POSITION_TICKS)
        status |= FOLLOWING_ERROR * (np.abs(shown - present) > FOLLOWING_TICKS)
        status = np.where(placed, status, 0) | PROFILE_ONGOING * ongoing
        bank["Moving Status"][:] = status | np.where(control_loops.position, path.kind, 0)

    def turning(self) -> Bools:
        """(S,) faster than Moving Threshold(24)."""
        threshold = self._bank["Moving Threshold"] * self._scales.rad_s_per_velocity
        return np.abs(self._plant.velocity_rad_s) > threshold

    def supply(self) -> None:
        """Present Input Voltage and Temperature(144, 146)."""
        bank = self._bank
        volts = self._protection.supply_v(self._plant.velocity_rad_s)
        bank["Present Input Voltage"][:] = np.rint(volts * 10.0)
        celsius = np.rint(self._protection.temperature_c)
        bank["Present Temperature"][:] = np.minimum(np.maximum(celsius, 0.0), 255.0)


def _span(bank: ServoBank, first: str, last: str) -> range:
    """Addresses from one register to the end of another."""
    end = bank.register(last)
    return range(bank.register(first).address, end.address + end.size)
