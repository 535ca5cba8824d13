"""One run: link, motion, log and alarms joined in the loop; the same on metal and in simulation."""

import gc
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import count
from typing import Literal, NamedTuple, Protocol

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.controller.kinematics.links import BodyView, SpineLinks
from snakewalk.controller.kinematics.ramp import Ramp
from snakewalk.controller.motion.compliance import Compliance
from snakewalk.controller.motion.path_progress import OpenWaypoints, path_progress
from snakewalk.controller.motion.source import MotionSource, StartsAnywhere
from snakewalk.controller.runlog.record import MotorEnergy
from snakewalk.controller.runlog.topics import (
    BatteryTable,
    FrictionTable,
    PathTable,
    PoseSourceTable,
    PoseTable,
    WalkTable,
    WaypointTable,
)
from snakewalk.controller.runlog.writer import RunLog
from snakewalk.controller.runtime.cycle_row import log_cycle
from snakewalk.controller.runtime.derating import Derating
from snakewalk.controller.runtime.friction_estimator import FrictionEstimator
from snakewalk.controller.runtime.loop import Tick, ticks
from snakewalk.controller.runtime.pose_hold import PoseHealth, PoseHold
from snakewalk.controller.runtime.roll_monitor import RollMonitor
from snakewalk.controller.runtime.slip_monitor import SlipMonitor
from snakewalk.drivers.clock import Clock
from snakewalk.drivers.errors import SafetyTrippedError
from snakewalk.drivers.link import HoldingLink, LoadedLink, VettedLink
from snakewalk.drivers.types import BodyPose, JointCommand, JointState

RUNS_PER_COLLECTION = 8
"""Runs of a process between two complete garbage collections (ours): one needs up to 0.3 s."""
_ended_runs = count(1)


PoseSource = Callable[[JointState], BodyPose]
SETTLE_S = 0.3
"""Time between the ramp and the motion."""
BATTERY_S = 1.0
"""Time between two rows of the supply (ours)."""
_IGNORE_TRIP = suppress(SafetyTrippedError)


class Progress(NamedTuple):
    """State of a run after the command of a cycle has been sent."""

    time_s: float
    """Time since torque on."""
    speed_m_s: float
    """Forward speed of the body, smoothed."""
    reached: int
    """Number of waypoints reached."""
    along_m: float
    """Arc length on the path; NaN without a path."""
    done: bool
    """Whether the motion has come to its end and rests."""
    waypoints: int = 0
    """Number of waypoints in force."""


@contextmanager
def _no_long_collections() -> Iterator[None]:
    """Exclude present objects from Python's garbage collections.

    A collection of all imports and plans needs 0.1 s and more, and the bus watchdog trips at 0.2 s.
    Cycles of earlier runs then need an explicit collection; otherwise a process grows by 1 MB with
    each run.
    """
    if gc.get_freeze_count() > 0:  # by the caller
        yield
        return
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
        if next(_ended_runs) % RUNS_PER_COLLECTION == 0:
            gc.collect()


OnProgress = Callable[[Progress], None]
OnEvent = Callable[[str, str], None]
"""Receives the kind of an event, and a line of text."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a run ended."""

    reached: int
    missed: int
    duration_s: float
    """Time from torque on to torque off, as ``RunRecord.duration_s``."""
    alarms: int
    tripped: str | None
    waypoints: int
    """Number of waypoints, with those that were set on the way."""
    least_rate: float = 1.0
    """Lowest rate to which derating slowed the motion."""

    @property
    def complete(self) -> bool:
        """Whether every waypoint was reached without a trip."""
        return self.reached == self.waypoints and self.tripped is None


class CycleObserver(Protocol):
    """Follows a run from cycle to cycle; it steers nothing."""

    def begin(self, state: JointState) -> None:
        """Accept the state in which the run begins, before its first cycle.

        Torque is on: it returns well within the servos' bus watchdog (0.2 s).
        """
        ...

    def step(self, deadline_s: float, sent_s: float, sent_rad: Floats, state: JointState) -> None:
        """Process a cycle: its due time, and the readings.

        Safety passed the goals ``sent_rad`` (J,), and they went out at ``sent_s``.
        """
        ...


