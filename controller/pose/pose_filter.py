"""Kalman filter for the head's pose: dead reckoning corrected by delayed measurements.

The motion of the joints since a measurement is added to it. The state is the head's position and
the attitude of the body, whose mean frame turns slowly while the head swings. Each has a
covariance; their coupling is neglected. Dead reckoning adds uncertainty with time and distance.
"""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.kinematics.links import SpineLinks
from snakewalk.controller.pose.motion_history import Moment
from snakewalk.controller.pose.tracked_body import HeadMeasurement
from snakewalk.drivers.attitude import about_up, heading_of, rotation_by, rotations
from snakewalk.drivers.types import BodyPose

SLIP_SHARE = 0.15
"""Standard deviation of dead-reckoned speed and rate, over their magnitude (ours)."""
SLIP_TIME_S = 0.5
"""Duration of such an error of speed and rate (ours)."""
DRIFT_M2_S = 2e-4
"""Growth of the variance of each coordinate at rest: 14 mm in a second (ours)."""
DRIFT_RAD2_S = 1e-3
"""Growth of the variance of the heading at rest: 1.8 degrees in a second (ours)."""
RISE_M2_S = 2e-4
"""Growth of the variance of the height, which dead reckoning does not know (ours)."""
TILT_RAD2_S = 5e-2
"""Growth of the variance of roll and pitch of the body: it may roll over within half a second
(ours)."""
JUMP_SD = 5.0
JUMP_M = 0.10
JUMP_RAD = 0.45
"""Jump of a measurement: more standard deviations and larger errors of position and heading than
these (ours). Roll and pitch are free: a body may roll over quickly."""
LEAST_LEVEL = 0.5
"""Least horizontal part of a direction that has a heading (ours)."""
SLIDE_M_S = 0.3
SLIDE_RAD_S = 0.5
SLIDE_S = 0.5
"""Largest speed and turn of a body that slides without its joints, and longest time of such a slide
(ours)."""


@dataclass(frozen=True, slots=True)
class Innovation:
    """Difference between a measurement and the prediction for its time."""

    position_m: Floats
    """(3,) difference of the positions, m."""
    turn_rad: Floats
    """(3,) rotation vector in the world."""
    is_jump: bool

    @property
    def distance_m(self) -> float:
        """Length of the difference in position."""
        return float(np.linalg.norm(self.position_m))

    @property
    def angle_rad(self) -> float:
        """Angle of the difference in attitude."""
        return float(np.linalg.norm(self.turn_rad))


