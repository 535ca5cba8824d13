"""A run of a gait along waypoints: path, checks and motion."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from snakewalk.config.errors import InputError
from snakewalk.controller.gaits.gait import Gait
from snakewalk.controller.gaits.registry import make_gait
from snakewalk.controller.motion.source import MotionSource
from snakewalk.controller.run.kinds.gait_run import GaitRun
from snakewalk.controller.run.kinds.walk_run import PathRun
from snakewalk.controller.run.prepared_run import plan_of_path
from snakewalk.controller.runlog.record import PlanSummary
from snakewalk.controller.runtime.drive import OnEvent
from snakewalk.controller.walk.course import Course
from snakewalk.controller.walk.landing import Landing
from snakewalk.controller.walk.steered_gait import CYCLES_PER_BODY, SteeredGait, check_turns


@dataclass(frozen=True)
class SteeredRun(PathRun, GaitRun):
    """A ``PreparedRun`` of a gait steered along a path."""

    @cached_property
    def ashore(self) -> Gait | None:
        """Gait on land of a run that leaves the water."""
        table = self.config.ashore
        return None if table is None else make_gait(table.name, table.parameters)

    def check_plan(self) -> PlanSummary:
        """Check steering and the joints' ranges; plan the path.

        Raises:
            InputError: the gait cannot be steered, or the run has keys of a gait without waypoints.

        """
        if self.ground is not None and not self.robot.limbs:
            raise InputError(
                f"run {self.run.name}: a gait goes along waypoints on flat floors only, unless the "
                "body has legs"
            )
        config = self.config
        if config.then or config.look_heading_rad is not None or config.look_at_m is not None:
            raise InputError(
                f"run {self.run.name}: a gait along waypoints cannot have then, "
                "look_heading_rad or look_at_m; remove them from [gait]"
            )
        try:
            for gait in filter(None, (self.gait, self.ashore)):
                check_turns(gait, self.robot)
        except InputError as error:
            faults = [f"run {self.run.name}: {fault}" for fault in error.faults]
            raise InputError(faults) from None
        return plan_of_path(self.run, self.path)

    def make_source(self, on_event: OnEvent) -> MotionSource:
        """Return a fresh motion."""
        run = self.run
        course = Course(
            self.planner.in_steps,
            run.waypoints_m,
            start_m=np.array(run.start_m),
            radius_m=run.waypoint_radius_m,
            length_m=self.robot.length_m,
            travel_per_body=CYCLES_PER_BODY,
        )
        swim = SteeredGait(self.gait, self.robot, course, run.walk.carrot_m)
        walk = self.ashore
        table = self.config.ashore
        if walk is None or table is None:
            return swim
        return Landing(
            swim,
            lambda cycles: SteeredGait(walk, self.robot, course, run.walk.carrot_m, cycles=cycles),
            self.robot,
            headway=table.headway,
            on_ashore=lambda text: on_event("ashore", text),
        )
