"""The view from above: the picture that a camera over the simulated robot takes."""

import math

import mujoco
import numpy as np

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.camera import CameraConfig
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig
from snakewalk.sim.rendering.looks import dressed_model
from snakewalk.sim.rendering.offscreen import Offscreen
from snakewalk.sim.rendering.shade import add_shade

NOISE = 3.0
"""Standard deviation of the sensor's noise, of 255."""
_FIELDS = 8


class TopView:
    """Draws ``MujocoPlant.qpos`` from above; ``close`` it.

    Level floors only. The same seed gives the same noise.

    Raises:
        OffscreenError: nothing here draws without a screen.

    """

    def __init__(
        self,
        robot: RobotConfig,
        world: WorldConfig,
        camera: CameraConfig,
        centre_m: tuple[float, float],
        seed: int = 0,
    ) -> None:
        self._robot = robot
        self._model = model = dressed_model(robot, world, None)
        self._data = mujoco.MjData(model)
        size = camera.width_px, camera.height_px
        field_m = camera.field_width_m * size[1] / size[0]
        model.vis.global_.fovy = math.degrees(2.0 * math.atan(0.5 * field_m / camera.height_m))
        model.vis.map.zfar = 4.0 * camera.height_m / model.stat.extent + 10.0
        self._scene = mujoco.MjvScene(model, maxgeom=model.ngeom + robot.joint_count + 11)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = 0
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
        self._view = mujoco.MjvCamera()
        self._view.lookat[:] = (*centre_m, 0.0)
        self._view.distance, self._view.elevation = camera.height_m, -90.0
        self._view.azimuth = 90.0 + math.degrees(camera.turn_rad)
        self._screen = Offscreen(model, *size)
        self._random = np.random.default_rng(seed)
        shape = (_FIELDS, size[1], size[0], 3)
        self._noise = np.rint(self._random.normal(0.0, NOISE, shape)).astype(np.int16)

    def picture(self, qpos: Floats) -> Image:
        """(H, W, 3) the robot at ``qpos`` (7 + J,)."""
        data = self._data
        data.qpos[:] = qpos
        self._update(mujoco.MjvOption())
        spine = slice(1, 1 + self._robot.link_count)
        add_shade(
            self._scene,
            np.array(data.xipos[spine]),
            np.array(data.xmat[spine, ::3]),
            self._robot,
            None,
        )
        return self._drawn()

    def empty_floor(self) -> Image:
        """(H, W, 3) the same without the robot."""
        option = mujoco.MjvOption()
        option.geomgroup[1] = 0  # the skin
        self._update(option)
        return self._drawn()

    def close(self) -> None:
        """Free the frame buffer."""
        self._screen.close()

    def _update(self, option: mujoco.MjvOption) -> None:
        data, model = self._data, self._model
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_camlight(model, data)
        everything = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(model, data, option, None, self._view, everything, self._scene)

    def _drawn(self) -> Image:
        """Draw, and add the sensor's noise: one of a few fields, shifted by chance."""
        field = self._noise[self._random.integers(_FIELDS)]
        down, right = (int(self._random.integers(side)) for side in field.shape[:2])
        grey = self._screen.draw(self._scene) + np.roll(field, (down, right), axis=(0, 1))
        return np.asarray(np.clip(grey, 0, 255), dtype=np.uint8)
