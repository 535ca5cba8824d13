"""Rollouts: predict the motion of a body for pieces of angle track before one is chosen.

The links' headings follow the track. In each step the rigid velocity balances Coulomb friction and
the slope's pull under every link (``rigid_motion``). This is the forecast of a complete plan,
compiled and for many pieces. The balance does not depend on speed; times matter only where a body
slides with inertia.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.links import half_lengths_m, link_weights
from snakewalk.controller.kinematics.retarget import Retarget
from snakewalk.controller.mechanics.ground_step import plane
from snakewalk.controller.mechanics.link_table import LANES, link_table
from snakewalk.controller.mechanics.rollout_kernel import (
    ALONG,
    COLUMNS,
    HALF,
    HEADING,
    OFF_PATH,
    PASSED,
    PATH_STEP_M,
    ROWS,
    STATE,
    TIME,
    WEIGHT,
    note_place,
    roll_pieces,
    write_result,
)

STEP_SEGMENTS = 4.0
"""Segments per step (ours): ends lie 1 cm along the path and 3 to 5 mm aside of those by steps of
0.5."""
_EXTENSION_M = 4.0


@dataclass(frozen=True, slots=True)
class PlanarPose:
    """Position of a body in plan."""

    centre_m: Floats
    """(2,) centre of the links."""
    offset_rad: float
    """Rotation from the track's angles to the world."""


@dataclass(frozen=True, slots=True)
class Drift:
    """Deviation of a body from the balance, per segment of pulse, in the frame of its mean line."""

    ahead_m: float = 0.0
    left_m: float = 0.0
    turn_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class TabulatedPath:
    """A path as a table: a point every ``PATH_STEP_M``, and straight beyond its end."""

    points_m: Floats
    """(n, 2) points of the path, m."""
    waypoint_m: Floats
    """(2,) the next one."""
    waypoint_at: float
    """Index of the point at which the path passes it; infinite where it leads to none."""

    @classmethod
    def of(
        cls, points_m: Floats, waypoint_m: Floats | None = None, waypoint_at: float = np.inf
    ) -> "TabulatedPath":
        """Extend points (n, 2), ``PATH_STEP_M`` apart, along the last direction."""
        step = points_m[-1] - points_m[-2]
        step = step / np.hypot(step[0], step[1]) * PATH_STEP_M
        count = np.arange(1, round(_EXTENSION_M / PATH_STEP_M) + 1)
        return cls(
            np.ascontiguousarray(np.vstack([points_m, points_m[-1] + count[:, None] * step])),
            np.zeros(2) if waypoint_m is None else waypoint_m,
            waypoint_at,
        )


@dataclass(frozen=True, slots=True)
class Rolled:
    """Results of C pieces; lengths in metres."""

    columns: Floats
    """(C, 10) place (2) of the centre and turn, and what the properties from there on say."""

    @property
    def centre_m(self) -> Floats:
        """(C, 2) final centre."""
        return self.columns[:, :2]

    @property
    def offset_rad(self) -> Floats:
        """(C,) final offset."""
        return self.columns[:, 2]

    @property
    def off_path_m(self) -> Floats:
        """(C,) root mean square distance of the centre from the path."""
        return self.columns[:, OFF_PATH]

    @property
    def heading_rad(self) -> Floats:
        """(C,) final mean heading less the path's direction a little ahead of the centre."""
        return self.columns[:, HEADING]

    @property
    def passed_m(self) -> Floats:
        """(C,) smallest distance of the centre from the next waypoint; 0 if it is not passed."""
        return self.columns[:, PASSED]

    @property
    def along_m(self) -> Floats:
        """(C,) progress on the path."""
        return self.columns[:, ALONG]

    @property
    def time_s(self) -> Floats:
        """(C,) duration at the joints' speed."""
        return self.columns[:, TIME]


class Followed:
    """Measures a body that follows a path otherwise, as rollouts are measured."""

    def __init__(self, path: TabulatedPath, path_at: int) -> None:
        """Start at the path's point with index ``path_at``."""
        self._path = path
        self._from = path_at
        self._steps = 0
        self._state = np.zeros(STATE)
        self._state[3], self._state[10] = path_at, np.inf

    def note(self, centre_m: Floats, dt_s: float) -> None:
        """Record the centre of mass (2,), ``dt_s`` after the last."""
        path, (x, y) = self._path, centre_m
        note_place(self._state, path.points_m, path.waypoint_m, float(x), float(y), dt_s)
        self._steps += 1

    def rolled(self, headings_rad: Floats, points_m: Floats) -> Rolled:
        """Return the result for final headings (L,) of links at points (L, 2) about the centre."""
        out = np.empty((1, COLUMNS))
        path = self._path
        body = float(headings_rad.mean()), float(points_m[0, 0]), float(points_m[0, 1])
        given = path.points_m, self._from, path.waypoint_at
        write_result(self._state, self._steps, *body, *given, out[0])
        return Rolled(out)


