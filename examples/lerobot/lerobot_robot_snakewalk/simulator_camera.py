"""A camera of LeRobot's kind that draws a robot which a child process simulates."""

from typing import Any

import numpy as np

import snakewalk as sw


class SimulatorCamera:
    """Simulates the robot on its ground while it is connected, and draws it."""

    height, width = 480, 640

    def __init__(self, robot: sw.RobotConfig, world: str) -> None:
        self._robot, self._world = robot, sw.load_world(world)
        self._served_line: sw.RealTimeRobot | None = None

    @property
    def path(self) -> str:
        """Serial device of the servos."""
        assert self._served_line is not None
        return self._served_line.path

    @property
    def is_connected(self) -> bool:
        """Whether the robot is simulated."""
        return self._served_line is not None

    def connect(self) -> None:
        """Begin the simulation, and draw once: the first picture needs a second."""
        self._served_line = sw.RealTimeRobot(self._robot, self._world)
        try:
            self._served_line.picture()
        except BaseException:
            self.disconnect()
            raise

    def async_read(self) -> np.ndarray[Any, np.dtype[np.uint8]]:
        """Draw the robot now, (480, 640, 3) in RGB."""
        assert self._served_line is not None
        return self._served_line.picture()

    def disconnect(self) -> None:
        """End the simulation; safe to call twice."""
        if self._served_line is not None:
            self._served_line.close()
        self._served_line = None
