"""From a recording to a job that plays it in time on a robot."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.loader import checked, load_robot, load_world
from snakewalk.config.playback import PlaybackConfig
from snakewalk.config.run import RunConfig
from snakewalk.controller.app.recordings.recorded_joints import recorded_joints
from snakewalk.controller.app.runs.prepared_motion import PreparedMotion
from snakewalk.controller.motion.recorded import Recorded
from snakewalk.controller.runlog.record import Laid, PlanSummary
from snakewalk.controller.runtime.guide import Guide, SourceGuide
from snakewalk.drivers.bus.budget import wire_budget


@dataclass(frozen=True)
class PreparedPlayback(PreparedMotion):
    """A recording to be played."""

    @cached_property
    def motion(self) -> tuple[Floats, Floats]:
        """Times (T,) in the animal's own time from 0 on, and joint angles (T, J)."""
        return recorded_joints(self.run.track, self.robot)

    @property
    def speed(self) -> float:
        """Times the animal's own speed at which it will be played."""
        wanted = (self.run.playback or PlaybackConfig()).speed
        most = 1.0 / Recorded(self.robot, *self.motion).slowed
        if wanted is not None and wanted > most > 0.0 and self._fresh(wanted).slowed > 1.0:
            raise InputError(
                f"--speed {wanted:g}: the joints of {self.robot.name} follow {self.run.track} at "
                "a lower speed only; auto is as fast as they can, at most the animal's own"
            )
        return most if wanted is None else wanted

    @property
    def duration_s(self) -> float:
        """Of the playing."""
        return float(self.motion[0][-1]) / self.speed

    def laid(self) -> Laid:
        """In the first shape of the recording."""
        return self._laid_in(self.motion[1][0])

    def judged(self) -> PlanSummary:
        """Range, speed and acceleration of every joint over the whole recording."""
        self._fresh(self.speed)
        return self._no_path()

    def guide(self, say: Callable[[str, str], None]) -> Guide:
        """Return a fresh guide of the motion."""
        if self.speed < 1.0:
            say("limit", f"played at {self.speed:.2f} times the animal's speed")
        return SourceGuide(self._fresh(self.speed))

    def _fresh(self, speed: float) -> Recorded:
        time_s, joints = self.motion
        return Recorded(self.robot, time_s / speed, joints)


def prepare_playback(
    track: str, *, robot: str | None = None, world: str | None = None, speed: float | None = None
) -> PreparedPlayback:
    """Prepare to play a recording.

    Raises:
        InputError: no such recording, joints that do not bend so far, too fast for them.

    """
    body = load_robot(robot or "yaw16")
    given = {
        "name": Path(track).stem,
        "robot": body.name,
        "world": world or "flat",
        "track": track,
        "motion": "playback",
        "playback": {"speed": speed},
    }
    run = checked(RunConfig, given, "command line")
    wire_budget(body.joint_count, body.servo.baud, fast=True, slow_read_bytes=7).check(run.cycle_hz)
    prepared = PreparedPlayback(run, body, load_world(run.world))
    Recorded(body, *prepared.motion).needs.check(body, "this recording")
    limit = {"time_limit_s": prepared.duration_s + 30.0}
    return PreparedPlayback(run.model_copy(update=limit), body, prepared.world)
