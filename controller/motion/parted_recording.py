"""A recording with gaps: its parts are played one after another, with a rest at each gap.

A spline through both sides of a long gap leaves the recorded range; a servo must not receive angles
that nobody measured.
"""

from itertools import pairwise

import numpy as np

from snakewalk.config.arrays import Floats, SignedInts
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.gaits.gait import Needs
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.kinematics.ramp import Ramp
from snakewalk.controller.motion.recorded import Recorded
from snakewalk.controller.motion.source import HEADROOM, Pace

_STEPS = 3.5
_GAP_S = 0.25
"""A gap is longer than both: usual steps between rows, and a time in which a wave changes little
(ours)."""


def gaps(time_s: Floats) -> SignedInts:
    """Return the indices (G,) of the rows after gaps in times (T,)."""
    step_s = np.diff(time_s)
    limit_s = max(_STEPS * float(np.median(step_s)), _GAP_S)
    return np.flatnonzero(step_s > limit_s) + 1


def recording(
    robot: RobotConfig, time_s: Floats, joint_rad: Floats, speed: float = 1.0
) -> "Recorded | PartedRecording":
    """Return a recording (T, J) as a motion, at a factor on its speed.

    Raises:
        InputError: as ``Recorded``.

    """
    cuts = gaps(time_s)
    if not len(cuts):
        return Recorded(robot, time_s / speed, joint_rad)
    return PartedRecording(robot, time_s / speed, joint_rad, cuts)


class PartedRecording:
    """Plays each part from rest to rest, and moves evenly from the end of one to the next."""

    def __init__(
        self, robot: RobotConfig, time_s: Floats, joint_rad: Floats, cuts: SignedInts
    ) -> None:
        """Split angles (T, J) at times (T,) before each row of ``cuts``."""
        step_s = float(np.median(np.diff(time_s)))
        times = np.split(time_s, cuts)
        angles = np.split(joint_rad, cuts)
        self._parts = [
            Recorded(robot, part, rows)
            if len(part) > 1
            else Recorded(robot, part[0] + np.array([0.0, step_s]), np.repeat(rows, 2, axis=0))
            for part, rows in zip(times, angles, strict=True)
        ]
        self.slowed = max(part.slowed for part in self._parts)
        """Factor by which the recording was slowed (``Recorded.slowed``)."""
        speed_rad_s = HEADROOM * robot.joint_speed_limit_rad_s
        acceleration_rad_s2 = HEADROOM * robot.joint_acceleration_limit_rad_s2
        self._bridges = [
            Ramp(before[-1], after[0], speed_rad_s, acceleration_rad_s2, float(gap_s))
            for (before, after), gap_s in zip(
                pairwise(angles), time_s[cuts] - time_s[cuts - 1], strict=True
            )
        ]
        paces = [part.pace() for part in self._parts]
        paces += [Pace(*bridge.peaks()) for bridge in self._bridges]
        self._pace = Pace(
            np.max([pace.speed_rad_s for pace in paces], axis=0),
            np.max([pace.acceleration_rad_s2 for pace in paces], axis=0),
        )
        self.duration_s = sum(part.duration_s for part in self._parts)
        self.duration_s += sum(bridge.duration_s for bridge in self._bridges)
        """From rest to rest."""
        self._at = 0
        self._bridge_s = 0.0
        """Time since the present part has ended."""
        self.needs = Needs.of(robot, joint_rad)

    @property
    def done(self) -> bool:
        """Whether the recording has been played."""
        return self._at == len(self._parts) - 1 and self._parts[-1].done

    def goal_rad(self) -> Floats:
        """(J,) present joint targets."""
        if self._bridge_s == 0.0:
            return self._parts[self._at].goal_rad()
        return self._bridges[self._at].at(self._bridge_s)

    def velocity_rad_s(self) -> Floats:
        """(J,) their present speeds."""
        if self._bridge_s == 0.0:
            return self._parts[self._at].velocity_rad_s()
        return self._bridges[self._at].velocity_rad_s(self._bridge_s)

    def pace(self) -> Pace:
        """Largest values of the whole recording."""
        return self._pace

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Advance by ``dt_s``, up to the end; a part and a gap end on a step."""
        part = self._parts[self._at]
        if not part.done:
            return part.step(dt_s, view)
        if self._at < len(self._bridges):
            self._bridge_s += dt_s
            if self._bridge_s >= self._bridges[self._at].duration_s:
                self._at += 1
                self._bridge_s = 0.0
        return self.goal_rad()
