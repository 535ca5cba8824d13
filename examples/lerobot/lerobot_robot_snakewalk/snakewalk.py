"""The robot: joint angles and cameras as observations, joint goals as actions."""

import math
from contextlib import ExitStack
from functools import cached_property
from typing import Any

import numpy as np
from lerobot.cameras.utils import make_cameras_from_configs
from lerobot.robots import Robot
from lerobot.utils.decorators import check_if_already_connected, check_if_not_connected

import snakewalk as sw
from lerobot_robot_snakewalk.config_snakewalk import SnakewalkConfig
from lerobot_robot_snakewalk.control_loop import ControlLoop
from lerobot_robot_snakewalk.simulator_camera import SimulatorCamera

SIMULATED = "sim"
"""Port of servos that this process simulates."""
CAMERA = "simulator"
"""Name of the camera that draws the simulated robot."""


class Snakewalk(Robot):
    """A snake robot on a port.

    ``<joint>.pos`` in rad is observed and commanded, ``<joint>.vel`` in rad/s and
    ``<joint>.current`` in A are observed. Torque is on while it is connected.
    """

    config_class = SnakewalkConfig
    name = "snakewalk"

    def __init__(self, config: SnakewalkConfig) -> None:
        super().__init__(config)
        if not 0.0 < config.rate_hz < math.inf:
            raise ValueError(f"robot.rate_hz: {config.rate_hz} is not a rate; give a positive one")
        if config.simulator_camera and config.port != SIMULATED:
            raise ValueError(
                "robot.simulator_camera: draws a robot that the package simulates, and "
                f"robot.port is {config.port}; use --robot.port={SIMULATED}, or --robot.cameras"
            )
        if config.simulator_camera and CAMERA in config.cameras:
            raise ValueError(
                f"robot.cameras: {CAMERA} is the name of the simulator's camera; use another"
            )
        self.config = config
        self.robot = sw.load_robot(config.robot)
        self.cameras: dict[str, Any] = make_cameras_from_configs(config.cameras)
        self._body = SimulatorCamera(self.robot, config.world) if config.simulator_camera else None
        if self._body is not None:
            self.cameras[CAMERA] = self._body
        self._loop: ControlLoop | None = None
        self._opened = ExitStack()

    @cached_property
    def action_features(self) -> dict[str, type]:
        return {f"{name}.pos": float for name in self.robot.joint_names}

    @cached_property
    def observation_features(self) -> dict[str, Any]:
        measured = {
            f"{name}.{what}": float
            for what in ("pos", "vel", "current")
            for name in self.robot.joint_names
        }
        sizes = {name: (each.height, each.width, 3) for name, each in self.cameras.items()}
        return measured | sizes

    @property
    def is_connected(self) -> bool:
        return self._loop is not None

    @property
    def is_calibrated(self) -> bool:
        """Always true: the robot file describes how the servos are mounted."""
        return True

    def calibrate(self) -> None:
        """Do nothing; ``snakewalk bus calibrate`` writes the robot file."""

    def configure(self) -> None:
        """Do nothing; ``connect`` sets the servos up as a run does."""

    @check_if_already_connected
    def connect(self, calibrate: bool = True) -> None:
        robot, limits = self.robot, sw.SafetyConfig()
        with ExitStack() as stack:
            device = self.config.port
            if self._body is not None:
                self._body.connect()  # before the servos, which are those of the body
                stack.callback(self._body.disconnect)
                device = self._body.path
            elif device == SIMULATED:
                ids = ",".join(str(each) for each in robot.servo_ids)
                bus = sw.ServoBus(f"{ids}:{robot.servo.model}", baud=robot.servo.baud)
                stack.callback(bus.close)
                device = bus.path  # real time, as LeRobot's loop has; `bus.line` has its own
            port = sw.SerialPort(device, robot.servo.baud)
            stack.callback(port.closePort)
            bus = sw.DynamixelBus(port, robot.servo.model)
            chain = sw.ServoChain(bus, robot, watchdog_s=limits.watchdog_s)
            for camera in self.cameras.values():
                if camera is self._body:
                    continue
                camera.connect()
                stack.callback(camera.disconnect)
            loop = ControlLoop(
                chain, sw.SafetyLimits.from_config(robot, limits), self.config.rate_hz
            )
            self._loop = stack.enter_context(loop)
            self._opened = stack.pop_all()

    @check_if_not_connected
    def get_observation(self) -> dict[str, Any]:
        state = self._loop.state()
        observed: dict[str, Any] = {}
        values = (
            ("pos", state.position_rad),
            ("vel", state.velocity_rad_s),
            ("current", state.current_a),
        )
        for what, measured in values:
            for name, value in zip(self.robot.joint_names, measured, strict=True):
                observed[f"{name}.{what}"] = float(value)
        for name, camera in self.cameras.items():
            observed[name] = camera.async_read()
        return observed

    @check_if_not_connected
    def send_action(self, action: dict[str, Any]) -> dict[str, Any]:
        missing = [key for key in self.action_features if key not in action]
        if missing:
            raise ValueError(f"action: {missing[0]} is missing; record with the same robot file")
        sent = self._loop.command(np.array([float(action[key]) for key in self.action_features]))
        return dict(zip(self.action_features, sent.tolist(), strict=True))

    @check_if_not_connected
    def disconnect(self) -> None:
        self._loop = None
        self._opened.close()
