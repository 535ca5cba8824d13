"""Adapters of a chain with segments on several ports."""

from pydantic import Field

from snakewalk.config.base import Strict

SIMULATED = "sim"
"""The port of servos that are simulated while the others of the chain are real."""


class PortConfig(Strict):
    """One adapter, and the segment of the chain that is behind it."""

    port: str = Field(
        min_length=1,
        description="a device such as /dev/ttyUSB0, a URL such as socket://host:5000, or sim: "
        "these servos are simulated, and the others are real",
    )
    ids: tuple[int, ...] = Field(
        min_length=1, description="of all servos on it, and of the IMU where it is on it"
    )