@dataclass(frozen=True, slots=True)
class Sensors:
    """Measurements of a run besides the joint states."""

    pose: PoseSource
    """Pose of the head for a joint state."""
    wire_busy_s: Callable[[], float] = lambda: float("nan")
    """Time that bytes have spent on the wire so far; NaN if it is not counted."""
    energy: Callable[[], MotorEnergy] = MotorEnergy
    """Energy that the motors have drawn and delivered so far."""
    pose_health: PoseHealth | None = None
    """Whether the pose can be trusted; None of a source that is always believed."""
    pose_sd_m: float = 0.0
    """Standard deviation of a measured position."""
    pose_is_measured: bool = True
    """Whether a source measures the pose; otherwise it is dead-reckoned."""


class DrivePlan(Protocol):
    """A checked run, as ``PreparedRun``."""

    @property
    def run(self) -> RunConfig:
        """Configuration of the run."""
        ...

    @property
    def robot(self) -> RobotConfig:
        """The body."""
        ...

    @property
    def gain(self) -> float:
        """Predicted advance per distance of the shape along the body."""
        ...


@dataclass(frozen=True, slots=True)
class Watchers:
    """Objects that follow a run and steer nothing."""

    observer: CycleObserver | None = None
    on_progress: OnProgress = lambda progress: None
    """Function that is called after each cycle."""
    on_event: OnEvent = lambda kind, text: None
    """Function that gets decisions of the motion."""