class Rollout:
    """Rolls out pieces of track for one robot on one ground; ``None`` is a level floor."""

    def __init__(
        self,
        robot: RobotConfig,
        friction: FrictionConfig,
        ground: HeightField | None,
        points: int,
    ) -> None:
        self._level = True
        self.change_ground(ground or HeightField(np.zeros((2, 2)), 1.0, 0.0, 0.0))
        retarget = Retarget(robot, points)
        self._table = link_table(robot.link_count, ROWS)
        groups = self._table.reshape(-1, ROWS)
        for row, values in ((HALF, half_lengths_m(robot)), (WEIGHT, link_weights(robot))):
            for k, value in enumerate(values):
                groups[k // LANES, row + k % LANES] = value
        self._links = self._table, retarget.edges, retarget.group_of_link
        self.segment_m = robot.length_m / points
        """Length of a segment."""
        self._speed_limit_rad_s = robot.joint_speed_limit_rad_s
        self.use_friction(friction)

    def use_friction(self, friction: FrictionConfig) -> None:
        """Use this friction; pieces that have begun keep the earlier one."""
        self._body = np.array([*friction.grip, self._speed_limit_rad_s])

    def change_ground(self, ground: HeightField) -> None:
        """Use another ground from now on."""
        self._field = np.ascontiguousarray(ground.z_m), ground.x0_m, ground.y0_m, ground.spacing_m
        self._level = bool(np.ptp(ground.z_m) == 0.0)

    def steepest(self, points_m: Floats) -> float:
        """Largest mean slope (tangent) of the ground over ten consecutive points of (n, 2)."""
        slopes = np.array([plane(*self._field, float(x), float(y))[1:] for x, y in points_m])
        count = min(10, len(slopes))
        rows = np.lib.stride_tricks.sliding_window_view(slopes, count, axis=0).mean(axis=-1)
        return float(np.hypot(*rows.T).max())

    def begin(
        self,
        samples_rad: Floats,
        head: float,
        start: PlanarPose,
        path: TabulatedPath,
        path_at: int,
        cruise_segments_s: float,
        drift: Drift,
        room_of: "RolloutTree | None" = None,
    ) -> "RolloutTree":
        """Return the common start of a decision's rollouts.

        Args:
            samples_rad: (M,) of the track, from at least a body length before ``head``.
            head: segments from the first sample to the head.
            start: pose of the body.
            path: path to measure by.
            path_at: index of its point nearest to the centre.
            cruise_segments_s: preferred speed of the pulse; the joints' speed limit may slow it.
            drift: added to the balance.
            room_of: an unused tree whose memory is reused.

        """
        given = (
            np.array([*start.centre_m, start.offset_rad]),
            *self._field,
            self._level,
            *self._links,
            self._body,
            path.points_m,
            path_at,
            np.array([*path.waypoint_m, path.waypoint_at]),
            cruise_segments_s,
            np.array([drift.ahead_m, drift.left_m, drift.turn_rad]),
        )
        return RolloutTree(samples_rad, head, len(self._table) // ROWS, given, room_of)


class RolloutTree:
    """Rollouts from one pose on one track; the common part of pieces is rolled out once."""

    def __init__(
        self,
        samples_rad: Floats,
        head: float,
        groups: int,
        given: tuple[Any, ...],
        room_of: "RolloutTree | None" = None,
    ) -> None:
        """``given``: arguments of ``roll_pieces``; for the others see ``Rollout.begin``."""
        self._samples = samples_rad
        self._head = head
        self._given = given
        self._count = 0
        if room_of is None:
            self._pieces = np.empty((0, 0))
            self._states = np.empty((0, 0, STATE))
            self._moving = np.empty((0, 0, 2 * groups * LANES))
        else:
            self._pieces = room_of._pieces
            self._states = room_of._states
            self._moving = room_of._moving

    def roll(self, pieces_rad: Floats, pulse: float | None = None) -> Rolled:
        """Roll a body out over each piece.

        Args:
            pieces_rad: (C, n) samples to append.
            pulse: segments that the head travels; None: to the end of the pieces.

        """
        count, length = pieces_rad.shape
        if pulse is None:
            pulse = len(self._samples) + length - self._head
        steps = max(1, round(pulse / STEP_SEGMENTS))
        before = self._make_room(count, length, steps)
        self._pieces[before : self._count] = pieces_rad
        out = np.empty((count, COLUMNS))
        arguments = (
            self._samples,
            self._pieces[: self._count],
            before,
            self._head,
            pulse / steps,
            *self._given,
            self._states,
            self._moving,
            out,
        )
        roll_pieces(*arguments)
        return Rolled(out)

    def _make_room(self, count: int, length: int, steps: int) -> int:
        """Allocate ``count`` more pieces; return the index of the first."""
        fits = (length, steps + 1) == (self._pieces.shape[1], self._states.shape[1])
        if not fits:
            self._count = 0
        before = self._count
        self._count += count
        if not fits or self._count > len(self._pieces):
            room = 2 * self._count
            pieces = np.empty((room, length))
            states = np.empty((room, steps + 1, STATE))
            moving = np.empty((room, steps + 1, self._moving.shape[2]))
            if before > 0:
                pieces[:before], states[:before] = self._pieces[:before], self._states[:before]
                moving[:before] = self._moving[:before]
            self._pieces = pieces
            self._states = states
            self._moving = moving
        return before
