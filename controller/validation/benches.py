"""Benches on which a measurement is repeated: a body in a run, a pendulum, a motor."""

import math
from collections.abc import Callable

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.config.errors import InputError
from snakewalk.config.loader import checked
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.controller.gaits.gait import Needs
from snakewalk.controller.gaits.registry import make_gait
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.motion.gait_motion import GaitMotion
from snakewalk.controller.motion.source import MotionSource, Pace
from snakewalk.controller.run.kinds.source_run import SourceRun
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.validation.measurement import (
    Conditions,
    MotorMotion,
    PendulumMotion,
    ShippedGait,
    WaveMotion,
)
from snakewalk.sim.servo.bench import BenchPlant
from snakewalk.sim.servo.motor import gears_of, make_drive, motors_of, p_gain_per_rad

RISE_S = 1.0
"""Time in which the amplitudes of a wave rise from 0 (ours)."""
_CYCLE_HZ = 100.0
"""Goals per second: steps of 20 ms would shake a stiff body, and water resists by the square."""
_PENDULUM_S = 6.0
"""Duration of BAM's trajectories."""
_SETTLING_S = 1.0
_LAG_STEP_S = 2.5e-3
_MOST_LAG_S = 0.4
"""Lags are searched in these steps and up to this limit, as in ``feetech-bench-figures``."""
_SPIN_UP_S = 3.0
_TRAJECTORIES: dict[str, Callable[[Floats], Floats]] = {
    "sin_sin": lambda t: np.sin(t) * np.pi / 2 + 0.5 * np.sin(5.0 * t) * np.sin(2.0 * t),
    "sin_time_square": lambda t: np.sin(t**2),
}