class Drive:
    """Runs a motion on a link; construct, then ``run()`` once."""

    def __init__(
        self,
        *,
        link: VettedLink,
        clock: Clock,
        sensors: Sensors,
        motion: MotionSource,
        log: RunLog,
        plan: DrivePlan,
        watchers: Watchers = Watchers(),
        friction: FrictionEstimator | None = None,
    ) -> None:
        self._observer = watchers.observer
        robot = plan.robot
        run = plan.run
        gain = plan.gain
        self._link = link
        self._clock = clock
        self._pose = sensors.pose
        health = sensors.pose_health
        self._pose_hold = None if health is None else PoseHold(health, self._on_pose)
        self._believes = not sensors.pose_is_measured
        self._motion, self._path = motion, path_progress(motion)
        self._open = motion if isinstance(motion, OpenWaypoints) else None
        self._waypoints_m = None if self._open is None else self._open.waypoints_m
        self._log = log
        self._robot = robot
        self._run = run
        self._gain = gain
        self._slip_monitor = SlipMonitor(
            robot.length_m, gain, run.safety.advance_fraction, sensors.pose_sd_m
        )
        self._roll_monitor = RollMonitor()
        self._friction_monitor = friction
        self._load = link.load if isinstance(link, LoadedLink) else None
        self._battery_s = -math.inf
        self._derating = Derating(run.safety, robot, self._on_derating, self._load)
        self._compliance = None if run.compliance is None else Compliance(run.compliance, robot)
        self._on_progress, self._on_event = watchers.on_progress, watchers.on_event
        self._wire_busy_s = sensors.wire_busy_s
        self._wire_s = sensors.wire_busy_s()
        self._energy = sensors.energy
        self._alarms = 0
        self._speed_m_s = 0.0
        self._last: BodyView | None = None
        self._displacement_m = 0.0
        self._start_s = self._end_s = 0.0

    @property
    def _waypoints(self) -> int:
        return len(self._run.waypoints_m if self._waypoints_m is None else self._waypoints_m)

    def run(self) -> Outcome:
        """Enable, ramp to the first shape, follow the path, settle, disable."""
        clock = self._clock
        log = self._log
        motion = self._motion
        path = self._path
        period_s = 1.0 / self._run.cycle_hz
        spine = SpineLinks.of(self._robot)
        with _no_long_collections(), self._link:
            state = self._link.enable()
            self._wire_s = self._wire_busy_s()
            if self._observer is not None:
                self._observer.begin(state)
            view = spine.in_world(self._pose(state), state.position_rad)
            if isinstance(motion, StartsAnywhere):
                motion.start_at(state.position_rad)
            ramp = Ramp(
                state.position_rad,
                path.begin(view),
                self._robot.joint_speed_limit_rad_s,
                self._robot.joint_acceleration_limit_rad_s2,
            )
            start_s = self._start_s = clock.now_s()
            log.event(start_s, "start", f"torque on; ramp of {ramp.duration_s:.1f} s to the shape")
            walk_s = start_s + ramp.duration_s + SETTLE_S
            self._end_s = walk_s + self._run.time_limit_s
            for tick in ticks(clock, period_s, lambda: self._end_s):
                try:
                    state = self._link.read()
                except SafetyTrippedError:
                    break
                pose = self._pose(state)
                view = spine.in_world(pose, state.position_rad)
                self._displacement_m = (
                    view.unbiased_advance_since_m(self._last) if self._last is not None else 0.0
                )
                self._find_friction(view)
                if self._run.waypoints_m:  # gaits may roll as they please
                    self._report_roll(view)
                if clock.now_s() < walk_s:
                    goal = ramp.at(clock.now_s() - start_s)
                else:
                    goal = self._next_goal(state, period_s, view)
                self._send(tick, state, pose, view, goal)
                if self._link.tripped or motion.done or self._pose_failure:
                    break
            tripped = self._link.tripped or self._pose_failure
            if tripped:
                log.event(clock.now_s(), "trip", tripped, "error")
            if self._link.tripped:
                self._hold_out(period_s)
                tripped = self._link.tripped
        stop_s = clock.now_s()
        log.event(stop_s, "stop", f"torque off; {self._end_text()}")
        return Outcome(
            path.reached,
            path.missed,
            stop_s - start_s,
            self._alarms,
            tripped,
            self._waypoints,
            self._derating.least,
        )

    def _end_text(self) -> str:
        reached = self._path.reached
        if not self._run.waypoints_m:
            is_done = self._motion.done
            return "the motion came to its end" if is_done else "the motion was cut off"
        if self._goal_is_unconfirmed:
            return (
                f"reached {reached} of {self._waypoints} by a pose that the joints did not confirm"
            )
        if self._believes:
            return f"believes it reached {reached} of {self._waypoints} (dead reckoning)"
        if reached == self._waypoints:
            return "every waypoint reached"
        return f"{reached} waypoints reached"

    @property
    def _goal_is_unconfirmed(self) -> bool:
        hold = self._pose_hold
        return hold is not None and not hold.health.row().get("is_confirmed", True)

    def _hold_out(self, period_s: float) -> None:
        """Go on reading while a trip holds the body, until its torque is off."""
        link = self._link
        log = self._log
        if not isinstance(link, HoldingLink):
            return
        for tick in ticks(self._clock, period_s, lambda: math.inf if link.is_holding else -1.0):
            with _IGNORE_TRIP:
                state = link.read()
                log.cycle(
                    tick.deadline_s,
                    state.position_rad,
                    state.position_rad,
                    state,
                    deadline_s=tick.deadline_s,
                    lateness_s=tick.lateness_s,
                    wire_busy_s=math.nan,
                    **self._energy()._asdict(),
                    yield_rad=None,
                    verdict="veto",
                    reason=link.tripped or "",
                    joints=[],
                )

    def _log_battery(self, time_s: float, state: JointState) -> None:
        load = self._load
        if load is None or time_s < self._battery_s + BATTERY_S:
            return
        self._battery_s = time_s
        known_v = state.voltage_v[np.isfinite(state.voltage_v)]
        self._log.add(
            BatteryTable,
            time_s,
            voltage_v=float(known_v.max()) if len(known_v) else math.nan,
            current_a=load.current_a,
            charge_ah=load.charge_ah,
            winding_c=load.winding_c(state),
        )

    def _find_friction(self, view: BodyView) -> None:
        sent = self._link.last_verdict
        monitor = self._friction_monitor
        if monitor is None or sent is None:
            return
        identified = monitor.update(view, sent.goal_rad)
        if identified is None:
            return
        now_s = self._clock.now_s()
        if identified.is_estimated:
            self._log.add(
                FrictionTable,
                now_s,
                along=identified.friction.along,
                across=identified.friction.across,
                along_95=identified.along_95,
                across_95=identified.across_95,
            )
        text = monitor.event_text()
        if text is not None:
            self._log.event(now_s, "friction", text)
            self._on_event("friction", text)

    def _report_roll(self, view: BodyView) -> None:
        text = self._roll_monitor.update(view, self._clock.now_s())
        if text is not None:
            self._log.event(self._clock.now_s(), "roll", text, "warning")
            self._on_event("roll", text)

    def _on_derating(self, kind: str, text: str) -> None:
        self._log.event(self._clock.now_s(), kind, text, "warning")
        self._on_event(kind, text)

    def _on_pose(self, level: Literal["info", "warning"], text: str) -> None:
        self._log.event(self._clock.now_s(), "pose", text, level)
        self._on_event("pose", text)

    @property
    def _pose_failure(self) -> str | None:
        return None if self._pose_hold is None else self._pose_hold.failure

    def _next_goal(self, state: JointState, period_s: float, view: BodyView) -> Floats:
        """Return the goals of this cycle, derated and compliant."""
        sent = self._link.last_verdict
        before_rad = state.position_rad if sent is None else sent.goal_rad
        rate = self._derating.update(state, before_rad, period_s)
        goal = self._steer_or_hold(period_s, rate, view)
        return goal if self._compliance is None else self._compliance.step(goal, state, period_s)

    def _steer_or_hold(self, period_s: float, rate: float, view: BodyView) -> Floats:
        """Return the goals of this cycle; without a pose the motion pauses."""
        hold = self._pose_hold
        if hold is not None:
            rate *= hold.rate(self._clock.now_s(), period_s)
            if hold.is_held:
                return self._motion.goal_rad()
        return self._steer(period_s * rate, view)

    def _steer(self, period_s: float, view: BodyView) -> Floats:
        path = self._path
        log = self._log
        now_s = self._clock.now_s()
        reached = path.reached
        missed = path.missed
        goal = self._motion.step(period_s, view)
        if self._open is not None and self._open.waypoints_m is not self._waypoints_m:
            self._waypoints_m = self._open.waypoints_m
            self._end_s = now_s + self._run.time_limit_s
            log.add(WaypointTable, now_s, waypoints_m=self._waypoints_m)
        if path.reached > reached:
            text = f"waypoint {path.reached} reached"
            if self._goal_is_unconfirmed:
                text += " by a pose that the joints have not confirmed"
            if self._believes:
                text = f"believes it reached waypoint {path.reached} (dead reckoning)"
            log.event(now_s, "waypoint", text)
        if path.replanned is not None:
            text = f"{path.replanned}: another path to waypoint {path.reached + 1}"
            if path.missed > missed:
                log.event(now_s, "missed", text, "warning")
            else:
                log.event(now_s, "replanned", text)
            log.add(PathTable, now_s, points_m=path.path_m(60))
        d = path.decision
        if d is not None:
            log.add(
                WalkTable,
                now_s,
                state=d.state,
                visited=d.visited,
                heading_error_rad=d.heading_error_rad,
                ramp_rad=d.ramp_rad,
                candidates=d.candidates,
                carrier_rad=d.carrier_rad,
            )
        if self._slip_monitor.update(path.pulse_m_s * period_s, self._displacement_m):
            self._alarms += 1
            share = self._slip_monitor.window.share if self._slip_monitor.window else float("nan")
            text = f"the body moves {share:.0%} of the predicted distance"
            monitor = self._friction_monitor
            text += f"; {monitor.alarm_text}" if monitor else ": is the ground too slippery?"
            log.event(now_s, "alarm", text, "warning")
        return goal

    def _send(
        self, tick: Tick, state: JointState, pose: BodyPose, view: BodyView, goal: Floats
    ) -> None:
        before_s, sent_s = self._wire_s, self._clock.now_s()
        # a veto latches: torque is off, the loop ends, and the log gets this cycle all the same
        with _IGNORE_TRIP:
            self._link.write(JointCommand(sent_s, goal))
        self._wire_s = self._wire_busy_s()
        sent_rad = log_cycle(
            self._log,
            self._link,
            state,
            goal,
            tick=tick,
            wire_busy_s=self._wire_s - before_s,
            energy=self._energy(),
            yield_rad=None if self._compliance is None else self._compliance.yield_rad,
        )
        self._log_battery(tick.deadline_s, state)
        if self._observer is not None and not self._link.tripped:
            self._observer.step(tick.deadline_s, sent_s, sent_rad, state)
        self._measure_speed()
        path = self._path
        pulse_m_s = path.pulse_m_s
        along_m = path.along_m
        self._log.add(
            PoseTable,
            tick.deadline_s,
            head_m=pose.head_in_world_m,
            rotation=pose.rotation,
            links_m=view.link_m,
            centre_m=view.centre_m,
            speed_m_s=self._speed_m_s,
            predicted_speed_m_s=self._gain * pulse_m_s,
            pulse_m_s=pulse_m_s,
            path_s_m=along_m,
            target=path.reached,
        )
        if self._pose_hold is not None:
            self._log.add(PoseSourceTable, tick.deadline_s, **self._pose_hold.health.row())
        self._last = view
        self._on_progress(
            Progress(
                tick.deadline_s - self._start_s,
                self._speed_m_s,
                path.reached,
                along_m,
                self._motion.done,
                self._waypoints,
            )
        )

    def _measure_speed(self) -> None:
        """Forward speed of the links along themselves, mean over the body, smoothed over 0.5 s."""
        hz = self._run.cycle_hz
        self._speed_m_s += min(2.0 / hz, 1.0) * (self._displacement_m * hz - self._speed_m_s)
