"""State of torque and log, for the notes on an error that ends a run."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from snakewalk.config.errors import InputError
from snakewalk.controller.runlog.writer import part_path
from snakewalk.drivers.errors import DriverError, notes_of
from snakewalk.drivers.safety.safe_link import TORQUE_IS_OFF, SafeLink

NOT_SWITCHED_ON: Final = "torque was not switched on"
MAY_BE_ON: Final = "torque may be on: switch the supply off"


class RunEnding:
    """The state of a run that ends, whatever ends it and in which phase."""

    def __init__(self) -> None:
        self.log: Path | None = None
        """Log of the run; None until it is begun."""
        self.link: SafeLink | None = None
        """Link of the run; None until it is made."""
        self.is_over = False
        """Whether the loop has come to its end."""

    @property
    def torque(self) -> str:
        """State of torque."""
        if self.link is None or not self.link.was_enabled:
            return NOT_SWITCHED_ON
        return TORQUE_IS_OFF if self.link.is_off else MAY_BE_ON

    @property
    def notes(self) -> list[str]:
        """State of torque, and the place of the log if there is one."""
        return [self.torque, *self._log_notes()]

    def _log_notes(self) -> list[str]:
        if self.log is None:
            return []
        for log in (self.log, part_path(self.log)):
            if log.exists():
                what = "the run is whole" if self.is_over else "log"
                return [f"{what}: {log}; its page: snakewalk log report {log}"]
        return []

    @contextmanager
    def noted(self) -> Iterator[None]:
        """Add the notes to an error of the block."""
        try:
            yield
        except DriverError as fault:  # says itself what it knows of torque
            if self.link is not None and self.link.tripped is not None:
                _add(fault, self._log_notes())
            raise
        except InputError:
            raise
        except OSError as fault:  # before the link, of a file: nothing has begun
            if self.link is not None:
                is_closed = self.log is not None and self.log.exists()  # else the log has its note
                _add(fault, self.notes if is_closed else [self.torque])
            raise
        except BaseException as stop:
            _add(stop, self.notes)
            raise


def _add(error: BaseException, notes: list[str]) -> None:
    for note in notes:
        if note not in notes_of(error):
            error.add_note(note)
