"""One run: link, pilot, log and alarms joined in the loop; the same for metal and simulation."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.controller.kinematics.links import BodyView, body_in_world
from snakewalk.controller.runlog.writer import RunLog
from snakewalk.controller.runtime.derating import Derating
from snakewalk.controller.runtime.guide import Guide
from snakewalk.controller.runtime.loop import Tick, ticks
from snakewalk.controller.runtime.ramp import Ramp
from snakewalk.controller.runtime.slip_monitor import AdvanceWatch
from snakewalk.drivers.clock import Clock
from snakewalk.drivers.errors import SafetyTrippedError
from snakewalk.drivers.link import VettedLink
from snakewalk.drivers.types import BodyPose, JointCommand, JointState

PoseSource = Callable[[JointState], BodyPose]
_SETTLE_S = 0.3
_LATCHED = suppress(SafetyTrippedError)


class Watcher(Protocol):
    """Told of every cycle: a progress bar, a film recorder."""

    def cycle(self, time_s: float, pilot: Guide, speed_m_s: float) -> None:
        """After the command of a cycle has been sent."""
        ...


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a run ended."""

    reached: int
    missed: int
    duration_s: float
    alarms: int
    tripped: str | None
    least_rate: float = 1.0
    """Lowest rate to which derating slowed the motion."""

    def complete(self, waypoints: int) -> bool:
        """Whether every waypoint was reached without a trip."""
        return self.reached == waypoints and self.tripped is None


