"""The head's pose from an external source: checked, dated, and continued by dead reckoning.

An unusable pose is named and left out; dead reckoning bridges it with growing uncertainty. After
``max_age_s`` without a usable pose, ``fault`` has the reason and the run holds.
"""

import math
from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.pose import PoseConfig
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.pose.agreement import Agreement
from snakewalk.controller.pose.motion_history import Moment, MotionHistory
from snakewalk.controller.pose.pose_filter import PoseFilter
from snakewalk.controller.pose.relocation import PlacedPose, Relocation
from snakewalk.controller.pose.sample import ArrivedPose, PoseFeed, PoseSample, UnusablePoseError
from snakewalk.controller.pose.sender_clock import MOST_DRIFT, SenderClock
from snakewalk.controller.pose.senders import Senders
from snakewalk.controller.pose.tracked_body import HeadMeasurement, TrackedBody
from snakewalk.drivers.attitude import heading_of
from snakewalk.drivers.types import BodyPose, JointState

LONGEST_S = 0.5
"""Longest delay that is looked for."""
STEP_S = 0.02
SLOW_S = 2.0
"""Slower differences are drift of dead reckoning (ours)."""
MEMORY_S = 8.0
"""Time for which a measurement counts (ours)."""
CONTRAST = 0.7
"""Share of the largest error below which the best shift is believed (ours)."""
FOLLOW_S = 2.0
"""Time constant with which the estimate follows (ours)."""


class LatencyEstimate:
    """Call ``add`` with each measured heading, in order of time."""

    def __init__(self, fixed_s: float | None = None) -> None:
        """Prepare; ``fixed_s`` is a delay that is known."""
        self._shifts_s = np.arange(0.0, LONGEST_S + 0.5 * STEP_S, STEP_S)
        self._mean = np.zeros(len(self._shifts_s))
        self._square = np.zeros(len(self._shifts_s))
        self._last: tuple[float, float] | None = None
        self._seconds = 0.0
        self._is_fixed = fixed_s is not None
        self.latency_s = fixed_s or 0.0
        """Estimated latency; 0 until the motion shows it."""
        self.is_known = self._is_fixed
        """Whether the delay is given, or the motion has shown it."""

    def add(self, stamped_s: float, heading_rad: float, history: MotionHistory) -> None:
        """Accept the heading of the head link, and when its message says that it was measured."""
        times = history.times_s
        if self._is_fixed or len(times) < 2 or stamped_s - LONGEST_S < times[0]:
            return
        last_s, last_rad = self._last or (stamped_s, heading_rad)
        step_s = stamped_s - last_s
        heading = last_rad + math.remainder(heading_rad - last_rad, math.tau)
        if not 0.0 <= step_s < 0.5 * SLOW_S:  # a gap: begin again
            self._last = None
            self._seconds = 0.0
            return
        moved = np.interp(stamped_s - self._shifts_s, times, history.headings_rad)
        off = heading - moved
        if self._last is None:
            self._mean[:], self._square[:] = off, 0.0
        self._last = (stamped_s, heading)
        self._mean += min(step_s / SLOW_S, 1.0) * (off - self._mean)
        self._seconds += step_s
        share = min(step_s / min(max(self._seconds, step_s), MEMORY_S), 1.0) if step_s else 0.0
        self._square += share * ((off - self._mean) ** 2 - self._square)
        self._choose(step_s)

    def _choose(self, step_s: float) -> None:
        best = int(self._square.argmin())
        if self._seconds < SLOW_S or best == len(self._shifts_s) - 1:
            return
        if self._square[best] > CONTRAST * self._square.max():
            return
        shift_s = self._shifts_s[best]
        if best > 0:
            a, b, c = self._square[best - 1 : best + 2]
            if a + c > 2.0 * b:
                shift_s += 0.5 * STEP_S * (a - c) / (a - 2.0 * b + c)
        follow = 1.0 if not self.is_known else min(step_s / FOLLOW_S, 1.0)
        self.is_known = True
        self.latency_s += follow * float(shift_s - self.latency_s)


