"""A walk over unknown ground, on a map that grows as the snake moves.

The map replaces the ground in path, predictions, and pitch. Unknown places use the map's filled-in
heights, and no path leads over them.
"""

from collections.abc import Callable

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.motion.path_progress import Decision
from snakewalk.controller.motion.wrapper import MotionWrapper
from snakewalk.controller.terrain.growing_map import GrowingMap
from snakewalk.controller.terrain.map_planner import MapPlanner
from snakewalk.controller.walk.course import OnCourse
from snakewalk.controller.walk.pilot import Pilot


class MapWalk(MotionWrapper, OnCourse):
    """A ``MotionSource`` with ``PathProgress``: a pilot on a map that changes."""

    def __init__(
        self,
        pilot: Pilot,
        ground_map: GrowingMap,
        planner: MapPlanner,
        *,
        change_ground: Callable[[HeightField], None],
        replan_m: float,
    ) -> None:
        """Begin with the current map, to which the caller adds pictures.

        ``planner`` is the course's. ``change_ground`` sets the ground of predictions and pitch. A
        path that ends before a waypoint is planned again after ``replan_m`` of travel.
        """
        OnCourse.__init__(self, pilot.course)
        MotionWrapper.__init__(self, pilot)
        self._pilot = pilot
        self._map = ground_map
        self._planner = planner
        self._change_ground = change_ground
        self._replan_m = replan_m
        self._pictures = ground_map.pictures
        self._planned_m = 0.0
        self._travel_m = 0.0

    @property
    def pulse_m_s(self) -> float:
        """Speed of the shape along the body."""
        return self._pilot.pulse_m_s

    @property
    def decision(self) -> Decision | None:
        """Decision of the last step, or None."""
        return self._pilot.decision

    def begin(self, view: BodyView) -> Floats:
        """(J,) where the walk begins."""
        return self._pilot.begin(view)

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Advance by ``dt_s`` and return the new targets (J,)."""
        goal_rad = self._pilot.step(dt_s, view)
        self._travel_m += self._pilot.pulse_m_s * dt_s
        if self.course.replanned is not None:
            self._planned_m = self._travel_m
        if self._map.pictures > self._pictures and not self.course.complete:
            self._pictures = self._map.pictures
            ground = self._map.height_field()
            if ground is not None:
                self._change_ground(ground)
                self._planner.update(ground)
                self._renew(view)
        return goal_rad

    def _renew(self, view: BodyView) -> None:
        """Plan again if the path is now known to be unsafe, or can lead farther."""
        course = self.course
        ahead_m = course.path.piece_m(course.head_along_m, course.path.length_m)
        if not self._planner.clear(ahead_m):
            why = "the path ahead is seen to be unsafe"
        elif not course.leads_on and self._travel_m >= self._planned_m + self._replan_m:
            why = "more of the ground is known"
        else:
            return
        course.renew(why, self._planner.clear, lambda: view.heading_rad)
        if course.replanned is not None:
            self._planned_m = self._travel_m
