"""Adapters of a chain with segments on several ports."""

from typing import Annotated

from pydantic import AfterValidator, Field

from snakewalk.config.base import Strict

SIMULATED = "sim"
"""Name of the port of servos that are simulated while the others of the chain are real."""
URL_SCHEMES = ("socket", "rfc2217", "loop", "snakewalk")
"""Schemes of URLs that may be a port; others of pyserial, such as ``spy``, write to files."""


def port_fault(port: str) -> str | None:
    """Return the fault of a port's name; None for a device, and for a URL of a known scheme."""
    scheme, separator, _ = port.partition("://")
    if not separator or scheme.lower() in URL_SCHEMES:
        return None
    schemes = [f"{scheme_name}://" for scheme_name in URL_SCHEMES]
    return (
        f"a port cannot be a URL of {scheme}://; use {', '.join(schemes[:-1])} or {schemes[-1]}, "
        "or the path of a device"
    )


def _checked_port(port: str) -> str:
    fault = port_fault(port)
    if fault is not None:
        raise ValueError(f"{port}: {fault}")
    return port


class PortConfig(Strict):
    """One adapter, and the segment of the chain that is behind it."""

    port: Annotated[str, AfterValidator(_checked_port)] = Field(
        min_length=1,
        description="a device such as /dev/ttyUSB0, a URL such as socket://host:5000, or sim: "
        "these servos are simulated, and the others are real",
    )
    ids: tuple[int, ...] = Field(
        min_length=1, description="IDs of all servos on the port, and of the IMU if it is there"
    )
