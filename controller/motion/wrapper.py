"""Base class of motion sources that move joints by another source."""

from snakewalk.config.arrays import Floats
from snakewalk.controller.gaits.gait import Needs
from snakewalk.controller.motion.source import MotionSource, Pace


class MotionWrapper:
    """Part of a ``MotionSource`` that passes on what another source reports.

    A subclass provides ``step``, and overrides the methods in which it differs from the source.
    """

    def __init__(self, wrapped: MotionSource) -> None:
        self.wrapped = wrapped
        """The source that moves the joints; a subclass may replace it."""

    @property
    def needs(self) -> Needs:
        """Requirements of the source on the robot."""
        return self.wrapped.needs

    @property
    def done(self) -> bool:
        """Whether the source has come to its end and rests."""
        return self.wrapped.done

    def goal_rad(self) -> Floats:
        """(J,) joint targets now."""
        return self.wrapped.goal_rad()

    def velocity_rad_s(self) -> Floats:
        """(J,) speeds of the joint targets now."""
        return self.wrapped.velocity_rad_s()

    def pace(self) -> Pace:
        """Largest speeds and accelerations of the source from now on."""
        return self.wrapped.pace()
