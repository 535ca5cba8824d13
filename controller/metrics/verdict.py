"""Verdict on a run: one sentence, how it is known, exit code, cause, and the next command."""

from dataclasses import asdict, dataclass
from typing import Any

from snakewalk.controller.metrics.failure import Cause, Failure, failure
from snakewalk.controller.metrics.summary import RunSummary
from snakewalk.controller.runlog.evidence import Kind
from snakewalk.controller.runlog.record import RunRecord

NOT_MEASURED = 3
"""Exit code of a run that ended as planned, but whose arrival nothing measured."""
MOST_RADII = 4.0
"""Accuracy over the radius of a waypoint beyond which no arrival is shown (ours): sound sources
are below 3."""
_EXIT_MISSED = 1
"""Exit code of a run that safety stopped, or that missed a waypoint."""
_SIMULATED_BACKEND = "sim"
_ADVICE: dict[Cause, str] = {
    "safety": "snakewalk log report {log}",
    "roll": "snakewalk plan {run}",
    "climb": "snakewalk plan {run}",
    "time": "snakewalk plan {run}",
    "joint": "snakewalk log shadow {log}",
    "slip": "snakewalk log shadow {log}",
    "steering": "snakewalk log report {log}",
}
"""Command that shows more of a cause."""


@dataclass(frozen=True, slots=True)
class RunVerdict:
    """How a run ended, as every result states it."""

    sentence: str
    """Waypoints or distance, error of the path, duration."""
    evidence: str
    """Evidence of the sentence: ``simulated``, ``measured (udp)``, ``dead-reckoned (joints)``."""
    exit_code: int
    """0: as planned; 1: safety stopped it, or a waypoint was missed; 3: as planned, but nothing
    measured the arrival."""
    cause: str | None
    """Why the exit code is not 0; None if it is."""
    next_command: str | None
    """Command that shows more of the cause; None without one."""
    failure: Cause | None = None
    """Class of the cause; None without a failure, or if no class fits."""
    report: str | None = None
    """Path of the run's report, which is drawn last; None if no folder keeps it."""

    @property
    def is_unconfirmed(self) -> bool:
        """Whether a source sent poses that did not agree with the joints."""
        return self.evidence.startswith(Kind.UNCONFIRMED)

    def accepted(self, dead_reckoning: bool) -> "RunVerdict":
        """Return the verdict if a user accepts a dead-reckoned arrival."""
        if not dead_reckoning or self.exit_code != NOT_MEASURED or self.is_unconfirmed:
            return self
        return RunVerdict(self.sentence, self.evidence, 0, None, None)

    @property
    def explanation(self) -> str:
        """Exit code, cause and next command in a line; empty for 0."""
        if not self.exit_code:
            return ""
        more = "" if self.next_command is None else f"; more: {self.next_command}"
        return f"exit code {self.exit_code}: {self.cause}{more}"

    @property
    def text(self) -> str:
        """The sentence, with the explanation if there is one."""
        return "; ".join(filter(None, (self.sentence, self.explanation)))

    @property
    def with_cause(self) -> str:
        """The sentence, with the cause if there is one, for a log that is not kept."""
        return "; ".join(filter(None, (self.sentence, self.cause)))

    def to_dict(self) -> dict[str, Any]:
        """Keys and values for JSON."""
        return asdict(self)


def verdict(record: RunRecord, numbers: RunSummary, log: str = "log.mcap") -> RunVerdict:
    """Return the verdict on a run, from its log alone.

    Args:
        record: the log.
        numbers: its summary.
        log: name of the log in the next command.

    """
    exit_code = 0
    cause = None
    radius_m = record.header.plan.waypoint_radius_m
    sd_m = (numbers.is_measured and numbers.pose_position_sd_m) or 0.0
    more = ""
    fault = None
    if numbers.trip is not None or _reached_count(numbers) < numbers.waypoints:
        exit_code = _EXIT_MISSED
        if numbers.trip is None:
            fault = failure(record)
        else:
            fault = Failure("safety", f"stopped by safety: {numbers.trip}")
        cause = "a waypoint was missed" if fault is None else fault.text
        more = "" if fault is None else _ADVICE[fault.cause]
        if numbers.trip is not None and numbers.backend != _SIMULATED_BACKEND:
            more = "snakewalk doctor --port {port}"
    elif numbers.pose_evidence == Kind.UNCONFIRMED:
        exit_code = NOT_MEASURED
        cause = (
            f"the pose of {numbers.pose_source} is unconfirmed: it did not agree with the joints; "
            "check the source"
        )
        more = "snakewalk pose check {pose}" + " --run {run}" * (numbers.waypoints > 0)
    elif numbers.waypoints and sd_m > MOST_RADII * radius_m:
        exit_code = NOT_MEASURED
        cause = (
            f"the pose of {numbers.pose_source} states an accuracy of {sd_m:.2g} m, a waypoint has "
            f"a radius of {radius_m:g} m: the arrival is not shown; use snakewalk pose calibrate"
        )
    elif numbers.waypoints and not numbers.is_measured:
        exit_code = NOT_MEASURED
        cause = (
            "the arrival is dead-reckoned, nothing measured the pose; give a pose source with "
            "--pose, or accept it with --accept-dead-reckoning"
        )
    pose = record.header.run.pose
    next_command = more.format(run=numbers.run, log=log, port=numbers.backend, pose=pose)
    return RunVerdict(
        sentence=_sentence(numbers),
        evidence=_evidence(numbers),
        exit_code=exit_code,
        cause=cause,
        next_command=next_command or None,
        failure=None if fault is None else fault.cause,
    )


def _reached_count(numbers: RunSummary) -> int:
    measured = numbers.waypoints_reached
    return (numbers.dead_reckoned_waypoints_reached if measured is None else measured) or 0


def _sentence(numbers: RunSummary) -> str:
    """Return the sentence; numbers that nothing measured are marked."""
    is_measured = numbers.is_measured
    error_m = numbers.path_error_mean_m if is_measured else numbers.dead_reckoned_path_error_mean_m
    travelled_m = numbers.travelled_m if is_measured else numbers.dead_reckoned_travelled_m
    parts = []
    if numbers.waypoints:
        noun = "waypoint" if numbers.waypoints == 1 else "waypoints"
        believes = "believes " * (numbers.pose_evidence == Kind.UNCONFIRMED)
        parts.append(f"{believes}{_reached_count(numbers)} of {numbers.waypoints} {noun}")
        if error_m is not None:
            parts.append(f"{100.0 * error_m:.1f} cm from its path")
    elif travelled_m is not None:
        parts.append(f"moved {travelled_m:.2f} m")
    if numbers.duration_s is not None:
        parts.append(f"{numbers.duration_s:.1f} s")
    if numbers.pose_evidence == Kind.UNCONFIRMED:
        parts.append("by an unconfirmed pose")
    elif not is_measured:
        parts.append("by dead reckoning")
    if numbers.trip is not None:
        parts.insert(0, "stopped by safety")
    elif numbers.outcome.startswith("interrupted"):
        parts.insert(0, "interrupted")
    return ", ".join(parts)


def _evidence(numbers: RunSummary) -> str:
    if numbers.pose_source == "simulator":
        return "simulated"
    is_simulated = numbers.pose_is_simulated or numbers.port_is_pseudo_terminal
    source = f"{numbers.pose_source}, simulated" if is_simulated else numbers.pose_source
    return f"{numbers.pose_evidence} ({source})"
