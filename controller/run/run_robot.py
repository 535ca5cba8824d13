"""A run in steps: check, open, drive, finish."""

import json
import shlex
from collections.abc import Callable, Iterable, Iterator
from contextlib import (
    AbstractContextManager,
    ExitStack,
    contextmanager,
    nullcontext,
)
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Protocol, cast

from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import DeviationConfig, SafetyConfig
from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.console.plugins import require
from snakewalk.controller.console.result_files import (
    LOG,
    SUMMARY,
    cleared_folder,
    refuse_another_run,
    write_result,
)
from snakewalk.controller.metrics.summary import RunSummary, summary
from snakewalk.controller.metrics.travel import travel
from snakewalk.controller.motion.command import Refused
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
from snakewalk.controller.run.observers import SHADOW, Observers
from snakewalk.controller.run.pose_provider import (
    PoseProvider,
    pose_evidence,
    pose_faults,
    pose_provider,
)
from snakewalk.controller.run.prepared_run import AsksForPort, HasWaypoints, PreparedRun
from snakewalk.controller.run.request import RunEnding, RunRequest, RunResult
from snakewalk.controller.run.servo_setup import check_compliance, motor_constants
from snakewalk.controller.runlog.evidence import PoseEvidence
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.runlog.record import Header, InitialPose, PlanSummary
from snakewalk.controller.runlog.row_line import VERDICT
from snakewalk.controller.runlog.writer import RunLog
from snakewalk.controller.runtime.drive import (
    CycleObserver,
    Drive,
    OnEvent,
    Outcome,
    Sensors,
    Watchers,
)
from snakewalk.controller.runtime.friction_estimator import FrictionEstimator
from snakewalk.controller.walk.course import OnCourse
from snakewalk.controller.walk.live_course import LiveCourse, MotionOnCourse
from snakewalk.controller.walk.twin import UsesFriction
from snakewalk.drivers.clock import Clock
from snakewalk.drivers.errors import DriverError, notes_of
from snakewalk.drivers.priority import raised_priority
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.recovery import Recovery
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.safety.stop_button import StopButton
from snakewalk.drivers.safety.stop_output import StopCall, StopOutput, parse_stop_output
from snakewalk.drivers.safety.trip_hold import TripHold


class ShadowPlugin(CycleObserver, Protocol):
    """A simulated chain that follows the goals of the run, as a plug-in provides it."""

    def end(self, time_s: float) -> None:
        """Report; torque is off."""
        ...


@dataclass(frozen=True, slots=True)
class CheckedRun:
    """Facts of a request that may be opened."""

    robot: RobotConfig
    """Robot with the ports of its segments."""
    port: str | None
    """Name of the port; None: the simulator."""
    rehearsed: RehearsedPort | None
    ports: list[str] | None
    """Ports of real servos; None: the simulator."""
    plan: PlanSummary
    initial_pose: InitialPose | None
    """Pose in which the simulated body starts; None if no servo is simulated."""


@dataclass(frozen=True, slots=True)
class OpenedRun:
    """Parts of a run whose torque is off."""

    ending: RunEnding
    backend: Backend
    evidence: PoseEvidence
    button: StopButton | None
    observers: Observers
    log: RunLog
    pose: PoseProvider
    map: MapProvider
    source: MotionSource
    friction: FrictionEstimator | None
    link: SafeLink
    shadow: ShadowPlugin | None
    is_on_wire: bool
    """Whether real time counts."""


def run_robot(request: RunRequest) -> RunResult:
    """Run on the request's port, or on the simulator, in the same steps.

    Raises:
        InputError: the plan breaks a limit. The port is not there. The servos are not the robot's.
            The folder holds a run or is used by one. A shadow is requested on ground where it
            means nothing.
        KeyboardInterrupt: of an operator; its notes report the state of torque, and the log's path.

    """
    ending = RunEnding()
    with ending.noted(), ExitStack() as place:
        checked = check(request)
        folder = request.folder or Path(place.enter_context(TemporaryDirectory()))
        with open_run(request, checked, folder, ending, place) as opened:
            outcome = drive(request, opened)
        LOGGER.debug("ran %.2f s; tripped: %s", outcome.duration_s, outcome.tripped or "no")
        return finish(request, opened, outcome, folder)


