"""The bones of a spine over time: segments of a recorded skeleton, links of a robot, or a wave."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.gaits.spine import SpineGait, offset
from snakewalk.controller.gaits.wave import TURN
from snakewalk.controller.track.resample import SEGMENTS, equal_arc_length
from snakewalk.controller.track.track import Track

CYCLE_FRAMES = 24
"""Frames of a cycle ([GC] 3)."""


@dataclass(frozen=True, slots=True)
class BoneMotion:
    """K bones in T frames, head first."""

    time_s: Floats
    """(T,) increasing, from 0."""
    front_m: Floats
    """(T, K, 3) the head's end of each bone."""
    rotation: Floats
    """(T, K, 3, 3) columns: forward (towards the head), left, up."""
    bone_m: Floats
    """(K,) lengths at rest."""
    pose: Mapping[str, str] = field(default_factory=dict)
    """Kind, source and uncertainty of a robot's poses; empty of an animal."""

    @property
    def length_m(self) -> float:
        """Length of the body at rest."""
        return float(self.bone_m.sum())


def thinned_points(track: Track) -> Floats:
    """(T, P, 2) midlines; those of more than 101 points resampled to 100 equal arcs."""
    points = track.points
    if points.shape[1] > SEGMENTS + 1:
        points = np.stack([equal_arc_length(body) for body in points])
    return points


def from_points(points_m: Floats, time_s: Floats) -> BoneMotion:
    """Bones between points (T, K + 1, 3); a bone's left side is level.

    Raises:
        InputError: a bone has no length, or is vertical.

    """
    step = points_m[:, :-1] - points_m[:, 1:]
    length = np.linalg.norm(step, axis=-1)
    if not length.all():
        frame, bone = np.argwhere(length == 0.0)[0]
        raise InputError(f"frame {frame}: points {bone} and {bone + 1} of the spine are the same")
    forward = step / length[..., None]
    left = np.stack([-forward[..., 1], forward[..., 0], np.zeros_like(length)], axis=-1)
    level = np.linalg.norm(left, axis=-1, keepdims=True)
    if level.min() < 1e-9:
        raise InputError("a spine that stands upright has no left side")
    left /= level
    rotation = np.stack([forward, left, np.cross(forward, left)], axis=-1)
    return BoneMotion(time_s - time_s[0], points_m[:, :-1], rotation, np.median(length, axis=0))


def swimming(gait: SpineGait, length_m: float) -> BoneMotion:
    """One cycle of a spine gait; the last frame repeats the first.

    [GC] ends its cycle at t = 1 s whatever omega is, so the body would jump. Here a cycle lasts 1 /
    omega. The spine keeps its length: it is divided into equal arcs.

    Raises:
        InputError: the frequency is 0.

    """
    p = gait.params
    if p.frequency_hz <= 0.0:
        raise InputError(f"{gait.name}: a cycle needs a frequency above 0")
    u = np.linspace(0.0, TURN, 4 * SEGMENTS + 1)
    side = offset(u, TURN * np.arange(CYCLE_FRAMES + 1) / CYCLE_FRAMES, p) * (
        -1.0 if p.mirror else 1.0
    )
    points = np.empty((CYCLE_FRAMES + 1, SEGMENTS + 1, 3))
    for k, wave in enumerate(side):
        even = equal_arc_length(np.stack([-u, wave], axis=1))
        even *= length_m / np.hypot(*np.diff(even, axis=0).T).sum()
        flat = np.zeros(SEGMENTS + 1)
        x, y = even.T
        points[k] = np.stack([x, flat, y] if gait.vertical else [x, y, flat], axis=1)
    return from_points(points, np.arange(CYCLE_FRAMES + 1) / CYCLE_FRAMES / p.frequency_hz)
