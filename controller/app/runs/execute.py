"""Carry out a prepared run: folder, log, link, loop, summary."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from snakewalk.controller.app.report.build import write_summary
from snakewalk.controller.app.runs.backend import metal, simulated
from snakewalk.controller.app.runs.job import Job
from snakewalk.controller.app.runs.pose_source import pose_faults, pose_source
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.runlog.writer import RunLog
from snakewalk.controller.runtime.drive import Drive, Outcome, Watcher
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.recovery import Recovery
from snakewalk.drivers.safety.safe_link import SafeLink


@dataclass(frozen=True, slots=True)
class Finished:
    """What a run left behind."""

    outcome: Outcome
    log: Path
    summary: dict[str, object]
    pose: dict[str, object]
    """Where a camera or the joints measured the pose: what they did, and how far off they were."""


def execute(
    prepared: Job,
    folder: Path,
    port: str | None = None,
    watchers: tuple[Watcher, ...] = (),
    confirm: Callable[[str], bool] | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> Finished:
    """Run on ``port``, or on the simulator where it is None; nothing else differs.

    ``confirm`` asks an operator whether an interrupted chain may go on (``safety.recovery``);
    ``say`` is told what the motion decides by itself: a slower rate, an operator's change.

    Raises:
        InputError: the plan breaks a limit, the port is not there, the servos are not the robot's.

    """
    pose_faults(prepared.run, prepared.robot, prepared.world, metal=port is not None)
    plan = prepared.judged()
    if port is None:
        laid = prepared.laid()
        backend = simulated(
            prepared.run,
            prepared.robot,
            prepared.world,
            prepared.ground,
            laid,
        )
    else:
        laid = None
        backend = metal(prepared.run, prepared.robot, port)
    log_path = folder / "log.mcap"
    with RunLog(log_path) as log:
        log.config(
            prepared.run,
            prepared.robot,
            prepared.world,
            backend=backend.name,
            plan=plan,
            ground=prepared.ground,
            laid=laid,
            torque_constant_n_m_a=_torque_constant_n_m_a(prepared.robot.servo.model),
        )
        safety, clock = prepared.run.safety, backend.clock
        recovery = Recovery(
            backend.chain,
            backend.chain.port,
            policy=safety.recovery,
            patience_s=safety.recovery_time_s,
            confirm=confirm,
            on_event=lambda text: log.event(clock.now_s(), "recovery", text, "warning"),
        )

        def note(kind: str, text: str) -> None:
            log.event(clock.now_s(), kind, text)
            say(text)

        limits = SafetyLimits.from_config(prepared.robot, safety)
        with pose_source(prepared, backend, note) as source:
            drive = Drive(
                link=SafeLink(backend.chain, limits, clock, recovery),
                clock=clock,
                pose=source.ask,
                pilot=prepared.guide(note),
                log=log,
                robot=prepared.robot,
                run=prepared.run,
                gain=prepared.gain,
                watchers=watchers,
                wire_busy_s=backend.wire_busy_s,
                say=say,
            )
            outcome = drive.run()
    numbers = dict(write_summary(read_log(log_path), folder))
    return Finished(outcome, log_path, numbers, source.found)


def _torque_constant_n_m_a(model: str) -> float:
    """Of the servo's specification table; NaN where the simulator does not know the model."""
    from snakewalk.sim.servo.motor import MOTORS  # noqa: PLC0415  only for this figure

    return MOTORS[model].torque_constant_n_m_a if model in MOTORS else float("nan")
