"""Kind of a device by its name; opening it would change lines of an adapter."""

import os
import re
import stat
from pathlib import Path
from typing import Final

from snakewalk.drivers.errors import PortError

try:
    import termios
except ImportError:  # Windows: opening a port reports the remedy
    termios = None  # type: ignore[assignment]

_NO_DEVICES = ("sim", "robot")
"""Names for simulated servos, and for the ports in the robot's file."""
_IDS: Final = re.compile(r"\s*\d[\d\s-]*=")
_PSEUDO_TERMINALS = range(136, 144)
"""Major numbers of Linux's pseudo-terminals, which have no entry below ``/sys/dev/char``."""


def check_port_name(port: str | None) -> str | None:
    """Return ``--port`` if each name in it is a URL of a known scheme, or may be a serial device.

    A missing name passes; opening it reports that.

    Raises:
        PortError: one line per fault.

    """
    if port is None:
        return None
    names = [_IDS.sub("", part, count=1) for part in port.split(",")]
    faults = [fault for fault in map(_fault, names) if fault is not None]
    if faults:
        raise PortError(faults)
    return port


def _fault(name: str) -> str | None:
    from snakewalk.config.robot.ports import port_fault  # noqa: PLC0415  --help loads no schema

    if (fault := port_fault(name)) is not None:
        return f"{name}: {fault}"
    if termios is None or name in _NO_DEVICES:
        return None
    path = Path(name)
    if path.is_symlink() and not path.exists():
        return (
            f"{name}: leads to {os.readlink(path)}, which is gone: its server has ended; start it "
            "again"
        )
    try:
        facts = path.stat()
    except (OSError, ValueError):
        return None
    if stat.S_ISCHR(facts.st_mode) and _is_terminal(facts.st_rdev):
        return None
    return f"{name}: is not a serial device; name one such as /dev/ttyUSB0"


def _is_terminal(device: int) -> bool:
    major, minor = os.major(device), os.minor(device)
    if major in _PSEUDO_TERMINALS:
        return True
    subsystem = Path(f"/sys/dev/char/{major}:{minor}/subsystem")
    return not subsystem.exists() or subsystem.resolve().name == "tty"
