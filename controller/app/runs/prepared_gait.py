"""A gait run as a job: gait, robot and world, and the motion that they make."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

from snakewalk.config.errors import InputError
from snakewalk.config.gait import GaitConfig
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.app.runs.prepared_motion import PreparedMotion
from snakewalk.controller.gaits.gait import Gait
from snakewalk.controller.gaits.registry import make_gait
from snakewalk.controller.motion.cpg_motion import CpgMotion
from snakewalk.controller.motion.gait_cycle import Cycle
from snakewalk.controller.motion.gait_motion import GaitMotion
from snakewalk.controller.motion.gait_sequence import GaitSequence
from snakewalk.controller.motion.head_steering import HeadSteering, Look
from snakewalk.controller.motion.source import MotionSource
from snakewalk.controller.runlog.record import Laid, PlanSummary
from snakewalk.controller.runtime.guide import Guide, SourceGuide

Live = Callable[[GaitMotion, RobotConfig, Callable[[str, str], None]], MotionSource]
"""Puts a live operator between a gait and the servos."""


@dataclass(frozen=True)
class PreparedGait(PreparedMotion):
    """A gait run."""

    live: Live | None = None

    @property
    def config(self) -> GaitConfig:
        """The run's table ``gait``."""
        if self.run.gait is None:
            raise InputError(f"run {self.run.name}: has no table [gait]")
        return self.run.gait

    @cached_property
    def gait(self) -> Gait:
        """With its parameters."""
        return make_gait(self.config.name, self.config.parameters, f"gait {self.config.name}")

    @cached_property
    def later(self) -> list[tuple[float, Gait]]:
        """What it changes to, and when."""
        return [(c.at_s, make_gait(c.name, c.parameters)) for c in self.config.then]

    def laid(self) -> Laid:
        """In the shape that the gait begins with; the first joint angles are held meanwhile."""
        return self._laid_in(Cycle(self.gait, self.robot).goal_rad())

    def judged(self) -> PlanSummary:
        """A gait is checked against the joints' range; its speed is kept within limits live."""
        for gait in (self.gait, *(gait for _, gait in self.later)):
            gait.check(self.robot)
        return self._no_path()

    def motion(self, say: Callable[[str, str], None]) -> MotionSource:
        """Return a fresh motion source: gait, live operator and head steering, as asked."""
        gait = GaitMotion(self.gait, self.robot, duration_s=self.config.duration_s)
        asked_hz = self.gait.params.frequency_hz
        if gait.frequency_hz < asked_hz - 1e-9:
            say("limit", f"{asked_hz:g} Hz is too fast for the joints: {gait.frequency_hz:.2f} Hz")
        source: MotionSource = gait
        if self.live is not None:
            source = self.live(gait, self.robot, say)
        elif self.config.by == "cpg":
            source = CpgMotion(self.robot, Cycle(self.gait, self.robot).goal_rad())
            source.schedule([(0.0, self.gait), *self.later, (self.config.duration_s, None)])
        elif self.later:
            source = GaitSequence(gait, self.later)
        look = Look(self.config.look_heading_rad, self.config.look_at_m)
        if look == Look():
            return source
        return HeadSteering(source, self.robot, look)

    def guide(self, say: Callable[[str, str], None]) -> Guide:
        """Return a fresh guide of the motion."""
        return SourceGuide(self.motion(say))
