"""The facts of ``snakewalk animal track``: its content, and the share that a robot can do."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.reading import texts
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import StatesConfig
from snakewalk.controller.kinematics.retarget import Retarget
from snakewalk.controller.shape.states import energy_kept, to_angles, to_states
from snakewalk.controller.track.choice import ALL, Choice
from snakewalk.controller.track.readers.load import load_track
from snakewalk.controller.track.slowing import joint_demand, slowing
from snakewalk.controller.track.track import UNSURE_HEAD, Track
from snakewalk.controller.track.wave import measure_wave
from snakewalk.controller.walk.shape_filters import shape_filters
from snakewalk.sim.servo.motor import known_motors


@dataclass(frozen=True, slots=True)
class ExaminedRecording:
    """A recording and its facts."""

    track: Track
    facts: dict[str, Any]
    """Figures of the recording for one robot on one ground, rounded, by the names of the output."""


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
    facts = {
        "recording": name_or_path,
        "source": track.source,
        "licence": track.licence,
        "frames": track.frames,
        "frames_left_out": track.dropped,
        "frames_missing": track.absent,
        "frames_bridged": track.bridged,
        "head_and_tail_swapped": track.flips,
        "rate_hz": round(track.rate_hz, 3),
        "rate_assumed": track.rate_assumed,
        "times_uneven": track.uneven,
        "length_mm": None if track.length_m is None else round(1e3 * track.length_m, 1),
        "waves_on_body": None if wave.unknown_reason else round(wave.waves, 2),
        "wave_hz": None if wave.unknown_reason else round(wave.frequency_hz, 2),
        "wave_share": round(wave.share, 2),
        "time_towards_head": None if wave.unknown_reason else round(wave.headward, 2),
        "wave_not_told": wave.unknown_reason,
        "bend_k_rad": round(float(np.median(track.bend_rad)), 2),
        "bend_k_most_rad": round(float(track.bend_rad.max()), 2),
        "energy_kept": round(float(energy_kept(track.angles_rad).mean()), 4),
        "robot": robot.name,
        "states_kept": len(kept),
        "states_refused": refused,
        "places_recorded": track.places_recorded,
        "head_sure": None if track.head_sure is None else round(track.head_sure, 3),
        "every_nth_frame": track.every,
        "facts": texts(track.facts),
        "warning": _warning(track, wave.headward if wave.unknown_reason is None else 0.0),
        "notes": track.notes,
    }
    return ExaminedRecording(track, facts | _pace(track, shapes, wave.frequency_hz, robot))


def _warning(track: Track, headward: float) -> str | None:
    """Doubt about head and tail; None without a doubt."""
    if track.flips:
        return f"head and tail change places {track.flips} times"
    if track.head_sure is not None and track.head_sure < UNSURE_HEAD:
        return (
            f"head and tail may be exchanged (sure by {track.head_sure:.2f}); capture the film "
            "again with --head X,Y, or correct it on the page of capture --review"
        )
    if headward > 0.5:
        return "the wave runs towards the head: an animal going backwards, or tail first"
    return None


def _pace(track: Track, shapes: Floats, wave_hz: float, robot: RobotConfig) -> dict[str, Any]:
    joints = Retarget(robot).joints_rad(shapes)
    demand = joint_demand(joints, track.time_s, track.rate_hz, wave_hz)
    slow = slowing(demand, robot.joint_speed_limit_rad_s, robot.joint_acceleration_limit_rad_s2)
    fastest = float(demand.speed_rad_s.max())
    no_load = [motor.no_load_rad_s for motor in known_motors(robot) if motor is not None]
    return {
        "joint_speed_rad_s": round(fastest, 2),
        "joint_speed_95_rad_s": round(float(np.percentile(demand.speed_rad_s, 95.0)), 2),
        "joint_speed_unsmoothed_rad_s": round(demand.raw_speed_rad_s, 2),
        "joint_acceleration_rad_s2": round(float(demand.acceleration_rad_s2.max(initial=0.0)), 1),
        "joint_speed_limit_rad_s": robot.joint_speed_limit_rad_s,
        "times_no_load_speed": round(fastest / min(no_load), 2) if no_load else None,
        "slowed_by": round(slow.throughout, 2),
        "slowed_by_for_speed": round(slow.by_speed, 2),
        "slowed_by_for_acceleration": round(slow.by_acceleration, 2),
        "longer_if_slowed_where_needed": round(slow.where_needed, 2),
    }
