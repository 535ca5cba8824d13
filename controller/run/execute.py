"""Execution of a prepared run: folder, log, link, loop, summary."""

import json
import shlex
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, cast

from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import DeviationConfig, RunConfig, SafetyConfig
from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.console.plugins import require
from snakewalk.controller.console.result_files import (
    LOG,
    SUMMARY,
    atomic_write,
    cleared_folder,
    refuse_another_run,
)
from snakewalk.controller.metrics.summary import RunSummary, summary
from snakewalk.controller.metrics.travel import Travel, travel
from snakewalk.controller.motion.command import Refused
from snakewalk.controller.motion.compliance import chatters
from snakewalk.controller.motion.source import MotionSource
from snakewalk.controller.run.backend import (
    Backend,
    RehearsedPort,
    is_pseudo_terminal,
    is_split,
    metal,
    on_ports,
    real_ports,
)
from snakewalk.controller.run.map_provider import MapProvider, map_faults, map_provider
from snakewalk.controller.run.observer_watch import ObserverWatch, Watcher
from snakewalk.controller.run.pose_provider import (
    PoseProvider,
    pose_evidence,
    pose_faults,
    pose_provider,
)
from snakewalk.controller.run.prepared_run import HasWaypoints, PreparedRun
from snakewalk.controller.run.run_ending import RunEnding
from snakewalk.controller.run.watchers import SHADOW
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.runlog.record import InitialPose, RunRecord, Winding
from snakewalk.controller.runlog.writer import RunLog
from snakewalk.controller.runtime.drive import (
    CycleObserver,
    Drive,
    OnEvent,
    OnProgress,
    Outcome,
    Sensors,
)
from snakewalk.controller.runtime.friction_estimator import FrictionEstimator
from snakewalk.controller.walk.course import OnCourse
from snakewalk.controller.walk.live_course import LiveCourse, MotionOnCourse
from snakewalk.controller.walk.twin import UsesFriction
from snakewalk.drivers.chain.recheck import Recheck
from snakewalk.drivers.clock import Clock
from snakewalk.drivers.errors import DriverError, notes_of
from snakewalk.drivers.priority import raised_priority
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.recovery import Recovery
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.safety.stop_button import StopButton
from snakewalk.drivers.safety.stop_output import StopCall, StopOutput, parse_stop_output
from snakewalk.drivers.safety.trip_hold import TripHold
from snakewalk.sim.servo.motor import known_motors, p_gain_per_rad


class RunObserver(CycleObserver, Protocol):
    """An observer of every cycle that also reports at the end of the run."""

    def end(self, time_s: float) -> None:
        """Report; torque is off."""
        ...


@dataclass(frozen=True, slots=True)
class Finished:
    """Results of a run."""

    outcome: Outcome
    log: Path
    record: RunRecord
    """The log, read once for summary and report."""
    summary: RunSummary
    pose: PoseProvider
    """Pose source, and its accuracy if known."""
    map: MapProvider
    """Map source and its accuracy, for a run that maps its ground."""
    source: MotionSource
    """The motion that ran, at its end."""
    travel: Travel
    """Travel of the centre of mass, which gives the summary's speed."""
    ending: RunEnding
    """State of torque and log, for the notes of a later error."""


def execute(
    prepared: PreparedRun,
    folder: Path,
    port: str | RehearsedPort | None = None,
    *,
    force: bool = False,
    stoppable: bool = True,
    view: Watcher | None = None,
    shadow: bool = False,
    confirm: Callable[[str], bool] | None = None,
    stop_requested: Callable[[], str | None] = lambda: None,
    waypoint_commands: Callable[[], Iterable[str | Refused]] | None = None,
    on_progress: OnProgress = lambda progress: None,
    on_event: OnEvent = lambda kind, text: None,
) -> Finished:
    """Run on ``port``, or on the simulator where it is None; nothing else differs.

    ``port`` is a device or a URL, ``1-8=PORT,9-16=PORT`` where segments of the chain are on ports
    of their own, or ``robot``, whose file says so; a port ``sim`` has simulated servos. A
    ``RehearsedPort`` serves a simulated robot in this process as if it were real.

    The folder is made; one that holds a run's files is refused without ``force``, which deletes
    them when the new log begins. One that another run uses is always refused. A ``stoppable`` run
    has a button that ``snakewalk stop`` presses; the simulated runs of a study have none. ``view``
    observes the run: a page that shows it, a ROS node that publishes it. With ``shadow`` a
    simulated chain follows the same goals, and log and ``on_event`` report the differences.
    ``confirm`` asks an operator whether an interrupted chain may go on (``safety.recovery``).
    ``stop_requested`` is called in every read and write and returns why torque goes off, or None.
    ``waypoint_commands`` is called in every cycle and returns a person's changes of the waypoints,
    as ``LiveCourse`` accepts them: the run then holds at the last one until it is ended.
    ``on_progress`` is called after each cycle, ``on_event`` with decisions of the motion: a slower
    rate, an operator's change.

    Raises:
        InputError: the plan breaks a limit, the port is not there, the servos are not the robot's,
            the folder holds a run, or a shadow is asked for on ground where it means nothing.
        KeyboardInterrupt: of an operator; its notes report the state of torque, and the log's path.

    """
    refuse_another_run(folder, force)
    rehearsed = None if isinstance(port, str | None) else port
    name = port if isinstance(port, str | None) else port.name
    ending = RunEnding()
    run = _Execution(
        prepared, folder, name, rehearsed, force, ending, view, shadow, confirm, stop_requested,
        waypoint_commands, on_progress, on_event,
    )  # fmt: skip
    with ending.noted():
        return run.carry_out(stoppable=stoppable)