class Drive:
    """Runs a pilot on a link; construct, then ``run()`` once."""

    def __init__(
        self,
        *,
        link: VettedLink,
        clock: Clock,
        pose: PoseSource,
        pilot: Guide,
        log: RunLog,
        robot: RobotConfig,
        run: RunConfig,
        gain: float,
        watchers: tuple[Watcher, ...] = (),
        wire_busy_s: Callable[[], float] = lambda: float("nan"),
        say: Callable[[str], None] = lambda text: None,
    ) -> None:
        self._link, self._clock, self._pose = link, clock, pose
        self._pilot, self._log, self._robot, self._run = pilot, log, robot, run
        self._gain = gain
        self._watch = AdvanceWatch(robot.length_m, gain, run.safety.advance_fraction)
        self._derating = Derating(run.safety)
        self._watchers, self._say = watchers, say
        self._wire_busy_s = wire_busy_s
        self._wire_s = wire_busy_s()
        self._alarms = 0
        self._speed_m_s = 0.0
        self._last: BodyView | None = None
        self._way_m = 0.0

    def run(self) -> Outcome:
        """Enable, ramp to the first shape, follow the path, settle, disable."""
        clock, log, pilot = self._clock, self._log, self._pilot
        period_s = 1.0 / self._run.cycle_hz
        with self._link:
            found = self._link.enable()
            self._wire_s = self._wire_busy_s()
            view = body_in_world(self._robot, self._pose(found), found.position_rad)
            ramp = Ramp(
                found.position_rad,
                pilot.lay(pilot.first_goal_rad(), period_s, view),
                self._robot.joint_speed_limit_rad_s,
                self._robot.joint_acceleration_limit_rad_s2,
            )
            start_s = clock.now_s()
            log.event(start_s, "start", f"torque on; ramp of {ramp.duration_s:.1f} s to the shape")
            walk_s = start_s + ramp.duration_s + _SETTLE_S
            end_s = walk_s + self._run.time_limit_s
            for tick in ticks(clock, period_s, end_s):
                try:
                    state = self._link.read()
                except SafetyTrippedError:
                    break
                pose = self._pose(state)
                view = body_in_world(self._robot, pose, state.position_rad)
                self._way_m = view.advance_since_m(self._last) if self._last is not None else 0.0
                if clock.now_s() < walk_s:
                    goal = ramp.at(clock.now_s() - start_s)
                else:
                    goal = self._steer(period_s * self._rate(state, period_s), view)
                self._send(tick, state, pose, view, goal)
                if self._link.tripped or pilot.at_rest:
                    break
            tripped = self._link.tripped
            if tripped:
                log.event(clock.now_s(), "trip", tripped, "error")
        if not self._run.waypoints_m:
            end = "the motion came to its end" if pilot.done else "the motion was cut off"
        else:
            end = "every waypoint reached" if pilot.done else f"{pilot.reached} waypoints reached"
        log.event(clock.now_s(), "stop", f"torque off; {end}")
        duration_s = clock.now_s() - start_s
        least = self._derating.least
        return Outcome(pilot.reached, pilot.missed, duration_s, self._alarms, tripped, least)

    def _rate(self, state: JointState, period_s: float) -> float:
        """How fast the motion may run, so that no servo trips."""
        rate = self._derating.update(state, period_s)
        for text in self._derating.news():
            self._log.event(self._clock.now_s(), "derating", text, "warning")
            self._say(text)
        return rate

    def _steer(self, period_s: float, view: BodyView) -> Floats:
        pilot, log, now_s = self._pilot, self._log, self._clock.now_s()
        reached, missed = pilot.reached, pilot.missed
        goal = pilot.step(period_s, view)
        if pilot.reached > reached:
            log.event(now_s, "waypoint", f"waypoint {pilot.reached} reached")
        if pilot.missed > missed and pilot.path is not None:
            log.event(now_s, "missed", f"waypoint {pilot.reached + 1} passed by; back", "warning")
            log.path_laid(now_s, pilot.path.position(np.linspace(0, pilot.path.length_m, 60)))
        if pilot.decision is not None:
            d = pilot.decision
            log.walk(
                now_s,
                state=d.state,
                visited=d.visited,
                heading_error_rad=d.heading_error_rad,
                ramp_rad=d.ramp_rad,
                candidates=d.candidates,
            )
        if self._watch.update(pilot.pulse_m_s * period_s, self._way_m):
            self._alarms += 1
            share = self._watch.window.share if self._watch.window else float("nan")
            text = f"the body makes {share:.0%} of its predicted way: is the ground too slippery?"
            log.event(now_s, "alarm", text, "warning")
        return goal

    def _send(
        self, tick: Tick, state: JointState, pose: BodyPose, view: BodyView, goal: Floats
    ) -> None:
        before_s = self._wire_s
        # a veto latches: torque is off, the loop ends, and the log gets this cycle all the same
        with _LATCHED:
            self._link.write(JointCommand(self._clock.now_s(), goal))
        verdict = self._link.last_verdict
        self._wire_s = self._wire_busy_s()
        clamped = () if verdict is None else verdict.clamped.nonzero()[0].tolist()
        self._log.cycle(
            tick.deadline_s,
            goal,
            state.position_rad if verdict is None else verdict.goal_rad,
            state,
            deadline_s=tick.deadline_s,
            lateness_s=tick.lateness_s,
            wire_busy_s=self._wire_s - before_s,
            verdict="veto" if self._link.tripped else "clamp" if clamped else "pass",
            reason=self._link.tripped or "",
            joints=clamped,
        )
        self._measure_speed()
        pilot = self._pilot
        self._log.pose(
            tick.deadline_s,
            pose.head_in_world_m,
            pose.rotation,
            links_m=view.link_m,
            centre_m=view.centre_m,
            speed_m_s=self._speed_m_s,
            predicted_speed_m_s=self._gain * pilot.pulse_m_s,
            pulse_m_s=pilot.pulse_m_s,
            path_s_m=pilot.along_m,
            target=pilot.reached,
        )
        self._last = view
        for watcher in self._watchers:
            watcher.cycle(tick.deadline_s, pilot, self._speed_m_s)

    def _measure_speed(self) -> None:
        """Forward speed of the links along themselves, mean over the body, smoothed over 0.5 s."""
        hz = self._run.cycle_hz
        self._speed_m_s += min(2.0 / hz, 1.0) * (self._way_m * hz - self._speed_m_s)
