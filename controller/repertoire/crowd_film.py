"""Film of a crowd on a ground: motion of the bodies, view of the camera, and its cost."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from snakewalk.config.arrays import Bools, Floats, Ints
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.mechanics.ground_step import GroundStep
from snakewalk.controller.repertoire.behaviour import Wandering
from snakewalk.controller.repertoire.crowd import Crowd
from snakewalk.controller.repertoire.habit import Habit
from snakewalk.controller.repertoire.repertoire import Repertoire
from snakewalk.controller.repertoire.species import Species
from snakewalk.sim.rendering.crowd_film import BodyChain, CrowdShot, CrowdView, render_crowd
from snakewalk.sim.rendering.view_frustum import ViewFrustum

HIDDEN, FAR, MIDDLE, NEAR = range(4)
"""Levels: body frame alone, three segments, every second link, all links on the ground."""
NEAR_PX = 110.0
MIDDLE_PX = 45.0
"""Least apparent length of a body at these levels (ours)."""


def detail_levels(view: ViewFrustum, centre_m: Floats, length_m: Floats) -> Ints:
    """(N,) level of bodies with centres (N, 3) and lengths (N,).

    A single point is checked, with the frustum wider by half a body ([YT] 6): no body of which a
    part is in view is left out.
    """
    depth, across, up = view.in_camera(centre_m)
    focal_px = 0.5 * view.height_px / view.half_tan[1]
    size_px = focal_px * length_m / np.maximum(np.hypot(depth, np.hypot(across, up)), 1e-6)
    level = FAR + (size_px >= MIDDLE_PX).astype(int) + (size_px >= NEAR_PX)
    return np.where(view.touches(centre_m, 0.5 * length_m), level, HIDDEN)


class DetailedCrowd:
    """Lays the bodies of a crowd on a ground, each at its level."""

    def __init__(self, ground: HeightField, radius_m: Floats, swims: Bools) -> None:
        """``radius_m`` (N, L): half the recorded bodies' heights; ``swims`` (N,): not laid down."""
        self._ground = ground
        self._radius_m = radius_m
        self._swims = swims
        self._step = GroundStep(ground)
        last = radius_m.shape[1] - 1
        self._kept = {
            FAR: np.linspace(0, last, 4).round().astype(int),
            MIDDLE: np.arange(0, last + 1, 2),
        }

    def chains(self, crowd: Crowd, levels: Ints) -> list[BodyChain]:
        """Return the bodies that are not hidden, each with its number as its colour.

        Near ones stand on the ground by the half circle of [PT] 2.6.5, which keeps their lengths;
        of others each point is lifted onto the ground.
        """
        detailed_chains = []
        for body in np.flatnonzero(levels > HIDDEN).tolist():
            level = int(levels[body])
            points = links = crowd.link_m(body)
            radius = crowd.scale[body] * self._radius_m[body]
            if level == NEAR and not self._swims[body]:
                chord = links[:-1, :2] - links[1:, :2]
                r = float(np.hypot(*chord.T).mean())
                angles = np.arctan2(chord[:, 1], chord[:, 0])
                points = self._step.place(angles, links[-1, :2], r, radius).points_m
            elif level != NEAR:
                kept = self._kept[level]
                points = links[kept]
                radius = radius[kept]
                if not self._swims[body]:
                    points[:, 2] = self._ground.elevation_m(points[:, 0], points[:, 1]) + radius
            detailed_chains.append(BodyChain(points, radius, body, level - FAR))
        return detailed_chains


FPS = 20
SIZE_PX = (960, 540)
_SPREAD = 0.3
"""Largest difference of a size from the mean, as a share of it (ours)."""
FLIGHT_S = 40.0
"""Time in which the camera circles the field."""


@dataclass
class CrowdCosts:
    """CPU time and levels of detail, summed over frames."""

    frames: int = 0
    motion_s: float = 0.0
    """Behaviour, actions, body frames and links of those in view."""
    laying_s: float = 0.0
    """Culling, and bodies onto the ground."""
    levels: Ints = field(default_factory=lambda: np.zeros(4, dtype=np.int64))
    """(4,) body-frames hidden, far, middle, near."""


FOOD_KIND = 4
"""Number of the colours of food."""
_FOOD_M = np.array([[x, 0.0, 0.015] for x in (0.03, 0.01, -0.01, -0.03)])
"""(4, 3) points of a piece of food about its place; their height is its radius (ours)."""


