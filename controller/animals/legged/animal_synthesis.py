"""The motion of an animal with legs over a world: plan, prototype, transformation ([KP] 4)."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from snakewalk.config.animal import AnimalConfig
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load, locate, shipped
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.animals.legged.motion_transformation import AnimalMotion, transformed
from snakewalk.controller.animals.legged.prototype import LEGS, prototype
from snakewalk.controller.run.kinds.walk_run import WalkRun
from snakewalk.controller.terrain.path import SplinePath

ANIMALS = shipped("animals")
"""Names of the shipped animals with legs."""
CYCLE_FRAMES = 24
"""Least frames of a cycle ([GC] 3)."""


@dataclass(frozen=True, slots=True)
class SynthesisedAnimal:
    """An animal's motion over a world, and how it came about."""

    animal: AnimalConfig
    motion: AnimalMotion
    path: SplinePath
    rate_hz: float
    waypoints_m: Floats
    """(W, 2) waypoints of the animal, m."""
    waypoint_radius_m: float
    ground: HeightField | None

    def reached_s(self) -> list[float]:
        """When the middle of the trunk came within the radius of each waypoint."""
        start = 0
        middle = self.middle_m
        times_s = []
        for point in self.waypoints_m:
            near = np.hypot(*(middle[start:] - point).T) <= self.waypoint_radius_m
            if not near.any():
                break
            start += int(np.argmax(near))
            times_s.append(float(self.motion.time_s[start]))
        return times_s

    @property
    def middle_m(self) -> Floats:
        """(T, 2) of the trunk in plan."""
        return np.asarray(self.motion.hip_m[..., :2].mean(axis=1))

    @property
    def complete(self) -> bool:
        """Whether every waypoint was reached."""
        return len(self.reached_s()) == len(self.waypoints_m)

    @property
    def slip_m(self) -> float:
        """Largest distance that a foot moved while it was on the ground."""
        foot = self.motion.foot_m
        on = self.motion.on_ground
        stays_down = on[1:] & on[:-1]
        return float(np.linalg.norm(np.diff(foot, axis=0), axis=-1)[stays_down].max(initial=0.0))

    @property
    def stance_slip_m(self) -> float:
        """Largest distance between the places where a foot came down and where it left."""
        foot = self.motion.foot_m
        on = self.motion.on_ground
        moved_m = np.linalg.norm(np.diff(foot, axis=0), axis=-1) * (on[1:] & on[:-1])
        total = np.concatenate([np.zeros((1, moved_m.shape[1])), np.cumsum(moved_m, axis=0)])
        begun = np.maximum.accumulate(np.where(on, 0.0, total), axis=0)
        return float((total - begun)[on].max(initial=0.0))

    def facts(self) -> dict[str, object]:
        """Plain numbers, for the table and JSON."""
        animal = self.animal
        motion = self.motion
        spine = motion.spine_m
        stretch = np.linalg.norm(np.diff(spine, axis=1), axis=-1).sum(axis=1) / animal.length_m
        low = spine[..., 2]
        if self.ground is not None:
            low = low - self.ground.elevation_m(spine[..., 0], spine[..., 1])
        return {
            "frames": len(motion.time_s),
            "seconds": round(float(motion.time_s[-1]), 2),
            "waypoints": len(self.waypoints_m),
            "waypoints_reached": len(self.reached_s()),
            "path_m": round(self.path.length_m, 3),
            "cycles": round(float(motion.time_s[-1]) / animal.cycle_s, 1),
            "stride_m": round(animal.stride * animal.length_m, 4),
            "speed_m_s": round(animal.speed_m_s, 4),
            "speed_body_lengths_s": round(animal.stride / animal.cycle_s, 4),
            "steepest_deg": round(float(np.degrees(np.arccos(motion.up[:, 2].min()))), 1),
            "feet": animal.feet,
            "slip_most_m": round(self.slip_m, 9),
            "slip_stance_most_m": round(self.stance_slip_m, 6),
            "leg_short_most_m": round(
                float(np.linalg.norm(motion.end_m - motion.foot_m, axis=-1).max()), 6
            ),
            "spine_stretch_most": round(float(np.abs(stretch - 1.0).max()), 4),
            "axis_over_ground_least_m": round(float(low.min()), 4),
        }

    def save(self, file: Path, name: str) -> None:
        """Write a track of the spine and the legs.

        ``points`` (T, S + 1, 2) and ``height_m`` (T, S + 1) are the spine, head first; ``hip_m``,
        ``knee_m`` and ``foot_m`` (T, 4, 3), in the order of ``legs``; ``on_ground`` (T, 4).
        ``front_joints_m`` and ``hind_joints_m`` (T, 2, J, 3) are all joints of the left and the
        right leg, from the root to the toe.
        """
        motion = self.motion
        np.savez_compressed(
            file,
            points=motion.spine_m[..., :2],
            rate_hz=self.rate_hz,
            length_m=self.animal.length_m,
            name=name,
            source=f"snakewalk animal synthesise of {self.animal.name}: {self.animal.source}",
            licence="made by snakewalk animal synthesise",
            height_m=motion.spine_m[..., 2],
            legs=np.array(LEGS),
            hip_m=motion.hip_m,
            knee_m=motion.knee_m(self.animal),
            foot_m=motion.end_m,
            on_ground=motion.on_ground,
            front_joints_m=np.stack(motion.joints_m[:2], axis=1),
            hind_joints_m=np.stack(motion.joints_m[2:], axis=1),
        )


