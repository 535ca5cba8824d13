"""A run that plays a recording in time on a robot."""

import zlib
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from snakewalk.config.archive import read_head
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.playback import JointRequest, PlaybackConfig
from snakewalk.config.reading import Facts, stored, with_stored
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WaterGround
from snakewalk.controller.console.plugins import plugins
from snakewalk.controller.mechanics.thrust import forward_speed_m_s
from snakewalk.controller.motion.joint_motion import JointMotion, JointReader, onto_robot
from snakewalk.controller.motion.parted_recording import PartedRecording, gaps, recording
from snakewalk.controller.motion.recorded import Recorded
from snakewalk.controller.motion.source import MotionSource
from snakewalk.controller.run.prepared_run import PathlessRun, plan_without_path, pose_with
from snakewalk.controller.runlog.record import InitialPose, PlanSummary
from snakewalk.controller.runtime.drive import OnEvent
from snakewalk.controller.track.readers.generated import EMBEDDED
from snakewalk.controller.track.recorded_joints import recorded_joints

_HEAD_BYTES = 4096


def foreign_joints(track: str, robot: RobotConfig, asked: JointRequest) -> JointMotion | None:
    """Motion of the joints of a robot; None for midlines.

    Raises:
        InputError: a fault of the file, or it needs a choice.

    """
    path = Path(track)
    reader = _reader(path, asked)
    if reader is None:
        names = ("joints", "unit", "topic", "episode", "columns")
        given = [name for name in names if getattr(asked, name) not in (None, {})]
        if given and (path.exists() or track in EMBEDDED):
            option = "--joint" if given[0] == "joints" else f"--{given[0]}"
            raise InputError(f"{option}: {track} has no joint angles with names; leave it out")
        return None
    request, lines = with_stored(path, asked)
    motion = onto_robot(reader.read(path, request), robot, request.joints, track)
    return replace(motion, notes=(*lines, *motion.notes))


def _reader(path: Path, asked: JointRequest) -> JointReader | None:
    if not path.exists():
        return None
    head = read_head(path, _HEAD_BYTES) if path.is_file() else b""
    columns = asked.columns or stored(path).get("columns")
    if columns:
        head = ",".join([*columns, "joint"]).encode()
    for plugin in plugins("joints"):
        reader: JointReader = plugin.load()()
        if reader.accepts(path, head):
            return reader
    return None


_LINEAR = 0.9  # of the limit: angles up to it are played as they are
_NO_THRUST_1_S = 0.02
"""Predicted speed, body lengths per second, below which a motion has no thrust (ours): shipped
recordings of crawling animals have 0.1 and more."""
_MOST_OF_RANGE = 0.995  # of the limit: the spline between frames goes a little beyond them


def clip_softly(joints: Floats, limit_rad: Floats) -> Floats:
    """Joint angles (T, J) within their limits (J,), without a corner.

    Up to 0.9 of the limit they are unchanged. A corner would need any acceleration, and slow the
    complete recording.
    """
    start = _LINEAR * limit_rad
    room = (_MOST_OF_RANGE - _LINEAR) * limit_rad
    size = np.abs(joints)
    soft = start + room * np.tanh(np.maximum(size - start, 0.0) / room)
    return np.sign(joints) * np.where(size > start, soft, size)


