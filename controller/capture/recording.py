"""The facts of ``snakewalk animal track``: its content, and the share that a robot can do."""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import StatesConfig
from snakewalk.controller.kinematics.retarget import Retarget
from snakewalk.controller.shape.states import energy_kept, to_angles, to_states
from snakewalk.controller.track.choice import ALL, Choice
from snakewalk.controller.track.readers.load import load_track
from snakewalk.controller.track.slowing import joint_demand, slowing
from snakewalk.controller.track.track import Track
from snakewalk.controller.track.wave import measure_wave
from snakewalk.controller.walk.shape_filters import shape_filters
from snakewalk.sim.servo.motor import known_motors


@dataclass(frozen=True, slots=True)
class PaceFacts:
    """Joint speed at the animal's pace, and slowing that a robot needs."""

    joint_speed_rad_s: float
    joint_speed_95_rad_s: float
    joint_speed_unsmoothed_rad_s: float
    joint_acceleration_rad_s2: float
    joint_speed_limit_rad_s: float
    times_no_load_speed: float | None
    """Largest speed of a joint over the no-load speed; None if the servo's motor is unknown."""
    slowed_by: float
    slowed_by_for_speed: float
    slowed_by_for_acceleration: float
    longer_if_slowed_where_needed: float


@dataclass(frozen=True, slots=True)
class RecordingFacts:
    """A recording measured for one robot on one ground, rounded."""

    recording: str
    source: str
    licence: str
    frames: int
    frames_left_out: int
    frames_missing: int
    """Frames between the first and the last without a row in the file."""
    frames_bridged: int
    """Frames with a missing keypoint set on the curve through the others."""
    head_and_tail_swapped: int
    rate_hz: float
    rate_assumed: bool
    times_uneven: bool
    """Whether the frames came at uneven times; ``rate_hz`` is then that of interpolated bodies."""
    length_mm: float | None
    waves_on_body: float | None
    wave_hz: float | None
    wave_share: float
    time_towards_head: float | None
    wave_not_told: str | None
    """Why the wave's figures are None; the joints' smoothing still uses the strongest pattern."""
    bend_k_rad: float
    bend_k_most_rad: float
    energy_kept: float
    robot: str
    states_kept: int
    states_refused: dict[str, int]
    """Rejected shapes by their first reason."""
    places_recorded: bool
    """False where the images were cropped to the animal and contain no travel."""
    head_sure: float | None
    """Certainty that the first point is the head, 0 to 1; None if the file does not contain it."""
    pace: PaceFacts
    every_nth_frame: int = 1
    """Camera frames from one row of the file to the next."""
    notes: tuple[str, ...] = ()
    """Lines about parts that the reader left out or changed."""

    def to_dict(self) -> dict[str, object]:
        """Return all facts for JSON, those of the pace included."""
        values = {name: getattr(self, name) for name in RecordingFacts.__slots__ if name != "pace"}
        return values | {name: getattr(self.pace, name) for name in PaceFacts.__slots__}


@dataclass(frozen=True, slots=True)
class ExaminedRecording:
    """A recording and its facts."""

    track: Track
    facts: RecordingFacts


def examine(
    name_or_path: str,
    robot_name: str = "yaw16",
    world_name: str = "flat",
    choice: Choice = ALL,
) -> ExaminedRecording:
    """Load a recording and measure it for a robot on a ground.

    Raises:
        InputError: recording, robot or world cannot be used.

    """
    robot = load_robot(robot_name)
    friction = load_world(world_name).friction
    track = load_track(name_or_path, choice=choice)
    states = StatesConfig()
    wave = measure_wave(track)
    shapes = to_angles(to_states(track.angles_rad))
    refused: dict[str, int] = {}
    kept = shapes
    for reason, refuse in shape_filters(robot, friction, states).items():
        bad = refuse(kept)
        refused[reason] = int(bad.sum())
        kept = kept[~bad]
    facts = RecordingFacts(
        recording=name_or_path,
        source=track.source,
        licence=track.licence,
        frames=track.frames,
        frames_left_out=track.dropped,
        frames_missing=track.absent,
        frames_bridged=track.bridged,
        head_and_tail_swapped=track.flips,
        rate_hz=round(track.rate_hz, 3),
        rate_assumed=track.rate_assumed,
        times_uneven=track.uneven,
        length_mm=None if track.length_m is None else round(1e3 * track.length_m, 1),
        waves_on_body=None if wave.unknown_reason else round(wave.waves, 2),
        wave_hz=None if wave.unknown_reason else round(wave.frequency_hz, 2),
        wave_share=round(wave.share, 2),
        time_towards_head=None if wave.unknown_reason else round(wave.headward, 2),
        wave_not_told=wave.unknown_reason,
        bend_k_rad=round(float(np.median(track.bend_rad)), 2),
        bend_k_most_rad=round(float(track.bend_rad.max()), 2),
        energy_kept=round(float(energy_kept(track.angles_rad).mean()), 4),
        robot=robot.name,
        states_kept=len(kept),
        states_refused=refused,
        places_recorded=track.places_recorded,
        head_sure=None if track.head_sure is None else round(track.head_sure, 3),
        pace=_pace(track, shapes, wave.frequency_hz, robot),
        every_nth_frame=track.every,
        notes=track.notes,
    )
    return ExaminedRecording(track, facts)


def _pace(track: Track, shapes: Floats, wave_hz: float, robot: RobotConfig) -> PaceFacts:
    joints = Retarget(robot).joints_rad(shapes)
    demand = joint_demand(joints, track.time_s, track.rate_hz, wave_hz)
    slow = slowing(demand, robot.joint_speed_limit_rad_s, robot.joint_acceleration_limit_rad_s2)
    fastest = float(demand.speed_rad_s.max())
    no_load = [motor.no_load_rad_s for motor in known_motors(robot) if motor is not None]
    return PaceFacts(
        joint_speed_rad_s=round(fastest, 2),
        joint_speed_95_rad_s=round(float(np.percentile(demand.speed_rad_s, 95.0)), 2),
        joint_speed_unsmoothed_rad_s=round(demand.raw_speed_rad_s, 2),
        joint_acceleration_rad_s2=round(float(demand.acceleration_rad_s2.max(initial=0.0)), 1),
        joint_speed_limit_rad_s=robot.joint_speed_limit_rad_s,
        times_no_load_speed=round(fastest / min(no_load), 2) if no_load else None,
        slowed_by=round(slow.throughout, 2),
        slowed_by_for_speed=round(slow.by_speed, 2),
        slowed_by_for_acceleration=round(slow.by_acceleration, 2),
        longer_if_slowed_where_needed=round(slow.where_needed, 2),
    )
