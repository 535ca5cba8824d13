"""Interface of the estimators of the friction under the body."""

from abc import ABC, abstractmethod
from collections.abc import Callable

from snakewalk.config.arrays import Floats
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.mechanics.friction_filter import FoundFriction

_NOTABLE = 0.25
"""Change of a friction since the last report that is reported."""


class FrictionEstimator(ABC):
    """Estimates the friction under a body; call ``update`` once a cycle."""

    def __init__(self, file: FrictionConfig, use: Callable[[FrictionConfig], None]) -> None:
        self._file = file
        self._use = use
        self._confirmed = 0
        self._is_estimated = False
        self._used = self._reported = file

    @abstractmethod
    def update(self, view: BodyView, goal_rad: Floats) -> FoundFriction | None:
        """Process the body, and the goals (J,) that were sent in the cycle before.

        Returns:
            The finding, if motion has just been judged; else None.

        """

    def accept(self, identified: FoundFriction) -> None:
        """Use a finding: the estimate if it contradicts the file, else the file's friction."""
        if identified.differs or not identified.is_estimated:
            self._confirmed = 0
        else:
            self._confirmed += 1
        self._is_estimated = identified.is_estimated
        friction = identified.friction if identified.differs else self._file
        if friction != self._used:
            self._used = friction
            self._use(friction)

    @property
    def confirms_file(self) -> bool:
        """Whether the newest motion that was judged agrees with the world's file."""
        return self._confirmed > 0

    @property
    def alarm_text(self) -> str:
        """Estimate and its data, for an alarm; it excludes no cause."""
        used = self._used
        if not self._is_estimated:
            return "friction not estimated; check ground, belly and `world.friction`"
        values = f"{used.along:.2g} along and {used.across:.2g} across, law {used.law_text}"
        if not self.confirms_file:
            return f"friction estimated from the body's motion: {values}; check ground and belly"
        return (
            f"the body's motion in the last {self._confirmed} spans agrees with the file's "
            f"friction ({values}); the ground is not excluded: check it, the belly and "
            "`world.friction.law`"
        )

    def event_text(self) -> str | None:
        """A line when the friction in use has changed notably since the last one."""
        used = self._used
        reported = self._reported
        change = max(
            abs(used.along / reported.along - 1.0), abs(used.across / reported.across - 1.0)
        )
        if change < _NOTABLE:
            return None
        self._reported = used
        file = self._file
        if not self._is_estimated:
            return "the estimate of the friction is discarded; the world's file applies"
        if used == file:
            return "the estimated friction agrees with the world's file again"
        return (
            f"found {used.along:.2f} along and {used.across:.2f} across the body; the world's file "
            f"has {file.along:g} and {file.across:g}"
        )
