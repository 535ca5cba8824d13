"""Landing: a body swims along its course until it meets the ground, and walks on from there.

The measured pose alone shows the ground: a body that swims makes the same way in every cycle, and
hardly any once its head lies on the beach. Legs unfold and the spine changes its wave in one join
without a step (``controller.motion.source_switch``).
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
    """A ``MotionSource`` with ``PathProgress``: one steered gait, and another one ashore."""

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

        Args:
            swim: the gait in the water.
            make_walk: of the cycles so far; the gait on land, on the same course.
            robot: that both move.
            headway: share of the best way of a cycle; a cycle that makes less is the last.
            on_ashore: called with a text when the ground is met.

        """
        OnCourse.__init__(self, swim.course)
        self._swim: SteeredGait | None = swim
        self._make_walk, self._headway, self._on_ashore = make_walk, headway, on_ashore
        self._switch = SourceSwitch(robot, swim)
        MotionWrapper.__init__(self, self._switch)
        self._before: BodyView | None = None
        """Where the body was when the cycle began."""
        self._cycle = 0
        self._best_m = 0.0

    @property
    def ashore(self) -> bool:
        """Whether it has met the ground."""
        return self._swim is None

    def begin(self, view: BodyView) -> Floats:
        """(J,) where the gait in the water begins."""
        return self.goal_rad()

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Go on by ``dt_s`` and return the new targets (J,)."""
        goal = self._switch.step(dt_s, view)
        if self._swim is not None and int(self._swim.cycles) > self._cycle:
            self._cycle = int(self._swim.cycles)
            self._end_cycle(self._swim, view)
        return goal

    def _end_cycle(self, swim: SteeredGait, view: BodyView) -> None:
        """Weigh the way of a whole cycle; walk if it is too short, and waypoints are left."""
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