class PoseFilter:
    """Call ``advance`` in each cycle and ``update`` with each measurement, in order of time."""

    def __init__(self, robot: RobotConfig) -> None:
        self._spine = SpineLinks.of(robot)
        self._last: Moment | None = None
        self._frames: deque[tuple[Moment, Floats]] = deque(maxlen=3)
        """Mean frames of the newest moments: each is needed several times in a cycle."""
        self.head_m = np.zeros(3)
        """(3,) of the head in the world, at the newest moment."""
        self._body = np.eye(3)
        self._shape = np.eye(3)
        """Mean frame of the links in the axes of the head link, for the newest joints."""
        self._seen_s = -np.inf
        """Time of the newest measurement, used or not: poses that arrive without a gap leave no
        time in which the body could have slid unseen."""
        self._gate = self._used_gate = np.zeros((3, 3))
        """Covariance of the position with which a jump is judged, and the same after the newest
        measurement that was used."""
        self._frame_rad = 0.0
        """Heading of the frame of dead reckoning in the world."""
        self.is_placed = False
        """Whether a measurement has placed the body."""
        self.position_covariance = np.zeros((3, 3))
        self.turn_covariance = np.zeros((3, 3))

    @property
    def position_sd_m(self) -> float:
        """Standard deviation of the horizontal position of the head."""
        return math.sqrt(0.5 * self.position_covariance[:2, :2].trace())

    @property
    def heading_sd_rad(self) -> float:
        """Standard deviation of the heading."""
        return math.sqrt(self.turn_covariance[2, 2])

    def pose(self, time_s: float) -> BodyPose:
        """Return the head's pose at the newest moment."""
        return BodyPose(time_s, self.head_m.copy(), self._body @ self._shape.T)

    def advance(self, moment: Moment) -> None:
        """Move the body as dead reckoning does since the last call, and grow the uncertainty."""
        before = self._last
        self._last = moment
        self._shape = self._mean_frame(moment)
        if before is None:
            self._align()
            return
        step_s = moment.time_s - before.time_s
        turn, displacement_m = self._motion(before, moment)
        self.head_m[:2] += displacement_m
        self._body = about_up(turn) @ self._body
        if step_s > 0.0:
            slip = 2.0 * SLIP_TIME_S * SLIP_SHARE**2 / step_s
            moved = slip * float(displacement_m @ displacement_m)
            turned = slip * turn * turn
            across = DRIFT_M2_S * step_s + moved
            rise = RISE_M2_S * step_s + 0.5 * moved
            tilt = TILT_RAD2_S * step_s
            growth = np.diag([across, across, rise])
            self.position_covariance += growth
            self._gate = self._gate + growth
            self.turn_covariance += np.diag([tilt, tilt, DRIFT_RAD2_S * step_s + turned])

    def innovation(self, measured: HeadMeasurement, then: Moment) -> Innovation:
        """Compare a measurement with the prediction for its moment."""
        assert self._last is not None
        turn, displacement_m = self._motion(then, self._last)
        head_m = self.head_m - np.append(displacement_m, 0.0)
        body = about_up(-turn) @ self._body
        measured_frame = measured.rotation @ self._mean_frame(then)
        off_m = measured.position_m - head_m
        off_rad = rotations().from_matrix(measured_frame @ body.T).as_rotvec()
        gap_s = min(max(then.time_s - self._seen_s, 0.0), SLIDE_S)
        self._seen_s = then.time_s
        far = float(
            np.sqrt(off_m @ np.linalg.solve(self._gate + measured.position_covariance, off_m))
        )
        variance = (self.turn_covariance + measured.rotation_covariance)[2, 2]
        turn_rad = abs(_turn_between(body[:, 0], measured_frame[:, 0]))
        is_jump = bool(
            (far > JUMP_SD and np.linalg.norm(off_m) > JUMP_M + SLIDE_M_S * gap_s)
            or (
                (turn_rad > JUMP_SD * np.sqrt(variance))
                and turn_rad > JUMP_RAD + SLIDE_RAD_S * gap_s
            )
        )
        if is_jump:
            self._gate = self._used_gate
        return Innovation(off_m, off_rad, is_jump)

    def turn_rad(self, measured: HeadMeasurement, then: Moment) -> float:
        """Return the turn from the frame of dead reckoning to the world by a measurement alone."""
        heading_rad = heading_of(measured.rotation @ self._mean_frame(then))
        return math.remainder(heading_rad - self._body_heading(then), math.tau)

    def place_again(self, measured: HeadMeasurement, then: Moment) -> None:
        """Place the body by a measurement, whatever its pose was before."""
        self.is_placed = False
        self.update(measured, then, self.innovation(measured, then))

    def update(self, measured: HeadMeasurement, then: Moment, off: Innovation) -> None:
        """Correct the pose by a measurement and its innovation; the first one places the body."""
        if self.is_placed:
            gain, self.position_covariance = _gain_and_covariance(
                self.position_covariance, measured.position_covariance
            )
            self.head_m += gain @ off.position_m
            gain, self.turn_covariance = _gain_and_covariance(
                self.turn_covariance, measured.rotation_covariance
            )
            self._body = rotation_by(gain @ off.turn_rad) @ self._body
        else:
            self.is_placed = True
            self.position_covariance = measured.position_covariance.copy()
            self.turn_covariance = measured.rotation_covariance.copy()
            self.head_m += off.position_m
            self._body = rotation_by(off.turn_rad) @ self._body
        self._gate = self._used_gate = self.position_covariance.copy()
        self._align()

    def _motion(self, before: Moment, after: Moment) -> tuple[float, Floats]:
        """Return how dead reckoning turned the body and moved the head, in the world."""
        turn = self._body_heading(after) - self._body_heading(before)
        way_m = about_up(self._frame_rad)[:2, :2] @ (after.place[:2] - before.place[:2])
        return math.remainder(turn, math.tau), way_m

    def _align(self) -> None:
        """Turn the frame of dead reckoning so that the body has its heading."""
        assert self._last is not None
        turn_rad = heading_of(self._body) - self._body_heading(self._last)
        self._frame_rad = math.remainder(turn_rad, math.tau)

    def _body_heading(self, moment: Moment) -> float:
        return float(moment.place[2] + heading_of(self._mean_frame(moment)))

    def _mean_frame(self, moment: Moment) -> Floats:
        """Return the mean axes (3, 3) of the links, in those of the head link."""
        for moment_of_frame, frame in self._frames:
            if moment_of_frame is moment:
                return frame
        frame = self._mean_axes(moment.joint_rad)
        self._frames.append((moment, frame))
        return frame

    def _mean_axes(self, joint_rad: Floats) -> Floats:
        at_origin = BodyPose(0.0, np.zeros(3), np.eye(3))
        rotation = self._spine.in_world(at_origin, joint_rad).rotation
        forward = rotation[:, :, 0].mean(axis=0)
        up = rotation[:, :, 2].mean(axis=0)
        forward = forward / max(float(np.linalg.norm(forward)), 1e-9)
        left = np.cross(up, forward)
        left = left / max(float(np.linalg.norm(left)), 1e-9)
        return np.stack([forward, left, np.cross(forward, left)], axis=1)


def _turn_between(first: Floats, two: Floats) -> float:
    """Return the angle between two directions in the horizontal plane; 0 of a steep one."""
    if min(np.hypot(*first[:2]), np.hypot(*two[:2])) < LEAST_LEVEL:
        return 0.0
    return float(np.angle(complex(*two[:2]) / complex(*first[:2])))


def _gain_and_covariance(prior: Floats, noise: Floats) -> tuple[Floats, Floats]:
    """Return the gain (3, 3) of a measurement, and the covariance after it."""
    gain = prior @ np.linalg.inv(prior + noise)
    remainder = np.eye(3) - gain
    after = remainder @ prior
    return gain, 0.5 * (after + after.T)