@dataclass(frozen=True, slots=True)
class _Execution:
    """Arguments of ``execute``."""

    prepared: PreparedRun
    folder: Path
    port: str | None
    rehearsed: RehearsedPort | None
    force: bool
    ending: RunEnding
    view: Watcher | None
    shadow: bool
    confirm: Callable[[str], bool] | None
    stop_requested: Callable[[], str | None]
    waypoint_commands: Callable[[], Iterable[str | Refused]] | None
    on_progress: OnProgress
    on_event: OnEvent

    def carry_out(self, *, stoppable: bool) -> Finished:
        prepared, port, view = self.prepared, self.port, self.view
        robot = prepared.robot if self.rehearsed else on_ports(prepared.robot, port)
        body_simulated = port is None or is_split(robot)
        _check(prepared, metal=not body_simulated, shadow=self.shadow)
        plan = prepared.check_plan()
        initial_pose = prepared.initial_pose() if body_simulated else None
        backend = self._backend(robot, initial_pose)
        evidence = pose_evidence(prepared, backend)
        if not evidence.is_measured:
            LOGGER.warning(
                "pose: %s: distances and arrivals are not measured; give a pose source with --pose",
                evidence.text,
            )
        log_path = self.folder / LOG
        LOGGER.debug(
            "%s on %s; the plan keeps the limits; log: %s",
            *(prepared.robot.name, backend.name, log_path),
        )
        torque_constant_n_m_a, winding = motor_constants(prepared.robot)
        ports = None if port is None else real_ports(robot) or [port]
        made = StopButton(prepared.run.name, ports, self.folder) if stoppable else nullcontext()
        with made as button, cleared_folder(self.folder, self.force):
            self.ending.log = log_path
            with RunLog(log_path, None if view is None else view.on_row) as log:
                if button is not None and ports and self.rehearsed is None:
                    LOGGER.info(
                        "to stop it: snakewalk stop --port %s", shlex.quote(",".join(ports[:1]))
                    )
                if view is not None and button is not None:
                    view.on_button(button.path)
                log.config(
                    prepared.run,
                    robot,
                    prepared.world,
                    backend=backend.name,
                    plan=plan,
                    ground=prepared.ground,
                    initial_pose=initial_pose,
                    torque_constant_n_m_a=torque_constant_n_m_a,
                    winding=winding,
                    pose_evidence=evidence,
                    port_is_pseudo_terminal=(
                        is_pseudo_terminal(ports) if self.rehearsed is None else True
                    ),
                )
                with _end_logged(self.ending, log, backend.clock):
                    ran = self._loop(robot, backend, log, button, initial_pose)
            outcome, pose, mapped, source = ran
            LOGGER.debug("ran %.2f s; tripped: %s", outcome.duration_s, outcome.tripped or "no")
            record, numbers, moved = _read_back(log_path)
        return Finished(
            outcome, log_path, record, numbers, pose, mapped, source, moved, self.ending
        )

    def _backend(self, robot: RobotConfig, initial_pose: InitialPose | None) -> Backend:
        prepared, port = self.prepared, self.port
        if self.rehearsed is not None:
            return self.rehearsed.open(prepared.run, robot)
        if initial_pose is None:
            return metal(prepared.run, robot, port or "")
        from snakewalk.controller.run.external import simulated_backend  # noqa: PLC0415  slow to import

        make = simulated_backend.simulated if port is None else simulated_backend.split
        return make(prepared.run, robot, prepared.world, prepared.ground, initial_pose)

    def _loop(
        self,
        robot: RobotConfig,
        backend: Backend,
        log: RunLog,
        button: StopButton | None,
        initial_pose: InitialPose | None,
    ) -> tuple[Outcome, PoseProvider, MapProvider, MotionSource]:
        prepared, view, safety = self.prepared, self.view, self.prepared.run.safety
        clock = backend.clock

        def warn(kind: str, text: str) -> None:
            log.event(clock.now_s(), kind, text, "warning")
            LOGGER.warning("%s", text)

        def log_event(kind: str, text: str) -> None:
            log.event(clock.now_s(), kind, text)
            self.on_event(kind, text)

        backend.chain.on_event = lambda text: warn("bus", text)
        observers = ObserverWatch(view, safety.lost_observer, warn)
        shown = {} if view is None else {"on_picture": view.on_picture}
        with (
            pose_provider(prepared, backend, log_event, **shown) as pose,
            map_provider(prepared, backend, pose.measure, self.folder, log_event) as mapped,
            _stop_output(safety, backend) as output,
            ExitStack() as workers,
        ):
            source = prepared.make_source(log_event)
            friction = self._helped(source, backend, pose, workers)
            evidence = pose_evidence(prepared, backend)
            if self.waypoint_commands is not None:
                source = _live(prepared, source, self.waypoint_commands, log_event)
            link = SafeLink(
                backend.chain,
                SafetyLimits.from_config(robot, safety),
                clock,
                self._recovery(backend, warn),
                observers.with_stop(self.stop_requested, button),
                lambda text: warn("safety", text),
                TripHold.from_config(robot, safety),
                output,
            )
            self.ending.link = link
            start = initial_pose if self.port is None else None
            beside = _shadow(prepared, start, log, self.on_event) if self.shadow else None
            drive = Drive(
                link=link,
                clock=clock,
                sensors=Sensors(
                    *(mapped.measure, backend.wire_busy_s, backend.energy, pose.health),
                    pose_sd_m=evidence.position_m or 0.0,
                    pose_is_measured=evidence.is_measured,
                ),
                motion=source,
                log=log,
                robot=prepared.robot,
                run=prepared.run,
                gain=prepared.gain,
                observer=beside,
                friction=friction,
                on_progress=observers.with_report(self.on_progress),
                on_event=self.on_event,
            )
            on_wire = self.port is not None and self.rehearsed is None
            with raised_priority() if on_wire else nullcontext():
                outcome = drive.run()
            self.ending.is_over = True
            end = outcome.tripped or "it had come to its end"
            if button is not None:
                button.report_end(end)
            if beside is not None:  # for many seconds, in which the port is still open
                beside.end(clock.now_s())
            if button is not None:
                button.end(end)
        return outcome, pose, mapped, source

    def _helped(
        self, source: MotionSource, backend: Backend, pose: PoseProvider, workers: ExitStack
    ) -> FrictionEstimator | None:
        """Let a walk use a second body; return the estimator of the friction under it."""
        if not isinstance(source, UsesFriction):
            return None
        from snakewalk.controller.run.external import second_body  # noqa: PLC0415  slow to import

        prepared = self.prepared
        friction = second_body.second_body(prepared, source, backend, pose)
        if self.port is not None and pose_evidence(prepared, backend).is_measured:
            now_s = None if self.rehearsed is None else backend.clock.now_s
            second_body.use_worker(prepared, source, now_s, workers)
        return friction

    def _recovery(self, backend: Backend, warn: Callable[[str, str], None]) -> Recovery[Recheck]:
        safety = self.prepared.run.safety
        return Recovery(
            backend.chain,
            policy=safety.recovery,
            patience_s=safety.recovery_time_s,
            overload_reboots=safety.overload_reboots,
            confirm=self.confirm,
            on_event=lambda text: warn("recovery", text),
        )


