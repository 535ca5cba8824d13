"""A camera that follows the simulated body: pictures without a screen, or a window."""

import os
import sys
from typing import Any

import mujoco
import mujoco.viewer

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.errors import InputError
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig
from snakewalk.sim.rendering.looks import Scene, dressed_model
from snakewalk.sim.rendering.offscreen import Offscreen

DISTANCE_LENGTHS = 1.6
"""Distance of the camera, in lengths of the body (ours)."""
ELEVATION_DEG, AZIMUTH_DEG = -35.0, 90.0
SIZE_PX = (640, 480)


class ChaseView:
    """Draws ``MujocoPlant.qpos`` without a screen; ``close`` it.

    Raises:
        OffscreenError: neither OSMesa nor EGL works.

    """

    def __init__(self, robot: RobotConfig, world: WorldConfig, ground: HeightField | None) -> None:
        self._pose = _Pose(robot, world, ground)
        model = self._pose.model
        self._scene = mujoco.MjvScene(model, maxgeom=model.ngeom + model.nbody + 11)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = 0
        self._camera, self._option = mujoco.MjvCamera(), mujoco.MjvOption()
        self._screen = Offscreen(model, *SIZE_PX)

    def draw(self, qpos: Floats) -> Image:
        """Draw a pose, (height, width, 3), top row first; a new array."""
        camera = self._camera
        self._pose.show(qpos, camera)
        every = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(
            self._pose.model, self._pose.data, self._option, None, camera, every, self._scene
        )
        return self._screen.draw(self._scene).copy()

    def close(self) -> None:
        """Free the frame buffer; safe to call twice."""
        self._screen.close()


class _Pose:
    """The drawn model and its pose."""

    def __init__(self, robot: RobotConfig, world: WorldConfig, ground: HeightField | None) -> None:
        self.model = dressed_model(Scene(robot, world, ground))
        self.data = mujoco.MjData(self.model)
        self._distance_m = DISTANCE_LENGTHS * robot.length_m

    def show(self, qpos: Floats, camera: mujoco.MjvCamera) -> None:
        """Move the body, and point a camera at its middle."""
        self.data.qpos[:] = qpos
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)
        camera.lookat[:] = self.data.subtree_com[1]
        camera.distance = self._distance_m
        camera.elevation = ELEVATION_DEG
        camera.azimuth = AZIMUTH_DEG


class ChaseWindow:
    """Shows ``MujocoPlant.qpos`` in MuJoCo's window; ``close`` it.

    Raises:
        InputError: the machine has no screen.

    """

    def __init__(self, robot: RobotConfig, world: WorldConfig, ground: HeightField | None) -> None:
        if sys.platform == "linux" and not {"DISPLAY", "WAYLAND_DISPLAY"} & set(os.environ):
            raise InputError(
                "render_mode 'human': this machine has no screen; use render_mode='rgb_array'"
            )
        self._pose = _Pose(robot, world, ground)
        self._window: Any = mujoco.viewer.launch_passive(  # untyped
            self._pose.model, self._pose.data, show_left_ui=False, show_right_ui=False
        )

    def draw(self, qpos: Floats) -> None:
        """Show a pose; no effect after the window was closed."""
        if not self._window.is_running():
            return
        with self._window.lock():
            self._pose.show(qpos, self._window.cam)
        self._window.sync()

    def close(self) -> None:
        """Close the window; safe to call twice."""
        self._window.close()
