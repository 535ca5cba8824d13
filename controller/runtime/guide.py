"""What the drive asks of whatever moves the robot: the pilot, or any motion source."""

from typing import Protocol

from snakewalk.config.arrays import Floats
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.motion.source import MotionSource
from snakewalk.controller.walk.steering import Path
from snakewalk.controller.walk.walker import Decision


class Guide(Protocol):
    """Joint goals for a measured body, and how far the job has come."""

    @property
    def done(self) -> bool:
        """Whether the job is done."""
        ...

    @property
    def at_rest(self) -> bool:
        """Whether it is done and the joints rest."""
        ...

    @property
    def reached(self) -> int:
        """Waypoints reached."""
        ...

    @property
    def missed(self) -> int:
        """How often one was passed by."""
        ...

    @property
    def along_m(self) -> float:
        """Arc length on the path; NaN where there is none."""
        ...

    @property
    def pulse_m_s(self) -> float:
        """How fast the shape travels along the body; 0 where that says nothing of the advance."""
        ...

    @property
    def decision(self) -> Decision | None:
        """Made in the last step, if one was."""
        ...

    @property
    def path(self) -> Path | None:
        """The path in force; None where there is none."""
        ...

    def first_goal_rad(self) -> Floats:
        """(J,) joint goals to begin with."""
        ...

    def lay(self, goal_rad: Floats, dt_s: float, view: BodyView) -> Floats:
        """Add what the ground under the body asks for to goals (J,)."""
        ...

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Go on by ``dt_s`` and return the joint goals (J,)."""
        ...


class SourceGuide:
    """Lets a motion source run by itself: no path, no waypoints."""

    reached = missed = 0
    along_m = float("nan")
    pulse_m_s = 0.0
    decision: Decision | None = None
    path: Path | None = None

    def __init__(self, source: MotionSource) -> None:
        self.source = source

    @property
    def done(self) -> bool:
        """Whether the source is."""
        return self.source.done

    @property
    def at_rest(self) -> bool:
        """Whether the source is done."""
        return self.source.done

    def first_goal_rad(self) -> Floats:
        """(J,) where the source begins."""
        return self.source.goal_rad()

    def lay(self, goal_rad: Floats, dt_s: float, view: BodyView) -> Floats:
        """Nothing is added: a gait lifts its joints by itself."""
        return goal_rad

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Go on by ``dt_s``."""
        return self.source.step(dt_s, view)