def _stop_output(
    safety: SafetyConfig, backend: Backend
) -> AbstractContextManager[StopOutput | None]:
    if safety.stop_output is None:
        return nullcontext()
    if backend.open_supply is not None:
        return StopCall("simulated supply", backend.open_supply)
    return parse_stop_output(safety.stop_output)


def _live(
    prepared: PreparedRun,
    source: MotionSource,
    commands: Callable[[], Iterable[str | Refused]],
    on_event: OnEvent,
) -> LiveCourse:
    """Let an operator command the waypoints.

    Raises:
        InputError: the motion follows no course.

    """
    if not isinstance(prepared, HasWaypoints) or not isinstance(source, OnCourse):
        raise InputError(f"run {prepared.run.name}: its motion has no waypoints that can be set")
    return LiveCourse(cast(MotionOnCourse, source), commands, prepared.check_waypoint, on_event)


@contextmanager
def _end_logged(ending: RunEnding, log: RunLog, clock: Clock) -> Iterator[None]:
    """Log what ended a run early."""
    try:
        yield
    except DriverError as fault:
        if ending.link is not None and ending.link.tripped is not None:
            log.event(clock.now_s(), "interrupt", str(fault), "warning")
        raise
    except (KeyboardInterrupt, SystemExit) as stop:
        if not ending.is_over:
            torque = "; ".join(dict.fromkeys([*notes_of(stop), ending.torque]))
            log.event(clock.now_s(), "interrupt", torque, "warning")
        raise


