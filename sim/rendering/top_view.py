"""The picture of a camera above the simulated robot."""

import math
from collections.abc import Sequence

import mujoco
import numpy as np

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.camera import CameraConfig
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig
from snakewalk.sim.rendering.looks import FloorPrint, Scene, dressed_model
from snakewalk.sim.rendering.offscreen import Offscreen, plain_scene
from snakewalk.sim.rendering.shade import add_shade

NOISE = 3.0
"""Standard deviation of the sensor's noise, of 255."""
_FIELDS = 8
_SLACK = 128  # number of noise fields, and their excess size in pixels


class TopView:
    """Draws ``MujocoPlant.qpos`` from above; ``close`` it.

    The ground is drawn once, then only the part around the robot. The seed determines the noise.

    Raises:
        OffscreenError: neither OSMesa nor EGL works.

    """

    def __init__(
        self,
        robot: RobotConfig,
        world: WorldConfig,
        camera: CameraConfig,
        centre_m: tuple[float, float],
        seed: int = 0,
        prints: Sequence[FloorPrint] = (),
        ground: HeightField | None = None,
    ) -> None:
        self._robot = robot
        self._ground = ground
        self._model = model = dressed_model(Scene(robot, world, ground), prints=prints)
        self._data = mujoco.MjData(model)
        size = camera.width_px, camera.height_px
        field_m = camera.field_width_m * size[1] / size[0]
        model.vis.global_.fovy = math.degrees(2.0 * math.atan(0.5 * field_m / camera.height_m))
        model.vis.map.zfar = 4.0 * camera.height_m / model.stat.extent + 10.0
        self._scene = plain_scene(model, model.ngeom + robot.joint_count + 11)
        self._view = mujoco.MjvCamera()
        self._view.lookat[:] = (*centre_m, 0.0)
        self._view.distance, self._view.elevation = camera.height_m, -90.0
        self._view.azimuth = 90.0 + math.degrees(camera.turn_rad)
        self._screen = Offscreen(model, *size)
        self._random = np.random.default_rng(seed)
        shape = (_FIELDS, size[1] + _SLACK, size[0] + _SLACK, 3)
        self._noise = np.rint(self._random.normal(0.0, NOISE, shape)).astype(np.int16)
        self._camera, self._centre_m = camera, np.array(centre_m)
        option = mujoco.MjvOption()
        option.geomgroup[1] = 0  # the skin
        self._update(option)
        self._floor = self._screen.draw(self._scene).copy()

    def picture(self, qpos: Floats) -> Image:
        """(H, W, 3) picture of the robot at ``qpos`` (7 + J,)."""
        data = self._data
        data.qpos[:] = qpos
        self._update(mujoco.MjvOption())
        spine = slice(1, 1 + self._robot.link_count)
        add_shade(
            self._scene,
            np.array(data.xipos[spine]),
            np.array(data.xmat[spine, ::3]),
            self._robot,
            self._ground,
        )
        left, right, top, low = self._window(np.array(data.xipos[spine]))
        self._narrow_cameras(left, right, top, low)
        grey = self._floor.copy()
        grey[top:low, left:right] = self._screen.draw(
            self._scene, size_px=(right - left, low - top)
        )
        return self._with_sensor_noise(grey)

    def empty_floor(self) -> Image:
        """(H, W, 3) picture without the robot."""
        return self._with_sensor_noise(self._floor)

    def close(self) -> None:
        """Free the frame buffer."""
        self._screen.close()

    def _update(self, option: mujoco.MjvOption) -> None:
        data = self._data
        model = self._model
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_camlight(model, data)
        all_categories = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(model, data, option, None, self._view, all_categories, self._scene)

    def _window(self, links_m: Floats) -> tuple[int, int, int, int]:
        """First and end columns and rows that contain the robot and its shade."""
        camera = self._camera
        robot = self._robot
        c, s = math.cos(camera.turn_rad), math.sin(camera.turn_rad)
        nearest = camera.height_m - float(links_m[:, 2].max()) - robot.body_radius_m
        scale = camera.width_px / camera.field_width_m * camera.height_m / nearest
        east, north = (links_m[:, :2] - self._centre_m).T
        x = 0.5 * camera.width_px + scale * (c * east + s * north)
        y = 0.5 * camera.height_px - scale * (c * north - s * east)
        beyond = scale * (max(robot.link_lengths_m) + 4.0 * robot.body_radius_m)
        span = []
        for values, side in ((x, camera.width_px), (y, camera.height_px)):
            first = min(max(math.floor(float(values.min()) - beyond), 0), side - 1)
            span += [first, min(max(math.ceil(float(values.max()) + beyond), first + 1), side)]
        return span[0], span[1], span[2], span[3]

    def _narrow_cameras(self, left: int, right: int, top: int, low: int) -> None:
        """Narrow the scene's cameras to these columns and rows."""
        for camera in self._scene.camera:
            half = camera.frustum_top
            pixel = 2.0 * half / self._camera.height_px
            camera.frustum_center = pixel * 0.5 * (left + right - self._camera.width_px)
            camera.frustum_top, camera.frustum_bottom = half - pixel * top, half - pixel * low

    def _with_sensor_noise(self, grey: Image) -> Image:
        """Add sensor noise: a random part of one of a few fields."""
        field = self._noise[self._random.integers(_FIELDS)]
        down, right = (int(k) for k in self._random.integers(_SLACK, size=2))
        rows, columns = grey.shape[:2]
        noisy = grey + field[down : down + rows, right : right + columns]
        return np.asarray(np.clip(noisy, 0, 255, out=noisy), dtype=np.uint8)
