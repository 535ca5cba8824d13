"""Base class of motion sources that wrap another source."""

from snakewalk.config.arrays import Floats
from snakewalk.controller.gaits.gait import Needs
from snakewalk.controller.motion.source import MotionSource, Pace


class MotionWrapper:
    """Part of a ``MotionSource`` that delegates to another source.

    A subclass provides ``step``, and overrides the methods in which it differs.
    """

    def __init__(self, wrapped: MotionSource) -> None:
        self.wrapped = wrapped
        """Source that moves the joints; a subclass may replace it."""

    @property
    def needs(self) -> Needs:
        """Requirements of the source on the robot."""
        return self.wrapped.needs

    @property
    def done(self) -> bool:
        """Whether the source has ended and rests."""
        return self.wrapped.done

    def goal_rad(self) -> Floats:
        """(J,) present joint targets."""
        return self.wrapped.goal_rad()

    def velocity_rad_s(self) -> Floats:
        """(J,) their present speeds."""
        return self.wrapped.velocity_rad_s()

    def pace(self) -> Pace:
        """Largest speeds and accelerations of the source from now on."""
        return self.wrapped.pace()
