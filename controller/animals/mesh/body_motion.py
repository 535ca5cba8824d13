"""Motion of a skin: a recording, the log of a run, or a spine gait in place."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from snakewalk.config.archive import read_arrays
from snakewalk.config.arrays import Floats, Ints
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import Water
from snakewalk.controller.animals.fish.postures import holds_postures, load_postures
from snakewalk.controller.animals.mesh.skin import Skin
from snakewalk.controller.console.result_files import LOG
from snakewalk.controller.gaits.registry import GAITS, SPINE_GAITS
from snakewalk.controller.gaits.spine import SpineGait
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.report.film import body_qpos
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.track.bone_motion import (
    BoneMotion,
    from_points,
    swimming,
    thinned_points,
)
from snakewalk.controller.track.readers.load import load_track
from snakewalk.drivers.types import BodyPose

LOG_FPS = 25.0
"""Frames a second that are used of a log."""


def animated(skin: Skin, source: str, fps: float | None) -> tuple[Skin, BoneMotion]:
    """Size a skin to the body that moves, and stand it on the ground.

    Args:
        skin: at rest.
        source: a gait of ``SPINE_GAITS``; a log (``.mcap``, ``.mcap.part``, or a run's folder); or
            what ``load_track`` reads.
        fps: frames a second; None uses all frames of a recording and 25 of a log.

    Raises:
        InputError: the source cannot be used, or holds fewer than two frames.

    """
    if fps is not None and not 0.1 <= fps <= 1000.0:
        raise InputError(f"fps: frames a second must be from 0.1 to 1000, not {fps:g}")
    if source in GAITS:
        gait = GAITS[source]
        if not issubclass(gait, SpineGait):
            raise InputError(
                f"{source}: moves a robot, not a spine; spines: {', '.join(SPINE_GAITS)}"
            )
        if fps is not None:
            raise InputError(f"{source}: a cycle has 24 frames; fps is for recordings and logs")
        return skin, swimming(gait(), skin.length_m)
    path = Path(source)
    log = path / LOG if path.is_dir() else path
    if log.name.endswith((".mcap", ".mcap.part")):
        return _robot_skin(skin, read_log(log), LOG_FPS if fps is None else fps, source)
    time_s, points = _in_space(skin, source)
    if len(time_s) < 2:
        raise InputError(f"{source}: has one frame; a motion needs two")
    rows = np.arange(len(time_s)) if fps is None else _thinned_frames(time_s, fps)
    motion = from_points(points[rows], time_s[rows])
    return skin.sized(motion.length_m), motion


def _in_space(skin: Skin, source: str) -> tuple[Floats, Floats]:
    """Times (T,) and spines (T, P, 3) of a recording.

    A fish is where it swam, with its lowest place on the ground. A track of ``animal synthesise``
    has its own heights. All others lie level on the ground.
    """
    path = Path(source)
    if holds_postures(path):
        fish = load_postures(path)
        points = fish.points_in_space()
        is_visible = np.isfinite(points).all(axis=(1, 2))
        points = points[is_visible]
        time_s = np.flatnonzero(is_visible) / fish.rate_hz
        points[..., 2] += _belly_m(skin, fish.length) - points[..., 2].min(initial=0.0)
        return time_s, points
    track = load_track(source)
    flat = thinned_points(track)
    if not track.places_recorded:
        flat = flat - flat.mean(axis=1, keepdims=True)  # the images were cropped: no travel
    belly_m = _belly_m(skin, 1.0 if track.length_m is None else track.length_m)
    height_m = np.full(flat.shape[:2], belly_m)
    arrays = read_arrays(path, {"height_m"})[0] if path.suffix == ".npz" else {}
    if "height_m" in arrays and arrays["height_m"].shape == height_m.shape:
        height_m = np.asarray(arrays["height_m"], float)
    return track.time_s, np.concatenate([flat, height_m[..., None]], axis=-1)


def _belly_m(skin: Skin, length_m: float) -> float:
    sized = skin.sized(length_m)
    return sized.axis_m - float(sized.mesh.vertices[:, 2].min())


def _robot_skin(skin: Skin, record: RunRecord, fps: float, source: str) -> tuple[Skin, BoneMotion]:
    time_s, qpos = body_qpos(record)
    if len(time_s) < 2:
        raise InputError(f"{source}: the log has fewer than two poses; choose a longer log")
    rows = _thinned_frames(time_s, fps)
    robot = record.header.robot
    in_water = isinstance(record.header.world.ground, Water)
    motion = from_poses(robot, time_s[rows], qpos[rows])
    motion = replace(motion, pose=record.header.pose_evidence.texts)
    return robot_skin(skin, robot, in_water), motion


def robot_skin(skin: Skin, robot: RobotConfig, in_water: bool = False) -> Skin:
    """Size a skin to a robot; on land its lowest place is where the robot's belly is."""
    sized = skin.sized(robot.length_m)
    if in_water:
        return sized
    low = float(sized.mesh.vertices[:, 2].min())
    return replace(sized, axis_m=low + robot.body_radius_m)


def from_poses(robot: RobotConfig, time_s: Floats, qpos: Floats) -> BoneMotion:
    """Bones that are the robot's links; ``qpos`` (T, 7 + J) as ``MujocoPlant.qpos``."""
    links = robot.link_count
    bone_m = np.array(robot.link_lengths_m)
    half = 0.5 * bone_m[:, None]
    turns = Rotation.from_quat(qpos[:, 3:7], scalar_first=True).as_matrix()
    front = np.empty((len(qpos), links, 3))
    rotation = np.empty((len(qpos), links, 3, 3))
    for k, row in enumerate(qpos):
        body = body_in_world(robot, BodyPose(float(time_s[k]), row[:3], turns[k]), row[7:])
        front[k], rotation[k] = body.link_m + half * body.forward, body.rotation
    return BoneMotion(time_s - time_s[0], front, rotation, bone_m)


def _thinned_frames(time_s: Floats, fps: float) -> Ints:
    even = np.arange(time_s[0], time_s[-1] + 0.5 / fps, 1.0 / fps)
    middle = 0.5 * (time_s[1:] + time_s[:-1])
    return np.unique(np.searchsorted(middle, even)).astype(np.int64)