class SineWave:
    """A ``MotionSource`` of sinusoidal joint angles, whose amplitudes rise within a second."""

    needs = Needs()

    def __init__(self, motion: WaveMotion) -> None:
        self._amplitude_rad = np.radians(motion.amplitudes_deg)
        self._phase_rad = np.radians(motion.phases_deg)
        self._rate_rad_s = math.tau * motion.frequency_hz
        self._seconds = motion.seconds
        self._time_s = 0.0

    @property
    def done(self) -> bool:
        """Whether the duration has passed."""
        return self._time_s >= self._seconds

    def goal_rad(self) -> Floats:
        """(J,) present angles."""
        return self._values_at(self._time_s)

    def velocity_rad_s(self) -> Floats:
        """(J,) their present speeds, from a short difference."""
        return (self._values_at(self._time_s + 1e-4) - self._values_at(self._time_s)) / 1e-4

    def pace(self) -> Pace:
        """Largest speeds and accelerations of the complete wave."""
        speed = self._rate_rad_s * np.abs(self._amplitude_rad)
        return Pace(speed, self._rate_rad_s * speed)

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Advance by ``dt_s`` and return the new angles (J,)."""
        self._time_s += dt_s
        return self.goal_rad()

    def _values_at(self, time_s: float) -> Floats:
        share = min(time_s / RISE_S, 1.0)
        rise = share * share * (3.0 - 2.0 * share)
        wave = np.sin(self._rate_rad_s * time_s + self._phase_rad)
        return rise * self._amplitude_rad * wave


def simulate(conditions: Conditions) -> dict[str, float]:
    """Return the results of a simulation by quantity.

    Raises:
        InputError: the motion does not fit the body, or the run stopped early.

    """
    motion = conditions.motion
    if isinstance(motion, PendulumMotion):
        return _pendulum(conditions.robot, motion)
    if isinstance(motion, MotorMotion):
        return _motor(conditions.robot, motion)
    return _body(conditions, motion)


def _body(conditions: Conditions, motion: WaveMotion | ShippedGait) -> dict[str, float]:
    robot = conditions.robot
    if isinstance(motion, WaveMotion):
        joints = robot.joint_count
        for key in ("amplitudes_deg", "phases_deg"):
            if len(getattr(motion, key)) != joints:
                raise InputError(f"motion.{key}: write {joints} values, one for each joint")
    fields = {
        "name": "validate",
        "robot": robot.name,
        "world": conditions.world.name,
        "motion": "source",
        "time_limit_s": motion.seconds + 5.0,
        "cycle_hz": _CYCLE_HZ,
    }
    run = checked(RunConfig, fields, "validate")
    prepared = SourceRun(run, robot, conditions.world, lambda body: _source(body, motion))
    result = run_robot(RunRequest(prepared, stoppable=False))
    if result.outcome.tripped:
        raise InputError(f"the simulated run stopped: {result.outcome.tripped}")
    pose = result.record.pose
    late = (pose.time_s >= motion.after_s) & (pose.time_s <= motion.seconds)
    time_s = pose.time_s[late]
    links_m = pose.links_m[late][..., :2]
    speed = _fitted_speed(time_s, links_m.mean(axis=1))
    return {
        "head_speed_m_s": _fitted_speed(time_s, links_m[:, 0]),
        "tail_speed_m_s": _fitted_speed(time_s, links_m[:, -1]),
        "speed_m_s": speed,
        "lengths_per_cycle": speed / motion.frequency_hz / robot.length_m,
    }


def _source(robot: RobotConfig, motion: WaveMotion | ShippedGait) -> MotionSource:
    if isinstance(motion, WaveMotion):
        return SineWave(motion)
    parameters = {"frequency_hz": motion.frequency_hz, **motion.parameters}
    running = GaitMotion(make_gait(motion.name, parameters), robot, duration_s=motion.seconds)
    if running.frequency_hz < motion.frequency_hz * (1.0 - 1e-6):
        raise InputError(
            f"motion.frequency_hz = {motion.frequency_hz:g}: the joints of {robot.name} reach "
            f"{running.frequency_hz:.3g} Hz; write this, or raise joint_speed_limit_rad_s"
        )
    return running


def _fitted_speed(time_s: Floats, place_m: Floats) -> float:
    """Slope of a place (T, 2) over time, by least squares."""
    moved_s = time_s - time_s.mean()
    slope = (moved_s[:, None] * (place_m - place_m.mean(axis=0))).sum(axis=0) / (moved_s**2).sum()
    return math.hypot(*slope)


def _pendulum(robot: RobotConfig, motion: PendulumMotion) -> dict[str, float]:
    time_s = np.arange(0.0, _PENDULUM_S, 1.0 / motion.rate_hz)
    trajectory = _TRAJECTORIES[motion.trajectory]
    weight_n_m = motion.mass_kg * GRAVITY_M_S2 * motion.arm_m
    model = motors_of(robot)[0]
    plant = BenchPlant(
        1,
        inertia_kg_m2=motion.mass_kg * motion.arm_m**2,
        load_n_m=lambda q: -weight_n_m * np.sin(q),
        gear=gears_of(robot)[0],
    )
    drive = make_drive([model], robot.servo.supply_v)
    drive.torque_on[:] = 1.0
    drive.p_gain_per_rad[:] = p_gain_per_rad(motion.p_gain, model)
    angle_rad = np.empty_like(time_s)
    for k, now_s in enumerate(time_s):
        plant.advance(now_s, drive)
        angle_rad[k] = plant.position_rad[0]
        drive.goal_rad[:] = trajectory(np.maximum(time_s[k : k + 1] - motion.delay_s, 0.0))
    settled = time_s >= _SETTLING_S
    late_s = np.arange(0.0, _MOST_LAG_S + 1e-9, _LAG_STEP_S)
    errors = [
        float(np.sqrt(np.mean((angle_rad[settled] - trajectory(time_s[settled] - lag)) ** 2)))
        for lag in late_s
    ]
    return {"lag_s": float(late_s[np.argmin(errors)]), "rms_error_rad": errors[0]}


def _motor(robot: RobotConfig, motion: MotorMotion) -> dict[str, float]:
    """Spin a free shaft at full output until its speed settles; block it for torque and current."""
    model = motors_of(robot)[0]
    plant = BenchPlant(1, inertia_kg_m2=1e-4, gear=gears_of(robot)[0])
    drive = make_drive([model], motion.supply_v)
    drive.torque_on[:] = 1.0
    drive.p_gain_per_rad[:] = 1.0
    drive.goal_rad[:] = 1e6
    plant.advance(_SPIN_UP_S, drive)
    stall_a = motion.supply_v / drive.resistance_ohm[0]
    return {
        "no_load_rpm": float(plant.velocity_rad_s[0]) * 60.0 / math.tau,
        "stall_torque_n_m": float(stall_a * drive.torque_constant_n_m_a[0]),
        "stall_current_a": float(stall_a),
    }
