"""The servos' control loops beyond the plain proportional law.

Position PID with feed-forward along a profile, and the velocity loop, run every ``CONTROL_S``. They
reach the motors through the same drive: a proportional gain, and a goal shifted by the other terms.
Gains are the e-manual's: K_P = register / 128 PWM units per tick, K_D / 16, K_I / 65536,
feed-forward / 4; velocity K_P / 128 per unit of velocity, K_I / 65536. It gives no time unit for
the other terms; here it is a control period, one millisecond (ours).
"""

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.drivers.compiling import compiled, readonly_array
from snakewalk.drivers.protocol.registers import (
    CURRENT_POSITION_MODE,
    EXTENDED_MODE,
    POSITION_MODE,
    VELOCITY_MODE,
)
from snakewalk.sim.plant import Plant, ServoDrive
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.motor import MotorColumns, p_gain_per_rad
from snakewalk.sim.servo.profile import Trajectory

CONTROL_S = 1e-3
TIME_BASED = 0x04
"""Drive Mode(10), bit 2."""
TINY_GAIN = 1e-9
"""A proportional gain too small to add anything: with it a far goal is a constant output."""
_READ = readonly_array()
_BOOLS = readonly_array("boolean")
_GAINS = readonly_array(dimensions=2, layout="C")
_FEEDFORWARD_GAINS = ("Feedforward 1st Gain", "Feedforward 2nd Gain")


class ControlLoops:
    """Control loops of all servos of a bank; idle in the plain case."""

    def __init__(self, bank: ServoBank, drive: ServoDrive, motor: MotorColumns) -> None:
        self._bank = bank
        self._drive = drive
        self._motor = motor
        servos = len(bank)
        scales = bank.scales
        self._rad_s_per_velocity = scales.rad_s_per_velocity
        self._scales = np.stack(
            [
                scales.positions_per_rad,
                scales.full_pwm,
                scales.rad_s_per_velocity,
                scales.rad_s2_per_acceleration,
            ]
        )
        self.trajectory = Trajectory(
            servos, scales.rad_s_per_velocity, scales.rad_s2_per_acceleration
        )
        self.active = False
        """Whether any servo needs ``tick``."""
        self.position = np.zeros(servos, bool)
        """(S,) position control with a profile or more gains than P."""
        self.velocity = np.zeros(servos, bool)
        """(S,) velocity control."""
        self._sum = np.zeros(servos)
        self._last_error = np.zeros(servos)

    def apply_registers(self, on: Bools, shaft_rad: Floats) -> None:
        """Apply modes, gains and profiles after a write; joining servos start at their angle."""
        bank = self._bank
        mode = bank["Operating Mode"]
        placed = (mode == POSITION_MODE) | (mode == EXTENDED_MODE) | (mode == CURRENT_POSITION_MODE)
        beyond_p = (bank["Position D Gain"] != 0) | (bank["Position I Gain"] != 0)
        beyond_p |= bank["Profile Velocity"] != 0
        for name in _FEEDFORWARD_GAINS:
            beyond_p |= bank[name] != 0
        position = on & placed & beyond_p
        velocity = on & (mode == VELOCITY_MODE)
        joined = (position & ~self.position) | (velocity & ~self.velocity)
        if joined.any():
            self.trajectory.restart(joined, shaft_rad)
            self._sum[joined] = self._last_error[joined] = 0.0
        self.position = position
        self.velocity = velocity
        self._any_position, self._any_velocity = bool(position.any()), bool(velocity.any())
        self.active = self._any_position or self._any_velocity
        kp = p_gain_per_rad(bank["Position P Gain"], self._motor)
        self._drive.p_gain_per_rad[:] = np.where(velocity, TINY_GAIN, kp)
        if not self.active:
            return
        self._timed = (bank["Drive Mode"] & TIME_BASED) != 0
        integral = bank["Position I Gain"] / 65_536.0
        differential = bank["Position D Gain"] / 16.0
        forward = [bank[name] / 4.0 for name in _FEEDFORWARD_GAINS]
        self._gains = np.stack([kp, integral, differential, *forward])
        if self._any_velocity:
            goal_rad_s = bank["Goal Velocity"] * self._rad_s_per_velocity
            gains = (bank["Velocity P Gain"] / 128.0, bank["Velocity I Gain"] / 65_536.0)
            self._settings = np.stack([goal_rad_s, bank["Profile Acceleration"], *gains])

    def set_goals(self, goal_rad: Floats) -> None:
        """Set position goals, in the shafts' frame."""
        if not self.active:
            return
        bank = self._bank
        velocity = bank["Profile Velocity"].astype(float)
        ramp = bank["Profile Acceleration"].astype(float)
        goal = np.where(self.position, goal_rad, self.trajectory.goal)
        self.trajectory.set_goals(goal, velocity, ramp, self._timed)

    def tick(self, plant: Plant, goal_rad: Floats, sign: Floats, is_held: Bools) -> None:
        """Run one control period: set the drive of the servos with these loops.

        ``goal_rad`` is the angle of held servos; ``sign`` converts registers to the shafts' frame.
        """
        drive = self._drive
        path = self.trajectory
        if self._any_velocity:
            _run_velocity(
                self.velocity,
                is_held,
                sign,
                plant.position_rad,
                plant.velocity_rad_s,
                drive.pwm_limit,
                self._settings,
                self._scales,
                self._timed,
                path.velocity,
                self._sum,
                drive.goal_rad,
            )
        if self._any_position:
            path.advance(CONTROL_S, self.position)
            _run_position(
                self.position,
                is_held,
                goal_rad,
                plant.position_rad,
                drive.pwm_limit,
                self._gains,
                self._scales,
                path.position,
                path.velocity,
                path.acceleration,
                self._sum,
                self._last_error,
                drive.p_gain_per_rad,
                drive.goal_rad,
            )


