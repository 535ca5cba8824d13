"""Errors between radians and bytes.

::

    DriverError                         everything below
    ├── ProtocolError                   bytes that are not a packet
    │   └── StuffingError               ``FF FF FD`` in a payload without its stuffed ``FD``
    ├── BusError                        a servo did not do what an instruction asked
    │   ├── NoAnswerError               no status packet before the deadline
    │   └── ServoError                  a status packet that carries a result error
    ├── SafetyTrippedError              the safety layer has latched; an operator must reset it
    ├── PortError (InputError)          the port is missing, denied, busy, or vanished
    ├── ChainError (InputError)         the servos found are not the robot described
    ├── ControlTableError (InputError)  unknown servo model, register or unit
    └── BudgetError (InputError)        the cycle does not fit the wire

The last four state faults of the user's input, one line each; the command line prints them and
exits with code 2.
"""

from dataclasses import dataclass
from enum import Enum, auto

from snakewalk.config.errors import InputError


def notes_of(error: BaseException | None) -> list[str]:
    """Return the notes of an error; one without notes has no attribute for them."""
    return list(getattr(error, "__notes__", []))


class DriverError(Exception):
    """Base class of driver errors."""


class ProtocolError(DriverError):
    """Bytes that cannot be a Protocol 2.0 packet."""


class StuffingError(ProtocolError):
    """Malformed byte stuffing."""


class BusError(DriverError):
    """A servo did not follow an instruction."""


class NoAnswerError(BusError):
    """No status packet arrived before the deadline."""


class ServoError(BusError):
    """The servo replied with a result error; ``error`` is the byte of its status packet."""

    def __init__(self, message: str, error: int) -> None:
        super().__init__(message)
        self.error = error


class SafetyTrippedError(DriverError):
    """The safety layer has latched; an operator must reset it."""


class PortError(InputError, DriverError):
    """The port is missing, denied, busy, or vanished."""


class PortBusyError(PortError):
    """Another program has the port open."""


class FaultCause(Enum):
    """Kinds of faults that forbid a start or a continuation."""

    NO_ANSWER = auto()
    OTHER_MODEL = auto()
    OTHER_FIRMWARE = auto()
    ALARM = auto()
    TURN_COUNT_LOST = auto()
    MOVED = auto()
    EXCHANGED = auto()
    OTHER_SETTINGS = auto()


@dataclass(frozen=True, slots=True)
class ChainFault:
    """One fault of a chain; as a string, the line for the user."""

    cause: FaultCause
    text: str

    def __str__(self) -> str:
        return self.text


class ChainError(InputError, DriverError):
    """The servos on the bus are not the described robot."""


class ControlTableError(InputError, DriverError):
    """Unknown servo model, register, or unit."""


class BudgetError(InputError, DriverError):
    """The control cycle does not fit the wire."""
