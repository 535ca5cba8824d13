"""Many bodies on one ground as a film: tubes with detail by distance, and shadows."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import mujoco

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig
from snakewalk.sim.rendering.crowd_mesh import CrowdMeshes
from snakewalk.sim.rendering.ground_tiles import GroundTiles
from snakewalk.sim.rendering.looks import Scene, dressed_model
from snakewalk.sim.rendering.movie_file import MovieFile
from snakewalk.sim.rendering.offscreen import Offscreen, plain_scene
from snakewalk.sim.rendering.view_frustum import ViewFrustum

FOVY_DEG = 45.0


@dataclass(frozen=True, slots=True)
class BodyChain:
    """One body in one frame."""

    points_m: Floats
    """(n, 3) points of the body's axis, head first, m."""
    radius_m: Floats
    """(n,) radii of the body at its points."""
    kind: int
    """Number of the body's colours."""
    level: int
    """Level of detail from 0, the farthest."""


@dataclass(frozen=True, slots=True)
class CrowdShot:
    """One frame: an orbiting camera, and the bodies in view."""

    lookat_m: Floats
    """(3,) point that the camera looks at, m."""
    distance_m: float
    azimuth_deg: float
    elevation_deg: float
    bodies: list[BodyChain]
    caption: str


class CrowdView:
    """Draws crowds on a world; ``close`` it.

    Raises:
        OffscreenError: no off-screen OpenGL.

    """

    def __init__(
        self,
        robot: RobotConfig,
        world: WorldConfig,
        ground: HeightField,
        bodies: int,
        size_px: tuple[int, int],
        *,
        tiled: bool = True,
    ) -> None:
        """Prepare a model.

        ``tiled``: the ground has detail by distance; else it is drawn in full.
        """
        self._meshes = CrowdMeshes(bodies)
        self._ground = ground
        self._size_px = size_px
        self._tiles = GroundTiles(ground) if tiled else None
        more = () if self._tiles is None else (self._tiles.add_to,)
        self._model = model = dressed_model(
            Scene(robot, world, ground), additions=(self._meshes.add_to, *more)
        )
        model.vis.global_.fovy = FOVY_DEG
        self._data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, self._data)
        mujoco.mj_camlight(model, self._data)
        self._scene = plain_scene(model, model.ngeom + model.nskin)
        self._camera, self._option = mujoco.MjvCamera(), mujoco.MjvOption()
        self._option.skingroup[:] = 0  # the meshes add those in use
        self._screen = Offscreen(model, *size_px)

    def draw(self, shot: CrowdShot) -> Image:
        """Draw a frame (height, width, 3), valid until the next one."""
        camera = self._camera
        scene = self._scene
        camera.lookat[:] = shot.lookat_m
        camera.distance = shot.distance_m
        camera.azimuth = shot.azimuth_deg
        camera.elevation = shot.elevation_deg
        if self._tiles is not None:
            view = ViewFrustum.orbit(
                shot.lookat_m,
                shot.distance_m,
                shot.azimuth_deg,
                shot.elevation_deg,
                fovy_deg=FOVY_DEG,
                size_px=self._size_px,
            )
            self._tiles.choose(self._model, view)
        mujoco.mjv_updateScene(
            self._model,
            self._data,
            self._option,
            None,
            camera,
            mujoco.mjtCatBit.mjCAT_STATIC,
            scene,
        )
        bodies = [(body.kind, body.level, body.points_m, body.radius_m) for body in shot.bodies]
        self._meshes.lay(self._model, scene, bodies, self._ground)
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
    on_frame: Callable[[int], None],
) -> int:
    """Write shots as an MP4; return their number."""
    done = 0
    with MovieFile(path, fps, size_px) as film:
        for shot in shots:
            film.add(view.draw(shot))
            done += 1
            on_frame(done)
    return done
