"""The row of the log for a control cycle whose goals the safety layer has vetted."""

from snakewalk.config.arrays import Floats
from snakewalk.controller.runlog.record import MotorEnergy
from snakewalk.controller.runlog.writer import RunLog
from snakewalk.controller.runtime.loop import Tick
from snakewalk.drivers.link import VettedLink
from snakewalk.drivers.types import JointState


def log_cycle(
    log: RunLog,
    link: VettedLink,
    state: JointState,
    goal_rad: Floats,
    *,
    tick: Tick,
    wire_busy_s: float,
    energy: MotorEnergy,
    yield_rad: Floats | None = None,
) -> Floats:
    """Log a cycle and the verdict on its goals; returns the goals (J,) that were sent.

    Without a verdict they are the measured positions.
    """
    verdict = link.last_verdict
    clamped = () if verdict is None else verdict.clamped.nonzero()[0].tolist()
    sent_rad = state.position_rad if verdict is None else verdict.goal_rad
    log.cycle(
        tick.deadline_s,
        goal_rad,
        sent_rad,
        state,
        deadline_s=tick.deadline_s,
        lateness_s=tick.lateness_s,
        wire_busy_s=wire_busy_s,
        **energy._asdict(),
        yield_rad=yield_rad,
        verdict="veto" if link.tripped else "clamp" if clamped else "pass",
        reason=link.tripped or "",
        joints=clamped,
    )
    return sent_rad
