"""Pictures of a moving mesh, such as a person, on level ground, with its shadow."""

from dataclasses import dataclass

import mujoco
import numpy as np

from snakewalk.config.arrays import Floats, Image, Ints
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig
from snakewalk.sim.rendering.looks import Scene, SkinLook, dressed_model
from snakewalk.sim.rendering.offscreen import Offscreen, plain_scene
from snakewalk.sim.rendering.shade import SoftShade, add_sheet, surface_points_m


@dataclass(frozen=True, slots=True)
class OrbitCamera:
    """A camera that looks at a point; a negative elevation is below the horizon."""

    lookat_m: tuple[float, float, float]
    distance_m: float
    azimuth_deg: float
    elevation_deg: float


class FigureView:
    """Draws a mesh with given corners; ``close`` it.

    Raises:
        OffscreenError: no off-screen OpenGL.

    """

    def __init__(
        self, look: SkinLook, robot: RobotConfig, world: WorldConfig, size_px: tuple[int, int]
    ) -> None:
        """Prepare the view.

        ``look`` gives faces and texture and replaces the robot; its free bones are not used.
        ``world`` is level ground.
        """
        self._model = dressed_model(
            Scene(robot, world, None), look=look, fine=True, additions=(add_sheet,)
        )
        self._shade = SoftShade(self._model, None)
        self._data = mujoco.MjData(self._model)
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        self._faces = look.faces
        room = self._model.ngeom + self._model.nbody + 11
        self._scene = plain_scene(self._model, room)
        self._camera, self._option = mujoco.MjvCamera(), mujoco.MjvOption()
        self._screen = Offscreen(self._model, *size_px)

    def draw(self, corners_m: Floats, camera: OrbitCamera, caption: str = "") -> Image:
        """Draw the mesh with corners (V, 3), (height, width, 3); a new array each time."""
        model = self._model
        view = self._camera
        scene = self._scene
        view.lookat[:] = camera.lookat_m
        view.distance = camera.distance_m
        view.azimuth = camera.azimuth_deg
        view.elevation = camera.elevation_deg
        every = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(model, self._data, self._option, None, view, every, scene)
        count = len(corners_m)  # the mesh is the first skin
        scene.skinvert.reshape(-1, 3)[:count] = corners_m
        scene.skinnormal.reshape(-1, 3)[:count] = _normals(corners_m, self._faces)
        self._shade.lay(scene, surface_points_m(corners_m, self._faces))
        self._screen.reload(model, self._shade.texture)
        return self._screen.draw(scene, caption).copy()

    def close(self) -> None:
        """Free the frame buffer; safe to call twice."""
        self._screen.close()


def _normals(corners_m: Floats, faces: Ints) -> Floats:
    """(V, 3) area-weighted means of the normals of adjacent faces."""
    a, b, c = (corners_m[faces[:, k]] for k in range(3))
    face = np.cross(b - a, c - a)
    total = np.zeros_like(corners_m)
    for axis in range(3):
        for k in range(3):
            total[:, axis] += np.bincount(faces[:, k], face[:, axis], len(corners_m))
    return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300))
