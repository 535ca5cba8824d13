"""A simulated robot on its ground at a serial device, in real time, by another process."""

from multiprocessing.connection import Connection
from typing import Any, Self

import numpy as np

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.errors import InputError
from snakewalk.config.ground import build_ground
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.console.child_process import pipe, start
from snakewalk.controller.run.external.served_robot import (
    Place,
    ServedRobot,
    Serving,
    simulated_views,
)
from snakewalk.drivers.clock import WallClock
from snakewalk.drivers.priority import raised_priority
from snakewalk.sim.serve.pty import IDLE_S, PtyServer

_ASK = b"qpos"


class RealTimeRobot:
    """Serves the servos of a robot that lies straight on its ground; a context manager.

    Another process simulates it by wall time, because work of this one would delay the replies. It
    starts as by ``multiprocessing``: a script needs ``if __name__ == "__main__":``. ``picture``
    belongs to one thread, that of its first call, as its graphics context does.

    Raises:
        InputError: MuJoCo is missing, or the robot or its ground cannot be simulated.

    """

    def __init__(self, robot: RobotConfig, world: WorldConfig) -> None:
        self._robot = robot
        self._world = world
        self._view: Any = None
        self._line, other = pipe()
        self._process = start(_serve, other, robot, world, daemon=True)
        other.close()
        try:
            begun = self._line.recv()
        except EOFError:
            begun = InputError(f"robot {robot.name}: its simulation ended at the start")
        if isinstance(begun, InputError):
            self.close()
            raise begun
        self.path: str = begun
        """Serial device to open."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        self.close()

    def qpos(self) -> Floats:
        """MuJoCo's coordinates of the body now.

        Raises:
            InputError: the simulation has ended.

        """
        try:
            self._line.send_bytes(_ASK)
            return np.frombuffer(self._line.recv_bytes())
        except (EOFError, OSError):
            raise InputError(f"robot {self._robot.name}: its simulation has ended") from None

    def picture(self) -> Image:
        """Draw the body now, (480, 640, 3) in RGB, by a camera that follows it.

        Raises:
            InputError: the simulation has ended.
            OffscreenError: neither OSMesa nor EGL works.

        """
        if self._view is None:
            view = simulated_views().ChaseView
            self._view = view(self._robot, self._world, build_ground(self._world))
        picture: Image = self._view.draw(self.qpos())
        return picture

    def close(self) -> None:
        """End the simulation; safe to call twice."""
        self._line.close()
        self._process.terminate()
        self._process.join()
        if self._view is not None:
            self._view.close()
        self._view = None


def _serve(line: Connection, robot: RobotConfig, world: WorldConfig) -> None:
    """Serve until the line is closed; the first message is the device, or an ``InputError``."""
    try:
        served = ServedRobot(robot, world, Place(), Serving())
        server = PtyServer(served.line, WallClock())
    except InputError as fault:
        line.send(fault)
        return
    try:
        with served, server, raised_priority():
            line.send(server.path)
            while True:
                server.step(IDLE_S)
                if line.poll():
                    line.recv_bytes()
                    line.send_bytes(np.array(served.body.qpos).tobytes())
    except (EOFError, OSError):
        return
