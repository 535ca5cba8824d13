"""A gait that becomes other gaits at set times, each by a C1 join."""

from collections.abc import Sequence

from snakewalk.config.arrays import Floats
from snakewalk.controller.gaits.gait import Gait, Needs
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.motion.gait_motion import GaitMotion
from snakewalk.controller.motion.source import Pace


class GaitSequence:
    """Runs a ``GaitMotion`` through gaits."""

    def __init__(self, motion: GaitMotion, changes: Sequence[tuple[float, Gait]]) -> None:
        """Take gaits at rising times on the motion's own time; all suit its robot."""
        self.motion = motion
        self._due = list(changes)
        self._now_s = 0.0

    @property
    def needs(self) -> Needs:
        """Those of the gait that runs."""
        return self.motion.needs

    @property
    def done(self) -> bool:
        """Whether the motion is."""
        return self.motion.done

    def goal_rad(self) -> Floats:
        """(J,) joint targets now."""
        return self.motion.goal_rad()

    def velocity_rad_s(self) -> Floats:
        """(J,) how fast they move now."""
        return self.motion.velocity_rad_s()

    def pace(self) -> Pace:
        """That of the motion."""
        return self.motion.pace()

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Change gait if it is time to, then go on by ``dt_s``."""
        while self._due and self._now_s >= self._due[0][0] - 1e-9:
            self.motion.become(self._due.pop(0)[1])
        self._now_s += dt_s
        return self.motion.step(dt_s, view)
