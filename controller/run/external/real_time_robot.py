"""A simulated robot on its ground at a serial device of this process, in real time."""

import threading
from types import TracebackType
from typing import Any, Self

import numpy as np

from snakewalk.config.arrays import Image
from snakewalk.config.ground import build_ground
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.run.external.served_robot import (
    Place,
    ServedRobot,
    Serving,
    simulated_views,
)
from snakewalk.drivers.clock import WallClock
from snakewalk.sim.serve.pty import PtyServer

_JOIN_S = 5.0
"""Longest wait for the last step of the server."""


class RealTimeRobot:
    """Serves the servos of a robot that lies straight on its ground; a context manager.

    A thread advances the simulation by wall time. ``picture`` belongs to one thread: the graphics
    context does, which the first call makes.

    Raises:
        InputError: MuJoCo is missing, or the robot or its ground cannot be simulated.

    """

    def __init__(self, robot: RobotConfig, world: WorldConfig) -> None:
        self._robot, self._world = robot, world
        self._served = ServedRobot(robot, world, Place(), Serving())
        self._server = PtyServer(self._served.line, WallClock())
        self.path = self._server.path
        """Serial device to open."""
        self._view: Any = None
        self._stop = threading.Event()
        self._thread = threading.Thread(
            target=self._server.serve, args=(self._stop.is_set,), daemon=True
        )
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def picture(self) -> Image:
        """Draw the body now, (480, 640, 3) in RGB, by a camera that follows it.

        Raises:
            OffscreenError: neither OSMesa nor EGL works.

        """
        if self._view is None:
            view = simulated_views().ChaseView
            self._view = view(self._robot, self._world, build_ground(self._world))
        picture: Image = self._view.draw(np.array(self._served.body.qpos))
        return picture

    def close(self) -> None:
        """Stop serving; safe to call twice."""
        self._stop.set()
        self._thread.join(_JOIN_S)
        self._server.close()
        if self._view is not None:
            self._view.close()
        self._view = None
