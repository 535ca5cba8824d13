"""The head's pose from the tags of one picture and the measured joint angles.

The joints combine the tags on all links into one rigid set of corners in the head's axes. A single
square has two similar poses (IPPE). Each places the whole chain; the one that fits the other tags
is chosen. With one tag, the earlier pose decides, or else the more upright attitude. All corners
then give the pose by least squares, with its covariance.
[IPPE] T. Collins, A. Bartoli, Infinitesimal plane-based pose estimation, IJCV 109, 2014.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.config.tags import TagMount
from snakewalk.controller.cameras.tags.tag_detector import Corners
from snakewalk.controller.cameras.tags.tag_view import TagView, square
from snakewalk.controller.kinematics.links import SpineLinks
from snakewalk.controller.pose.sample import turned
from snakewalk.drivers.attitude import rotation_by
from snakewalk.drivers.types import BodyPose

_TRIED_TAGS = 3
"""Tags whose poses are tried, the largest in the picture first (ours)."""
_MISFIT = 6.0
"""A tag farther off than this many standard deviations is left out (ours)."""
_AMBIGUOUS = 2.0
"""Poses whose errors differ by a smaller factor are ambiguous (ours)."""
_ROUNDS = 3
_ROBUST_ROUNDS = 10
_LEAST_DEPTH_M = 0.02
"""Least distance ahead of the lens (ours)."""
_JOINT_SD_M, _JOINT_SD_RAD = 1e-3, 5e-3
"""Error of the chain that all corners share: backlash and mounting (ours)."""


@dataclass(frozen=True, slots=True)
class HeadFit:
    """Pose of the head link in the world, from one picture."""

    position_m: Floats
    """(3,) position of the head link in the world, m."""
    rotation: Floats
    """(3, 3) axes of the head link in the world, in columns."""
    covariance: Floats
    """(6, 6) of position (m) and of rotations about the world's axes (rad)."""
    error_px: float
    """Root of the mean square distance of the corners from their places."""
    tags: tuple[int, ...]
    """Numbers of the tags that were used."""


@dataclass(frozen=True, slots=True)
class _Sighting:
    """Corners of tags in the head's axes and in the picture."""

    tags: tuple[int, ...]
    points_m: Floats
    """(4 k, 3) corners of the tags in the head's axes, m."""
    pixels: Floats
    """(4 k, 2) without distortion."""

    def only(self, is_kept_tag: Bools) -> "_Sighting":
        tags = tuple(tag for tag, is_kept in zip(self.tags, is_kept_tag, strict=True) if is_kept)
        corners = np.repeat(is_kept_tag, 4)
        return _Sighting(tags, self.points_m[corners], self.pixels[corners])


