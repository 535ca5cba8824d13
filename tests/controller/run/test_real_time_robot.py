"""A simulated robot at a serial device of a child process."""

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.loader import checked, load_robot, load_world
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.run.external.real_time_robot import RealTimeRobot
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.port.serial_port import SerialPort


@pytest.mark.slow
def test_the_servos_reply_and_the_body_is_drawn() -> None:
    robot = load_robot("yaw16")
    with RealTimeRobot(robot, load_world("flat")) as served:
        port = SerialPort(served.path, robot.servo.baud)
        try:
            assert DynamixelBus(port, robot.servo.model, latency_s=0.2).probe(16).answered
        finally:
            port.closePort()
        picture = served.picture()
    assert picture.shape == (480, 640, 3)
    # the body covers a part of an even floor
    floor = np.median(picture, axis=(0, 1))
    differs = np.abs(picture - floor).max(axis=2) > 60.0
    assert 0.002 < differs.mean() < 0.5
    served.close()
    with pytest.raises(InputError, match="has ended"):
        served.qpos()


@pytest.mark.slow
def test_a_robot_that_cannot_be_served_is_rejected() -> None:
    keys = {
        "name": "two",
        "joints": [
            {"axis": "y", "id": 1},
            {"axis": "y", "id": 2, "model": "STS3215-C018"},
        ],
        "ports": [{"port": "a", "ids": [1]}, {"port": "b", "ids": [2]}],
        "servo": {"supply_v": 12.0},
    }
    with pytest.raises(InputError, match="different series"):
        RealTimeRobot(checked(RobotConfig, keys, "robot two"), load_world("flat"))
