"""Many bodies on one ground as a film: chains of capsules, as detailed as each is near."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import mujoco
import numpy as np

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig
from snakewalk.sim.rendering.looks import EYE, Rgba, dressed_model
from snakewalk.sim.rendering.movie_file import MovieFile
from snakewalk.sim.rendering.offscreen import Offscreen

FOVY_DEG: Final = 45.0
MOST: Final = 24
"""Geoms of a body."""
COLOURS: Final[tuple[tuple[Rgba, Rgba], ...]] = (
    ((0.80, 0.56, 0.20, 1), (0.36, 0.22, 0.11, 1)),
    ((0.42, 0.55, 0.24, 1), (0.20, 0.27, 0.12, 1)),
    ((0.62, 0.30, 0.22, 1), (0.28, 0.13, 0.10, 1)),
    ((0.45, 0.50, 0.56, 1), (0.20, 0.22, 0.26, 1)),
    ((0.86, 0.76, 0.48, 1), (0.55, 0.40, 0.18, 1)),
)
"""Back and bands of five kinds of animals (ours)."""


@dataclass(frozen=True, slots=True)
class BodyChain:
    """One body in one frame."""

    points_m: Floats
    """(n, 3) head first."""
    radius_m: Floats
    """(n,) there."""
    kind: int
    """Number of its colours."""
    near: bool
    """Whether it is near enough for details."""


@dataclass(frozen=True, slots=True)
class CrowdShot:
    """One frame: a camera that looks at a point from a distance, and the bodies in view."""

    lookat_m: Floats
    """(3,)"""
    distance_m: float
    azimuth_deg: float
    elevation_deg: float
    bodies: list[BodyChain]
    caption: str


class CrowdView:
    """Draws crowds on a world; ``close`` it.

    Raises:
        OffscreenError: nothing here draws without a screen.

    """

    def __init__(
        self,
        robot: RobotConfig,
        world: WorldConfig,
        ground: HeightField,
        bodies: int,
        size_px: tuple[int, int],
    ) -> None:
        self._model = model = dressed_model(robot, world, ground)
        model.vis.global_.fovy = FOVY_DEG
        self._data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, self._data)
        mujoco.mj_camlight(model, self._data)
        self._scene = mujoco.MjvScene(model, maxgeom=model.ngeom + MOST * bodies + 1)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = 0
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
        self._camera, self._option = mujoco.MjvCamera(), mujoco.MjvOption()
        self._screen = Offscreen(model, *size_px)

    def draw(self, shot: CrowdShot) -> Image:
        """Draw a frame (height, width, 3), valid until the next one."""
        camera, scene = self._camera, self._scene
        camera.lookat[:], camera.distance = shot.lookat_m, shot.distance_m
        camera.azimuth, camera.elevation = shot.azimuth_deg, shot.elevation_deg
        mujoco.mjv_updateScene(
            self._model, self._data, self._option, None, camera, mujoco.mjtCatBit.mjCAT_STATIC,
            scene,
        )  # fmt: skip
        for body in shot.bodies:
            _add_chain(scene, body)
        return self._screen.draw(scene, shot.caption)

    def close(self) -> None:
        """Free the frame buffer."""
        self._screen.close()


def render_crowd(
    view: CrowdView,
    shots: Iterable[CrowdShot],
    path: Path,
    *,
    fps: int,
    size_px: tuple[int, int],
    on_frame: Callable[[int], None] = lambda done: None,
) -> int:
    """Write shots as an MP4; returns their number."""
    done = 0
    with MovieFile(path, fps, size_px) as film:
        for shot in shots:
            film.add(view.draw(shot))
            done += 1
            on_frame(done)
    return done


def _add_chain(scene: mujoco.MjvScene, body: BodyChain) -> None:
    """Append a body's geoms to a scene with enough free geoms."""
    back, band = COLOURS[body.kind % len(COLOURS)]
    points, none = body.points_m, np.zeros(3)
    for k, radius in enumerate(0.5 * (body.radius_m[:-1] + body.radius_m[1:])):
        _init(scene, mujoco.mjtGeom.mjGEOM_CAPSULE, none, none, band if k % 4 == 3 else back)
        mujoco.mjv_connector(
            scene.geoms[scene.ngeom - 1], mujoco.mjtGeom.mjGEOM_CAPSULE, radius, points[k],
            points[k + 1],
        )  # fmt: skip
    if not body.near:
        return
    ahead = points[0] - points[1]
    ahead /= np.linalg.norm(ahead)
    side = np.array([-ahead[1], ahead[0], 0.0])
    radius = float(body.radius_m[0])
    for sign in (-1.0, 1.0):
        at = points[0] + radius * (0.55 * ahead + 0.6 * sign * side + [0.0, 0.0, 0.45])
        _init(scene, mujoco.mjtGeom.mjGEOM_SPHERE, np.full(3, 0.3 * radius), at, EYE)


def _init(
    scene: mujoco.MjvScene, kind: mujoco.mjtGeom, size: Floats, at_m: Floats, rgba: Rgba
) -> None:
    scene.ngeom += 1
    mujoco.mjv_initGeom(scene.geoms[scene.ngeom - 1], kind, size, at_m, np.eye(3).ravel(), rgba)