@compiled("float64(float64, float64, float64, float64)")
def _limited_sum(errors: float, gain: float, pwm_limit: float, full_pwm: float) -> float:
    """Sum of errors limited to the bridge's output (anti-windup)."""
    limit = pwm_limit * full_pwm / max(gain, 1e-12) if gain > 0.0 else 0.0
    return min(max(errors, -limit), limit)


@compiled(
    f"void({_BOOLS}, {_BOOLS}, {_READ}, {_READ}, {_READ}, {_GAINS}, {_GAINS},"
    f" {_READ}, {_READ}, {_READ}, {', '.join(['float64[::1]'] * 4)})"
)
def _run_position(
    run: Bools,
    is_held: Bools,
    hold_rad: Floats,
    shaft_rad: Floats,
    pwm_limit: Floats,
    gains: Floats,
    scales: Floats,
    path_rad: Floats,
    path_rad_s: Floats,
    path_rad_s2: Floats,
    sums: Floats,
    last_error: Floats,
    p_gain_per_rad: Floats,
    goal_rad: Floats,
) -> None:
    """Position PID with feed-forward, for the servos in ``run``.

    ``gains`` (5, S): P in the drive's unit, I, D, feed-forward of speed and of acceleration.
    ``scales`` (4, S): positions per radian, PWM of full output, units of velocity, acceleration.
    """
    for k in range(len(run)):
        if not run[k]:
            continue
        per_rad = scales[0, k]
        full_pwm = scales[1, k]
        ticks = per_rad * CONTROL_S
        target = hold_rad[k] if is_held[k] else path_rad[k]
        error = (target - shaft_rad[k]) * per_rad
        sums[k] = _limited_sum(sums[k] + error, gains[1, k], pwm_limit[k], full_pwm)
        pwm = gains[1, k] * sums[k] + gains[2, k] * (error - last_error[k])
        last_error[k] = error
        if not is_held[k]:
            pwm += gains[3, k] * path_rad_s[k] * ticks
            pwm += gains[4, k] * path_rad_s2[k] * (ticks * CONTROL_S)
        gain = max(gains[0, k], TINY_GAIN)
        p_gain_per_rad[k] = gain
        goal_rad[k] = target + pwm / full_pwm / gain


@compiled(
    f"void({_BOOLS}, {_BOOLS}, {_READ}, {_READ}, {_READ}, {_READ}, {_GAINS}, {_GAINS}, {_BOOLS},"
    " float64[::1], float64[::1], float64[::1])"
)
def _run_velocity(
    run: Bools,
    is_held: Bools,
    sign: Floats,
    shaft_rad: Floats,
    shaft_rad_s: Floats,
    pwm_limit: Floats,
    settings: Floats,
    scales: Floats,
    timed: Bools,
    path_rad_s: Floats,
    sums: Floats,
    goal_rad: Floats,
) -> None:
    """Velocity PI along a ramp, for the servos in ``run``.

    ``settings`` (4, S): goal in rad/s of the servo, Profile Acceleration, P and I. ``scales`` as in
    ``_run_position``.
    """
    for k in range(len(run)):
        if not run[k]:
            continue
        full_pwm = scales[1, k]
        rad_s = scales[2, k]
        rad_s2 = scales[3, k]
        goal = 0.0 if is_held[k] else settings[0, k] * sign[k]
        ramp = settings[1, k]
        step = np.inf
        if ramp > 0.0 and not is_held[k]:  # a watchdog's stop has no profile
            if timed[k]:
                step = abs(goal) / ramp * (CONTROL_S * 1e3)
            else:
                step = ramp * (rad_s2 * CONTROL_S)
        path_rad_s[k] += min(max(goal - path_rad_s[k], -step), step)
        error = (path_rad_s[k] - shaft_rad_s[k]) / rad_s
        sums[k] = _limited_sum(sums[k] + error, settings[3, k], pwm_limit[k], full_pwm)
        pwm = (settings[2, k] * error + settings[3, k] * sums[k]) / full_pwm
        goal_rad[k] = shaft_rad[k] + pwm / TINY_GAIN