def check(request: RunRequest) -> CheckedRun:
    """Reject a run that may not begin; opens and writes nothing.

    Raises:
        InputError: folder, port, pose, map, compliance, shadow or plan have a fault.

    """
    prepared = request.prepared
    port = request.port
    if request.folder is not None:
        refuse_another_run(request.folder, request.overwrite)
    rehearsed = None if isinstance(port, str | None) else port
    name = port if isinstance(port, str | None) else port.name
    robot = prepared.robot if rehearsed else on_ports(prepared.robot, name)
    is_simulated = name is None or is_split(robot)
    if not is_simulated and prepared.run.deviation != DeviationConfig():
        raise InputError(
            f"run {prepared.run.name}: deviation: changes a simulated robot only; remove the "
            "table, or --port"
        )
    pose_faults(prepared.run, prepared.robot, prepared.world, metal=not is_simulated)
    map_faults(prepared, metal=not is_simulated)
    check_compliance(prepared.run, prepared.robot)
    if request.shadow:
        require_extra("a shadow needs", "mujoco")
        _shadow_plugin().check(prepared.world)
    plan = prepared.check_plan()
    if not is_simulated and isinstance(prepared, AsksForPort):
        prepared.check_for_port()
    return CheckedRun(
        robot=robot,
        port=name,
        rehearsed=rehearsed,
        ports=None if name is None else real_ports(robot) or [name],
        plan=plan,
        initial_pose=prepared.initial_pose() if is_simulated else None,
    )


@contextmanager
def open_run(
    request: RunRequest, checked: CheckedRun, folder: Path, ending: RunEnding, place: ExitStack
) -> Iterator[OpenedRun]:
    """Open port, log, pose, map and link of a run.

    The port is the first: if it fails, the files in the folder stay. ``place`` keeps the folder for
    this run until its log is read.

    Raises:
        InputError: one of them cannot be opened.

    """
    prepared = request.prepared
    observers = request.observers or Observers()
    safety = prepared.run.safety
    backend = _backend(prepared, checked)
    evidence = _evidence(prepared, backend)
    path = folder / LOG
    names = (prepared.robot.name, backend.name, path)
    LOGGER.debug("%s on %s; the plan keeps the limits; log: %s", *names)
    with ExitStack() as stack:
        button = None
        if request.stoppable:
            button = stack.enter_context(StopButton(prepared.run.name, checked.ports, folder))
        place.enter_context(cleared_folder(folder, request.overwrite))
        ending.log = path
        on_row = observers.on_row if observers else None
        log = stack.enter_context(RunLog(path, on_row, request.log_limits))
        if button is not None:
            _tell_how_to_stop(checked)
            observers.on_button(button.path)
        _log_header(prepared, checked, backend, evidence, log)
        clock = backend.clock
        stack.enter_context(_end_logged(ending, log, clock))

        def warn(kind: str, text: str) -> None:
            log.event(clock.now_s(), kind, text, "warning")
            LOGGER.warning("%s", text)

        def log_event(kind: str, text: str) -> None:
            log.event(clock.now_s(), kind, text)
            request.on_event(kind, text)

        backend.chain.on_event = lambda text: warn("bus", text)
        observers.watch(safety.lost_observer, warn)
        opened_pose = pose_provider(prepared, backend, log_event, observers.on_picture)
        pose = stack.enter_context(opened_pose)
        opened_map = map_provider(prepared, backend, pose.measure, folder, log_event)
        mapped = stack.enter_context(opened_map)
        output = stack.enter_context(_stop_output(safety, backend))
        source = prepared.make_source(log_event)
        friction = _use_second_body(prepared, checked, source, backend, pose, stack)
        if request.waypoint_commands is not None:
            source = _live_course(prepared, source, request.waypoint_commands, log_event)
        link = SafeLink(
            backend.chain,
            SafetyLimits.from_config(checked.robot, safety),
            clock,
            _recovery(request, backend, warn),
            _stop_requested(request, button, observers),
            lambda text: warn("safety", text),
            TripHold.from_config(checked.robot, safety),
            output,
        )
        ending.link = link
        shadow = _shadow(request, checked, log) if request.shadow else None
        yield OpenedRun(
            ending=ending,
            backend=backend,
            evidence=pose_evidence(prepared, backend),
            button=button,
            observers=observers,
            log=log,
            pose=pose,
            map=mapped,
            source=source,
            friction=friction,
            link=link,
            shadow=shadow,
            is_on_wire=checked.port is not None and checked.rehearsed is None,
        )


def drive(request: RunRequest, opened: OpenedRun) -> Outcome:
    """Switch torque on, run the motion to its end, and switch torque off."""
    prepared = request.prepared
    backend = opened.backend
    loop = Drive(
        link=opened.link,
        clock=backend.clock,
        sensors=Sensors(
            opened.map.measure,
            backend.wire_busy_s,
            backend.energy,
            opened.pose.health,
            pose_sd_m=opened.evidence.position_m or 0.0,
            pose_is_measured=opened.evidence.is_measured,
        ),
        motion=opened.source,
        log=opened.log,
        plan=prepared,
        watchers=Watchers(
            opened.shadow,
            opened.observers.reporting(request.on_progress),
            request.on_event,
        ),
        friction=opened.friction,
    )
    with raised_priority() if opened.is_on_wire else nullcontext():
        outcome = loop.run()
    opened.ending.is_over = True
    end = outcome.tripped or "it had come to its end"
    if opened.button is not None:
        opened.button.report_end(end)
    if opened.shadow is not None:  # for many seconds, in which the port is still open
        opened.shadow.end(backend.clock.now_s())
    if opened.button is not None:
        opened.button.end(end)
    return outcome


