"""From a recording to a job that plays it in time on a robot."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from config.errors import InputError
from config.ground import build_ground
from config.heightfield import HeightField
from config.loader import checked, load_robot, load_world
from config.playback import PlaybackConfig
from config.robot import RobotConfig
from config.run import RunConfig
from config.world import WorldConfig
from controller.capture.load import load_track
from controller.capture.slowing import CUT_CYCLES
from controller.capture.wave import measure_wave
from controller.motion.recorded import Recorded
from controller.motion.retarget import Retarget
from controller.runtime.forecast import mean_heading_rad
from controller.runtime.guide import Guide, SourceGuide
from drivers.budget import wire_budget
from drivers.telemetry.record import Laid, PlanSummary

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class PreparedPlayback:
    """A recording to be played: everything that is known before a servo moves."""

    run: RunConfig
    robot: RobotConfig
    world: WorldConfig
    gain: float = field(default=float("nan"), init=False)

    @cached_property
    def ground(self) -> HeightField | None:
        """The world's height field; None on a flat floor."""
        return build_ground(self.world)

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

    @property
    def start_heading_rad(self) -> float:
        """Mean heading of the body at the start."""
        return self.run.start_heading_rad or 0.0

    def laid(self) -> Laid:
        """In the first shape of the recording."""
        joints = self.motion[1][0]
        return Laid(self.start_heading_rad - mean_heading_rad(self.robot, joints), joints)

    def judged(self) -> PlanSummary:
        """Range, speed and acceleration of every joint over the whole recording."""
        self._fresh(self.speed)
        start = np.array([self.run.start_m, self.run.start_m], dtype=float)
        return PlanSummary(start, np.zeros((0, 2)), self.run.waypoint_radius_m)

    def guide(self, say: Callable[[str, str], None]) -> Guide:
        """Return a fresh guide of the motion."""
        if self.speed < 1.0:
            say("limit", f"played at {self.speed:.2f} times the animal's speed")
        return SourceGuide(self._fresh(self.speed))

    def _fresh(self, speed: float) -> Recorded:
        time_s, joints = self.motion
        return Recorded(self.robot, time_s / speed, joints)


def recorded_joints(track: str, robot: RobotConfig) -> tuple[Floats, Floats]:
    """Read times (T,) and joint angles (T, J): of the file itself, or of its midlines.

    Midlines shake from frame to frame; their joints are smoothed, well above the wave's frequency.

    Raises:
        InputError: no such recording, or made for another robot.

    """
    made = _made_joints(track, robot)
    if made is not None:
        return made
    recording = load_track(track)
    if recording.frames < 2:
        raise InputError(f"{track}: one frame is no motion")
    joints = Retarget(robot).joints_rad(recording.angles_rad)
    known_s = recording.time_s - recording.time_s[0]
    time_s = np.arange(0.0, known_s[-1] + 0.5 / recording.rate_hz, 1.0 / recording.rate_hz)
    even = np.stack([np.interp(time_s, known_s, column) for column in joints.T], axis=1)
    wave_hz = measure_wave(recording).frequency_hz
    if wave_hz > 0.0:
        width = recording.rate_hz / (2.0 * np.pi * CUT_CYCLES * wave_hz)
        even = gaussian_filter1d(even, width, axis=0, mode="nearest")
    return time_s, even


def _made_joints(track: str, robot: RobotConfig) -> tuple[Floats, Floats] | None:
    """Joint angles that a synthesis wrote beside its midlines; None where there are none."""
    if Path(track).suffix != ".npz" or not Path(track).is_file():
        return None
    try:
        with np.load(track, allow_pickle=False) as data:
            if "joints_rad" not in data or "rate_hz" not in data or "robot" not in data:
                return None
            joints = np.asarray(data["joints_rad"], dtype=float)
            rate_hz, name = float(data["rate_hz"]), str(data["robot"])
    except (BadZipFile, ValueError, OSError):
        return None  # load_track says what is wrong with it
    if name != robot.name or joints.ndim != 2 or len(joints) < 2:
        return None
    return np.arange(len(joints)) / rate_hz, joints


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
