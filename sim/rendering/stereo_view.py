"""The pictures of a stereo head in a world."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.ndimage import gaussian_filter

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig
from snakewalk.drivers.attitude import about_up
from snakewalk.sim.rendering.looks import TEXELS, Scene, dressed_model
from snakewalk.sim.rendering.offscreen import Offscreen, plain_scene
from snakewalk.sim.rendering.top_view import NOISE

_NEAR_M, _FAR_M = 0.05, 60.0
_GRAIN_TEXELS = (0.7, 3.0, 12.0)
"""Sizes of the spots of the ground (ours): gravel, stones, patches."""
_SOIL = np.array([126.0, 110.0, 88.0])
_CONTRAST = 34.0
"""Standard deviation of the ground's grey levels, of 255 (ours)."""


@dataclass(frozen=True, slots=True)
class CameraFrame:
    """Pose of a camera."""

    at_m: Floats
    """(3,) position of the lens."""
    axes: Floats
    """(3, 3) columns: right, down and forward in the world."""


def tilted(tilt_rad: float, carrier: Floats) -> Floats:
    """(3, 3) axes of a camera (right, down, forward) that looks ahead and down by an angle.

    ``carrier`` (3, 3) has the link's axes as columns: forward, left, up.
    """
    c, s = math.cos(tilt_rad), math.sin(tilt_rad)
    return carrier @ [[0.0, -s, c], [-1.0, 0.0, 0.0], [0.0, -c, -s]]


class StereoView:
    """Draws a hilly world with grain from two cameras; ``close`` it.

    Raises:
        OffscreenError: no off-screen OpenGL.

    """

    def __init__(
        self,
        robot: RobotConfig,
        world: WorldConfig,
        ground: HeightField,
        *,
        size_px: tuple[int, int] = (640, 480),
        focal_px: float = 500.0,
        baseline_m: float = 0.1,
        seed: int = 0,
    ) -> None:
        self._model = model = dressed_model(Scene(robot, world, ground))
        self._data = mujoco.MjData(model)
        self._ground = ground
        self._size = size_px
        self._focal_px = focal_px
        self._baseline_m = baseline_m
        self._random = np.random.default_rng(seed)
        self._paint()
        self._scene = plain_scene(model, model.ngeom + 1)
        self._screen = Offscreen(model, *size_px)

    @property
    def camera_matrix(self) -> Floats:
        """(3, 3) of both cameras, without distortion."""
        wide, tall = self._size
        f = self._focal_px
        return np.array([[f, 0.0, 0.5 * (wide - 1)], [0.0, f, 0.5 * (tall - 1)], [0.0, 0.0, 1.0]])

    def pictures(
        self, at_m: tuple[float, float, float], heading_rad: float, tilt_rad: float
    ) -> tuple[Image, Image]:
        """(H, W, 3) left and right pictures with sensor noise, without the robot.

        ``at_m`` is the left camera; ``heading_rad`` is seen from above, ``tilt_rad`` downwards.
        """
        return self.taken(
            [
                CameraFrame(
                    np.array(at_m),
                    tilted(tilt_rad, about_up(heading_rad)),
                )
            ]
        )

    def taken(
        self, frames: Sequence[CameraFrame], qpos: Floats | None = None
    ) -> tuple[Image, Image]:
        """(H, W, 3) left and right pictures of a left camera that moves during exposure.

        ``frames`` are successive poses; the picture is their mean. ``qpos`` is (7 + J,).
        """
        option = mujoco.MjvOption()
        option.geomgroup[1] = int(qpos is not None)  # the robot's skin
        if qpos is not None:
            self._data.qpos[:] = qpos
        mujoco.mj_forward(self._model, self._data)
        all_categories = mujoco.mjtCatBit.mjCAT_ALL
        view = mujoco.MjvCamera()
        mujoco.mjv_updateScene(
            self._model, self._data, option, None, view, all_categories, self._scene
        )
        taken = []
        for shift_m in (0.0, self._baseline_m):
            drawn = np.zeros((*self._size[::-1], 3))
            for frame in frames:
                self._aim_camera(frame.at_m + shift_m * frame.axes[:, 0], frame.axes)
                drawn += self._screen.draw(self._scene)
            noisy = drawn / len(frames) + self._random.normal(0.0, NOISE, drawn.shape)
            taken.append(np.clip(np.rint(noisy), 0, 255).astype(np.uint8))
        return taken[0], taken[1]

    def close(self) -> None:
        """Free the frame buffer."""
        self._screen.close()

    def _aim_camera(self, at_m: Floats, axes: Floats) -> None:
        wide, tall = self._size
        scale = _NEAR_M / self._focal_px
        for camera in self._scene.camera:
            camera.pos = at_m
            camera.forward = axes[:, 2]
            camera.up = -axes[:, 1]
            camera.frustum_center, camera.frustum_width = 0.0, 0.5 * wide * scale
            camera.frustum_bottom, camera.frustum_top = -0.5 * tall * scale, 0.5 * tall * scale
            camera.frustum_near, camera.frustum_far = _NEAR_M, _FAR_M

    def _paint(self) -> None:
        """Replace the map's colours by a grain."""
        grain = np.zeros((TEXELS, TEXELS))
        for size in _GRAIN_TEXELS:
            noise = gaussian_filter(self._random.normal(size=grain.shape), size, mode="wrap")
            grain += noise / noise.std()
        colour = np.clip(_SOIL + _CONTRAST / grain.std() * grain[..., None], 0, 255)
        texture = self._model.tex("ground")
        start = int(texture.adr[0])
        flat = colour.astype(np.uint8).ravel()
        self._model.tex_data[start : start + flat.size] = flat