def read_animal(name: str) -> AnimalConfig:
    """Read a shipped animal, or a file of one's own.

    Raises:
        InputError: no such animal, or a fault in its file.

    """
    if name not in ANIMALS and not name.endswith(".toml"):
        raise InputError(
            f"--animal {name}: no such animal; shipped are {', '.join(ANIMALS)}; "
            "a file of your own ends in .toml"
        )
    file = locate("animals", name)
    animal = load(file, AnimalConfig)
    if animal.skin.endswith(".toml"):
        folder = str(locate("skins", animal.skin, file.parent))
        return animal.model_copy(update={"skin": folder})
    return animal


def synthesise_animal(
    prepared: WalkRun, animal: AnimalConfig, frames: int | None = None
) -> SynthesisedAnimal:
    """Lead an animal along a run's path until its trunk is at the end, or for a number of frames.

    Beyond the path, the motion ends when the head leaves the ground of the world.

    Raises:
        InputError: the path bends more sharply than the animal is wide.

    """
    run = prepared.run
    path = prepared.path
    rate_hz = max(run.synthesis.rate_hz, CYCLE_FRAMES / animal.cycle_s)
    to_end = frames is None
    if frames is None:
        front, hind = (pair.at for pair in animal.leg_pairs)
        way_m = path.length_m + 0.5 * animal.length_m * (front + hind)
        frames = 1 + int(np.ceil(min(way_m / animal.speed_m_s, run.time_limit_s) * rate_hz))
    animal_prototype = prototype(animal, np.arange(frames) / rate_hz)
    motion = transformed(animal_prototype, animal, path, prepared.ground)
    off = np.flatnonzero(~prepared.on_map(motion.spine_m[:, 0, :2]))
    if len(off) and not to_end:
        animal_prototype = prototype(animal, np.arange(max(2, int(off[0]) + 1)) / rate_hz)
        motion = transformed(animal_prototype, animal, path, prepared.ground)
    return SynthesisedAnimal(
        animal,
        motion,
        path,
        rate_hz,
        np.array(run.waypoints_m),
        run.waypoint_radius_m,
        prepared.ground,
    )


def as_long_robot(robot: RobotConfig, length_m: float) -> RobotConfig:
    """Size a robot for a film: the camera and the shade use its length and thickness."""
    link_m = length_m / robot.link_count
    plain = {"joints": (), "links": (), "limbs": (), "body_profile": None}
    thick_m = robot.body_radius_m * length_m / robot.length_m
    return robot.model_copy(update=plain | {"link_length_m": link_m, "body_radius_m": thick_m})
