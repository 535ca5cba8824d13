"""Recorded joint angles as a motion: splined, and slowed as far as the robot needs."""

import numpy as np
import scipy  # scipy.interpolate loads when it is first used

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.gaits.gait import Needs
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.kinematics.smoothstep import quintic, quintic_slope, quintic_sum
from snakewalk.controller.motion.source import HEADROOM, Pace

RAMP_S = 0.5
"""Shortest time in which a recording comes to its speed, and to rest again (ours)."""
_RAMP_SAMPLES = 400


class Recorded:
    """Plays (T, J) joint angles once, from rest to rest.

    A recording need not start at rest. The playback's clock ramps up to its rate along a quintic,
    and down to rest; the angles stay those of the recording.
    """

    def __init__(self, robot: RobotConfig, time_s: Floats, joint_rad: Floats) -> None:
        """Spline ``joint_rad`` (T, J) over ``time_s`` (T,), T at least 2.

        Raises:
            InputError: times do not increase, another number of joints, or angles beyond the
                limits.

        """
        if joint_rad.shape != (len(time_s), robot.joint_count) or len(time_s) < 2:
            raise InputError(
                f"a recording of shape {joint_rad.shape} at {len(time_s)} times; "
                f"robot {robot.name} has {robot.joint_count} joints, and two times are the least"
            )
        if not (np.diff(time_s) > 0.0).all():
            raise InputError("the times of a recording must grow")
        self._spline = scipy.interpolate.CubicSpline(time_s, joint_rad, bc_type="natural")
        fine = np.linspace(time_s[0], time_s[-1], 8 * len(time_s))
        reach = np.abs(self._spline(fine)).max(axis=0)
        limit = np.array(robot.limit_rad)
        if (reach > limit).any():
            joint = int(np.argmax(reach / limit))
            moment = fine[np.argmax(np.abs(self._spline(fine)[:, joint]))]
            frame = int(np.argmin(np.abs(time_s - moment)))
            least = np.floor(100.0 * limit[joint] / reach[joint]) / 100.0
            raise InputError(
                f"recording: {robot.joint_label(joint)} bends to {reach[joint]:.2f} rad in frame "
                f"{frame}; its limit is {limit[joint]:.2f}: make the whole motion smaller (--scale "
                f"{least:.2f}), or clip joints to their limits (--clip)"
            )
        speed = np.abs(self._spline(fine, 1)).max(axis=0)
        bend = np.abs(self._spline(np.concatenate([fine, time_s]), 2)).max(axis=0)
        fast = float(speed.max()) / (HEADROOM * robot.joint_speed_limit_rad_s)
        hard = float(bend.max()) / (HEADROOM * robot.joint_acceleration_limit_rad_s2)
        self.slowed = max(1.0, fast, float(np.sqrt(hard)))
        """Factor by which it is slower here than the recording, without the time of the ramps."""
        self._start_s, self._length_s = float(time_s[0]), float(time_s[-1] - time_s[0])
        most = HEADROOM * robot.joint_acceleration_limit_rad_s2
        self._ramp_s = min(RAMP_S, self._length_s * self.slowed)
        while True:
            ramps = self._ramp_acceleration_rad_s2()
            if ramps.max(initial=0.0) <= most * (1.0 + 1e-9):
                break
            if self._ramp_s < self._length_s * self.slowed:
                self._ramp_s = min(1.2 * self._ramp_s, self._length_s * self.slowed)
            else:
                self.slowed *= 1.05
        self._pace = Pace(
            speed / self.slowed,
            np.maximum(bend / self.slowed**2, ramps),
        )
        self.duration_s = self._length_s * self.slowed + self._ramp_s
        """Duration of the motion, from rest to rest."""
        self._now_s = 0.0
        self.needs = Needs.of(robot, joint_rad)

    @property
    def done(self) -> bool:
        """Whether it has been played."""
        return self._now_s >= self.duration_s

    def goal_rad(self) -> Floats:
        """(J,) present joint targets."""
        return np.asarray(self._spline(self._place(self._now_s)[0]), dtype=float)

    def velocity_rad_s(self) -> Floats:
        """(J,) their present speeds."""
        place_s, rate = self._place(self._now_s)
        return np.asarray(self._spline(place_s, 1) * rate, dtype=float)

    def pace(self) -> Pace:
        """Largest values of the whole recording."""
        return self._pace

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Advance by ``dt_s``, up to the end."""
        self._now_s = min(self._now_s + dt_s, self.duration_s)
        return self.goal_rad()

    def _place(self, now_s: float) -> tuple[float, float]:
        """Time in the recording after ``now_s``, and its rate."""
        ramp_s, left_s = self._ramp_s, self.duration_s - now_s
        if min(now_s, left_s) >= ramp_s:
            return self._start_s + (now_s - 0.5 * ramp_s) / self.slowed, 1.0 / self.slowed
        x = min(now_s, left_s) / ramp_s
        done_s = ramp_s * quintic_sum(x) / self.slowed
        rate = quintic(x) / self.slowed
        return self._start_s + (done_s if now_s <= left_s else self._length_s - done_s), rate

    def _ramp_acceleration_rad_s2(self) -> Floats:
        """Largest acceleration (J,) of the joints during the clock's ramps."""
        x = np.linspace(0.0, 1.0, _RAMP_SAMPLES)[:, None]
        done_s = self._ramp_s * quintic_sum(x[:, 0]) / self.slowed
        rate = quintic(x) / self.slowed
        growth = quintic_slope(x) / self._ramp_s / self.slowed
        ramps = []
        for places_s, sign in (
            (self._start_s + done_s, 1.0),
            (self._start_s + self._length_s - done_s, -1.0),
        ):
            bend = self._spline(places_s, 2)
            speed = self._spline(places_s, 1)
            ramps.append(np.abs(bend * rate**2 + sign * speed * growth))
        return np.asarray(np.concatenate(ramps).max(axis=0))
