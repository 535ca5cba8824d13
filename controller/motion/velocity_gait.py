"""A gait whose rate and bend follow commanded velocities of the body.

A serpenoid body without side slip advances by one wavelength per cycle, on an arc with the bend of
its axis. The rate of the phase therefore follows the speed; the bend is turn rate times length over
speed; a negative rate moves backward. Slip makes the body slower than commanded: the pose is not
fed back.
"""

import math
from copy import copy

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.gaits.gait import CYCLE_SAMPLES, Gait, Needs
from snakewalk.controller.gaits.wave import TURN
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.motion.gait_cycle import GaitCycle
from snakewalk.controller.motion.rate_limiter import RateLimiter
from snakewalk.controller.motion.source import Pace
from snakewalk.controller.motion.turned_gait import (
    TURN_PER_S2,
    TURN_RATE_PER_S,
    rate_beside_turn,
    turned,
)

BEND_LIMIT_RAD = 1.4
"""Largest bend of the axis over the body (ours), as of a steered gait."""
_RATE_PER_S = 0.7
"""Rate of change of the share of the full rate (ours): from full speed to rest in 1.5 s."""
_RATE_PER_S2 = 4.0
_REST_RATE = 1e-3
_ROUNDING = 1.0 + 1e-9
_KEY = "turn_rad"


class VelocityGait:
    """A ``MotionSource`` that starts at rest and moves when a velocity is commanded."""

    done = False

    def __init__(self, gait: Gait, robot: RobotConfig) -> None:
        """Prepare at phase 0, at rest.

        Raises:
            InputError: the gait follows no velocity, or bends joints beyond their limits.

        """
        if not gait.follows_velocity:
            raise InputError(
                f"velocity: gait {gait.name} does not follow velocities; start lateral-undulation"
            )
        straight = turned(gait, _KEY, 0.0)
        straight = type(gait)(straight.params.model_copy(update={"backward": False}))
        for bend in (-BEND_LIMIT_RAD, BEND_LIMIT_RAD):
            turned(straight, _KEY, bend).check(robot)
        self._gait = straight
        self._robot = robot
        cycle = GaitCycle(straight, robot)
        share = rate_beside_turn(straight, _KEY, robot, cycle.pace())
        self._full_rad_s = cycle.rate_rad_s * share
        speed = share * cycle.pace().speed_rad_s
        bend = 1.0 / len(robot.yaw_joints)
        self._pace = Pace(
            speed + bend * TURN_RATE_PER_S,
            share**2 * cycle.pace().acceleration_rad_s2 + bend * TURN_PER_S2 + _RATE_PER_S * speed,
        )
        self.full_speed_m_s = self._full_rad_s / TURN * _wavelength_m(straight, robot)
        """Speed without slip at the full rate."""
        self._bend = RateLimiter(np.zeros(1), TURN_RATE_PER_S, TURN_PER_S2)
        self._rate = RateLimiter(np.zeros(1), _RATE_PER_S, _RATE_PER_S2)
        self._share = self._bend_rad = 0.0
        self._phase_rad = 0.0

    @property
    def needs(self) -> Needs:
        """Requirements of the gait."""
        return self._gait.needs

    @property
    def rests(self) -> bool:
        """Whether the body is at rest and will stay so."""
        return self._share == 0.0 and abs(float(self._rate.angle_rad[0])) < _REST_RATE

    def follow(self, forward_m_s: float, turn_rad_s: float) -> None:
        """Move along the body at a speed, and turn at a rate, positive to the left.

        Raises:
            InputError: a value is not a number, or the gait does not reach it.

        """
        if not (math.isfinite(forward_m_s) and math.isfinite(turn_rad_s)):
            raise InputError("velocity: not a number; send finite values")
        speed = abs(forward_m_s)
        most = self.full_speed_m_s
        if speed > most * _ROUNDING:
            raise InputError(f"velocity: {forward_m_s:.3g} m/s; at most {most:.3f} m/s is accepted")
        length_m = self._robot.length_m
        most_turn = BEND_LIMIT_RAD * speed / length_m
        if abs(turn_rad_s) > most_turn * _ROUNDING:
            raise InputError(
                f"velocity: {turn_rad_s:.3g} rad/s at {forward_m_s:.3g} m/s; at most "
                f"{most_turn:.3f} rad/s is accepted at this speed"
            )
        self._share = forward_m_s / most
        if speed > 0.0:
            self._bend_rad = turn_rad_s * length_m / forward_m_s

    def restarted(self) -> "VelocityGait":
        """Return a copy at rest with the same commanded velocity."""
        fresh = copy(self)
        fresh._bend = RateLimiter(np.zeros(1), TURN_RATE_PER_S, TURN_PER_S2)
        fresh._rate = RateLimiter(np.zeros(1), _RATE_PER_S, _RATE_PER_S2)
        fresh._phase_rad = 0.0
        return fresh

    def stop(self) -> None:
        """Come to rest in the shape at that time."""
        self._share = 0.0

    def goal_rad(self) -> Floats:
        """(J,) present joint targets."""
        return self._joints_rad(self._phase_rad, float(self._bend.angle_rad[0]))

    def velocity_rad_s(self) -> Floats:
        """(J,) central difference over 4e-4 s of phase and bend."""
        rate = self._full_rad_s * float(self._rate.angle_rad[0])
        half_s = 2e-4
        bend = float(self._bend.angle_rad[0])
        bending = float(self._bend.speed_rad_s[0])
        before, after = (
            self._joints_rad(self._phase_rad + at_s * rate, bend + at_s * bending)
            for at_s in (-half_s, half_s)
        )
        return (after - before) / (2.0 * half_s)

    def pace(self) -> Pace:
        """Return the pace at full speed with changing rate and bend."""
        return self._pace

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Advance by ``dt_s`` and return the new targets (J,)."""
        before = float(self._rate.angle_rad[0])
        self._rate.step(dt_s, np.array([self._share]))
        self._bend.step(dt_s, np.array([self._bend_rad]))
        rate = 0.5 * (before + float(self._rate.angle_rad[0]))
        self._phase_rad = (self._phase_rad + dt_s * rate * self._full_rad_s) % TURN
        return self.goal_rad()

    def _joints_rad(self, phase_rad: float, bend_rad: float) -> Floats:
        bent = turned(self._gait, _KEY, bend_rad)
        return np.asarray(bent.joints_rad(self._robot, np.array([phase_rad]))[0])


def _wavelength_m(gait: Gait, robot: RobotConfig) -> float:
    """Return the length of a wave along the body's axis, mean over a cycle."""
    joints = gait.joints_rad(robot, np.linspace(0.0, TURN, CYCLE_SAMPLES))[:, robot.yaw_joints]
    heading = np.concatenate([np.zeros((len(joints), 1)), np.cumsum(joints, axis=1)], axis=1)
    off_axis = heading - heading.mean(axis=1, keepdims=True)
    return float(robot.length_m * np.cos(off_axis).mean() / gait.params.waves)