def finish(request: RunRequest, opened: OpenedRun, outcome: Outcome, folder: Path) -> RunResult:
    """Read the log back, write the summary, and send the verdict to the observers."""
    log = folder / LOG
    record = read_log(log, is_snakewalk_log=True)
    moved = travel(record)
    numbers = write_summary(summary(record, moved), folder)
    result = RunResult(
        prepared=request.prepared,
        outcome=outcome,
        record=record,
        summary=numbers,
        travel=moved,
        pose=opened.pose,
        map=opened.map,
        source=opened.source,
        ending=opened.ending,
        saved_log=None if request.folder is None else log,
    )
    opened.observers.on_row(VERDICT, json.dumps(result.verdict.to_dict()).encode())
    return result


def write_summary(numbers: RunSummary, folder: Path) -> RunSummary:
    """Write ``summary.json`` into a folder and return the numbers."""
    text = json.dumps(numbers.to_dict(), indent=2, ensure_ascii=False, allow_nan=False)
    write_result(folder / SUMMARY, text + "\n")
    return numbers


def _backend(prepared: PreparedRun, checked: CheckedRun) -> Backend:
    run = prepared.run
    robot = checked.robot
    if checked.rehearsed is not None:
        return checked.rehearsed.open(run, robot)
    if checked.initial_pose is None:
        return metal(run, robot, checked.port or "")
    from snakewalk.controller.run.external import simulated_backend  # noqa: PLC0415  slow to import

    make = simulated_backend.simulated if checked.port is None else simulated_backend.split
    return make(run, robot, prepared.world, prepared.ground, checked.initial_pose)


def _evidence(prepared: PreparedRun, backend: Backend) -> PoseEvidence:
    """Return how the poses are known, and warn if nothing measures them."""
    evidence = pose_evidence(prepared, backend)
    if not evidence.is_measured:
        LOGGER.warning(
            "pose: %s: distances and arrivals are not measured; give a pose source with --pose",
            evidence.text,
        )
    return evidence


def _tell_how_to_stop(checked: CheckedRun) -> None:
    if checked.ports and checked.rehearsed is None:
        LOGGER.info("to stop it: snakewalk stop --port %s", shlex.quote(checked.ports[0]))


def _log_header(
    prepared: PreparedRun,
    checked: CheckedRun,
    backend: Backend,
    evidence: PoseEvidence,
    log: RunLog,
) -> None:
    torque_constant_n_m_a, winding = motor_constants(prepared.robot)
    log.config(
        Header(
            prepared.run,
            checked.robot,
            prepared.world,
            backend=backend.name,
            plan=checked.plan,
            ground=prepared.ground,
            initial_pose=checked.initial_pose,
            torque_constant_n_m_a=torque_constant_n_m_a,
            winding=winding,
            pose_evidence=evidence,
            port_is_pseudo_terminal=(
                is_pseudo_terminal(checked.ports) if checked.rehearsed is None else True
            ),
        )
    )


def _use_second_body(
    prepared: PreparedRun,
    checked: CheckedRun,
    source: MotionSource,
    backend: Backend,
    pose: PoseProvider,
    workers: ExitStack,
) -> FrictionEstimator | None:
    """Let a walk use a second body; return the estimator of the friction under it."""
    if not isinstance(source, UsesFriction):
        return None
    from snakewalk.controller.run.external import second_body  # noqa: PLC0415  slow to import

    friction = second_body.second_body(prepared, source, backend, pose)
    if checked.port is not None and pose_evidence(prepared, backend).is_measured:
        now_s = None if backend.poses is None else backend.clock.now_s
        second_body.use_worker(prepared, source, now_s, workers)
    return friction


def _stop_requested(
    request: RunRequest, button: StopButton | None, observers: Observers
) -> Callable[[], str | None]:
    """Return the reason for torque off of an operator, the button or an observer."""
    return lambda: (
        request.stop_requested()
        or (None if button is None else button.pressed())
        or observers.stop_requested()
    )


def _recovery(request: RunRequest, backend: Backend, warn: Callable[[str, str], None]) -> Recovery:
    safety = request.prepared.run.safety
    return Recovery(
        backend.chain,
        policy=safety.recovery,
        patience_s=safety.recovery_time_s,
        overload_reboots=safety.overload_reboots,
        confirm=request.confirm,
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


def _live_course(
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


def _shadow(request: RunRequest, checked: CheckedRun, log: RunLog) -> ShadowPlugin:
    prepared = request.prepared
    start = checked.initial_pose if checked.port is None else None
    shadow_plugin: ShadowPlugin = _shadow_plugin()(
        prepared.run,
        prepared.robot,
        prepared.world,
        prepared.ground,
        start,
        log,
        request.on_event,
    )
    return shadow_plugin


def _shadow_plugin() -> Any:
    return require("observer", SHADOW, "--shadow").load()
