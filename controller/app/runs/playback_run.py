"""A run that plays a recording in time on a robot."""

from dataclasses import dataclass
from functools import cached_property

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.playback import PlaybackConfig
from snakewalk.controller.app.recordings.recorded_joints import recorded_joints
from snakewalk.controller.app.runs.prepared_run import PathlessRun, plan_without_path, pose_with
from snakewalk.controller.motion.recorded import Recorded
from snakewalk.controller.motion.source import MotionSource
from snakewalk.controller.runlog.record import InitialPose, PlanSummary
from snakewalk.controller.runtime.drive import OnEvent


@dataclass(frozen=True)
class PlaybackRun(PathlessRun):
    """A ``PreparedRun`` of a recording."""

    @cached_property
    def joint_track(self) -> tuple[Floats, Floats]:
        """Times (T,) in the animal's own time from 0 on, and joint angles (T, J)."""
        return recorded_joints(self.run.track, self.robot)

    @property
    def speed(self) -> float:
        """Speed of the playback over the animal's own."""
        asked = (self.run.playback or PlaybackConfig()).speed
        most = 1.0 / Recorded(self.robot, *self.joint_track).slowed
        if asked is not None and asked > most > 0.0 and self._recorded(asked).slowed > 1.0:
            raise InputError(
                f"--speed {asked:g}: the joints of {self.robot.name} follow {self.run.track} up to "
                f"{most:.3f} times the animal's own speed"
            )
        return most if asked is None else asked

    @property
    def duration_s(self) -> float:
        """Duration of the playback."""
        return self._recorded(self.speed).duration_s

    def initial_pose(self) -> InitialPose:
        """Return the first shape of the recording."""
        return pose_with(self.robot, self.start_heading_rad, self.joint_track[1][0])

    def check_plan(self) -> PlanSummary:
        """Check range, speed and acceleration of every joint over the whole recording."""
        self._recorded(self.speed)
        return plan_without_path(self.run)

    def make_source(self, on_event: OnEvent) -> MotionSource:
        """Return a fresh motion that plays the recording."""
        if self.speed < 1.0:
            on_event("limit", f"played at {self.speed:.2f} times the animal's speed")
        return self._recorded(self.speed)

    def _recorded(self, speed: float) -> Recorded:
        time_s, joints = self.joint_track
        return Recorded(self.robot, time_s / speed, joints)
