"""Request for a run, and its result: the same for commands, studies, rehearsals and programs."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from snakewalk.controller.console.result_files import LOG
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
from snakewalk.controller.run.run_ending import RunEnding
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.runtime.drive import OnEvent, OnProgress, Outcome


@dataclass(frozen=True, slots=True)
class RunRequest:
    """A prepared run, its folder, its port, and everyone who watches or operates it."""

    prepared: PreparedRun
    """The motion, checked on paper."""
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
    observers: Observers | None = None
    """A page that shows the run, a ROS node that publishes it, plug-ins."""
    confirm: Callable[[str], bool] | None = None
    """Asks an operator whether an interrupted chain may go on (``safety.recovery``)."""
    stop_requested: Callable[[], str | None] = lambda: None
    """Returns why an operator wants torque off, or None; called in every read and write."""
    waypoint_commands: Callable[[], Iterable[str | Refused]] | None = None
    """Returns an operator's changes of the waypoints in each cycle, as ``LiveCourse`` accepts them.
    The run then holds at the last waypoint until it is ended."""
    on_progress: OnProgress = lambda progress: None
    """Called after each cycle."""
    on_event: OnEvent = lambda kind, text: None
    """Called with decisions of the motion: a slower rate, an operator's change."""


@dataclass(frozen=True, slots=True)
class RunResult:
    """Results of a run."""

    prepared: PreparedRun
    outcome: Outcome
    record: RunRecord
    """The log, read once for summary and report."""
    summary: RunSummary
    travel: Travel
    """Travel of the centre of mass, which gives the summary's speed."""
    pose: PoseProvider
    """Pose source, and its accuracy if known."""
    map: MapProvider
    """Map source and its accuracy, for a run that maps its ground."""
    source: MotionSource
    """The motion that ran, at its end."""
    ending: RunEnding
    """State of torque and log, for an ending of the program afterwards."""
    saved_log: Path | None
    """None if the folder was temporary."""

    @property
    def verdict(self) -> RunVerdict:
        """How the run ended, as every result states it."""
        log = LOG if self.saved_log is None else str(self.saved_log)
        return verdict(self.record, self.summary, log)

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
