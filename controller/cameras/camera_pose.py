"""The head's pose from an overhead camera, continued by dead reckoning.

A frame shows the body at an earlier time; dead reckoning adds the motion since then. So the pose is
given in a drifting frame, whose place in the world each image updates.
"""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.cameras.ground_rest import GroundRest, heights_of
from snakewalk.controller.cameras.markers.floor_markers import Bump
from snakewalk.controller.cameras.overhead_camera import LineDetection
from snakewalk.controller.cameras.pose_fit import PoseFit, fit_both_ends
from snakewalk.controller.cameras.pose_tracking import BodyPrior, TrackedPose
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.pose.dead_reckoning import DeadReckoning
from snakewalk.controller.track.frame_status import FrameStatus
from snakewalk.drivers.attitude import about_up
from snakewalk.drivers.types import BodyPose, JointState

MISFIT = 0.5
"""Largest error of a fit that is used, in lengths of a link."""
DECISIVE = 0.25
"""Share of the worse fit's error: a fit this much better decides alone which end is the head."""
GAP_S = 0.2
"""A longer time without a frame that can be used is reported."""
HISTORY_S = 2.0
"""Largest age of a late frame."""


PriorAt = Callable[[float], BodyPrior | None]
"""Function that returns the believed place of the body at a time (s); None where it was lost."""


class Camera(Protocol):
    """Source of frames, as detections."""

    def first(self) -> LineDetection:
        """Capture a frame and wait for its detection; the body is at rest."""
        ...

    def arrived(self, now_s: float, prior_at: PriorAt) -> Sequence[LineDetection | TrackedPose]:
        """Return the detections since the last call, in order of time.

        With a prior the body is searched only near it.
        """
        ...


@dataclass(frozen=True, slots=True)
class _Moment:
    """The estimate at one joint read, in the drifting frame."""

    time_s: float
    place: Floats
    """(3,) x, y, heading of the head link."""
    joint_rad: Floats


