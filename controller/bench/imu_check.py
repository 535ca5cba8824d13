"""The robot's IMU: whether it answers, and whether its readings are possible."""

import numpy as np

from snakewalk.config.robot import ImuConfig
from snakewalk.controller.console.finding import Finding
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.imu_reader import ImuReader
from snakewalk.drivers.errors import ChainError
from snakewalk.drivers.types import ImuState

_READS = 10
_PAUSE_S = 0.02
_LEVEL_DEG = 20.0
"""A link that lies flat shows less (ours): more is a wrong mounting, or a robot that lies askew."""
_STILL_DPS = 5.0
"""A robot on the bench turns by less (ours): a gyro in other units would show more."""


def imu_finding(bus: DynamixelBus, imu: ImuConfig) -> Finding:
    """Ping it and read it for a fifth of a second.

    Raises:
        PortError: the port vanished.

    """
    reader = ImuReader(bus, imu)
    clock = bus.port.clock
    try:
        reader.find()
    except ChainError as error:
        return Finding("imu", "fail", str(error), "look at its cable; snakewalk bus scan")
    shown: list[ImuState] = []
    for _ in range(_READS):
        state = reader.read(lambda line: None)
        if state is not None and state.valid:
            shown.append(state)
        clock.sleep_until_s(clock.now_s() + _PAUSE_S)
    name = f"{imu.model} (ID {imu.id})"
    if not shown:
        return Finding(
            "imu", "fail", f"{name}: shows no attitude", "its filter does not run: power it again"
        )
    rate_dps = np.rad2deg(max(float(np.linalg.norm(s.rate_rad_s)) for s in shown))
    up = shown[-1].rotation[2]
    tilt_deg = np.rad2deg(np.arccos(np.clip(up[2], -1.0, 1.0)))
    imu_text = (
        f"{name}: link {imu.link} is {tilt_deg:.0f} degrees off upright, turns at up to "
        f"{rate_dps:.1f} degrees a second"
    )
    if rate_dps > _STILL_DPS:
        return Finding(
            "imu", "warn", imu_text, "does the robot lie still? is the range the board's?"
        )
    if tilt_deg > _LEVEL_DEG:
        return Finding("imu", "warn", imu_text, "if it lies flat: correct mounting_deg of [imu]")
    return Finding("imu", "ok", imu_text)
