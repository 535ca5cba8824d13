"""Whether the chain names sensors that show a constant value for long."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from snakewalk.config.faults import FaultPlan, ReadingFault
from tests.campaign.rig import ROBOT

LONG_S = 2.0
"""Duration from which a constant reading has to be named."""
_WORDS = {
    "Present Current": "current",
    "Present Velocity": "velocity",
    "Present Position": "",
    "Present Temperature": "temperature",
}
"""Word of a line that names the sensor; a constant position has several descriptions."""


@dataclass
class SensorCounts:
    """Long constant readings of a scenario."""

    noticed: int = 0
    ended_otherwise: int = 0
    """A trip for another reason came first."""
    unnoticed: list[str] = field(default_factory=list)


def judge_sensors(
    plan: FaultPlan,
    reports: Iterable[str],
    trips: Sequence[tuple[float, str]],
    end_s: float,
) -> SensorCounts:
    """Compare the constant readings of a plan with all lines of a run.

    Args:
        plan: faults of the run.
        reports: lines of the chain.
        trips: times and reasons of trips.
        end_s: end of the run; a reading that lasts beyond it is not judged.

    """
    counts = SensorCounts()
    lines = [*reports, *(reason for _, reason in trips)]
    for fault in plan.fault:
        if not isinstance(fault, ReadingFault) or fault.for_s is None or fault.for_s < LONG_S:
            continue
        until_s = fault.at_s + fault.for_s
        if until_s > end_s:
            continue
        for servo_id in fault.ids:
            label = ROBOT.joint_label(ROBOT.servo_ids.index(servo_id))
            word = _WORDS[fault.register_name]
            if any(label in line and word in line for line in lines):
                counts.noticed += 1
            elif any(fault.at_s <= time_s <= until_s for time_s, _ in trips):
                counts.ended_otherwise += 1
            else:
                text = f"unnoticed: {fault.register_name} of {label} is {fault.value}"
                counts.unnoticed.append(text)
    return counts