@dataclass(frozen=True)
class PlaybackRun(PathlessRun):
    """A ``PreparedRun`` of a recording."""

    @cached_property
    def joint_track(self) -> tuple[Floats, Floats]:
        """Times (T,) in the animal's time from 0, and joint angles (T, J) to play."""
        time_s, joints = self._recorded_angles
        if self._asked_playback.clip:
            joints = clip_softly(joints, np.array(self.robot.limit_rad))
        return time_s, joints

    @cached_property
    def _recorded_angles(self) -> tuple[Floats, Floats]:
        if self._foreign is not None:
            time_s, joints = self._foreign.time_s, self._foreign.joint_rad
        else:
            time_s, joints = recorded_joints(
                self.run.track, self.robot, self._asked_playback.time_unit
            )
        return time_s, self._asked_playback.scale * joints

    @cached_property
    def _foreign(self) -> JointMotion | None:
        return foreign_joints(self.run.track, self.robot, self._asked_playback.request)

    @property
    def facts(self) -> Facts:
        """Facts about the file of joint angles; none of midlines, which are examined by `track`."""
        return {} if self._foreign is None else self._foreign.facts

    @property
    def notes(self) -> tuple[str, ...]:
        """Lines about the mapping of joints, and about omitted or changed parts."""
        lines = () if self._foreign is None else self._foreign.notes
        time_s = self.joint_track[0]
        cuts = gaps(time_s)
        if not len(cuts):
            return lines
        longest_s = float((time_s[cuts] - time_s[cuts - 1]).max())
        return (
            *lines,
            f"the joints come to rest at each of {len(cuts)} gaps, of up to {longest_s:.3g} s, "
            "and move evenly from the row before to the row after",
        )

    def check_for_port(self) -> None:
        """Ask for the user's consent to a new mapping of joints before it moves servos.

        Raises:
            InputError: the question, with a drawing of the body and a table.

        """
        motion = self._foreign
        if motion is None:
            return
        labels = [self.robot.joint_label(k) for k in range(self.robot.joint_count)]
        pairs = list(zip(labels, motion.names, strict=True))
        code = f"{zlib.crc32(repr(pairs).encode()):08x}"
        request, _ = with_stored(Path(self.run.track), self._asked_playback.request)
        if request.mapping == code:
            return
        body = "".join(f"={k}=" for k in range(1, len(pairs) + 1))
        range_deg = np.degrees([motion.joint_rad.min(axis=0), motion.joint_rad.max(axis=0)]).T
        raise InputError(
            [
                f"{self.run.track}: check which joint of the file moves which servo:",
                f"head <{body}> tail",
                *(
                    f"{k}: {label}: {name}, {low:.0f}° to {high:.0f}°"
                    for k, ((label, name), (low, high)) in enumerate(
                        zip(pairs, range_deg.tolist(), strict=True), start=1
                    )
                ),
                f"add --mapping {code} --remember if this is right, --joint ROBOT=FILE if not",
            ]
        )

    @property
    def _asked_playback(self) -> PlaybackConfig:
        return self.run.playback or PlaybackConfig()

    @property
    def speed(self) -> float:
        """Speed of the playback over the animal's own."""
        asked = self._asked_playback.speed
        most = 1.0 / self._loaded_recording(1.0).slowed
        if asked is not None and asked > most > 0.0 and self._loaded_recording(asked).slowed > 1.0:
            raise InputError(
                f"--speed {asked:g}: the joints of {self.robot.name} follow {self.run.track} up to "
                f"{most:.3f} times the animal's own speed; leave --speed out, or make the motion "
                "smaller by --scale"
            )
        return most if asked is None else asked

    @property
    def clipped(self) -> str | None:
        """Words about clipping; None if nothing was clipped."""
        past = np.abs(self._recorded_angles[1]) - np.array(self.robot.limit_rad)
        if not (past > 0.0).any():
            return None
        frame, joint = (int(k) for k in np.unravel_index(np.argmax(past), past.shape))
        return (
            f"joints clipped to their limits in {int((past > 0.0).any(axis=1).sum())} of "
            f"{len(past)} frames, most by {past.max():.2f} rad: {self.robot.joint_label(joint)} in "
            f"frame {frame}"
        )

    @cached_property
    def no_thrust(self) -> str | None:
        """Warning that the motion does not move this robot at the recorded speed."""
        time_s, joints = self.joint_track
        if isinstance(self.world.ground, WaterGround) or not np.ptp(joints, axis=0).any():
            return None
        speed_m_s = forward_speed_m_s(self.robot, self.world.friction, time_s, joints)
        if abs(speed_m_s) >= _NO_THRUST_1_S * self.robot.length_m:
            return None
        return (
            f"{self.run.track}: the traction model predicts {1e3 * speed_m_s:.0f} mm/s on this "
            "ground, so the motion produces no thrust; play one whose waves run down the body"
        )

    @property
    def duration_s(self) -> float:
        """Duration of the playback."""
        return self._loaded_recording(self.speed).duration_s

    def initial_pose(self) -> InitialPose:
        """Return the first shape of the recording."""
        return pose_with(self.robot, self.start_heading_rad, self.joint_track[1][0])

    def check_plan(self) -> PlanSummary:
        """Check range, speed and acceleration of every joint."""
        self._loaded_recording(self.speed)
        return plan_without_path(self.run)

    def make_source(self, on_event: OnEvent) -> MotionSource:
        """Return a fresh motion that plays the recording."""
        if self._asked_playback.scale != 1.0:
            on_event("limit", f"joint angles scaled by {self._asked_playback.scale:g}")
        clipped_text = self.clipped
        if clipped_text is not None:
            on_event("limit", clipped_text)
        for line in self.notes:
            on_event("recording", line)
        if self.no_thrust is not None:
            on_event("thrust", self.no_thrust)
        if self.speed < 1.0:
            on_event("limit", f"played at {self.speed:.2f} times the animal's speed")
        return self._loaded_recording(self.speed)

    def _loaded_recording(self, speed: float) -> Recorded | PartedRecording:
        return recording(self.robot, *self.joint_track, speed)