class CameraPose:
    """Callable with each joint state, in order of time; returns the estimated pose."""

    def __init__(
        self,
        robot: RobotConfig,
        camera: Camera,
        reckoning: DeadReckoning,
        on_event: Callable[[str], None] = lambda text: None,
        ground: HeightField | None = None,
    ) -> None:
        self._rest = GroundRest(robot, heights_of(ground))
        self._robot = robot
        self._camera = camera
        self._reckoning = reckoning
        self._on_event = on_event
        self._history: deque[_Moment] = deque()
        self._offset = np.zeros(3)  # of the drifting frame in the world
        self._fixed_s: float | None = None
        self._reason = ""
        self._gap = False
        self._bump: Bump | None = None
        self.frames = 0
        """Number of frames that arrived so far."""
        self.used = 0
        """Number of frames that were used so far."""
        self.covariance: Floats | None = None
        """(3, 3) of x, y (m) and heading (rad) of the head in the last frame that was used."""
        self._sigma_m: list[float] = []

    def facts(self) -> dict[str, float | int]:
        """Return the numbers of frames, and the median uncertainty of the head's place."""
        facts: dict[str, float | int] = {"frames": self.frames, "frames_used": self.used}
        if self._sigma_m:
            facts["head_sigma_median_m"] = round(float(np.median(self._sigma_m)), 4)
        return facts

    def row(self) -> dict[str, Any]:
        """Return a row of the log about the newest frame that was used; it has its own time."""
        now_s = self._history[-1].time_s
        no_value = float("nan")
        fixed_s = no_value if self._fixed_s is None else self._fixed_s
        variance = np.full((3, 3), no_value) if self.covariance is None else self.covariance
        return {
            "age_s": now_s - fixed_s,
            "position_sd_m": float(np.sqrt(0.5 * variance[:2, :2].trace())),
            "heading_sd_rad": float(np.sqrt(variance[2, 2])),
            "latency_s": 0.0,
            "sequence": self.used - 1,
            "arrival_s": no_value,
            "fault": "",
            "is_confirmed": 1,
        }

    def __call__(self, state: JointState) -> BodyPose:
        """Advance to the state's time, and process arrived frames."""
        odometry = self._reckoning(state)
        place = np.array([*odometry.head_in_world_m[:2], odometry.heading_rad])
        self._history.append(_Moment(state.time_s, place, np.array(state.position_rad)))
        while self._history[0].time_s < state.time_s - HISTORY_S:
            self._history.popleft()
        if self._fixed_s is None:
            self._fixed_s = state.time_s
            self._update(self._camera.first())
        for detection in self._camera.arrived(state.time_s, self._prior_at):
            if isinstance(detection, TrackedPose):
                self._follow(detection)
            else:
                self._update(detection)
        self._report_gap(state.time_s)
        return self._rest.pose(
            _in_world(self._offset, place), self._history[-1].joint_rad, state.time_s
        )

    def _prior_at(self, time_s: float) -> BodyPrior | None:
        if self._gap:
            return None
        then = self._moment_at(time_s)
        believed = self._rest.pose(_in_world(self._offset, then.place), then.joint_rad, time_s)
        body = body_in_world(self._robot, believed, then.joint_rad)
        return BodyPrior(body.link_m[:, :2], body.forward[:, :2])

    def _follow(self, tracked: TrackedPose) -> None:
        self.frames += 1
        if tracked.bump != self._bump:
            self._bump = tracked.bump
            self._on_event(str(tracked.bump))
        if tracked.fault:
            self._reason = tracked.fault
            return
        self._place(tracked, tracked.time_s)

    def _place(self, fitted: PoseFit | TrackedPose, time_s: float) -> None:
        """Move the drifting frame to the head's place in a frame."""
        head_m = fitted.head_m
        heading_rad = fitted.heading_rad
        self.covariance = fitted.covariance
        self._sigma_m.append(float(np.sqrt(np.linalg.eigvalsh(fitted.covariance[:2, :2])[-1])))
        then = self._moment_at(time_s)
        self.used += 1
        self._fixed_s = time_s
        turn = heading_rad - then.place[2]
        self._offset = np.append(head_m - _turned_point(then.place[:2], turn), turn)

    def _update(self, detection: LineDetection) -> None:
        self.frames += 1
        if detection.status is not FrameStatus.GOOD:
            self._reason = str(detection.status)
            return
        then = self._moment_at(detection.time_s)
        fit = self._head_end(fit_both_ends(self._robot, detection.line_m, then.joint_rad), then)
        if fit.error_m > MISFIT * self._robot.mean_link_length_m:
            self._reason = f"the image lies {fit.error_m * 1e3:.0f} mm off the measured joints"
            return
        self._place(fit, detection.time_s)

    def _head_end(self, fits: tuple[PoseFit, PoseFit], then: _Moment) -> PoseFit:
        better, worse = sorted(fits, key=lambda fit: fit.error_m)
        is_separate = worse.error_m > MISFIT * self._robot.mean_link_length_m
        if is_separate and better.error_m < DECISIVE * worse.error_m:
            return better
        believed = _in_world(self._offset, then.place)
        return max(fits, key=lambda fit: np.cos(fit.heading_rad - believed[2]))

    def _moment_at(self, time_s: float) -> _Moment:
        if len(self._history) == 1:
            return self._history[0]
        times = np.array([moment.time_s for moment in self._history])
        k = int(np.clip(np.searchsorted(times, time_s), 1, len(times) - 1))
        earlier_head = self._history[k - 1]
        two = self._history[k]
        part = float(
            np.clip((time_s - earlier_head.time_s) / (two.time_s - earlier_head.time_s), 0.0, 1.0)
        )
        change = two.place - earlier_head.place
        change[2] = np.angle(np.exp(1j * change[2]))
        joints = earlier_head.joint_rad + part * (two.joint_rad - earlier_head.joint_rad)
        return _Moment(time_s, earlier_head.place + part * change, joints)

    def _report_gap(self, now_s: float) -> None:
        blind_s = now_s - (self._fixed_s or 0.0)
        if self._gap != (blind_s > GAP_S):
            self._gap = not self._gap
            self._on_event(
                f"the camera has lost the body: {self._reason or 'no frame came'}; dead reckoning"
                if self._gap
                else "the camera has the body again"
            )


def _turned_point(point: Floats, by_rad: float) -> Floats:
    return about_up(by_rad)[:2, :2] @ point[:2]


def _in_world(frame: Floats, place: Floats) -> Floats:
    """(3,) world place of a place in the drifting frame."""
    return np.append(frame[:2] + _turned_point(place[:2], frame[2]), frame[2] + place[2])
