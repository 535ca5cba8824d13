"""Landing: a body swims along its course until it meets the ground, then walks.

Only the measured pose shows the ground: a swimming body hardly advances once its head lies on the
beach. The change of gait has no step (``controller.motion.source_switch``).
"""

from collections.abc import Callable

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.motion.path_progress import Decision
from snakewalk.controller.motion.source_switch import SourceSwitch
from snakewalk.controller.motion.wrapper import MotionWrapper
from snakewalk.controller.walk.course import OnCourse
from snakewalk.controller.walk.steered_gait import SteeredGait


class Landing(MotionWrapper, OnCourse):
    """A ``MotionSource`` with ``PathProgress``: a steered gait in water, and another one ashore."""

    pulse_m_s = 0.0
    decision: Decision | None = None

    def __init__(
        self,
        swim: SteeredGait,
        make_walk: Callable[[float], SteeredGait],
        robot: RobotConfig,
        *,
        headway: float,
        on_ashore: Callable[[str], None],
    ) -> None:
        """Begin to swim.

        ``make_walk`` makes the gait on land, on the same course, from the number of cycles so far.
        The swim ends if a cycle advances less than the share ``headway`` of the best one.
        """
        OnCourse.__init__(self, swim.course)
        self._swim: SteeredGait | None = swim
        self._make_walk = make_walk
        self._headway = headway
        self._on_ashore = on_ashore
        self._switch = SourceSwitch(robot, swim)
        MotionWrapper.__init__(self, self._switch)
        self._before: BodyView | None = None
        """Place of the body when the cycle began."""
        self._cycle = 0
        self._best_m = 0.0

    @property
    def ashore(self) -> bool:
        """Whether the body has met the ground."""
        return self._swim is None

    def begin(self, view: BodyView) -> Floats:
        """(J,) where the gait in the water begins."""
        return self.goal_rad()

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Advance by ``dt_s`` and return the new targets (J,)."""
        goal = self._switch.step(dt_s, view)
        if self._swim is not None and int(self._swim.cycles) > self._cycle:
            self._cycle = int(self._swim.cycles)
            self._end_cycle(self._swim, view)
        return goal

    def _end_cycle(self, swim: SteeredGait, view: BodyView) -> None:
        if self._before is not None:
            way_m = view.advance_since_m(self._before)
            if way_m < self._headway * self._best_m and not self.course.complete:
                self._on_ashore(
                    f"{way_m:.3f} m in a cycle, {self._best_m:.3f} m before: the ground is met"
                )
                self._switch.join(self._make_walk(swim.cycles))
                self._swim = None
            self._best_m = max(self._best_m, way_m)
        self._before = view