START_SD_DEG = 5.0
"""Standard deviation of the heading in which people lay down a robot (ours)."""
UNKNOWN_S = 0.1
"""Standard deviation of a delay that is not known yet (ours)."""
REST_M = 0.003
"""Way of the head from which on a body moves: joints at rest are noisy (ours)."""
AGAIN_S = 10.0
"""Time after which the same fault is reported again (ours)."""
FROZEN = 10
FROZEN_M = 0.03
"""This many equal poses in a row are stale if the head has moved so far meanwhile (ours)."""
_MOST_KEPT_POSES = 1000
"""Measurements that are kept for ``take_measured``."""


class TimedHead(NamedTuple):
    """A measured pose of the head link that was used."""

    time_s: float
    """Time of the measurement on the clock of the run."""
    head: HeadMeasurement


class MeasuredHeads(NamedTuple):
    """The newest measurements."""

    now_s: float
    """Time of the newest joint state."""
    heads: list[TimedHead]
    """Poses that were used since the last call; none before the delay of the source is known."""
    has_slid: bool = False
    """Whether the body moved without its joints since the last call."""


class ExternalPose:
    """Call with each joint state, in order of time; returns the estimated pose."""

    def __init__(
        self,
        robot: RobotConfig,
        config: PoseConfig,
        feed: PoseFeed,
        reckoning: Callable[[JointState], BodyPose],
        on_event: Callable[[str], None] = lambda text: None,
        *,
        is_level: bool = True,
    ) -> None:
        """Prepare.

        Args:
            robot: whose head it is.
            config: its tracked body.
            feed: of the source.
            reckoning: dead reckoning from the joints; it begins at the start of the run.
            on_event: accepts a line for each fault and each correction.
            is_level: whether the ground is a floor.

        """
        self._config = config
        self._feed = feed
        self._reckoning = reckoning
        self._on_event = on_event
        self._body = TrackedBody(robot, config)
        self._history = MotionHistory(robot.joint_count)
        self._filter = PoseFilter(robot)
        self._is_level = is_level
        self._clock = SenderClock()
        self._check = Agreement(is_level=is_level)
        self._start: PlacedPose | None = None
        self._rests = True
        self._turns_rad: deque[float] = deque(maxlen=50)
        """Turns from the stated heading of the start, of the newest poses before the motion."""
        self._relocation = Relocation()
        self._has_slid = False
        self._latency = LatencyEstimate(config.latency_s)
        self._senders = Senders(config.sender)
        self._frame = config.frame
        self._early: list[ArrivedPose] = []
        self._equal: tuple[int, Floats, Floats] = (0, np.zeros(12), np.zeros(2))
        self._measured: deque[TimedHead] = deque(maxlen=_MOST_KEPT_POSES)
        self._now_s = self._used_s = -np.inf
        self._used: PoseSample | None = None
        self._reason = ""
        self._reported: dict[str, float] = {}
        self.counts = dict.fromkeys(("poses", "used", "rejected", "restarts", "relocations"), 0)
        """Poses that arrived, that were used, that were rejected; restarts of
        the sender; and slides after which poses were used again."""

    def store_poses(self, early: list[ArrivedPose]) -> None:
        """Accept poses that arrived before the first joint state."""
        self._early += early

    def __call__(self, state: JointState) -> BodyPose:
        """Advance to the state's time, and use the poses that have arrived."""
        odometry = self._reckoning(state)
        place = np.array([*odometry.head_in_world_m[:2], odometry.heading_rad])
        moment = Moment(state.time_s, place, np.array(state.position_rad))
        self._history.add(moment)
        self._filter.advance(self._history.at(state.time_s))
        self._now_s = state.time_s
        arrived = [*self._early, *self._feed.arrived(state.time_s)]
        self._early.clear()
        for arrival in arrived:
            self._accept(arrival)
        return self._filter.pose(state.time_s)

    def needs_caution(self) -> bool:
        """Whether the run should move slowly until the source has agreed with the joints."""
        return self._check.is_cautious

    @property
    def position_sd_m(self) -> float:
        """Standard deviation of the head's position, with errors that agreement cannot show.

        A wrong scale or a turned frame moves a body more that is far from its start. The start
        shows only the difference between the turns of frame and robot. Both have a normal prior;
        ``share`` of the difference is the mean turn of the frame. Half of a displacement is the
        frame's.
        """
        start = self._start
        if start is None:
            return self._filter.position_sd_m
        check = self._check
        away_m = math.hypot(*(self._filter.head_m - start.position_m)[:2])
        share = 1.0 / (1.0 + (START_SD_DEG / self._config.world_sd_deg) ** 2)
        turns_rad = (
            share * float(np.mean(self._turns_rad)),
            math.sqrt(share) * math.radians(START_SD_DEG),
            check.step_rad,
        )
        parts = (
            self._filter.position_sd_m,
            math.hypot(check.scale_sd, *turns_rad) * away_m,
            0.5 * math.hypot(*(start.position_m[:2] - start.odometry_m)),
            check.aside_m,
        )
        return math.hypot(*parts)

    def fault(self) -> str | None:
        """Return why the pose cannot be trusted any more; None while it can."""
        if self._check.fault is not None:
            return self._check.fault
        age_s = self._now_s - self._used_s
        if age_s <= self._config.max_age_s:
            return None
        return f"no usable pose for {age_s:.1f} s: {self._reason or 'nothing arrived'}"

    def take_measured(self) -> MeasuredHeads:
        """Return the measurements since the last call."""
        heads = list(self._measured)
        has_slid = self._has_slid
        self._measured.clear()
        self._has_slid = False
        return MeasuredHeads(self._now_s, heads, has_slid)

    def facts(self) -> dict[str, float | int]:
        """Return numbers for the log and for a command's answer."""
        counts = {f"poses_{key}": value for key, value in self.counts.items() if key != "poses"}
        drift = self._clock.drift
        # a bound is not a measurement
        known = {"sender_drift_ppm": round(1e6 * drift, 1)} if abs(drift) < MOST_DRIFT else {}
        return {
            "poses": self.counts["poses"],
            "poses_lost": self._senders.lost,
            **counts,
            "pose_latency_s": round(self._latency.latency_s, 3),
            **known,
        }

    def row(self) -> dict[str, Any]:
        """Return a row of the log."""
        used = self._used
        newest = self._senders.newest
        return {
            "age_s": self._now_s - self._used_s if np.isfinite(self._used_s) else float("nan"),
            "position_sd_m": self.position_sd_m,
            "heading_sd_rad": self._filter.heading_sd_rad,
            "latency_s": self._latency.latency_s,
            "sequence": -1 if used is None else used.sequence,
            "arrival_s": float("nan") if newest is None else newest.arrival_s,
            "fault": self.fault() or "",
            "is_confirmed": int(self._check.is_confirmed),
        }

    def _accept(self, arrived: ArrivedPose) -> None:
        """Judge a pose, and use it if nothing is wrong with it."""
        self.counts["poses"] += 1
        sample = arrived.sample
        placed = self._senders.place(arrived)
        if placed.order in ("late", "other"):
            self._reject(placed.text, placed.text, counts_as_reason=placed.order == "late")
            return
        if isinstance(sample, UnusablePoseError):
            self._reject("damaged", str(sample))
            return
        if placed.order == "restarted":
            self._restart(placed.text)
        self._frame = self._frame or sample.frame
        if sample.frame != self._frame:
            self._reject("frame", f"wrong frame: {sample.frame!r}, expected {self._frame!r}")
            return
        self._clock.add(sample.time_s, arrived.arrival_s)
        stamped_s = self._clock.local_s(sample.time_s, arrived.arrival_s)
        measured_s = stamped_s - self._latency.latency_s
        late_s = self._now_s - measured_s
        if self._filter.is_placed and late_s > self._config.max_age_s:
            self._reject("late", f"stale: poses arrive {late_s:.1f} s after they were measured")
            return
        self._use(sample, stamped_s, measured_s)

    def _use(self, sample: PoseSample, stamped_s: float, measured_s: float) -> None:
        then = self._history.at(measured_s)
        # while the delay is not known, a pose may be as old as this
        before = self._history.at(measured_s - UNKNOWN_S * (not self._latency.is_known))
        measured = self._body.head(sample, then.joint_rad, then.place[2] - before.place[2])
        self._latency.add(stamped_s, heading_of(measured.rotation), self._history)
        if self._is_frozen(sample, then):
            self._reject("frozen", "stale: the same pose is sent while the head moves")
            return
        self._check.add(measured, then, is_timed=self._latency.is_known)
        if self._check.fault is not None:
            self._reject("contradiction", self._check.fault)
            return
        off = self._filter.innovation(measured, then)
        placed = _placed_pose(measured, then, self._filter.turn_rad(measured, then))
        if not self._filter.is_placed or not off.is_jump:
            self._filter.update(measured, then, off)
        elif not self._body_has_relocated(placed):
            if self._check.has_agreed and self._relocation.is_followed:
                self._check.forget()  # a body that slides does not move as its joints do
            self._reject(
                "jump",
                f"jump by {off.distance_m:.2f} m and {np.degrees(off.angle_rad):.0f} degrees",
            )
            return
        else:
            self._filter.place_again(measured, then)
        if self._rests:
            self._compare_start(placed)
        self._relocation.use(placed)
        if self._latency.is_known:
            self._measured.append(TimedHead(measured_s, measured))
        self.counts["used"] += 1
        self._used = sample
        self._used_s = measured_s
        self._reason = ""

    def _compare_start(self, placed: PlacedPose) -> None:
        """Compare the poses before the first motion with the start of the run.

        The mean heading may be off by its standard deviation as well.

        Raises:
            InputError: the robot lies elsewhere, or points elsewhere.

        """
        config = self._config
        start = self._start = self._start or placed
        turns_rad = self._turns_rad
        self._rests = math.hypot(*(placed.odometry_m - start.odometry_m)) < REST_M
        if not self._rests:
            return
        turns_rad.append(placed.turn_rad)
        away_m = math.hypot(*(start.position_m[:2] - start.odometry_m))
        turned_deg = math.degrees(np.mean(turns_rad))
        most_deg = config.start_deg + math.degrees(placed.turn_sd_rad) / math.sqrt(len(turns_rad))
        if away_m <= config.start_m and abs(turned_deg) <= most_deg:
            return
        raise InputError(
            f"pose: the robot lies {away_m:.2f} m from the start of the run, turned by "
            f"{turned_deg:+.0f} degrees; put it there, or correct pose.world_m and pose.world_deg "
            f"(at most {config.start_m:g} m and {config.start_deg:g} degrees: pose.start_m, "
            "pose.start_deg)"
        )

    def _body_has_relocated(self, placed: PlacedPose) -> bool:
        """Whether the body truly moved without its joints, and now lies where the poses say."""
        relocated = self._relocation.add(placed)
        self._has_slid |= self._relocation.is_followed
        if relocated is None or not self._check.has_agreed:
            return False
        self.counts["relocations"] += 1
        self._check.forget()
        self._on_event(
            f"the robot slid or was moved by {relocated.distance_m:.2f} m; the poses followed it, "
            f"agree with the joints again, and are used after {relocated.seconds:.1f} s"
        )
        return True

    def _restart(self, why: str) -> None:
        self.counts["restarts"] += 1
        self._clock = SenderClock()
        self._check = Agreement(is_level=self._is_level)
        self._relocation = Relocation()
        self._on_event(f"restarted sender: {why}; its clock is estimated again")

    def _is_frozen(self, sample: PoseSample, then: Moment) -> bool:
        values = np.concatenate([sample.position_m, sample.rotation.ravel()])
        count, last, place = self._equal
        if not np.array_equal(values, last):
            self._equal = (1, values, then.place[:2].copy())
            return False
        self._equal = (count + 1, last, place)
        moved_m = math.hypot(*(then.place[:2] - place))
        return count + 1 >= FROZEN and moved_m > FROZEN_M

    def _reject(self, kind: str, text: str, *, counts_as_reason: bool = True) -> None:
        self.counts["rejected"] += 1
        if counts_as_reason:
            self._reason = text
        if self._now_s - self._reported.get(kind, -np.inf) >= AGAIN_S:
            self._reported[kind] = self._now_s
            self._on_event(f"{text}; the pose is left out")


def _placed_pose(measured: HeadMeasurement, then: Moment, turn_rad: float) -> PlacedPose:
    return PlacedPose(
        then.time_s,
        measured.position_m,
        then.place[:2],
        turn_rad,
        math.sqrt(measured.position_covariance.trace() / 3.0),
        math.sqrt(measured.rotation_covariance[2, 2]),
    )
