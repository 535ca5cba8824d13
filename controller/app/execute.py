"""Carry out a prepared run: folder, log, link, loop, summary."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from controller.app.backend import Backend, metal, simulated
from controller.app.drive import Drive, Outcome, PoseSource, Watcher
from controller.app.prepare import Prepared
from controller.app.report.build import write_summary
from controller.runtime.dead_reckoning import DeadReckoning
from drivers.recovery import Recovery
from drivers.safe_link import SafeLink
from drivers.safety import SafetyLimits
from drivers.telemetry.reader import read_log
from drivers.telemetry.record import PlanSummary
from drivers.telemetry.writer import RunLog


@dataclass(frozen=True, slots=True)
class Finished:
    """What a run left behind."""

    outcome: Outcome
    log: Path
    summary: dict[str, object]


def execute(
    prepared: Prepared,
    folder: Path,
    port: str | None = None,
    watchers: tuple[Watcher, ...] = (),
    confirm: Callable[[str], bool] | None = None,
) -> Finished:
    """Run on ``port``, or on the simulator where it is None; nothing else differs.

    ``confirm`` asks an operator whether an interrupted chain may go on (``safety.recovery``).

    Raises:
        InputError: the plan breaks a limit, the port is not there, the servos are not the robot's.

    """
    ahead = prepared.forecast()
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
            plan=PlanSummary(
                path_m=prepared.path.position(np.linspace(0.0, prepared.path.length_m, 200)),
                waypoints_m=np.array(prepared.run.waypoints_m),
                waypoint_radius_m=prepared.run.waypoint_radius_m,
                predicted_speed_m_s=prepared.gain * ahead.pulse_m / ahead.duration_s,
                states=None if prepared.run.motion == "serpenoid" else prepared.library.counts,
            ),
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
            say=lambda text: log.event(clock.now_s(), "recovery", text, "warning"),
        )
        limits = SafetyLimits.from_config(prepared.robot, safety)
        drive = Drive(
            link=SafeLink(backend.chain, limits, clock, recovery),
            clock=clock,
            pose=_pose_source(prepared, backend),
            pilot=prepared.pilot(),
            log=log,
            robot=prepared.robot,
            run=prepared.run,
            gain=prepared.gain,
            watchers=watchers,
            wire_busy_s=backend.wire_busy_s,
        )
        outcome = drive.run()
    numbers = dict(write_summary(read_log(log_path), folder))
    return Finished(outcome, log_path, numbers)


def _torque_constant_n_m_a(model: str) -> float:
    """Of the servo's specification table; NaN where the simulator does not know the model."""
    from sim.bus.motor import MOTORS  # noqa: PLC0415  only for this figure

    return MOTORS[model].torque_constant_n_m_a if model in MOTORS else float("nan")


def _pose_source(prepared: Prepared, backend: Backend) -> PoseSource:
    measured = backend.pose
    if measured is not None:
        return lambda state: measured()
    return DeadReckoning(
        prepared.robot,
        prepared.world.friction,
        prepared.run.start_m,
        prepared.start_heading_rad,
    )