def species_of(
    repertoire: Repertoire, robot: RobotConfig, bodies: int, size: float, habit: Habit, seed: int
) -> Species:
    """Return bodies of random sizes about a mean, with the radii of a robot, thinner behind."""
    links = repertoire.segments[0].link_m.shape[1]
    along = np.arange(links) / (links - 1)
    thin = 0.85 + 0.15 * np.sin(np.pi * np.minimum(along / 0.5, 1.0) / 2)
    thin *= 1.0 - 0.7 * np.maximum(0.0, (along - 0.55) / 0.45) ** 1.5
    radius_m = thin * np.array(robot.radii_m(2 * links + 1))[1::2]
    sizes = np.random.default_rng(seed).uniform(1.0 - _SPREAD, 1.0 + _SPREAD, bodies)
    return Species(repertoire, size * sizes, radius_m, habit)


class CrowdScene:
    """A crowd on a ground before a camera that flies around."""

    def __init__(self, wandering: Wandering, ground: HeightField, *, detail: bool = True) -> None:
        """``detail``: with culling and levels; else every body is drawn in full."""
        self._ground = ground
        self._detail = detail
        self._chains = DetailedCrowd(ground, wandering.radius_m, wandering.swims)
        self._wandering = wandering
        self.costs = CrowdCosts()

    def shots(self, frames: int, steps: int) -> Iterator[CrowdShot]:
        """Yield ``frames`` shots, ``steps`` frames of the repertoire apart."""
        wandering = self._wandering
        costs = self.costs
        crowd = wandering.crowd
        is_mixed = wandering.species[-1] > 0  # then a colour is that of a species
        for k in range(frames):
            begun = time.process_time()
            lookat, distance, azimuth, elevation = self._camera(k / FPS)
            frustum = ViewFrustum.orbit(
                lookat, distance, azimuth, elevation, fovy_deg=45.0, size_px=SIZE_PX
            )
            levels = np.full(len(crowd.scale), NEAR)
            if self._detail:
                centre = crowd.origin_m.copy()
                centre[:, 2] = np.maximum(centre[:, 2], self._ground.elevation_m(*centre[:, :2].T))
                levels = detail_levels(frustum, centre, wandering.length_m)
            if wandering.separated is None:
                crowd.visible[:] = levels > HIDDEN
            culled = time.process_time()
            wandering.step(steps)
            moved = time.process_time()
            chains = self._chains.chains(crowd, levels)
            if is_mixed:
                chains = [replace(of, kind=int(wandering.species[of.kind])) for of in chains]
            costs.frames += 1
            costs.motion_s += moved - culled
            costs.laying_s += time.process_time() - moved + culled - begun
            costs.levels += np.bincount(levels, minlength=4)
            near = int((levels == NEAR).sum())
            food = [
                BodyChain(place + _FOOD_M, np.full(len(_FOOD_M), _FOOD_M[0, 2]), FOOD_KIND, 0)
                for place in self._food_m()
            ]
            yield CrowdShot(
                lookat,
                distance,
                azimuth,
                elevation,
                chains + food,
                f"{len(chains)} of {len(levels)} bodies in view, {near} near",
            )

    def _food_m(self) -> Floats:
        """(F, 3) places of the food, which lies on the ground or floats in the water."""
        food_m = self._wandering.food_m.copy()
        food_m[:, 2] = np.maximum(food_m[:, 2], self._ground.elevation_m(*food_m[:, :2].T))
        return food_m

    def _camera(self, time_s: float) -> tuple[Floats, float, float, float]:
        """Where the camera looks, from how far, and its two angles in degrees."""
        turn = 2.0 * np.pi * time_s / FLIGHT_S
        wide = 0.5 * min(self._ground.size_m)
        place_m = self._ground.middle_m + 0.3 * wide * np.array([np.cos(turn), np.sin(turn)])
        lookat = np.array([*place_m, float(self._ground.elevation_m(*place_m))])
        distance = wide * (0.42 + 0.14 * np.cos(1.7 * turn))
        return lookat, distance, float(np.degrees(turn)) + 55.0, -26.0


def film_crowd(
    scene: CrowdScene,
    view: CrowdView,
    path: Path,
    *,
    seconds: float,
    frame_s: float,
    on_frame: Callable[[int], None] = lambda done: None,
) -> int:
    """Draw the film into ``path`` (.mp4) and close the view; returns the number of frames."""
    try:
        shots = scene.shots(round(seconds * FPS), round(1.0 / (FPS * frame_s)))
        return render_crowd(view, shots, path, fps=FPS, size_px=SIZE_PX, on_frame=on_frame)
    finally:
        view.close()
