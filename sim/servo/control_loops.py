"""The servos' own control loops where they are more than the bridge's plain proportional law.

Position PID with feed-forward along a profile, and the velocity loop, run every ``CONTROL_S``; they
reach the motors through the same drive: a proportional gain, and a goal shifted by what the other
terms add. Gains are the e-manual's: K_P = register / 128 PWM units a tick, K_D / 16, K_I / 65536,
feed-forward / 4; velocity K_P / 128 a unit of 0.229 rev/min, K_I / 65536. It gives no unit of time
for the other terms: they are taken a control period, one millisecond (ours).
"""

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.drivers.protocol.registers import (
    ACCELERATION_UNIT_RAD_S2,
    CURRENT_POSITION_MODE,
    EXTENDED_MODE,
    POSITION_MODE,
    PWM_FULL,
    VELOCITY_MODE,
    VELOCITY_UNIT_RAD_S,
)
from snakewalk.sim.plant import Plant, ServoDrive
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.motor import TICKS_PER_RAD, MotorColumns, p_gain_per_rad
from snakewalk.sim.servo.profile import Trajectory

CONTROL_S = 1e-3
TIME_BASED = 0x04
"""Drive Mode(10), bit 2."""
TINY_GAIN = 1e-9
"""A proportional gain too small to add anything: with it a far goal is a constant output."""
_FORWARD = ("Feedforward 1st Gain", "Feedforward 2nd Gain")


class ControlLoops:
    """Control loops of all servos of a bank; idle, and free of cost, in the plain case."""

    def __init__(self, bank: ServoBank, drive: ServoDrive, motor: MotorColumns) -> None:
        self._bank, self._drive, self._motor = bank, drive, motor
        servos = len(bank)
        self.trajectory = Trajectory(servos)
        self.active = False
        """Whether any servo needs ``tick``."""
        self.position = np.zeros(servos, bool)
        """(S,) position control with a profile or more gains than P."""
        self.velocity = np.zeros(servos, bool)
        """(S,) velocity control."""
        self._sum = np.zeros(servos)
        self._last_error = np.zeros(servos)

    def apply_registers(self, on: Bools, shaft_rad: Floats) -> None:
        """Apply modes, gains and profiles after a write; servos that join start where they are."""
        bank = self._bank
        mode = bank["Operating Mode"]
        placed = np.isin(mode, (POSITION_MODE, EXTENDED_MODE, CURRENT_POSITION_MODE))
        beyond_p = (bank["Position D Gain"] != 0) | (bank["Position I Gain"] != 0)
        beyond_p |= bank["Profile Velocity"] != 0
        for name in _FORWARD:
            beyond_p |= bank[name] != 0
        position, velocity = on & placed & beyond_p, on & (mode == VELOCITY_MODE)
        joined = (position & ~self.position) | (velocity & ~self.velocity)
        if joined.any():
            self.trajectory.restart(joined, shaft_rad)
            self._sum[joined] = self._last_error[joined] = 0.0
        self.position, self.velocity = position, velocity
        self.active = bool(position.any() or velocity.any())
        self._kp = p_gain_per_rad(bank["Position P Gain"], self._motor)
        self._drive.p_gain_per_rad[:] = np.where(velocity, TINY_GAIN, self._kp)

    def set_goals(self, goal_rad: Floats) -> None:
        """Pass on position goals, in the shafts' frame."""
        if not self.active:
            return
        bank = self._bank
        timed = (bank["Drive Mode"] & TIME_BASED) != 0
        velocity = bank["Profile Velocity"].astype(float)
        ramp = bank["Profile Acceleration"].astype(float)
        goal = np.where(self.position, goal_rad, self.trajectory.goal)
        self.trajectory.set_goals(goal, velocity, ramp, timed)

    def tick(self, plant: Plant, goal_rad: Floats, sign: Floats, held: Bools) -> None:
        """Run one control period: set the drive of the servos that need these loops.

        ``goal_rad`` is the place of held servos; ``sign`` turns registers into the shafts' frame.
        """
        if self.velocity.any():
            self._tick_velocity(plant, sign, held)
        if self.position.any():
            self._tick_position(plant, goal_rad, held)

    def _tick_position(self, plant: Plant, goal_rad: Floats, held: Bools) -> None:
        bank, drive, path, run = self._bank, self._drive, self.trajectory, self.position
        path.advance(CONTROL_S)
        target = np.where(held, goal_rad, path.position)
        error = (target - plant.position_rad) * TICKS_PER_RAD
        full = drive.pwm_limit * PWM_FULL
        integral = bank["Position I Gain"] / 65_536.0
        limit = np.where(integral > 0.0, full / np.maximum(integral, 1e-12), 0.0)
        self._sum[run] = np.clip(self._sum + error, -limit, limit)[run]
        pwm = integral * self._sum
        pwm += bank["Position D Gain"] / 16.0 * (error - self._last_error)
        self._last_error[run] = error[run]
        ticks = TICKS_PER_RAD * CONTROL_S
        moving = np.where(held, 0.0, 1.0)
        pwm += bank["Feedforward 1st Gain"] / 4.0 * path.velocity * ticks * moving
        pwm += bank["Feedforward 2nd Gain"] / 4.0 * path.acceleration * (ticks * CONTROL_S) * moving
        gain = np.maximum(self._kp, TINY_GAIN)
        drive.p_gain_per_rad[run] = gain[run]
        drive.goal_rad[run] = (target + pwm / PWM_FULL / gain)[run]

    def _tick_velocity(self, plant: Plant, sign: Floats, held: Bools) -> None:
        bank, drive, path, run = self._bank, self._drive, self.trajectory, self.velocity
        goal = np.where(held, 0.0, bank["Goal Velocity"] * sign * VELOCITY_UNIT_RAD_S)
        ramp = bank["Profile Acceleration"].astype(float)
        timed = (bank["Drive Mode"] & TIME_BASED) != 0
        with np.errstate(divide="ignore"):
            per_tick = np.where(
                timed,
                np.abs(goal) / np.maximum(ramp, 1e-12) * (CONTROL_S * 1e3),
                ramp * (ACCELERATION_UNIT_RAD_S2 * CONTROL_S),
            )
        step = np.where((ramp > 0.0) & ~held, per_tick, np.inf)  # a watchdog's stop has no profile
        path.velocity[run] += np.clip(goal - path.velocity, -step, step)[run]
        error = (path.velocity - plant.velocity_rad_s) / VELOCITY_UNIT_RAD_S
        integral = bank["Velocity I Gain"] / 65_536.0
        full = drive.pwm_limit * PWM_FULL
        limit = np.where(integral > 0.0, full / np.maximum(integral, 1e-12), 0.0)
        self._sum[run] = np.clip(self._sum + error, -limit, limit)[run]
        pwm = (bank["Velocity P Gain"] / 128.0 * error + integral * self._sum) / PWM_FULL
        drive.goal_rad[run] = (plant.position_rad + pwm / TINY_GAIN)[run]
