"""Evidence of a value: how it is known, from which source, and how accurately."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Self

from snakewalk.config.run import RunConfig


class Kind(StrEnum):
    """How a value is known."""

    MEASURED = "measured"
    """Evidence of a value that a source measured at a time, with an accuracy; the truth of the
    simulator is measured."""
    ESTIMATED = "estimated"
    """Computed from measurements, with an interval."""
    ASSUMED = "assumed"
    """Read from a file or an option."""
    DEAD_RECKONED = "dead-reckoned"
    """A pose integrated from the joints, or from the joints and an IMU."""
    UNCONFIRMED = "unconfirmed"
    """A pose that a source sent, and that did not agree with the joints."""


@dataclass(frozen=True, slots=True)
class PoseEvidence:
    """Evidence of the poses of a run."""

    kind: Kind
    source: str
    """Source of the value: ``simulator``, ``camera``, ``joints``, ``imu``, or the name of a
    plug-in."""
    position_m: float | None = None
    """Standard deviation of the head's position; None where the source does not state it."""
    heading_rad: float | None = None
    """Standard deviation of its heading; None where the source does not state it."""

    @property
    def is_measured(self) -> bool:
        """Whether distances and arrivals that follow from these poses are measured."""
        return self.kind not in (Kind.DEAD_RECKONED, Kind.UNCONFIRMED)

    @property
    def text(self) -> str:
        """The evidence for a reader: ``measured by simulator``."""
        by = "from" if self.kind is Kind.DEAD_RECKONED else "by"
        off = "" if not self.position_m else f", {100.0 * self.position_m:.1f} cm"
        return f"{self.kind} {by} {self.source}{off}"

    @property
    def texts(self) -> dict[str, str]:
        """Kind, source and uncertainty as texts; an unknown uncertainty is left out."""
        off = {"pose_position_sd_m": self.position_m, "pose_heading_sd_rad": self.heading_rad}
        limit_texts = {name: f"{value:g}" for name, value in off.items() if value is not None}
        return {"pose_evidence": str(self.kind), "pose_source": self.source, **limit_texts}

    def row(self) -> dict[str, Any]:
        """The evidence as it is written to the log."""
        return {
            "kind": str(self.kind),
            "source": self.source,
            "position_m": self.position_m,
            "heading_rad": self.heading_rad,
        }

    @classmethod
    def of(cls, row: dict[str, Any]) -> Self:
        """Evidence of a row of the log."""
        return cls(Kind(row["kind"]), row["source"], row["position_m"], row["heading_rad"])


SIMULATED = PoseEvidence(Kind.MEASURED, "simulator", 0.0, 0.0)


def evidence_of_old_log(run: RunConfig, backend: str, has_imu: bool) -> PoseEvidence:
    """Return the evidence of a log that does not state it.

    Args:
        run: its run.
        backend: ``sim``, or the ports of the servos.
        has_imu: whether the robot has an IMU.

    """
    if run.pose == "camera":
        return PoseEvidence(Kind.MEASURED, "camera")
    if backend.startswith("sim") and run.pose_is_true:
        return SIMULATED
    return PoseEvidence(Kind.DEAD_RECKONED, "imu" if run.pose == "imu" or has_imu else "joints")
