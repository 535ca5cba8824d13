"""Request for a run, and its result: the same for commands, studies, rehearsals and programs."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from snakewalk.config.errors import InputError
from snakewalk.controller.console.result_files import LOG, REPORT
from snakewalk.controller.metrics.summary import RunSummary
from snakewalk.controller.metrics.travel import Travel
from snakewalk.controller.metrics.verdict import RunVerdict, verdict
from snakewalk.controller.motion.command import Refused
from snakewalk.controller.motion.source import MotionSource
from snakewalk.controller.run.backend import RehearsedPort
from snakewalk.controller.run.map_provider import MapProvider
from snakewalk.controller.run.observers import Observers
from snakewalk.controller.run.pose_provider import PoseProvider
from snakewalk.controller.run.prepared_run import PreparedRun
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.runlog.writer import ONE_PART, PartLimits, part_path
from snakewalk.controller.runtime.drive import OnEvent, OnProgress, Outcome
from snakewalk.drivers.errors import DriverError, notes_of
from snakewalk.drivers.safety.safe_link import TORQUE_IS_OFF, SafeLink

NOT_SWITCHED_ON = "torque was not switched on"
MAY_BE_ON = "torque may be on: switch the supply off"


class RunEnding:
    """State of an ending run in any phase."""

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
                what = "the run is complete" if self.is_over else "log"
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


@dataclass(frozen=True, slots=True)
class RunRequest:
    """A prepared run, its folder, its port, and everyone who watches or operates it."""

    prepared: PreparedRun
    """Motion of the run, checked on paper."""
    folder: Path | None = None
    """Folder of the log, which is made; None: a temporary one, which is deleted."""
    port: str | RehearsedPort | None = None
    """A device or a URL; ``1-8=PORT,9-16=PORT`` if segments of the chain have ports of their own;
    or ``robot``, whose file names them. A port ``sim`` has simulated servos. A ``RehearsedPort``
    serves a simulated robot in this process as if it were real. None: the simulator."""
    overwrite: bool = False
    """Whether the files of another run in the folder are deleted when the new log begins."""
    stoppable: bool = True
    """Whether the run has a button, which ``snakewalk stop`` presses."""
    shadow: bool = False
    """Whether a simulated chain follows the same goals; log and ``on_event`` report differences."""
    log_limits: PartLimits = ONE_PART
    """Limits from which the log continues in a new part."""
    observers: Observers | None = None
    """Observers of the run: page, ROS node, plug-ins."""
    confirm: Callable[[str], bool] | None = None
    """Asks an operator whether an interrupted chain may go on (``safety.recovery``)."""
    stop_requested: Callable[[], str | None] = lambda: None
    """Returns why an operator wants torque off, or None; called in every read and write."""
    waypoint_commands: Callable[[], Iterable[str | Refused]] | None = None
    """Returns an operator's changes of the waypoints in each cycle, as ``LiveCourse`` accepts them.
    The run then holds at the last waypoint until it is ended."""
    on_progress: OnProgress = lambda progress: None
    """Function that is called after each cycle."""
    on_event: OnEvent = lambda kind, text: None
    """Function that gets decisions of the motion: a slower rate, an operator's change."""


@dataclass(frozen=True, slots=True)
class RunResult:
    """Results of a run."""

    prepared: PreparedRun
    outcome: Outcome
    record: RunRecord
    """Log of the run, read once for summary and report."""
    summary: RunSummary
    travel: Travel
    """Travel of the centre of mass, which gives the summary's speed."""
    pose: PoseProvider
    """Pose source, and its accuracy if known."""
    map: MapProvider
    """Map source and its accuracy, for a run that maps its ground."""
    source: MotionSource
    """Motion of the run, at its end."""
    ending: RunEnding
    """State of torque and log, for an ending of the program afterwards."""
    saved_log: Path | None
    """Path of the log; None if the folder was temporary."""

    @property
    def verdict(self) -> RunVerdict:
        """How the run ended, as every result states it."""
        if self.saved_log is None:
            return verdict(self.record, self.summary, LOG)
        report = str(self.folder.absolute() / REPORT)
        return replace(verdict(self.record, self.summary, str(self.saved_log)), report=report)

    @property
    def log(self) -> Path:
        """Path of the log.

        Raises:
            ValueError: the folder was temporary.

        """
        if self.saved_log is None:
            raise ValueError("the log was in a temporary folder; request the run with a folder")
        return self.saved_log

    @property
    def folder(self) -> Path:
        """Folder of the results; raises as ``log``."""
        return self.log.parent