def _read_back(log: Path) -> tuple[RunRecord, RunSummary, Travel]:
    record = read_log(log, is_ours=True)
    moved = travel(record)
    return record, write_summary(summary(record, moved), log.parent), moved


def write_summary(numbers: RunSummary, out_dir: Path) -> RunSummary:
    """Write ``out_dir/summary.json`` and return the numbers; needs no matplotlib."""
    text = json.dumps(numbers.to_dict(), indent=2, ensure_ascii=False, allow_nan=False)
    with atomic_write(out_dir / SUMMARY) as part:
        part.write_text(text + "\n", encoding="utf-8")
    return numbers


def _check(prepared: PreparedRun, *, metal: bool, shadow: bool) -> None:
    """Reject a run for reasons that no plan shows: pose, compliance, a shadow's ground."""
    if metal and prepared.run.deviation != DeviationConfig():
        raise InputError(
            f"run {prepared.run.name}: deviation: changes a simulated robot only; remove the "
            "table, or --port"
        )
    pose_faults(prepared.run, prepared.robot, prepared.world, metal=metal)
    map_faults(prepared, metal=metal)
    check_compliance(prepared.run, prepared.robot)
    if shadow:
        require_extra("a shadow needs", "mujoco")
        _shadow_plugin().check(prepared.world)


def _shadow(
    prepared: PreparedRun, start: InitialPose | None, log: RunLog, on_event: OnEvent
) -> RunObserver:
    run, robot, world = prepared.run, prepared.robot, prepared.world
    observer: RunObserver = _shadow_plugin()(
        run, robot, world, prepared.ground, start, log, on_event
    )
    return observer


def _shadow_plugin() -> Any:
    return require("observer", SHADOW, "--shadow").load()


def check_compliance(run: RunConfig, robot: RobotConfig) -> None:
    """Reject compliance that safety would clamp, or that would chatter at a blocked shaft.

    Raises:
        InputError: one line for each fault.

    """
    config = run.compliance
    if config is None:
        return
    faults, allowed = [], run.safety.goal_rate_rad_s - robot.joint_speed_limit_rad_s
    if config.yield_rate_rad_s > allowed:
        faults.append(
            f"run {run.name}: compliance.yield_rate_rad_s {config.yield_rate_rad_s:g}: together "
            f"with the robot's joint_speed_limit_rad_s {robot.joint_speed_limit_rad_s:g} it is "
            f"over safety.goal_rate_rad_s {run.safety.goal_rate_rad_s:g}; at most {allowed:g}"
        )
    chatter = chatters(config, _current_gain_a_rad(robot), 1.0 / run.cycle_hz)
    if chatter is not None:
        faults.append(f"run {run.name}: {chatter}")
    if faults:
        raise InputError(faults)


def _current_gain_a_rad(robot: RobotConfig) -> float:
    """Current of the stiffest joint per radian of lead; 0 without a known motor."""
    gains_a_rad = [0.0]
    for motor, gain in zip(known_motors(robot), robot.position_p_gains, strict=True):
        if motor is not None:
            per_rad = float(p_gain_per_rad(gain, motor))
            gains_a_rad.append(per_rad * robot.servo.supply_v / motor.resistance_ohm)
    return max(gains_a_rad)


def motor_constants(robot: RobotConfig) -> tuple[float, Winding | None]:
    """Torque constant (N m/A) and winding of the robot's servos.

    NaN and None if the model has no motor, or there are several models.
    """
    motors = set(known_motors(robot))
    motor = motors.pop()
    if motor is None or motors:
        return float("nan"), None
    return motor.torque_constant_n_m_a, Winding(motor.resistance_ohm, motor.back_emf_v_s)