class TagFit:
    """Finds the head from the tags on a robot's links."""

    def __init__(self, robot: RobotConfig, view: TagView) -> None:
        assert robot.tags is not None
        self._spine = SpineLinks.of(robot)
        self._tags = robot.tags
        self._mounts = {tag.id: tag for tag in robot.tags.on}
        self.view = view

    def fit(
        self, corners_px: Corners, joint_rad: Floats, before: Floats | None = None
    ) -> HeadFit | None:
        """Return the head's pose; None if no tag of the robot is visible, or none fits.

        ``joint_rad`` (J,) are those at the picture's time; ``before`` (3, 3) is an earlier attitude
        of the head, if known.
        """
        sighting = self._sighting(corners_px, joint_rad)
        while sighting.tags:
            start = self._start(sighting, before)
            if start is None:
                return None
            robust = self._refined_pose(sighting, *start, weighted=True)
            good = self._per_tag_px(sighting, *robust) <= _MISFIT * self._tags.noise_px
            if good.all():
                pose = self._refined_pose(sighting, *robust)
                error_px = float(np.sqrt((self._corner_errors_px(sighting, *pose) ** 2).mean()))
                return self._result(sighting, *pose, error_px)
            sighting = sighting.only(good)
        return None

    def of_link(self, corners_px: Corners) -> tuple[int, HeadFit] | None:
        """Return a link and its pose from its largest tag only; None without a tag.

        A tag has two poses; the more upright one is returned.
        """
        for number in self._sighting(corners_px, np.zeros(len(self._spine.half_m) - 1)).tags:
            mount = self._mounts[number]
            points = tag_corners(mount, self._tags.side_m)
            pixels = self.view.lens.undistorted(corners_px[number])
            sighting = _Sighting((number,), points, pixels)
            start = self._start(sighting, None)
            if start is not None:
                return mount.link, self._result(sighting, *start, 0.0)
        return None

    def _sighting(self, corners_px: Corners, joint_rad: Floats) -> _Sighting:
        body = self._spine.in_world(BodyPose(0.0, np.zeros(3), np.eye(3)), joint_rad)
        numbers = [number for number in corners_px if number in self._mounts]
        area = {
            number: abs(cv2.contourArea(corners_px[number].astype(np.float32)))
            for number in numbers
        }
        numbers.sort(key=lambda number: -area[number])
        if not numbers:
            return _Sighting((), np.zeros((0, 3)), np.zeros((0, 2)))
        points = [
            body.link_m[tag.link] + tag_corners(tag, self._tags.side_m) @ body.rotation[tag.link].T
            for tag in (self._mounts[number] for number in numbers)
        ]
        pixels = self.view.lens.undistorted(np.concatenate([corners_px[n] for n in numbers]))
        return _Sighting(tuple(numbers), np.concatenate(points), pixels)

    def _start(self, sighting: _Sighting, before: Floats | None) -> tuple[Floats, Floats] | None:
        """Return the best pose from single tags, in the camera's axes."""
        starts = []
        for turn, place_m in self._candidates(sighting):
            off = self._corner_errors_px(sighting, turn, place_m)
            starts.append((float(np.sqrt((off**2).mean())), turn, place_m))
        if not starts:
            return None
        best = min(error for error, _, _ in starts)
        close = [
            start for start in starts if start[0] <= _AMBIGUOUS * max(best, self._tags.noise_px)
        ]  # each explains the picture
        if len(close) == 1:
            return close[0][1:]
        in_world = [self.view.rotation @ turn for _, turn, _ in close]
        # the trace grows as the angle between two attitudes falls
        likely = [
            turn[2, 2] if before is None else float(np.trace(before.T @ turn)) for turn in in_world
        ]
        return close[int(np.argmax(likely))][1:]

    def _candidates(self, sighting: _Sighting) -> Iterator[tuple[Floats, Floats]]:
        flat = square(self._tags.side_m)
        for k in range(min(_TRIED_TAGS, len(sighting.tags))):
            rows = slice(4 * k, 4 * k + 4)
            count, turns, shifts, _ = cv2.solvePnPGeneric(
                flat,
                sighting.pixels[rows],
                self.view.lens.matrix,
                None,
                flags=cv2.SOLVEPNP_IPPE_SQUARE,
            )
            axes, middle = _axes_of(sighting.points_m[rows])
            for turn, shift in zip(turns[:count], shifts[:count], strict=True):
                rotation = cv2.Rodrigues(turn)[0] @ axes.T
                yield rotation, shift.ravel() - rotation @ middle

    def _refined_pose(
        self, sighting: _Sighting, turn: Floats, place_m: Floats, *, weighted: bool = False
    ) -> tuple[Floats, Floats]:
        """Fit all corners; ``weighted``: outlying tags count less (Cauchy's weights)."""
        scale_px = _MISFIT * self._tags.noise_px
        for _ in range(_ROBUST_ROUNDS if weighted else _ROUNDS):
            off = self._corner_errors_px(sighting, turn, place_m).ravel()
            slope = self._slope(sighting, turn, place_m)
            if weighted:
                share = 1.0 / (1.0 + (self._per_tag_px(sighting, turn, place_m) / scale_px) ** 2)
                root = np.sqrt(np.repeat(share, 8))
                off = root * off
                slope = root[:, None] * slope
            step = np.asarray(np.linalg.lstsq(slope, -off, rcond=None)[0], dtype=float)
            place_m = place_m + step[:3]
            turn = rotation_by(step[3:]) @ turn
        return turn, place_m

    def _per_tag_px(self, sighting: _Sighting, turn: Floats, place_m: Floats) -> Floats:
        off = self._corner_errors_px(sighting, turn, place_m).reshape(len(sighting.tags), 8)
        return np.asarray(np.sqrt((off**2).mean(axis=1)))

    def _corner_errors_px(self, sighting: _Sighting, turn: Floats, place_m: Floats) -> Floats:
        """Errors (4 k, 2) of the corners."""
        places = sighting.points_m @ turn.T + place_m
        ahead = np.maximum(places[:, 2:], _LEAST_DEPTH_M)
        shown = places[:, :2] / ahead @ self.view.lens.matrix[:2, :2].T
        return shown + self.view.lens.matrix[:2, 2] - sighting.pixels

    def _slope(self, sighting: _Sighting, turn: Floats, place_m: Floats) -> Floats:
        """Derivatives (8 k, 6) by position and rotation, in the camera's axes."""
        arm = sighting.points_m @ turn.T
        x, y, z = (arm + place_m).T
        z = np.maximum(z, _LEAST_DEPTH_M)
        zero = np.zeros_like(x)
        shown = np.stack(
            [np.stack([1.0 / z, zero, -x / z**2], 1), np.stack([zero, 1.0 / z, -y / z**2], 1)], 1
        )
        by_place = self.view.lens.matrix[:2, :2] @ shown
        a, b, c = arm.T
        by_turn = np.stack(
            [np.stack([zero, c, -b], 1), np.stack([-c, zero, a], 1), np.stack([b, -a, zero], 1)], 1
        )
        return np.concatenate([by_place, by_place @ by_turn], axis=2).reshape(-1, 6)

    def _result(
        self, sighting: _Sighting, turn: Floats, place_m: Floats, error_px: float
    ) -> HeadFit:
        slope = self._slope(sighting, turn, place_m)
        noise_px = max(self._tags.noise_px, error_px)
        inner = noise_px**2 * np.linalg.inv(slope.T @ slope)
        axes = self.view.rotation
        both = np.zeros((6, 6))
        both[:3, :3] = both[3:, 3:] = axes
        shared = np.diag([_JOINT_SD_M**2] * 3 + [_JOINT_SD_RAD**2] * 3)
        covariance = both @ inner @ both.T + shared
        return HeadFit(
            self.view.place_m + axes @ place_m,
            axes @ turn,
            0.5 * (covariance + covariance.T),
            error_px,
            sighting.tags,
        )


def tag_corners(tag: TagMount, side_m: float) -> Floats:
    """Corners (4, 3) of a tag in the axes of its link."""
    return np.array(tag.offset_m) + square(side_m) @ turned(tag.offset_deg).T


def _axes_of(corners: Sequence[Floats] | Floats) -> tuple[Floats, Floats]:
    """Axes (3, 3) and centre (3,) of a square from its corners (4, 3)."""
    upper_left, upper_right, lower_right, lower_left = corners
    right = upper_right - upper_left
    top = upper_left - lower_left
    right = right / np.linalg.norm(right)
    top = top / np.linalg.norm(top)
    middle = 0.25 * (upper_left + upper_right + lower_right + lower_left)
    return np.column_stack([right, top, np.cross(right, top)]), middle
