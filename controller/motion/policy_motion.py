"""A running policy: it observes joints and heading, and moves within the robot's limits.

All observations are available without a camera: measured angles, its last goals, its phase, and a
heading (from an IMU, a pose, or dead reckoning). The training environment steps this same motion.
"""

from math import cos, sin

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.gaits.gait import Needs
from snakewalk.controller.gaits.wave import TURN, places
from snakewalk.controller.kinematics.links import BodyView, chain_angles_rad
from snakewalk.controller.motion.policy import WAVE_ENDS, WAVE_SPAN, Policy
from snakewalk.controller.motion.rate_limiter import RateLimiter
from snakewalk.controller.motion.source import HEADROOM, Pace
from snakewalk.controller.motion.stop_profile import StopProfile

GAIN_PER_S = 25.0
"""Gain of the rate limiter: a goal lags its wave by 40 ms if no limit binds (ours)."""
CHANGE_S = 0.1
"""Time in which the wave follows an action (ours)."""


class PolicyMotion:
    """A policy on a robot; it starts with a straight body at rest."""

    needs = Needs(yaw=True, wheels=True)

    def __init__(
        self, policy: Policy, robot: RobotConfig, *, duration_s: float = float("inf")
    ) -> None:
        """Prepare; after ``duration_s`` the motion comes to rest.

        Raises:
            InputError: the robot lacks yaw joints, or its joints differ from those observed.

        """
        self.needs.check(robot, f"policy {policy.name}")
        policy.check(robot)
        self._yaw = np.array(robot.yaw_joints)
        place = places(robot, robot.yaw_joints)
        self._start = policy.wave.vector()
        self._wave = self._start.copy()
        self._layers = [(np.array(layer.weights), np.array(layer.bias)) for layer in policy.network]
        thirds = np.clip(place - np.arange(3)[:, None] / 3.0, 0.0, 1.0 / 3.0)
        along = np.zeros((3, len(WAVE_SPAN), len(place)))
        along[0, 1:5], along[1, 5:8], along[2, 10:13] = (
            _hats(4, place),
            TURN * thirds,
            _hats(3, place),
        )
        self._along = along
        """(3, P, n) amplitude, lag and steering of each joint by the values of a wave."""
        self._most_rad = HEADROOM * np.array(robot.limit_rad)[self._yaw]
        self._pace = Pace(
            HEADROOM * Pace.limit(robot).speed_rad_s,
            HEADROOM * Pace.limit(robot).acceleration_rad_s2,
        )
        self._limiter = RateLimiter(
            np.zeros(len(self._yaw)),
            HEADROOM * robot.joint_speed_limit_rad_s,
            HEADROOM * robot.joint_acceleration_limit_rad_s2,
            GAIN_PER_S,
        )
        self._phase_rad = 0.0
        self._heading_rad = 0.0
        self._mean_heading_rad = np.nan
        self._measured_rad = np.zeros(len(self._yaw))
        self._robot = robot
        self._remaining_s = duration_s
        self._stop_profile = StopProfile()
        self.cycles = 0.0
        """Number of cycles of the wave so far."""

    @property
    def done(self) -> bool:
        """Whether the motion rests after its duration."""
        return self._stop_profile.over

    def goal_rad(self) -> Floats:
        """(J,) present joint targets."""
        return self._values_of_all(self._limiter.angle_rad)

    def velocity_rad_s(self) -> Floats:
        """(J,) their present speeds."""
        return self._values_of_all(self._stop_profile.rate * self._limiter.speed_rad_s)

    def pace(self) -> Pace:
        """The robot's limits times the headroom."""
        return self._pace

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Observe, and advance by ``dt_s``."""
        self._remaining_s -= dt_s
        if self._remaining_s <= 0.0:
            self._stop_profile.stop()
        part_s = self._stop_profile.step(dt_s)
        values = self.observe(view)
        for weights, bias in self._layers[:-1]:
            values = np.tanh(weights @ values + bias)
        if self._layers:
            weights, bias = self._layers[-1]
            return self.act(weights @ values + bias, part_s)
        return self.act(np.zeros(len(self._wave)), part_s)

    def observe(self, view: BodyView) -> Floats:
        """Measure the body; return a network's observation, as ``observation_names``."""
        self._measured_rad = chain_angles_rad(self._robot, view)[self._yaw]
        self._heading_rad = view.heading_rad
        observation = [cos(self._phase_rad), sin(self._phase_rad)]
        observation += [cos(self._heading_rad), sin(self._heading_rad)]
        return np.concatenate([observation, self._measured_rad, self._limiter.angle_rad])

    def act(self, action: Floats, dt_s: float) -> Floats:
        """Change the wave by an action (P,), -1 to 1, and advance by ``dt_s``; return targets (J,).

        The wave follows the action with time constant ``CHANGE_S``.
        """
        target = np.clip(self._start + WAVE_SPAN * np.clip(action, -1.0, 1.0), *WAVE_ENDS)
        self._wave += (1.0 - np.exp(-dt_s / CHANGE_S)) * (target - self._wave)
        wave = self._wave
        frequency_hz = wave[0]
        sine = wave[8]
        cosine = wave[9]
        self.cycles += dt_s * frequency_hz
        self._phase_rad = float((self._phase_rad + dt_s * TURN * frequency_hz) % TURN)
        heading_rad = self._mean_heading(dt_s * frequency_hz)
        amplitude_rad, lag_rad, gain = wave @ self._along
        phase_rad = self._phase_rad - lag_rad
        swing = (
            np.sin(phase_rad) + sine * np.sin(3.0 * phase_rad) + cosine * np.cos(3.0 * phase_rad)
        )
        off = np.zeros(len(phase_rad) + 2)
        off[1:-1] = self._measured_rad - self._limiter.angle_rad
        reflex = wave[13] * off[1:-1] + wave[14] * off[:-2] + wave[15] * off[2:]
        goal = amplitude_rad * swing - heading_rad / len(phase_rad) * gain + reflex
        self._limiter.step(dt_s, np.clip(goal, -self._most_rad, self._most_rad))
        return self.goal_rad()

    def _mean_heading(self, cycles: float) -> float:
        """Return the heading without its swing: a running mean over about a cycle."""
        if np.isnan(self._mean_heading_rad):
            self._mean_heading_rad = self._heading_rad
        off = (self._heading_rad - self._mean_heading_rad + np.pi) % TURN - np.pi
        self._mean_heading_rad += (1.0 - np.exp(-cycles)) * off
        return float((self._mean_heading_rad + np.pi) % TURN - np.pi)

    def _values_of_all(self, yaw: Floats) -> Floats:
        joints = np.zeros(self._robot.joint_count)
        joints[self._yaw] = yaw
        return joints


def _hats(count: int, place: Floats) -> Floats:
    """(count, n) weights that interpolate values at ``count`` knots from 0 to 1 at places (n,)."""
    knots = np.linspace(0.0, 1.0, count)
    return np.array([np.interp(place, knots, row) for row in np.eye(count)])
