"""The view of a pair of cameras over a world: what a stereo head takes of its ground."""

import math

import mujoco
import numpy as np
from scipy.ndimage import gaussian_filter

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig
from snakewalk.sim.rendering.looks import TEXELS, dressed_model
from snakewalk.sim.rendering.offscreen import Offscreen
from snakewalk.sim.rendering.top_view import NOISE

_NEAR_M, _FAR_M = 0.05, 60.0
_GRAIN_TEXELS = (0.7, 3.0, 12.0)
"""Sizes of the spots of the ground (ours): gravel, stones, patches."""
_SOIL = np.array([126.0, 110.0, 88.0])
_CONTRAST = 34.0
"""Standard deviation of the ground's grey levels, of 255 (ours)."""


class StereoView:
    """Draws a hilly world, with grain on it and without the robot, from two places; ``close`` it.

    Raises:
        OffscreenError: nothing here draws without a screen.

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
        self._model = model = dressed_model(robot, world, ground)
        self._data = mujoco.MjData(model)
        self._ground, self._size = ground, size_px
        self._focal_px, self._baseline_m = focal_px, baseline_m
        self._random = np.random.default_rng(seed)
        self._paint()
        self._scene = mujoco.MjvScene(model, maxgeom=model.ngeom + 1)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = 0
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
        self._screen = Offscreen(model, *size_px)

    @property
    def camera_matrix(self) -> Floats:
        """(3, 3) of both cameras, which have no distortion."""
        wide, tall = self._size
        f = self._focal_px
        return np.array([[f, 0.0, 0.5 * (wide - 1)], [0.0, f, 0.5 * (tall - 1)], [0.0, 0.0, 1.0]])

    def pictures(
        self, at_m: tuple[float, float, float], heading_rad: float, tilt_rad: float
    ) -> tuple[Image, Image]:
        """(H, W, 3) left and right pictures, with the sensors' noise.

        Args:
            at_m: of the left camera.
            heading_rad: where it looks, seen from above.
            tilt_rad: of its axis, downwards.

        """
        option = mujoco.MjvOption()
        option.geomgroup[1] = 0  # the robot's skin
        mujoco.mj_forward(self._model, self._data)
        everything = mujoco.mjtCatBit.mjCAT_ALL
        view = mujoco.MjvCamera()
        mujoco.mjv_updateScene(self._model, self._data, option, None, view, everything, self._scene)
        c, s = math.cos(heading_rad), math.sin(heading_rad)
        right = np.array([s, -c, 0.0])
        taken = []
        for shift_m in (0.0, self._baseline_m):
            self._look(np.array(at_m) + shift_m * right, np.array([c, s, 0.0]), tilt_rad)
            drawn = self._screen.draw(self._scene)
            noisy = drawn + self._random.normal(0.0, NOISE, drawn.shape)
            taken.append(np.clip(np.rint(noisy), 0, 255).astype(np.uint8))
        return taken[0], taken[1]

    def close(self) -> None:
        """Free the frame buffer."""
        self._screen.close()

    def _look(self, at_m: Floats, ahead: Floats, tilt_rad: float) -> None:
        up = np.array([0.0, 0.0, 1.0])
        wide, tall = self._size
        scale = _NEAR_M / self._focal_px
        for camera in self._scene.camera:
            camera.pos = at_m
            camera.forward = math.cos(tilt_rad) * ahead - math.sin(tilt_rad) * up
            camera.up = math.sin(tilt_rad) * ahead + math.cos(tilt_rad) * up
            camera.frustum_center, camera.frustum_width = 0.0, 0.5 * wide * scale
            camera.frustum_bottom, camera.frustum_top = -0.5 * tall * scale, 0.5 * tall * scale
            camera.frustum_near, camera.frustum_far = _NEAR_M, _FAR_M

    def _paint(self) -> None:
        """Give the ground a grain in place of its map's colours."""
        grain = np.zeros((TEXELS, TEXELS))
        for size in _GRAIN_TEXELS:
            noise = gaussian_filter(self._random.normal(size=grain.shape), size, mode="wrap")
            grain += noise / noise.std()
        colour = np.clip(_SOIL + _CONTRAST / grain.std() * grain[..., None], 0, 255)
        texture = self._model.tex("ground")
        start = int(texture.adr[0])
        flat = colour.astype(np.uint8).ravel()
        self._model.tex_data[start : start + flat.size] = flat
