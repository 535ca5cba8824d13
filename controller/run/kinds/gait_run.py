"""A run of a gait: checks, changes of gait, live operator and head steering."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

from snakewalk.config.errors import InputError
from snakewalk.config.gait import GaitConfig
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.gaits.gait import Gait
from snakewalk.controller.gaits.registry import make_gait
from snakewalk.controller.motion.gait_cycle import GaitCycle
from snakewalk.controller.motion.gait_motion import GaitMotion, GaitSequence
from snakewalk.controller.motion.head_steering import HeadSteering, HeadTarget
from snakewalk.controller.motion.source import MotionSource
from snakewalk.controller.run.prepared_run import PathlessRun, plan_without_path, pose_with
from snakewalk.controller.runlog.record import InitialPose, PlanSummary
from snakewalk.controller.runtime.drive import OnEvent

_LEAST_GRIP = 1.2
"""Least friction across over along (ours): an undulation goes backward at 1, slowly forward at
1.25."""
MakeOperator = Callable[[GaitMotion, RobotConfig, OnEvent], MotionSource]
"""Puts a live operator between a gait and the servos."""


@dataclass(frozen=True)
class GaitRun(PathlessRun):
    """A ``PreparedRun`` of a gait."""

    make_operator: MakeOperator | None = None

    @property
    def config(self) -> GaitConfig:
        """The run's table ``gait``."""
        if self.run.gait is None:
            raise InputError(f"run {self.run.name}: has no table [gait]")
        return self.run.gait

    @cached_property
    def gait(self) -> Gait:
        """The gait to begin with."""
        return make_gait(self.config.name, self.config.parameters, f"gait {self.config.name}")

    @cached_property
    def changes(self) -> list[tuple[float, Gait]]:
        """Times and gaits of the changes."""
        return [(c.at_s, make_gait(c.name, c.parameters)) for c in self.config.then]

    def initial_pose(self) -> InitialPose:
        """Return the gait's first shape; its first joint angles are held meanwhile."""
        first_rad = GaitCycle(self.gait, self.robot).goal_rad()
        return pose_with(self.robot, self.start_heading_rad, first_rad)

    def check_plan(self) -> PlanSummary:
        """Check the gaits against the joints' ranges; the run limits their speed."""
        for gait in (self.gait, *(gait for _, gait in self.changes)):
            gait.check(self.robot)
        return plan_without_path(self.run)

    def remark(self) -> str | None:
        """Return a warning if a gait may go backward on this ground."""
        if self.world.ground.kind == "water":
            return None
        friction = self.world.friction
        for gait in (self.gait, *(gait for _, gait in self.changes)):
            backward = getattr(gait.params, "backward", False)
            along = friction.backward if backward else friction.along
            if gait.needs.wheels and friction.across < _LEAST_GRIP * along:
                return (
                    f"world {self.world.name}: friction is {friction.across:g} across the body and "
                    f"{along:g} along it; gait {gait.name} needs more across, and may go the other "
                    "way; use another --world or another gait"
                )
        return None

    def make_source(self, on_event: OnEvent) -> MotionSource:
        """Return a fresh motion: gait, operator and head steering."""
        gait = GaitMotion(
            self.gait,
            self.robot,
            duration_s=self.config.duration_s,
            on_limit=partial(on_event, "limit"),
        )
        source: MotionSource = gait
        if self.make_operator is not None:
            source = self.make_operator(gait, self.robot, on_event)
        elif self.config.by == "cpg":
            from snakewalk.controller.motion.cpg_motion import CpgMotion  # noqa: PLC0415  compiled: slow to import

            source = CpgMotion(self.robot, GaitCycle(self.gait, self.robot).goal_rad())
            source.schedule([(0.0, self.gait), *self.changes, (self.config.duration_s, None)])
        elif self.changes:
            source = GaitSequence(gait, self.changes)
        target = HeadTarget(self.config.look_heading_rad, self.config.look_at_m)
        if target == HeadTarget():
            return source
        return HeadSteering(source, self.robot, target)
